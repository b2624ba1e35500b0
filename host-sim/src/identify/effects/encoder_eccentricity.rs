//! `encoder_eccentricity`: once-per-revolution error of measured angle and speed.

use super::{About, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::filters::gaussian;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct EncoderEccentricity;

/// An error of the angle that is large, rad: a disc set a tenth of its radius off centre.
const LARGE_RAD: f64 = 0.1;

impl Effect for EncoderEccentricity {
    fn about(&self) -> About {
        About {
            id: "encoder_eccentricity",
            meaning: "measured angle and speed have an error once per revolution",
            experiment: "turn the lifted disc steadily at 60 and 120 rpm",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        if !view.rotary {
            return Vec::new();
        }
        let own: Vec<Option<usize>> = (0..view.logs.len()).map(Some).collect();
        [("one phase", vec![None]), ("a phase for each log", own)]
            .into_iter()
            .map(|(form, logs)| self.alternative(view, form, &logs))
            .collect()
    }
}

impl EncoderEccentricity {
    fn alternative(&self, view: &DriveView<'_>, form: &str, logs: &[Option<usize>]) -> Alternative {
        let (mut columns, mut parameters) = (Vec::new(), Vec::new());
        for only in logs {
            let name_of_log = only.map_or(String::new(), |log| format!("_log{}", log + 1));
            // A tilted disc adds a second harmonic, a fifth of the first at most.
            for (name, order, sine) in [("cos", 1, false), ("sin", 1, true), ("cos", 2, false), ("sin", 2, true)] {
                let turns = f64::from(order);
                let column = view.logs.iter().enumerate().flat_map(|(at, log)| {
                    if only.is_some_and(|only| only != at) {
                        return vec![0.0; log.len()];
                    }
                    let wave: Vec<f64> = log.position.iter().map(|x| if sine { (turns * x).sin() } else { (turns * x).cos() }).collect();
                    let dt = log.grid.step_s;
                    gaussian(&wave, log.width, 2).iter().map(|d| view.inertia * d / (dt * dt)).collect()
                });
                columns.push(column.collect());
                let large = if order == 1 { LARGE_RAD } else { 0.2 * LARGE_RAD };
                parameters.push(Parameter::amplitude(format!("{name}_{order}_rad{name_of_log}"), large));
            }
        }
        Alternative { form: form.into(), ..Alternative::columns(self.id(), parameters, columns) }
    }
}
