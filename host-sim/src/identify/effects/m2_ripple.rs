//! `m2_ripple`: M2's torque ripples with its angle (cogging orders).
//!
//! Coordinate: angle, or position of a stage. Columns: the orders at which what the base leaves has lines; one phase for all
//! logs, or one for each, since an incremental encoder has its zero where it was switched on. Cogging, and an offset of a current,
//! ripple alike at every torque; what the windings' field or the gain of a current's sensor does is in proportion to it (Jahns and
//! Soong 1996).

use super::waves::{self, Waves};
use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::DriveLog;
use crate::identify::filters::gaussian;

/// The effect.
pub(super) struct M2Ripple;

/// Highest order per revolution: cogging of the common motors ends at a few hundred.
const HIGHEST_ORDER: usize = 240;
/// Periods over a stage's travel.
const MOST_PERIODS: usize = 120;
/// Most orders at once.
const MOST_ORDERS: usize = 8;
/// A line's power over the median of all: of white noise the largest of 240 is 8 times it, coloured noise has more.
const OVER_MEDIAN: f64 = 25.0;

impl Effect for M2Ripple {
    fn about(&self) -> About {
        About {
            id: "m2_ripple",
            meaning: "M2's torque ripples with its angle",
            experiment: "turn the lifted disc steadily at 5 and at 30 rpm for ten revolutions",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let positions: Vec<&[f64]> = view.logs.iter().map(|log| log.position.as_slice()).collect();
        let relative = |log: &DriveLog| log.effort.iter().map(|effort| effort / view.scales.effort).collect();
        // Over a stage's travel a force that drags more in some places than in others is as much in proportion to the effort.
        let efforts: Vec<Vec<f64>> =
            if view.rotary { view.logs.iter().map(relative).collect() } else { Vec::new() };
        let make = Waves {
            effect: self.id(),
            positions: &positions,
            efforts: &efforts,
            filtered: &|at, values| view.logs[at].filtered(values),
            size: view.scales.own,
            rotary: view.rotary,
        };
        if let Some(fixed) = view.fixed {
            return make.alternatives(&waves::fixed(fixed), 1);
        }
        let picked = |values: &[f64]| waves::picked(view.balance, values);
        let (x, r) = (picked(&positions.concat()), picked(view.company.residual));
        let effort = if efforts.is_empty() { Vec::new() } else { picked(&efforts.concat()) };
        let candidates: Vec<f64> = if view.rotary {
            // At the usual speed a wave turns by less than half of its period from row to row.
            let fastest = view.scales.speed * view.balance.row_step_s;
            (1..=HIGHEST_ORDER).map(|k| k as f64).filter(|k| k * fastest < std::f64::consts::PI).collect()
        } else {
            waves::of_travel(x.iter().map(|x| waves::travel(x.iter().copied())).fold(0.0, f64::max), MOST_PERIODS)
        };
        // Steady ones alone, and all together where that finds others: a compensated motor's torque ripples itself.
        let mut all: Vec<Alternative> = Vec::new();
        for (effort, kinds) in [(&[][..], 1), (&effort, 2)] {
            let found = waves::lines(&x, &r, effort, &candidates, MOST_ORDERS, OVER_MEDIAN);
            for count in [1, 2, 4, MOST_ORDERS].into_iter().filter(|count| *count < 2 * found.len().max(1)) {
                let found = &found[..count.min(found.len())];
                if kinds == 1 || found.iter().any(|wave| wave.of_effort) {
                    all.extend(make.alternatives(found, kinds * candidates.len()));
                }
            }
        }
        // A compensated motor has the ripple in its torque and not in its motion: both are told.
        // Through a filter that lets ripples pass, at all samples: a motor that cogs stands still at times.
        let speed: Vec<Vec<f64>> = view
            .logs
            .iter()
            .map(|log| gaussian(&log.position, 1.0, 1).iter().map(|d| d / log.grid.step_s).collect())
            .collect();
        for alternative in &mut all {
            let orders = waves::fixed(&alternative.constants);
            let sizes = orders.iter().enumerate().map(|(i, k)| (format!("speed_amplitude_{}", i + 1), waves::amplitude(&positions, &speed, k.number)));
            alternative.constants.extend(sizes);
            if orders.iter().any(|wave| wave.of_effort) {
                // At which a wave in proportion to the torque has its amplitude.
                alternative.constants.push(("usual_torque_nm".into(), view.scales.effort));
            }
        }
        all
    }
}
