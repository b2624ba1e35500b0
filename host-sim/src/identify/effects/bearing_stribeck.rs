//! `bearing_stribeck`: the bearing's friction falls with speed near zero.

use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::direction;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BearingStribeck;

/// Stribeck speeds that are tried, in shares of the usual speed.
const SPEEDS: [f64; 6] = [0.02, 0.05, 0.1, 0.2, 0.4, 0.8];

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
        let shape = |at: f64| {
            let column = view.logs.iter().flat_map(|log| {
                let fall: Vec<f64> =
                    direction(log, s.speed).iter().zip(&log.speed).map(|(d, v)| d * (-v.abs() / at).exp()).collect();
                log.filtered(&fall)
            });
            let parameters = vec![Parameter::positive("static_excess", s.own)];
            Alternative {
                form: format!("below {at:.3}"),
                constants: vec![("stribeck_speed".to_string(), at)],
                log_prior: -(SPEEDS.len() as f64).ln(),
                ..Alternative::columns("bearing_stribeck", parameters, vec![column.collect()])
            }
        };
        let grid = SPEEDS.map(|share| share * s.speed).to_vec();
        super::shapes(view.fixed, "stribeck_speed", grid).into_iter().map(shape).collect()
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let (excess, speed) = (value("static_excess")?, value("stribeck_speed")?);
        let exponent = value("exponent").unwrap_or(1.0);
        Some(DriveLaw::effort(move |v| excess * v.signum() * (-(v.abs() / speed).powf(exponent)).exp()))
    }
}
