//! The fault campaign: what can go wrong on the rig is made to go wrong, and the firmware must end it or bear it.
//!
//! The rig is brought into a state; from instants drawn by a seed the run branches once for each fault. Asked each time: did
//! the fault act (`sighting.rs`), are the outputs safe within two control periods of the moment it can be known, do they
//! stay so with nobody at the rig, is the reason in the firmware's log and said over the link, is the rig refused while
//! the fault is there, and does it come back when it is put right. A run whose fault nothing saw does not count.

pub mod case;
pub mod faults;
pub mod kept;
mod link_noise;
pub mod listening_host;
mod settings_cut;
pub mod states;
pub mod table;

use crate::bench;
use crate::branch::Job;
use crate::defmt_log;
use crate::driver::PERIOD;
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::error::BenchError;
use crate::outside::Action;
use crate::soak::Chance;
use case::{Common, Row};
use defmt_decoder::Table;
use faults::FaultCase;
use listening_host::ListeningHost;
use serde::{Deserialize, Serialize};
use states::State;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;

/// Outputs are safe so long after the moment the fault can be known.
pub const PROMISED_NS: u64 = 2 * PERIOD;

/// What is run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Instants in each state.
    pub instants: usize,
    /// Where their drawing begins.
    pub seed: u64,
    /// Bits of the control state that are flipped at each instant: many of them do nothing.
    pub flips: usize,
    /// Branches at a time.
    pub at_once: usize,
    /// The states.
    pub states: Vec<State>,
    /// Only faults whose name has this in it.
    pub only: Option<String>,
    /// Each fault in one of the states only, the states in turn.
    pub in_turn: bool,
}

impl Plan {
    /// The whole campaign.
    #[must_use]
    pub fn whole() -> Self {
        Self {
            instants: 20,
            seed: 1,
            flips: 4,
            at_once: 2,
            states: State::ALL.to_vec(),
            only: None,
            in_turn: false,
        }
    }

    /// Each fault once, in one of the states; which one goes round with the seed.
    #[must_use]
    pub fn part(seed: u64) -> Self {
        Self { instants: 1, seed, in_turn: true, ..Self::whole() }
    }

    /// The faults, in the order of their places.
    fn faults(&self) -> Vec<FaultCase> {
        let wanted =
            |case: &FaultCase| self.only.as_ref().is_none_or(|only| case.name.contains(only.as_str()));
        faults::all().into_iter().filter(wanted).collect()
    }

    /// Runs of a fault at each instant.
    const fn times(&self, case: &FaultCase) -> usize {
        if case.is_flip { self.flips } else { 1 }
    }

    /// Runs at each instant of the state with this place in the plan.
    fn runs_an_instant(&self, faults: &[FaultCase], place: usize) -> usize {
        let here = faults.iter().enumerate().filter(|(fault, _)| self.takes(*fault, place));
        here.map(|(_, case)| self.times(case)).sum()
    }

    /// All runs.
    #[must_use]
    pub fn runs(&self) -> usize {
        let faults = self.faults();
        let each = (0..self.states.len()).map(|place| self.runs_an_instant(&faults, place));
        self.instants * each.sum::<usize>()
    }

    /// Whether the fault with this place in the list is made in the state with that place in the plan.
    #[must_use]
    pub fn takes(&self, fault: usize, state: usize) -> bool {
        let states = self.states.len();
        // The list has groups as long as there are states, e.g. what can happen to each analogue input: the place in
        // a group moves on by one with each group, or all open inputs would come in the same state.
        !self.in_turn || (fault + fault / states + self.seed as usize % states) % states == state
    }
}

/// Length of the time from which the instants are drawn.
const DRAWN_FROM_PERIODS: u64 = 1000;

/// One run: which, and what became of it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Run {
    /// The fault.
    pub fault: String,
    /// The state.
    pub state: State,
    /// When it was made, ns from power-on.
    pub at_ns: u64,
    /// What became of it.
    pub row: Row,
}

/// A run that is done, and its place among all of the campaign.
#[derive(Debug)]
pub struct Done<'a> {
    /// Its number: the same plan gives the same run the same number.
    pub nth: usize,
    /// What became of it.
    pub run: &'a Run,
}

/// Hears of a run as soon as it is done, and says whether further ones are to begin.
pub type Tell<'a> = dyn FnMut(Done<'_>) -> Result<ControlFlow<()>, BenchError> + Send + 'a;

/// Runs the campaign, but for the runs that are `known`, by their number. `tell` hears of each
/// other one. Gives all runs, the known ones too, in the order of their numbers.
///
/// # Errors
/// The bench itself failed, or `tell` did. A firmware that fails a fault is no error: see [`Row::problems`].
pub fn run(
    firmware: &Firmware,
    plan: &Plan,
    known: BTreeMap<usize, Run>,
    tell: &mut Tell<'_>,
) -> Result<Vec<Run>, BenchError> {
    let chip = Chip {
        faults: Arc::new(plan.faults()),
        table: Arc::new(defmt_log::table(&firmware.bytes)?),
        control_state: firmware.control_state,
    };
    let mut runs = Runs { done: known, first: 0, tell, ended: false };
    for (place, state) in plan.states.iter().enumerate() {
        let each = plan.runs_an_instant(&chip.faults, place);
        let last = runs.first + each * plan.instants;
        if !runs.ended && (runs.first..last).any(|nth| !runs.done.contains_key(&nth)) {
            let plant = Box::new(state.plant()?);
            bench::run(firmware, plant, |endpoint| in_state(endpoint, place, plan, &chip, &mut runs))?;
        }
        runs.first = last;
    }
    Ok(runs.done.into_values().collect())
}

/// What the branches share.
struct Chip {
    faults: Arc<Vec<FaultCase>>,
    table: Arc<Table>,
    control_state: (u64, u64),
}

/// The runs so far.
struct Runs<'a, 'b> {
    done: BTreeMap<usize, Run>,
    /// Number of the first run of the state at hand.
    first: usize,
    tell: &'a mut Tell<'b>,
    ended: bool,
}

/// A run that is to be made.
struct ToDo {
    nth: usize,
    case: FaultCase,
}

fn in_state(
    endpoint: &mut Endpoint,
    place: usize,
    plan: &Plan,
    chip: &Chip,
    runs: &mut Runs<'_, '_>,
) -> Result<(), BenchError> {
    let state = plan.states[place];
    state.reach(endpoint)?;
    let mut listener = ListeningHost::new();
    // The host of before is gone: a few periods of this one's company first.
    let begin = endpoint.now_ns() + 5_000_000;
    let mut chance = Chance(plan.seed ^ (state as u64 + 1) << 32);
    let mut instants: Vec<u64> =
        (0..plan.instants).map(|_| begin + chance.below(DRAWN_FROM_PERIODS) * PERIOD).collect();
    instants.sort_unstable();
    let mut nth = runs.first;
    for instant in instants {
        listener.listen(endpoint, instant)?;
        let mut to_do = Vec::new();
        for (_, case) in chip.faults.iter().enumerate().filter(|(fault, _)| plan.takes(*fault, place)) {
            for _ in 0..plan.times(case) {
                let mut case = case.clone();
                // Drawn for those that are known too: the numbers after them stay the same.
                if case.is_flip {
                    let (start, length) = chip.control_state;
                    let (offset, bit) = (chance.below(length), chance.below(8));
                    case.actions = vec![Action::FlipBit { address: start + offset, bit: bit as u8 }];
                }
                if !runs.done.contains_key(&nth) {
                    to_do.push(ToDo { nth, case });
                }
                nth += 1;
            }
        }
        at_an_instant(endpoint, state, plan, chip, to_do, runs)?;
        if runs.ended {
            break;
        }
    }
    Ok(())
}

/// Branches once for each run.
fn at_an_instant(
    endpoint: &mut Endpoint,
    state: State,
    plan: &Plan,
    chip: &Chip,
    mut to_do: Vec<ToDo>,
    runs: &mut Runs<'_, '_>,
) -> Result<(), BenchError> {
    let at_ns = endpoint.now_ns();
    let mut twin = None;
    if to_do.iter().any(|run| run.case.is_flip) {
        let job: Job = Box::new(|endpoint: &mut Endpoint| encoded(&case::twin(endpoint)));
        endpoint.branch(vec![job], 1, &mut |_, bytes| {
            twin = decoded(bytes)?;
            Ok(ControlFlow::Continue(()))
        })?;
    }
    // The longest first: else the last of them runs while the other cores have nothing to do.
    to_do.sort_by_key(|run| std::cmp::Reverse(faults::watch_ns(&run.case, state)));
    let jobs = to_do.iter().map(|run| job(run.case.clone(), state, &chip.table, twin)).collect();
    endpoint.branch(jobs, plan.at_once, &mut |which, bytes| {
        let Some(ToDo { nth, case }) = to_do.get(which) else { return Ok(ControlFlow::Continue(())) };
        let run = Run { fault: case.name.clone(), state, at_ns, row: decoded(bytes)? };
        let flow = (runs.tell)(Done { nth: *nth, run: &run })?;
        runs.done.insert(*nth, run);
        runs.ended |= flow.is_break();
        Ok(flow)
    })
}

/// What a branch does for a run.
fn job(case: FaultCase, state: State, table: &Arc<Table>, twin: Option<(u64, u64)>) -> Job {
    let table = Arc::clone(table);
    Box::new(move |endpoint: &mut Endpoint| {
        let mut row = case::run(endpoint, &case, state, &Common { table: &table, twin });
        if case.is_flip && !row.problems.is_empty() {
            row.problems.push(format!("{:?}", case.actions));
        }
        encoded(&row)
    })
}

fn encoded<T: Serialize>(value: &T) -> Vec<u8> {
    // What cannot be written cannot be read either, and that is reported.
    serde_json::to_vec(value).unwrap_or_default()
}

fn decoded<T: for<'a> Deserialize<'a>>(bytes: &[u8]) -> Result<T, BenchError> {
    serde_json::from_slice(bytes).map_err(|error| BenchError::Emulator(format!("a branch's result: {error}")))
}

/// What became of one of the longer trials, which are no faults of an instant.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The trial in words.
    pub name: &'static str,
    /// What the firmware did.
    pub said: String,
    /// Everything that was not as it must be.
    pub problems: Vec<String>,
}

/// The longer trials: noise on the line for seconds, power cuts while a setting is stored. `scratch` is a folder for
/// temporary files.
///
/// # Errors
/// The bench itself failed.
pub fn trials(firmware: &Firmware, scratch: &Path) -> Result<Vec<Verdict>, BenchError> {
    let running = State::Sliding.kept(firmware)?;
    Ok(vec![link_noise::verdict(firmware, &running, scratch)?, settings_cut::verdict(firmware, scratch)?])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_part_makes_each_fault_in_one_state_and_as_many_in_each() {
        let faults = faults::all().len();
        for seed in 0..7 {
            let plan = Plan::part(seed);
            let states = 0..plan.states.len();
            for fault in 0..faults {
                assert_eq!(states.clone().filter(|state| plan.takes(fault, *state)).count(), 1, "{fault}");
            }
            for state in states {
                let here = (0..faults).filter(|fault| plan.takes(*fault, state)).count();
                assert!(here.abs_diff(faults / 5) <= 2, "{here} of {faults} in state {state}");
            }
        }
    }
}
