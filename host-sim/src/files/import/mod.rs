//! Logs of other tools: which column is which signal, in which unit, and how the text is to be read.
//!
//! A log in the tool's own format needs nothing of this. For others `--map SIGNAL=COLUMN` and
//! `--unit COLUMN=UNIT`, or a `[columns]` table in a TOML file beside the log, say what the columns mean; separator,
//! decimal mark, encoding and a row of units are found in the text. Whatever was assumed stands in the log's
//! metadata under `assumed`, one line each. Nothing is converted silently.

pub mod columns;
pub mod table;
pub mod text;
pub mod units;

use std::path::Path;
use std::sync::Mutex;

use super::log::Log;
use super::{log_csv, log_parquet};
use crate::input_error::InputError;
use crate::provenance;
use columns::Columns;

/// `--map` and `--unit` of this process.
static ASKED: Mutex<Option<Columns>> = Mutex::new(None);

/// Key of the metadata that say what was assumed.
pub const ASSUMED: &str = "assumed";

/// From now on logs are read with these columns.
pub fn read_logs_with(columns: Columns) {
    if let Ok(mut asked) = ASKED.lock() {
        *asked = Some(columns);
    }
}

fn asked() -> Columns {
    ASKED.lock().ok().and_then(|asked| asked.clone()).unwrap_or_default()
}

/// Reads a log of any form; checks the form, not what time does.
pub(super) fn read(path: &Path) -> Result<Log, InputError> {
    let mut columns = Columns::beside(path)?;
    columns.extend(asked());
    if path.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet")) {
        let mut log = log_parquet::read(path, &columns)?;
        if let Ok(bytes) = std::fs::read(path) {
            provenance::note_file(&log.source, &bytes);
        }
        columns.apply(&mut log, &[])?;
        return Ok(log);
    }
    let bytes = std::fs::read(path).map_err(|e| InputError::io(path, "read", &e))?;
    let source = path.display().to_string();
    provenance::note_file(&source, &bytes);
    parse(&source, &bytes, &columns)
}

/// Parses a text with these columns.
fn parse(source: &str, bytes: &[u8], columns: &Columns) -> Result<Log, InputError> {
    let (text, encoding) = text::decode(bytes);
    if encoding == text::Encoding::Utf8 && columns.is_empty() && table::is_plain(&text) {
        return log_csv::parse(source, bytes);
    }
    let table = table::parse(source, &text)?;
    let mut log = Log { source: source.into(), ..Log::default() };
    if let Some(note) = encoding.note() {
        log.metadata.push((ASSUMED.into(), note.into()));
    }
    let units = table.into_log(&mut log, columns)?;
    columns.apply(&mut log, &units)?;
    Ok(log)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::signal::Signal;

    fn columns(map: &[&str], units: &[&str]) -> Columns {
        let list = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        Columns::from_options(&list(map), &list(units)).unwrap()
    }

    fn assumed(log: &Log) -> Vec<&str> {
        log.metadata.iter().filter(|(key, _)| key == ASSUMED).map(|(_, value)| value.as_str()).collect()
    }

    #[test]
    fn a_german_spreadsheet_with_units_row_and_decimal_commas() {
        let text = "Messung 7\nDatum;01.02.2026\n\nZeit;Winkel;Kraft;Notiz\nms;°;kN;\n0,0;10,0;0,08;a\n1,0;20,5;0,081;b;\n";
        let (bytes, ..) = encoding_rs::WINDOWS_1252.encode(text);
        let map = columns(&["time_s=Zeit", "m2_angle_rad=Winkel", "normal_force_n=Kraft"], &[]);
        let log = parse("l.csv", &bytes, &map).unwrap();
        assert_eq!(log.time_s(), [0.0, 0.001]);
        assert!((log.signal(Signal::M2Angle).unwrap()[1] - 20.5_f64.to_radians()).abs() < 1e-12);
        assert_eq!(log.signal(Signal::NormalForce).unwrap(), [80.0, 81.0]);
        let assumed = assumed(&log);
        assert!(assumed.iter().any(|note| note.contains("kN")), "{assumed:?}");
        assert!(assumed.iter().any(|note| note.contains("Windows-1252")), "{assumed:?}");
    }

    #[test]
    fn utf_16_with_tabs_and_units_in_the_header() {
        let text = "\u{feff}Time [ms]\tSpeed [rpm]\tTemp\n0\t30\t20\n1\t60\t21\n";
        let bytes: Vec<u8> = text.encode_utf16().flat_map(u16::to_le_bytes).collect();
        let map = columns(&["time_s=Time", "m2_speed_rad_s=Speed [rpm]"], &[]);
        let log = parse("l.txt", &bytes, &map).unwrap();
        assert_eq!(log.time_s(), [0.0, 0.001]);
        let speed = log.signal(Signal::M2Speed).unwrap();
        assert!((speed[1] - std::f64::consts::TAU).abs() < 1e-12, "{speed:?}");
        assert_eq!(log.numbers("Temp"), Some(&[20.0, 21.0][..]));
    }

    #[test]
    fn a_unit_that_is_asked_for_wins_and_may_carry_a_factor_and_a_sign() {
        let map = columns(&["time_s=t", "normal_force_n=F"], &["F=-2.5*kN"]);
        let log = parse("l.csv", b"t,F\n0,0.1\n1,0.2\n", &map).unwrap();
        assert_eq!(log.signal(Signal::NormalForce).unwrap(), [-250.0, -500.0]);
        let log =
            parse("l.csv", b"time_s,normal_force_n\n0,0.1\n1,0.2\n", &columns(&[], &["normal_force_n=kN"]))
                .unwrap();
        assert_eq!(log.signal(Signal::NormalForce).unwrap(), [100.0, 200.0]);
    }

    #[test]
    fn what_is_wrong_with_a_mapping_is_named() {
        let refused = |text: &[u8], map: &[&str], units: &[&str]| {
            parse("l.csv", text, &columns(map, units)).unwrap_err().to_string()
        };
        let error = refused(b"t,F\n0,1\n1,2\n", &["time_s=time"], &[]);
        assert_eq!(error, "l.csv: --map time_s = time: there is no such column; allowed: t, F");
        let error = refused(b"t,F\n0,1\n1,2\n", &["time_s=t"], &["t=N"]);
        assert!(error.starts_with("l.csv: --unit t = N: is no unit of time_s; allowed: s, ms"), "{error}");
        let error = refused(b"t,F\n0,1\n1,\n", &["time_s=t", "normal_force_n=F"], &[]);
        assert_eq!(error, "l.csv:3: F = : the cell is empty; allowed: a number");
        assert!(
            Columns::from_options(&["speed=v".into()], &[]).unwrap_err().to_string().contains("time_s, m1")
        );
        assert!(
            Columns::from_options(&["time_s".into()], &[]).unwrap_err().to_string().contains("SIGNAL=COLUMN")
        );
    }

    #[test]
    fn clock_times_and_seconds_since_1970_begin_at_zero() {
        let log = parse(
            "l.csv",
            b"__time,/force\n1700000000.000,1\n1700000000.001,2\n",
            &columns(&["time_s=__time"], &[]),
        )
        .unwrap();
        assert!((log.time_s()[1] - 1e-3).abs() < 1e-6 && log.time_s()[0] == 0.0);
        let text = b"stamp,F\n2026-02-03 23:59:59.999,1\n2026-02-04 00:00:00.001,2\n";
        let log = parse("l.csv", text, &columns(&["time_s=stamp"], &[])).unwrap();
        assert!((log.time_s()[1] - 2e-3).abs() < 1e-6, "{:?}", log.time_s());
    }
}
