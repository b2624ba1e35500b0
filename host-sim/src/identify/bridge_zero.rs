//! What a bridge shows where nothing pulls: no transducer's zero is known better than its class says.

use crate::files::rig_file::RigFile;

/// Zero of a strain-gauge transducer relative to its range: assumed of class 0.2. Makers name the accuracy class after the largest
/// of a transducer's errors in per cent, what 10 K do to its zero among them; 0.05 to 0.5 are sold.
const CLASS: f64 = 2e-3;

/// Standard deviations of the zeros of friction bridge (N m) and normal bridge (N): each is made for what its motor can do.
pub(super) fn standard_deviations(rig: &RigFile) -> [f64; 2] {
    [rig.m2.rated_torque_nm, rig.m1.rated_torque_nm * rig.lever_gain_n_per_nm].map(|range| CLASS * range)
}
