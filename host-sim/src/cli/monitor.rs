//! `rig monitor`: what the rig says, as it says it.

use std::time::{Duration, Instant};

use rig_link::telemetry::{Health, TelemetryRow};

use super::common::say;
use super::port::PortArgs;
use crate::input_error::InputError;
use crate::link::client::Client;
use crate::link::procedure::Procedure;
use crate::link::record::{Record, Recorded};
use crate::link::words;

/// Show what the rig does: values twice a second, events as they come
#[derive(clap::Args, Debug)]
#[command(after_long_help = "\
Example:
  rig monitor --port /dev/ttyACM0

Says who answers, why it started, and what it kept from before a crash; then a line twice a second with mode,
torques, speed, forces and supply, and a line for each event. Commands nothing. Ctrl-C ends it.")]
pub(super) struct Monitor {
    #[command(flatten)]
    port: PortArgs,
    /// End by itself after so many seconds
    #[arg(long, value_name = "S", default_value_t = 86400.0)]
    seconds: f64,
}

/// A recording that keeps nothing and prints its last row now and then.
struct Watching {
    record: Record,
    printed: Instant,
}

const EVERY: Duration = Duration::from_millis(500);
/// 20 rows a second.
const EVERY_TICKS: u16 = 500;

impl Procedure for Watching {
    type Outcome = Recorded;

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        self.record.step(now_s, client)?;
        if self.printed.elapsed() >= EVERY
            && let Some(recorded) = self.record.recorded()
            && let Some(row) = recorded.rows.last()
        {
            say(&line(row, recorded.health.as_ref()));
            self.printed = Instant::now();
        }
        Ok(())
    }

    fn outcome(&mut self) -> Option<Recorded> {
        self.record.outcome()
    }

    fn notes(&mut self) -> Vec<String> {
        self.record.notes()
    }
}

fn line(row: &TelemetryRow, health: Option<&Health>) -> String {
    let fault = if row.fault == 0 { String::new() } else { format!("  {}", words::fault(row.fault)) };
    let load = health.map_or(String::new(), |health| {
        format!("  {} cycles, {} late", health.cycles_max, health.deadline_misses)
    });
    format!(
        "{:9} M1 {:6.2} N m  M2 {:6.2} N m {:7.2} rad/s  normal {:6.1} N  friction {:6.3} N m  {:4.1} V{load}{fault}",
        words::mode(row.mode),
        row.m1_torque_nm,
        row.m2_torque_nm,
        row.m2_speed_rad_s,
        row.normal_force_n,
        row.friction_torque_nm,
        row.supply_v,
    )
}

impl Monitor {
    /// Runs the command.
    pub(super) fn run(self) -> Result<(), InputError> {
        let record = Record::new(EVERY_TICKS, self.seconds, false);
        self.port.open()?.perform(&mut Watching { record, printed: Instant::now() })?;
        Ok(())
    }
}
