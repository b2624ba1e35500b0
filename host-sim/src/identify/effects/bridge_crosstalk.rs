//! `bridge_crosstalk`: the friction bridge picks up normal force, whatever the direction.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::term::Parameter;

/// The effect.
pub struct BridgeCrosstalk;

impl Effect for BridgeCrosstalk {
    fn id(&self) -> &'static str {
        "bridge_crosstalk"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        let (load, torque) = (view.scales.load_n, view.scales.torque_nm);
        let power = |n: i32| {
            let of = |log: &super::ContactLog| log.load_n.iter().map(|x| torque * (x / load).powi(n)).collect();
            view.logs.iter().map(of).collect()
        };
        let columns = [1, 2].map(power).to_vec();
        let parameters = vec![Parameter::amplitude("gain", 1.0), Parameter::amplitude("bend", 0.5)];
        vec![ContactTerm::shown(self.id(), "", columns, parameters)]
    }
}
