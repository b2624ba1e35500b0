//! `lever_hysteresis`: normal force lags M1 torque by a Coulomb band.

use super::{About, Effect, PressView};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct LeverHysteresis;

/// Widths of the play, in shares of the usual load.
const WIDTHS: [f64; 6] = [0.01, 0.03, 0.1, 0.2, 0.4, 0.8];

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

    fn press(&self, view: &PressView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let column = |share: f64| {
            let width = share * s.load_n;
            let of = |log: &super::PressLog| {
                let follows = play(&log.filtered_n, width);
                log.filtered_n.iter().zip(follows).map(|(x, q)| (x - q) / width).collect::<Vec<f64>>()
            };
            view.logs.iter().flat_map(of).collect()
        };
        let parameters = WIDTHS.map(|w| Parameter::positive(format!("band_{w}_nm"), 0.5 * s.torque_nm)).to_vec();
        vec![Alternative::columns(self.id(), parameters, WIDTHS.map(column).to_vec())]
    }
}
