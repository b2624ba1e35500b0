//! What every subsystem offers to the comparison of causes, and what a fit of it gives back.
//!
//! A subsystem fits its baseline together with any set of its effects. The fit is judged by residuals
//! divided by the standard deviation that they would have if the model were true: sensor noise plus
//! what the noise of the measured inputs does to the prediction. So 1 is noise in every channel, and
//! channels of different units can be added. Samples that tell nothing (saturated, sticking where the
//! motion is below the encoder's resolution, drive at rest) are masked with NaN, not set to zero.

use crate::files::effect_id::Subsystem;

/// A subsystem whose baseline can be fitted with and without effects.
pub trait Analysis: Sync {
    /// The part of the rig, for the tables of results.
    fn subsystem(&self) -> Subsystem;

    /// Name of the baseline in the results: the model's kind, `"drive"`, `"pressure"`.
    fn baseline_kind(&self) -> &str;

    /// Ids of the effects that can be added here, in the order of the contract. They may belong to
    /// another subsystem of the contract: the encoder's eccentricity shows in the drive.
    fn candidates(&self) -> Vec<&'static str>;

    /// Effects that the logs show by themselves, without a fit: the search begins with them.
    fn seen(&self) -> Vec<&'static str> {
        Vec::new()
    }

    /// Fits baseline and effects together to the training logs and evaluates all logs. `near` is a fit
    /// with fewer effects to start from.
    ///
    /// The error is a sentence: why this combination cannot be fitted to these logs.
    fn fit(&self, effects: &[&'static str], near: Option<&Fit>) -> Result<Fit, String>;

    /// Parameters of an effect that are read off the training logs instead of being fitted: names with units, values.
    fn constants(&self, _effect: &str) -> Vec<(&'static str, f64)> {
        Vec::new()
    }

    /// What sets this effect apart from its rivals, as seen in a fit that has it: sentences with numbers.
    fn evidence(&self, effect: &'static str, fit: &Fit) -> Vec<String>;
}

/// A parameter with its uncertainty.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Effect that the parameter belongs to; `None` is the baseline.
    pub effect: Option<&'static str>,
    /// Name with unit.
    pub name: String,
    /// Value.
    pub value: f64,
    /// Standard deviation; NaN where the logs do not determine the parameter.
    pub std: f64,
    /// Log that the parameter belongs to, for origins and initial states that logs do not share.
    pub log: Option<usize>,
}

/// Which use a log has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// Parameters are fitted to it.
    Train,
    /// Only origins and initial states are fitted to it.
    Holdout,
}

/// A residual over time, normalised: 1 is what noise alone would give.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Channel {
    /// Name for tables and plots.
    pub name: &'static str,
    /// Time of each residual, s.
    pub time_s: Vec<f64>,
    /// Residual (measured − predicted) over its expected standard deviation; NaN is masked.
    pub residual: Vec<f64>,
    /// Derivative of `residual` by each free parameter, in the order of [`Fit::parameters`]; a column
    /// may be empty where it is zero. Empty altogether where it is not known.
    pub sensitivity: Vec<Vec<f64>>,
    /// How many neighbouring residuals share one independent noise value: 1 for white noise, the
    /// sampling rate over twice the corner frequency after a low-pass.
    pub samples_per_noise: f64,
}

/// A log as a fit sees it.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFit {
    /// Fitted or held out.
    pub role: Role,
    /// Time of `measured` and `predicted`, s.
    pub time_s: Vec<f64>,
    /// The subsystem's signal as measured, in the log's units.
    pub measured: Vec<f64>,
    /// The same as predicted.
    pub predicted: Vec<f64>,
    /// Standard deviation of `measured − predicted` if the model were true, per sample.
    pub noise_std: Vec<f64>,
    /// Whether a sample counts in the error.
    pub used: Vec<bool>,
    /// Normalised residuals; the first is that of `measured`, others are further witnesses.
    pub channels: Vec<Channel>,
}

/// A fitted combination of effects.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    /// Effects in it, beside the baseline.
    pub effects: Vec<&'static str>,
    /// Free parameters with their estimates.
    pub parameters: Vec<Estimate>,
    /// Training logs first, then those held out.
    pub logs: Vec<LogFit>,
}

impl Fit {
    /// A parameter of the baseline (`None`) or of an effect.
    pub fn get(&self, effect: Option<&str>, name: &str) -> Option<&Estimate> {
        self.parameters.iter().find(|p| p.effect == effect && p.name == name)
    }

    /// RMS error over RMS of the measured signal, over all logs of a role. `None` where nothing is
    /// measured in it.
    pub fn nrmse(&self, role: Role) -> Option<f64> {
        self.relative(role, |log, i| log.measured[i] - log.predicted[i])
    }

    /// The nrmse that a true model would have.
    pub fn noise_floor(&self, role: Role) -> Option<f64> {
        self.relative(role, |log, i| log.noise_std[i])
    }

    fn relative(&self, role: Role, error: impl Fn(&LogFit, usize) -> f64) -> Option<f64> {
        let (mut errors, mut signal) = (0.0, 0.0);
        for log in self.logs.iter().filter(|log| log.role == role) {
            for i in (0..log.measured.len()).filter(|i| log.used[*i]) {
                errors += error(log, i).powi(2);
                signal += log.measured[i].powi(2);
            }
        }
        (signal > 0.0).then(|| (errors / signal).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_counts_only_used_samples_of_the_asked_logs() {
        let log = |role, predicted| LogFit {
            role,
            time_s: vec![0.0, 0.1, 0.2],
            measured: vec![3.0, 4.0, 100.0],
            predicted: vec![3.0, predicted, 0.0],
            noise_std: vec![1.0; 3],
            used: vec![true, true, false],
            channels: vec![],
        };
        let fit = Fit {
            effects: vec![],
            parameters: vec![],
            logs: vec![log(Role::Train, 3.0), log(Role::Holdout, 4.0)],
        };
        assert_eq!(fit.nrmse(Role::Train), Some(0.2));
        assert_eq!(fit.nrmse(Role::Holdout), Some(0.0));
        assert_eq!(fit.noise_floor(Role::Train), Some((2.0f64 / 25.0).sqrt()));
    }
}
