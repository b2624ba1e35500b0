//! A contact log made ready for the observer of the slip.

use std::borrow::Cow;

use super::ends::Ends;
use super::motion::{Motion, Speed};
use super::observer::{SLIP_NOISES, slip_noise_m_s};
use super::problem::Numbers;
use super::ringing::Ringing;
use super::smoothing::{OBSERVED_OVER, Smoothing};
use crate::files::log::{Log, unwrapped};
use crate::files::rig_file::{Bridge, RigFile};
use crate::files::signal::Signal;
use crate::identify::filters::{
    gaussian, gradient, local_maximum, rms, shifted, smoothed_flat, smoothed_together,
};
use crate::identify::grid::Grid;
use crate::identify::mains;
use crate::identify::noise;
use crate::input_error::InputError;
use crate::predict::BridgeModel;

/// Signals of a contact log on an even grid, SI units.
#[derive(Debug, Clone)]
pub struct ContactLog {
    /// The log's name.
    pub source: String,
    /// The grid.
    pub grid: Grid,
    /// Friction radius, m.
    pub radius_m: f64,
    /// Angle of the disc, from angle and speed columns.
    pub angle_rad: Vec<f64>,
    /// Way of the element's root over the road, m.
    pub root_m: Vec<f64>,
    /// Its speed, smoothed over a few samples, m/s.
    pub root_speed_m_s: Vec<f64>,
    /// Normal force, smoothed where it is steady and taken ahead by its bridge's delay, N.
    pub load_n: Vec<f64>,
    /// Its largest change a sample near by, N.
    pub load_change_n: Vec<f64>,
    /// Normal force as logged, N: what shows the end of a range.
    pub logged_n: Vec<f64>,
    /// Friction torque as logged, N m: what shows the ends of a range.
    pub logged_nm: Vec<f64>,
    /// Normal force without what its bridge picks up from the mains, N.
    pub normal_n: Vec<f64>,
    /// Friction torque without what its bridge picks up from the mains, N m.
    pub friction_nm: Vec<f64>,
    /// The same, smoothed: what the slip is observed from.
    pub observed_nm: Vec<f64>,
    /// How it is smoothed.
    pub smoothing: Smoothing,
    /// The same, smoothed more: for coordinates and noise levels.
    pub smooth_nm: Vec<f64>,
    /// Its largest change a sample near by, N m.
    pub friction_change_nm: Vec<f64>,
    /// Torque of M1, N m.
    pub m1_torque_nm: Option<Vec<f64>>,
    /// Angle of M1, rad.
    pub m1_angle_rad: Option<Vec<f64>>,
    /// Torque of M2, N m.
    pub m2_torque_nm: Option<Vec<f64>>,
    /// Surface temperature, °C.
    pub temperature_c: Option<Vec<f64>>,
    /// Whether a point takes part: covered by samples, and whatever an effect's file takes out.
    pub usable: Vec<bool>,
    /// Noise of the friction channel, N m.
    pub friction_noise_nm: f64,
    /// Noise of the normal channel, N.
    pub normal_noise_n: f64,
    /// Noise of the root's way where an angle was logged, m; else 0.
    pub root_noise_m: f64,
    /// Noise of the root's speed from sample to sample, m/s.
    pub speed_noise_m_s: f64,
    /// What that speed is uncertain by beside it, m/s: of a disc that is reckoned and not seen.
    pub unsure_m_s: f64,
    /// By how much the instants of the disc's logged angle jitter, s, where its speed was used for what is fast.
    pub jitter_s: Option<f64>,
    /// What is left of a jump as ringing that samples are too far apart to show: its RMS at the jump over the jump, and the share
    /// that is left a sample on. `None` where they show it.
    pub unseen_ringing: Option<(f64, f64)>,
    /// How late the friction channel is by the rig file, samples.
    pub friction_late: f64,
    /// What the friction channel swings with faster than a model can follow, where samples are regular enough to show it.
    pub ringing: Option<Ringing>,
}

/// A channel is at its end within so many deviations of its noise.
pub const END_NOISES: f64 = 4.0;

impl ContactLog {
    /// Prepares a log.
    ///
    /// # Errors
    /// Where a column is missing.
    pub fn new(log: &Log, rig: &RigFile) -> Result<Self, InputError> {
        let signals = log.contact()?;
        let stamps = signals.time_s;
        let grid = Grid::new(stamps);
        let on_grid = |values: &[f64]| grid.channel(stamps, values);
        let optional = |signal| log.signal(signal).map(&on_grid);
        let step_s = grid.step_s;

        let logged_nm = on_grid(signals.friction_torque_nm);
        let logged_n = on_grid(signals.normal_force_n);
        let friction_noise_nm = noise::white_deviation(&logged_nm);
        let normal_noise_n = grid.noise(&logged_n, signals.normal_force_n);
        let [friction_nm, normal_n] = [&logged_nm, &logged_n].map(|logged| mains::without(logged, step_s));

        let lag_s = log.speed_lag().map_or(0.0, |lag| lag.lag_s);
        let speed_column =
            log.signal(Signal::M2Speed).map(|speed| Speed { values_rad_s: on_grid(speed), lag_s });
        let angle_column = log.signal(Signal::M2Angle).map(|angle| on_grid(&unwrapped(angle)));
        let Motion { angle_rad, slope_noise_rad_s, noise_rad, jitter_s } =
            Motion::new(&grid, speed_column.as_ref(), angle_column.as_deref());
        let radius_m = rig.friction_radius_m;
        let root_m: Vec<f64> = angle_rad.iter().map(|a| radius_m * a).collect();

        let ahead = BridgeModel::delay_s(&rig.normal_bridge) / step_s;
        let load_n = shifted(&steady_smoothed(&normal_n, normal_noise_n), ahead);
        let load_change_n = local_maximum(&magnitudes(&gradient(&load_n)), 2);
        let smooth_nm = gaussian(&friction_nm, 2.0, 0);
        let friction_change_nm = local_maximum(&magnitudes(&gradient(&smooth_nm)), 2);

        let ringing = Ringing::new(&friction_nm, friction_noise_nm);
        let mut usable = grid.covered.clone();
        // The observer's first state is a guess.
        usable.iter_mut().take(5).for_each(|u| *u = false);
        Ok(Self {
            source: log.source.clone(),
            root_speed_m_s: smooth_speed(&root_m, step_s),
            observed_nm: smoothed_flat(&friction_nm, OBSERVED_OVER),
            smoothing: Smoothing::default(),
            unseen_ringing: unseen_ringing(&rig.friction_bridge, step_s),
            friction_late: BridgeModel::delay_s(&rig.friction_bridge) / step_s,
            ringing,
            root_noise_m: radius_m * noise_rad,
            speed_noise_m_s: radius_m * slope_noise_rad_s,
            unsure_m_s: 0.0,
            jitter_s,
            m1_torque_nm: optional(Signal::M1Torque),
            m1_angle_rad: optional(Signal::M1Angle),
            m2_torque_nm: optional(Signal::M2Torque),
            temperature_c: optional(Signal::SurfaceTemperature),
            grid,
            radius_m,
            angle_rad,
            root_m,
            load_n,
            load_change_n,
            logged_n,
            logged_nm,
            normal_n,
            friction_nm,
            smooth_nm,
            friction_change_nm,
            usable,
            friction_noise_nm,
            normal_noise_n,
        })
    }

    /// Prepares logs that are seen through the block of a model with these numbers, where it has one.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn all(logs: &[Log], rig: &RigFile, numbers: &Numbers) -> Result<Vec<Self>, InputError> {
        logs.iter().map(|log| Ok(Self::new(log, rig)?.seen_through(numbers))).collect()
    }

    /// With a root that moves no more at rest than it must, where bristles without a block follow it: over a single count of the
    /// encoder they would show a good part of the friction.
    #[must_use]
    pub fn at_rest_for(mut self, numbers: &Numbers) -> Self {
        if numbers.bristles_alone && self.root_noise_m > 0.0 {
            self.root_m = smoothed_together([(&self.root_m, self.root_noise_m)]);
            self.root_speed_m_s = smooth_speed(&self.root_m, self.grid.step_s);
        }
        self
    }

    /// Smoothed as far as it takes to tell slip from the channel's noise through a model's block.
    #[must_use]
    pub fn seen_through(mut self, numbers: &Numbers) -> Self {
        if numbers.bristles_alone {
            return self.at_rest_for(numbers);
        }
        let noise_n = self.friction_noise_nm / self.radius_m;
        let told_m_s = SLIP_NOISES
            * slip_noise_m_s(
                noise_n,
                (numbers.stiffness_n_per_m, numbers.damping_n_s_per_m),
                self.grid.step_s,
            );
        let usual_m_s = rms(&self.root_speed_m_s);
        self.smoothing = Smoothing::new(&self.friction_nm, self.friction_noise_nm, told_m_s, usual_m_s);
        let least_nm = smoothed_flat(&self.friction_nm, OBSERVED_OVER);
        self.observed_nm = self.smoothing.further(least_nm, 0.0);
        self
    }

    /// With the disc's own angle in place of the encoder's.
    #[must_use]
    pub fn following(&self, angle_rad: &[f64]) -> Self {
        let root_m: Vec<f64> = angle_rad.iter().map(|a| self.radius_m * a).collect();
        let root_speed_m_s = smooth_speed(&root_m, self.grid.step_s);
        Self { angle_rad: angle_rad.to_vec(), root_m, root_speed_m_s, ..self.clone() }
    }

    /// With its difference from another reckoning as the error of the sliding speed.
    #[must_use]
    pub fn known_as_well_as(&self, other: &Self) -> Self {
        let pairs = self.root_speed_m_s.iter().zip(&other.root_speed_m_s);
        let error = rms(&pairs.map(|(a, b)| a - b).collect::<Vec<_>>());
        Self {
            speed_noise_m_s: self.speed_noise_m_s.hypot(error),
            unsure_m_s: self.unsure_m_s.hypot(error),
            ..self.clone()
        }
    }

    /// The normal force where its bridge shows so much when nothing presses, N.
    pub fn load_above(&self, zero_n: f64) -> Cow<'_, [f64]> {
        if zero_n == 0.0 {
            return Cow::Borrowed(&self.load_n);
        }
        self.load_n.iter().map(|load| load - zero_n).collect()
    }

    /// Values of the friction channel beyond which it is at an end of its range, N m.
    pub fn near_ends(&self, ends: &Ends) -> (f64, f64) {
        let near = END_NOISES * self.friction_noise_nm;
        let (low, high) = ends.told_between();
        let (lowest, highest) = ends.range();
        (low.max(lowest + near), high.min(highest - near))
    }

    /// Takes out the points at which the friction channel shows an end of its range, and what the amplifier smears.
    pub fn leave_out_ends(&mut self, ends: &Ends) {
        let (low, high) = self.near_ends(ends);
        let ends = self.logged_nm.iter().map(|x| *x > high || *x < low).collect();
        self.leave_out(ends);
    }

    /// Takes out the points at which the normal channel shows its upper end, to which it bends within this width.
    pub fn leave_out_normal_end(&mut self, end_n: f64, knee_n: f64) {
        let near = END_NOISES * knee_n;
        let ends = self.logged_n.iter().map(|x| *x > end_n - near).collect();
        self.leave_out(ends);
    }

    fn leave_out(&mut self, ends: Vec<bool>) {
        const BEFORE: usize = 12;
        const AFTER: usize = 25;
        let last = self.len().saturating_sub(1);
        for i in (0..self.len()).filter(|i| ends[*i]) {
            self.usable[i.saturating_sub(BEFORE)..=(i + AFTER).min(last)].fill(false);
        }
    }

    /// Points of the grid.
    pub fn len(&self) -> usize {
        self.grid.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.grid.is_empty()
    }
}

/// Of a mode above half the rate of the samples, behind the low-pass.
fn unseen_ringing(bridge: &Bridge, step_s: f64) -> Option<(f64, f64)> {
    let mode = bridge.mode.filter(|mode| mode.mode_hz * step_s > 0.5)?;
    let passes = bridge.lowpass_hz.map_or(1.0, |hz| 1.0 / (1.0 + (mode.mode_hz / hz).powi(4)).sqrt());
    let decay = mode.damping_ratio * std::f64::consts::TAU * mode.mode_hz;
    Some((passes * std::f64::consts::FRAC_1_SQRT_2, (-decay * step_s).exp()))
}

fn smooth_speed(way_m: &[f64], step_s: f64) -> Vec<f64> {
    let speed: Vec<f64> = gradient(way_m).iter().map(|d| d / step_s).collect();
    gaussian(&speed, 3.0, 0)
}

fn magnitudes(values: &[f64]) -> Vec<f64> {
    values.iter().map(|x| x.abs()).collect()
}

/// Smoothed over many samples where the signal is steady, over few where it moves: the weight follows how far two
/// smoothed versions differ against what noise alone would make of that (a quarter of its variance).
fn steady_smoothed(values: &[f64], noise: f64) -> Vec<f64> {
    let (narrow, wide) = (smoothed_flat(values, OBSERVED_OVER), gaussian(values, 6.0, 0));
    let square: Vec<f64> = narrow.iter().zip(&wide).map(|(a, b)| (a - b) * (a - b)).collect();
    let activity = gaussian(&square, 6.0, 0);
    let variance = (noise * noise).max(1e-24);
    (0..values.len())
        .map(|i| {
            let weight = ((activity[i] / variance - 0.8) / 4.0).clamp(0.0, 1.0);
            weight * narrow[i] + (1.0 - weight) * wide[i]
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::super::baseline::baseline;
    use super::*;
    use crate::files::model_file::{ModelFile, ModelKind};

    const COUNT_RAD: f64 = 5.2e-5;
    const RESTS: std::ops::Range<usize> = 0..2000;

    /// A disc that rests at the edge of a count, as a trembling of a fifth of one shows, and then turns to and fro.
    fn log() -> Log {
        let turned = |i: usize| {
            if RESTS.contains(&i) {
                (0.5 + 0.2 * (2.3 * i as f64).sin()) * COUNT_RAD
            } else {
                let t = 1e-3 * (i - RESTS.end) as f64;
                0.5 * COUNT_RAD + 0.1 * (1.0 - (20.0 * t).cos())
            }
        };
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..6000).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(
            Signal::M2Angle,
            (0..6000).map(|i| (turned(i) / COUNT_RAD).round() * COUNT_RAD).collect(),
        );
        log.set_signal(Signal::NormalForce, vec![60.0; 6000]);
        log.set_signal(Signal::FrictionTorque, vec![1.0; 6000]);
        log
    }

    #[test]
    fn a_resting_root_is_still_for_bristles_alone_and_turns_where_the_disc_does() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let lugre = [("sigma0_n_per_m", 2e7), ("a0", 0.6), ("a1", 0.4), ("v0_m_s", 0.1)];
        let lugre = ModelFile::new("bristles", ModelKind::Lugre, &lugre).unwrap();
        let root = |model: &ModelFile| {
            let numbers = baseline(model, 0.1).numbers;
            ContactLog::new(&log(), &rig).unwrap().at_rest_for(&numbers).root_m
        };
        let (shown, still) = (root(&ModelFile::assumed(&[]).unwrap()), root(&lugre));
        let count_m = rig.friction_radius_m * COUNT_RAD;
        let moves = |root: &[f64], range: std::ops::Range<usize>| {
            let steps = root[range].windows(2).map(|w| w[1] - w[0]);
            rms(&steps.collect::<Vec<_>>()) / count_m
        };
        assert!(moves(&shown, RESTS) > 0.5, "{}", moves(&shown, RESTS));
        // Of means of 32 samples a sixth of one's noise is left in the difference of neighbours, at most.
        assert!(moves(&still, 100..1900) < 0.05, "{}", moves(&still, 100..1900));
        let furthest = shown.iter().zip(&still).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // Estimates that agree within three deviations each, √12 of which are a count.
        assert!(furthest < 3.0 * count_m, "{furthest}");
        let ways = moves(&still, 2100..6000) / moves(&shown, 2100..6000);
        assert!((ways - 1.0).abs() < 1e-3, "{ways}");
    }
}
