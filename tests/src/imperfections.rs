//! What is not perfect in any log, whatever effect it hides: hum, bounce, missing samples, jitter.
//!
//! - hum: the mains' 50 Hz and 150 Hz in both bridges, below the noise where mild;
//! - bounce: the disc's roughness shakes the normal force through the mechanism's mode while the disc turns;
//! - missing samples: single rows and short runs of them lost on the way to the file, stamps right;
//! - jitter: samples taken early or late by a few hundredths of the period, stamped when they were taken.
//!
//! Mild ones are drawn by the seed, each with probability 1/2; strong ones are always there. What a log needs
//! comes from streams of its own, so that all other draws are the same with and without.

use clap::ValueEnum;
use serde::Serialize;

use crate::contact_log::STEPS_PER_S;
use crate::random::Stream;
use crate::sensors::Noise;

/// How imperfect the logs are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Imperfection {
    /// Not at all.
    None,
    /// As in a good laboratory.
    #[default]
    Mild,
    /// As in a workshop.
    Strong,
}

/// The imperfections of a case.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct Imperfections {
    /// Amplitude of the hum in the friction torque.
    pub friction_hum_nm: f64,
    /// Amplitude of the hum in the normal force.
    pub normal_hum_n: f64,
    /// RMS of the bounce over the normal force.
    pub bounce_share: f64,
    /// Share of the rows that are missing.
    pub missing_share: f64,
    /// Longest run of missing rows.
    pub longest_missing: usize,
    /// Standard deviation of the sampling instants.
    pub jitter_s: f64,
}

impl Imperfections {
    /// Draws those of a case.
    #[must_use]
    pub fn draw(seed: u64, level: Imperfection, noise: &Noise, rate_hz: f64) -> Self {
        let mut s = Stream::new(seed, "imperfections");
        let (chance, factor, longest_missing) = match level {
            Imperfection::None => return Self::default(),
            Imperfection::Mild => (0.5, 1.0, 4),
            Imperfection::Strong => (1.0, 4.0, 8),
        };
        let mut perhaps = |low: f64, high: f64| {
            let (there, value) = (s.chance(chance), factor * s.log_uniform(low, high));
            if there { value } else { 0.0 }
        };
        Self {
            friction_hum_nm: noise.friction_nm * perhaps(0.1, 0.5),
            normal_hum_n: noise.normal_n * perhaps(0.1, 0.5),
            bounce_share: perhaps(0.5e-3, 3e-3),
            missing_share: perhaps(3e-4, 3e-3),
            longest_missing,
            jitter_s: perhaps(0.01, 0.04) / rate_hz,
        }
    }

    /// Steps of the plant at which a log of this length is sampled.
    #[must_use]
    pub fn schedule(&self, rate_hz: f64, duration_s: f64, s: &mut Stream) -> Vec<usize> {
        let every = (STEPS_PER_S / rate_hz).round() as usize;
        let last = (duration_s * STEPS_PER_S).round() as usize;
        let furthest = (every as f64 / 3.0).floor();
        let sd = self.jitter_s * STEPS_PER_S;
        let mean_run = 0.5 * (1.0 + self.longest_missing as f64);
        let mut steps = Vec::with_capacity(last / every + 1);
        let mut missing = 0;
        for at in (0..=last).step_by(every) {
            let (late, lost) = (sd * s.normal(), s.chance(self.missing_share / mean_run));
            let length = 1 + s.below(self.longest_missing.max(1));
            if missing > 0 {
                missing -= 1;
            } else if lost && at > 0 {
                missing = length - 1;
            } else {
                let moved = at as f64 + late.round().clamp(-furthest, furthest);
                steps.push(if at == 0 { 0 } else { (moved as usize).min(last) });
            }
        }
        steps
    }
}

/// Hum and bounce of one log.
#[derive(Debug, Clone)]
pub struct Disturbance {
    imperfections: Imperfections,
    phase: f64,
    bounce: Stream,
    kick: f64,
}

impl Disturbance {
    /// Those of a log.
    #[must_use]
    pub fn new(imperfections: &Imperfections, seed: u64, log: usize) -> Self {
        let mut bounce = Stream::new(seed, &format!("bounce {log}"));
        Self { imperfections: *imperfections, phase: bounce.phase(), bounce, kick: 0.0 }
    }

    /// Hum at a time: friction torque, normal force.
    #[must_use]
    pub fn hum(&self, time_s: f64) -> (f64, f64) {
        let turn = std::f64::consts::TAU * 50.0 * time_s + self.phase;
        let wave = turn.sin() + 0.2 * (3.0 * turn).sin();
        (self.imperfections.friction_hum_nm * wave, self.imperfections.normal_hum_n * wave)
    }

    /// Draws the next push of the road; once per control period.
    pub fn push(&mut self, normal_n: f64, sliding_m_s: f64) {
        if self.imperfections.bounce_share > 0.0 {
            // The mechanism's mode passes about 0.4 of the RMS of a push that is held for 0.25 ms.
            let size = self.imperfections.bounce_share / 0.4 * normal_n;
            let moving = sliding_m_s.abs() / (sliding_m_s.abs() + 0.05);
            self.kick = size * moving * self.bounce.normal();
        }
    }

    /// Force of the last push.
    #[must_use]
    pub fn kick_n(&self) -> f64 {
        self.kick
    }
}
