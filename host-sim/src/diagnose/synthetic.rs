//! A subsystem for tests: waves in white noise, and a least-squares fit of any of them.
//!
//! r = e + Σ aₖ wₖ with e white noise of variance 1, wₖ the wave of an effect: a sine over time with a frequency of its
//! own. A fit of effects takes their waves off by least squares over the training logs. An effect whose size is 0 in a
//! log is not in it; the fit puts it there all the same, as a model would.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::analysis::{Analysis, Channel, Estimate, Fit, LogFit, Role};
use super::contact::ContactAnalysis;
use super::noise::tests::white;
use super::selection::select;
use super::verdict::{Cause, Judged, Verdict, judge};
use crate::files::effect_id::Subsystem;
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;

/// Samples of a log.
pub(super) const COUNT: usize = 4000;
/// Time between them, s.
const STEP_S: f64 = 0.01;
/// Amplitude of the signal that the residual belongs to, in standard deviations of the noise.
const SIGNAL: f64 = 20.0;

/// An effect that can be fitted.
pub(super) struct Wave {
    pub id: &'static str,
    /// Amplitude in the training logs, in standard deviations of the noise.
    pub trained: f64,
    /// The same in the held-out log.
    pub held_out: f64,
}

/// An effect with the same size in all logs.
pub(super) fn wave(id: &'static str, size: f64) -> Wave {
    Wave { id, trained: size, held_out: size }
}

/// The subsystem.
pub(super) struct Waves {
    pub subsystem: Subsystem,
    pub waves: Vec<Wave>,
    /// Amplitude of a wave that no effect has.
    pub unexplained: f64,
    /// Two effects that have the first one's wave.
    pub twins: Option<(&'static str, &'static str)>,
    /// From one effect's frequency to the next, rad/s.
    pub spread_rad_s: f64,
}

impl Waves {
    pub(super) fn new(waves: Vec<Wave>) -> Self {
        Self { subsystem: Subsystem::Friction, waves, unexplained: 0.0, twins: None, spread_rad_s: 0.37 }
    }

    /// Selects and judges, without quantities to sort by.
    pub(super) fn judged(self) -> Judged {
        let selection = select(&self, &|_| ()).unwrap();
        judge(Arc::new(self), selection, &[])
    }

    /// The shape of an effect, or of what no effect has.
    fn shape(&self, which: Option<usize>) -> Vec<f64> {
        let angular = which.map_or(2.9, |k| 1.1 + self.spread_rad_s * k as f64);
        (0..COUNT).map(|i| (angular * STEP_S * i as f64).sin()).collect()
    }

    fn residual(&self, log: usize, role: Role) -> Vec<f64> {
        let mut residual = white(COUNT, 3 + log as u64);
        let mut add = |size: f64, shape: Vec<f64>| {
            residual.iter_mut().zip(shape).for_each(|(r, x)| *r += size * x);
        };
        for (k, wave) in self.waves.iter().enumerate() {
            add(if role == Role::Train { wave.trained } else { wave.held_out }, self.shape(Some(k)));
        }
        add(self.unexplained, self.shape(None));
        residual
    }
}

/// A subsystem about which something was said, whatever the reason.
pub(super) fn said(subsystem: Subsystem, verdict: Verdict, ids: &[&'static str]) -> Judged {
    let mut judged = Waves { subsystem, ..Waves::new(Vec::new()) }.judged();
    judged.verdict = verdict;
    let cause = |id: &&'static str| Cause { id, probability: 0.9, weight: 50.0, evidence: Vec::new() };
    judged.causes = ids.iter().map(cause).collect();
    judged
}

/// A contact log: elements slide steadily under a load that swings from 30 to 70 N, with a coefficient of 0.7. Where
/// `limit` is given, that channel shows nothing above it.
pub(super) fn sliding_log(limit: Option<(Signal, f64)>) -> Log {
    let time: Vec<f64> = (0..2500).map(|i| 2e-3 * f64::from(i)).collect();
    let noise = |seed, std: f64| white(time.len(), seed).into_iter().map(move |e| std * e);
    let load: Vec<f64> =
        time.iter().zip(noise(11, 0.2)).map(|(t, e)| 50.0 + 20.0 * (2.0 * t).sin() + e).collect();
    let friction = load.iter().zip(noise(12, 0.01)).map(|(load, e)| 0.06 * 0.7 * load + e).collect();
    let mut log = Log::default();
    log.set_signal(Signal::M2Speed, noise(13, 1e-3).map(|e| 3.0 + e).collect());
    log.set_signal(Signal::NormalForce, load);
    log.set_signal(Signal::FrictionTorque, friction);
    if let Some((signal, limit)) = limit {
        let shown = log.signal(signal).unwrap().iter().map(|x| x.min(limit)).collect();
        log.set_signal(signal, shown);
    }
    log.set_signal(Signal::Time, time);
    log
}

/// The analysis of a log to fit to and of one that is held out.
pub(super) fn contact_of(train: &Log, holdout: &Log) -> ContactAnalysis {
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    ContactAnalysis::new(&rig, &model, &[(train, Role::Train), (holdout, Role::Holdout)]).unwrap()
}

impl Analysis for Waves {
    fn subsystem(&self) -> Subsystem {
        self.subsystem
    }

    fn baseline_kind(&self) -> &str {
        "noise"
    }

    fn candidates(&self) -> Vec<&'static str> {
        self.waves.iter().map(|wave| wave.id).collect()
    }

    fn fit(&self, effects: &[&'static str], _near: Option<&Fit>) -> Result<Fit, String> {
        if self.twins.is_some_and(|(one, other)| effects.contains(&one) && effects.contains(&other)) {
            return Err("one wave cannot be fitted twice".into());
        }
        let roles = [Role::Train, Role::Train, Role::Holdout];
        let residuals: Vec<Vec<f64>> =
            roles.iter().enumerate().map(|(i, role)| self.residual(i, *role)).collect();
        let at = |id: &&'static str| {
            let twin = self.twins.filter(|(_, twin)| twin == id);
            let id = twin.map_or(*id, |(first, _)| first);
            self.waves.iter().position(|wave| wave.id == id).ok_or("not an effect here")
        };
        let shapes: Vec<Vec<f64>> =
            effects.iter().map(|id| Ok(self.shape(Some(at(id)?)))).collect::<Result<_, &str>>()?;
        let count = shapes.len();
        let mut sizes = vec![0.0; count];
        if count > 0 {
            let trained: Vec<f64> = residuals[..2].concat();
            let columns = DMatrix::from_fn(trained.len(), count, |i, k| shapes[k][i % COUNT]);
            let right = columns.transpose() * DVector::from_vec(trained);
            let solved = (columns.transpose() * columns).cholesky().ok_or("not independent")?.solve(&right);
            sizes = solved.iter().copied().collect();
        }
        let time_s: Vec<f64> = (0..COUNT).map(|i| STEP_S * i as f64).collect();
        let logs = roles.iter().zip(&residuals).map(|(role, before)| {
            let fitted =
                |i: usize| sizes.iter().zip(&shapes).map(|(size, shape)| size * shape[i]).sum::<f64>();
            let signal = |i: usize| SIGNAL * (0.5 * time_s[i]).cos();
            let residual: Vec<f64> = (0..COUNT).map(|i| before[i] - fitted(i)).collect();
            let channel = Channel {
                name: "wave",
                time_s: time_s.clone(),
                residual,
                sensitivity: vec![],
                samples_per_noise: 1.0,
            };
            LogFit {
                role: *role,
                time_s: time_s.clone(),
                measured: (0..COUNT).map(|i| signal(i) + before[i]).collect(),
                predicted: (0..COUNT).map(|i| signal(i) + fitted(i)).collect(),
                noise_std: vec![1.0; COUNT],
                used: vec![true; COUNT],
                channels: vec![channel],
            }
        });
        let estimate = |(id, value): (&&'static str, &f64)| Estimate {
            effect: Some(id),
            name: "size".into(),
            value: *value,
            std: (1.0 / COUNT as f64).sqrt(),
            log: None,
        };
        let logs = logs.collect();
        Ok(Fit {
            effects: effects.to_vec(),
            parameters: effects.iter().zip(&sizes).map(estimate).collect(),
            logs,
        })
    }

    fn evidence(&self, _effect: &'static str, _fit: &Fit) -> Vec<String> {
        Vec::new()
    }
}
