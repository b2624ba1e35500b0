//! Emergency stop, arm switch and the drives' fault lines, each in both positions.

use rig_link::inputs::Inputs;

use super::{Commissioning, Stop};

type Look = fn(&Inputs) -> bool;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let asks: [(&str, &str, Look, &str); 7] = [
        (
            "emergency stop released",
            "release the emergency stop",
            |i| !i.emergency_stop,
            "its circuit is open: look at the wire to PF3",
        ),
        (
            "emergency stop pressed",
            "press the emergency stop",
            |i| i.emergency_stop,
            "its contact is bridged, or it is wired to the opening side",
        ),
        (
            "emergency stop released again",
            "release the emergency stop",
            |i| !i.emergency_stop,
            "its contact hangs",
        ),
        (
            "arm switch off",
            "turn the arm switch off",
            |i| !i.arm_switch,
            "it reads on: the wire to PG12 is at 3.3 V, or the switch opens where it should close",
        ),
        (
            "arm switch on",
            "turn the arm switch on",
            |i| i.arm_switch,
            "it reads off: the wire to PG12 is open, or the switch opens where it should close",
        ),
        ("arm switch off again", "turn the arm switch off", |i| !i.arm_switch, "its contact hangs"),
        (
            "both drives healthy",
            "clear the faults of both drives",
            |i| i.drive_fault == [false; 2],
            "a drive reports a fault, or its line is open: PE11 (M1), PE9 (M2)",
        ),
    ];
    for (what, ask, look, advice) in asks {
        // What is so already needs nobody, except that a switch must be seen to change.
        let seen = look(&c.rig.inputs()?) || c.rig.until(ask, |inputs, _| look(inputs))?;
        c.check(what, if seen { "seen" } else { "not seen" }, "seen", seen, advice);
        c.settle()?;
    }
    Ok(())
}
