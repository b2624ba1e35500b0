//! Readers of files.

use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::log::Log;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::input_error::InputError;
use std::path::Path;

/// Any text as a rig, a model or an experiment: refused with a reason, or taken and written out as it was read.
pub fn toml(bytes: &[u8]) {
    let Ok(text) = std::str::from_utf8(bytes) else { return };
    let refused = |error: &dyn std::fmt::Display| assert!(!error.to_string().is_empty());
    if let Err(error) = RigFile::parse("rig.toml", text) {
        refused(&error);
    }
    if let Err(error) = ExperimentFile::parse("experiment.toml", text) {
        refused(&error);
    }
    match ModelFile::parse("model.toml", text) {
        Err(error) => refused(&error),
        Ok(model) => {
            let again = model.to_toml();
            let read = ModelFile::parse("again.toml", &again).expect("what was read can be read again");
            assert_eq!(read.to_toml(), again);
        }
    }
}

/// Any bytes as a log in CSV: refused with a reason, or taken with columns of one length.
pub fn csv(bytes: &[u8]) {
    read(Log::parse_csv("log.csv", bytes));
}

/// Any bytes as a log in Parquet, by way of a file at `path`.
pub fn parquet(bytes: &[u8], path: &Path) {
    std::fs::write(path, bytes).expect("a place for a file");
    read(Log::read(path));
}

fn read(log: Result<Log, InputError>) {
    match log {
        Err(error) => assert!(!error.to_string().is_empty()),
        Ok(log) => {
            assert_eq!(log.time_s().len(), log.len());
            let _ = log.kind();
            let _ = log.contact();
        }
    }
}
