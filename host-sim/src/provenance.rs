//! Where results come from: the command line, the version, the day, every file that was read with its hash, and what
//! was assumed where no file was given. Reports end with it.
//!
//! The day is that of `SOURCE_DATE_EPOCH` where it is set, so that the same inputs can give the same bytes.

use std::sync::Mutex;
use std::time::{SystemTime, UNIX_EPOCH};

use sha2::{Digest, Sha256};

static NOTES: Mutex<Vec<(String, String)>> = Mutex::new(Vec::new());

/// Notes something about the inputs, once.
pub fn note(what: &str, value: &str) {
    if let Ok(mut notes) = NOTES.lock() {
        let note = (what.to_owned(), value.to_owned());
        if !notes.contains(&note) {
            notes.push(note);
        }
    }
}

/// Notes a file that was read.
pub fn note_file(name: &str, bytes: &[u8]) {
    let hash: String = Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect();
    note(name, &format!("SHA-256 {hash}"));
}

/// All of it, for a table.
#[must_use]
pub fn lines() -> Vec<(String, String)> {
    let command: Vec<String> = std::env::args_os().map(|word| quoted(&word.to_string_lossy())).collect();
    let mut lines = vec![
        ("command".to_owned(), command.join(" ")),
        ("version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
        ("made".to_owned(), now()),
    ];
    if let Ok(notes) = NOTES.lock() {
        lines.extend(notes.iter().cloned());
    }
    lines
}

/// Date and time, or those of `SOURCE_DATE_EPOCH`.
#[must_use]
pub fn now() -> String {
    let seconds = std::env::var("SOURCE_DATE_EPOCH").ok().and_then(|text| text.parse().ok());
    utc(seconds
        .unwrap_or_else(|| SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs())))
}

/// The program's name without its folder, other words with quotes where a shell wants them.
fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "-_./=,:+@%…".contains(c);
    if word.chars().all(plain) && !word.is_empty() {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', "'\\''"))
    }
}

/// Seconds since 1970 as a date of the Gregorian calendar.
fn utc(seconds: u64) -> String {
    let (days, of_day) = (seconds / 86_400, seconds % 86_400);
    // Years of 365.2425 days from 1 March of year 0 (Hinnant's civil calendar).
    let z = days + 719_468;
    let era = z / 146_097;
    let of_era = z % 146_097;
    let year_of_era = (of_era - of_era / 1460 + of_era / 36_524 - of_era / 146_096) / 365;
    let of_year = of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let m = (5 * of_year + 2) / 153;
    let day = of_year - (153 * m + 2) / 5 + 1;
    let month = if m < 10 { m + 3 } else { m - 9 };
    let year = year_of_era + era * 400 + u64::from(month <= 2);
    format!("{year:04}-{month:02}-{day:02} {:02}:{:02} UTC", of_day / 3600, of_day / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dates_are_those_of_the_calendar() {
        assert_eq!(utc(0), "1970-01-01 00:00 UTC");
        assert_eq!(utc(1_709_164_800), "2024-02-29 00:00 UTC");
        assert_eq!(utc(1_798_761_599), "2026-12-31 23:59 UTC");
    }

    #[test]
    fn a_file_stands_with_its_hash_once() {
        note_file("provenance-test.csv", b"abc");
        note_file("provenance-test.csv", b"abc");
        let found: Vec<String> = lines()
            .into_iter()
            .filter(|(name, _)| name == "provenance-test.csv")
            .map(|(_, text)| text)
            .collect();
        let expected = "SHA-256 ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(found, [expected]);
        assert_eq!((quoted("a b").as_str(), quoted("--x=1").as_str()), ("'a b'", "--x=1"));
    }
}
