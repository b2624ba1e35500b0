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
        let ones = vec![1.0; view.balance.response.len()];
        vec![Alternative::columns(self.id(), vec![Parameter::amplitude("offset", view.scales.own)], vec![ones])]
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let offset = value("offset")?;
        Some(DriveLaw::effort(move |_| offset))
    }
}
