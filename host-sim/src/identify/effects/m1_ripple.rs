//! `m1_ripple`: M1's torque ripples with its position or with the mechanism's.
//!
//! Coordinates: M1's angle; the mechanism's position, which the normal force shows. Where the springs are the only compliance the
//! two are one, and a law over them is a law of the spring force: then nothing parts them. Columns as those of M2's ripple.

use super::joint_waves::{Candidates, Joint};
use super::waves::{self, Waves};
use super::{About, Effect, NormalLoadView, fixed_orders};
use crate::identify::balance::Alternative;

/// The effect.
pub(super) struct M1Ripple;

/// Fewer periods over the travel are a spring's law as well as a ripple.
const LEAST_PERIODS: f64 = 1.7;
/// Wave numbers are a half of this part of a half period off at most: a tenth of a radian at the travel's ends.
const PARTS: usize = 8;
/// Most periods over the travel, and most orders at once.
const MOST_PERIODS: usize = 60;
const MOST_ORDERS: usize = 3;

impl Effect for M1Ripple {
    fn about(&self) -> About {
        About {
            id: "m1_ripple",
            meaning: "M1's torque ripples with its position",
            experiment: "ramp M1's torque slowly over its whole range, with the elements lifted and pressed",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let angle: Option<Vec<&[f64]>> = view.logs.iter().map(|log| log.angle_rad.as_deref()).collect();
        let force: Vec<&[f64]> = view.logs.iter().map(|log| log.filtered_n.as_slice()).collect();
        let mut all = Vec::new();
        for (over, positions) in [("angle", angle), ("force", Some(force))] {
            let Some(positions) = positions else { continue };
            let make = Waves {
                effect: self.id(),
                positions: &positions,
                filtered: &|at, values| view.logs[at].filtered(values),
                size: 0.5 * view.scales.torque_nm,
                rotary: over == "angle",
            };
            if let Some(fixed) = view.fixed {
                let wanted = fixed.iter().any(|(name, _)| name.starts_with("wavelength")) == (over == "force");
                if wanted {
                    all.extend(make.alternatives(&fixed_orders(fixed), 1));
                }
                continue;
            }
            let position = positions.concat();
            let travel = positions.iter().map(|x| waves::travel(x.iter().copied())).fold(0.0, f64::max);
            let mut wave_numbers = waves::of_travel(travel, MOST_PERIODS);
            wave_numbers.retain(|k| k * travel > LEAST_PERIODS * std::f64::consts::TAU);
            let candidates = Candidates { wave_numbers, parts: PARTS };
            // The position dwells at the steps of the force, where a spectrum shows all orders alike. Orders that are the clearer
            // with a phase for each log may have one phase all the same.
            for (apart, forms) in [(false, &[false][..]), (true, &[false, true])] {
                let orders = Joint::new(view.balance, &position, view.company, apart)
                    .orders(&candidates, MOST_ORDERS);
                for own_phase in forms {
                    let joint = Joint::new(view.balance, &position, view.company, *own_phase);
                    for count in 1..=orders.len() {
                        let orders = joint.sharpened(&orders[..count], &candidates);
                        all.push(make.alternative(&orders, candidates.count(), *own_phase));
                    }
                }
            }
        }
        all
    }
}
