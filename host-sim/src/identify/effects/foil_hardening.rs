//! `foil_hardening`: the spring force grows faster than linearly.

use super::{About, Effect, NormalLoadView};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct FoilHardening;

impl Effect for FoilHardening {
    fn about(&self) -> About {
        About {
            id: "foil_hardening",
            meaning: "the springs' force grows faster than linearly",
            experiment: "ramp M1's torque slowly over its whole range",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let power = |n: i32| {
            let of = |log: &super::NormalLoadLog| log.filtered_n.iter().map(|x| (x.max(0.0) / s.load_n).powi(n)).collect::<Vec<f64>>();
            view.logs.iter().flat_map(of).collect()
        };
        // Up to a bend as sharp as that of a second leaf.
        let names = ["square_nm", "cube_nm", "fourth_power_nm", "fifth_power_nm"];
        let parameters = names.map(|name| Parameter::amplitude(name, s.torque_nm)).to_vec();
        vec![Alternative::columns(self.id(), parameters, (2..6).map(power).collect())]
    }
}
