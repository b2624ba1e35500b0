//! A log that is written while it is recorded, so that nothing is lost whatever happens to the host.
//!
//! It is an ordinary log, `unfinished.csv` in the folder of the results. Its first line says why it ends; until
//! somebody knows better, that is that the host went away. The line has room for another reason, which is written
//! over it in place: that works on a full disk too. Lines are only ever added whole.

use std::fs::{self, File};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::log::Log;
use crate::input_error::InputError;

/// Name of the file.
pub const NAME: &str = "unfinished.csv";
/// The reason that stands in the file until there is another.
pub const HOST_GONE: &str = "the host went away while it recorded (killed, or without power)";
/// Key of the reason in a log.
pub const KEY: &str = "ended";
/// Bytes of the first line without its end.
const WIDTH: usize = 160;

/// The file while it is written.
#[derive(Debug)]
pub struct Journal {
    path: PathBuf,
    file: File,
    /// Bytes of whole lines.
    whole: u64,
    /// The header line stands.
    headed: bool,
}

/// The first line, as long as it always is.
fn first_line(reason: &str) -> String {
    let mut line = format!("# {KEY}: {}", reason.replace(['\n', '\r'], " "));
    while line.len() > WIDTH {
        line.pop();
    }
    format!("{line:<0$}\n", WIDTH - (line.len() - line.chars().count()))
}

impl Journal {
    /// Begins the file in a folder that is there, with what is known about the log.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn begin(folder: &Path, metadata: &[(String, String)]) -> Result<Self, InputError> {
        let path = folder.join(NAME);
        let file = File::create(&path).map_err(|error| InputError::io(&path, "write", &error))?;
        let mut journal = Self { path, file, whole: 0, headed: false };
        let about = Log { metadata: metadata.to_vec(), ..Log::default() }.to_csv();
        journal.add(&(first_line(HOST_GONE) + about.trim_start_matches('\n').trim_end() + "\n"))?;
        Ok(journal)
    }

    /// Adds the rows of a log; all logs have the same columns.
    ///
    /// # Errors
    /// They cannot be written; the file ends with the last whole line before them.
    pub fn append(&mut self, rows: &Log) -> Result<(), InputError> {
        let text = rows.to_csv();
        let after_header = text.find('\n').map_or(0, |end| end + 1);
        let new = if self.headed { text.get(after_header..).unwrap_or_default() } else { &text };
        self.add(new)?;
        self.headed = true;
        Ok(())
    }

    fn add(&mut self, text: &str) -> Result<(), InputError> {
        let written = self.file.write_all(text.as_bytes()).and_then(|()| self.file.flush());
        match written {
            Ok(()) => {
                self.whole += text.len() as u64;
                Ok(())
            }
            Err(error) => {
                // A part of a line is no line. Where even this fails, readers refuse that line by its number.
                let _ = self.file.set_len(self.whole);
                let _ = self.file.seek(SeekFrom::Start(self.whole));
                Err(InputError::io(&self.path, "write", &error))
            }
        }
    }

    /// Says in the file why it ends, and leaves it.
    pub fn leave(mut self, reason: &str) -> PathBuf {
        let at_start = self.file.seek(SeekFrom::Start(0));
        // The old reason stays where the new one cannot be written: it is true of the log all the same.
        let _ = at_start.and_then(|_| self.file.write_all(first_line(reason).as_bytes()));
        self.path
    }

    /// Removes the file: its log stands elsewhere.
    pub fn discard(self) {
        // A left-over file only repeats what is in the log.
        let _ = fs::remove_file(&self.path);
    }
}

/// A log that was never finished.
#[derive(Debug, Clone, PartialEq)]
pub struct Unfinished {
    /// The file.
    pub path: PathBuf,
    /// Its samples.
    pub rows: usize,
    /// Time of the last one.
    pub last_s: f64,
    /// Why it ends there.
    pub reason: String,
}

impl Unfinished {
    /// The one in a folder.
    #[must_use]
    pub fn in_folder(folder: &Path) -> Option<Self> {
        let path = folder.join(NAME);
        let log = Log::parse_csv(NAME, &fs::read(&path).ok()?).ok()?;
        let (rows, last_s) = (log.len(), log.time_s().last().copied().unwrap_or_default());
        Some(Self { path, rows, last_s, reason: log.metadata(KEY).unwrap_or(HOST_GONE).to_owned() })
    }

    /// Those in the folders beside `folder`, and in it.
    #[must_use]
    pub fn beside(folder: &Path) -> Vec<Self> {
        let parent = match folder.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let Ok(entries) = fs::read_dir(parent) else { return Vec::new() };
        let mut folders: Vec<PathBuf> = entries.flatten().take(1000).map(|entry| entry.path()).collect();
        folders.sort();
        folders.iter().filter_map(|folder| Self::in_folder(folder)).collect()
    }

    /// What a person should know of it.
    #[must_use]
    pub fn sentence(&self) -> String {
        format!(
            "{}: a recording that was never finished: {} rows up to {} s; {}",
            self.path.display(),
            self.rows,
            self.last_s,
            self.reason
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(from: u32, to: u32) -> Log {
        let mut log = Log::default();
        log.set_numbers("time_s", (from..to).map(|k| f64::from(k) / 1000.0).collect());
        log.set_numbers("m2_speed_rad_s", (from..to).map(f64::from).collect());
        log
    }

    #[test]
    fn at_every_moment_the_file_is_a_log_that_says_why_it_ends() {
        let folder = tempfile::tempdir().unwrap();
        let about = [("experiment".to_owned(), "fig20".to_owned())];
        let mut journal = Journal::begin(folder.path(), &about).unwrap();
        assert_eq!(Unfinished::in_folder(folder.path()), None, "nothing recorded, nothing to tell");
        journal.append(&rows(0, 10)).unwrap();
        journal.append(&rows(10, 25)).unwrap();
        let found = Unfinished::in_folder(folder.path()).unwrap();
        assert_eq!((found.rows, found.last_s, found.reason.as_str()), (25, 0.024, HOST_GONE));
        let path = journal.leave("the port is gone: cannot read: µ");
        let log = Log::read(&path).unwrap();
        assert_eq!(log.metadata(KEY), Some("the port is gone: cannot read: µ"));
        assert_eq!((log.len(), log.metadata("experiment")), (25, Some("fig20")));
        let found = &Unfinished::beside(&folder.path().join("next"))[..];
        assert_eq!(found, []);
    }

    #[test]
    fn the_next_run_finds_it_from_a_folder_beside() {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("first");
        fs::create_dir(&folder).unwrap();
        Journal::begin(&folder, &[]).unwrap().append(&rows(0, 10)).unwrap();
        let found = Unfinished::beside(&parent.path().join("second"));
        assert_eq!(found.len(), 1);
        assert!(found[0].sentence().contains("10 rows up to 0.009 s; the host went away"), "{found:?}");
    }

    #[test]
    fn every_reason_fills_the_same_bytes() {
        for reason in ["", "short", HOST_GONE, "µµµ", &"x".repeat(400), &"µ".repeat(200)] {
            assert_eq!(first_line(reason).len(), first_line("").len(), "{reason}");
        }
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn a_full_disk_is_told_by_its_kind() {
        // /dev/full takes nothing.
        let file = File::options().write(true).open("/dev/full").unwrap();
        let mut journal = Journal { path: "/dev/full".into(), file, whole: 0, headed: false };
        let error = journal.append(&rows(0, 2)).unwrap_err();
        assert_eq!(error.kind(), crate::input_error::Kind::Storage);
        assert!(error.to_string().contains("no space left"), "{error}");
    }
}
