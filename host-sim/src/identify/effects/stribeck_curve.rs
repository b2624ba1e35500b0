//! A bearing's friction in excess of Coulomb's near standstill: Σ a_k exp(−(v/v_k)²), a_k ≥ 0.
//!
//! Mixtures of Gaussians of all widths hold exp(−|v|) and exp(−|v|^½) (Bo and Pavelescu 1982), 1/(1 + v²) (Hess and Soom
//! 1990) and the Gaussian itself: every curve that falls, and no other. One law of them would leave the others' difference to
//! a second cause.

use super::{DriveLog, DriveView};
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// Widths, in shares of the widest: from standstill to all of it, a factor of two apart.
const SHARES: [f64; 9] = [0.0039, 0.0078, 0.0156, 0.0312, 0.0625, 0.125, 0.25, 0.5, 1.0];
/// The widest is the fastest speed, and in shares of the usual one where the logs turn one way alone: there a controller gives less torque the faster it turns, and what falls over
/// the usual speed is the controller's. No controller of one speed gives the same curve both ways.
const WIDEST_ONE_WAY: f64 = 0.5;
/// Share of the motion that goes the rarer way at least: less is the encoder's noise about a standstill.
const SEEN: f64 = 0.01;
/// What the names of a width and of its excess begin with.
const SPEED: &str = "stribeck_speed";
const EXCESS: &str = "static_excess";

/// Whether the logs turn both ways: what turns one way alone shows no difference of the two.
pub(super) fn turns_both_ways(view: &DriveView<'_>) -> bool {
    let turned = view.logs.iter().flat_map(|log| direction(log, view.scales.speed));
    let (forward, backward) = turned.fold((0.0, 0.0), |(f, b), d| (f + d.max(0.0), b - d.min(0.0)));
    f64::min(forward, backward) >= SEEN * (forward + backward)
}

/// Widths of a curve.
pub(super) struct Curve {
    speeds: Vec<f64>,
}

impl Curve {
    /// By the usual speed, or as found on other logs.
    pub(super) fn new(view: &DriveView<'_>) -> Self {
        let usual = || {
            let usual = view.scales.speed;
            if !turns_both_ways(view) {
                return SHARES.iter().filter(|s| **s <= WIDEST_ONE_WAY).map(|s| s * usual).collect();
            }
            let speeds = view.logs.iter().flat_map(|log| &log.speed);
            let fastest = speeds.fold(0.0, |most: f64, speed| most.max(speed.abs()));
            // Alone, nothing but the motor's torque tells a curve over all speeds from a delay of it.
            if !view.balance.rests {
                return SHARES[1..].iter().map(|share| share * usual).collect();
            }
            SHARES.iter().map(|share| share * fastest).collect()
        };
        let found = |fixed: &[(String, f64)]| {
            let one =
                |k: usize| fixed.iter().find(|(name, _)| *name == format!("{SPEED}_{k}")).map(|(_, v)| *v);
            (1..=SHARES.len()).map_while(one).collect()
        };
        Self { speeds: view.fixed.map_or_else(usual, found) }
    }

    /// Names and values of the widths.
    pub(super) fn constants(&self) -> Vec<(String, f64)> {
        (1..).zip(&self.speeds).map(|(k, speed)| (format!("{SPEED}_{k}"), *speed)).collect()
    }

    /// The excesses; `way` tells those of one direction.
    pub(super) fn parameters(&self, way: &str, large: f64) -> Vec<Parameter> {
        (1..=self.speeds.len()).map(|k| Parameter::positive(format!("{EXCESS}{way}_{k}"), large)).collect()
    }

    /// Columns of the balance; `acts` is what an excess does at a direction.
    pub(super) fn columns(&self, view: &DriveView<'_>, acts: fn(f64) -> f64) -> Vec<Vec<f64>> {
        let column = |speed: &f64| -> Vec<f64> {
            let of = |log: &DriveLog| {
                let moving = direction(log, view.scales.speed).into_iter().zip(&log.speed);
                let torque = moving.map(|(d, v)| acts(d) * (-(v / speed).powi(2)).exp());
                log.filtered(&torque.collect::<Vec<f64>>())
            };
            view.logs.iter().flat_map(of).collect()
        };
        self.speeds.iter().map(column).collect()
    }

    /// The excess over speed by a file's values; `None` where it has none.
    pub(super) fn of_file(way: &str, value: &dyn Fn(&str) -> Option<f64>) -> Option<Box<dyn Fn(f64) -> f64>> {
        let pair = |k: usize| Some((value(&format!("{EXCESS}{way}_{k}"))?, value(&format!("{SPEED}_{k}"))?));
        let parts: Vec<(f64, f64)> = (1..=SHARES.len()).map_while(pair).collect();
        if parts.is_empty() {
            return None;
        }
        Some(Box::new(move |v| parts.iter().map(|(a, speed)| a * (-(v / speed).powi(2)).exp()).sum()))
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::identify::law_form::LAW_FORM;
    use crate::identify::linear::non_negative;

    #[test]
    fn published_curves_are_sums_of_the_widths() {
        let laws: [fn(f64) -> f64; 4] =
            [|x| (-x).exp(), |x| (-x * x).exp(), |x| 1.0 / (1.0 + x * x), |x| (-x.sqrt()).exp()];
        let speeds: Vec<f64> = (1..200).map(|i| 0.01 * f64::from(i)).collect();
        // Falling over a tenth of the usual speed to all of it; beside Coulomb's and viscous friction.
        for (law, at) in laws.iter().flat_map(|law| [0.1, 0.23, 0.5, 1.0].map(|at| (law, at))) {
            let base = |v: &f64| [1.0, -1.0, *v, -*v];
            let widths = |v: &f64| SHARES.map(|share| (-(v / share).powi(2)).exp());
            let rows: Vec<f64> = speeds.iter().flat_map(|v| base(v).into_iter().chain(widths(v))).collect();
            let a = DMatrix::from_row_slice(speeds.len(), 4 + SHARES.len(), &rows);
            let b = DVector::from_iterator(speeds.len(), speeds.iter().map(|v| law(v / at)));
            let x = non_negative(&(a.transpose() * &a), &(a.transpose() * &b));
            let left = (&a * x - &b).norm() / b.norm();
            // One law of them leaves so much of another.
            assert!(left < LAW_FORM, "{left} at {at}");
        }
    }
}
