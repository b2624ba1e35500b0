//! `lever_hysteresis`: normal force lags M1 torque by a Coulomb band.

use super::stops::{Stops, coarse, stop};
use super::waves::travel;
use super::{About, Effect, NormalLoadLog, NormalLoadView};
use crate::identify::balance::Alternative;

/// The effect.
pub(super) struct LeverHysteresis;

/// The two forms, by the usual size of what is lagged.
const FORCE: &str = "usual_force_n";
const TORQUE: &str = "usual_torque_nm";
/// Shortest width of the play, in shares of the usual force or torque; the longest, of what it goes over: a wider one slides both
/// ways on less than half of it, and is a spring.
const SHORTEST: f64 = 0.01;
const LONGEST: f64 = 0.25;

/// What lags.
type Signal = fn(&NormalLoadLog) -> &[f64];

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
        let over = |form: &str, [unit, within]: [&'static str; 2], usual: f64, signal: Signal| {
            // A stop remembers peaks: noise makes some, and a filter that is the same everywhere cuts those that are.
            let column = |width: f64| {
                view.logs.iter().flat_map(|log| log.filtered(&stop(signal(log), width))).collect()
            };
            let stops = Stops {
                effect: self.id(),
                size: 0.5 * s.torque_nm,
                units: [unit, "nm"],
                column: &column,
                deflection: Some(within),
            };
            let found = match view.fixed {
                Some(fixed) => stops.of_constants(fixed),
                None => {
                    let goes_over = view.logs.iter().map(|log| travel(signal(log).iter().copied()));
                    let longest = LONGEST * goes_over.fold(usual, f64::max);
                    stops.searched(view.balance, view.company, &coarse([SHORTEST * usual, longest]))
                }
            };
            let mut constants = found.constants;
            // Which of the forms, as a constant: held-out logs take the one that was found.
            constants.push((form.into(), usual));
            Alternative { form: form.into(), constants, ..found }
        };
        let wanted = |form: &str| view.fixed.is_none_or(|fixed| fixed.iter().any(|(name, _)| name == form));
        let mut all = Vec::new();
        if wanted(FORCE) {
            all.push(over(FORCE, ["n", "force within the band, N"], s.load_n, |log| &log.smoothed_n));
        }
        if wanted(TORQUE) {
            let words = ["nm", "torque within the band, N m"];
            all.push(over(TORQUE, words, s.torque_nm, |log| &log.smoothed_torque_nm));
        }
        all
    }
}
