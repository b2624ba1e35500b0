//! The host's side of the link to the firmware: serial port or virtual bench, the same code.
//!
//! | module | what |
//! |---|---|
//! | [`client`] | frames in, frames out, requests and answers; no I/O and no clock of its own |
//! | [`procedure`] | something that is done over a link step by step, and the loop that does it on a port |
//! | [`ask`] | requests one after the other, each with its answer |
//! | [`run_experiment`] | upload, arm, run, record |
//! | [`record`] | record what the rig does without commanding it |
//! | [`rows`] | telemetry to a log |
//! | [`capture`] | the triggered capture to a log |
//! | [`model_upload`] | a model file for the observer |
//! | [`words`] | what the rig says, in words |
//! | [`serial`] | the serial port |
//! | [`share`] | what comes in, for whoever looks on |
//! | [`usb`] | the port of the debug probe, by its USB id |

pub mod ask;
pub mod capture;
pub mod client;
pub mod model_upload;
pub mod procedure;
pub mod record;
pub mod rows;
pub mod run_experiment;
pub mod serial;
pub mod share;
pub mod usb;
pub mod words;
