//! Laws that change the coefficient of friction, or the block.

use serde::Serialize;

use crate::contact_force::Branch;
use crate::random::Stream;

/// What a law of µ may depend on, at one step.
#[derive(Debug, Clone, Copy)]
pub struct Slide {
    /// Step.
    pub step_s: f64,
    /// Time in the log.
    pub time_s: f64,
    /// Speed at which the tips slide.
    pub tip_speed_m_s: f64,
    /// Speed of the disc under the elements.
    pub root_speed_m_s: f64,
    /// Normal force.
    pub normal_n: f64,
    /// Friction force of the last step.
    pub force_n: f64,
    /// Angle of the disc itself, whatever the encoder counts.
    pub disc_angle_rad: f64,
}

/// Two thermal nodes: a thin layer that sliding heats, backed by the bulk of the element, which loses
/// heat to the air. C_f Ṫ_f = P − G (T_f − T_b), C_b Ṫ_b = G (T_f − T_b) − H T_b, temperatures over
/// ambient. µ/µ0 = r + (1 − r)/(1 + (T_f/T_h)^p).
#[derive(Debug, Clone, Serialize)]
pub struct ThermalFade {
    layer_j_per_k: f64,
    bulk_j_per_k: f64,
    to_bulk_w_per_k: f64,
    to_air_w_per_k: f64,
    half_k: f64,
    power: f64,
    residual: f64,
    #[serde(skip)]
    layer_k: f64,
    #[serde(skip)]
    bulk_k: f64,
}

impl ThermalFade {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        let to_bulk = s.uniform(0.6, 1.0);
        let bulk = s.uniform(3.5, 6.0);
        Self {
            layer_j_per_k: to_bulk * s.uniform(0.25, 0.7),
            bulk_j_per_k: bulk,
            to_bulk_w_per_k: to_bulk,
            to_air_w_per_k: bulk / s.uniform(5.0, 12.0),
            half_k: s.uniform(70.0, 110.0),
            power: s.uniform(1.3, 2.0),
            residual: s.uniform(0.3, 0.45),
            layer_k: 0.0,
            bulk_k: 0.0,
        }
    }

    /// A surface of average properties, for the temperature sensor of a case without the effect.
    #[must_use]
    pub fn average() -> Self {
        Self {
            layer_j_per_k: 0.4,
            bulk_j_per_k: 4.7,
            to_bulk_w_per_k: 0.8,
            to_air_w_per_k: 0.6,
            half_k: 90.0,
            power: 1.6,
            residual: 0.4,
            layer_k: 0.0,
            bulk_k: 0.0,
        }
    }

    /// Surface temperature over ambient.
    #[must_use]
    pub fn layer_k(&self) -> f64 {
        self.layer_k
    }

    /// Heats and cools for a step.
    pub fn heat(&mut self, slide: &Slide) {
        let power = (slide.force_n * slide.tip_speed_m_s).max(0.0);
        let across = self.to_bulk_w_per_k * (self.layer_k - self.bulk_k);
        self.layer_k += slide.step_s * (power - across) / self.layer_j_per_k;
        self.bulk_k += slide.step_s * (across - self.to_air_w_per_k * self.bulk_k) / self.bulk_j_per_k;
    }

    /// Factor on µ.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        self.heat(slide);
        let ratio = self.layer_k.max(0.0) / self.half_k;
        self.residual + (1.0 - self.residual) / (1.0 + ratio.powf(self.power))
    }
}

/// µ/µ0 = 1 + A (1 − (1 + s/s0)^−p): a power law of the distance slid that settles.
#[derive(Debug, Clone, Serialize)]
pub struct WearDrift {
    change: f64,
    scale_m: f64,
    power: f64,
    #[serde(skip)]
    slid_m: f64,
}

impl WearDrift {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            change: s.signed(0.22, 0.42),
            scale_m: s.uniform(1.5, 4.0),
            power: s.uniform(0.6, 1.2),
            slid_m: 0.0,
        }
    }

    /// Factor on µ.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        if slide.normal_n > 0.5 {
            self.slid_m += slide.step_s * slide.tip_speed_m_s.abs();
        }
        1.0 + self.change * (1.0 - (1.0 + self.slid_m / self.scale_m).powf(-self.power))
    }
}

/// µ/µ0 = exp(Σ A_k sin(n_k φ + ψ_k)), φ the angle of the disc itself.
#[derive(Debug, Clone, Serialize)]
pub struct DiscAngle {
    /// (order per revolution, amplitude, phase)
    waves: Vec<(f64, f64, f64)>,
}

impl DiscAngle {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        let mut orders = [1.0, 2.0, 3.0, 4.0, 5.0];
        s.shuffle(&mut orders);
        let count = 2 + s.below(2);
        let waves = orders[..count].iter().map(|order| (*order, s.uniform(0.035, 0.08), s.phase())).collect();
        Self { waves }
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        let sum: f64 = self
            .waves
            .iter()
            .map(|(order, amplitude, phase)| amplitude * (order * slide.disc_angle_rad + phase).sin())
            .sum();
        sum.exp()
    }
}

/// Thirion's law of rubber, 1/µ = a + b·p: µ/µ0 = (1 + F_r/F_s)/(1 + F_N/F_s), 1 at F_r.
#[derive(Debug, Clone, Serialize)]
pub struct LoadDependence {
    scale_n: f64,
    reference_n: f64,
}

impl LoadDependence {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self { scale_n: s.log_uniform(90.0, 220.0), reference_n: s.uniform(35.0, 55.0) }
    }

    /// Factor on µ.
    #[must_use]
    pub fn factor(&self, slide: &Slide) -> f64 {
        (1.0 + self.reference_n / self.scale_n) / (1.0 + slide.normal_n.max(0.0) / self.scale_n)
    }
}

/// Age of the contact: ψ̇ = 1 − |v| ψ/D; µ/µ0 = 1 + B (1 − (1 + ψ/τ)^−q), which runs along the
/// logarithm of ψ over two to three decades and then settles.
#[derive(Debug, Clone, Serialize)]
pub struct StaticAgeing {
    gain: f64,
    onset_s: f64,
    power: f64,
    renewal_m: f64,
    #[serde(skip)]
    age_s: f64,
}

impl StaticAgeing {
    /// Draws one.
    pub fn draw(s: &mut Stream) -> Self {
        Self {
            gain: s.uniform(0.55, 0.95),
            onset_s: s.log_uniform(0.03, 0.1),
            power: s.uniform(0.2, 0.3),
            renewal_m: s.log_uniform(1.5e-3, 4e-3),
            age_s: 0.0,
        }
    }

    /// Factor on µ.
    pub fn factor(&mut self, slide: &Slide) -> f64 {
        if slide.normal_n > 0.5 {
            let renewal = slide.step_s * slide.tip_speed_m_s.abs() / self.renewal_m;
            self.age_s = (self.age_s + slide.step_s) / (1.0 + renewal);
        } else {
            self.age_s = 0.0;
        }
        1.0 + self.gain * (1.0 - (1.0 + self.age_s / self.onset_s).powf(-self.power))
    }
}

/// Three Maxwell branches from hundredths of a second to seconds; stiffness as a share of the block's.
pub fn relaxation_branches(s: &mut Stream) -> Vec<Branch> {
    [(0.02, 0.05), (0.15, 0.4), (0.8, 2.0)]
        .iter()
        .map(|(fast, slow)| Branch {
            stiffness_n_per_m: s.uniform(0.25, 0.6),
            relaxation_s: s.log_uniform(*fast, *slow),
        })
        .collect()
}
