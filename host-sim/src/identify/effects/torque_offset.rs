//! `torque_offset`: the commanded torque has an offset.
//!
//! The same in all logs, another one in each, one that settles while the amplifier warms up, or one that wanders.

use super::coordinates::saturating;
use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct TorqueOffset;

/// Times in which an amplifier settles, in shares of the longest log: soon, and hardly.
const BENDS: [f64; 3] = [0.03, 0.1, 0.3];
/// Names of what is not one offset.
const OF_LOG: &str = "offset_log";
const SETTLES: &str = "settles_by";
const WANDERS: &str = "wanders_by";
/// Half periods in the longest log up to which a zero's wandering is told: like a random walk's, its parts fall with their
/// number, and what changes faster is no zero.
const WANDERING: usize = 8;

impl Effect for TorqueOffset {
    fn about(&self) -> About {
        About {
            id: "torque_offset",
            meaning: "the commanded torque has an offset",
            experiment: "rest the lifted disc and find the torques at which it begins to turn either way",
        }
    }

    fn is_like_a_bridges_error(&self) -> bool {
        true
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let size = view.scales.own;
        let ones = |log: Option<usize>| -> Vec<f64> {
            let of = |(at, own): (usize, &super::DriveLog)| {
                vec![f64::from(u8::from(log.is_none_or(|log| log == at))); own.len()]
            };
            view.logs.iter().enumerate().flat_map(of).collect()
        };
        let offset = |name: String| Parameter::amplitude(name, size);
        let form = |form: &str, parameters, columns| Alternative {
            form: form.into(),
            log_prior: -4f64.ln(),
            ..Alternative::columns(self.id(), parameters, columns)
        };
        let mut all = vec![form("constant", vec![offset("offset".into())], vec![ones(None)])];
        if view.logs.len() > 1 {
            let logs = 0..view.logs.len();
            let parameters = logs.clone().map(|log| offset(format!("{OF_LOG}{}", log + 1))).collect();
            all.push(form("another one in each log", parameters, logs.map(|log| ones(Some(log))).collect()));
        }
        let settling = |bend: &f64| -> Vec<f64> {
            let of = |log: &super::DriveLog| saturating(&log.grid.time_s, view.scales.time_s, *bend);
            view.logs.iter().flat_map(of).collect()
        };
        let parameters = (1..=BENDS.len()).map(|n| offset(format!("{SETTLES}_{n}")));
        all.push(form(
            "settling",
            std::iter::once(offset("offset".into())).chain(parameters).collect(),
            std::iter::once(ones(None)).chain(BENDS.iter().map(settling)).collect(),
        ));
        let cosine = |half_periods: usize| -> Vec<f64> {
            let turn = std::f64::consts::PI * half_periods as f64 / view.scales.time_s;
            let of = |log: &super::DriveLog| log.grid.time_s.iter().map(|t| (turn * t).cos()).collect::<Vec<f64>>();
            view.logs.iter().flat_map(of).collect()
        };
        let parts = (1..=WANDERING).map(|n| Parameter::amplitude(format!("{WANDERS}_{n}"), size / n as f64));
        all.push(form(
            "wandering",
            std::iter::once(offset("offset".into())).chain(parts).collect(),
            std::iter::once(ones(None)).chain((1..=WANDERING).map(cosine)).collect(),
        ));
        all
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        // What belongs to one log or to its time is not known of another one.
        if value(OF_LOG).or(value(SETTLES)).or(value(WANDERS)).is_some() {
            return None;
        }
        let offset = value("offset")?;
        Some(DriveLaw::effort(move |_| offset))
    }
}
