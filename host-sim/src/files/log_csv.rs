//! Logs as CSV text.
//!
//! Read line by line; a line with quotes in it goes through the `csv` crate, every other one is split
//! at its commas. Written with the shortest decimals that read back as the same numbers, so that equal
//! logs give equal bytes and nothing is lost. Left out: line breaks inside quotes.

use super::log::{Cells, Column, Log};
use super::number;
use super::signal::Signal;
use crate::input_error::InputError;

/// Parses a log; checks its form (header, width, numbers), not what time does.
pub(super) fn parse(source: &str, bytes: &[u8]) -> Result<Log, InputError> {
    let refuse = |problem: String| InputError::new(problem).file(source);
    let text = std::str::from_utf8(bytes).map_err(|e| {
        let line = bytes[..e.valid_up_to()].iter().filter(|b| **b == b'\n').count() as u64 + 1;
        refuse("is not text".into()).line(line).allowed("UTF-8 text, comma separated")
    })?;
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);

    let mut log = Log { source: source.into(), ..Log::default() };
    let mut lines = text.lines().zip(1_u64..);
    let mut metadata = Vec::new();
    let header = lines.by_ref().find(|(line, _)| !is_aside(line, &mut metadata));
    let Some((header, header_line)) = header else {
        return Err(
            refuse("is empty".into()).allowed("a header line with column names, then one line a sample")
        );
    };
    let names = cells(header).map_err(|e| refuse(e).line(header_line))?;
    check_names(&names).map_err(|e| e.file(source).line(header_line))?;

    let width = names.len();
    let known: Vec<bool> = names.iter().map(|name| Signal::named(name).is_some()).collect();
    let rows = text.len() / header.len().max(16);
    let mut columns: Vec<Vec<f64>> = (0..width).map(|_| Vec::with_capacity(rows)).collect();
    let mut is_text = vec![false; width];
    let mut samples = 0;
    let mut expected_line = 0;
    for (line, at) in lines {
        if is_aside(line, &mut metadata) {
            continue;
        }
        if at != expected_line {
            log.line_marks.push((samples, at));
        }
        expected_line = at + 1;
        let mut count = 0;
        let mut take = |cell: &str| {
            let column = count;
            count += 1;
            if column >= width {
                return Ok(());
            }
            let value = match cell.parse::<f64>() {
                Ok(value) if value.is_finite() => value,
                _ if !known[column] => {
                    is_text[column] = true;
                    0.0
                }
                parsed => return Err(bad_number(parsed.is_ok(), cell).key(names[column].as_str())),
            };
            columns[column].push(value);
            Ok(())
        };
        let located = |e: InputError| e.file(source).line(at);
        if line.contains('"') {
            for cell in cells(line).map_err(|e| refuse(e).line(at))? {
                take(&cell).map_err(located)?;
            }
        } else {
            for cell in line.split(',') {
                take(cell.trim()).map_err(located)?;
            }
        }
        if count != width {
            return Err(located(InputError::new(format!("has {count} cells, the header has {width}")))
                .allowed(format!("{width} cells, one for each column of the header")));
        }
        samples += 1;
    }
    if samples == 0 {
        return Err(
            refuse("has a header but no samples".into()).allowed("one line a sample after the header")
        );
    }
    log.metadata = metadata;
    let mut columns: Vec<Cells> = columns.into_iter().map(Cells::Numbers).collect();
    if is_text.contains(&true) {
        reread_text(text, &is_text, &mut columns).map_err(|e| e.file(source))?;
    }
    log.columns = names.into_iter().zip(columns).map(|(name, cells)| Column { name, cells }).collect();
    Ok(log)
}

/// A blank line, or a `#` line, which is kept as metadata.
fn is_aside(line: &str, metadata: &mut Vec<(String, String)>) -> bool {
    if let Some(comment) = line.strip_prefix('#') {
        let (key, value) = comment.split_once(':').unwrap_or(("", comment));
        metadata.push((key.trim().into(), value.trim().into()));
        return true;
    }
    line.trim().is_empty()
}

/// The cells of a line.
fn cells(line: &str) -> Result<Vec<String>, String> {
    let mut reader =
        csv::ReaderBuilder::new().has_headers(false).trim(csv::Trim::All).from_reader(line.as_bytes());
    match reader.records().next() {
        Some(Ok(record)) => Ok(record.iter().map(str::to_string).collect()),
        Some(Err(error)) => Err(error.to_string()),
        None => Ok(Vec::new()),
    }
}

fn check_names(names: &[String]) -> Result<(), InputError> {
    if let [only] = names
        && (only.contains(';') || only.contains('\t'))
    {
        return Err(InputError::new("the header is one cell")
            .value(only)
            .allowed("names separated by commas"));
    }
    if names.iter().all(|name| name.parse::<f64>().is_ok()) {
        return Err(InputError::new("the header line is missing, the first line holds numbers")
            .allowed("a first line with column names such as time_s,m2_speed_rad_s"));
    }
    for (at, name) in names.iter().enumerate() {
        if name.is_empty() {
            return Err(InputError::new(format!("column {} has no name", at + 1)));
        }
        if names[..at].contains(name) {
            return Err(InputError::new("this column is there twice").key(name).allowed("each name once"));
        }
    }
    Ok(())
}

fn bad_number(parsed: bool, cell: &str) -> InputError {
    let what = match (cell.is_empty(), parsed) {
        (true, _) => "the cell is empty",
        (false, true) => "not a finite number",
        (false, false) => "not a number",
    };
    InputError::new(what).value(cell).allowed("a finite number with '.' as decimal mark")
}

/// Second pass for unknown columns that hold text.
fn reread_text(text: &str, is_text: &[bool], columns: &mut [Cells]) -> Result<(), InputError> {
    let mut kept: Vec<Vec<String>> = vec![Vec::new(); is_text.len()];
    let mut aside = Vec::new();
    for line in text.lines().filter(|line| !is_aside(line, &mut aside)).skip(1) {
        for (column, cell) in cells(line).map_err(InputError::new)?.into_iter().enumerate() {
            if is_text[column] {
                kept[column].push(cell);
            }
        }
    }
    for (column, kept) in kept.into_iter().enumerate().filter(|(column, _)| is_text[*column]) {
        columns[column] = Cells::Text(kept);
    }
    Ok(())
}

/// The log as CSV: metadata, header, samples.
pub(super) fn write(log: &Log) -> String {
    let mut text = String::with_capacity(log.len() * log.columns.len() * 12 + 256);
    for (key, value) in &log.metadata {
        text.push_str("# ");
        if !key.is_empty() {
            text.push_str(key);
            text.push_str(": ");
        }
        text.push_str(value);
        text.push('\n');
    }
    for (at, column) in log.columns.iter().enumerate() {
        separate(&mut text, at);
        push_text(&mut text, &column.name);
    }
    text.push('\n');
    for sample in 0..log.len() {
        for (at, column) in log.columns.iter().enumerate() {
            separate(&mut text, at);
            match &column.cells {
                Cells::Numbers(values) => number::push(&mut text, values[sample]),
                Cells::Text(values) => push_text(&mut text, &values[sample]),
            }
        }
        text.push('\n');
    }
    text
}

fn separate(text: &mut String, at: usize) {
    if at > 0 {
        text.push(',');
    }
}

fn push_text(text: &mut String, cell: &str) {
    if cell.contains([',', '"', '#', '\n', '\r']) || cell.trim() != cell {
        text.push('"');
        text.push_str(&cell.replace('"', "\"\"").replace(['\n', '\r'], " "));
        text.push('"');
    } else {
        text.push_str(cell);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(text: &str) -> String {
        parse("l.csv", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn metadata_may_stand_anywhere_and_unknown_columns_are_kept() {
        let text = "# rig: A\r\ntime_s, note ,extra\r\n0,a,1\r\n# run: 2: b\r\n\r\n0.1,\"b, c\",2\r\n";
        let log = parse("l.csv", text.as_bytes()).unwrap();
        assert_eq!(log.metadata, [("rig".into(), "A".into()), ("run".into(), "2: b".into())]);
        assert_eq!(log.numbers("extra"), Some(&[1.0, 2.0][..]));
        assert_eq!(log.columns[1].cells, Cells::Text(vec!["a".into(), "b, c".into()]));
        assert_eq!((log.line_of(0), log.line_of(1)), (3, 6));
        let again = parse("l.csv", log.to_csv().as_bytes()).unwrap();
        assert_eq!(again.columns, log.columns);
        assert_eq!(again.metadata, log.metadata);
        assert_eq!(again.to_csv(), log.to_csv());
    }

    #[test]
    fn bad_cells_are_named_with_line_and_column() {
        assert_eq!(
            refused("time_s,normal_force_n\n0,1\n0.1,NaN\n"),
            "l.csv:3: normal_force_n = NaN: not a finite number; allowed: a finite number with '.' as decimal mark"
        );
        assert!(
            refused("time_s,normal_force_n\n0,\n")
                .starts_with("l.csv:2: normal_force_n = : the cell is empty")
        );
        assert!(refused("time_s,normal_force_n\n0,x1\n").contains("normal_force_n = x1: not a number"));
        assert!(refused("time_s,normal_force_n\n0,-inf\n").contains("not a finite number"));
    }

    #[test]
    fn a_bad_form_is_named() {
        assert!(refused("").starts_with("l.csv: is empty"));
        assert!(refused("# only: this\n\n").starts_with("l.csv: is empty"));
        assert!(refused("time_s,a\n").starts_with("l.csv: has a header but no samples"));
        assert!(refused("time_s,a,a\n0,1,2\n").starts_with("l.csv:1: a: this column is there twice"));
        assert!(refused("time_s,a\n0,1,2\n").starts_with("l.csv:2: has 3 cells, the header has 2"));
        assert!(refused("time_s,a\n0\n").starts_with("l.csv:2: has 1 cells, the header has 2"));
        assert!(refused("time_s;a\n0;1\n").contains("names separated by commas"));
        assert!(refused("0,1\n0,1\n").contains("the header line is missing"));
        assert!(
            parse("l.csv", b"time_s\n\xff\n").unwrap_err().to_string().starts_with("l.csv:2: is not text")
        );
    }

    #[test]
    fn a_byte_order_mark_is_no_part_of_the_first_name() {
        assert!(parse("l.csv", "\u{feff}time_s\n0\n".as_bytes()).unwrap().numbers("time_s").is_some());
    }
}
