//! `direction_asymmetry`: µ differs between the two directions of sliding.
//!
//! Coordinate: direction, with powers of ln speed. Law: the core's ([`model_core::extension::direction_asymmetry`]).

use model_core::extension::direction_asymmetry::DirectionAsymmetry as Law;

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::log::ContactLog;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct DirectionAsymmetry;

/// Share of the way that is slid in the lesser direction where the logs tell the two apart: in logs of one direction, its columns
/// are curves over the speed.
const BOTH_WAYS: f64 = 0.02;

/// Whether the training logs slide in both directions.
fn slides_both_ways(view: &ContactView<'_>) -> bool {
    let slid_m = |sign: f64| -> f64 {
        let of = |log: &ContactLog| log.root_speed_m_s.iter().map(|v| (sign * v).max(0.0) * log.grid.step_s).sum::<f64>();
        view.logs.iter().map(of).sum()
    };
    let ways = [-1.0, 1.0].map(slid_m);
    ways[0].min(ways[1]) > BOTH_WAYS * (ways[0] + ways[1])
}

impl Effect for DirectionAsymmetry {
    fn about(&self) -> About {
        About {
            id: "direction_asymmetry",
            meaning: "friction differs between the two directions of sliding",
            experiment: "slide to and fro at 10, 30 and 120 rpm under one load",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        if view.training && !slides_both_ways(view) {
            return Vec::new();
        }
        let by_speed = |n: i32| {
            let of = |c: &super::Coordinates| c.direction.iter().zip(&c.log_speed).map(|(d, v)| d * v.powi(n)).collect();
            view.coordinates.iter().map(of).collect()
        };
        let columns = [0, 1, 2].map(by_speed).to_vec();
        let parameters = [("asymmetry", 1.0), ("with_speed", 0.7), ("with_speed_squared", 0.5)];
        let parameters = parameters.map(|(name, sd)| Parameter::amplitude(name, sd)).to_vec();

        let usual = view.scales.speed_m_s;
        let values = move |p: &[f64]| {
            let share = |x: f64| x.clamp(-0.95, 0.95);
            [share(p[0]), share(p[1]), (p[2].exp() * usual).clamp(1e-6, 1e3), p[3].exp().clamp(0.1, 4.0)]
        };
        let motion: Vec<Vec<(f64, f64)>> = view
            .logs
            .iter()
            .zip(view.coordinates)
            .map(|(log, c)| c.direction.iter().copied().zip(log.root_speed_m_s.iter().copied()).collect())
            .collect();
        let law = vec![
            Parameter::amplitude("asymmetry_slow", 0.5),
            Parameter::amplitude("asymmetry_fast", 0.5),
            Parameter::logarithm("between", 0.3, 1.0),
            Parameter::logarithm("sharpness", 1.0, 0.5),
        ];
        let starts = [(0.05, 0.05), (-0.05, -0.05), (0.05, -0.05), (-0.05, 0.05)];
        let starts = starts.map(|(slow, fast)| vec![slow, fast, 0.3f64.ln(), 0.0]).to_vec();
        let act = move |p: &[f64], change: &mut super::Change| {
            let Ok(law) = Law::new(&values(p)) else { return };
            // The core takes the force's sign; between the directions the measured direction goes through zero.
            let of = |(direction, speed): &(f64, f64)| (1.0 + (law.factor(1.0, *speed) - 1.0) * direction).ln();
            let column = motion.iter().map(|log| log.iter().map(of).collect()).collect();
            change.add_log_factor(&[column], &[1.0]);
        };
        let law = ContactTerm::any(self.id(), law, Starts::BestOf(starts, 2), act).as_law();
        let names = Law::<f64>::NAMES;
        vec![
            ContactTerm::factor(self.id(), "", columns, parameters),
            law.exported(move |p, _| names.iter().map(ToString::to_string).zip(values(p)).collect()),
        ]
    }
}
