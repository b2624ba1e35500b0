//! The inverse model with any set of effects, and its fit by variable projection.
//!
//! u(t − τ) = M q̈ + Fv q̇ + Fc d(q) + Σ θ_i φ_i(t; ξ), d the direction of motion. For given shapes ξ the
//! sizes θ follow from linear least squares on whitened signals ([`super::whitening`]), so only shapes
//! are searched (Golub and Pereyra, 1973). Force is what is compared; nothing is integrated in open
//! loop, so an integrating plant cannot hide a fault.
//!
//! **Timing.** The channels of a log need not be sampled at the same instant: a command held over its
//! period alone acts half a period late. Up to [`TIMING_S`] is therefore taken as the log's timing and
//! is part of the baseline, once for M2's torque and once for the friction channel. The torque ring and
//! its amplifier are low-passes: below their modes the true friction is T + timing·Ṫ + ring·T̈, and ring =
//! Σ 1/ω² is fitted too, up to that of a mode at [`SLOWEST_RING_HZ`].
//! Left out: gains of the torque channels; they cannot be told from the inertia.

use std::sync::Arc;

use nalgebra::{DMatrix, DVector};

use super::conditioned::DriveLog;
use super::effect::{Prepared, Regressor, Seen};
use super::resonance::{Resonance, noise_ratio};
use super::whitening::Whitener;
use crate::fit::drive::inverse::Motion;
use crate::fit::drive::record::central_difference;

/// Largest difference in time between two channels that is not called a delay, s.
pub const TIMING_S: f64 = 1e-3;

/// Lowest mode of the torque ring that is taken as known.
pub const SLOWEST_RING_HZ: f64 = 300.0;
/// Name of the ring's term.
pub const FRICTION_RING: &str = "friction_ring_s2";

/// An effect in the model.
#[derive(Clone)]
pub struct Part {
    /// Its id.
    pub id: &'static str,
    /// The effect, set up.
    pub prepared: Arc<dyn Prepared>,
}

/// A log with its filter, and what no shape changes: whitened once.
pub struct Filtered {
    /// The log.
    pub log: DriveLog,
    /// Its filter.
    pub whitener: Whitener,
    effort: Vec<f64>,
    baseline: [Vec<f64>; 3],
    torque_timing: Vec<f64>,
    friction_timing: Option<Vec<f64>>,
    friction_ring: Option<Vec<f64>>,
}

impl Filtered {
    /// Whitens a log for an inertia.
    pub fn new(log: DriveLog, inertia: f64) -> Self {
        let whitener = log.whitener(inertia);
        let step_s = log.record.step_s;
        let white = |values: &[f64]| whitener.apply(values, &log.weight);
        let rate = |values: &[f64]| white(&central_difference(values, step_s));
        Self {
            effort: white(&log.record.effort),
            baseline: [white(&log.acceleration), white(&log.speed), white(&log.direction)],
            torque_timing: rate(&gross(&log)),
            friction_timing: log.contact.as_ref().map(|contact| rate(&contact.friction)),
            friction_ring: log.contact.as_ref().map(|contact| white(&curvature(&contact.friction, step_s))),
            whitener,
            log,
        }
    }
}

/// Logs with their filters, and the effects.
pub struct Model<'a> {
    /// Training logs first.
    pub logs: &'a [Filtered],
    /// Effects in the order of their shapes.
    pub parts: &'a [Part],
}

/// Values of everything nonlinear: shapes of all parts in order, and an origin for each log.
#[derive(Debug, Clone, PartialEq)]
pub struct Shapes {
    /// Shapes of all parts.
    pub values: Vec<f64>,
    /// Origin of each log.
    pub origins: Vec<f64>,
}

/// A column of the linear problem.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColumnName {
    /// Effect, or the baseline.
    pub effect: Option<&'static str>,
    /// Name with unit.
    pub name: String,
}

/// One log's linear problem: whitened effort and columns.
pub struct Whitened {
    /// Whitened effort.
    pub effort: Vec<f64>,
    /// Whitened columns.
    pub columns: Vec<Vec<f64>>,
}

impl Whitened {
    /// What given sizes leave of the effort.
    pub fn residual(&self, sizes: &[f64]) -> Vec<f64> {
        let mut left = self.effort.clone();
        for (column, size) in self.columns.iter().zip(sizes) {
            left.iter_mut().zip(column).for_each(|(left, x)| *left -= size * x);
        }
        left
    }
}

/// Sizes for given shapes.
#[derive(Debug, Clone)]
pub struct Sizes {
    /// Coefficients of all columns.
    pub values: Vec<f64>,
    /// Sum of squares that is left.
    pub sum_of_squares: f64,
}

impl Model<'_> {
    fn shapes_of<'s>(&self, part: usize, shapes: &'s Shapes) -> &'s [f64] {
        let before: usize = self.parts[..part].iter().map(|p| p.prepared.shapes().len()).sum();
        &shapes.values[before..before + self.parts[part].prepared.shapes().len()]
    }

    /// Delay of the parts, s; `None` where no part is a delay.
    pub fn delay_s(&self, shapes: &Shapes) -> Option<f64> {
        (0..self.parts.len()).find_map(|i| self.parts[i].prepared.delay_s(self.shapes_of(i, shapes)))
    }

    /// Direction of motion in a log where a part replaces the sign of the speed.
    fn own_direction(&self, shapes: &Shapes, index: usize) -> Option<Vec<f64>> {
        let log = &self.logs[index].log;
        (0..self.parts.len()).find_map(|i| self.parts[i].prepared.direction(self.shapes_of(i, shapes), log))
    }

    /// Regressors of the parts in a log.
    fn part_regressors(
        &self,
        shapes: &Shapes,
        index: usize,
        direction: &[f64],
    ) -> Vec<(&'static str, Regressor)> {
        let seen = Seen { log: &self.logs[index].log, direction, origin: shapes.origins[index] };
        let of_part = |(i, part): (usize, &Part)| {
            let own = part.prepared.regressors(self.shapes_of(i, shapes), &seen);
            own.into_iter().map(|regressor| (part.id, regressor)).collect::<Vec<_>>()
        };
        self.parts.iter().enumerate().flat_map(of_part).collect()
    }

    /// Regressors of a log on its samples: inertia, viscous, Coulomb, then those of the parts. Timing
    /// is not among them.
    pub fn regressors(&self, shapes: &Shapes, index: usize) -> Vec<Vec<f64>> {
        let log = &self.logs[index].log;
        let own = self.own_direction(shapes, index);
        let direction = own.as_ref().unwrap_or(&log.direction);
        let mut all = vec![log.acceleration.clone(), log.speed.clone(), direction.clone()];
        all.extend(self.part_regressors(shapes, index, direction).into_iter().map(|(_, r)| r.values));
        all
    }

    /// Offsets of the disc against the encoder in a log, of each part that has one.
    pub fn disc_offsets(
        &self,
        shapes: &Shapes,
        names: &[ColumnName],
        sizes: &Sizes,
        index: usize,
    ) -> Vec<Vec<f64>> {
        let log = &self.logs[index].log;
        let seen = Seen { log, direction: &log.direction, origin: shapes.origins[index] };
        let of_part = |(i, part): (usize, &Part)| {
            let columns = names.iter().zip(&sizes.values).filter(|(name, _)| name.effect == Some(part.id));
            let own: Vec<f64> = columns.map(|(_, size)| *size).collect();
            part.prepared.disc_offset(self.shapes_of(i, shapes), &own, &seen)
        };
        self.parts.iter().enumerate().filter_map(of_part).collect()
    }

    /// Names of the columns: those of [`Self::regressors`], then timing.
    pub fn names(&self, shapes: &Shapes) -> Vec<ColumnName> {
        let log = &self.logs[0].log;
        let baseline = |name: &str| ColumnName { effect: None, name: name.into() };
        let mut names: Vec<ColumnName> =
            baseline_names(log.motion).iter().map(|name| baseline(name)).collect();
        let parts = self.part_regressors(shapes, 0, &log.direction);
        names.extend(parts.into_iter().map(|(id, r)| ColumnName { effect: Some(id), name: r.name }));
        if self.delay_s(shapes).is_none() {
            names.push(baseline("torque_timing_s"));
        }
        if log.contact.is_some() {
            names.push(baseline("friction_timing_s"));
            names.push(baseline(FRICTION_RING));
        }
        names
    }

    /// The effort that the regressors explain: net of the measured friction, delayed by the parts.
    pub fn net_effort(&self, shapes: &Shapes, index: usize) -> Vec<f64> {
        let log = &self.logs[index].log;
        let Some(delay_s) = self.delay_s(shapes) else { return log.record.effort.clone() };
        let mut effort = delayed(&gross(log), delay_s / log.record.step_s);
        if let Some(contact) = &log.contact {
            effort.iter_mut().zip(&contact.friction).for_each(|(effort, friction)| *effort -= friction);
        }
        effort
    }

    /// The linear problem of a log. The effort is net of the measured friction and delayed by the parts.
    pub fn whitened(&self, shapes: &Shapes, index: usize) -> Whitened {
        let filtered = &self.logs[index];
        let log = &filtered.log;
        let white = |values: &[f64]| filtered.whitener.apply(values, &log.weight);
        let delay_s = self.delay_s(shapes);
        let effort = match delay_s {
            None => filtered.effort.clone(),
            Some(_) => white(&self.net_effort(shapes, index)),
        };
        let own = self.own_direction(shapes, index);
        let mut columns = filtered.baseline.to_vec();
        if let Some(direction) = &own {
            columns[2] = white(direction);
        }
        let direction = own.as_ref().unwrap_or(&log.direction);
        columns.extend(self.part_regressors(shapes, index, direction).iter().map(|(_, r)| white(&r.values)));
        if delay_s.is_none() {
            columns.push(filtered.torque_timing.clone());
        }
        columns.extend(filtered.friction_timing.clone());
        columns.extend(filtered.friction_ring.clone());
        let mut whitened = Whitened { effort, columns };
        if let Some((resonance, ratio)) = self.resonance(shapes).zip(noise_ratio(log)) {
            let step_s = log.record.step_s * filtered.whitener.factor() as f64;
            let filters = resonance.filters(ratio, step_s, log.band_hz);
            // What is wrong with the friction channel reaches the motor through the disc.
            let friction = whitened.columns.len() - 2;
            for column in &mut whitened.columns[friction..] {
                *column = filters.through_disc(column);
            }
            whitened.effort = filters.whiten(&whitened.effort);
            whitened.columns.iter_mut().for_each(|column| *column = filters.whiten(column));
        }
        whitened
    }

    /// The resonance that a part puts between the friction and the motor.
    pub fn resonance(&self, shapes: &Shapes) -> Option<Resonance> {
        (0..self.parts.len()).find_map(|i| self.parts[i].prepared.resonance(self.shapes_of(i, shapes)))
    }

    /// Sizes that fit `problems` best; timing is kept within its limits. `None` if nothing is left of
    /// the logs.
    pub fn solve(&self, problems: &[Whitened], names: &[ColumnName]) -> Option<Sizes> {
        let count = names.len();
        let mut normal = DMatrix::<f64>::zeros(count, count);
        let mut right = DVector::<f64>::zeros(count);
        let mut energy = 0.0;
        for problem in problems {
            energy += dot(&problem.effort, &problem.effort);
            for i in 0..count {
                right[i] += dot(&problem.columns[i], &problem.effort);
                for j in 0..=i {
                    let product = dot(&problem.columns[i], &problem.columns[j]);
                    normal[(i, j)] += product;
                    if i != j {
                        normal[(j, i)] += product;
                    }
                }
            }
        }
        let mut held: Vec<Option<f64>> = vec![None; count];
        let mut values = solve_normal(&normal, &right, &held)?;
        for i in 0..count {
            let (low, high) = limits(&names[i]);
            if !(low..=high).contains(&values[i]) {
                held[i] = Some(values[i].clamp(low, high));
            }
        }
        if held.iter().any(Option::is_some) {
            values = solve_normal(&normal, &right, &held)?;
        }
        if !energy.is_finite() || values.iter().any(|x| !x.is_finite()) {
            return None;
        }
        let explained = 2.0 * right.dot(&values) - (&normal * &values).dot(&values);
        Some(Sizes { values: values.as_slice().to_vec(), sum_of_squares: (energy - explained).max(0.0) })
    }
}

/// Whether a column's coefficient is a time between channels, or the ring's.
pub fn is_timing(name: &ColumnName) -> bool {
    name.effect.is_none() && (name.name.ends_with("_timing_s") || name.name == FRICTION_RING)
}

/// Range of a coefficient.
fn limits(name: &ColumnName) -> (f64, f64) {
    if is_timing(name) && name.name == FRICTION_RING {
        (0.0, (2.0 * std::f64::consts::PI * SLOWEST_RING_HZ).powi(-2))
    } else if is_timing(name) {
        (-TIMING_S, TIMING_S)
    } else if name.effect == Some("bearing_stribeck") && name.name.starts_with("static_excess") {
        // Friction that rises from standstill is not this effect.
        (0.0, f64::INFINITY)
    } else {
        (f64::NEG_INFINITY, f64::INFINITY)
    }
}

/// Second derivative by central differences.
pub fn curvature(signal: &[f64], step_s: f64) -> Vec<f64> {
    central_difference(&central_difference(signal, step_s), step_s)
}

/// Names of inertia, viscous and Coulomb friction.
pub fn baseline_names(motion: Motion) -> [&'static str; 3] {
    match motion {
        Motion::Rotary => ["inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm"],
        Motion::Linear => ["mass_kg", "viscous_n_s_per_m", "coulomb_n"],
    }
}

/// M2's torque or the force, before the friction torque was taken off.
pub fn gross(log: &DriveLog) -> Vec<f64> {
    match &log.contact {
        None => log.record.effort.clone(),
        Some(contact) => log.record.effort.iter().zip(&contact.friction).map(|(net, t)| net + t).collect(),
    }
}

/// A signal later by `samples`, not necessarily a whole number: cubic through four neighbours, ends
/// held.
pub fn delayed(signal: &[f64], samples: f64) -> Vec<f64> {
    let whole = samples.floor();
    let s = samples - whole;
    let last = signal.len() as i64 - 1;
    // Lagrange weights at −s between samples −2, −1, 0, 1 counted from the whole delay.
    let weights = [
        s * (s * s - 1.0) / 6.0,
        s * (s + 1.0) * (2.0 - s) / 2.0,
        (1.0 - s * s) * (2.0 - s) / 2.0,
        -s * (1.0 - s) * (2.0 - s) / 6.0,
    ];
    (0..signal.len() as i64)
        .map(|i| {
            let base = i - whole as i64;
            (0..4).map(|k| weights[k as usize] * signal[(base + k - 2).clamp(0, last) as usize]).sum()
        })
        .collect()
}

/// Σ x y, in eight running sums: one would wait for each addition to end.
pub fn dot(x: &[f64], y: &[f64]) -> f64 {
    let count = x.len().min(y.len());
    let (x, y) = (x[..count].chunks_exact(8), y[..count].chunks_exact(8));
    let rest: f64 = x.remainder().iter().zip(y.remainder()).map(|(x, y)| x * y).sum();
    let mut sums = [0.0; 8];
    for (x, y) in x.zip(y) {
        for lane in 0..8 {
            sums[lane] += x[lane] * y[lane];
        }
    }
    sums.iter().sum::<f64>() + rest
}

/// Solves the normal equations with some values held, columns brought to length one first.
fn solve_normal(normal: &DMatrix<f64>, right: &DVector<f64>, held: &[Option<f64>]) -> Option<DVector<f64>> {
    let free: Vec<usize> = (0..held.len()).filter(|i| held[*i].is_none() && normal[(*i, *i)] > 0.0).collect();
    let mut values = DVector::from_iterator(held.len(), held.iter().map(|h| h.unwrap_or(0.0)));
    if free.is_empty() {
        return None;
    }
    let scale: Vec<f64> = free.iter().map(|&i| 1.0 / normal[(i, i)].sqrt()).collect();
    let rest = right - normal * &values;
    let mut scaled =
        DMatrix::from_fn(free.len(), free.len(), |a, b| normal[(free[a], free[b])] * scale[a] * scale[b]);
    // Columns that are alike within rounding share their size instead of failing.
    for a in 0..free.len() {
        scaled[(a, a)] += 1e-10;
    }
    let target = DVector::from_iterator(free.len(), free.iter().zip(&scale).map(|(&i, s)| rest[i] * s));
    let solution = scaled.cholesky()?.solve(&target);
    for (a, &i) in free.iter().enumerate() {
        values[i] = solution[a] * scale[a];
    }
    Some(values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_delay_of_part_of_a_sample_moves_a_wave_by_it() {
        let wave = |t: f64| (0.3 * t).sin();
        let signal: Vec<f64> = (0..200).map(|i| wave(f64::from(i))).collect();
        for samples in [0.0, 0.25, 1.0, 3.7] {
            for (i, y) in delayed(&signal, samples).iter().enumerate().skip(10).take(180) {
                // Cubic interpolation of a wave with 21 samples a period.
                assert!((y - wave(i as f64 - samples)).abs() < 5e-4, "{samples} {i}");
            }
        }
    }
}
