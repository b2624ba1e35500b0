//! `bridge_crosstalk`: the friction bridge picks up normal force, whatever the direction.

use super::{About, ContactView, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::contact::change::{Bridge, ContactTerm};
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BridgeCrosstalk;

impl Effect for BridgeCrosstalk {
    fn about(&self) -> About {
        About {
            id: "bridge_crosstalk",
            meaning: "the friction bridge picks up normal force",
            experiment: "press from 10 to 160 N at rest with the disc free to turn",
        }
    }

    fn is_like_a_bridges_error(&self) -> bool {
        true
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let (load, torque) = (view.scales.load_n, view.scales.torque_nm);
        let power = |n: i32| {
            let of = |log: &super::ContactLog| log.load_n.iter().map(|x| torque * (x / load).powi(n)).collect();
            view.logs.iter().map(of).collect()
        };
        let columns = [1, 2].map(power).to_vec();
        let parameters = vec![Parameter::amplitude("gain", 1.0), Parameter::amplitude("bend", 0.5)];
        let export = move |p: &[f64]| {
            let names = ["gain_nm_per_n", "bend_nm_per_n2"].map(String::from);
            names.into_iter().zip([p[0] * torque / load, p[1] * torque / (load * load)]).collect()
        };
        vec![ContactTerm::amplifier(self.id(), "", [columns, Vec::new()], parameters)
            .as_error_of(Bridge::Friction)
            .exported(move |p, _| export(p))]
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        if s.load_n <= 0.0 {
            return Vec::new();
        }
        let power = |n: i32| {
            let of = |log: &super::DriveLog| {
                let load = log.load_n.clone().unwrap_or_else(|| vec![0.0; log.len()]);
                log.filtered(&load.iter().map(|x| -(x / s.load_n).powi(n)).collect::<Vec<_>>())
            };
            view.logs.iter().flat_map(of).collect()
        };
        let parameters = ["gain_nm", "bend_nm"].map(|name| Parameter::amplitude(name, s.effort)).to_vec();
        vec![Alternative::columns(self.id(), parameters, vec![power(1), power(2)])]
    }
}
