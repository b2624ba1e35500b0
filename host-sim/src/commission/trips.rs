//! Each trip, provoked and seen.
//!
//! By hand with the drives on at zero torque: emergency stop, arm switch. By hand with the drives off, as a cause that
//! stands in the way of arming: the drives' fault lines, the bridges' plugs, too much force. By this program, with the
//! limit lowered for the moment: speed, torque, a host that falls silent.

use model_core::control::{Fault, M2Mode, Mode};
use rig_link::message::{Answer, Command};

use super::rig::sentence;
use super::{Commissioning, Stop};

/// The force limit while it is provoked by hand, N.
const FORCE_N: f32 = 10.0;
/// The speed limit while it is provoked, rad/s: 7 rpm.
const SPEED_RAD_S: f32 = 0.7;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    emergency_stop(c)?;
    arm_switch(c)?;
    for (fault, ask, back) in [
        (
            Fault::M1DriveFault,
            "make the drive of M1 report a fault, or pull its fault wire",
            "make the drive of M1 healthy again",
        ),
        (
            Fault::M2DriveFault,
            "make the drive of M2 report a fault, or pull its fault wire",
            "make the drive of M2 healthy again",
        ),
        (Fault::FrictionBridgeOpen, "unplug the friction bridge", "plug the friction bridge in"),
        (Fault::NormalBridgeOpen, "unplug the normal force bridge", "plug the normal force bridge in"),
    ] {
        stands_in_the_way(c, fault, ask, back)?;
    }
    c.rig.change("limits.normal_force_n", FORCE_N - 1.0)?;
    c.rig.change("limits.over_force_n", FORCE_N)?;
    let ask = format!("press M1's lever by hand with more than {FORCE_N} N, and hold it");
    stands_in_the_way(c, Fault::OverForce, &ask, "let M1's lever go")?;
    c.rig.restore()?;
    link(c)?;
    let small = c.options.small_torque_nm;
    #[allow(clippy::cast_possible_truncation)]
    let (torque, limit) = ((1.75 * small) as f32, (0.75 * small).max(0.1) as f32);
    c.rig.change("limits.speed_rad_s", 0.98 * SPEED_RAD_S)?;
    c.rig.change("limits.over_speed_rad_s", SPEED_RAD_S)?;
    moving(c, Fault::OverSpeed, torque, &format!("{SPEED_RAD_S} rad/s"))?;
    c.rig.change("limits.over_torque_nm", limit)?;
    moving(c, Fault::M2OverTorque, torque, &format!("{limit} N m"))
}

fn seen(c: &mut Commissioning<'_, '_>, what: &str, passed: bool, found: Option<String>) -> Result<(), Stop> {
    let found = found.unwrap_or_else(|| if passed { "seen".into() } else { "not seen".into() });
    c.check(
        what,
        found,
        "seen, drives off",
        passed,
        "what protects the rig does not: look at its wires and at its limit",
    );
    c.settle()
}

fn emergency_stop(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    c.arm("see the steps before")?;
    let stop = Fault::EmergencyStop.number();
    let tripped =
        c.rig.until("press the emergency stop", |inputs, rig| rig.row.fault == stop && !inputs.enabled)?;
    let fault = c.rig.fault();
    seen(c, "emergency stop while armed", tripped, fault)?;
    c.rig.until("release the emergency stop", |inputs, _| !inputs.emergency_stop)?;
    Ok(c.rig.clear_fault()?)
}

fn arm_switch(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    c.arm("see the steps before")?;
    let off = c.rig.until("turn the arm switch off", |inputs, rig| {
        rig.mode() == Some(Mode::Disabled) && !inputs.enabled && !inputs.arm_switch
    })?;
    c.rig.fall_silent();
    seen(c, "arm switch off while armed", off, None)
}

/// A cause that is there while the drives are off: arming is refused because of it.
fn stands_in_the_way(c: &mut Commissioning<'_, '_>, fault: Fault, ask: &str, back: &str) -> Result<(), Stop> {
    let there = c.rig.until(ask, |_, rig| rig.has_cause(fault))?;
    let refused = !matches!(c.rig.ask(Command::Arm)?, Answer::Done);
    if !refused {
        c.rig.disarm()?;
    }
    seen(c, &format!("{}, arming refused", sentence(fault.number())), there && refused, None)?;
    let gone = c.rig.until(back, |_, rig| !rig.has_cause(fault))?;
    c.check(back, if gone { "seen" } else { "not seen" }, "seen", gone, "the cause does not go away");
    c.settle()
}

/// This program falls silent with the drives on.
fn link(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    c.arm("see the steps before")?;
    c.rig.fall_silent();
    let timeout_s = f64::from(c.rig.settings.timing.link_timeout_s);
    let fault = c.rig.wait_for_fault(timeout_s + 1.0)?;
    let latched = c.rig.latched_tick(Fault::LinkLost).unwrap_or(c.rig.row.tick);
    let took = super::rig::seconds(latched.saturating_sub(c.rig.answered_tick));
    let found = format!("{} after {took:.2} s", c.rig.fault().unwrap_or_else(|| "nothing".into()));
    seen(c, "the host falls silent", fault == Some(Fault::LinkLost) && took <= timeout_s + 0.1, Some(found))?;
    Ok(c.rig.clear_fault()?)
}

/// M2 turns into a limit that was lowered for the moment.
fn moving(c: &mut Commissioning<'_, '_>, wanted: Fault, torque_nm: f32, limit: &str) -> Result<(), Stop> {
    c.arm("see the steps before")?;
    c.rig.start(0.0, M2Mode::Torque, torque_nm)?;
    let fault = c.rig.wait_for_fault(2.0)?;
    let found = c.rig.fault();
    c.rig.disarm()?;
    seen(c, &format!("{}, limit {limit}", sentence(wanted.number())), fault == Some(wanted), found)?;
    c.rig.clear_fault()?;
    Ok(c.rig.restore()?)
}
