//! A small torque of each motor: reference, amplifier, drive and monitor on one line, and the way the motor turns.
//!
//! M1 first, so small that the elements stay off the disc. The loops are open: a wrong sign cannot run away, and the
//! drives are switched off, not braked, because braking would already need the right sign.

use model_core::control::M2Mode;
use rig_link::telemetry::TelemetryRow;

use super::line_fit::LineFit;
use super::{Calibration, Commissioning, Stop};

/// Torques of M1, N·m: below 0.27 N·m the foil springs of the assumed rig hold the elements off.
const M1_LEVELS_NM: [f64; 2] = [0.1, 0.2];
/// The torque acts so long before it is looked at, and while it is, s.
const SETTLE_S: f64 = 0.03;
const SPAN_S: f64 = 0.12;
/// Least motion that has a direction.
const LEAST_COUNTS: i64 = 8;
/// Where the monitor shows the torque with the other sign.
const OTHER_SIGN: &str = "the torque has the other sign: the cores of its reference are exchanged, or rig settings set mN.reversed";
/// Where it shows another torque.
const NOT_FOLLOWED: &str = "the drive does not follow its torque reference: its wire is open, or rated torque and \
                            monitor scale are those of another drive";
/// Codes of the converter on one side of zero.
const DAC_HALF: f64 = 2048.0;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    one(c, 0, "M1", &M1_LEVELS_NM)?;
    let small = c.options.small_torque_nm;
    one(c, 1, "M2", &[small, -small, 1.75 * small, -1.75 * small])
}

fn one(c: &mut Commissioning<'_, '_>, motor: usize, name: &str, levels: &[f64]) -> Result<(), Stop> {
    let s = c.rig.settings;
    let drive = if motor == 0 { s.m1 } else { s.m2 };
    let mut points = Vec::new();
    let mut moved = Vec::new();
    let sign = if drive.reversed { -1.0 } else { 1.0 };
    for level in std::iter::once(&0.0).chain(levels) {
        c.arm("a drive gives torque at a setpoint of zero")?;
        #[allow(clippy::cast_possible_truncation)]
        let torque = *level as f32;
        let (m1, m2) = if motor == 0 { (torque, 0.0) } else { (0.0, torque) };
        let before = c.rig.row;
        c.rig.start(m1, M2Mode::Torque, m2)?;
        c.rig.wait(SETTLE_S)?;
        let readings = c.rig.readings(SPAN_S)?;
        let advice = if is_opposed(motor, &c.rig.rows) { OTHER_SIGN } else { NOT_FOLLOWED };
        c.no_fault(&format!("{name} at {level:+.2} N m"), advice)?;
        let count = |row: &TelemetryRow| if motor == 0 { row.m1_count } else { row.m2_count };
        moved.push((*level, count(&c.rig.row) - count(&before)));
        c.rig.disarm()?;
        let asked = sign * (readings.dac[motor] - DAC_HALF) / DAC_HALF * f64::from(drive.rated_torque_nm);
        let shown = (readings.code[2 + motor] - f64::from(drive.monitor_zero_code))
            * f64::from(drive.monitor_nm_per_code);
        points.push((asked, shown));
    }
    let Some(fit) = LineFit::through(&points) else {
        c.check(name, "no line", "different torques", false, "the reference does not change");
        return c.settle();
    };
    let gain = s.torque_watch.gain_tolerance;
    c.check(
        &format!("{name}, monitor over reference"),
        format!("{:.4}", fit.slope),
        &format!("1 ± {gain}"),
        (fit.slope - 1.0).abs() <= f64::from(gain),
        if fit.slope < 0.0 { OTHER_SIGN } else { "rated torque or monitor scale are those of another drive" },
    );
    let offset = s.torque_watch.offset_tolerance_nm;
    c.check(
        &format!("{name}, offset"),
        format!("{:+.4} N m", fit.offset),
        &format!("± {offset} N m"),
        fit.offset.abs() <= f64::from(offset),
        "trim the drive's offset",
    );
    let most = 0.1 * levels.iter().fold(0.0, |most: f64, level| most.max(level.abs()));
    c.check(
        &format!("{name}, largest deviation from a line"),
        format!("{:.4} N m", fit.largest_residual),
        &format!("{most:.3} N m"),
        fit.largest_residual <= most,
        "the drive limits or filters its torque",
    );
    c.report.calibrations.push(Calibration {
        name: format!("torque of {name}"),
        x: "Setpoint at the converter, N m",
        y: "Torque monitor of the drive, N m",
        fit,
    });
    c.settle()?;
    direction(c, name, &moved)
}

/// Whether the torque went against its reference before a fault ended it: the trim of the torque loop then drives it on.
fn is_opposed(motor: usize, rows: &[TelemetryRow]) -> bool {
    let of = |row: &TelemetryRow| {
        if motor == 0 {
            (row.m1_torque_ref_nm, row.m1_torque_nm)
        } else {
            (row.m2_torque_ref_nm, row.m2_torque_nm)
        }
    };
    rows.iter().map(of).map(|(reference, torque)| f64::from(reference * torque)).sum::<f64>() < 0.0
}

fn direction(c: &mut Commissioning<'_, '_>, name: &str, moved: &[(f64, i64)]) -> Result<(), Stop> {
    let wrong =
        moved.iter().any(|(level, counts)| *level * (*counts).signum() as f64 <= 0.0 && *level != 0.0);
    let still = moved.iter().any(|(level, counts)| *level != 0.0 && counts.abs() < LEAST_COUNTS);
    let shown: Vec<String> =
        moved.iter().map(|(level, counts)| format!("{level:+.2} N m: {counts:+}")).collect();
    c.check(
        &format!("{name}, counts with the torque"),
        shown.join(", "),
        "the sign of the torque",
        !wrong && !still,
        if still {
            "it does not move: raise --small-torque-nm above its friction, and look for what blocks it"
        } else {
            "the motor turns the other way than its drive believes: exchange two phases, or set the drive's direction"
        },
    );
    c.settle()
}
