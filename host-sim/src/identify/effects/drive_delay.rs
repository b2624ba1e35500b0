//! `drive_delay`: motion follows the commanded torque after a pure delay.

use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::filters::shifted;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct DriveDelay;

/// Delays that are tried, s: 12 % apart, from a fifth of a millisecond to what no drive has.
const SHORTEST_S: f64 = 2e-4;
const COUNT: usize = 48;
const RATIO: f64 = 1.12;

impl Effect for DriveDelay {
    fn about(&self) -> About {
        About {
            id: "drive_delay",
            meaning: "motion follows the logged torque after a pure delay",
            experiment: "step the torque of the lifted disc sharply and log at the highest rate",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let shape = |delay_s: f64| {
            let added = view.logs.iter().flat_map(|log| {
                let late = shifted(&log.effort, -delay_s / log.grid.step_s);
                let change: Vec<f64> = late.iter().zip(&log.effort).map(|(a, b)| a - b).collect();
                log.filtered(&change)
            });
            Alternative {
                form: format!("{:.2} ms", 1e3 * delay_s),
                constants: vec![("delay_s".to_string(), delay_s)],
                response: Some(added.collect()),
                log_prior: -(COUNT as f64).ln(),
                ..Alternative::columns("drive_delay", Vec::<Parameter>::new(), Vec::new())
            }
        };
        let grid = (0..COUNT).map(|i| SHORTEST_S * RATIO.powi(i as i32)).collect();
        super::shapes(view.fixed, "delay_s", grid).into_iter().map(shape).collect()
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        Some(DriveLaw { late_s: value("delay_s")?, ..DriveLaw::default() })
    }
}
