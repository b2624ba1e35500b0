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
mod log_mcap;
mod log_parquet;
pub mod model_file;
pub mod number;
pub mod output_dir;
pub mod overrides;
pub mod plausible;
pub mod rig_file;
pub mod signal;
pub mod strain_gauges;
pub mod toml_tree;
