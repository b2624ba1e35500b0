//! `bearing_stribeck`: the bearing's friction falls with speed near zero.

use super::coordinates::STRIBECK_SPEEDS;
use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BearingStribeck;

/// Exponents that are tried: Bo and Pavelescu 1982 found 0.5 to 1, Armstrong-Hélouvry 1991 takes 2.
const EXPONENTS: [f64; 3] = [0.5, 1.0, 2.0];
/// Names of speed and exponent.
const SPEED: &str = "stribeck_speed";
const EXPONENT: &str = "exponent";

impl Effect for BearingStribeck {
    fn about(&self) -> About {
        About {
            id: "bearing_stribeck",
            meaning: "the bearing's friction falls with speed near zero",
            experiment: "turn the lifted disc steadily at eight speeds from 0.1 to 10 rad/s",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let shape = |(at, exponent): (f64, f64)| {
            let column = view.logs.iter().flat_map(|log| {
                let fall: Vec<f64> =
                    direction(log, s.speed).iter().zip(&log.speed).map(|(d, v)| d * (-(v.abs() / at).powf(exponent)).exp()).collect();
                log.filtered(&fall)
            });
            let parameters = vec![Parameter::positive("static_excess", s.own)];
            Alternative {
                form: format!("below {at:.3}, exponent {exponent}"),
                constants: vec![(SPEED.to_string(), at), (EXPONENT.to_string(), exponent)],
                log_prior: -((STRIBECK_SPEEDS.len() * EXPONENTS.len()) as f64).ln(),
                ..Alternative::columns("bearing_stribeck", parameters, vec![column.collect()])
            }
        };
        let grid = STRIBECK_SPEEDS.map(|share| share * s.speed).to_vec();
        let exponents = super::shapes(view.fixed, EXPONENT, EXPONENTS.to_vec());
        let speeds = super::shapes(view.fixed, SPEED, grid).into_iter();
        speeds.flat_map(|at| exponents.iter().map(move |exponent| (at, *exponent))).map(shape).collect()
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let (excess, speed) = (value("static_excess")?, value(SPEED)?);
        let exponent = value(EXPONENT).unwrap_or(1.0);
        Some(DriveLaw::effort(move |v| excess * v.signum() * (-(v.abs() / speed).powf(exponent)).exp()))
    }
}
