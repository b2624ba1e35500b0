//! `bell_curve`: friction rises with speed below v_m, then falls (Fig. 27).
//!
//! Coordinate: ln of the slip speed. Columns: eight bumps. Law: the core's hump ([`model_core::extension::bell_curve`]).

use model_core::extension::bell_curve::BellCurve as Law;

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::law::speeds;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct BellCurve;

/// Bumps over the logarithm of slip speed.
const BUMPS: usize = 8;
/// Between these shares of the usual speed.
const FROM: f64 = 0.006;
const TO: f64 = 3.0;

fn add(change: &mut super::Change, column: &[f64], size: f64) {
    let sum = change.log_curve.get_or_insert_with(|| vec![0.0; column.len()]);
    sum.iter_mut().zip(column).for_each(|(s, x)| *s += size * x);
}

impl Effect for BellCurve {
    fn about(&self) -> About {
        About {
            id: "bell_curve",
            meaning: "friction rises with speed before it falls",
            experiment: "slide steadily at 12 speeds from 1 mm/s to 1 m/s under one load",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let width = (TO / FROM).ln() / (BUMPS - 1) as f64;
        let usual = view.scales.speed_m_s;
        let centres: Vec<f64> = (0..BUMPS).map(|i| (FROM * usual).ln() + i as f64 * width).collect();
        let parameters = centres.iter().map(|c| Parameter::amplitude(format!("at_{:.4}_m_s", c.exp()), 1.0)).collect();
        let bumps: Vec<Vec<f64>> = centres
            .iter()
            .map(|c| speeds().map(|w| (-0.5 * (((w + 1e-9).ln() - c) / width).powi(2)).exp()).collect())
            .collect();
        let columns = ContactTerm::any(self.id(), parameters, Starts::At(vec![vec![0.0; BUMPS]]), move |p, change| {
            p.iter().zip(&bumps).for_each(|(size, bump)| add(change, bump, *size));
        });

        let values = move |p: &[f64]| {
            let wide = |x: f64| x.exp().clamp(0.1, 20.0);
            [p[0].clamp(0.0, 20.0), (p[1].exp() * usual).clamp(1e-6, 100.0), wide(p[2]), wide(p[3]), 10.0]
        };
        let law = vec![
            Parameter::positive("height", 1.0),
            Parameter::logarithm("peak", 0.15, 1.0),
            Parameter::logarithm("rise_width", 1.5, 0.5),
            Parameter::logarithm("fall_width", 1.5, 0.5),
        ];
        let starts = [0.03, 0.1, 0.3, 0.9].map(|v: f64| vec![0.1, v.ln(), 1.5f64.ln(), 1.5f64.ln()]).to_vec();
        let act = move |p: &[f64], change: &mut super::Change| {
            let Ok(law) = Law::new(&values(p)) else { return };
            let column: Vec<f64> = speeds().map(|w| law.factor(w).ln()).collect();
            add(change, &column, 1.0);
        };
        let law = ContactTerm::any(self.id(), law, Starts::BestOf(starts, 2), act).as_law();
        let names = Law::<f64>::NAMES;
        vec![columns, law.exported(move |p, _| names.iter().map(ToString::to_string).zip(values(p)).collect())]
    }
}
