//! The fault campaign: what can go wrong on the rig is made to go wrong, and the firmware must end it or bear it.
//!
//! The rig is brought into a state; from instants drawn by a seed the run branches once for each fault. Asked each time: did
//! the fault act (`sighting.rs`), are the outputs safe within two control periods of the moment it can be known, do they
//! stay so with nobody at the rig, is the reason in the firmware's log and said over the link, is the rig refused while
//! the fault is there, and does it come back when it is put right. A run whose fault nothing saw does not count.

pub mod case;
pub mod faults;
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
use std::path::Path;
use std::sync::Arc;

/// Outputs are safe so long after the moment the fault can be known.
pub const PROMISED_NS: u64 = 2 * PERIOD;

/// What is run.
#[derive(Debug, Clone)]
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

/// Runs the campaign; `tell` hears the runs as they are done, and how many there will be.
///
/// # Errors
/// The bench itself failed. A firmware that fails a fault is no error: see [`Row::problems`].
pub fn run(
    firmware: &Firmware,
    plan: &Plan,
    tell: &mut (dyn FnMut(&[Run], usize) + Send),
) -> Result<Vec<Run>, BenchError> {
    let wanted = |case: &FaultCase| plan.only.as_ref().is_none_or(|only| case.name.contains(only.as_str()));
    let faults: Arc<Vec<FaultCase>> = Arc::new(faults::all().into_iter().filter(wanted).collect());
    let table = Arc::new(defmt_log::table(&firmware.bytes)?);
    let chip = Chip { faults: Arc::clone(&faults), table, control_state: firmware.control_state };
    let times = |case: &FaultCase| if case.is_flip { plan.flips } else { 1 };
    let total = plan.instants
        * (0..plan.states.len())
            .flat_map(|place| faults.iter().enumerate().filter(move |(nth, _)| plan.takes(*nth, place)))
            .map(|(_, case)| times(case))
            .sum::<usize>();
    let mut runs = Vec::new();
    for (place, state) in plan.states.iter().enumerate() {
        let outcome = bench::run(firmware, Box::new(state.plant()?), |endpoint| {
            in_state(endpoint, place, plan, &chip, &mut |new| tell(new, total))
        })?;
        runs.extend(outcome.operator);
    }
    Ok(runs)
}

/// What the branches share.
struct Chip {
    faults: Arc<Vec<FaultCase>>,
    table: Arc<Table>,
    control_state: (u64, u64),
}

fn in_state(
    endpoint: &mut Endpoint,
    place: usize,
    plan: &Plan,
    chip: &Chip,
    tell: &mut dyn FnMut(&[Run]),
) -> Result<Vec<Run>, BenchError> {
    let state = plan.states[place];
    state.reach(endpoint)?;
    let mut listener = ListeningHost::new();
    // The host of before is gone: a few periods of this one's company first.
    let begin = endpoint.now_ns() + 5_000_000;
    let mut chance = Chance(plan.seed ^ (state as u64 + 1) << 32);
    let mut instants: Vec<u64> =
        (0..plan.instants).map(|_| begin + chance.below(DRAWN_FROM_PERIODS) * PERIOD).collect();
    instants.sort_unstable();
    let mut runs = Vec::new();
    for instant in instants {
        listener.listen(endpoint, instant)?;
        let at_ns = endpoint.now_ns();
        let twin = match endpoint
            .branch(vec![Box::new(|endpoint: &mut Endpoint| encoded(&case::twin(endpoint)))], 1)?
            .first()
        {
            Some(bytes) => decoded(bytes)?,
            None => None,
        };
        let mut names = Vec::new();
        let mut jobs: Vec<Job> = Vec::new();
        for (_, case) in chip.faults.iter().enumerate().filter(|(nth, _)| plan.takes(*nth, place)) {
            for _ in 0..if case.is_flip { plan.flips } else { 1 } {
                let mut case = case.clone();
                if case.is_flip {
                    let (start, length) = chip.control_state;
                    let (offset, bit) = (chance.below(length), chance.below(8));
                    case.actions = vec![Action::FlipBit { address: start + offset, bit: bit as u8 }];
                }
                names.push(case.name.clone());
                let table = Arc::clone(&chip.table);
                jobs.push(Box::new(move |endpoint: &mut Endpoint| {
                    let mut row = case::run(endpoint, &case, state, &Common { table: &table, twin });
                    if case.is_flip && !row.problems.is_empty() {
                        row.problems.push(format!("{:?}", case.actions));
                    }
                    encoded(&row)
                }));
            }
        }
        let done = runs.len();
        for (bytes, fault) in endpoint.branch(jobs, plan.at_once)?.iter().zip(names) {
            runs.push(Run { fault, state, at_ns, row: decoded(bytes)? });
        }
        tell(&runs[done..]);
    }
    Ok(runs)
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
