//! `bridge_drift`: zero or gain of a bridge drifts with time.

use model_core::extension::bridge_drift::BridgeDrift as Law;

use super::coordinates::saturating;
use super::{About, ContactView, DriveView, Effect, NormalLoadView};
use crate::identify::balance::Alternative;
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Column, Parameter};

/// The effect.
pub(super) struct BridgeDrift;

/// Bends of the drift over time, in shares of the log: warming up, and steady.
const BENDS: [f64; 3] = [0.1, 0.3, 10.0];

/// The core's drift, which has one settling time: least squares on the sum of the columns over the log.
fn export(p: &[f64], bridge: &str, time_s: f64, zero: f64) -> Vec<(String, f64)> {
    const POINTS: usize = 100;
    let at = |sizes: &[f64], t: f64| -> f64 {
        BENDS.iter().zip(sizes).map(|(b, p)| p * (1.0 - (-t / b).exp()) / (1.0 - (-1.0 / b).exp())).sum()
    };
    let (zeros, gains) = p.split_at(BENDS.len());
    let mut best = (f64::INFINITY, 0.0, 0.0, 0.0);
    for i in 0..40 {
        // From steady to settled in a fiftieth of the log.
        let rate = if i == 0 { 0.0 } else { 0.2 * 1.15f64.powi(i) };
        let shape = |t: f64| if rate == 0.0 { t } else { (1.0 - (-rate * t).exp()) / rate };
        let (mut zz, mut z, mut g) = (1e-12, 0.0, 0.0);
        let times = || (1..=POINTS).map(|i| i as f64 / POINTS as f64);
        for t in times() {
            (zz, z, g) = (zz + shape(t).powi(2), z + shape(t) * at(zeros, t), g + shape(t) * at(gains, t));
        }
        let (z, g) = (z / zz, g / zz);
        let off: f64 = times()
            .map(|t| (at(zeros, t) - z * shape(t)).powi(2) + (at(gains, t) - g * shape(t)).powi(2))
            .sum();
        if off < best.0 {
            best = (off, rate, z, g);
        }
    }
    let (_, rate, z, g) = best;
    // A factor of friction of the normal channel's drift: a load that is shown too small makes friction look larger.
    let sign = if bridge == "normal" { -1.0 } else { 1.0 };
    let (zero_rate, gain_rate) = (sign * z * zero / time_s, sign * g / time_s);
    let value = |name: &str| match (name, bridge) {
        ("friction_zero_nm_per_s", "friction") | ("normal_zero_n_per_s", "normal") => zero_rate,
        ("friction_gain_per_s", "friction") | ("normal_gain_per_s", "normal") => gain_rate,
        ("settling_per_s", _) => rate / time_s,
        _ => 0.0,
    };
    Law::<f64>::NAMES.iter().map(|name| ((*name).to_string(), value(name))).collect()
}

impl Effect for BridgeDrift {
    fn about(&self) -> About {
        About {
            id: "bridge_drift",
            meaning: "zero or gain of a bridge drifts with time",
            experiment: "log both bridges unloaded and with a known weight for ten minutes after switching on",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let s = view.scales;
        let (s_time, s_torque, s_load) = (s.time_s, s.torque_nm, s.load_n);
        let over_time = |bend: f64, of: &dyn Fn(usize, usize) -> f64| -> Column {
            let column = |(at, c): (usize, &super::Coordinates)| {
                saturating(&c.time, 1.0, bend).iter().enumerate().map(|(i, x)| x * of(at, i)).collect()
            };
            view.coordinates.iter().enumerate().map(column).collect()
        };
        let zero = |_: usize, _: usize| s.torque_nm;
        let gain = |_: usize, _: usize| 1.0;
        let friction = [&zero as &dyn Fn(usize, usize) -> f64, &gain].map(|of| BENDS.map(|b| over_time(b, of)).to_vec());
        // An error of the load is a factor of friction the other way.
        let load_zero = |at: usize, i: usize| s.load_n / view.logs[at].load_n[i].max(0.06 * s.load_n);
        let normal: Vec<Column> = BENDS
            .iter()
            .map(|b| over_time(*b, &load_zero))
            .chain(BENDS.iter().map(|b| over_time(*b, &gain)))
            .collect();
        let named = |bridge: &str| -> Vec<Parameter> {
            let kinds = ["zero", "gain"].into_iter();
            kinds
                .flat_map(|kind| BENDS.map(|b| Parameter::amplitude(format!("{bridge}_{kind}_{b}"), 1.0)))
                .collect()
        };
        vec![
            ContactTerm::amplifier(self.id(), "friction", friction, named("friction"))
                .exported(move |p, _| export(p, "friction", s_time, s_torque)),
            ContactTerm::factor(self.id(), "normal", normal, named("normal"))
                .exported(move |p, _| export(p, "normal", s_time, s_load)),
        ]
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        if s.load_n <= 0.0 {
            return Vec::new();
        }
        let over_time = |bend: f64, with_force: bool| {
            let of = |log: &super::DriveLog| {
                let time: Vec<f64> = log.grid.time_s.iter().map(|t| t / s.time_s).collect();
                let friction = log.friction.clone().unwrap_or_else(|| vec![0.0; log.len()]);
                let size = |i: usize| if with_force { friction[i] / s.effort } else { 1.0 };
                let drift: Vec<f64> =
                    saturating(&time, 1.0, bend).iter().enumerate().map(|(i, d)| d * size(i)).collect();
                log.filtered(&drift)
            };
            view.logs.iter().flat_map(of).collect::<Vec<f64>>()
        };
        let columns = [false, true].into_iter().flat_map(|force| BENDS.map(|b| over_time(b, force))).collect();
        let parameters = ["zero_nm", "gain_nm"]
            .into_iter()
            .flat_map(|kind| BENDS.map(|b| Parameter::amplitude(format!("friction_{kind}_{b}"), s.effort)))
            .collect();
        vec![Alternative::columns(self.id(), parameters, columns)]
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let over_time = |bend: f64, with_load: bool| {
            let of = |log: &super::NormalLoadLog| {
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
