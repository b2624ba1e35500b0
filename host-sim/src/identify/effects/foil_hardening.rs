//! `foil_hardening`: the spring force grows faster than linearly.
//!
//! Whether a foil stretches or a second leaf takes part, the stiffness only grows: T1 = N/gain + Σ a_k h(N − N_k), a_k ≥ 0,
//! h a rounded ramp.

use super::{About, Effect, NormalLoadView};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct FoilHardening;

/// Loads at which the stiffness may grow, evenly between none and the largest.
const BENDS: usize = 12;
/// Name of their distance.
const APART: &str = "bends_apart_n";
/// How far a bend is rounded, in distances of the bends: between two of them the sum is then smooth.
const ROUNDED: f64 = 0.5;

impl Effect for FoilHardening {
    fn about(&self) -> About {
        About {
            id: "foil_hardening",
            meaning: "the springs' force grows faster than linearly",
            experiment: "ramp M1's torque slowly over its whole range, with the elements lifted and pressed: a ripple of M1 with less \
                         than two periods over the travel looks the same, but shows lifted too",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let known = view.fixed.and_then(|fixed| fixed.iter().find(|(name, _)| name == APART));
        let largest_n = || view.logs.iter().flat_map(|log| &log.filtered_n).copied().fold(view.scales.load_n, f64::max);
        let apart_n = known.map_or_else(|| largest_n() / BENDS as f64, |(_, apart_n)| *apart_n);
        let ramp = |bend: usize| -> Vec<f64> {
            let at_n = bend as f64 * apart_n;
            let of = |n: &f64| 0.5 * ((n - at_n) + (n - at_n).hypot(ROUNDED * apart_n));
            view.logs.iter().flat_map(|log| log.filtered_n.iter().map(of)).collect()
        };
        let all_of_it = view.scales.torque_nm / view.scales.load_n;
        let name = |bend| format!("stiffer_{}_nm_per_n", bend + 1);
        let parameters = (0..BENDS).map(|bend| Parameter::positive(name(bend), all_of_it)).collect();
        vec![Alternative {
            constants: vec![(APART.to_string(), apart_n)],
            ..Alternative::columns(self.id(), parameters, (0..BENDS).map(ramp).collect())
        }]
    }
}
