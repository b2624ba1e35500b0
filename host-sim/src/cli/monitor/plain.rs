//! A line twice a second.

use std::time::{Duration, Instant};

use rig_link::telemetry::{Health, TelemetryRow};

use super::{Each, Monitor, Watching, timing};
use crate::cli::common::say;
use crate::cli::interrupt;
use crate::cli::port::Port;
use crate::input_error::InputError;
use crate::link::words;

const EVERY: Duration = Duration::from_millis(500);
/// 20 rows a second.
const EVERY_TICKS: u16 = 500;

pub(super) fn watch(monitor: &Monitor) -> Result<(), InputError> {
    let (port, listens) = monitor.port.open_or_listen()?;
    let mut watching = Watching::new(1.0);
    let mut printed = Instant::now();
    let aloud = |port: &mut Port, watching: &mut Watching, each: Each<'_>| port.perform_with(watching, each);
    monitor.watch(port, listens, &mut watching, EVERY_TICKS, aloud, |watching| {
        if interrupt::count() > 0 {
            watching.record.finish_early();
        }
        if printed.elapsed() >= EVERY
            && let Some(row) = watching.history.rows.back()
        {
            say(&line(row, watching.history.health.as_ref()));
            printed = Instant::now();
        }
    })
}

fn line(row: &TelemetryRow, health: Option<&Health>) -> String {
    let fault = if row.fault == 0 { String::new() } else { format!("  {}", words::fault(row.fault)) };
    let limits = words::limits(row.limits);
    let limits = if limits.is_empty() { limits } else { format!("  {limits}") };
    let load = health.map_or(String::new(), |health| {
        format!(
            "  {} cycles, {} late, start {} ns late at most, stack {} %",
            health.cycles_max,
            health.deadline_misses,
            health.start_max_ns.saturating_sub(health.start_min_ns),
            timing::stack_percent(health)
        )
    });
    format!(
        "{:9} M1 {:6.2} N m  M2 {:6.2} N m {:7.2} rad/s  normal {:6.1} N  friction {:6.3} N m  {:4.1} V{load}{fault}{limits}",
        words::mode(row.mode),
        row.m1_torque_nm,
        row.m2_torque_nm,
        row.m2_speed_rad_s,
        row.normal_force_n,
        row.friction_torque_nm,
        row.supply_v,
    )
}
