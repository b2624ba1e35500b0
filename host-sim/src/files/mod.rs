//! The files of the tool: logs, rigs, models, experiments, and how results are written.

pub mod drive_model;
pub mod effect_id;
mod experiment_core;
pub mod experiment_file;
pub mod import;
pub mod journal;
pub mod log;
mod log_check;
mod log_csv;
#[cfg(feature = "mcap")]
mod log_mcap;
#[cfg(feature = "parquet")]
mod log_parquet;
pub mod model_file;
pub mod number;
pub mod output_dir;
pub mod overrides;
pub mod plausible;
pub mod rig_file;
pub mod signal;
pub mod speed_lag;
mod stamp_wobble;
pub mod strain_gauges;
pub mod toml_tree;
#[cfg(feature = "parquet")]
mod whole_file;

/// In place of a form of file that the build leaves out.
#[cfg(not(feature = "mcap"))]
mod log_mcap {
    use super::log::Log;
    use crate::input_error::InputError;

    pub(super) fn write(_: &Log) -> Result<Vec<u8>, InputError> {
        Err(InputError::new("this build of rig writes no MCAP").allowed("a build with the feature mcap"))
    }
}

/// In place of a form of file that the build leaves out.
#[cfg(not(feature = "parquet"))]
mod log_parquet {
    use super::import::columns::Columns;
    use super::log::Log;
    use crate::input_error::InputError;
    use std::path::Path;

    fn left_out() -> InputError {
        InputError::new("this build of rig has no Parquet").allowed("a build with the feature parquet")
    }

    pub(super) fn read(path: &Path, _: &Columns) -> Result<Log, InputError> {
        Err(left_out().file(path.display().to_string()))
    }

    pub(super) fn write(_: &Log) -> Result<Vec<u8>, InputError> {
        Err(left_out())
    }
}
