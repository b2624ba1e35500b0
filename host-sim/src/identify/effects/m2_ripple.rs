//! `m2_ripple`: M2's torque ripples with its angle (cogging orders).

use super::waves;
use super::{DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub struct M2Ripple;

/// Highest order per revolution: cogging of the common motors ends at a few hundred.
const HIGHEST_ORDER: usize = 240;
/// Most orders at once.
const MOST_ORDERS: usize = 8;
/// A line's power over the median of all: of white noise the largest of 240 is 8 times it, coloured noise has more.
const OVER_MEDIAN: f64 = 25.0;

impl Effect for M2Ripple {
    fn id(&self) -> &'static str {
        "m2_ripple"
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let rows = view.balance.rows_of_logs();
        let positions: Vec<f64> = view.logs.iter().flat_map(|log| log.position.iter().copied()).collect();
        let picked = |values: &[f64]| -> Vec<Vec<f64>> {
            rows.iter().map(|rows| rows.iter().map(|i| values[*i]).collect()).collect()
        };
        let (x, r) = (picked(&positions), picked(view.residual));
        let logs: Vec<(&[f64], &[f64])> = x.iter().zip(&r).map(|(x, r)| (x.as_slice(), r.as_slice())).collect();
        let candidates: Vec<f64> = if view.rotary {
            // A wave must not turn by more than a third of its period from row to row.
            let fastest = view.scales.speed * view.balance.row_step_s;
            (1..=HIGHEST_ORDER).map(|k| k as f64).filter(|k| k * fastest < 2.0).collect()
        } else {
            waves::of_travel(waves::travel(positions.iter().copied()), 60)
        };
        let found = waves::lines(&logs, &candidates, MOST_ORDERS, OVER_MEDIAN);
        let mut all = Vec::new();
        for count in [1, 2, 4, MOST_ORDERS].into_iter().filter(|c| *c <= found.len().next_power_of_two()) {
            let orders = &found[..count.min(found.len())];
            if !orders.is_empty() {
                all.push(waves_of(view, orders, candidates.len()));
            }
        }
        all
    }
}

/// Waves of these orders, for each log its own phase: an incremental encoder has its zero where it was switched on.
fn waves_of(view: &DriveView<'_>, orders: &[f64], candidates: usize) -> Alternative {
    let (mut columns, mut parameters) = (Vec::new(), Vec::new());
    for at in 0..view.logs.len() {
        for (i, order) in orders.iter().enumerate() {
            for (name, sine) in [("cos", false), ("sin", true)] {
                let column = view.logs.iter().enumerate().flat_map(|(other, log)| {
                    if other != at {
                        return vec![0.0; log.len()];
                    }
                    let wave = |x: &f64| if sine { (order * x).sin() } else { (order * x).cos() };
                    log.filtered(&log.position.iter().map(wave).collect::<Vec<_>>())
                });
                columns.push(column.collect());
                parameters.push(Parameter::amplitude(format!("{name}_{}_log{}", i + 1, at + 1), view.scales.own));
            }
        }
    }
    let constants = orders
        .iter()
        .enumerate()
        .map(|(i, k)| {
            if view.rotary { (format!("order_{}", i + 1), *k) } else { (format!("wavelength_{}_m", i + 1), std::f64::consts::TAU / k) }
        })
        .collect();
    Alternative {
        form: format!("{} orders", orders.len()),
        constants,
        // The orders were chosen among so many.
        log_prior: -(orders.len() as f64) * (candidates as f64).ln(),
        ..Alternative::columns("m2_ripple", parameters, columns)
    }
}
