//! `thermal_fade`: µ falls as dissipated power heats the surface and recovers as it cools.

use model_core::extension::thermal_fade::ThermalFade as Law;

use super::coordinates::{HEAT_TIMES_S, held, saturating};
use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub struct ThermalFade;

/// Bends of the law over heat, in shares of the largest.
const BENDS: [f64; 3] = [0.05, 0.2, 1.0];

impl Effect for ThermalFade {
    fn id(&self) -> &'static str {
        "thermal_fade"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let (mut columns, mut parameters) = (Vec::new(), Vec::new());
        for (at, time_s) in HEAT_TIMES_S.iter().enumerate() {
            for bend in BENDS {
                let fall = |heat: &[f64]| saturating(heat, view.scales.heat_j[at], bend).iter().map(|x| -x).collect();
                columns.push(view.coordinates.iter().map(|c| fall(&c.heat_j[at])).collect());
                parameters.push(Parameter::positive(format!("fade_{time_s}s_{bend}"), 1.0));
            }
        }
        vec![ContactTerm::factor(self.id(), "", columns, parameters), law(view)]
    }
}

/// The core's law: one thermal node and its bend.
fn law(view: &ContactView<'_>) -> ContactTerm {
    let power: Vec<(f64, Vec<f64>)> =
        view.logs.iter().zip(view.coordinates).map(|(log, c)| (log.grid.step_s, c.power_w.clone())).collect();
    let usual_w = view.scales.heat_j[0] / HEAT_TIMES_S[0];
    let parameters = vec![
        // Fade in a second of the largest power.
        Parameter::logarithm("fade", 0.1, 1.5),
        Parameter::logarithm("cooling_s", 5.0, 1.2),
        Parameter::logarithm("saturation", 0.7, 1.0),
        Parameter::logarithm("exponent", 1.0, 0.3),
    ];
    let starts = [1.5, 6.0, 25.0].map(|t: f64| [0.02, 0.1].map(|f: f64| vec![f.ln(), t.ln(), 0.7f64.ln(), 0.0])).concat();
    ContactTerm {
        law: true,
        ..ContactTerm::any("thermal_fade", parameters, Starts::BestOf(starts, 2), move |p, change| {
            let (fade, time_s) = (p[0].exp() / usual_w, p[1].exp().clamp(0.02, 1e4));
            let values = [fade.min(10.0), time_s, 0.0, 1e3, p[2].exp().clamp(0.0, 100.0), p[3].exp().clamp(0.2, 5.0)];
            let Ok(law) = Law::new(&values) else { return };
            let column: Vec<Vec<f64>> = power
                .iter()
                .map(|(step_s, power)| held(power, *step_s, time_s).iter().map(|e| law.factor(&[*e, 0.0]).ln()).collect())
                .collect();
            change.add_log_factor(&[column], &[1.0]);
        })
    }
}
