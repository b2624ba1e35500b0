//! `encoder_eccentricity`: once-per-revolution error of measured angle and speed.

use super::{DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::filters::gaussian;
use crate::identify::term::Parameter;

/// The effect.
pub struct EncoderEccentricity;

/// An error of the angle that is large, rad: a disc set a tenth of its radius off centre.
const LARGE_RAD: f64 = 0.1;

impl Effect for EncoderEccentricity {
    fn id(&self) -> &'static str {
        "encoder_eccentricity"
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        if !view.rotary {
            return Vec::new();
        }
        let (mut columns, mut parameters) = (Vec::new(), Vec::new());
        for at in 0..view.logs.len() {
            for (name, sine) in [("cos", false), ("sin", true)] {
                let column = view.logs.iter().enumerate().flat_map(|(other, log)| {
                    if other != at {
                        return vec![0.0; log.len()];
                    }
                    let wave: Vec<f64> = log.position.iter().map(|x| if sine { x.sin() } else { x.cos() }).collect();
                    let dt = log.grid.step_s;
                    gaussian(&wave, log.width, 2).iter().map(|d| view.inertia * d / (dt * dt)).collect()
                });
                columns.push(column.collect());
                parameters.push(Parameter::amplitude(format!("{name}_1_rad_log{}", at + 1), LARGE_RAD));
            }
        }
        vec![Alternative::columns(self.id(), parameters, columns)]
    }
}
