//! `bearing_asymmetry`: the bearing's friction differs per direction.
//!
//! Half the difference is even in speed: Coulomb and viscous friction, or each direction with a Stribeck curve of its own.

use super::stribeck_curve::Curve;
use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BearingAsymmetry;

/// Share of the motion that goes the rarer way at least: less is the encoder's noise about a standstill.
const SEEN: f64 = 0.01;
/// Ends of the names of what belongs to one direction.
const WAYS: [&str; 2] = ["_forward", "_backward"];

impl Effect for BearingAsymmetry {
    fn about(&self) -> About {
        About {
            id: "bearing_asymmetry",
            meaning: "the bearing's friction differs per direction",
            experiment: "turn the lifted disc steadily at three speeds each way, and rest it: at rest an offset shows and an asymmetry does not",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        // What turns one way alone does not show a difference, and its columns would be those of the bearing itself.
        let turned = view.logs.iter().flat_map(|log| direction(log, s.speed));
        let (forward, backward) = turned.fold((0.0, 0.0), |(f, b), d| (f + d.max(0.0), b - d.min(0.0)));
        if f64::min(forward, backward) < SEEN * (forward + backward) {
            return Vec::new();
        }
        let magnitude = |values: Vec<f64>| values.into_iter().map(f64::abs).collect::<Vec<f64>>();
        let coulomb = view.logs.iter().flat_map(|log| magnitude(direction(log, s.speed))).collect();
        let viscous = view.logs.iter().flat_map(|log| magnitude(log.speed.clone())).collect();
        let (coulomb, viscous): (Vec<f64>, Vec<f64>) = (coulomb, viscous);
        let parameters = || {
            vec![
                Parameter::amplitude("coulomb_half_difference", s.own),
                Parameter::amplitude("viscous_half_difference", s.own / s.speed),
            ]
        };
        let plain = Alternative {
            log_prior: -2f64.ln(),
            ..Alternative::columns(self.id(), parameters(), vec![coulomb.clone(), viscous.clone()])
        };
        let curve = Curve::new(view);
        let excesses = WAYS.into_iter().flat_map(|way| curve.parameters(way, s.own));
        let columns = curve.columns(view, |d| d.max(0.0)).into_iter().chain(curve.columns(view, |d| d.min(0.0)));
        let with_curves = Alternative {
            form: "a Stribeck curve each way".into(),
            constants: curve.constants(),
            log_prior: -2f64.ln(),
            ..Alternative::columns(
                self.id(),
                parameters().into_iter().chain(excesses).collect(),
                [coulomb, viscous].into_iter().chain(columns).collect(),
            )
        };
        vec![plain, with_curves]
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let part = |name: &str| value(&format!("{name}_difference")).or(value(&format!("{name}_half_difference")));
        let (coulomb, viscous) = (part("coulomb"), part("viscous"));
        coulomb.or(viscous)?;
        let (coulomb, viscous) = (coulomb.unwrap_or(0.0), viscous.unwrap_or(0.0));
        let [forward, backward] = WAYS.map(|way| Curve::of_file(way, value));
        Some(DriveLaw::effort(move |v: f64| {
            let excess = |curve: &Option<Box<dyn Fn(f64) -> f64>>| curve.as_ref().map_or(0.0, |of| of(v));
            let fall = if v > 0.0 { excess(&forward) } else { -excess(&backward) };
            coulomb + viscous * v.abs() + fall
        }))
    }
}
