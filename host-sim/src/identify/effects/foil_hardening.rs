//! `foil_hardening`: the spring force grows faster than linearly.

use super::{Effect, PressView};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub struct FoilHardening;

impl Effect for FoilHardening {
    fn id(&self) -> &'static str {
        "foil_hardening"
    }

    fn press(&self, view: &PressView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let power = |n: i32| {
            let of = |log: &super::PressLog| log.filtered_n.iter().map(|x| (x.max(0.0) / s.load_n).powi(n)).collect::<Vec<f64>>();
            view.logs.iter().flat_map(of).collect()
        };
        let parameters = ["square_nm", "cube_nm"].map(|name| Parameter::amplitude(name, s.torque_nm)).to_vec();
        vec![Alternative::columns(self.id(), parameters, vec![power(2), power(3)])]
    }
}
