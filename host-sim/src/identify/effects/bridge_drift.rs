//! `bridge_drift`: zero or gain of a bridge drifts with time.

use super::coordinates::saturating;
use super::{ContactView, Effect, PressView};
use crate::identify::balance::Alternative;
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Column, Parameter};

/// The effect.
pub struct BridgeDrift;

/// Bends of the drift over time, in shares of the log: warming up, and steady.
const BENDS: [f64; 3] = [0.1, 0.3, 10.0];

impl Effect for BridgeDrift {
    fn id(&self) -> &'static str {
        "bridge_drift"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let s = view.scales;
        let over_time = |bend: f64, of: &dyn Fn(usize, usize) -> f64| -> Column {
            let column = |(at, c): (usize, &super::Coordinates)| {
                saturating(&c.time, 1.0, bend).iter().enumerate().map(|(i, x)| x * of(at, i)).collect()
            };
            view.coordinates.iter().enumerate().map(column).collect()
        };
        let zero = |_: usize, _: usize| s.torque_nm;
        let gain = |at: usize, i: usize| view.logs[at].smooth_nm[i];
        let friction: Vec<Column> =
            BENDS.iter().map(|b| over_time(*b, &zero)).chain(BENDS.iter().map(|b| over_time(*b, &gain))).collect();
        // An error of the load is a factor of friction the other way.
        let load_zero = |at: usize, i: usize| s.load_n / view.logs[at].load_n[i].max(0.06 * s.load_n);
        let load_gain = |_: usize, _: usize| 1.0;
        let normal: Vec<Column> = BENDS
            .iter()
            .map(|b| over_time(*b, &load_zero))
            .chain(BENDS.iter().map(|b| over_time(*b, &load_gain)))
            .collect();
        let named = |bridge: &str| -> Vec<Parameter> {
            let kinds = ["zero", "gain"].into_iter();
            kinds
                .flat_map(|kind| BENDS.map(|b| Parameter::amplitude(format!("{bridge}_{kind}_{b}"), 1.0)))
                .collect()
        };
        vec![
            ContactTerm::shown(self.id(), "friction", friction, named("friction")),
            ContactTerm::factor(self.id(), "normal", normal, named("normal")),
        ]
    }

    fn press(&self, view: &PressView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let over_time = |bend: f64, with_load: bool| {
            let of = |log: &super::PressLog| {
                let time: Vec<f64> = log.time_s.iter().map(|t| t / s.time_s).collect();
                let drift = saturating(&time, 1.0, bend);
                let load = |i: usize| if with_load { log.filtered_n[i] / s.load_n } else { 1.0 };
                drift.iter().enumerate().map(|(i, d)| -d * load(i)).collect::<Vec<f64>>()
            };
            view.logs.iter().flat_map(of).collect::<Vec<f64>>()
        };
        let columns = [false, true].into_iter().flat_map(|load| BENDS.map(|b| over_time(b, load))).collect();
        let parameters = ["zero_nm", "gain_nm"]
            .into_iter()
            .flat_map(|kind| BENDS.map(|b| Parameter::amplitude(format!("normal_{kind}_{b}"), s.torque_nm)))
            .collect();
        vec![Alternative::columns(self.id(), parameters, columns)]
    }
}
