//! `encoder_eccentricity`: once-per-revolution error of measured angle and speed.
//!
//! The disc then turns by the measured angle less the error, in the contact too: what rubs knows nothing of the encoder.

use super::{About, DriveView, Effect};
use crate::identify::balance::{Alternative, DiscMotion};
use crate::identify::filters::gaussian;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct EncoderEccentricity;

/// An error e of the angle that is large, rad: a disc set a tenth of its radius off centre.
const LARGE_RAD: f64 = 0.1;
/// A tilted disc adds a second harmonic, a fifth of the first at most. Over the measured angle, e(θ − e(θ)) ≈ e − e e′ has
/// others too: of two harmonics m and n the product (m + n)/2 times as large at m + n.
const LARGE_OF_HARMONIC_RAD: [f64; 4] =
    [LARGE_RAD, 0.2 * LARGE_RAD, 1.5 * 0.2 * LARGE_RAD * LARGE_RAD, 0.04 * LARGE_RAD * LARGE_RAD];

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
        let (mut columns, mut parameters, mut angle_per_unit) = (Vec::new(), Vec::new(), Vec::new());
        for only in logs {
            let name_of_log = only.map_or(String::new(), |log| format!("_log{}", log + 1));
            let harmonics = LARGE_OF_HARMONIC_RAD.into_iter().zip(1u8..);
            for ((large, order), (name, sine)) in
                harmonics.flat_map(|harmonic| [("cos", false), ("sin", true)].map(|wave| (harmonic, wave)))
            {
                let turns = f64::from(order);
                let waves: Vec<Vec<f64>> = view
                    .logs
                    .iter()
                    .enumerate()
                    .map(|(at, log)| {
                        let acts = only.is_none_or(|only| only == at);
                        let wave = |x: &f64| if sine { (turns * x).sin() } else { (turns * x).cos() };
                        log.position.iter().map(|x| if acts { wave(x) } else { 0.0 }).collect()
                    })
                    .collect();
                let column = view.logs.iter().zip(&waves).flat_map(|(log, wave)| {
                    let dt = log.grid.step_s;
                    gaussian(wave, log.width, 2).into_iter().map(move |d| view.inertia * d / (dt * dt))
                });
                columns.push(column.collect());
                angle_per_unit.push(waves);
                parameters.push(Parameter::amplitude(format!("{name}_{order}_rad{name_of_log}"), large));
            }
        }
        let disc = DiscMotion {
            angle_rad: vec![view.logs.iter().map(|log| log.position.clone()).collect()],
            angle_per_unit,
        };
        // Cosine and sine of each harmonic, log after log.
        const EACH: usize = LARGE_OF_HARMONIC_RAD.len();
        let same_amplitude = if logs.len() > 1 {
            let places = |harmonic: usize| {
                (0..logs.len()).map(move |log| [0, 1].map(|sine| 2 * (EACH * log + harmonic) + sine)).collect()
            };
            (0..EACH).map(places).collect()
        } else {
            Vec::new()
        };
        Alternative { form: form.into(), disc: Some(disc), same_amplitude, ..Alternative::columns(self.id(), parameters, columns) }
    }
}
