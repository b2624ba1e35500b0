//! Logs as Parquet files: the columns of the CSV as doubles (or strings), metadata as key-value pairs.
//!
//! Read are flat columns of doubles, floats, integers and strings, uncompressed or Snappy; nulls in a
//! known column are refused like empty cells. Written are required doubles with Snappy, one row group,
//! without statistics: equal logs give equal bytes. Left out: nested columns, other compressions.

use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Arc;

use parquet::basic::{Compression, ConvertedType, Encoding, Repetition, Type as Physical};
use parquet::column::reader::{ColumnReader, ColumnReaderImpl};
use parquet::data_type::{ByteArray, ByteArrayType, DataType, DoubleType};
use parquet::errors::ParquetError;
use parquet::file::metadata::{KeyValue, ParquetMetaData};
use parquet::file::properties::{EnabledStatistics, WriterProperties};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{Type, TypePtr};

use super::import::columns::Columns;
use super::log::{Cells, Column, Log};
use super::number;
use super::whole_file::WholeFile;
use crate::input_error::InputError;

/// Room made for a column before its first page is read: what a file says of its rows may be wrong.
const FIRST_ROWS: usize = 1 << 16;

/// Metadata that other writers add about themselves.
const NOT_OURS: [&str; 2] = ["ARROW:schema", "pandas"];

/// Reads a log; checks its form, not what time does. `meant` says which columns are signals.
///
/// The library panics on some damaged files; what is damaged is refused here, whoever notices it.
pub(super) fn read(path: &Path, meant: &Columns) -> Result<Log, InputError> {
    // Nothing outlives the closure that a panic could have left half done.
    catch_unwind(AssertUnwindSafe(|| read_unguarded(path, meant))).unwrap_or_else(|_| {
        Err(InputError::in_file(path, "is damaged: the Parquet library could not go on")
            .allowed("a whole Parquet file"))
    })
}

fn read_unguarded(path: &Path, meant: &Columns) -> Result<Log, InputError> {
    let source = path.display().to_string();
    let refuse = |e: &ParquetError| {
        InputError::in_file(path, format!("cannot be read as Parquet: {e}"))
            .allowed("flat columns of numbers, uncompressed or Snappy")
    };
    let file = std::fs::read(path).map_err(|e| InputError::io(path, "read", &e))?;
    let length = file.len() as u64;
    if length == 0 {
        return Err(InputError::in_file(path, "is empty").allowed("a Parquet file"));
    }
    let reader = SerializedFileReader::new(WholeFile(file.into())).map_err(|e| refuse(&e))?;
    check_places(reader.metadata(), length).map_err(|e| e.file(source.as_str()))?;
    let metadata = reader.metadata().file_metadata();
    let mut log = Log { source, ..Log::default() };
    for KeyValue { key, value } in metadata.key_value_metadata().into_iter().flatten() {
        if !NOT_OURS.contains(&key.as_str()) {
            log.metadata.push((key.clone(), value.clone().unwrap_or_default()));
        }
    }
    for (at, descriptor) in metadata.schema_descr().columns().iter().enumerate() {
        let name = descriptor.path().string();
        if descriptor.max_rep_level() > 0 || descriptor.max_def_level() > 1 {
            return Err(InputError::in_file(path, "nested column").key(name).allowed("flat columns"));
        }
        if log.columns.iter().any(|column| column.name == name) {
            return Err(InputError::in_file(path, "this column is there twice")
                .key(name)
                .allowed("each name once"));
        }
        let mut values = Values::default();
        for group in 0..reader.num_row_groups() {
            let group = reader.get_row_group(group).map_err(|e| refuse(&e))?;
            let rows = usize::try_from(group.metadata().num_rows()).unwrap_or(0);
            let column = group.get_column_reader(at).map_err(|e| refuse(&e))?;
            values.append(column, rows).map_err(|e| refuse(&e))?;
        }
        let cells = values
            .into_cells(&name, meant.signal_of(&name).is_some())
            .map_err(|e| e.file(log.source.as_str()))?;
        log.columns.push(Column { name, cells });
    }
    if log.is_empty() {
        return Err(InputError::in_file(path, "has no samples").allowed("one row a sample"));
    }
    Ok(log)
}

/// Every column chunk lies within the file's `bytes`: the library asserts it, or does not look.
fn check_places(metadata: &ParquetMetaData, bytes: u64) -> Result<(), InputError> {
    for (nth, group) in metadata.row_groups().iter().enumerate() {
        for chunk in group.columns() {
            let begin = chunk.dictionary_page_offset().unwrap_or_else(|| chunk.data_page_offset());
            let length = chunk.compressed_size();
            let end = begin.checked_add(length).and_then(|end| u64::try_from(end).ok());
            if begin < 0 || length < 0 || end.is_none_or(|end| end > bytes) {
                let problem = format!("damaged: row group {nth} says {length} bytes at {begin}");
                return Err(InputError::new(problem)
                    .key(chunk.column_path().string())
                    .allowed(format!("within the file's {bytes} bytes")));
            }
        }
    }
    Ok(())
}

/// Cells of a column as they come: numbers, or strings; `None` is a null.
#[derive(Default)]
struct Values {
    numbers: Vec<Option<f64>>,
    texts: Vec<Option<String>>,
    unreadable: Option<&'static str>,
}

impl Values {
    fn append(&mut self, column: ColumnReader, rows: usize) -> Result<(), ParquetError> {
        let numbers = &mut self.numbers;
        match column {
            ColumnReader::DoubleColumnReader(r) => read_column(r, rows, |x| numbers.push(x.copied())),
            ColumnReader::FloatColumnReader(r) => {
                read_column(r, rows, |x| numbers.push(x.map(|x| f64::from(*x))))
            }
            ColumnReader::Int32ColumnReader(r) => {
                read_column(r, rows, |x| numbers.push(x.map(|x| f64::from(*x))))
            }
            ColumnReader::Int64ColumnReader(r) => {
                read_column(r, rows, |x| numbers.push(x.map(|x| *x as f64)))
            }
            ColumnReader::BoolColumnReader(r) => {
                read_column(r, rows, |x| numbers.push(x.map(|x| f64::from(u8::from(*x)))))
            }
            ColumnReader::ByteArrayColumnReader(r) => {
                let text = |x: &ByteArray| String::from_utf8_lossy(x.data()).into_owned();
                read_column(r, rows, |x| self.texts.push(x.map(text)))
            }
            ColumnReader::Int96ColumnReader(_) => {
                self.unreadable = Some("time stamps of 96 bits");
                Ok(())
            }
            ColumnReader::FixedLenByteArrayColumnReader(_) => {
                self.unreadable = Some("byte arrays of fixed length");
                Ok(())
            }
        }
    }

    fn into_cells(self, name: &str, known: bool) -> Result<Cells, InputError> {
        let refuse = |problem: String| Err(InputError::new(problem).key(name).allowed("finite numbers"));
        if let Some(what) = self.unreadable {
            return refuse(format!("a column of {what}"));
        }
        if !self.texts.is_empty() {
            let texts = self.texts.into_iter().map(Option::unwrap_or_default).collect();
            return if known { refuse("a column of strings".into()) } else { Ok(Cells::Text(texts)) };
        }
        match self.numbers.iter().position(|x| !x.is_some_and(f64::is_finite)) {
            None => Ok(Cells::Numbers(self.numbers.into_iter().flatten().collect())),
            Some(at) if known => {
                let what = self.numbers[at].map_or("null".into(), number::text);
                refuse(format!("{what} in row {}", at + 1))
            }
            Some(_) => {
                let text = |x: Option<f64>| x.map(number::text).unwrap_or_default();
                Ok(Cells::Text(self.numbers.into_iter().map(text).collect()))
            }
        }
    }
}

/// Hands every cell of a column chunk on; `None` for a null.
fn read_column<T: DataType>(
    mut reader: ColumnReaderImpl<T>,
    rows: usize,
    mut take: impl FnMut(Option<&T::T>),
) -> Result<(), ParquetError> {
    let room = rows.min(FIRST_ROWS);
    let (mut values, mut levels) = (Vec::with_capacity(room), Vec::with_capacity(room));
    let mut done = 0;
    while done < rows {
        let (records, ..) = reader.read_records(rows - done, Some(&mut levels), None, &mut values)?;
        if records == 0 {
            return Err(ParquetError::EOF(format!("{done} of {rows} rows")));
        }
        done += records;
    }
    if levels.is_empty() {
        values.iter().for_each(|value| take(Some(value)));
    } else {
        let mut present = values.iter();
        levels.iter().for_each(|level| take(if *level > 0 { present.next() } else { None }));
    }
    Ok(())
}

/// The log as the bytes of a Parquet file.
pub(super) fn write(log: &Log) -> Result<Vec<u8>, InputError> {
    encode(log).map_err(|e| InputError::new(format!("cannot be written as Parquet: {e}")))
}

fn encode(log: &Log) -> Result<Vec<u8>, ParquetError> {
    let fields = log.columns.iter().map(field).collect::<Result<Vec<TypePtr>, _>>()?;
    let schema = Arc::new(Type::group_type_builder("log").with_fields(fields).build()?);
    let metadata =
        log.metadata.iter().map(|(key, value)| KeyValue::new(key.clone(), value.clone())).collect();
    let properties = WriterProperties::builder()
        .set_created_by("rig".into())
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false)
        .set_encoding(Encoding::PLAIN)
        .set_statistics_enabled(EnabledStatistics::None)
        .set_key_value_metadata(Some(metadata))
        .build();
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    for column in &log.columns {
        let Some(mut chunk) = group.next_column()? else { break };
        match &column.cells {
            Cells::Numbers(values) => chunk.typed::<DoubleType>().write_batch(values, None, None)?,
            Cells::Text(values) => {
                let values: Vec<ByteArray> =
                    values.iter().map(|text| ByteArray::from(text.as_str())).collect();
                chunk.typed::<ByteArrayType>().write_batch(&values, None, None)?
            }
        };
        chunk.close()?;
    }
    group.close()?;
    writer.into_inner()
}

fn field(column: &Column) -> Result<TypePtr, ParquetError> {
    let builder = match column.cells {
        Cells::Numbers(_) => Type::primitive_type_builder(&column.name, Physical::DOUBLE),
        Cells::Text(_) => Type::primitive_type_builder(&column.name, Physical::BYTE_ARRAY)
            .with_converted_type(ConvertedType::UTF8),
    };
    builder.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_written_reads_back_the_same_and_equal_logs_give_equal_bytes() {
        let mut log = Log { metadata: vec![("rig".into(), "A".into())], ..Log::default() };
        log.set_numbers("time_s", (0..5000).map(|i| f64::from(i) * 1e-4).collect());
        log.set_numbers("friction_torque_nm", (0..5000).map(|i| f64::from(i).sin()).collect());
        let notes = (0..5000).map(|i| format!("n{i}")).collect();
        log.columns.push(Column { name: "note".into(), cells: Cells::Text(notes) });
        let bytes = write(&log).unwrap();
        assert_eq!(bytes, write(&log).unwrap());

        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("l.parquet");
        std::fs::write(&path, &bytes).unwrap();
        let again = Log::read(&path).unwrap();
        assert_eq!((&again.columns, &again.metadata), (&log.columns, &log.metadata));
    }

    #[test]
    fn what_is_no_parquet_file_is_refused_by_name() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("l.parquet");
        for (bytes, problem) in [(&b""[..], "is empty"), (b"time_s\n0\n1\n", "cannot be read as Parquet")] {
            std::fs::write(&path, bytes).unwrap();
            let error = Log::read(&path).unwrap_err().to_string();
            assert!(error.starts_with(&format!("{}: {problem}", path.display())), "{error}");
        }
    }
}
