//! The contact as a subsystem of a diagnosis: friction torque and what measures it.
//!
//! What is minimised, and why, is said in [`problem`](super::problem). The measured and predicted torque
//! of a fit are compared at every sample of the record; the residuals that causes are judged by are those
//! of the bins that were fitted. Where M2's torque was logged, the balance of the disc
//! ([`witness`](super::witness)) is a second channel. Logs that are held out have a balance of their own.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use model_core::extension::Extension;
use rayon::prelude::*;

use super::evidence;
use super::output;
use super::problem::{Combination, Fitted, Problem};
use crate::diagnose::analysis::{Analysis, Fit, Role};
use crate::diagnose::effects;
use crate::diagnose::record::{Measured, Record};
use crate::files::effect_id::{Subsystem, subsystem_of};
use crate::files::log::Log;
use crate::files::model_file::ModelFile;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;
use crate::input_error::InputError;

/// Rates of a drift that are of the friction bridge: the first ones.
const FRICTION_RATES: usize = 2;
/// Fewest samples of a channel that clips.
const FEWEST_CLIPPED: usize = 20;

/// Times and values.
pub type Series = (Vec<f64>, Vec<f64>);

/// The contact's analysis of a set of logs.
pub struct ContactAnalysis {
    problem: Problem,
    source: String,
    fitted: Mutex<HashMap<Vec<&'static str>, Arc<Fitted>>>,
}

impl ContactAnalysis {
    /// Prepares logs and fits the baseline to those for training.
    pub fn new(rig: &RigFile, model: &ModelFile, logs: &[(&Log, Role)]) -> Result<Self, InputError> {
        let mut sorted: Vec<&(&Log, Role)> = logs.iter().collect();
        sorted.sort_by_key(|(_, role)| *role == Role::Holdout);
        if sorted.first().is_none_or(|(_, role)| *role == Role::Holdout) {
            return Err(InputError::new("no log to fit to").allowed("one training log or more"));
        }
        let records = sorted
            .into_par_iter()
            .map(|(log, role)| Record::new(log, *role, rig))
            .collect::<Result<Vec<_>, _>>()?;
        let problem = Problem::new(rig, model, records)?;
        let analysis = Self { problem, source: model.source.clone(), fitted: Mutex::default() };
        analysis.fitted(&[], None).map_err(|why| InputError::new(why).file(model.source.as_str()))?;
        Ok(analysis)
    }

    /// The prepared records, training first.
    pub fn records(&self) -> &[Record] {
        &self.problem.records
    }

    /// The channel that clips in the training logs, the one that does so more, and how many samples do.
    pub fn clipped(&self) -> Option<(Signal, usize)> {
        let train = || self.records().iter().filter(|record| record.role == Role::Train);
        let count = |channel: &Measured| (0..channel.values.len()).filter(|i| channel.clipped(*i)).count();
        let friction: usize = train().map(|record| count(&record.friction_nm)).sum();
        let normal: usize = train().map(|record| count(&record.normal_n)).sum();
        let (channel, samples) = if friction > normal {
            (Signal::FrictionTorque, friction)
        } else {
            (Signal::NormalForce, normal)
        };
        (samples >= FEWEST_CLIPPED).then_some((channel, samples))
    }

    /// The fitted model as a file: refitted baseline, its intervals, and an extension for each effect.
    /// An elastic element is no extension: it makes the model one of the series kind.
    pub fn to_model_file(&self, fit: &Fit) -> Result<ModelFile, InputError> {
        let fitted = self.fitted(&fit.effects, None).map_err(InputError::new)?;
        output::model_file(&self.problem, &fitted, fit, &self.source)
    }

    /// What the measurement effects of a fit add to the friction torque that the channel shows, for each
    /// log (training first) at the times of its record: to be taken off by who needs the torque itself.
    pub fn shown_in_excess(&self, fit: &Fit) -> Result<Vec<Series>, String> {
        let fitted = self.fitted(&fit.effects, None)?;
        let excess = |log: usize| {
            let mut model = self.problem.model_with(&fitted, log, self.problem.origin(&fitted, log));
            let shown = self.problem.run_samples(&model, log)?.shown_nm;
            let of_contact = |id| subsystem_of(id) != Some(Subsystem::Measurement);
            model.effects.retain(|(e, _)| of_contact(e.id()) || *e == Extension::BridgeDrift);
            // A drift of the normal bridge is in the load, not in what the friction channel adds.
            for (_, rates) in model.effects.iter_mut().filter(|(e, _)| *e == Extension::BridgeDrift) {
                rates[..FRICTION_RATES].fill(0.0);
            }
            let plain = self.problem.run_samples(&model, log)?.shown_nm;
            let excess = shown.iter().zip(&plain).map(|(a, b)| a - b).collect();
            Ok((self.problem.records[log].time_s.clone(), excess))
        };
        let all: Result<Vec<_>, InputError> = (0..self.problem.records.len()).map(excess).collect();
        all.map_err(|e| e.to_string())
    }

    fn known(&self, effects: &[&'static str]) -> Option<Arc<Fitted>> {
        self.fitted.lock().unwrap_or_else(PoisonError::into_inner).get(&sorted(effects)).cloned()
    }

    /// Fits a combination again, from one with the same or more effects, and keeps the better.
    fn again(&self, effects: &[&'static str], known: &Arc<Fitted>, larger: &Arc<Fitted>) -> Arc<Fitted> {
        let again = self.problem.fit_again(known, larger);
        let mut fitted = self.fitted.lock().unwrap_or_else(PoisonError::into_inner);
        fitted.insert(sorted(effects), again.clone());
        again
    }

    /// The fit of a combination, from that of another one.
    fn fitted(&self, effects: &[&'static str], near: Option<&Fit>) -> Result<Arc<Fitted>, String> {
        let more = near.filter(|fit| effects.iter().all(|id| fit.effects.contains(id)));
        if let Some(known) = self.known(effects) {
            return match more.and_then(|fit| self.known(&fit.effects)) {
                Some(larger) => Ok(self.again(effects, &known, &larger)),
                None => Ok(known),
            };
        }
        let failed = || format!("no finite prediction with {}", effects.join(", "));
        let mut best = match near.and_then(|fit| self.known(&fit.effects)).or_else(|| self.known(&[])) {
            Some(start) => start,
            None => self.problem.fit(&Vec::new(), None).ok_or_else(failed)?,
        };
        let kept: Combination =
            best.combination.iter().copied().filter(|(id, _)| effects.contains(id)).collect();
        if kept.len() < best.combination.len() {
            best = self.problem.fit(&kept, Some(&best)).ok_or_else(failed)?;
        }
        for id in effects {
            if best.combination.iter().any(|(known, _)| known == id) {
                continue;
            }
            let effect = effects::effect(id).ok_or_else(|| format!("{id}: not an effect of the contact"))?;
            if !effect.applies(&self.problem.baseline, &self.problem.scales) {
                return Err(format!("{id} does not apply to this baseline and these logs"));
            }
            let forms = (0..effect.variants()).into_par_iter().filter_map(|variant| {
                let mut combination = best.combination.clone();
                combination.push((effect.id(), variant));
                self.problem.fit(&combination, Some(&best))
            });
            best = forms.min_by(|a, b| a.point.loss.total_cmp(&b.point.loss)).ok_or_else(failed)?;
        }
        self.fitted.lock().unwrap_or_else(PoisonError::into_inner).insert(sorted(effects), best.clone());
        Ok(best)
    }
}

fn sorted(effects: &[&'static str]) -> Vec<&'static str> {
    let mut key = effects.to_vec();
    key.sort_unstable();
    key
}

impl Analysis for ContactAnalysis {
    fn subsystem(&self) -> Subsystem {
        Subsystem::Friction
    }

    fn baseline_kind(&self) -> &str {
        self.problem.baseline.kind.name()
    }

    fn candidates(&self) -> Vec<&'static str> {
        self.problem.conceivable().into_iter().map(|effect| effect.id()).collect()
    }

    fn seen(&self) -> Vec<&'static str> {
        self.clipped().map_or(Vec::new(), |_| vec!["adc_saturation"])
    }

    fn fit(&self, effects: &[&'static str], near: Option<&Fit>) -> Result<Fit, String> {
        let fitted = self.fitted(effects, near)?;
        output::fit(&self.problem, &fitted, effects)
    }

    fn constants(&self, effect: &str) -> Vec<(&'static str, f64)> {
        if effect == "adc_saturation" { output::ends(self.records()) } else { Vec::new() }
    }

    fn evidence(&self, effect: &'static str, fit: &Fit) -> Vec<String> {
        evidence::sentences(effect, fit)
    }
}
