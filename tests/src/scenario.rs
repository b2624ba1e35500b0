//! What is asked of the generator, and what it gives back.

use std::fmt;
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use serde::Serialize;

use crate::effect::Effect;
use crate::imperfections::Imperfection;
use crate::laws::LawFamily;
use crate::random::Stream;

/// Friction model behind the log where no effect changes it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Base {
    /// Series element (four of five) or LuGre, by the seed.
    #[default]
    BySeed,
    /// LuGre bristles.
    Lugre,
    /// Elastic, damped block in series with LuGre bristles.
    Series,
    /// The modified model with its implicit slip.
    ModifiedLugre,
}

/// What is logged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum)]
pub enum Form {
    /// Elements on the disc, every column.
    #[default]
    Contact,
    /// The rotary drive alone.
    Drive,
    /// A linear stage.
    LinearStage,
}

/// Which motions and loads are run.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Plan {
    /// A shuffled deck of dwells, slides, ramps, sines, reversals, load changes and torque parts.
    #[default]
    Random,
    /// Speed step at low load, then load step (the paper's figures 18 to 21): three speeds to train
    /// on, the fourth held out. Contact logs only; 8 s each.
    Paper,
    /// By the seed: decks of 20 s (six of ten), 10 s (two) and 60 s (one), or the paper's course (one) where that
    /// can show the effects.
    Drawn,
}

/// A case to generate.
#[derive(Debug, Clone, PartialEq)]
pub struct Scenario {
    /// Hidden effects; none is a case too.
    pub effects: Vec<Effect>,
    /// Decides every random draw.
    pub seed: u64,
    /// Rate of the log; 40 kHz divided by a whole number.
    pub rate_hz: f64,
    /// Factor on every sensor's noise; 0 is allowed.
    pub noise_factor: f64,
    /// Friction model behind the log.
    pub base: Base,
    /// What is logged.
    pub form: Form,
    /// Which motions are run.
    pub plan: Plan,
    /// Length of each log (random plan; 20 s are the paper's 8 s, and drawn where the plan is).
    pub duration_s: f64,
    /// Relative error (standard deviation) of the rig file against the true rig.
    pub rig_file_error: f64,
    /// Laws behind the effects.
    pub laws: LawFamily,
    /// How imperfect the logs are.
    pub imperfection: Imperfection,
    /// Whether the log has a surface temperature.
    pub temperature_sensor: bool,
}

impl Scenario {
    /// These effects, two training logs and one held out of 20 s at 1 kHz; a rig file 5 % off, mild imperfections.
    #[must_use]
    pub fn new(effects: &[Effect], seed: u64) -> Self {
        Self {
            effects: effects.to_vec(),
            seed,
            rate_hz: 1000.0,
            noise_factor: 1.0,
            base: Base::default(),
            form: Form::default(),
            plan: Plan::default(),
            duration_s: 20.0,
            rig_file_error: 0.05,
            laws: LawFamily::default(),
            imperfection: Imperfection::default(),
            temperature_sensor: false,
        }
    }

    /// The same with nothing left to draw about its plan.
    #[must_use]
    pub fn with_plan_drawn(&self) -> Self {
        if self.plan != Plan::Drawn {
            return self.clone();
        }
        let draw = Stream::new(self.seed, "plan").uniform(0.0, 1.0);
        let papers =
            self.form == Form::Contact && self.effects.iter().all(|effect| effect.shows_in_the_papers_plan());
        let (plan, duration_s) = match draw {
            d if d < 0.2 => (Plan::Random, 10.0),
            d if d < 0.3 => (Plan::Random, 60.0),
            d if d < 0.4 && papers => (Plan::Paper, 8.0),
            _ => (Plan::Random, 20.0),
        };
        Self { plan, duration_s, ..self.clone() }
    }
}

/// Why a scenario cannot be generated.
#[derive(Debug, Clone, PartialEq)]
pub enum ScenarioError {
    /// The rate does not divide the generator's.
    Rate(f64),
    /// A log must last at least 2 s.
    Duration(f64),
    /// The effect needs the elements on the disc.
    NeedsContact(Effect),
    /// The two effects exclude each other.
    Exclusive(Effect, Effect),
    /// The plan is for contact logs.
    PlanNeedsContact,
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Rate(rate) => write!(f, "rate {rate} Hz: 40000 Hz must be a whole multiple of it"),
            Self::Duration(duration) => write!(f, "duration {duration} s: at least 2 s"),
            Self::NeedsContact(effect) => write!(f, "{} needs a contact log", effect.id()),
            Self::Exclusive(a, b) => write!(f, "{} and {} exclude each other", a.id(), b.id()),
            Self::PlanNeedsContact => write!(f, "the paper's plan needs a contact log"),
        }
    }
}

impl std::error::Error for ScenarioError {}

/// A generated case: what a diagnosis gets, and the truth that it does not.
#[derive(Debug, Clone)]
pub struct GeneratedCase {
    /// Training logs as CSV text.
    pub train: Vec<String>,
    /// Log held out, as CSV text.
    pub holdout: String,
    /// Rig file. Empty for a linear stage.
    pub rig_toml: String,
    /// Baseline model file. Empty where there is no contact.
    pub model_toml: String,
    /// The answer.
    pub truth: crate::truth::Truth,
}

impl GeneratedCase {
    /// Writes the case to a folder, which is made if it is not there: `train1.csv` …, `holdout.csv`, and
    /// `rig.toml` and `model.toml` where the case has them. The truth is not written. Gives the paths.
    ///
    /// # Errors
    /// Where the folder or a file cannot be written.
    pub fn write(&self, folder: &Path) -> std::io::Result<CasePaths> {
        std::fs::create_dir_all(folder)?;
        let put = |name: &str, text: &str| {
            let path = folder.join(name);
            std::fs::write(&path, text).map(|()| path)
        };
        let train = self
            .train
            .iter()
            .enumerate()
            .map(|(i, text)| put(&format!("train{}.csv", i + 1), text))
            .collect::<Result<_, _>>()?;
        let maybe =
            |name: &str, text: &str| if text.is_empty() { Ok(None) } else { put(name, text).map(Some) };
        Ok(CasePaths {
            train,
            holdout: put("holdout.csv", &self.holdout)?,
            rig: maybe("rig.toml", &self.rig_toml)?,
            model: maybe("model.toml", &self.model_toml)?,
        })
    }
}

/// Where a case was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CasePaths {
    /// Training logs.
    pub train: Vec<PathBuf>,
    /// Log held out.
    pub holdout: PathBuf,
    /// Rig file.
    pub rig: Option<PathBuf>,
    /// Baseline model file.
    pub model: Option<PathBuf>,
}
