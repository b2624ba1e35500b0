//! Laws of the sensors.

use serde::Serialize;

use crate::random::Stream;

/// The friction bridge reads T + κ F_N (1 + ε F_N/100 N).
#[derive(Debug, Clone, Serialize)]
pub struct Crosstalk {
    share_nm_per_n: f64,
    curvature: f64,
}

impl Crosstalk {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share_nm_per_n: s.signed(0.003, 0.008), curvature: s.uniform(0.0, 0.2) }
    }

    /// What the friction bridge sees of the normal force.
    #[must_use]
    pub fn at(&self, normal_n: f64) -> f64 {
        self.share_nm_per_n * normal_n * (1.0 + self.curvature * normal_n / 100.0)
    }
}

/// Which bridge drifts, and how.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Drifting {
    /// Zero of the friction bridge.
    FrictionZero,
    /// Gain of the friction bridge.
    FrictionGain,
    /// Zero of the normal bridge.
    NormalZero,
    /// Gain of the normal bridge.
    NormalGain,
}

/// Warming up: size·(1 − e^(−t/τ)), plus a slow straight part.
#[derive(Debug, Clone, Serialize)]
pub struct Drift {
    what: Drifting,
    size: f64,
    warm_up_s: f64,
    straight_per_s: f64,
}

impl Drift {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        let what = s.pick(&[
            Drifting::FrictionZero,
            Drifting::FrictionGain,
            Drifting::NormalZero,
            Drifting::NormalGain,
        ]);
        let size = match what {
            Drifting::FrictionZero => s.signed(0.25, 0.6),
            Drifting::FrictionGain | Drifting::NormalGain => s.signed(0.1, 0.2),
            Drifting::NormalZero => s.signed(5.0, 11.0),
        };
        let warm_up_s = s.uniform(4.0, 14.0);
        Self { what, size, warm_up_s, straight_per_s: size * s.uniform(0.0, 0.02) }
    }

    /// What drifts.
    #[must_use]
    pub fn what(&self) -> Drifting {
        self.what
    }

    /// How far it has drifted.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        self.size * (1.0 - (-time_s / self.warm_up_s).exp()) + self.straight_per_s * time_s
    }
}

/// The torque ring's true mode.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Ring {
    /// Frequency.
    pub mode_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
}

impl Ring {
    /// Draws one that a log of this rate can show.
    pub fn draw(s: &mut Stream, rate_hz: f64) -> Self {
        let high = (0.36 * rate_hz).min(160.0);
        Self { mode_hz: s.uniform(0.55 * high, high), damping_ratio: s.log_uniform(6e-3, 1.5e-2) }
    }
}

/// A code disc whose centre is off the shaft's: the read angle is that of the vector
/// e^{iθ} + e·e^{iψ}: θ + arg(1 + e·e^{i(ψ − θ)}).
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Eccentricity {
    share: f64,
    phase_rad: f64,
}

impl Eccentricity {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { share: s.uniform(0.05, 0.09), phase_rad: s.phase() }
    }

    /// Read angle at a true one.
    #[must_use]
    pub fn angle(&self, true_angle: f64) -> f64 {
        let (sine, cosine) = (self.phase_rad - true_angle).sin_cos();
        true_angle + (self.share * sine).atan2(1.0 + self.share * cosine)
    }

    /// Read speed per true speed.
    #[must_use]
    pub fn rate(&self, true_angle: f64) -> f64 {
        let cosine = (self.phase_rad - true_angle).cos();
        let e = self.share;
        1.0 - (e * cosine + e * e) / (1.0 + 2.0 * e * cosine + e * e)
    }
}

/// Channel that clips.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Clipped {
    /// Friction torque, both signs.
    Friction,
    /// Normal force, from above.
    Normal,
}

/// A converter that runs out of range at the level which this share of the samples stays below.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Saturation {
    /// Channel.
    pub channel: Clipped,
    /// Share of the samples, by size, that are read right.
    pub unclipped_share: f64,
}

impl Saturation {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            channel: s.pick(&[Clipped::Friction, Clipped::Friction, Clipped::Normal]),
            unclipped_share: s.uniform(0.68, 0.88),
        }
    }
}
