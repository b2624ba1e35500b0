//! The drives enabled at zero torque: nothing moves, and the monitors agree.

use super::{Commissioning, Stop};

const SPAN_S: f64 = 0.5;
/// Motion that an enabled drive at zero torque may make: a thousandth of a turn.
const STILL_TURNS: f64 = 1e-3;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let advice =
        "a drive gives torque at a setpoint of zero: its torque reference is open, or its offset is large";
    c.arm(advice)?;
    let before = c.rig.row;
    let readings = c.rig.readings(SPAN_S)?;
    c.no_fault("armed at zero torque", advice)?;
    let s = c.rig.settings;
    let most = s.torque_watch.offset_tolerance_nm;
    for (name, code, drive) in [("M1", readings.code[2], s.m1), ("M2", readings.code[3], s.m2)] {
        let torque = (code - f64::from(drive.monitor_zero_code)) * f64::from(drive.monitor_nm_per_code);
        c.check(
            &format!("torque of {name}, enabled at zero"),
            format!("{torque:+.3} N m"),
            &format!("± {most} N m"),
            torque.abs() <= f64::from(most),
            "trim the drive's offset",
        );
    }
    let row = c.rig.row;
    for (name, counts, per_rev) in [
        ("M1", row.m1_count - before.m1_count, s.m1_encoder.counts_per_rev),
        ("M2", row.m2_count - before.m2_count, s.m2_encoder.counts_per_rev),
    ] {
        #[allow(clippy::cast_precision_loss)]
        let turns = counts as f64 / f64::from(per_rev);
        c.check(
            &format!("motion of {name} meanwhile"),
            format!("{counts:+} counts"),
            &format!("{STILL_TURNS} of a turn"),
            turns.abs() <= STILL_TURNS,
            "the drive turns it at zero torque: trim its offset",
        );
    }
    c.rig.disarm()?;
    c.settle()
}
