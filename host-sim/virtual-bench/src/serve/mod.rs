//! The bench as a board: the ELF runs in real time with the plant behind it, its USART is a pseudo-terminal, its log
//! goes to stdout, and the keyboard is what a person would touch at the rig.

pub mod keys;
pub mod miswired;
pub mod pace;
pub mod port;
pub mod traffic;

use crate::bench;
use crate::defmt_log::{self, DefmtLog};
use crate::elf::Firmware;
use crate::endpoint::Endpoint;
use crate::endpoint_link::perform;
use crate::error::BenchError;
use crate::experiment::{boot, preparation};
use crate::outside::{Action, Hand};
use crate::plant_side::HostPlant;
use defmt_decoder::{StreamDecoder, Table};
use host_sim::cli::common::say;
use host_sim::commission::{FRICTION_LOADS_NM, NORMAL_LOADS_N};
use host_sim::files::experiment_file::PlantOptions;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::link::ask::Ask;
use host_sim::link::client::Client;
use host_sim::link::words;
use host_sim::plant::PlantParameters;
use keys::{HELP, Key, Keyboard};
use miswired::{Mistake, OPEN_MICROVOLT};
use pace::{Pace, Speed};
use port::Pty;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use traffic::Traffic;

/// The bench looks at port, keys and clock so often, ns of its own time.
const LOOK_NS: u64 = 1_000_000;
/// How long the arm switch stays off before a willing person turns it on again.
const SWITCH_NS: u64 = 20_000_000;
/// How long a host is waited for that does not read, and how often it is looked at.
const HOST_PATIENCE: Duration = Duration::from_secs(3);
const HOST_LOOK: Duration = Duration::from_millis(1);
/// What a hand on M1's shaft gives: 22 N at the contact of the assumed rig.
const PRESS_NM: f64 = 1.0;

/// What is served.
#[derive(Debug)]
pub struct Served {
    /// The rig the plant is built from; the firmware gets what of it differs from its defaults as settings.
    pub rig: RigFile,
    /// The elements on the disc.
    pub model: ModelFile,
    /// The observer's model.
    pub observer: ModelFile,
    /// Seed of the sensors' noise.
    pub seed: u64,
    /// How fast.
    pub speed: Speed,
    /// A fixed name for the port.
    pub link: Option<PathBuf>,
    /// Turn the arm switch off and on whenever the rig asks for it.
    pub arm_when_asked: bool,
    /// What is wired wrongly.
    pub mistakes: Vec<Mistake>,
    /// Lose every so many-th row of telemetry, 0 for none.
    pub lose_every: u32,
    /// End by itself after so many seconds of the bench's time.
    pub for_s: Option<f64>,
}

/// Serves until it is told to end.
///
/// # Errors
/// The port cannot be opened, the firmware does not come up, or the emulator fails.
pub fn serve(firmware: &Firmware, served: &Served) -> Result<(), BenchError> {
    let parameters = PlantParameters::from_files(&served.rig, &served.model, &PlantOptions::default());
    let plant = HostPlant::new(&parameters, served.seed)?;
    let table = defmt_log::table(&firmware.bytes)?;
    let ended = Arc::new(AtomicBool::new(false));
    let by_signal = Arc::clone(&ended);
    ctrlc::set_handler(move || by_signal.store(true, Ordering::Relaxed))
        .map_err(|error| BenchError::Port(format!("signals cannot be caught: {error}")))?;
    let mut pty = Pty::open()?;
    bench::run(firmware, Box::new(plant), |endpoint| {
        served.mistakes.iter().try_for_each(|mistake| endpoint.act(mistake.action()))?;
        boot(endpoint)?;
        let wanted = preparation(&served.rig, &served.observer, false)?;
        if !wanted.is_empty() {
            let answers = perform(endpoint, &mut Client::new(), &mut Ask::new(wanted), |_, _, _| Ok(()))?;
            answers.iter().try_for_each(words::accepted)?;
        }
        // Only now: a host that finds the link finds a rig that answers.
        if let Some(link) = &served.link {
            pty.link_to(link)?;
        }
        say(&format!("port: {}", pty.path().display()));
        Service::new(served, pty, &table, endpoint.now_ns()).run(endpoint, &ended)
    })?;
    Ok(())
}

/// The operator at the endpoint.
struct Service<'a> {
    served: &'a Served,
    pty: Pty,
    keyboard: Keyboard,
    traffic: Traffic,
    table: &'a Table,
    decoder: Box<dyn StreamDecoder + Send + Sync + 'a>,
    begun: Instant,
    pace: Pace,
    outside: Switches,
    /// When a willing person turns the arm switch on again.
    arm_on_at: Option<u64>,
    lost_reported: u64,
    /// It did not read for longer than it is waited for.
    host_hangs: bool,
}

/// How the person left what can be touched.
#[derive(Debug, Clone, Copy, Default)]
struct Switches {
    armed: bool,
    stop_pressed: bool,
    drive_fault: [bool; 2],
    bridge_pulled: [bool; 2],
    pressing: bool,
    /// How many of the weights hang there: none, the first, …
    friction_weight: usize,
    normal_weight: usize,
    unplugged: bool,
    unpowered: bool,
}

impl<'a> Service<'a> {
    fn new(served: &'a Served, pty: Pty, table: &'a Table, now_ns: u64) -> Self {
        Self {
            served,
            pty,
            keyboard: Keyboard::listen(),
            traffic: Traffic::new(served.lose_every),
            table,
            decoder: table.new_stream_decoder(),
            begun: Instant::now(),
            pace: Pace::new(served.speed, Duration::ZERO, now_ns),
            outside: Switches::default(),
            arm_on_at: None,
            lost_reported: 0,
            host_hangs: false,
        }
    }

    fn run(mut self, endpoint: &mut Endpoint, ended: &AtomicBool) -> Result<(), BenchError> {
        eprintln!("virtual-bench: {HELP}");
        let until =
            self.served.for_s.map(|s| endpoint.now_ns() + Duration::from_secs_f64(s).as_nanos() as u64);
        while !ended.load(Ordering::Relaxed) && until.is_none_or(|until| endpoint.now_ns() < until) {
            self.serve_port(endpoint)?;
            self.print_log(endpoint)?;
            while let Some(key) = self.keyboard.pressed() {
                if key == Key::Quit {
                    ended.store(true, Ordering::Relaxed);
                }
                self.touch(key, endpoint)?;
            }
            self.turn_switch(endpoint)?;
            self.keep_pace(endpoint);
        }
        self.print_log(endpoint)?;
        if self.served.lose_every > 0 {
            eprintln!("virtual-bench: {} rows of telemetry were lost on purpose", self.traffic.rows_lost());
        }
        Ok(())
    }

    /// Bytes in both directions, and a step of the bench's time.
    fn serve_port(&mut self, endpoint: &mut Endpoint) -> Result<(), BenchError> {
        match self.pty.look() {
            Some(true) => eprintln!("virtual-bench: a host has opened the port"),
            Some(false) => eprintln!("virtual-bench: the host has closed the port"),
            None => {}
        }
        let from_host = self.pty.receive();
        if !from_host.is_empty() && !self.outside.unplugged {
            endpoint.send(&from_host)?;
        }
        let from_chip = endpoint.receive(endpoint.now_ns() + LOOK_NS)?;
        let through = self.traffic.pass(&from_chip);
        if !self.outside.unplugged {
            self.pty.send(&through);
        }
        Ok(())
    }

    fn print_log(&mut self, endpoint: &mut Endpoint) -> Result<(), BenchError> {
        for (start, bytes) in endpoint.take_log()?.iter().enumerate() {
            if start > 0 {
                self.decoder = self.table.new_stream_decoder();
            }
            if bytes.is_empty() {
                continue;
            }
            let mut log = DefmtLog::default();
            self.decoder.received(bytes);
            defmt_log::decode_into(self.table, self.decoder.as_mut(), &mut log);
            log.lines.iter().for_each(|line| say(line));
        }
        Ok(())
    }

    fn touch(&mut self, key: Key, endpoint: &mut Endpoint) -> Result<(), BenchError> {
        let x = &mut self.outside;
        let tell = |what: &str| eprintln!("virtual-bench: {what}");
        match key {
            Key::ArmSwitch => {
                x.armed = !x.armed;
                self.arm_on_at = None;
                tell(if x.armed { "arm switch on" } else { "arm switch off" });
                endpoint.act(Action::ArmSwitch(x.armed))
            }
            Key::EmergencyStop => {
                x.stop_pressed = !x.stop_pressed;
                tell(if x.stop_pressed { "emergency stop pressed" } else { "emergency stop released" });
                endpoint.act(Action::EmergencyStop(x.stop_pressed))
            }
            Key::DriveFault(motor) => {
                let fault = &mut x.drive_fault[motor as usize];
                *fault = !*fault;
                tell(&format!(
                    "the drive of {motor:?} {}",
                    if *fault { "reports a fault" } else { "is healthy" }
                ));
                endpoint.act(Action::DriveHealthy(motor, !*fault))
            }
            Key::BridgePlug(bridge) => {
                let pulled = &mut x.bridge_pulled[bridge];
                *pulled = !*pulled;
                let name = ["friction", "normal force"][bridge];
                tell(&format!("{name} bridge {}", if *pulled { "unplugged" } else { "plugged in" }));
                endpoint.act(Action::AnalogueInput(bridge, pulled.then_some(OPEN_MICROVOLT)))
            }
            Key::TurnDisc => {
                tell("a hand turns the disc one turn forward, in two seconds");
                endpoint.act(Action::Hand(Hand::TurnDisc(1.0)))
            }
            Key::PressM1 => {
                x.pressing = !x.pressing;
                tell(if x.pressing { "a hand presses M1" } else { "the hand lets M1 go" });
                endpoint.act(Action::Hand(Hand::PressM1(if x.pressing { PRESS_NM } else { 0.0 })))
            }
            Key::FrictionWeight => {
                let load = next(&mut x.friction_weight, &FRICTION_LOADS_NM);
                tell(&format!("on the torque ring: {load} N m"));
                endpoint.act(Action::Hand(Hand::LoadFriction(load)))
            }
            Key::NormalWeight => {
                let load = next(&mut x.normal_weight, &NORMAL_LOADS_N);
                tell(&format!("on the frame: {load} N"));
                endpoint.act(Action::Hand(Hand::LoadNormal(load)))
            }
            Key::Link => {
                x.unplugged = !x.unplugged;
                tell(if x.unplugged { "link unplugged" } else { "link plugged in" });
                endpoint.act(Action::LinkSilent(x.unplugged))
            }
            Key::Reset => {
                tell("reset");
                endpoint.act(Action::ResetPin)
            }
            Key::Power => {
                x.unpowered = !x.unpowered;
                tell(if x.unpowered { "power off" } else { "power on" });
                endpoint.act(Action::Power(!x.unpowered))
            }
            Key::Help => {
                tell(HELP);
                Ok(())
            }
            Key::Quit => Ok(()),
        }
    }

    /// The willing person: off when the rig asks, on a moment later.
    fn turn_switch(&mut self, endpoint: &mut Endpoint) -> Result<(), BenchError> {
        if self.traffic.asked_for_switch() && self.served.arm_when_asked && self.arm_on_at.is_none() {
            self.arm_on_at = Some(endpoint.now_ns() + SWITCH_NS);
            self.outside.armed = false;
            endpoint.act(Action::ArmSwitch(false))?;
        }
        if self.arm_on_at.is_some_and(|at| endpoint.now_ns() >= at) {
            self.arm_on_at = None;
            self.outside.armed = true;
            eprintln!("virtual-bench: arm switch off and on, as asked");
            endpoint.act(Action::ArmSwitch(true))?;
        }
        Ok(())
    }

    /// At the highest speed the bench waits for its host: a program that the computer keeps waiting for the processor is
    /// no host that is gone, and the rig's own time limit would take it for one. One that does not read for
    /// [`HOST_PATIENCE`] is waited for no more, until it has read all again.
    fn wait_for_host(&mut self) {
        if self.served.speed != Speed::Max {
            return;
        }
        let begun = Instant::now();
        while self.pty.is_behind() {
            self.host_hangs |= begun.elapsed() > HOST_PATIENCE;
            if self.host_hangs {
                return;
            }
            std::thread::sleep(HOST_LOOK);
            self.pty.send(&[]);
        }
        self.host_hangs = false;
    }

    fn keep_pace(&mut self, endpoint: &Endpoint) {
        self.wait_for_host();
        let sleep = self.pace.sleep(self.begun.elapsed(), endpoint.now_ns());
        if !sleep.is_zero() {
            std::thread::sleep(sleep);
        }
        if let Some(behind) = self.pace.report(self.begun.elapsed()) {
            eprintln!("virtual-bench: {}", behind.sentence());
        }
        let lost = self.pty.lost_bytes();
        if lost > self.lost_reported + (1 << 20) || (lost > 0 && self.lost_reported == 0) {
            self.lost_reported = lost;
            eprintln!("virtual-bench: the host does not read: {lost} bytes lost so far");
        }
    }
}

/// The next of the weights, or none after the last.
fn next(hangs: &mut usize, weights: &[f64]) -> f64 {
    *hangs = (*hangs + 1) % (weights.len() + 1);
    hangs.checked_sub(1).and_then(|weight| weights.get(weight)).copied().unwrap_or_default()
}
