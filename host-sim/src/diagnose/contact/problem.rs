//! The contact as a problem of least squares: any set of effects, fitted jointly with the baseline.
//!
//! **Error model.** The friction torque is noisy, and so are speed and normal force that drive the model.
//! A model cannot be driven with noise-free inputs, so the inputs are smoothed first, and each sample of
//! the residual is divided by √(σ_T² + σ_in² + σ_t²): the channel's noise, what the inputs' noise does to
//! the prediction (measured by running the fitted baseline with the noise put on once more), and a fifth of
//! a sample's change of the torque (the log does not say at which instant within a sample a channel was
//! read). Where the inputs' noise would move the prediction by more than `BLIND` σ_T the sample is masked:
//! stuck on stiff bristles, the force depends on motion below the encoder's resolution.

use std::collections::HashMap;
use std::sync::{Arc, Mutex, OnceLock};

use rayon::prelude::*;

use super::super::effects::{ContactEffect, LIBRARY, Scales, Start, effect};
use super::super::record::Record;
use super::super::search::{self, Point};
use super::baseline;
use super::bins::{self, Bin};
use super::model::{ContactModel, Torques};
use super::plan::Plan;
use super::witness::DriveWitness;
use super::{restored, ringdown, ringing};
use crate::diagnose::analysis::Role;
use crate::files::model_file::{ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::fit::bounds::Parameter;
use crate::input_error::InputError;

/// Input noise, in standard deviations of the channel, beyond which a sample tells nothing.
const BLIND: f64 = 3.0;
/// Part of a sample by which a channel may be late without blame.
const LATENESS: f64 = 0.2;
/// Time over which sliding is told from swinging on the bristles, s …
const STUCK_S: f64 = 6e-3;
/// … if it covers less than so many of their largest deflections.
const STUCK_REACHES: f64 = 6.0;
/// Part of what the ring adds that a record's timing leaves open.
const RING_PHASE: f64 = 0.7;
/// Uncertainty of the level from which a stuck element is wound up, of the sliding friction.
const LEVEL: f64 = 0.006;
/// Relative uncertainty of the load.
const LOAD_GAIN: f64 = 0.01;
/// Friction coefficient that no rest explains, over the largest known one.
const OVERLOAD: f64 = 1.05;
/// Motion that is rest, m, within a time, s.
const REST_M: f64 = 2e-5;
const REST_S: f64 = 0.01;
/// Number of noisy runs that measure what the inputs' noise does.
const NOISY_RUNS: u64 = 3;
/// Renewals of the derivatives in the search from one start, and of the best of them.
const FIRST_ROUNDS: usize = 2;
const ROUNDS: usize = 14;

/// A free parameter and what it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct Slot {
    /// Effect, `None` for the baseline.
    pub effect: Option<&'static str>,
    /// Log that it belongs to, for origins.
    pub log: Option<usize>,
    /// Name, bounds, scale.
    pub parameter: Parameter,
}

/// A combination of effects with the form of each.
pub type Combination = Vec<(&'static str, usize)>;

/// A fitted combination.
#[derive(Debug, Clone)]
pub struct Fitted {
    /// Effects and their forms.
    pub combination: Combination,
    /// Free parameters.
    pub slots: Vec<Slot>,
    /// Values, residuals, derivatives.
    pub point: Point,
}

/// Records, weights and baseline of the contact.
pub struct Problem {
    /// The rig.
    pub rig: RigFile,
    /// The baseline that fits start from.
    pub baseline: ContactModel,
    /// Training logs, then those held out.
    pub records: Vec<Record>,
    /// Bins of each record.
    pub bins: Vec<Vec<Bin>>,
    /// Friction torque of each bin.
    pub measured_nm: Vec<Vec<f64>>,
    /// Steps of each record's bins.
    pub plans: Vec<Plan>,
    /// Steps of each record's samples.
    sample_plans: Vec<Plan>,
    /// Steps of bins and samples with the load beyond the end of a clipped bridge, where that is known.
    restored_plans: Vec<Option<(Plan, Plan)>>,
    /// Expected standard deviation of the residual of each bin; NaN is masked.
    pub sigma_nm: Vec<Vec<f64>>,
    /// What the library knows about the records.
    pub scales: Scales,
    witness: Option<DriveWitness>,
    holdout_witness: Option<DriveWitness>,
    fits: Mutex<HashMap<Combination, Arc<Fitted>>>,
    /// The model as it was given, with derivatives.
    nominal: OnceLock<Fitted>,
}

impl Problem {
    /// Prepares logs (training first), smooths inputs, fits the baseline and sets the weights.
    pub fn new(rig: &RigFile, file: &ModelFile, records: Vec<Record>) -> Result<Self, InputError> {
        let radius_m = rig.friction_radius_m;
        let prepared: Vec<_> = records
            .par_iter()
            .map(|record| {
                let (speed, load) = record.inputs(None);
                let bins = bins::adaptive(record, radius_m, &speed, &load);
                let plans = |load: &[f64]| {
                    let plan = Plan::new(record, &bins, radius_m, &speed, load);
                    (plan, Plan::new(record, &bins::single(record), radius_m, &speed, load))
                };
                let restored = restored::load(record, rig, &load).map(|load| plans(&load));
                let (plan, samples) = plans(&load);
                ((bins, restored), (plan, samples))
            })
            .collect();
        type Both<A, B> = (Vec<A>, Vec<B>);
        let (bins, plans): Both<_, (Plan, Plan)> = prepared.into_iter().unzip();
        let (bins, restored_plans): Both<Vec<Bin>, Option<(Plan, Plan)>> = bins.into_iter().unzip();
        let (plans, sample_plans): Both<Plan, Plan> = plans.into_iter().unzip();
        let measured_nm = records
            .iter()
            .zip(&bins)
            .map(|(record, bins)| bins.iter().map(|bin| bin.mean(&record.friction_nm.values)).collect())
            .collect();
        let baseline = ContactModel::new(file);
        let scales = scales(rig, &baseline, &records);
        let balance = |role: Role| {
            let own = || records.iter().zip(&bins).filter(|(record, _)| record.role == role);
            let (records, bins): (Vec<&Record>, Vec<&[Bin]>) = own().map(|(r, b)| (r, b.as_slice())).unzip();
            DriveWitness::new(&records, &bins)
        };
        let (witness, holdout_witness) = (balance(Role::Train), balance(Role::Holdout));
        let mut problem = Self {
            rig: rig.clone(),
            baseline,
            sigma_nm: Vec::new(),
            bins,
            measured_nm,
            plans,
            sample_plans,
            restored_plans,
            records,
            scales,
            witness,
            holdout_witness,
            fits: Mutex::new(HashMap::new()),
            nominal: OnceLock::new(),
        };
        problem.sigma_nm = problem.weights(&problem.baseline.clone())?;
        let first = problem.fit(&Vec::new(), None).ok_or_else(|| {
            InputError::new("the baseline has no finite prediction for these logs").file(file.source.as_str())
        })?;
        let fitted = problem.model_with(&first, 0, 0.0);
        problem.sigma_nm = worse(problem.sigma_nm.clone(), problem.weights(&fitted)?);
        problem.scales.ring_peaks_hz = problem.ring_peaks(&fitted)?;
        problem.baseline = ContactModel { effects: Vec::new(), ..fitted };
        problem.scales.stiffness_n_per_m = problem.baseline.parameter("k_u_n_per_m").unwrap_or(3e4);
        problem.fits.lock().map_err(|_| InputError::new("a fit was interrupted"))?.clear();
        problem.fit(&Vec::new(), Some(&first));
        if let Some(nominal) = problem.as_given(file) {
            // It is set once, here.
            let _ = problem.nominal.set(nominal);
        }
        Ok(problem)
    }

    /// Where the friction channel may ring.
    fn ring_peaks(&self, model: &ContactModel) -> Result<Vec<f64>, InputError> {
        let residuals = (0..self.training())
            .map(|log| {
                let smooth = self.run_samples(model, log)?.true_nm;
                let measured = &self.records[log].friction_nm.values;
                Ok(measured.iter().zip(&smooth).map(|(m, p)| m - p).collect())
            })
            .collect::<Result<Vec<Vec<f64>>, InputError>>()?;
        let steps = self.records.iter().map(|record| record.step_s);
        let with_steps: Vec<(&[f64], f64)> = residuals.iter().map(Vec::as_slice).zip(steps).collect();
        Ok(ringing::peaks(&with_steps))
    }

    /// The given model as a point of the search.
    fn as_given(&self, file: &ModelFile) -> Option<Fitted> {
        let given = ContactModel::new(file);
        let slots = self.slots(&Vec::new());
        let values: Vec<f64> = slots
            .iter()
            .map(|slot| {
                let value = given.parameter(&slot.parameter.name).unwrap_or(0.0);
                value.clamp(slot.parameter.low, slot.parameter.high)
            })
            .collect();
        let parameters: Vec<Parameter> = slots.iter().map(|slot| slot.parameter.clone()).collect();
        let combination = Vec::new();
        let residuals = |values: &[f64]| self.residuals(&combination, &slots, values);
        let mut point = Point::at(values, &residuals)?;
        point.differentiate(&parameters, &residuals);
        Some(Fitted { combination: Vec::new(), slots, point })
    }

    /// Number of training logs.
    pub fn training(&self) -> usize {
        self.records.iter().filter(|record| record.role == Role::Train).count()
    }

    /// Runs a model over the bins of a record.
    pub fn run(&self, model: &ContactModel, log: usize) -> Result<Torques, InputError> {
        let restored = self.restored_plans[log].as_ref().filter(|_| model.restored_load);
        let plan = restored.map_or(&self.plans[log], |plans| &plans.0);
        let mut torques = model.run(&self.rig, plan, self.first_nm(log))?;
        if let (Some(ring), Some(sigma)) = (model.ring(), self.sigma_nm.get(log)) {
            ringdown::add(&plan.time_s, &self.measured_nm[log], sigma, &mut torques.shown_nm, ring);
        }
        Ok(torques)
    }

    /// Runs a model over the samples of a record.
    pub fn run_samples(&self, model: &ContactModel, log: usize) -> Result<Torques, InputError> {
        let restored = self.restored_plans[log].as_ref().filter(|_| model.restored_load);
        let plan = restored.map_or(&self.sample_plans[log], |plans| &plans.1);
        let mut torques = model.run(&self.rig, plan, self.first_nm(log))?;
        if let (Some(ring), Some(sigma)) = (model.ring(), self.sigma_nm.get(log)) {
            let bins = self.bins[log].iter().zip(sigma);
            let sigma: Vec<f64> = bins.flat_map(|(bin, s)| std::iter::repeat_n(*s, bin.len())).collect();
            let measured = &self.records[log].friction_nm.values;
            ringdown::add(&plan.time_s, measured, &sigma, &mut torques.shown_nm, ring);
        }
        Ok(torques)
    }

    /// What the friction channel shows when a record begins.
    fn first_nm(&self, log: usize) -> f64 {
        let values = &self.records[log].friction_nm.values;
        let window = values.len().clamp(1, 20);
        values.iter().take(window).sum::<f64>() / window as f64
    }

    /// The balance of torques at the disc for logs of a role, where M2's torque was logged.
    pub fn witness(&self, role: Role) -> Option<&DriveWitness> {
        match role {
            Role::Train => self.witness.as_ref(),
            Role::Holdout => self.holdout_witness.as_ref(),
        }
    }

    /// Rows of a training log among the residuals of a fit.
    pub fn rows_of(&self, log: usize) -> Option<std::ops::Range<usize>> {
        let before: usize = self.bins[..log].iter().map(Vec::len).sum();
        (log < self.training()).then(|| before..before + self.bins[log].len())
    }

    /// Rows of all training logs; those of the witness follow.
    pub fn friction_rows(&self) -> usize {
        self.bins[..self.training()].iter().map(Vec::len).sum()
    }

    /// Expected standard deviation of the residual of each sample, see above.
    fn weights(&self, model: &ContactModel) -> Result<Vec<Vec<f64>>, InputError> {
        (0..self.records.len()).into_par_iter().map(|log| self.weights_of(model, log)).collect()
    }

    fn weights_of(&self, model: &ContactModel, log: usize) -> Result<Vec<f64>, InputError> {
        let record = &self.records[log];
        let plain = self.run(model, log)?;
        // What the ring adds: its phase is not known to a fraction of a sample.
        let ringing: Vec<f64> =
            plain.shown_nm.iter().zip(&plain.true_nm).map(|(a, b)| (a - b).abs()).collect();
        let ringing = around(&ringing, 4, |window| window.iter().copied().fold(0.0, f64::max));
        let plain = plain.shown_nm;
        let mut spread = vec![0.0; plain.len()];
        for seed in 1..=NOISY_RUNS {
            let (speed, load) = record.inputs(Some(seed + 100 * log as u64));
            let plan = Plan::new(record, &self.bins[log], self.rig.friction_radius_m, &speed, &load);
            let first_nm = plain.first().copied().unwrap_or(0.0);
            let noisy = model.run(&self.rig, &plan, first_nm)?.shown_nm;
            for (sum, (a, b)) in spread.iter_mut().zip(noisy.iter().zip(&plain)) {
                *sum += (a - b).powi(2) / NOISY_RUNS as f64;
            }
        }
        // Where a change of the load by what its bridge's gain is uncertain changes the torque by more than
        // in proportion, an element near its limit slips in one run and holds in the other.
        let reach = around(&plain, 40, |window| window.iter().map(|x| x.abs()).fold(0.0, f64::max));
        for factor in [1.0 - LOAD_GAIN, 1.0 + LOAD_GAIN] {
            let (speed, mut load) = record.inputs(None);
            load.iter_mut().for_each(|n| *n *= factor);
            let plan = Plan::new(record, &self.bins[log], self.rig.friction_radius_m, &speed, &load);
            let moved = model.run(&self.rig, &plan, self.first_nm(log))?.shown_nm;
            for (i, sum) in spread.iter_mut().enumerate() {
                *sum += ((moved[i] - plain[i]).abs() - 2.0 * LOAD_GAIN * reach[i]).max(0.0).powi(2);
            }
        }
        let spread = around(&spread, 10, |window| window.iter().sum::<f64>() / window.len() as f64);
        let changes: Vec<f64> = (0..plain.len())
            .map(|i| {
                let (a, b) = (i.saturating_sub(1), (i + 1).min(plain.len() - 1));
                let span_s = self.plans[log].time_s[b] - self.plans[log].time_s[a];
                (plain[b] - plain[a]).abs() / span_s.max(1e-9) * record.step_s
            })
            .collect();
        let changes = around(&changes, 3, |window| window.iter().copied().fold(0.0, f64::max));
        let own = record.friction_nm.noise_std.max(1e-9);
        let stuck = self.stuck(model, log);
        let (_, load) = record.inputs(None);
        let overloaded = self.overloaded(model, log, &load);
        let sigma = self.bins[log].iter().enumerate().map(|(i, bin)| {
            let samples = bin.from..bin.to;
            let tells = samples.clone().all(|k| !stuck[k] && !overloaded[k]);
            if !tells || spread[i].sqrt() > BLIND * own {
                return f64::NAN;
            }
            let timing = (LATENESS * changes[i]).powi(2) + (RING_PHASE * ringing[i]).powi(2);
            // Far below sliding friction the element is held by its rubber, from a level that is uncertain.
            let sliding_nm = self.scales.friction * bin.mean(&load).max(0.0) * self.rig.friction_radius_m;
            let depth = (1.0 - self.measured_nm[log][i].abs() / (0.9 * sliding_nm).max(1e-9)).clamp(0.0, 1.0);
            let level = (LEVEL * depth * sliding_nm).powi(2);
            (own * own / bin.len() as f64 + spread[i] + timing + level).sqrt()
        });
        Ok(sigma.collect())
    }

    /// Where the disc rests and the element holds more than its load can carry by any friction seen in this
    /// log: the load was taken off, and what makes it slip at last is too small to be measured.
    fn overloaded(&self, model: &ContactModel, log: usize, load_n: &[f64]) -> Vec<bool> {
        let record = &self.records[log];
        let radius_m = self.rig.friction_radius_m;
        let still_m = REST_M + 6.0 * radius_m * record.angle_noise_rad;
        let half = (REST_S / record.step_s).ceil() as usize;
        let (_, most_friction) = model.stiffness_and_friction();
        let carried = OVERLOAD * most_friction.max(self.scales.most_friction);
        let shown = around(&record.friction_nm.values, half / 4, |w| w.iter().sum::<f64>() / w.len() as f64);
        (0..record.len())
            .map(|i| {
                let window = &record.angle_rad[i.saturating_sub(half)..(i + half + 1).min(record.len())];
                let low = window.iter().copied().fold(f64::INFINITY, f64::min);
                let high = window.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let rests = radius_m * (high - low) < still_m;
                rests && shown[i].abs() > carried * radius_m * load_n[i].max(1.0)
            })
            .collect()
    }

    /// Where stiff bristles stick: the last few milliseconds' motion is a matter of micrometres, and a
    /// micrometre more or less is a force far above the noise.
    pub fn stuck(&self, model: &ContactModel, log: usize) -> Vec<bool> {
        let record = &self.records[log];
        let radius_m = self.rig.friction_radius_m;
        let (stiffness, most_friction) = model.stiffness_and_friction();
        let resolution_m = radius_m * record.angle_noise_rad;
        if resolution_m * stiffness * radius_m < BLIND * record.friction_nm.noise_std {
            return vec![false; record.len()];
        }
        let (_, load) = record.inputs(None);
        let mut stuck = vec![false; record.len()];
        let mut from = 0;
        for at in 0..record.len() {
            while record.time_s[at] - record.time_s[from] > STUCK_S {
                from += 1;
            }
            // The largest excursion within the window: a swing on the bristles is no sliding.
            let moved_m = radius_m * (record.angle_rad[at] - record.angle_rad[from]).abs();
            let reach_m = load[at].max(0.0) * most_friction / stiffness;
            stuck[at] = moved_m < STUCK_REACHES * reach_m + 4.0 * resolution_m;
        }
        // The window looks back; what it calls sliding may have stuck a moment ago, and the reverse.
        let dilated = around(&stuck.iter().map(|s| f64::from(u8::from(*s))).collect::<Vec<_>>(), 2, |w| {
            w.iter().copied().fold(0.0, f64::max)
        });
        dilated.into_iter().map(|s| s > 0.5).collect()
    }

    /// Free parameters of a combination.
    fn slots(&self, combination: &Combination) -> Vec<Slot> {
        let shared = |effect, parameter| Slot { effect, log: None, parameter };
        let mut slots: Vec<Slot> = baseline::parameters(&self.baseline, self.scales.step_s)
            .into_iter()
            .map(|parameter| shared(None, parameter))
            .collect();
        for (id, variant) in combination {
            let Some(effect) = effect(id) else { continue };
            slots.extend(effect.parameters(*variant, &self.scales).into_iter().map(|p| shared(Some(id), p)));
            if let Some(origin) = effect.origin() {
                slots.extend((1..self.training()).map(|log| Slot {
                    effect: Some(id),
                    log: Some(log),
                    parameter: origin.clone(),
                }));
            }
        }
        slots
    }

    /// The model of one log from values of the slots.
    fn assemble(
        &self,
        combination: &Combination,
        slots: &[Slot],
        values: &[f64],
        log: usize,
        other_origin: f64,
    ) -> ContactModel {
        let mut model = self.baseline.clone();
        for (slot, value) in slots.iter().zip(values).filter(|(slot, _)| slot.effect.is_none()) {
            if slot.parameter.name == baseline::LATE {
                model.late_s = *value;
            } else if let Some((_, old)) =
                model.parameters.iter_mut().find(|(name, _)| *name == slot.parameter.name)
            {
                *old = *value;
            }
        }
        for (id, variant) in combination {
            let Some(effect) = effect(id) else { continue };
            let own = || slots.iter().zip(values).filter(|(slot, _)| slot.effect == Some(*id));
            let shared: Vec<f64> = own().filter(|(s, _)| s.log.is_none()).map(|(_, v)| *v).collect();
            let origin = own().find(|(s, _)| s.log == Some(log)).map_or(other_origin, |(_, v)| *v);
            effect.apply(*variant, &shared, origin, &self.scales, &mut model);
        }
        model
    }

    /// The fitted model of a log, with a given origin for a log that has none of its own.
    pub fn model_with(&self, fitted: &Fitted, log: usize, origin: f64) -> ContactModel {
        self.assemble(&fitted.combination, &fitted.slots, &fitted.point.values, log, origin)
    }

    /// Whether an effect of the combination has an origin in each log.
    pub fn has_origin(&self, combination: &Combination) -> bool {
        combination.iter().any(|(id, _)| effect(id).is_some_and(|e| e.origin().is_some()))
    }

    /// The origin of a log. That of a log that is held out is the one thing fitted to it: nothing else
    /// tells where on the disc its angle began.
    pub fn origin(&self, fitted: &Fitted, log: usize) -> f64 {
        if !self.has_origin(&fitted.combination) || log < self.training() {
            let own = fitted.slots.iter().position(|slot| slot.log == Some(log));
            return own.map_or(0.0, |at| fitted.point.values[at]);
        }
        let loss = |origin: f64| -> f64 {
            let model = self.model_with(fitted, log, origin);
            let Ok(found) = self.run(&model, log) else { return f64::INFINITY };
            self.friction_residuals(log, &found.shown_nm).iter().map(|r| search::loss(*r)).sum()
        };
        let best = |tries: Vec<f64>| -> f64 {
            let losses: Vec<(f64, f64)> = tries.into_par_iter().map(|o| (loss(o), o)).collect();
            losses.into_iter().min_by(|a, b| a.0.total_cmp(&b.0)).map_or(0.0, |(_, origin)| origin)
        };
        let step = std::f64::consts::TAU / 48.0;
        let mut origin = best((0..48).map(|k| step * f64::from(k)).collect());
        let mut width = step;
        for _ in 0..3 {
            origin = best((-4..=4).map(|k| origin + width * 0.25 * f64::from(k)).collect());
            width *= 0.25;
        }
        origin
    }

    /// Residuals of the training logs, then those of the witness.
    fn residuals(&self, combination: &Combination, slots: &[Slot], values: &[f64]) -> Option<Vec<f64>> {
        let mut all = Vec::new();
        let mut torques = Vec::new();
        for log in 0..self.training() {
            let model = self.assemble(combination, slots, values, log, 0.0);
            let found = self.run(&model, log).ok()?;
            all.extend(self.friction_residuals(log, &found.shown_nm));
            torques.push(found);
        }
        if let Some(witness) = &self.witness {
            all.extend(witness.residuals(&torques));
        }
        Some(all)
    }

    /// Residuals of the friction channel of a log over their expected standard deviation.
    pub fn friction_residuals(&self, log: usize, shown_nm: &[f64]) -> Vec<f64> {
        self.measured_nm[log]
            .iter()
            .zip(shown_nm)
            .zip(&self.sigma_nm[log])
            .map(|((m, p), s)| (m - p) / s)
            .collect()
    }

    /// Fits a combination, starting from `near` (a fit of a part of it). `None` where no start has a
    /// finite prediction.
    pub fn fit(&self, combination: &Combination, near: Option<&Fitted>) -> Option<Arc<Fitted>> {
        if let Some(found) = self.fits.lock().ok()?.get(combination) {
            return Some(found.clone());
        }
        let slots = self.slots(combination);
        let parameters: Vec<Parameter> = slots.iter().map(|slot| slot.parameter.clone()).collect();
        let residuals = |values: &[f64]| self.residuals(combination, &slots, values);
        let known = |slot: &Slot| -> Option<f64> {
            let near = near?;
            let same = |s: &&Slot| {
                s.effect == slot.effect && s.log == slot.log && s.parameter.name == slot.parameter.name
            };
            let at = near.slots.iter().position(|s| same(&s))?;
            Some(near.point.values[at])
        };
        let base: Vec<f64> = slots.iter().map(|s| known(s).unwrap_or(s.parameter.start)).collect();
        let fresh: Vec<(&'static str, usize)> = combination
            .iter()
            .copied()
            .filter(|(id, _)| !near.is_some_and(|n| n.combination.iter().any(|(known, _)| known == id)))
            .collect();
        let mut starts: Vec<Point> = Vec::new();
        match fresh.as_slice() {
            [] => {
                if near.is_none() {
                    starts.extend(self.baseline_starts(&slots, &base, &residuals));
                }
                starts.extend(Point::at(base, &residuals));
            }
            [(id, variant)] => {
                starts.extend(self.starts_of(combination, &slots, &base, near, (*id, *variant)));
                // Without the effect the baseline may have been bent far out of shape; the way back from
                // there is longer than from the model as it was given.
                if let (1, Some(nominal)) = (combination.len(), self.nominal.get()) {
                    let at = |slot: &Slot| {
                        nominal
                            .slots
                            .iter()
                            .position(|s| slot.effect.is_none() && s.parameter.name == slot.parameter.name)
                    };
                    let base: Vec<f64> = slots
                        .iter()
                        .map(|slot| at(slot).map_or(slot.parameter.start, |at| nominal.point.values[at]))
                        .collect();
                    let own = (*id, *variant);
                    starts.extend(self.starts_of(combination, &slots, &base, Some(nominal), own));
                }
            }
            _ => return None,
        }
        let several = starts.len() > 1;
        let mut best = starts
            .into_par_iter()
            .map(|start| search::refine(start, &parameters, &residuals, FIRST_ROUNDS))
            .min_by(|a, b| a.loss.total_cmp(&b.loss))?;
        if several || FIRST_ROUNDS < ROUNDS {
            best = search::refine(best, &parameters, &residuals, ROUNDS - FIRST_ROUNDS);
        }
        let fitted = Arc::new(Fitted { combination: combination.clone(), slots, point: best });
        self.fits.lock().ok()?.insert(combination.clone(), fitted.clone());
        Some(fitted)
    }

    /// Fits a combination again from the values of a fit that has all of its effects, and keeps the better.
    pub fn fit_again(&self, known: &Arc<Fitted>, from: &Fitted) -> Arc<Fitted> {
        let mut start = known.as_ref().clone();
        let residuals = |values: &[f64]| self.residuals(&known.combination, &known.slots, values);
        let values = known.slots.iter().zip(&known.point.values).map(|(slot, own)| {
            let same = |s: &&Slot| {
                s.effect == slot.effect && s.log == slot.log && s.parameter.name == slot.parameter.name
            };
            from.slots.iter().position(|s| same(&s)).map_or(*own, |at| from.point.values[at])
        });
        match Point::at(values.collect(), &residuals) {
            Some(point) => start.point = point,
            None => return known.clone(),
        }
        let again = Arc::new(self.polish(&start, ROUNDS));
        if again.point.loss >= known.point.loss {
            return known.clone();
        }
        if let Ok(mut fits) = self.fits.lock() {
            fits.insert(known.combination.clone(), again.clone());
        }
        again
    }

    /// Continues a fit for more rounds: for the few that matter.
    pub fn polish(&self, fitted: &Fitted, rounds: usize) -> Fitted {
        let parameters: Vec<Parameter> = fitted.slots.iter().map(|slot| slot.parameter.clone()).collect();
        let residuals = |values: &[f64]| self.residuals(&fitted.combination, &fitted.slots, values);
        let mut point = fitted.point.clone();
        point.columns.clear();
        Fitted { point: search::refine(point, &parameters, &residuals, rounds), ..fitted.clone() }
    }

    fn baseline_starts(&self, slots: &[Slot], base: &[f64], residuals: &search::Residuals<'_>) -> Vec<Point> {
        let start = |factors: &&[(&str, f64)]| {
            let mut values = base.to_vec();
            for (name, factor) in *factors {
                if let Some(at) = slots.iter().position(|s| s.effect.is_none() && s.parameter.name == *name) {
                    let parameter = &slots[at].parameter;
                    values[at] = (values[at] * factor).clamp(parameter.low, parameter.high);
                }
            }
            Point::at(values, residuals)
        };
        baseline::other_starts(self.baseline.kind).iter().filter_map(start).collect()
    }

    /// Up to two starts for an effect that is added: the shapes of the library that promise most.
    fn starts_of(
        &self,
        combination: &Combination,
        slots: &[Slot],
        base: &[f64],
        near: Option<&Fitted>,
        (id, variant): (&'static str, usize),
    ) -> Vec<Point> {
        let Some(effect) = effect(id) else { return Vec::new() };
        let residuals = |values: &[f64]| self.residuals(combination, slots, values);
        let own: Vec<usize> =
            (0..slots.len()).filter(|i| slots[*i].effect == Some(id) && slots[*i].log.is_none()).collect();
        if effect.origin().is_some() && self.training() > 1 {
            return self.origin_start(&own, slots, base, near, &residuals).into_iter().collect();
        }
        let mut points: Vec<Point> = effect
            .starts(variant, &self.scales)
            .into_par_iter()
            .filter_map(|start| self.start(&start, &own, slots, base, near, &residuals))
            .collect();
        points.sort_by(|a, b| a.loss.total_cmp(&b.loss));
        points.truncate(2);
        points
    }

    /// A start for an effect whose shared parameters are cosine and sine amplitudes of the orders of an
    /// angle (in turn) and whose origin differs from log to log: amplitudes for each log by a linear step,
    /// then the turns that bring the logs' patterns together.
    fn origin_start(
        &self,
        own: &[usize],
        slots: &[Slot],
        base: &[f64],
        near: Option<&Fitted>,
        residuals: &search::Residuals<'_>,
    ) -> Option<Point> {
        let parameters: Vec<Parameter> = slots.iter().map(|slot| slot.parameter.clone()).collect();
        let point = Point::at(base.to_vec(), residuals)?;
        let columns: Vec<Vec<f64>> = own
            .par_iter()
            .map(|at| search::column(&parameters, &point, *at, residuals))
            .collect::<Option<_>>()?;
        let mut extra = Vec::new();
        let mut row = 0;
        for log in 0..self.training() {
            let rows = row..row + self.bins[log].len();
            row = rows.end;
            for column in &columns {
                let mut part = vec![0.0; column.len()];
                part[rows.clone()].copy_from_slice(&column[rows.clone()]);
                extra.push(part);
            }
        }
        let near_columns = near.map_or(Vec::new(), |n| n.point.columns.clone());
        let full = Point {
            columns: near_columns.into_iter().filter(|c| c.len() == point.residuals.len()).collect(),
            ..point.clone()
        };
        let (_, found) = search::promise(&full, &extra)?;
        let orders = own.len() / 2;
        let pattern = |log: usize, order: usize| {
            let at = log * own.len() + 2 * order;
            (found[at], found[at + 1])
        };
        let mut values = base.to_vec();
        let mut mean: Vec<(f64, f64)> = (0..orders).map(|order| pattern(0, order)).collect();
        for log in 1..self.training() {
            // cos k(φ − o) has the amplitudes of cos kφ turned by k·o.
            let overlap = |origin: f64| -> f64 {
                (0..orders)
                    .map(|order| {
                        let ((a, b), (c, d)) = (pattern(0, order), pattern(log, order));
                        let (sine, cosine) = ((order + 1) as f64 * origin).sin_cos();
                        c * (a * cosine - b * sine) + d * (a * sine + b * cosine)
                    })
                    .sum()
            };
            let tries = (0..720).map(|k| std::f64::consts::TAU * f64::from(k) / 720.0 - std::f64::consts::PI);
            let origin = tries.max_by(|a, b| overlap(*a).total_cmp(&overlap(*b)))?;
            for (order, mean) in mean.iter_mut().enumerate() {
                let (c, d) = pattern(log, order);
                let (sine, cosine) = ((order + 1) as f64 * origin).sin_cos();
                mean.0 += c * cosine + d * sine;
                mean.1 += d * cosine - c * sine;
            }
            if let Some(at) =
                slots.iter().position(|s| s.effect == slots[own[0]].effect && s.log == Some(log))
            {
                values[at] = origin;
            }
        }
        for (order, (a, b)) in mean.into_iter().enumerate() {
            for (at, amplitude) in [(own[2 * order], a), (own[2 * order + 1], b)] {
                let parameter = &parameters[at];
                values[at] = (amplitude / self.training() as f64).clamp(parameter.low, parameter.high);
            }
        }
        Point::at(values, residuals)
    }

    /// The point of one start, with amplitudes by a linear step from the fit it extends.
    fn start(
        &self,
        start: &Start,
        own: &[usize],
        slots: &[Slot],
        base: &[f64],
        near: Option<&Fitted>,
        residuals: &search::Residuals<'_>,
    ) -> Option<Point> {
        let parameters: Vec<Parameter> = slots.iter().map(|slot| slot.parameter.clone()).collect();
        let mut values = base.to_vec();
        for (at, value) in own.iter().zip(&start.values) {
            values[*at] = value.clamp(parameters[*at].low, parameters[*at].high);
        }
        let columns_of_near = |point: &Point| {
            // Derivatives by the baseline and by effects already there, in this fit's order.
            let near = near?;
            let columns: Vec<Vec<f64>> = slots
                .iter()
                .map(|slot| {
                    let at = near.slots.iter().position(|s| {
                        s.effect == slot.effect
                            && s.log == slot.log
                            && s.parameter.name == slot.parameter.name
                    });
                    let column = at.and_then(|at| near.point.columns.get(at)).cloned();
                    column.filter(|c| c.len() == point.residuals.len()).unwrap_or_default()
                })
                .collect();
            Some(columns)
        };
        let mut point = Point::at(values, residuals)?;
        if !start.amplitudes.is_empty() {
            let wanted: Vec<usize> = start.amplitudes.iter().map(|k| own[*k]).collect();
            let extra: Vec<Vec<f64>> = wanted
                .iter()
                .map(|at| search::column(&parameters, &point, *at, residuals).unwrap_or_default())
                .collect();
            point.columns = columns_of_near(&point)?.into_iter().filter(|c| !c.is_empty()).collect();
            let (_, amplitudes) = search::promise(&point, &extra)?;
            let mut best: Option<Point> = None;
            for share in [1.0, 0.4] {
                let mut values = point.values.clone();
                for (at, amplitude) in wanted.iter().zip(&amplitudes) {
                    let parameter = &parameters[*at];
                    values[*at] = (share * amplitude).clamp(parameter.low, parameter.high);
                }
                if let Some(next) = Point::at(values, residuals)
                    && best.as_ref().is_none_or(|b| next.loss < b.loss)
                {
                    best = Some(next);
                }
            }
            point = best?;
        }
        // The baseline's derivatives are those of the fit it extends; the effect's own are computed.
        if let Some(mut columns) = columns_of_near(&point) {
            for (at, column) in columns.iter_mut().enumerate() {
                if column.is_empty() {
                    *column = search::column(&parameters, &point, at, residuals).unwrap_or_default();
                }
            }
            point.columns = columns;
        }
        Some(point)
    }

    /// Effects that these records and this baseline allow, with their forms.
    pub fn conceivable(&self) -> Vec<&'static dyn ContactEffect> {
        LIBRARY.into_iter().filter(|effect| effect.applies(&self.baseline, &self.scales)).collect()
    }
}

/// The larger of two expected deviations of each bin; masked where either is.
fn worse(a: Vec<Vec<f64>>, b: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let larger = |(a, b): (f64, f64)| if a.is_nan() || b.is_nan() { f64::NAN } else { a.max(b) };
    let logs = a.into_iter().zip(b);
    logs.map(|(a, b)| a.into_iter().zip(b).map(larger).collect()).collect()
}

/// Each value replaced by a statistic of its neighbours within `half` samples.
fn around(values: &[f64], half: usize, statistic: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let window = |i: usize| &values[i.saturating_sub(half)..(i + half + 1).min(values.len())];
    (0..values.len()).map(|i| statistic(window(i))).collect()
}

fn scales(rig: &RigFile, baseline: &ContactModel, records: &[Record]) -> Scales {
    let radius_m = rig.friction_radius_m;
    let mut scales = Scales {
        duration_s: 0.0,
        distance_m: 0.0,
        power_w: 0.0,
        load_n: 1.0,
        friction: 0.0,
        most_friction: 0.0,
        torque_nm: 1e-3,
        speed_m_s: (0.01, 1.0),
        rarer_direction: 0.0,
        step_s: records.iter().map(|r| r.step_s).fold(0.0, f64::max),
        friction_ends_nm: (None, None),
        normal_clips: false,
        ring_peaks_hz: Vec::new(),
        ring_hz: rig.friction_bridge.mode.map(|mode| mode.mode_hz),
        ring_damping: rig.friction_bridge.mode.map(|mode| mode.damping_ratio),
        stiffness_n_per_m: match baseline.kind {
            ModelKind::Series => baseline.parameter("k_u_n_per_m").unwrap_or(3e4),
            _ => 3e4,
        },
    };
    let (mut speeds, mut loads, mut coefficients) = (Vec::new(), Vec::new(), Vec::new());
    let (mut squares, mut work_j, mut sliding_s, mut count) = (0.0, 0.0, 0.0, 0usize);
    let mut backward_s = 0.0;
    for record in records {
        let (low, high) = &mut scales.friction_ends_nm;
        let own = record.friction_nm.clipping;
        *low = own.low.map(|end| low.map_or(end, |known| known.min(end))).or(*low);
        *high = own.high.map(|end| high.map_or(end, |known| known.max(end))).or(*high);
        let (speed, load) = record.inputs(None);
        scales.normal_clips |= restored::load(record, rig, &load).is_some();
        let mut distance_m = 0.0;
        for i in 0..record.len() {
            let (v, torque) = (radius_m * speed[i], record.friction_nm.values[i]);
            distance_m += v.abs() * record.step_s;
            squares += torque * torque;
            count += 1;
            if load[i] > 1.0 {
                loads.push(load[i]);
            }
            if v.abs() > 2e-3 && load[i] > 1.0 {
                speeds.push(v.abs());
                coefficients.push(torque.abs() / radius_m / load[i]);
                work_j += (torque * speed[i]).abs() * record.step_s;
                sliding_s += record.step_s;
                backward_s += if v < 0.0 { record.step_s } else { 0.0 };
            }
        }
        scales.distance_m = scales.distance_m.max(distance_m);
        scales.duration_s = scales.duration_s.max(record.time_s.last().copied().unwrap_or(0.0));
    }
    let quantile = |values: &mut Vec<f64>, share: f64| {
        let rank = ((values.len().max(1) - 1) as f64 * share) as usize;
        if values.is_empty() { None } else { Some(*values.select_nth_unstable_by(rank, f64::total_cmp).1) }
    };
    scales.most_friction = quantile(&mut coefficients, 0.98).unwrap_or(0.0);
    scales.friction = quantile(&mut coefficients, 0.5).unwrap_or(0.0);
    scales.load_n = quantile(&mut loads, 0.5).unwrap_or(1.0);
    if let (Some(low), Some(high)) = (quantile(&mut speeds, 0.05), quantile(&mut speeds, 0.95)) {
        scales.speed_m_s = (low, high.max(2.0 * low));
    }
    scales.torque_nm = (squares / count.max(1) as f64).sqrt().max(1e-6);
    if sliding_s > 0.0 {
        scales.rarer_direction = f64::min(backward_s, sliding_s - backward_s) / sliding_s;
    }
    scales.power_w = if sliding_s > 0.0 { (work_j / sliding_s).max(1e-6) } else { 1.0 };
    scales.distance_m = scales.distance_m.max(1e-3);
    scales.duration_s = scales.duration_s.max(1e-3);
    scales
}
