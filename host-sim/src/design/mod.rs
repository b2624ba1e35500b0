//! The experiment that separates candidate models best.
//!
//! Families of experiments ([`family`]) are laid over the rig's limits at a few levels; each is run in closed
//! loop with the first candidate on the disc, and all candidates are driven with its motion and load. The
//! best one's levels are then improved one at a time. What counts is the least [`separation`] of any pair.

pub mod family;
pub mod separation;
pub mod text;

use rayon::prelude::*;

use crate::files::experiment_file::ExperimentFile;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::identify::noise;
use crate::input_error::InputError;
use crate::lockstep::{self, Setup};
use crate::predict::ContactInputs;
use family::{Family, Setting};
use separation::Reach;

/// Longest hold, s, and the range within which it is improved.
const HOLD_S: f64 = 1.0;
const HOLDS_S: (f64, f64) = (0.25, 2.5);
/// Range of speeds, rpm: the drive's limit is 300.
const SPEED_RANGE_RPM: (f64, f64) = (1.0, 200.0);
/// Factor by which a level is moved.
const FACTOR: f64 = 1.6;

/// How much is tried.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effort {
    /// Shares of the largest load that every family is tried at.
    loads: &'static [f64],
    /// Speeds that every family is tried at, rpm.
    speeds_rpm: &'static [f64],
    /// Each level of the best is moved so often at most.
    rounds: usize,
}

impl Effort {
    /// About sixty experiments.
    pub const THOROUGH: Self = Self { loads: &[0.4, 1.0], speeds_rpm: &[10.0, 40.0, 120.0], rounds: 2 };
    /// About twenty, for a search at the end of other work: at a third of the time, without light loads and slow
    /// turns but where a level of the best is moved there.
    pub const QUICK: Self = Self { loads: &[1.0], speeds_rpm: &[40.0, 120.0], rounds: 1 };
    /// One of each family, for many pairs of models.
    pub const BRIEF: Self = Self { loads: &[1.0], speeds_rpm: &[40.0], rounds: 0 };
}

/// A pair of models and how far they are apart.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Pair {
    /// Index of the model taken as true, and of the one that is fitted to it; the worse direction.
    pub models: (usize, usize),
    /// RMS of what the wrong one cannot explain, over the noise of a sample.
    pub separation: f64,
}

/// An experiment with what it would show.
#[derive(Debug, Clone, PartialEq)]
pub struct Proposal {
    /// Family and levels.
    pub setting: Setting,
    /// The experiment file.
    pub toml: String,
    /// Separation of every pair of models, nearest first.
    pub pairs: Vec<Pair>,
    /// Noise of a sample of friction torque, N·m.
    pub noise_nm: f64,
    /// Time of the predictions, s.
    pub time_s: Vec<f64>,
    /// Prediction of each model, N·m.
    pub torque_nm: Vec<Vec<f64>>,
}

impl Proposal {
    /// Separation of the nearest pair.
    #[must_use]
    pub fn separation(&self) -> f64 {
        self.pairs.first().map_or(0.0, |pair| pair.separation)
    }

    /// The experiment in a sentence.
    #[must_use]
    pub fn sentence(&self) -> String {
        let Setting { family, load_n, speed_rpm, hold_s } = self.setting;
        format!(
            "{} at up to {speed_rpm:.0} rpm and {load_n:.0} N, holds of {hold_s:.1} s: the wrong model would miss by {:.1} times the noise of a sample",
            family.words(),
            self.separation()
        )
    }
}

/// All experiments that were tried, best first. `progress` is told the number done of all.
///
/// # Errors
/// A model that cannot be simulated, or a rig on which no experiment runs without a fault.
pub fn propose(
    rig: &RigFile,
    models: &[ModelFile],
    effort: Effort,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Vec<Proposal>, InputError> {
    let largest_n = text::largest_load_n(rig, models);
    let mut settings = Vec::new();
    for family in Family::ALL {
        for share in effort.loads {
            for speed_rpm in effort.speeds_rpm.iter().copied() {
                settings.push(Setting { family, load_n: share * largest_n, speed_rpm, hold_s: HOLD_S });
            }
        }
    }
    let moves = 6 * effort.rounds;
    let total = settings.len() + moves;
    let done = std::sync::atomic::AtomicUsize::new(0);
    let tell = |count: usize| {
        let before = done.fetch_add(count, std::sync::atomic::Ordering::Relaxed);
        progress(before + count, total);
    };
    let tried: Vec<Result<Option<Proposal>, InputError>> = settings
        .into_par_iter()
        .map(|setting| {
            let proposal = evaluate(setting, rig, models);
            tell(1);
            proposal
        })
        .collect();
    let mut proposals: Vec<Proposal> =
        tried.into_iter().collect::<Result<Vec<_>, _>>()?.into_iter().flatten().collect();
    sort(&mut proposals);
    for _ in 0..effort.rounds {
        let Some(best) = proposals.first() else { break };
        let better: Vec<Proposal> = neighbours(best.setting, largest_n)
            .into_par_iter()
            .map(|setting| {
                let proposal = evaluate(setting, rig, models);
                tell(1);
                proposal
            })
            .collect::<Result<Vec<_>, _>>()?
            .into_iter()
            .flatten()
            .collect();
        proposals.extend(better);
        sort(&mut proposals);
    }
    progress(total, total);
    if proposals.is_empty() {
        return Err(InputError::new("no experiment runs without a fault").file(rig.source.as_str()));
    }
    Ok(proposals)
}

fn sort(proposals: &mut [Proposal]) {
    proposals.sort_by(|a, b| b.separation().total_cmp(&a.separation()));
}

/// One level moved at a time, within the rig's limits.
fn neighbours(setting: Setting, largest_n: f64) -> Vec<Setting> {
    let mut all = Vec::new();
    for factor in [FACTOR, 1.0 / FACTOR] {
        let load_n = (setting.load_n * factor).clamp(0.1 * largest_n, largest_n);
        let speed_rpm = (setting.speed_rpm * factor).clamp(SPEED_RANGE_RPM.0, SPEED_RANGE_RPM.1);
        let hold_s = (setting.hold_s * factor).clamp(HOLDS_S.0, HOLDS_S.1);
        all.extend([
            Setting { load_n, ..setting },
            Setting { speed_rpm, ..setting },
            Setting { hold_s, ..setting },
        ]);
    }
    all.retain(|moved| *moved != setting);
    all
}

/// Runs one experiment; `None` where the rig cannot: it ends in a fault.
fn evaluate(setting: Setting, rig: &RigFile, models: &[ModelFile]) -> Result<Option<Proposal>, InputError> {
    let Some(first) = models.first() else { return Ok(None) };
    let toml = text::toml("proposed", setting.family.words(), &setting.course(), rig);
    let experiment = ExperimentFile::parse("proposed experiment", &toml)?;
    let setup = Setup::from_files(&experiment, rig, first, first)?;
    let recording = lockstep::run(&setup, |_, _| {})?;
    if recording.fault.is_some() {
        return Ok(None);
    }
    let log = recording.log(10, setup.plant.counts_per_rev);
    let noise_nm = noise::standard_deviation(log.require(Signal::FrictionTorque)?).max(1e-6);
    let signals = log.contact()?;
    let inputs = ContactInputs::new(&signals, rig);
    let reaches =
        models.iter().map(|model| Reach::new(model, rig, &inputs)).collect::<Result<Vec<_>, _>>()?;
    let unrepeatable: Vec<f64> = reaches.iter().map(|reach| reach.unrepeatable(noise_nm)).collect();
    let mut pairs = Vec::new();
    for i in 0..reaches.len() {
        for j in 0..i {
            let directions = [(i, j), (j, i)].map(|models| {
                let distance = reaches[models.1].distance_from(&reaches[models.0].torque_nm, noise_nm);
                let repeated = distance.powi(2) - unrepeatable[i].powi(2) - unrepeatable[j].powi(2);
                Pair { models, separation: repeated.max(0.0).sqrt() }
            });
            let [a, b] = directions;
            pairs.push(if a.separation < b.separation { a } else { b });
        }
    }
    pairs.sort_by(|a, b| a.separation.total_cmp(&b.separation));
    let torque_nm = reaches.into_iter().map(|reach| reach.torque_nm).collect();
    Ok(Some(Proposal { setting, toml, pairs, noise_nm, time_s: inputs.time_s, torque_nm }))
}
