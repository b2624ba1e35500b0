//! `bearing_asymmetry`: the bearing's friction differs per direction.
//!
//! Half the difference is even in speed: Coulomb and viscous friction, or each direction with a Stribeck curve of its own.

use super::coordinates::STRIBECK_SPEEDS;
use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BearingAsymmetry;

/// Name of the one chosen.
const STRIBECK_SPEED: &str = "stribeck_speed";

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
        let with_curves = |at: f64| {
            let fall = |of: fn(f64) -> f64| -> Vec<f64> {
                let falling = |log: &super::DriveLog| {
                    let fall = direction(log, s.speed).into_iter().zip(&log.speed);
                    log.filtered(&fall.map(|(d, v)| of(d) * (-v.abs() / at).exp()).collect::<Vec<f64>>())
                };
                view.logs.iter().flat_map(falling).collect()
            };
            let each = ["static_excess_forward", "static_excess_backward"]
                .map(|name| Parameter::positive(name, s.own));
            Alternative {
                form: format!("a Stribeck curve each way, below {at:.3}"),
                constants: vec![(STRIBECK_SPEED.to_string(), at)],
                log_prior: -(2.0 * STRIBECK_SPEEDS.len() as f64).ln(),
                ..Alternative::columns(
                    self.id(),
                    parameters().into_iter().chain(each).collect(),
                    vec![coulomb.clone(), viscous.clone(), fall(|d| d.max(0.0)), fall(|d| d.min(0.0))],
                )
            }
        };
        let curves = super::shapes(view.fixed, STRIBECK_SPEED, STRIBECK_SPEEDS.map(|share| share * s.speed).to_vec());
        std::iter::once(plain).chain(curves.into_iter().map(with_curves)).collect()
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let part = |name: &str| value(&format!("{name}_difference")).or(value(&format!("{name}_half_difference")));
        let (coulomb, viscous) = (part("coulomb"), part("viscous"));
        coulomb.or(viscous)?;
        let (coulomb, viscous) = (coulomb.unwrap_or(0.0), viscous.unwrap_or(0.0));
        let excess = |way: &str| value(&format!("static_excess_{way}")).unwrap_or(0.0);
        let (forward, backward) = (excess("forward"), excess("backward"));
        let speed = value(STRIBECK_SPEED).unwrap_or(f64::INFINITY);
        Some(DriveLaw::effort(move |v: f64| {
            let fall = if v > 0.0 { forward } else { -backward } * (-v.abs() / speed).exp();
            coulomb + viscous * v.abs() + fall
        }))
    }
}
