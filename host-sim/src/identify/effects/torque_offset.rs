//! `torque_offset`: the commanded torque has a constant offset.

use super::{DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::term::Parameter;

/// The effect.
pub struct TorqueOffset;

impl Effect for TorqueOffset {
    fn id(&self) -> &'static str {
        "torque_offset"
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let ones = vec![1.0; view.balance.response.len()];
        vec![Alternative::columns(self.id(), vec![Parameter::amplitude("offset", view.scales.own)], vec![ones])]
    }
}
