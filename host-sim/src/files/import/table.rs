//! The table in a text: separator, decimal mark, header, row of units.
//!
//! Where the numbers begin is found first: three lines in a row of the same number of cells, all of them numbers or
//! times. The line before is the header, or a row of units with the header before it. What stands above is left out
//! and said so.

use super::columns::{Columns, without_unit};
use super::{ASSUMED, units};
use crate::files::log::{Cells, Column, Log};
use crate::files::signal::Signal;
use crate::input_error::InputError;

const SEPARATORS: [(char, &str); 4] = [(';', "semicolons"), ('\t', "tabs"), (',', "commas"), ('|', "bars")];
/// Lines that are looked at to find where the numbers begin.
const LOOK: usize = 400;

/// Whether the text is in the tool's own form: names separated by commas, then numbers. Anything doubtful is left to
/// [`parse`], which looks closer.
pub(super) fn is_plain(text: &str) -> bool {
    let mut lines = text.lines().filter(|line| !line.starts_with('#') && !line.trim().is_empty());
    let (Some(header), second) = (lines.next(), lines.next()) else { return true };
    if header.contains([';', '\t', '|']) {
        return false;
    }
    let known = header.split(',').any(|name| {
        let name = name.trim().trim_matches('"');
        Signal::named(name).is_some() || Signal::meant_by(name).is_some()
    });
    let units = second.is_some_and(|line| {
        let cells: Vec<&str> = line.split(',').collect();
        cells.len() > 1 && is_units_row(&cells)
    });
    (known || !header.contains(',')) && !units
}

fn is_units_row(cells: &[&str]) -> bool {
    cells.iter().all(|cell| units::is_unit(cell))
        && cells.iter().filter(|cell| !cell.trim().is_empty()).count() >= 2
}

/// What was found.
#[derive(Debug)]
pub(super) struct Table<'a> {
    source: &'a str,
    names: Vec<String>,
    /// Column and unit.
    units: Vec<(String, String)>,
    /// Line from 1, and its cells.
    rows: Vec<(u64, Vec<String>)>,
    decimal_comma: bool,
    metadata: Vec<(String, String)>,
}

fn cells(line: &str, separator: char) -> Vec<String> {
    if !line.contains('"') {
        return line.split(separator).map(|cell| cell.trim().to_owned()).collect();
    }
    let mut byte = [0; 4];
    let delimiter = separator.encode_utf8(&mut byte).as_bytes()[0];
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .delimiter(delimiter)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    match reader.records().next() {
        Some(Ok(record)) => record.iter().map(str::to_owned).collect(),
        _ => Vec::new(),
    }
}

/// A number, with a decimal comma where there is no other meaning of it.
fn number(cell: &str, decimal_comma: bool) -> Option<f64> {
    if decimal_comma && cell.contains(',') {
        return cell.replace('.', "").replace(',', ".").parse().ok();
    }
    cell.parse().ok()
}

/// Seconds of a clock time: `2026-02-03T10:11:12.5`, `10:11:12.5`, with `T` or a blank between date and time.
fn clock_s(cell: &str) -> Option<f64> {
    let (date, time) = match cell.split_once(['T', ' ']) {
        Some((date, time)) => (Some(date), time.trim_end_matches('Z')),
        None => (None, cell),
    };
    let mut parts = time.split(':');
    let hour: f64 = parts.next()?.parse::<u32>().ok()?.into();
    let minute: f64 = parts.next()?.parse::<u32>().ok()?.into();
    let second: f64 = parts.next()?.replace(',', ".").parse().ok()?;
    if parts.next().is_some() {
        return None;
    }
    let day = match date {
        None => 0.0,
        Some(date) => {
            let fields: Vec<i32> =
                date.split(['-', '/']).map(|field| field.parse().ok()).collect::<Option<_>>()?;
            let [year, month, day] = fields[..] else { return None };
            // Days of the proleptic Gregorian calendar from 1 March of year 0.
            let (y, m) = if month > 2 { (year, month - 3) } else { (year - 1, month + 9) };
            f64::from(365 * y + y.div_euclid(4) - y.div_euclid(100) + y.div_euclid(400) + (153 * m + 2) / 5 + day)
                // Small numbers keep their decimals.
                - 738_000.0
        }
    };
    Some(((day * 24.0 + hour) * 60.0 + minute) * 60.0 + second)
}

fn is_value(cell: &str, comma_may_be_decimal: bool) -> bool {
    number(cell, comma_may_be_decimal).is_some() || clock_s(cell).is_some()
}

/// Finds the table.
pub(super) fn parse<'a>(source: &'a str, text: &str) -> Result<Table<'a>, InputError> {
    let lines: Vec<&str> = text.lines().collect();
    let mut best: Option<(usize, char, usize)> = None;
    for (separator, _) in SEPARATORS {
        let Some((at, width)) = numbers_begin(&lines, separator) else { continue };
        if best.is_none_or(|(_, _, most)| width > most) {
            best = Some((at, separator, width));
        }
    }
    let Some((first, separator, width)) = best else {
        return Err(InputError::new("holds no table of numbers under a line of column names")
            .file(source)
            .allowed(
                "columns separated by commas, semicolons, tabs or bars; UTF-8, UTF-16 or Windows-1252",
            ));
    };
    let above = |n: usize| -> Option<(usize, Vec<String>)> {
        let at = lines[..first].iter().rposition(|line| !line.trim().is_empty()).map(|last| {
            (0..=last).rev().filter(|at| !lines[*at].trim().is_empty()).nth(n).unwrap_or(usize::MAX)
        })?;
        let cells = cells(lines.get(at)?, separator);
        (cells.len() >= width).then_some((at, cells))
    };
    let missing = || {
        InputError::new("the header line is missing: nothing above the numbers has a name for each column")
            .file(source)
            .line(first as u64 + 1)
            .allowed("a line with column names above the numbers")
    };
    let (mut header_at, mut names) = above(0).ok_or_else(missing)?;
    let mut units_row = None;
    let as_text: Vec<&str> = names.iter().map(String::as_str).collect();
    if is_units_row(&as_text)
        && let Some((at, header)) = above(1)
    {
        units_row = Some(std::mem::replace(&mut names, header));
        header_at = at;
    }
    names.truncate(width);
    if let Some(name) = names.iter_mut().next() {
        *name = name.trim_start_matches('#').trim().to_owned();
    }
    let mut metadata = Vec::new();
    let mut skipped = 0;
    for line in &lines[..header_at] {
        match line.strip_prefix('#').map(|comment| comment.split_once(':').unwrap_or(("", comment))) {
            Some((key, value)) => metadata.push((key.trim().to_owned(), value.trim().to_owned())),
            None if !line.trim().is_empty() => skipped += 1,
            None => {}
        }
    }
    if skipped > 0 {
        metadata.push((ASSUMED.to_owned(), format!("{skipped} lines above the column names were left out")));
    }
    let words = SEPARATORS.iter().find(|(c, _)| *c == separator).map_or("", |(_, words)| *words);
    let rows: Vec<(u64, Vec<String>)> = (first..lines.len())
        .filter(|at| !lines[*at].trim().is_empty() && !lines[*at].starts_with('#'))
        .map(|at| (at as u64 + 1, cells(lines[at], separator)))
        .collect();
    let decimal_comma = separator != ','
        && rows
            .iter()
            .take(LOOK)
            .flat_map(|(_, cells)| cells)
            .any(|cell| cell.contains(',') && number(cell, true).is_some());
    let comma = if decimal_comma { ", with decimal commas" } else { "" };
    metadata.push((ASSUMED.to_owned(), format!("columns are separated by {words}{comma}")));
    let mut units: Vec<(String, String)> = names
        .iter()
        .filter_map(|name| without_unit(name).1.map(|unit| (name.clone(), unit.to_owned())))
        .collect();
    for (name, unit) in names.iter().zip(units_row.into_iter().flatten()) {
        let unit = unit.trim_matches(['[', ']', '(', ')']).trim().to_owned();
        if !unit.is_empty() && unit != "-" {
            units.retain(|(known, _)| known != name);
            units.push((name.clone(), unit));
        }
    }
    let table = Table { source, names, units, rows, decimal_comma, metadata };
    table.check(header_at as u64 + 1, width)?;
    Ok(table)
}

/// The first line of values that is followed by two of as many cells; in a shorter text, by all that follow.
fn numbers_begin(lines: &[&str], separator: char) -> Option<(usize, usize)> {
    let decimal = separator != ',';
    let row = |line: &str| -> Option<usize> {
        let cells = cells(line, separator);
        let filled = cells.len() - usize::from(cells.last().is_some_and(String::is_empty));
        // Text columns are allowed, but most of a row is numbers, and the first cell is one.
        let values = cells.iter().filter(|cell| is_value(cell, decimal)).count();
        (filled >= 2 && is_value(&cells[0], decimal) && 2 * values >= filled).then_some(filled)
    };
    (0..lines.len().min(LOOK)).find_map(|at| {
        let width = row(lines[at])?;
        // Cells may be missing there; the one that reads them says which.
        let alike = |line: &str| {
            let cells = cells(line, separator);
            cells.len() >= width && is_value(&cells[0], decimal)
        };
        let following: Vec<&&str> =
            lines[at..].iter().filter(|line| !line.trim().is_empty()).take(3).collect();
        following.iter().all(|line| alike(line)).then_some((at, width))
    })
}

impl Table<'_> {
    fn check(&self, header_line: u64, width: usize) -> Result<(), InputError> {
        for (at, name) in self.names.iter().enumerate() {
            if self.names[..at].contains(name) {
                return Err(InputError::new("this column is there twice")
                    .file(self.source)
                    .line(header_line)
                    .key(name)
                    .allowed("each name once"));
            }
        }
        for (line, cells) in &self.rows {
            let more = cells.get(width..).unwrap_or_default().iter().any(|cell| !cell.is_empty());
            if cells.len() < width || more {
                return Err(InputError::new(format!("has {} cells, the header has {width}", cells.len()))
                    .file(self.source)
                    .line(*line)
                    .allowed(format!("{width} cells, one for each column")));
            }
        }
        Ok(())
    }

    /// Fills the log; columns that are signals must be numbers. Gives the units that stand in the file.
    pub(super) fn into_log(
        self,
        log: &mut Log,
        columns: &Columns,
    ) -> Result<Vec<(String, String)>, InputError> {
        log.metadata.extend(self.metadata);
        let mut expected = 0;
        for (sample, (line, _)) in self.rows.iter().enumerate() {
            if *line != expected {
                log.line_marks.push((sample, *line));
            }
            expected = line + 1;
        }
        for (at, name) in self.names.iter().enumerate() {
            let signal = columns.signal_of(name);
            let clock = signal == Some(Signal::Time)
                && self
                    .rows
                    .first()
                    .is_some_and(|(_, cells)| number(&cells[at], self.decimal_comma).is_none());
            let mut numbers = Vec::with_capacity(self.rows.len());
            for (line, cells) in &self.rows {
                let cell = &cells[at];
                let value = if clock { clock_s(cell) } else { number(cell, self.decimal_comma) }
                    .filter(|x| x.is_finite());
                match value {
                    Some(value) => numbers.push(value),
                    None if signal.is_some() => {
                        let what = if cell.is_empty() { "the cell is empty" } else { "not a finite number" };
                        return Err(InputError::new(what)
                            .file(self.source)
                            .line(*line)
                            .key(name)
                            .value(cell)
                            .allowed("a number"));
                    }
                    None => break,
                }
            }
            let cells = if numbers.len() == self.rows.len() {
                if clock {
                    let first = numbers[0];
                    numbers.iter_mut().for_each(|value| *value -= first);
                    log.metadata
                        .push((ASSUMED.to_owned(), format!("{name} is a clock time; it begins at 0")));
                }
                Cells::Numbers(numbers)
            } else {
                Cells::Text(self.rows.iter().map(|(_, cells)| cells[at].clone()).collect())
            };
            log.columns.push(Column { name: name.clone(), cells });
        }
        Ok(self.units)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tools_own_form_is_left_to_the_strict_reader() {
        assert!(is_plain("# a: b\ntime_s,m2_speed_rad_s\n0,1\n"));
        assert!(is_plain("time_s,normal_force_kn\n0,1\n"));
        assert!(is_plain(""));
        assert!(!is_plain("time_s;m2_speed_rad_s\n0;1\n"));
        assert!(!is_plain("time_s,m2_speed_rad_s\ns,rad/s\n0,1\n"));
        assert!(!is_plain("t,v\n0,1\n"));
    }

    #[test]
    fn clock_times_count_over_midnight_and_leap_days() {
        let day = |date: &str| clock_s(&format!("{date} 00:00:00")).unwrap();
        assert_eq!(day("2024-03-01") - day("2024-02-28"), 2.0 * 86_400.0);
        assert_eq!(day("2025-03-01") - day("2025-02-28"), 86_400.0);
        assert_eq!(day("2026-01-01") - day("2025-12-31"), 86_400.0);
        assert_eq!(clock_s("01:02:03.5"), Some(3723.5));
        assert_eq!(clock_s("abc"), None);
    }

    #[test]
    fn a_text_without_a_table_and_ragged_rows_are_refused() {
        let refused = |text: &str| parse("l.csv", text).unwrap_err().to_string();
        assert!(refused("hello;world\nno;numbers\n").starts_with("l.csv: holds no table of numbers"));
        assert!(refused("1;2\n3;4\n5;6\n").contains("the header line is missing"));
        assert!(refused("a;b\n1;2\n3;4\n5;6\n7\n").starts_with("l.csv:5: has 1 cells, the header has 2"));
        assert!(refused("a;a\n1;2\n3;4\n5;6\n").starts_with("l.csv:1: a: this column is there twice"));
    }
}
