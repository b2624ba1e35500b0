//! Commissioning: from a rig that was just wired to one that may run experiments, step by step.
//!
//! No step enables more than the steps before it have shown to be safe. What the chip reads is looked at first, then
//! what a person does by hand, then the drives without torque, then a small torque of each motor, then the speed loop.
//! The first step in which something is wrong is the last one.
//!
//! | step | shows | drives |
//! |---|---|---|
//! | `identity` | who answers, the settings in force, that the chip computes as this computer does | off |
//! | `timing` | rate and jitter of the control tick | off |
//! | `channels` | supply and raw codes of every analogue channel | off |
//! | `switches` | emergency stop, arm switch, the drives' fault lines | off |
//! | `encoders` | direction and counts, turned by hand | off |
//! | `bridges` | sign, scale and linearity, by known weights | off |
//! | `arming` | enabled at zero torque, nothing moves | on, no torque |
//! | `torque` | reference, amplifier, drive and monitor agree, and the motor turns the right way | small torque |
//! | `speed` | the speed loop holds a slow speed and comes to rest | slow |
//! | `trips` | each trip, provoked and seen | on, no torque; slow |

mod arming;
mod bridges;
mod channels;
mod encoders;
mod identity;
pub mod line_fit;
pub mod report;
mod rig;
mod speed;
mod switches;
mod timing;
mod torque;
mod trips;

pub use report::Report;
pub use rig::{Person, Rig};

use model_core::control::Fault;
use serde::Serialize;

use crate::input_error::InputError;
use line_fit::LineFit;

/// Known torques to hang on the torque ring, where nothing else is said, N·m.
pub const FRICTION_LOADS_NM: [f64; 3] = [2.0, 4.0, 6.0];
/// Known forces to hang on the frame, where nothing else is said, N.
pub const NORMAL_LOADS_N: [f64; 3] = [20.0, 50.0, 100.0];

/// How it is done.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Known torques that are hung on the torque ring, N·m; positive as the road would drag it when the disc turns
    /// forward.
    pub friction_loads_nm: Vec<f64>,
    /// Known forces that are hung on the frame, N; positive as the elements press.
    pub normal_loads_n: Vec<f64>,
    /// Torque of M2 that surely turns the disc, N·m.
    pub small_torque_nm: f64,
    /// How long to wait for a person, s.
    pub patience_s: f64,
    /// How far the control rate may be from its nominal value by this computer's clock, as a share.
    pub clock_tolerance: f64,
    /// Store the scales that the weights gave.
    pub store: bool,
}

/// One thing that was looked at.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// The step it belongs to.
    pub step: &'static str,
    /// What was looked at.
    pub what: String,
    /// What was found, with its unit.
    pub found: String,
    /// What is allowed.
    pub allowed: String,
    /// Whether it is as it should be.
    pub passed: bool,
    /// What to do where it is not.
    pub advice: Option<String>,
}

/// A line through calibration points.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Calibration {
    /// Of what.
    pub name: String,
    /// Quantity and unit of the abscissa.
    pub x: &'static str,
    /// Quantity and unit of the ordinate.
    pub y: &'static str,
    /// The line.
    pub fit: LineFit,
}

/// Why a step went no further.
#[derive(Debug)]
pub enum Stop {
    /// A check failed; it is on record.
    Failed,
    /// The rig is lost, or a person ended it.
    Error(InputError),
}

impl From<InputError> for Stop {
    fn from(error: InputError) -> Self {
        Self::Error(error)
    }
}

/// The steps with their names, in order.
type Step = (&'static str, fn(&mut Commissioning<'_, '_>) -> Result<(), Stop>);
const STEPS: [Step; 10] = [
    ("identity", identity::step),
    ("timing", timing::step),
    ("channels", channels::step),
    ("switches", switches::step),
    ("encoders", encoders::step),
    ("bridges", bridges::step),
    ("arming", arming::step),
    ("torque", torque::step),
    ("speed", speed::step),
    ("trips", trips::step),
];

/// Names of the steps, in order.
#[must_use]
pub fn steps() -> [&'static str; 10] {
    STEPS.map(|(name, _)| name)
}

/// A commissioning on its way.
pub struct Commissioning<'a, 'b> {
    /// The rig.
    pub rig: &'b mut Rig<'a>,
    /// How it is done.
    pub options: &'b Options,
    step: &'static str,
    report: Report,
}

impl Commissioning<'_, '_> {
    /// Puts a check on record and shows it.
    fn check(&mut self, what: &str, found: impl Into<String>, allowed: &str, passed: bool, advice: &str) {
        let advice = (!passed).then(|| advice.to_owned());
        let (step, what, allowed) = (self.step, what.to_owned(), allowed.to_owned());
        let check = Check { step, what, found: found.into(), allowed, passed, advice };
        self.rig.say(&check.line());
        self.report.checks.push(check);
    }

    /// Ends the step where a check of it has failed.
    fn settle(&self) -> Result<(), Stop> {
        let failed = self.report.checks.iter().any(|check| check.step == self.step && !check.passed);
        if failed { Err(Stop::Failed) } else { Ok(()) }
    }

    /// The same for a fault that came meanwhile.
    fn no_fault(&mut self, during: &str, advice: &str) -> Result<(), Stop> {
        if let Some(fault) = self.rig.fault() {
            let advice = self.advice_or_silence(advice);
            self.check(during, fault, "no fault", false, advice);
        }
        self.settle()
    }

    /// What a step advises, unless it was this program that was not heard.
    fn advice_or_silence<'t>(&self, advice: &'t str) -> &'t str {
        if self.rig.row.fault == Fault::LinkLost.number() {
            "no fault of the wires: this computer was too busy to be heard in time; run it again with less beside it"
        } else {
            advice
        }
    }
}

impl Check {
    /// The check as a line.
    #[must_use]
    pub fn line(&self) -> String {
        let Self { step, what, found, allowed, .. } = self;
        let mark = if self.passed { "ok  " } else { "FAIL" };
        let advice = self.advice.as_ref().map_or_else(String::new, |advice| format!("\n       {advice}"));
        format!("{mark} {step:9} {what}: {found} (allowed: {allowed}){advice}")
    }
}

/// Commissions a rig, to the end or to the first step in which something is wrong; with the error where the rig was
/// lost or a person ended it. Drives are off and limits are as they were when it returns, unless the rig cannot be
/// reached.
pub fn commission(rig: &mut Rig<'_>, options: &Options) -> (Report, Option<InputError>) {
    let mut commissioning = Commissioning { rig, options, step: "", report: Report::default() };
    let mut error = None;
    for (number, (name, step)) in STEPS.into_iter().enumerate() {
        commissioning.step = name;
        commissioning.rig.say(&format!("step {} of {}: {name}", number + 1, STEPS.len()));
        match step(&mut commissioning) {
            Ok(()) => commissioning.report.steps_done.push(name),
            Err(Stop::Failed) => break,
            Err(Stop::Error(why)) => {
                error = Some(why);
                break;
            }
        }
    }
    commissioning.rig.leave();
    (commissioning.report, error)
}
