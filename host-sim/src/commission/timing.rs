//! Rate and jitter of the control tick: cycles by the chip's cycle counter (DWT), the tick's distance from the trigger of
//! its scan by the timer, the rate by this computer's clock.

use std::time::Instant;

use super::rig::seconds;
use super::{Commissioning, Stop};

/// Over so much of the rig's time.
const SPAN_S: f64 = 3.0;
/// Cycles of a control period: 480 MHz over 10 kHz.
const PERIOD_CYCLES: u32 = 48_000;
/// A tick that begins later than this after another one's distance from its trigger disturbs the sampling of the speed.
const MOST_JITTER_NS: u32 = 5_000;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    c.rig.wait(0.05)?;
    let (wall, from) = (Instant::now(), c.rig.row.tick);
    let before = c.rig.health;
    c.rig.wait(SPAN_S)?;
    // The nominal rate is 10 kHz, so the ticks' seconds over the clock's are the share of it.
    let share = seconds(c.rig.row.tick - from) / wall.elapsed().as_secs_f64();
    let tolerance = c.options.clock_tolerance;
    c.check(
        "control rate by this computer's clock",
        format!("{:.1} Hz", 1e4 * share),
        &format!("10 kHz ± {} %", 100.0 * tolerance),
        (share - 1.0).abs() <= tolerance,
        "the chip's clock is wrong; or a served bench falls behind real time (--clock-tolerance)",
    );
    let health = c.rig.health;
    let late = health.deadline_misses - before.deadline_misses + health.missed_scans - before.missed_scans;
    c.check("ticks late or without a scan", late.to_string(), "0", late == 0, "something masks interrupts");
    let share = 100.0 * f64::from(health.cycles_max) / f64::from(PERIOD_CYCLES);
    c.check(
        "longest control tick (DWT)",
        format!("{} cycles, {share:.0} % of a period", health.cycles_max),
        "90 % of a period",
        share <= 90.0,
        "forget the observer's model, or give it fewer elements",
    );
    let jitter = health.start_max_ns.saturating_sub(health.start_min_ns);
    c.check(
        "jitter of the tick's start",
        format!("{jitter} ns ({} to {} ns after the trigger)", health.start_min_ns, health.start_max_ns),
        &format!("{MOST_JITTER_NS} ns"),
        jitter <= MOST_JITTER_NS,
        "something masks interrupts",
    );
    c.settle()
}
