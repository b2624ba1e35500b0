//! `disc_angle`: µ varies with the disc's angle, a few orders per revolution.

use model_core::extension::disc_angle::DiscAngle as Law;

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::{Column, Parameter};

/// The effect.
pub(super) struct DiscAngle;

/// Orders per revolution.
const ORDERS: usize = 8;

impl Effect for DiscAngle {
    fn about(&self) -> About {
        About {
            id: "disc_angle",
            meaning: "friction varies with the disc's angle",
            experiment: "turn steadily at 10 and at 30 rpm for ten revolutions each under one load, from one switch-on of the encoder",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let wave = |order: usize, sine: bool, only: Option<usize>| -> Column {
            let of = |(at, log): (usize, &super::ContactLog)| -> Vec<f64> {
                if only.is_some_and(|only| !view.training || only != at) {
                    return vec![0.0; log.len()];
                }
                let phase = |a: &f64| order as f64 * a;
                log.angle_rad.iter().map(|a| if sine { phase(a).sin() } else { phase(a).cos() }).collect()
            };
            view.logs.iter().enumerate().map(of).collect()
        };
        // Over less than a period a wave is not to be told from a constant or a trend.
        let first = (std::f64::consts::TAU / view.scales.turned_rad).ceil().max(1.0);
        if first > ORDERS as f64 {
            return Vec::new();
        }
        let first = first as usize;
        // An incremental encoder has its zero where it was switched on: the pattern may be turned from log to log.
        let forms = [("", vec![None]), ("own_origin", (0..view.train_count).map(Some).collect())];
        forms
            .into_iter()
            .map(|(form, logs): (_, Vec<Option<usize>>)| {
                let (mut columns, mut parameters) = (Vec::new(), Vec::new());
                for only in logs {
                    let log = only.map_or(String::new(), |log| format!("_log{}", log + 1));
                    for order in first..=ORDERS {
                        for (name, sine) in [("cos", false), ("sin", true)] {
                            columns.push(wave(order, sine, only));
                            parameters.push(Parameter::amplitude(format!("{name}{order}{log}"), 1.0 / order as f64));
                        }
                    }
                }
                let export = move |p: &[f64]| -> Vec<(String, f64)> {
                    let mut out = vec![("origin_rad".to_string(), 0.0)];
                    for order in 1..=Law::<f64>::NAMES.len() / 2 {
                        for (i, name) in ["cos", "sin"].into_iter().enumerate() {
                            let value = if (first..=ORDERS).contains(&order) { p[2 * (order - first) + i] } else { 0.0 };
                            out.push((format!("{name}{order}"), value.clamp(-1.0, 1.0)));
                        }
                    }
                    out
                };
                ContactTerm::factor(self.id(), form, columns, parameters).exported(move |p, _| export(p))
            })
            .collect()
    }
}
