//! The speed loop at a slow speed, and the way back to rest.

use model_core::control::{M2Mode, Mode};
use rig_link::message::Command;

use super::{Commissioning, Stop};

/// 10 rpm, the slowest of the paper's experiments.
const SPEED_RAD_S: f32 = std::f32::consts::FRAC_PI_3;
const SETTLE_S: f64 = 0.5;
const SPAN_S: f64 = 1.0;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    c.arm("see the steps before")?;
    c.rig.start(0.0, M2Mode::Speed, SPEED_RAD_S)?;
    c.rig.wait(SETTLE_S)?;
    c.rig.begin_rows();
    c.rig.wait(SPAN_S)?;
    let advice = "inertia and bearing friction of the settings are another rig's, or the disc is blocked";
    c.no_fault("at 10 rpm", advice)?;
    #[allow(clippy::cast_precision_loss)]
    let count = c.rig.rows.len().max(1) as f64;
    let mean = c.rig.rows.iter().map(|row| f64::from(row.m2_speed_rad_s)).sum::<f64>() / count;
    let wanted = f64::from(SPEED_RAD_S);
    c.check(
        "mean speed",
        format!("{mean:.4} rad/s"),
        &format!("{wanted:.4} rad/s ± 2 %"),
        (mean / wanted - 1.0).abs() <= 0.02,
        advice,
    );
    c.rig.order(Command::Stop)?;
    let from = c.rig.row.tick;
    while c.rig.mode() == Some(Mode::Running) || c.rig.mode() == Some(Mode::Stopping) {
        c.rig.wait(0.02)?;
    }
    let took = super::rig::seconds(c.rig.row.tick - from);
    let most = f64::from(c.rig.settings.timing.stop_timeout_s);
    let armed = c.rig.mode() == Some(Mode::Armed);
    c.check("comes to rest", format!("{took:.2} s"), &format!("{most} s, and stays armed"), armed, advice);
    c.rig.disarm()?;
    c.settle()
}
