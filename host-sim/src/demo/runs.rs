//! All runs of the demo.

use super::comparison::{Comparison, reference_speed};
use super::{charts, findings};
use crate::files::experiment_file::{ExperimentFile, Study};
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::lockstep::{self, Recording, Setup};
use crate::plant::ElementParameters;
use crate::report::{Block, Page};
use crate::studies::candidate_models::rubber_of;
use crate::studies::patch_crossing::{self, Crossing};
use crate::studies::speed_sweep::{self, Sweep};
use crate::summary::{RunFacts, Summary, summarise};
use model_core::error::ParameterError;
use model_core::friction::series::SeriesParameters;

/// The experiments with motors, in the order of the paper.
const CLOSED_LOOP: [&str; 6] = ["fig18", "fig19", "fig20", "fig21", "fig22", "fig23"];
/// Those in which friction overshoots.
const LOAD_STEPS: usize = 4;
/// Steps of the whole demo: experiments, comparisons, studies, the hidden effect.
pub(super) const STEPS: usize = CLOSED_LOOP.len() + LOAD_STEPS + 3;

/// One experiment in closed loop.
#[derive(Debug, Clone)]
pub struct ClosedLoop {
    /// Short name, as in its file.
    pub name: String,
    /// What it shows.
    pub title: String,
    /// All signals at 10 kHz.
    pub recording: Recording,
    /// Its figures.
    pub summary: Summary,
}

impl ClosedLoop {
    /// Runs an experiment; the figures come from the full rate.
    ///
    /// # Errors
    /// What plant or core refuse.
    pub fn run(
        experiment: &ExperimentFile,
        setup: &Setup,
        progress: impl FnMut(usize, usize),
    ) -> Result<Self, InputError> {
        let started = std::time::Instant::now();
        let recording = lockstep::run(setup, progress)?;
        let facts = RunFacts {
            wall_s: started.elapsed().as_secs_f64(),
            simulated_s: recording.time_s(recording.frames.len()),
            control_ticks: recording.control_ticks,
            deadline_misses: recording.deadline_misses,
        };
        let summary = summarise(experiment, &recording.signals(setup.plant.counts_per_rev), facts)?;
        Ok(Self { name: experiment.name.clone(), title: experiment.title.clone(), recording, summary })
    }

    /// A page with this run alone.
    #[must_use]
    pub fn page(&self) -> Page {
        let charts = charts::own_experiment(self).into_iter().map(Block::Chart);
        Page {
            title: charts::capitalised(&format!("{}: {}", self.label(), self.title)),
            lead: self.sentence(),
            blocks: charts.collect(),
        }
    }

    fn sentence(&self) -> String {
        let s = &self.summary;
        let (what, found) = findings::verdict(self);
        let general = s.friction_peak_nm.zip(s.friction_settled_nm).map(|(peak, settled)| {
            format!(" Friction peaks at {peak:.3} N m and settles at {settled:.3} N m.")
        });
        let known = self.name.starts_with("fig") || self.recording.fault.is_some();
        let first = if known { format!("What must be seen: {what}. Found: {found}.") } else { String::new() };
        format!("{first}{}", general.unwrap_or_default()).trim().to_string()
    }

    /// "fig. 18" for "fig18".
    #[must_use]
    pub fn label(&self) -> String {
        self.name.strip_prefix("fig").map_or_else(|| self.name.clone(), |number| format!("fig. {number}"))
    }
}

/// Everything the page is made of.
#[derive(Debug, Clone)]
pub struct Runs {
    /// Figs. 18–23.
    pub closed_loop: Vec<ClosedLoop>,
    /// The five models at the speeds of Figs. 18–21.
    pub comparisons: Vec<Comparison>,
    /// Fig. 26.
    pub crossing: Crossing,
    /// Fig. 27.
    pub sweep: Sweep,
    /// The rubber.
    pub rubber: SeriesParameters<f64>,
}

impl Runs {
    /// Runs everything with the assumed rig and the assumed rubber.
    ///
    /// # Errors
    /// What plant or core refuse.
    pub fn new(progress: &mut impl FnMut(usize, usize, &str)) -> Result<Self, InputError> {
        let rig = RigFile::assumed_rig(&[])?;
        let model = ModelFile::assumed(&[])?;
        let rubber = rubber_of(&ElementParameters::from_file(&model))
            .ok_or_else(|| InputError::new("the assumed rubber is no series element"))?;
        let total = STEPS;
        let mut closed_loop = Vec::new();
        let mut comparisons = Vec::new();
        for (done, name) in CLOSED_LOOP.iter().enumerate() {
            progress(done, total, name);
            let experiment = ExperimentFile::named_or_read(name, &[])?;
            let setup = Setup::from_files(&experiment, &rig, &model, &model)?;
            closed_loop.push(ClosedLoop::run(&experiment, &setup, |_, _| {})?);
        }
        for (k, name) in CLOSED_LOOP.iter().take(LOAD_STEPS).enumerate() {
            progress(CLOSED_LOOP.len() + k, total, "five models");
            let experiment = ExperimentFile::named_or_read(name, &[])?;
            let setup = Setup::from_files(&experiment, &rig, &model, &model)?;
            let speed = reference_speed(&experiment, rig.friction_radius_m);
            comparisons.push(Comparison::run(&experiment, &setup, &closed_loop[k], &rubber, speed)?);
        }
        progress(total - 3, total, "fig26, fig27");
        let study = |name| ExperimentFile::named_or_read(name, &[]).map(|e| e.study);
        let named = |e: ParameterError| InputError::from(e).file("assumed rubber");
        let (Study::PatchCrossing(slip), Study::SpeedSweep(sweep)) = (study("fig26")?, study("fig27")?)
        else {
            return Err(InputError::new("fig26 and fig27 are not the studies they should be"));
        };
        let crossing = patch_crossing::run(&slip, &rubber).map_err(named)?;
        let sweep = speed_sweep::run(&sweep, &rubber).map_err(named)?;
        progress(total - 1, total, "the hidden effect");
        Ok(Self { closed_loop, comparisons, crossing, sweep, rubber })
    }

    /// The run of a name.
    #[must_use]
    pub fn named(&self, name: &str) -> Option<&ClosedLoop> {
        self.closed_loop.iter().find(|run| run.name == name)
    }
}
