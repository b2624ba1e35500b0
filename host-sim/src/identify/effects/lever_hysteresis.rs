//! `lever_hysteresis`: normal force lags M1 torque by a Coulomb band.

use super::{About, Effect, NormalLoadView};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct LeverHysteresis;

/// The two forms, by what their widths are relative to.
const FORCE: &str = "usual_force_n";
const TORQUE: &str = "usual_torque_nm";
/// Widths of the play, in shares of the usual force or torque.
const WIDTHS: [f64; 7] = [0.01, 0.02, 0.04, 0.08, 0.16, 0.32, 0.64];

/// A play operator: follows its input at a distance of at most `width`.
pub(in crate::identify) fn play(values: &[f64], width: f64) -> Vec<f64> {
    let mut state = values.first().copied().unwrap_or(0.0);
    values
        .iter()
        .map(|x| {
            state = state.clamp(x - width, x + width);
            state
        })
        .collect()
}

impl Effect for LeverHysteresis {
    fn about(&self) -> About {
        About {
            id: "lever_hysteresis",
            meaning: "the normal force lags M1's torque by a Coulomb band",
            experiment: "ramp M1's torque slowly up and down, in loops of three sizes",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        // The joints yield with the force that they carry, or with the torque before them: the force rings after a step,
        // the torque does not.
        let over = |form: &str, usual: f64, signal: &dyn Fn(&super::NormalLoadLog) -> Vec<f64>| {
            let column = |share: f64| -> Vec<f64> {
                let width = share * usual;
                let of = |log: &super::NormalLoadLog| {
                    let values = signal(log);
                    let follows = play(&values, width);
                    values.iter().zip(follows).map(|(x, q)| (x - q) / width).collect::<Vec<f64>>()
                };
                view.logs.iter().flat_map(of).collect()
            };
            let parameters = WIDTHS.map(|w| Parameter::positive(format!("band_{w}_nm"), 0.5 * s.torque_nm)).to_vec();
            Alternative {
                form: form.into(),
                // Which of the forms, as a constant: held-out logs take the one that was found.
                constants: vec![(form.into(), usual)],
                ..Alternative::columns(self.id(), parameters, WIDTHS.map(column).to_vec())
            }
        };
        let wanted = |form: &str| view.fixed.is_none_or(|fixed| fixed.iter().any(|(name, _)| name == form));
        let usual = |form: &str, now: f64| view.fixed.and_then(|f| f.iter().find(|(n, _)| n == form)).map_or(now, |f| f.1);
        let mut all = Vec::new();
        if wanted(FORCE) {
            all.push(over(FORCE, usual(FORCE, s.load_n), &|log| log.filtered_n.clone()));
        }
        if wanted(TORQUE) {
            all.push(over(TORQUE, usual(TORQUE, s.torque_nm), &|log| log.filtered(&log.torque_nm)));
        }
        all
    }
}
