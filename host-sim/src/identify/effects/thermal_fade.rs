//! `thermal_fade`: µ falls as dissipated power heats the surface and recovers as it cools.
//!
//! Coordinate: heat held, from the measured power. Columns: three cooling times, three bends each, fade only. Law: the
//! core's two thermal nodes ([`model_core::extension::thermal_fade`]).

use model_core::extension::thermal_fade::ThermalFade as Law;

use super::coordinates::{HEAT_TIMES_S, held, saturating};
use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct ThermalFade;

/// Bends of the law over heat, in shares of the largest.
const BENDS: [f64; 3] = [0.05, 0.2, 1.0];

impl Effect for ThermalFade {
    fn about(&self) -> About {
        About {
            id: "thermal_fade",
            meaning: "friction falls as sliding heats the surface, and recovers as it cools",
            experiment: "slide at 120 rpm under 88 N for 10 s, rest for 2, 10 and 40 s in turn, and slide again",
        }
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
        vec![ContactTerm::factor(self.id(), "", columns, parameters), law(self.id(), view)]
    }
}

/// Slow node: its fade relative to the fast one's, its time over the fast one's. The fast one cools within the longest
/// log, s, the slow one, at least half as slow again, within one and a half of it: heat that does not is all the energy ever
/// dissipated, which no log tells from the distance that was slid.
fn values(p: &[f64], usual_w: f64, longest_s: f64) -> [f64; 6] {
    let within = |x: f64, low: f64, high: f64| x.exp().clamp(low, high);
    let (fade, time_s) = (within(p[0], 0.0, 1e3) / usual_w, within(p[1], 0.05, longest_s.max(0.1)));
    let slow_s = (time_s * within(p[3], 1.5, 1e3)).min(1.5 * longest_s);
    [fade.min(10.0), time_s, (fade * within(p[2], 0.0, 1e3)).min(10.0), slow_s, within(p[4], 0.0, 100.0), within(p[5], 0.2, 5.0)]
}

fn law(id: &'static str, view: &ContactView<'_>) -> ContactTerm {
    let power: Vec<(f64, Vec<f64>)> =
        view.logs.iter().zip(view.coordinates).map(|(log, c)| (log.grid.step_s, c.power_w.clone())).collect();
    let longest_s = view.scales.time_s;
    let usual_w = view.scales.heat_j[0] / HEAT_TIMES_S[0];
    let parameters = vec![
        // Fade in a second of the largest power; the slow node fades a tenth as much and cools ten times slower.
        Parameter::logarithm("fade", 0.1, 1.5),
        Parameter::logarithm("cooling_s", 3.0, 1.2),
        Parameter::logarithm("slow_share", 0.1, 1.5),
        Parameter::logarithm("slow_ratio", 10.0, 0.7),
        Parameter::logarithm("saturation", 0.7, 1.0),
        Parameter::logarithm("exponent", 1.0, 0.3),
    ];
    let starts = [1.0, 4.0, 16.0]
        .map(|t: f64| [0.02, 0.1].map(|f: f64| vec![f.ln(), t.ln(), 0.1f64.ln(), 10f64.ln(), 0.7f64.ln(), 0.0]))
        .concat();
    let act = move |p: &[f64], change: &mut super::Change| {
        let values = values(p, usual_w, longest_s);
        let Ok(law) = Law::new(&values) else { return };
        let of = |(step_s, power): &(f64, Vec<f64>)| -> Vec<f64> {
            let (fast, slow) = (held(power, *step_s, values[1]), held(power, *step_s, values[3]));
            fast.iter().zip(&slow).map(|(a, b)| law.factor(&[*a, *b]).ln()).collect()
        };
        change.add_log_factor(&[power.iter().map(of).collect()], &[1.0]);
    };
    ContactTerm::any(id, parameters, Starts::BestOf(starts, 2), act).as_law().exported(move |p, _| {
        Law::<f64>::NAMES.iter().map(ToString::to_string).zip(values(p, usual_w, longest_s)).collect()
    })
}
