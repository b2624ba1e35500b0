//! Raw codes of every analogue channel at rest: none at a rail, each zero where it belongs.

use super::{Commissioning, Stop};

const SPAN_S: f64 = 0.2;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let readings = c.rig.readings(SPAN_S)?;
    let lines: Vec<String> =
        readings.named().map(|(name, code, std)| format!("{name} {code:.0} ± {std:.1}")).collect();
    c.rig.say(&format!("raw codes, mean and deviation of {} readings: {}", readings.count, lines.join(", ")));
    let [friction, normal, m1, m2, supply] = readings.code;
    let s = c.rig.settings;
    let volt = supply * f64::from(s.supply.volt_per_code);
    let (low, high) = (s.supply.low_v, s.supply.high_v);
    c.check(
        "supply",
        format!("{volt:.2} V"),
        &format!("{low} to {high} V"),
        (f64::from(low)..=f64::from(high)).contains(&volt),
        "look at the drives' supply and at its divider on PA0",
    );
    for (name, code, bridge, unit) in [
        ("friction bridge", friction, s.friction_bridge, "N m"),
        ("normal force bridge", normal, s.normal_bridge, "N"),
    ] {
        let (low, high) = (f64::from(bridge.saturated_low_code), f64::from(bridge.saturated_high_code));
        let inside = code > low && code < high;
        let value = (code - f64::from(bridge.zero_code)) * f64::from(bridge.unit_per_code);
        let most = bridge.tare_limit;
        let (passed, advice) = match (inside, value.abs() <= f64::from(most)) {
            (false, _) => {
                (false, "at a rail: the bridge is not connected, a wire is broken, or its supply is missing")
            }
            (true, false) => (
                false,
                "far from zero with nothing on it: signal wires or the plugs of the two bridges are exchanged, or \
                 zero_code is that of another amplifier",
            ),
            (true, true) => (true, ""),
        };
        let allowed = format!("codes {low:.0} to {high:.0}, and no more than {most} {unit} from zero");
        c.check(name, format!("code {code:.0}, {value:.3} {unit}"), &allowed, passed, advice);
    }
    let most = s.torque_watch.offset_tolerance_nm;
    for (name, code, drive) in [("M1 torque monitor", m1, s.m1), ("M2 torque monitor", m2, s.m2)] {
        let torque = (code - f64::from(drive.monitor_zero_code)) * f64::from(drive.monitor_nm_per_code);
        c.check(
            name,
            format!("code {code:.0}, {torque:.3} N m"),
            &format!("± {most} N m with the drive off"),
            torque.abs() <= f64::from(most),
            "the drive's monitor output is not connected, or monitor_zero_code is that of another amplifier",
        );
    }
    c.settle()
}
