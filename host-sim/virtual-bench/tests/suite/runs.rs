//! The runs that several checks look at: each is made once.

use super::firmware;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock};
use virtual_bench::budget;
use virtual_bench::experiment::{self, Done};

/// The six experiments.
pub(crate) const FIGURES: [&str; 6] = ["fig18", "fig19", "fig20", "fig21", "fig22", "fig23"];

/// The run of this name, as on the record of costs.
pub(crate) fn run(name: &'static str) -> Arc<Done> {
    type Runs = Mutex<BTreeMap<&'static str, Arc<OnceLock<Arc<Done>>>>>;
    static RUNS: Runs = Mutex::new(BTreeMap::new());
    // Only the map is locked while others run.
    let place = Arc::clone(RUNS.lock().unwrap().entry(name).or_default());
    Arc::clone(place.get_or_init(|| Arc::new(again(name))))
}

/// The same run, made anew.
pub(crate) fn again(name: &str) -> Done {
    experiment::run(firmware(), &budget::request(name).unwrap(), |_, _| ()).unwrap()
}
