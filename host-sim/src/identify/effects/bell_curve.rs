//! `bell_curve`: friction rises with speed below v_m, then falls (Fig. 27).

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::law::speeds;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub struct BellCurve;

/// Bumps over the logarithm of slip speed.
const BUMPS: usize = 8;
/// Between these shares of the usual speed.
const FROM: f64 = 0.006;
const TO: f64 = 3.0;

impl Effect for BellCurve {
    fn id(&self) -> &'static str {
        "bell_curve"
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
        vec![ContactTerm::any(self.id(), parameters, Starts::At(vec![vec![0.0; BUMPS]]), move |p, change| {
            let sum = change.log_curve.get_or_insert_with(|| vec![0.0; bumps[0].len()]);
            for (size, bump) in p.iter().zip(&bumps) {
                sum.iter_mut().zip(bump).for_each(|(s, x)| *s += size * x);
            }
        })]
    }
}
