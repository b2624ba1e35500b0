//! Fig. 27: steady friction over sliding speed, LuGre's falling curve against the measured bell.
//!
//! The models are run to their steady state at each speed. Where one does not come to rest but sticks and slips, the
//! mean and the span of the last half are given. The bell is Savkoor's, with assumed numbers: the paper prints
//! the shape and no scale.

use super::candidate_models::{drive, five};
use crate::files::experiment_file::SpeedSweep;
use crate::files::log::Log;
use crate::report::{Chart, Line, Panel, Role};
use model_core::error::ParameterError;
use model_core::friction::series::SeriesParameters;
use model_core::friction::static_curve::{Bell, BellParameters, lugre_coefficient};
use model_core::friction::stribeck::Stribeck;

/// The bell, assumed: from 0.7 at creep to 1.1 at 0.1 m/s.
pub const BELL: BellParameters<f64> =
    BellParameters { mu_0: 0.7, mu_m: 1.1, v_m_m_s: 0.1, h_per_decade: 1.2 };

/// Friction coefficients over speed.
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Speeds.
    pub speed_m_s: Vec<f64>,
    /// g(v) + a2 v.
    pub curve: Vec<f64>,
    /// The bell.
    pub bell: Vec<f64>,
    /// LuGre, run to its steady state.
    pub lugre: Vec<f64>,
    /// Series element: mean, least and largest over the last half of the run.
    pub series: Vec<[f64; 3]>,
}

/// Runs the models at each speed.
///
/// # Errors
/// A parameter out of range.
pub fn run(sweep: &SpeedSweep, rubber: &SeriesParameters<f64>) -> Result<Sweep, ParameterError> {
    let curve = Stribeck::new(&rubber.bristles.stribeck)?;
    let bell = Bell::new(&BELL)?;
    let load = sweep.normal_force_n;
    let ratio = (sweep.to_m_s / sweep.from_m_s).ln() / (sweep.points - 1) as f64;
    let speed_m_s: Vec<f64> = (0..sweep.points).map(|k| sweep.from_m_s * (ratio * k as f64).exp()).collect();
    let mut out = Sweep {
        curve: speed_m_s.iter().map(|v| lugre_coefficient(&curve, rubber.bristles.a2_s_per_m, *v)).collect(),
        bell: speed_m_s.iter().map(|v| bell.coefficient(*v)).collect(),
        lugre: Vec::new(),
        series: Vec::new(),
        speed_m_s,
    };
    for v in &out.speed_m_s {
        let models = five(rubber, *v, load)?;
        // Of LuGre's way to its steady value e^{−14} is left; and time for the block to relax.
        let duration_s = 14.0 * load * curve.largest() / rubber.k_u_n_per_m / v
            + 20.0 * rubber.c_u_n_s_per_m / rubber.k_u_n_per_m;
        let steps = 20_000;
        let step_s = duration_s / f64::from(steps);
        let coefficients = |role: Role| -> Result<Vec<f64>, ParameterError> {
            let Some(model) = models.iter().find(|m| m.role == role) else { return Ok(Vec::new()) };
            let force = drive(&model.parameters.model(step_s)?, (0..steps).map(|_| (*v, load)));
            Ok(force[force.len() / 2..].iter().map(|f| f / load).collect())
        };
        let last = |c: &[f64]| c.last().copied().unwrap_or(f64::NAN);
        out.lugre.push(last(&coefficients(Role::Lugre)?));
        let series = coefficients(Role::Series)?;
        let mean = series.iter().sum::<f64>() / series.len() as f64;
        let (low, high) = series.iter().fold((f64::INFINITY, 0.0f64), |(l, h), c| (l.min(*c), h.max(*c)));
        out.series.push([mean, low, high]);
    }
    Ok(out)
}

impl Sweep {
    /// `curves.csv`.
    #[must_use]
    pub fn log(&self) -> Log {
        let mut log = Log::default();
        let series = |k: usize| self.series.iter().map(|s| s[k]).collect();
        log.set_numbers("sliding_speed_m_s", self.speed_m_s.clone());
        log.set_numbers("curve", self.curve.clone());
        log.set_numbers("bell", self.bell.clone());
        log.set_numbers("lugre", self.lugre.clone());
        log.set_numbers("series_mean", series(0));
        log.set_numbers("series_least", series(1));
        log.set_numbers("series_largest", series(2));
        log
    }

    /// The largest speed at which the series element still sticks and slips: its coefficient spans more than 1 %.
    #[must_use]
    pub fn stick_slip_below_m_s(&self) -> Option<f64> {
        let span = |s: &[f64; 3]| (s[2] - s[1]) / s[0];
        self.series.iter().rposition(|s| span(s) > 0.01).map(|k| self.speed_m_s[k])
    }

    /// Coefficients over speed.
    #[must_use]
    pub fn chart(&self) -> Chart {
        let line = |name: &str, role, y: Vec<f64>| Line {
            name: name.into(),
            role,
            x: self.speed_m_s.clone(),
            y,
            tolerance: 1e-4,
            fine_tolerance: 1e-4,
        };
        let mut lines = vec![
            line("bell (Savkoor), numbers assumed", Role::Measured, self.bell.clone()),
            line("LuGre, run to its steady state", Role::Lugre, self.lugre.clone()),
            line("series element, mean", Role::Series, self.series.iter().map(|s| s[0]).collect()),
        ];
        if self.stick_slip_below_m_s().is_some() {
            lines.push(line(
                "series, least and largest",
                Role::Reference,
                self.series.iter().map(|s| s[1]).collect(),
            ));
            lines.push(line(
                "series, least and largest",
                Role::Reference,
                self.series.iter().map(|s| s[2]).collect(),
            ));
        }
        Chart {
            title: "Fig. 27: steady friction over sliding speed.".into(),
            caption: "The measured bell has its maximum at a speed above zero; g(v), and with it LuGre and the series \
                      element, falls from standstill on."
                .into(),
            x_title: "sliding speed, m/s".into(),
            panels: vec![Panel { y_title: "friction coefficient".into(), lines }],
            log_x: true,
            ..Chart::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::candidate_models::rubber_of;
    use super::*;
    use crate::plant::ElementParameters;

    #[test]
    fn models_settle_on_their_curve_and_the_bell_peaks_above_zero() {
        let rubber = rubber_of(&ElementParameters::default()).unwrap();
        let sweep = SpeedSweep { from_m_s: 1e-2, to_m_s: 2.0, points: 12, normal_force_n: 88.0 };
        let s = run(&sweep, &rubber).unwrap();
        for k in 0..12 {
            assert!((s.lugre[k] / s.curve[k] - 1.0).abs() < 2e-6, "LuGre at {}", s.speed_m_s[k]);
            if s.speed_m_s[k] > s.stick_slip_below_m_s().unwrap_or(0.0) {
                assert!((s.series[k][0] / s.curve[k] - 1.0).abs() < 2e-3, "series at {}", s.speed_m_s[k]);
            }
        }
        assert!(s.curve.windows(2).all(|w| w[1] < w[0]));
        let top = (0..12).max_by(|a, b| s.bell[*a].total_cmp(&s.bell[*b])).unwrap();
        assert!(top > 0 && top < 11);
    }
}
