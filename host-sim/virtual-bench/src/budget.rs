//! What a control tick may cost: the recorded instructions of each experiment, and the limits of all of them.
//!
//! Instructions on the emulated core are exact and the same on every computer with the same compiler. So the record,
//! `budget.toml`, is compared with little room: a tick that costs 2 % more than recorded fails the suite until the
//! record is made again, in the same change as what made the tick dearer. The same for the stack's worst case, which `cargo
//! verify` prints beside the ELF's size.

use crate::elf::Firmware;
use crate::error::BenchError;
use crate::experiment::{self, Request};
use crate::firmware_build::root;
use crate::meter::Ticks;
use crate::soak::{self, Soaked};
use crate::stack::{Depth, STACK};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

/// The experiments on the record; the last one has a 20-bristle patch in the observer.
pub const RECORDED: [&str; 7] = ["fig18", "fig19", "fig20", "fig21", "fig22", "fig23", PATCH];
/// Name of the run with the patch.
pub const PATCH: &str = "fig20_patch";
/// Most instructions of a tick on average.
pub const MOST_MEAN: f64 = 6_000.0;
/// Most instructions of any tick: a fifth of the 48 000 cycles of its period.
pub const MOST_MAX: u64 = 9_600;
/// What a tick may cost over the record.
const ROOM: f64 = 1.02;
/// How the record is made again.
const REMAKE: &str = "cargo virtual-bench --write-budget";

/// Instructions of a control tick.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Cost {
    /// On average over the experiment.
    pub mean: f64,
    /// Most.
    pub max: u64,
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "mean {:>7.1}  max {:>5}", self.mean, self.max)
    }
}

impl Cost {
    /// Of these ticks; the mean to a tenth.
    #[must_use]
    pub fn of(ticks: &Ticks) -> Self {
        Self { mean: (ticks.instructions.mean() * 10.0).round() / 10.0, max: ticks.instructions.max }
    }
}

/// The record.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
pub struct Budget {
    experiments: BTreeMap<String, Cost>,
    stack: StackRecord,
}

/// The stack's worst case on the record, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize)]
struct StackRecord {
    worst: u64,
    size: u64,
    depth: Depth,
}

/// The soak in which the stack is measured for the record: the suite's.
///
/// # Errors
/// As [`soak::soak`].
pub fn recorded_soak(firmware: &Firmware) -> Result<Soaked, BenchError> {
    soak::soak(firmware, 20.0, 3, &mut |_| ())
}

impl Budget {
    /// Where the record is.
    #[must_use]
    pub fn path() -> PathBuf {
        root().join("host-sim/virtual-bench/budget.toml")
    }

    /// The record as it is.
    ///
    /// # Errors
    /// There is none, or it is none.
    pub fn read() -> Result<Self, BenchError> {
        let path = Self::path();
        let bad =
            |why: String| BenchError::Check(format!("{}: {why}; make it with: {REMAKE}", path.display()));
        let text = std::fs::read_to_string(&path).map_err(|error| bad(error.to_string()))?;
        toml::from_str(&text).map_err(|error| bad(error.to_string()))
    }

    /// Runs everything and writes the record anew.
    ///
    /// # Errors
    /// A run failed, a tick costs more than any may, or the file cannot be written.
    pub fn write(
        firmware: &Firmware,
        tell: &mut dyn FnMut(&str, &dyn fmt::Display),
    ) -> Result<(), BenchError> {
        let mut budget = Self::default();
        for name in RECORDED {
            let cost = Cost::of(&experiment::run(firmware, &request(name)?, |_, _| ())?.ticks);
            within_limits(name, &cost)?;
            tell(name, &cost);
            budget.experiments.insert(name.to_owned(), cost);
        }
        let depth = recorded_soak(firmware)?.stack;
        tell("stack", &depth);
        budget.stack = StackRecord { worst: depth.worst(), size: STACK.end - STACK.start, depth };
        let failed = |error: String| BenchError::Check(format!("the record cannot be written: {error}"));
        let table = toml::to_string(&budget).map_err(|error| failed(error.to_string()))?;
        let text =
            format!("# Instructions of a control tick, and bytes of the stack. Made by: {REMAKE}\n\n{table}");
        std::fs::write(Self::path(), text).map_err(|error| failed(error.to_string()))
    }

    /// Whether the stack goes as deep as is on the record.
    ///
    /// # Errors
    /// It goes deeper, and what to do.
    pub fn check_stack(&self, depth: &Depth) -> Result<(), BenchError> {
        if depth.worst() <= self.stack.worst {
            return Ok(());
        }
        Err(BenchError::Check(format!(
            "{depth}: {} bytes at worst, on the record are {}; if it must be so, make the record again in the same change: \
             {REMAKE}",
            depth.worst(),
            self.stack.worst
        )))
    }

    /// Whether a run's ticks cost what is on the record.
    ///
    /// # Errors
    /// Which figure is too large, and what to do.
    pub fn check(&self, name: &str, cost: &Cost) -> Result<(), BenchError> {
        within_limits(name, cost)?;
        let recorded = self.experiments.get(name).ok_or_else(|| {
            BenchError::Check(format!("{name} is not on the record; make it with: {REMAKE}"))
        })?;
        if cost.mean <= recorded.mean * ROOM && cost.max as f64 <= recorded.max as f64 * ROOM {
            return Ok(());
        }
        Err(BenchError::Check(format!(
            "{name}: a tick costs {} instructions on average and {} at most; on the record are {} and {}, and 2 % more \
             are allowed; if it must be so, make the record again in the same change: {REMAKE}",
            cost.mean, cost.max, recorded.mean, recorded.max
        )))
    }
}

/// The run of that name on the record.
///
/// # Errors
/// There is no such experiment.
pub fn request(name: &str) -> Result<Request, BenchError> {
    let patch_observer = name == PATCH;
    let experiment = if patch_observer { "fig20" } else { name };
    Ok(Request { patch_observer, capture: !patch_observer, ..Request::assumed(experiment)? })
}

fn within_limits(name: &str, cost: &Cost) -> Result<(), BenchError> {
    if cost.mean <= MOST_MEAN && cost.max <= MOST_MAX {
        return Ok(());
    }
    Err(BenchError::Check(format!(
        "{name}: a tick costs {} instructions on average and {} at most; {MOST_MEAN} and {MOST_MAX} are the limits",
        cost.mean, cost.max
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tick_may_cost_two_per_cent_more_than_recorded_and_no_more() {
        let recorded = Cost { mean: 3000.0, max: 5000 };
        let budget = Budget { experiments: [("fig18".to_owned(), recorded)].into(), ..Budget::default() };
        let check = |mean, max| budget.check("fig18", &Cost { mean, max });
        assert!(check(3060.0, 5100).is_ok());
        assert!(check(2000.0, 3000).is_ok());
        for (mean, max) in [(3060.1, 5000), (3000.0, 5101)] {
            let refused = check(mean, max).unwrap_err().to_string();
            assert!(refused.contains("fig18") && refused.contains(REMAKE), "{refused}");
        }
        assert!(budget.check("fig19", &recorded).is_err());
    }

    #[test]
    fn a_stack_that_goes_deeper_than_recorded_is_refused() {
        let depth = Depth { mark: 30_000, tick: 4_000, drivers: 400, crash: 2_000 };
        let stack = StackRecord { worst: depth.worst(), size: 57_344, depth };
        let budget = Budget { stack, ..Budget::default() };
        assert!(budget.check_stack(&depth).is_ok());
        let refused = budget.check_stack(&Depth { crash: 2_004, ..depth }).unwrap_err().to_string();
        assert!(refused.contains(REMAKE), "{refused}");
    }

    #[test]
    fn no_record_allows_more_than_the_limits() {
        let dear = Cost { mean: MOST_MEAN + 0.1, max: MOST_MAX };
        let budget = Budget { experiments: [("fig18".to_owned(), dear)].into(), ..Budget::default() };
        assert!(budget.check("fig18", &dear).is_err());
        assert!(budget.check("fig18", &Cost { mean: 1000.0, max: MOST_MAX + 1 }).is_err());
    }
}
