//! Why a command could not do what it was asked: one line, and an exit status by its kind.
//!
//! The line reads `FILE:LINE: KEY = VALUE: what is wrong; allowed: …`, each part only where it is known.
//! It is the only error type of the tool: whatever a command refuses, it refuses with one of these. Most often
//! something the user gave is wrong; [`Kind`] tells the other cases apart.

use std::fmt;
use std::path::Path;

use model_core::error::ParameterError;

/// What kind of thing went wrong; scripts see it as the exit status.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Kind {
    /// Something the user gave is wrong.
    #[default]
    Input,
    /// The rig refused, or the run ended before its time: a fault, a stop by the user.
    Run,
    /// The rig does not answer any more, or its port is gone.
    Rig,
    /// The results cannot be stored: no space left.
    Storage,
}

impl Kind {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Input, Self::Run, Self::Rig, Self::Storage];

    /// The exit status.
    #[must_use]
    pub const fn exit_status(self) -> u8 {
        match self {
            Self::Input => 2,
            Self::Run => 3,
            Self::Rig => 4,
            Self::Storage => 5,
        }
    }

    /// The kind in words, for `--json` and the help.
    #[must_use]
    pub const fn words(self) -> &'static str {
        match self {
            Self::Input => "bad input",
            Self::Run => "the run failed or ended before its time",
            Self::Rig => "the rig is lost or does not answer",
            Self::Storage => "the results cannot be stored: no space left",
        }
    }
}

/// One refused input: where it stands, what it was, what is wrong, what is allowed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct InputError(Box<Parts>);

#[derive(Debug, Clone, PartialEq, Eq, Default)]
struct Parts {
    /// The file as the user named it, or `--set` and the like.
    file: Option<String>,
    /// Line in that file, from 1.
    line: Option<u64>,
    /// Column of a log or dotted path of a TOML key.
    key: Option<String>,
    /// The refused value as it was written.
    value: Option<String>,
    problem: String,
    allowed: Option<String>,
    kind: Kind,
}

impl InputError {
    /// An error that says only what is wrong.
    pub fn new(problem: impl Into<String>) -> Self {
        Self(Box::new(Parts { problem: problem.into(), ..Parts::default() }))
    }

    /// An error in (or with) a file.
    pub fn in_file(path: &Path, problem: impl Into<String>) -> Self {
        Self::new(problem).file(path.display().to_string())
    }

    /// Names the file.
    #[must_use]
    pub fn file(mut self, file: impl Into<String>) -> Self {
        self.0.file = Some(file.into());
        self
    }

    /// Names the line, from 1.
    #[must_use]
    pub fn line(mut self, line: u64) -> Self {
        self.0.line = Some(line);
        self
    }

    /// Names the column or the key.
    #[must_use]
    pub fn key(mut self, key: impl Into<String>) -> Self {
        self.0.key = Some(key.into());
        self
    }

    /// Shows the refused value.
    #[must_use]
    pub fn value(mut self, value: impl fmt::Display) -> Self {
        self.0.value = Some(value.to_string());
        self
    }

    /// Says what is allowed.
    #[must_use]
    pub fn allowed(mut self, allowed: impl Into<String>) -> Self {
        self.0.allowed = Some(allowed.into());
        self
    }

    /// Says what kind of error it is; without this, bad input.
    #[must_use]
    pub fn of_kind(mut self, kind: Kind) -> Self {
        self.0.kind = kind;
        self
    }

    /// What kind of error it is.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.0.kind
    }

    /// Says that reading or writing a path failed, and why.
    #[must_use]
    pub fn io(path: &Path, doing: &str, error: &std::io::Error) -> Self {
        use std::io::ErrorKind::{FileTooLarge, QuotaExceeded, StorageFull};
        let full = matches!(error.kind(), StorageFull | QuotaExceeded | FileTooLarge);
        let kind = if full { Kind::Storage } else { Kind::Input };
        Self::in_file(path, format!("cannot {doing}: {}", io_reason(error))).of_kind(kind)
    }
}

/// The reason of an I/O error without the system's number.
fn io_reason(error: &std::io::Error) -> String {
    use std::io::ErrorKind;
    match error.kind() {
        ErrorKind::NotFound => "no such file or folder".into(),
        ErrorKind::PermissionDenied => "permission denied".into(),
        ErrorKind::NotADirectory => "a part of the path is a file, not a folder".into(),
        ErrorKind::IsADirectory => "it is a folder, not a file".into(),
        ErrorKind::StorageFull => "no space left".into(),
        ErrorKind::ReadOnlyFilesystem => "the file system is read-only".into(),
        _ => error.to_string(),
    }
}

impl From<ParameterError> for InputError {
    fn from(error: ParameterError) -> Self {
        Self::new("not allowed").key(error.name).value(error.value).allowed(error.allowed)
    }
}

impl fmt::Display for InputError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut text = String::new();
        match (&self.0.file, self.0.line) {
            (Some(file), Some(line)) => text += &format!("{file}:{line}: "),
            (Some(file), None) => text += &format!("{file}: "),
            (None, Some(line)) => text += &format!("line {line}: "),
            (None, None) => {}
        }
        match (&self.0.key, &self.0.value) {
            (Some(key), Some(value)) => text += &format!("{key} = {value}: "),
            (Some(key), None) => text += &format!("{key}: "),
            (None, Some(value)) => text += &format!("{value}: "),
            (None, None) => {}
        }
        text += &self.0.problem;
        if let Some(allowed) = &self.0.allowed {
            text += &format!("; allowed: {allowed}");
        }
        // Always one line, whatever a file or a crate's message holds.
        let line: Vec<&str> =
            text.split(['\n', '\r']).map(str::trim).filter(|part| !part.is_empty()).collect();
        f.write_str(&line.join(" "))
    }
}

impl std::error::Error for InputError {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_names_file_line_key_value_and_what_is_allowed() {
        let error = InputError::in_file(Path::new("rig.toml"), "out of range")
            .line(7)
            .key("pressure.mode_hz")
            .value(-1.0)
            .allowed("> 0");
        assert_eq!(error.to_string(), "rig.toml:7: pressure.mode_hz = -1: out of range; allowed: > 0");
    }

    #[test]
    fn a_full_disk_and_a_missing_file_have_exit_statuses_of_their_own() {
        let status = |kind: std::io::ErrorKind| {
            InputError::io(Path::new("x"), "write", &kind.into()).kind().exit_status()
        };
        assert_eq!((status(std::io::ErrorKind::StorageFull), status(std::io::ErrorKind::NotFound)), (5, 2));
        assert_eq!(Kind::ALL.map(Kind::exit_status), [2, 3, 4, 5]);
    }

    #[test]
    fn an_error_is_one_line_even_where_its_parts_are_not() {
        let error = InputError::new("first\nsecond\r\n").value("a\nb");
        assert_eq!(error.to_string(), "a b: first second");
    }
}
