//! From clean samples to what a log holds: noise, converters, encoder counts.
//!
//! Noise is normal, per sample, with a size drawn per case around that of good bridges and drives; the bridges' has a
//! part that falls with frequency (a strain gauge's amplifier flickers), and they show a little where nothing pulls. Behind a
//! converter that averages, which each of them has in a third of the cases, a sample keeps some of the noise of the one before.
//! Converters have 16 bits, encoders 480 000 counts a turn. Order: amplifier (it may clip), noise, converter (so may
//! it). A drive reports its speed as it turns, or as the way of the counts over the last samples, half of them late.

use std::fmt::Write as _;

use serde::Serialize;

use crate::contact_log::Sample;
use crate::laws::clipping::{Clipped, Edge, Saturation};
use crate::random::Stream;

/// Share of its limit by which an overdriven amplifier reads too much just after.
const OVERDRIVE: f64 = 0.2;
/// Counts per radian of both encoders.
const COUNTS_PER_RAD: f64 = 480_000.0 / std::f64::consts::TAU;

/// Time constants of what flickers, s: parts of equal size a decade apart have a power that falls with frequency.
const FLICKER_S: [f64; 4] = [0.01, 0.1, 1.0, 10.0];
/// Range of what of a sample's noise stays in the next one, behind a converter that averages.
const KEPT: [f64; 2] = [0.5, 0.9];
/// Most samples over which a drive takes its speed.
const MOST_SAMPLES: usize = 4;

/// Standard deviations, and what else is between a sample and its log.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Noise {
    /// Friction torque.
    pub friction_nm: f64,
    /// Normal force.
    pub normal_n: f64,
    /// M1 torque.
    pub m1_torque_nm: f64,
    /// M2 torque.
    pub m2_torque_nm: f64,
    /// M2 speed.
    pub speed_rad_s: f64,
    /// Angles, in counts.
    pub angle_counts: f64,
    /// Surface temperature.
    pub temperature_k: f64,
    /// What flickers in the bridges beside their white noise, over that.
    pub flicker_share: f64,
    /// What the friction bridge shows where nothing pulls.
    pub friction_zero_nm: f64,
    /// What the normal bridge shows where nothing presses.
    pub normal_zero_n: f64,
    /// Samples over which the drive takes its speed from its counts; 0 where it knows it.
    pub speed_samples: usize,
    /// What of a sample's noise stays in the next one, by bridge (friction, normal): a converter that averages.
    pub kept: [f64; 2],
}

impl Noise {
    /// Draws the sensors of a case.
    #[must_use]
    pub fn draw(seed: u64, factor: f64) -> Self {
        let mut sensors = Stream::new(seed, "bridges and speed");
        let (friction_zero, normal_zero) = (sensors.uniform(-0.012, 0.012), sensors.uniform(-0.24, 0.24));
        let flicker_share = sensors.uniform(0.2, 0.7);
        let reports = sensors.chance(0.5) && factor > 0.0;
        let speed_samples = if reports { 1 + sensors.below(MOST_SAMPLES) } else { 0 };
        // Each of the bridges in a third of the cases.
        let mut converters = Stream::new(seed, "converters");
        let kept = [(); 2].map(|()| {
            let (averages, kept) = (converters.chance(1.0 / 3.0), converters.uniform(KEPT[0], KEPT[1]));
            if averages { kept } else { 0.0 }
        });
        let mut s = Stream::new(seed, "noise");
        let mut about = |value: f64| factor * s.about(value, 0.3);
        Self {
            friction_nm: about(0.014),
            normal_n: about(0.28),
            m1_torque_nm: about(0.008),
            m2_torque_nm: about(0.014),
            speed_rad_s: about(0.004),
            angle_counts: about(0.3),
            temperature_k: about(0.3),
            flicker_share,
            friction_zero_nm: factor * friction_zero,
            normal_zero_n: factor * normal_zero,
            speed_samples,
            kept,
        }
    }
}

/// Clipping of a case.
#[derive(Debug, Clone, Copy)]
pub struct Clip {
    channel: Clipped,
    edge: Edge,
    low: f64,
    high: f64,
    /// What clipping holds back, where the amplifier leaves its rails late.
    held: f64,
    last_s: f64,
}

impl Clip {
    /// The limits that leave the stated share of these samples within them.
    #[must_use]
    pub fn new(saturation: &Saturation, logs: &[Vec<Sample>]) -> Self {
        let value = |sample: &Sample| match saturation.channel {
            Clipped::Friction => sample.friction_torque_nm,
            Clipped::Normal => sample.normal_force_n,
        };
        let all: Vec<f64> = logs.iter().flatten().map(value).collect();
        // One rail: on the side with the more samples beyond the middle of the sizes.
        let mut sizes: Vec<f64> = all.iter().map(|value| value.abs()).collect();
        sizes.sort_by(f64::total_cmp);
        let at = |share: f64| sizes.get((share * sizes.len() as f64) as usize).copied().unwrap_or(0.0);
        let (level, middle) = (at(saturation.unclipped_share), at(0.5));
        let (above, below) = all
            .iter()
            .filter(|value| value.abs() > middle)
            .fold((0, 0), |(up, down), value| if *value > 0.0 { (up + 1, down) } else { (up, down + 1) });
        let one = saturation.edge == Edge::OneRail;
        Self {
            channel: saturation.channel,
            edge: saturation.edge,
            low: if one && above >= below { f64::NEG_INFINITY } else { -level },
            high: if one && above < below { f64::INFINITY } else { level },
            held: 0.0,
            last_s: 0.0,
        }
    }

    fn amplified(&mut self, value: f64, time_s: f64) -> f64 {
        let elapsed = time_s - std::mem::replace(&mut self.last_s, time_s);
        match self.edge {
            Edge::Converter => value,
            Edge::Rails | Edge::OneRail => value.clamp(self.low, self.high),
            Edge::Soft { power } => {
                value / (1.0 + (value / self.high).abs().powf(2.0 * power)).powf(0.5 / power)
            }
            Edge::Recovery { time_s } => {
                let inside = value.clamp(self.low, self.high);
                self.held =
                    if inside == value { self.held * (-elapsed / time_s).exp() } else { OVERDRIVE * inside };
                (value + self.held).clamp(self.low, self.high)
            }
        }
    }

    /// A sample's friction torque and normal force as the amplifier gives them.
    pub fn amplifier(&mut self, sample: &Sample) -> (f64, f64) {
        let (friction, normal) = (sample.friction_torque_nm, sample.normal_force_n);
        match self.channel {
            Clipped::Friction => (self.amplified(friction, sample.time_s), normal),
            Clipped::Normal => (friction, self.amplified(normal, sample.time_s)),
        }
    }

    /// The same with its noise, as the converter gives them.
    #[must_use]
    pub fn converter(&self, friction_nm: f64, normal_n: f64) -> (f64, f64) {
        match (self.edge, self.channel) {
            (Edge::Converter, Clipped::Friction) => (friction_nm.clamp(self.low, self.high), normal_n),
            (Edge::Converter, Clipped::Normal) => (friction_nm, normal_n.clamp(self.low, self.high)),
            _ => (friction_nm, normal_n),
        }
    }

    /// RMS of what is lost of friction torque and normal force in a log.
    #[must_use]
    pub fn lost(&self, samples: &[Sample]) -> (f64, f64) {
        let mut clip = *self;
        let (mut friction, mut normal) = (0.0, 0.0);
        for sample in samples {
            let (f, n) = clip.amplifier(sample);
            let (f, n) = self.converter(f, n);
            friction += (sample.friction_torque_nm - f).powi(2);
            normal += (sample.normal_force_n - n).powi(2);
        }
        let count = samples.len().max(1) as f64;
        ((friction / count).sqrt(), (normal / count).sqrt())
    }
}

fn converted(value: f64, span: f64) -> f64 {
    let lsb = span / 65_536.0;
    (value / lsb).round() * lsb
}

fn counted(angle: f64) -> f64 {
    (angle * COUNTS_PER_RAD).round() / COUNTS_PER_RAD
}

/// What flickers with a deviation of 1: first-order processes, each as large as the others.
struct Flicker {
    states: [f64; FLICKER_S.len()],
    last_s: f64,
}

impl Flicker {
    fn new(s: &mut Stream) -> Self {
        Self { states: FLICKER_S.map(|_| s.normal()), last_s: 0.0 }
    }

    fn at(&mut self, time_s: f64, s: &mut Stream) -> f64 {
        let elapsed = time_s - std::mem::replace(&mut self.last_s, time_s);
        for (state, constant_s) in self.states.iter_mut().zip(FLICKER_S) {
            let kept = (-elapsed / constant_s).exp();
            *state = kept * *state + (1.0 - kept * kept).sqrt() * s.normal();
        }
        self.states.iter().sum::<f64>() / (FLICKER_S.len() as f64).sqrt()
    }
}

/// Writes a contact log as CSV.
#[must_use]
pub fn contact_csv(
    samples: &[Sample],
    noise: &Noise,
    clip: Option<&Clip>,
    temperature: bool,
    s: &mut Stream,
) -> String {
    let mut text = String::with_capacity(samples.len() * 110 + 200);
    let mut clip = clip.copied();
    text.push_str(
        "time_s,m1_torque_ref_nm,m1_torque_nm,m1_angle_rad,m2_torque_ref_nm,m2_torque_nm,m2_angle_rad,\
         m2_speed_rad_s,normal_force_n,friction_torque_nm",
    );
    text.push_str(if temperature { ",surface_temperature_c\n" } else { "\n" });
    let mut flicker = [Flicker::new(s), Flicker::new(s)];
    let mut new = [s.normal(), s.normal()];
    // The first sample's counts, as long as there are none before.
    let mut counts = std::collections::VecDeque::new();
    for sample in samples {
        let [in_friction, in_normal] =
            flicker.each_mut().map(|f| noise.flicker_share * f.at(sample.time_s, s));
        let (mut friction, mut normal) = (sample.friction_torque_nm, sample.normal_force_n);
        if let Some(clip) = &mut clip {
            (friction, normal) = clip.amplifier(sample);
        }
        for (new, kept) in new.iter_mut().zip(noise.kept) {
            *new = kept * *new + (1.0 - kept * kept).sqrt() * s.normal();
        }
        friction += noise.friction_zero_nm + noise.friction_nm * (new[0] + in_friction);
        normal += noise.normal_zero_n + noise.normal_n * (new[1] + in_normal);
        if let Some(clip) = &clip {
            (friction, normal) = clip.converter(friction, normal);
        }
        let jitter = noise.angle_counts / COUNTS_PER_RAD;
        let m1_angle = counted(sample.m1_angle_rad + jitter * s.normal());
        let m2_angle = counted(sample.m2_angle_rad + jitter * s.normal());
        counts.push_back((sample.time_s, m2_angle));
        if counts.len() > noise.speed_samples + 1 {
            counts.pop_front();
        }
        let (since_s, from) = counts[0];
        let speed = if noise.speed_samples == 0 {
            sample.m2_speed_rad_s + noise.speed_rad_s * s.normal()
        } else if sample.time_s > since_s {
            (m2_angle - from) / (sample.time_s - since_s)
        } else {
            0.0
        };
        let row = [
            sample.m1_torque_ref_nm,
            converted(sample.m1_torque_nm + noise.m1_torque_nm * s.normal(), 20.0),
            m1_angle,
            sample.m2_torque_ref_nm,
            converted(sample.m2_torque_nm + noise.m2_torque_nm * s.normal(), 20.0),
            m2_angle,
            speed,
            converted(normal, 240.0),
            converted(friction, 24.0),
        ];
        let _ = write!(text, "{:.6}", sample.time_s);
        for value in row {
            let _ = write!(text, ",{value:.6}");
        }
        let heat = s.normal();
        if temperature {
            let _ = write!(text, ",{:.2}", sample.surface_temperature_c + noise.temperature_k * heat);
        }
        text.push('\n');
    }
    text
}
