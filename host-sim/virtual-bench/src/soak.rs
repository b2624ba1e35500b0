//! Soak: experiments and commands drawn by a seed, one after the other, for as long as asked.
//!
//! Asked at the end of each: is any row, event or frame lost by the counters of both ends, was a tick late or a scan missed,
//! is the disc where the rig's counts say it is. At the end: how deep the stack went and how deep it would with every
//! interrupt at once (`stack.rs`), and what flash was written.

use crate::bench;
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::endpoint_link::perform;
use crate::error::BenchError;
use crate::experiment::{ArmSwitch, Request, boot};
use crate::stack::{self, Depth};
use host_sim::files::experiment_file::ExperimentFile;
use host_sim::link::ask::Ask;
use host_sim::link::client::Client;
use host_sim::link::rows;
use host_sim::link::run_experiment::{RunExperiment, RunOptions};
use rig_link::capture::CaptureTrigger;
use rig_link::message::{Answer, Command};
use rig_link::model::ModelRecord;
use rig_link::telemetry::Health;
use serde::Serialize;

/// Counts of a turn of the assumed rig's encoders.
const COUNTS_PER_REV: f64 = 480_000.0;
/// The settings' sectors and the journal's (firmware/memory.x).
const SETTINGS: std::ops::Range<u64> = 0x0810_0000..0x0816_0000;
/// `speed_loop.bandwidth_hz`.
const KEY: u16 = 143;
/// Most that the count of a row and the disc's angle differ by: the disc creeps between the two.
const MOST_COUNTS: f64 = 200.0;

/// What a soak found.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct Soaked {
    /// Virtual time, s.
    pub seconds: f64,
    /// Experiments run.
    pub experiments: u32,
    /// Rows of telemetry received.
    pub rows: u64,
    /// Control ticks by the rig's own count.
    pub ticks: u64,
    /// Largest difference between the disc's angle and the rig's count, in counts.
    pub angle_counts: f64,
    /// How deep the stack goes.
    pub stack: Depth,
    /// Words of flash written, of so many.
    pub flash_words: (u64, u64),
    /// Everything that was not as it must be.
    pub problems: Vec<String>,
}

/// Soaks for so many seconds of virtual time; `tell` hears how far it is, in seconds.
///
/// # Errors
/// The bench itself failed, or an experiment was not carried out.
pub fn soak(
    firmware: &Firmware,
    seconds: f64,
    seed: u64,
    tell: &mut (dyn FnMut(f64) + Send),
) -> Result<Soaked, BenchError> {
    let plant = Request::assumed("fig20")?.plant()?;
    let outcome = bench::run(firmware, Box::new(plant), |endpoint| operate(endpoint, seconds, seed, tell))?;
    let mut soaked = outcome.operator;
    soaked.stack.crash = stack::crashes(firmware)?;
    if soaked.stack.left().is_none() {
        soaked.problems.push(soaked.stack.to_string());
    }
    if !outcome.record.restarts.is_empty() {
        soaked.problems.push(format!("it restarted: {:?}", outcome.record.restarts));
    }
    Ok(soaked)
}

fn operate(
    endpoint: &mut Endpoint,
    seconds: f64,
    seed: u64,
    tell: &mut dyn FnMut(f64),
) -> Result<Soaked, BenchError> {
    boot(endpoint)?;
    let mut soaked = Soaked::default();
    let mut chance = Chance(seed);
    let mut health = Health::default();
    while now_s(endpoint) < seconds {
        health = round(endpoint, &mut chance, &health, &mut soaked)?;
        // A run of an hour must not keep its log.
        endpoint.take_log()?;
        tell(now_s(endpoint));
    }
    soaked.seconds = now_s(endpoint);
    soaked.stack.mark = stack::mark(endpoint)?;
    stack::measure_interrupts(endpoint)?;
    round(endpoint, &mut chance, &health, &mut soaked)?;
    (soaked.stack.tick, soaked.stack.drivers) = stack::interrupts(endpoint)?;
    let flash = endpoint.memory(SETTINGS.start, SETTINGS.end - SETTINGS.start)?;
    let written = flash.chunks(32).filter(|word| word.iter().any(|byte| *byte != 0xFF)).count() as u64;
    soaked.flash_words = (written, (SETTINGS.end - SETTINGS.start) / 32);
    Ok(soaked)
}

fn now_s(endpoint: &Endpoint) -> f64 {
    endpoint.now_ns() as f64 * 1e-9
}

/// Some commands, an experiment, and a look at everything that was counted since the last time, when the rig's health was
/// `before`; gives its health now.
fn round(
    endpoint: &mut Endpoint,
    chance: &mut Chance,
    before: &Health,
    soaked: &mut Soaked,
) -> Result<Health, BenchError> {
    let mut client = Client::new();
    let mut commands = vec![Command::Hello, Command::Tare, Command::CaptureArm(CaptureTrigger::Start)];
    if chance.below(4) == 0 {
        commands.push(Command::SettingSet { key: KEY, value: 20.0 + chance.below(40) as f32 * 0.25 });
    }
    if chance.below(16) == 0 {
        commands.push(Command::ModelSet(ModelRecord::default()));
    }
    let mut ask = Ask::new(commands);
    perform(endpoint, &mut client, &mut ask, |_, _, _| Ok(()))?;
    // The tare takes half a second.
    endpoint.wait_until(endpoint.now_ns() + 600_000_000)?;

    let request = Request::assumed("fig20")?;
    let text = experiment(chance);
    let file = ExperimentFile::parse("soak.toml", &text)?;
    let options = RunOptions::default();
    let mut switch = ArmSwitch::default();
    let mut procedure = RunExperiment::new(file.for_core(&request.rig)?, options);
    let run = perform(endpoint, &mut client, &mut procedure, |endpoint, _, procedure| {
        if procedure.wants_arm_switch() { switch.turn(endpoint) } else { Ok(()) }
    })?;
    soaked.experiments += 1;
    soaked.rows += run.rows.len() as u64;
    let health = run.health.unwrap_or_default();
    if health.tick < soaked.ticks {
        soaked.problems.push("its ticks went back".to_owned());
    }
    soaked.ticks = health.tick;
    let expected = u64::from(file.for_core(&request.rig)?.duration_ticks) / u64::from(options.every_ticks);
    let counts = [
        (rows::missing(&run.rows), "rows are missing"),
        (expected.saturating_sub(run.rows.len() as u64), "rows of the experiment did not come"),
        (gained(before.telemetry_lost, health.telemetry_lost), "rows found no room"),
        (gained(before.events_lost, health.events_lost), "events found no room"),
        (u64::from(run.frames_rejected), "frames came in damaged"),
        (gained(before.frames_rejected, health.frames_rejected), "frames were thrown away by the rig"),
        (gained(before.line_errors, health.line_errors), "errors on the line"),
        (gained(before.deadline_misses, health.deadline_misses), "ticks ended late"),
        (gained(before.missed_scans, health.missed_scans), "scans were missed"),
    ];
    let at = format!("at {:.0} s", now_s(endpoint));
    for (count, what) in counts.into_iter().filter(|(count, _)| *count > 0) {
        soaked.problems.push(format!("{at}: {count} {what}"));
    }
    if let Some(fault) = run.fault_words() {
        soaked.problems.push(format!("{at}: {fault}, in {text}"));
    }
    angle(endpoint, &mut client, soaked)?;
    Ok(health)
}

/// What one of the rig's counters, which only grow, gained.
fn gained(before: u32, now: u32) -> u64 {
    u64::from(now.wrapping_sub(before))
}

/// The disc at rest against the rig's count.
fn angle(endpoint: &mut Endpoint, client: &mut Client, soaked: &mut Soaked) -> Result<(), BenchError> {
    endpoint.wait_until(endpoint.now_ns() + 200_000_000)?;
    let mut ask = Ask::new(vec![Command::Telemetry { every_ticks: 10 }]);
    let answers = perform(endpoint, client, &mut ask, |_, _, _| Ok(()))?;
    if !matches!(answers.as_slice(), [Answer::Done]) {
        soaked.problems.push(format!("it does not send telemetry: {answers:?}"));
    }
    let mut row = None;
    while row.is_none() {
        let bytes = endpoint.receive(endpoint.now_ns() + 1_000_000)?;
        client.receive(&bytes);
        while let Some(message) = client.next_message() {
            if let rig_link::message::Message::Telemetry(telemetry) = message {
                row = Some(telemetry);
            }
        }
    }
    let truth = endpoint.motion()?.disc_angle_rad * COUNTS_PER_REV / std::f64::consts::TAU;
    let off = row.map_or(0.0, |row| (row.m2_count as f64 - truth).abs());
    soaked.angle_counts = soaked.angle_counts.max(off);
    if off > MOST_COUNTS {
        soaked
            .problems
            .push(format!("at {:.0} s: the count is {off:.0} off the disc's angle", now_s(endpoint)));
    }
    perform(endpoint, client, &mut Ask::new(vec![Command::Telemetry { every_ticks: 0 }]), |_, _, _| Ok(()))?;
    Ok(())
}

/// An experiment of one to three seconds within what the rig can do.
fn experiment(chance: &mut Chance) -> String {
    let mut tenths = || chance.below(10) as f64 * 0.1;
    let load = 0.055 + 0.4 * tenths();
    let (first, second) = (0.2 + 0.3 * tenths(), 0.8 + 0.5 * tenths());
    let duration = second + 0.5 + tenths();
    let (slow, fast) = (60.0 * tenths() - 30.0, 200.0 * tenths() - 100.0);
    format!(
        "name = \"soak\"\ntitle = \"Soak\"\nduration_s = {duration:.1}\nseed = 1\nlog_rate_hz = 1000\n\
         [[m1]]\nstart_s = 0.0\ntorque_fraction = 0.055\n[[m1]]\nstart_s = {second:.2}\ntorque_fraction = {load:.3}\n\
         [[m2]]\nstart_s = 0.0\nspeed_rpm = 0.0\n[[m2]]\nstart_s = {first:.2}\nspeed_rpm = {slow:.1}\n\
         [[m2]]\nstart_s = {second:.2}\nspeed_rpm = {fast:.1}\n"
    )
}

/// Numbers without order (splitmix64).
#[derive(Debug)]
pub(crate) struct Chance(pub(crate) u64);

impl Chance {
    /// One below `end`.
    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut word = self.0;
        word = (word ^ word >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        word = (word ^ word >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        (word ^ word >> 31) % end.max(1)
    }
}
