//! `m1_ripple`: M1's torque ripples with its position or with the mechanism's.

use super::waves;
use super::{Effect, PressView};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub struct M1Ripple;

/// Most periods over M1's travel, and most orders at once.
const MOST_PERIODS: usize = 60;
const MOST_ORDERS: usize = 3;
/// A line's power over the median of all: the press's residuals are coloured.
const OVER_MEDIAN: f64 = 25.0;

impl Effect for M1Ripple {
    fn id(&self) -> &'static str {
        "m1_ripple"
    }

    fn press(&self, view: &PressView<'_>) -> Vec<Alternative> {
        let Some(angles) = view.logs.iter().map(|log| log.angle_rad.clone()).collect::<Option<Vec<_>>>() else {
            return Vec::new();
        };
        let rows = view.balance.rows_of_logs();
        let all: Vec<f64> = angles.iter().flatten().copied().collect();
        let picked = |values: &[f64]| -> Vec<Vec<f64>> {
            rows.iter().map(|rows| rows.iter().map(|i| values[*i]).collect()).collect()
        };
        let (x, r) = (picked(&all), picked(view.residual));
        let logs: Vec<(&[f64], &[f64])> = x.iter().zip(&r).map(|(x, r)| (x.as_slice(), r.as_slice())).collect();
        let travel = x.iter().map(|x| waves::travel(x.iter().copied())).fold(0.0, f64::max);
        let candidates = waves::of_travel(travel, MOST_PERIODS);
        let orders = waves::lines(&logs, &candidates, MOST_ORDERS, OVER_MEDIAN);
        (1..=orders.len())
            .map(|count| {
                let (mut columns, mut parameters) = (Vec::new(), Vec::new());
                for (i, k) in orders[..count].iter().enumerate() {
                    for at in 0..angles.len() {
                        for sine in [false, true] {
                            let column = angles.iter().enumerate().flat_map(|(other, angle)| {
                                if other != at {
                                    return vec![0.0; angle.len()];
                                }
                                let wave = |x: &f64| if sine { (k * x).sin() } else { (k * x).cos() };
                                view.logs[at].filtered(&angle.iter().map(wave).collect::<Vec<_>>())
                            });
                            columns.push(column.collect());
                            let name = format!("{}_{}_nm_log{}", if sine { "sin" } else { "cos" }, i + 1, at + 1);
                            parameters.push(Parameter::amplitude(name, 0.5 * view.scales.torque_nm));
                        }
                    }
                }
                Alternative {
                    form: format!("{count} orders"),
                    constants: orders[..count].iter().enumerate().map(|(i, k)| (format!("order_{}", i + 1), *k)).collect(),
                    log_prior: -(count as f64) * (candidates.len() as f64).ln(),
                    ..Alternative::columns("m1_ripple", parameters, columns)
                }
            })
            .collect()
    }
}
