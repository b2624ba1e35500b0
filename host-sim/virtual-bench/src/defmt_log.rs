//! Decodes the firmware's defmt frames into lines: `time level message`.

use crate::error::BenchError;
use defmt_decoder::{DecodeError, StreamDecoder, Table};

/// What became of the log's bytes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct DefmtLog {
    /// Decoded lines, in order.
    pub lines: Vec<String>,
    /// Frames that could not be decoded.
    pub malformed: u32,
}

impl DefmtLog {
    /// Events of the control core carry a running number, `#1` after each start: how many are missing.
    #[must_use]
    pub fn missing_events(&self) -> u64 {
        let mut last = 0;
        let mut missing = 0;
        for number in self.lines.iter().filter_map(|line| event_number(line)) {
            // A number that is not larger is a new start's.
            missing += if number > last { number - last - 1 } else { number - 1 };
            last = number;
        }
        missing
    }
}

/// The running number of an event's line.
fn event_number(line: &str) -> Option<u64> {
    let word = line.split_whitespace().nth(2)?;
    word.strip_prefix('#')?.parse().ok().filter(|number| *number > 0)
}

/// The table of the log's strings in an ELF.
///
/// # Errors
/// The ELF holds no defmt table of this decoder's version.
pub(crate) fn table(elf: &[u8]) -> Result<Table, BenchError> {
    Table::parse(elf)
        .map_err(|error| BenchError::Firmware(format!("its defmt table cannot be read: {error}")))?
        .ok_or_else(|| BenchError::Firmware("it holds no defmt table".to_owned()))
}

/// Takes the lines out of a decoder that are complete in it.
pub(crate) fn decode_into(table: &Table, decoder: &mut dyn StreamDecoder, log: &mut DefmtLog) {
    loop {
        match decoder.decode() {
            Ok(frame) => {
                let time = frame.display_timestamp().map(|time| time.to_string()).unwrap_or_default();
                let level = frame.level().map_or("-", |level| level.as_str());
                log.lines.push(format!("{time} {level} {}", frame.display_message()));
            }
            Err(DecodeError::UnexpectedEof) => break,
            Err(DecodeError::Malformed) => {
                log.malformed += 1;
                if !table.encoding().can_recover() {
                    break;
                }
            }
        }
    }
}

/// Decodes the bytes of each start of the firmware on its own: a frame cut short by a reset ends there.
///
/// # Errors
/// The ELF holds no defmt table of this decoder's version.
pub fn decode(elf: &[u8], starts: &[Vec<u8>]) -> Result<DefmtLog, BenchError> {
    Ok(decode_with(&table(elf)?, starts))
}

/// The same with a table that was read before.
#[must_use]
pub(crate) fn decode_with(table: &Table, starts: &[Vec<u8>]) -> DefmtLog {
    let mut log = DefmtLog::default();
    for bytes in starts {
        let mut decoder = table.new_stream_decoder();
        decoder.received(bytes);
        decode_into(table, decoder.as_mut(), &mut log);
    }
    log
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(numbers: &[&str]) -> DefmtLog {
        let lines =
            numbers.iter().map(|number| format!("0.1 info {number} tick 5: Armed -> Running")).collect();
        DefmtLog { lines, malformed: 0 }
    }

    #[test]
    fn a_gap_in_the_running_numbers_is_counted_and_a_new_start_is_none() {
        assert_eq!(log(&["#1", "start", "#2", "#3"]).missing_events(), 0);
        assert_eq!(log(&["#1", "#4"]).missing_events(), 2);
        assert_eq!(log(&["#2"]).missing_events(), 1);
        assert_eq!(log(&["#1", "#2", "#1", "#2", "#3"]).missing_events(), 0);
        assert_eq!(log(&["#1", "#2", "#2"]).missing_events(), 1);
    }
}
