//! From clean samples to what a log holds: noise, converters, encoder counts.
//!
//! Noise is white and normal, per sample, with a size drawn per case around that of good bridges and
//! drives; converters have 16 bits, encoders 480 000 counts a turn. A converter that is out of range
//! clips after the noise, as a real one does.

use std::fmt::Write as _;

use serde::Serialize;

use crate::contact_log::Sample;
use crate::laws::measurement::{Clipped, Saturation};
use crate::random::Stream;

/// Counts per radian of both encoders.
const COUNTS_PER_RAD: f64 = 480_000.0 / std::f64::consts::TAU;

/// Standard deviations.
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
}

impl Noise {
    /// Draws the sensors of a case.
    #[must_use]
    pub fn draw(seed: u64, factor: f64) -> Self {
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
        }
    }
}

/// Clipping levels of a case.
#[derive(Debug, Clone, Copy)]
pub struct Clip {
    channel: Clipped,
    level: f64,
}

impl Clip {
    /// The level that leaves the stated share of these samples below it.
    #[must_use]
    pub fn new(saturation: &Saturation, logs: &[Vec<Sample>]) -> Self {
        let mut sizes: Vec<f64> = logs
            .iter()
            .flatten()
            .map(|sample| match saturation.channel {
                Clipped::Friction => sample.friction_torque_nm.abs(),
                Clipped::Normal => sample.normal_force_n,
            })
            .collect();
        sizes.sort_by(f64::total_cmp);
        let index = (saturation.unclipped_share * sizes.len() as f64) as usize;
        Self { channel: saturation.channel, level: sizes.get(index).copied().unwrap_or(0.0) }
    }

    /// A sample's friction torque and normal force as the converter gives them.
    #[must_use]
    pub fn read(&self, friction_nm: f64, normal_n: f64) -> (f64, f64) {
        match self.channel {
            Clipped::Friction => (friction_nm.clamp(-self.level, self.level), normal_n),
            Clipped::Normal => (friction_nm, normal_n.min(self.level)),
        }
    }

    /// RMS of what is lost of friction torque and normal force in a log.
    #[must_use]
    pub fn lost(&self, samples: &[Sample]) -> (f64, f64) {
        let (mut friction, mut normal) = (0.0, 0.0);
        for sample in samples {
            let (f, n) = self.read(sample.friction_torque_nm, sample.normal_force_n);
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
    text.push_str(
        "time_s,m1_torque_ref_nm,m1_torque_nm,m1_angle_rad,m2_torque_ref_nm,m2_torque_nm,m2_angle_rad,\
         m2_speed_rad_s,normal_force_n,friction_torque_nm",
    );
    text.push_str(if temperature { ",surface_temperature_c\n" } else { "\n" });
    for sample in samples {
        let mut friction = sample.friction_torque_nm + noise.friction_nm * s.normal();
        let mut normal = sample.normal_force_n + noise.normal_n * s.normal();
        if let Some(clip) = clip {
            (friction, normal) = clip.read(friction, normal);
        }
        let jitter = noise.angle_counts / COUNTS_PER_RAD;
        let row = [
            sample.m1_torque_ref_nm,
            converted(sample.m1_torque_nm + noise.m1_torque_nm * s.normal(), 20.0),
            counted(sample.m1_angle_rad + jitter * s.normal()),
            sample.m2_torque_ref_nm,
            converted(sample.m2_torque_nm + noise.m2_torque_nm * s.normal(), 20.0),
            counted(sample.m2_angle_rad + jitter * s.normal()),
            sample.m2_speed_rad_s + noise.speed_rad_s * s.normal(),
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
