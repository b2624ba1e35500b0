//! `torque_offset`: the commanded torque has a constant offset.

use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct TorqueOffset;

impl Effect for TorqueOffset {
    fn about(&self) -> About {
        About {
            id: "torque_offset",
            meaning: "the commanded torque has a constant offset",
            experiment: "rest the lifted disc and find the torques at which it begins to turn either way",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let size = view.scales.own;
        let ones = |log: Option<usize>| -> Vec<f64> {
            let of = |(at, own): (usize, &super::DriveLog)| {
                vec![f64::from(u8::from(log.is_none_or(|log| log == at))); own.len()]
            };
            view.logs.iter().enumerate().flat_map(of).collect()
        };
        let mut all = vec![Alternative::columns(self.id(), vec![Parameter::amplitude("offset", size)], vec![ones(None)])];
        if view.logs.len() > 1 {
            // An amplifier's zero is another one after it has warmed up.
            let logs = 0..view.logs.len();
            let parameters = logs.clone().map(|log| Parameter::amplitude(format!("offset_log{}", log + 1), size));
            let columns = logs.clone().map(|log| ones(Some(log)));
            let form = "an offset for each log".to_string();
            all.push(Alternative { form, ..Alternative::columns(self.id(), parameters.collect(), columns.collect()) });
        }
        all
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let offset = value("offset")?;
        Some(DriveLaw::effort(move |_| offset))
    }
}
