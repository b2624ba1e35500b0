//! The rig during commissioning: one request after the other, telemetry in between, a person at hand.
//!
//! Durations are counted in the rig's own ticks. The clock of this computer decides only how long to wait for an
//! answer or for a person.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use model_core::control::{
    ControlSettings, Experiment, Fault, M1Mode, M2Mode, Mode, Refusal, Segment, Shape,
};
use rig_link::inputs::{CHANNELS, Inputs};
use rig_link::message::{Answer, Command, EventKind, EventMessage, Message};
use rig_link::program;
use rig_link::settings::{ALL, SettingState, by_name};
use rig_link::telemetry::{Health, TelemetryRow};

use super::Stop;
use crate::input_error::{InputError, Kind};
use crate::link::client::Client;
use crate::link::procedure::{KeepAlive, Transport, patience};
use crate::link::words;

/// Distance of two rows in ticks: 200 rows a second.
const EVERY_TICKS: u16 = 50;
/// Without a row for so long the rig is lost.
const SILENCE: Duration = Duration::from_secs(5);
/// Time between two looks while a person does something.
const LOOK: Duration = Duration::from_millis(50);
/// Longest time for the disc to coast to rest, s.
const COAST_S: f64 = 20.0;

/// Who does what is to be done by hand.
pub trait Person {
    /// Shows a line.
    fn say(&mut self, line: &str);
    /// Asks for something to be done.
    fn ask_to(&mut self, what: &str);
    /// Shows a line that the next one replaces.
    fn live(&mut self, line: &str);
    /// Whether Enter was pressed since the last call.
    fn entered(&mut self) -> bool;
    /// Whether everything is to end.
    fn gives_up(&mut self) -> bool;
}

/// The rig and the person.
pub struct Rig<'a> {
    transport: &'a mut dyn Transport,
    person: &'a mut dyn Person,
    client: Client,
    begun: Instant,
    patience: Duration,
    keep_alive: Option<KeepAlive>,
    answers: Vec<(u16, Answer)>,
    /// The settings in force.
    pub settings: ControlSettings,
    stored: BTreeMap<u16, SettingState>,
    changed: Vec<u16>,
    /// Rows since the last [`Rig::begin_rows`].
    pub rows: Vec<TelemetryRow>,
    /// The last row.
    pub row: TelemetryRow,
    heard: Instant,
    /// The tick of the last row before the last answer: what was asked last had come to the rig by then, by its own clock.
    pub answered_tick: u64,
    /// The last health record.
    pub health: Health,
    /// Events since the last [`Rig::begin_rows`].
    pub events: Vec<EventMessage>,
}

/// Means over some readings.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Readings {
    /// Mean code of each channel.
    pub code: [f64; 5],
    /// Its standard deviation from reading to reading.
    pub deviation: [f64; 5],
    /// Mean codes of the torque references.
    pub dac: [f64; 2],
    /// How many.
    pub count: usize,
}

impl<'a> Rig<'a> {
    /// A rig at the other end of a link.
    pub fn new(transport: &'a mut dyn Transport, person: &'a mut dyn Person, patience_s: f64) -> Self {
        Self {
            transport,
            person,
            client: Client::new(),
            begun: Instant::now(),
            patience: Duration::from_secs_f64(patience_s),
            keep_alive: None,
            answers: Vec::new(),
            settings: ControlSettings::default(),
            stored: BTreeMap::new(),
            changed: Vec::new(),
            rows: Vec::new(),
            row: TelemetryRow::default(),
            heard: Instant::now(),
            answered_tick: 0,
            health: Health::default(),
            events: Vec::new(),
        }
    }

    /// Shows the person a line.
    pub fn say(&mut self, line: &str) {
        self.person.say(line);
    }

    /// What goes over the line now, in both directions.
    fn pump(&mut self) -> Result<(), InputError> {
        if self.person.gives_up() {
            return Err(InputError::new("ended by the user before its end").of_kind(Kind::Run));
        }
        self.exchange()
    }

    fn exchange(&mut self) -> Result<(), InputError> {
        let gone = |doing: &str, name: String, error: &std::io::Error| {
            InputError::new(format!("the port is gone: cannot {doing}: {error}"))
                .file(name)
                .of_kind(Kind::Rig)
        };
        if let Some(keep_alive) = &mut self.keep_alive {
            keep_alive.step(self.begun.elapsed().as_secs_f64(), &mut self.client);
        }
        let outgoing = self.client.take_outgoing();
        if !outgoing.is_empty() {
            self.transport.send(&outgoing).map_err(|e| gone("write", self.transport.name(), &e))?;
        }
        let mut bytes = Vec::new();
        self.transport.receive(&mut bytes).map_err(|e| gone("read", self.transport.name(), &e))?;
        self.client.receive(&bytes);
        while let Some(message) = self.client.next_message() {
            match message {
                Message::Answer { id, answer } => {
                    self.answered_tick = self.row.tick;
                    self.answers.push((id, answer));
                }
                Message::Telemetry(row) => {
                    (self.row, self.heard) = (row, Instant::now());
                    self.rows.push(row);
                }
                Message::Health(health) => self.health = health,
                Message::Event(event) => self.events.push(event),
            }
        }
        Ok(())
    }

    /// Asks one thing.
    pub fn ask(&mut self, command: Command) -> Result<Answer, InputError> {
        // A person waits anyway, and a served bench may be slow.
        let (wait, name) = (2 * patience(&command), words::command(&command));
        let id = self.client.request(command);
        let asked = Instant::now();
        loop {
            self.pump()?;
            let at = self.answers.iter().position(|(answered, _)| *answered == id);
            if let Some(at) = at {
                let (_, answer) = self.answers.swap_remove(at);
                self.answers.clear();
                return Ok(answer);
            }
            if asked.elapsed() > wait {
                let error = InputError::new(format!("no answer to {name}")).file(self.transport.name());
                return Err(error.of_kind(Kind::Rig));
            }
        }
    }

    /// Asks one thing that must not be refused.
    pub fn order(&mut self, command: Command) -> Result<(), InputError> {
        words::accepted(&self.ask(command)?)
    }

    /// Switches telemetry on and reads all settings.
    pub(super) fn open(&mut self) -> Result<(), InputError> {
        self.order(Command::Telemetry { every_ticks: EVERY_TICKS })?;
        for info in ALL {
            match self.ask(Command::SettingGet { key: info.key })? {
                Answer::Setting(state) => {
                    // What the rig has in force fits its own field.
                    let _ = info.set(&mut self.settings, state.active);
                    self.stored.insert(state.key, state);
                }
                other => return Err(words::unexpected(&other)),
            }
        }
        self.wait(0.15)
    }

    /// All settings in force, by name.
    #[must_use]
    pub fn settings_by_name(&self) -> BTreeMap<&'static str, f32> {
        ALL.iter().map(|info| (info.name, info.get(&self.settings))).collect()
    }

    /// Raw readings of one tick.
    pub fn inputs(&mut self) -> Result<Inputs, InputError> {
        match self.ask(Command::Inputs)? {
            Answer::Inputs(inputs) => Ok(inputs),
            other => Err(words::unexpected(&other)),
        }
    }

    /// Means over the readings of so many seconds of the rig's time.
    pub fn readings(&mut self, time_s: f64) -> Result<Readings, InputError> {
        let first = self.inputs()?;
        let mut all = vec![first];
        while all.len() < 8 || seconds(all[all.len() - 1].tick - first.tick) < time_s {
            all.push(self.inputs()?);
        }
        Ok(Readings::of(&all))
    }

    /// Waits for so many seconds of the rig's time.
    pub fn wait(&mut self, time_s: f64) -> Result<(), InputError> {
        let from = self.row.tick;
        self.heard = Instant::now();
        while seconds(self.row.tick.saturating_sub(from)) < time_s || from == 0 && self.row.tick == 0 {
            self.pump()?;
            self.check_silence()?;
        }
        Ok(())
    }

    fn check_silence(&self) -> Result<(), InputError> {
        if self.heard.elapsed() < SILENCE {
            return Ok(());
        }
        Err(InputError::new("the rig has gone silent").file(self.transport.name()).of_kind(Kind::Rig))
    }

    /// From now on rows and events are kept.
    pub fn begin_rows(&mut self) {
        self.rows.clear();
        self.events.clear();
    }

    /// Asks the person for something and waits until it is seen; says whether it was. Enter tells that it was done,
    /// so that nobody waits for what will not come.
    pub fn until(
        &mut self,
        what: &str,
        mut seen: impl FnMut(&Inputs, &Self) -> bool,
    ) -> Result<bool, InputError> {
        let _ = self.person.entered();
        self.person.ask_to(what);
        let begun = Instant::now();
        let mut last_look = false;
        loop {
            let inputs = self.inputs()?;
            if seen(&inputs, self) {
                return Ok(true);
            }
            if last_look || begun.elapsed() > self.patience {
                return Ok(false);
            }
            let line = self.live_line(&inputs);
            self.person.live(&line);
            let looked = Instant::now();
            while looked.elapsed() < LOOK {
                self.pump()?;
            }
            last_look = self.person.entered();
        }
    }

    /// Asks the person for something that only they can tell is done.
    pub fn entered(&mut self, what: &str) -> Result<bool, InputError> {
        let _ = self.person.entered();
        self.person.ask_to(&format!("{what}, then press Enter"));
        let begun = Instant::now();
        while begun.elapsed() < self.patience {
            let inputs = self.inputs()?;
            let line = self.live_line(&inputs);
            self.person.live(&line);
            let looked = Instant::now();
            while looked.elapsed() < LOOK {
                self.pump()?;
            }
            if self.person.entered() {
                return Ok(true);
            }
        }
        Ok(false)
    }

    /// What the rig reads now, in a line.
    fn live_line(&self, inputs: &Inputs) -> String {
        let on = |is: bool, yes: &'static str, no: &'static str| if is { yes } else { no };
        let codes: Vec<String> = inputs.codes.iter().map(|code| format!("{code:5}")).collect();
        format!(
            "{:4.1} V  stop {}  arm {}  drives {} {}  codes {}  M1 {:8} M2 {:9} counts",
            f64::from(inputs.codes[4]) * f64::from(self.settings.supply.volt_per_code),
            on(inputs.emergency_stop, "pressed ", "released"),
            on(inputs.arm_switch, "on ", "off"),
            on(inputs.drive_fault[0], "fault", "ok"),
            on(inputs.drive_fault[1], "fault", "ok"),
            codes.join(" "),
            self.row.m1_count,
            self.row.m2_count,
        )
    }

    /// The mode by the last row.
    #[must_use]
    pub fn mode(&self) -> Option<Mode> {
        Mode::from_number(self.row.mode)
    }

    /// The fault that is latched, in words.
    #[must_use]
    pub fn fault(&self) -> Option<String> {
        (self.row.fault != 0).then(|| sentence(self.row.fault))
    }

    /// Whether the cause of a fault is there now.
    #[must_use]
    pub fn has_cause(&self, fault: Fault) -> bool {
        self.health.causes & (1 << fault.number()) != 0
    }

    /// Enables the drives; a person turns the arm switch. Without success, why.
    pub fn arm(&mut self) -> Result<Option<String>, InputError> {
        let waits = [Refusal::ArmSwitchOff, Refusal::ArmSwitchNotReleased, Refusal::Starting];
        let begun = Instant::now();
        let mut asked = false;
        loop {
            match self.ask(Command::Arm)? {
                Answer::Done => break,
                Answer::Refused { reason, .. } if waits.iter().any(|wait| wait.number() == reason) => {
                    if !std::mem::replace(&mut asked, true) {
                        self.person.ask_to("keep clear of the rig, and turn its arm switch off and on");
                    }
                    if begun.elapsed() > self.patience {
                        return Ok(Some("the arm switch was not turned off and on".into()));
                    }
                    let looked = Instant::now();
                    while looked.elapsed() < 4 * LOOK {
                        self.pump()?;
                    }
                }
                other => return Ok(Some(words::unexpected(&other).to_string())),
            }
        }
        self.keep_alive = Some(KeepAlive::default());
        self.wait(0.02)?;
        Ok(match self.mode() {
            Some(Mode::Armed) => None,
            _ => Some(self.fault().unwrap_or_else(|| "the rig did not stay armed".into())),
        })
    }

    /// Loads and starts an experiment of one value for each motor.
    pub fn start(&mut self, m1_torque_nm: f32, m2_mode: M2Mode, m2: f32) -> Result<(), InputError> {
        /// Longer than any step takes: it ends by a command.
        const TICKS: u32 = 600_000;
        let mut experiment = Experiment { duration_ticks: TICKS, ..Experiment::default() };
        let shape = |value: f32| Shape::Constant { value };
        // Both lists are empty, so there is room.
        let _ =
            experiment.m1.push(Segment { start_tick: 0, mode: M1Mode::Torque, shape: shape(m1_torque_nm) });
        let _ = experiment.m2.push(Segment { start_tick: 0, mode: m2_mode, shape: shape(m2) });
        self.order(Command::ProgramBegin(program::header(&experiment)))?;
        for segment in program::segments(&experiment) {
            self.order(Command::ProgramSegment(segment))?;
        }
        self.order(Command::ProgramCommit)?;
        self.order(Command::Start)
    }

    /// Drives off, and the disc at rest.
    pub fn disarm(&mut self) -> Result<(), InputError> {
        self.keep_alive = None;
        self.order(Command::Disarm)?;
        let from = self.row.tick;
        loop {
            self.wait(0.05)?;
            let rest =
                f64::from(self.row.m2_speed_rad_s).abs() < f64::from(self.settings.timing.rest_speed_rad_s);
            if rest || seconds(self.row.tick - from) > COAST_S {
                return Ok(());
            }
        }
    }

    /// Stops to be the host that keeps the drives on.
    pub fn fall_silent(&mut self) {
        self.keep_alive = None;
    }

    /// Waits until the rig has a fault, for so many seconds of its time.
    pub fn wait_for_fault(&mut self, time_s: f64) -> Result<Option<Fault>, InputError> {
        let from = self.row.tick;
        while self.row.fault == 0 && seconds(self.row.tick - from) < time_s {
            self.wait(0.005)?;
        }
        Ok(Fault::from_number(self.row.fault))
    }

    /// The tick at which a fault was latched, where that was told since the last [`Rig::begin_rows`].
    #[must_use]
    pub fn latched_tick(&self, fault: Fault) -> Option<u64> {
        let latched = EventKind::FaultLatched(fault.number());
        self.events.iter().find(|event| event.kind == latched).map(|event| event.tick)
    }

    /// Clears what is latched, once its cause is gone.
    pub fn clear_fault(&mut self) -> Result<(), InputError> {
        self.keep_alive = None;
        self.wait(0.2)?;
        if self.row.fault != 0 {
            self.order(Command::ClearFault)?;
            self.wait(0.05)?;
        }
        Ok(())
    }

    /// Changes a setting for the length of a check.
    pub fn change(&mut self, name: &str, value: f32) -> Result<(), InputError> {
        let info = by_name(name).ok_or_else(|| InputError::new("is no setting").key(name))?;
        self.changed.push(info.key);
        match self.ask(Command::SettingSet { key: info.key, value })? {
            Answer::Setting(_) => Ok(()),
            other => Err(words::unexpected(&other)),
        }
    }

    /// Stores a setting for good.
    pub fn store(&mut self, name: &str, value: f32) -> Result<(), InputError> {
        let info = by_name(name).ok_or_else(|| InputError::new("is no setting").key(name))?;
        match self.ask(Command::SettingSet { key: info.key, value })? {
            Answer::Setting(state) => {
                // It was accepted, so it fits.
                let _ = info.set(&mut self.settings, state.active);
                self.stored.insert(state.key, state);
                Ok(())
            }
            other => Err(words::unexpected(&other)),
        }
    }

    /// Puts changed settings back, the last one first.
    pub fn restore(&mut self) -> Result<(), InputError> {
        while let Some(key) = self.changed.pop() {
            let command = match self.stored.get(&key).and_then(|state| state.stored) {
                Some(value) => Command::SettingSet { key, value },
                None => Command::SettingForget { key },
            };
            words::accepted(&self.ask(command)?)?;
        }
        Ok(())
    }

    /// Leaves the rig with its drives off and its settings as they were, as far as it can be reached, also where the
    /// person gave up.
    pub(super) fn leave(&mut self) {
        self.keep_alive = None;
        let mut last = vec![Command::Disarm];
        for key in std::mem::take(&mut self.changed).into_iter().rev() {
            last.push(match self.stored.get(&key).and_then(|state| state.stored) {
                Some(value) => Command::SettingSet { key, value },
                None => Command::SettingForget { key },
            });
        }
        last.push(Command::Telemetry { every_ticks: 0 });
        for command in last {
            let wait = patience(&command);
            let id = self.client.request(command);
            let asked = Instant::now();
            // A rig that cannot be reached stops by itself.
            while asked.elapsed() < wait && self.exchange().is_ok() {
                if self.answers.iter().any(|(answered, _)| *answered == id) {
                    break;
                }
            }
        }
    }
}

impl Readings {
    #[allow(clippy::cast_precision_loss)]
    fn of(all: &[Inputs]) -> Self {
        let count = all.len().max(1) as f64;
        let mean = |value: &dyn Fn(&Inputs) -> f64| all.iter().map(value).sum::<f64>() / count;
        let code: [f64; 5] = std::array::from_fn(|k| mean(&|inputs| f64::from(inputs.codes[k])));
        let deviation =
            std::array::from_fn(|k| mean(&|inputs| (f64::from(inputs.codes[k]) - code[k]).powi(2)).sqrt());
        let dac = std::array::from_fn(|k| mean(&|inputs| f64::from(inputs.dac[k])));
        Self { code, deviation, dac, count: all.len() }
    }

    /// Mean of a channel by its name in the order of [`CHANNELS`].
    pub fn named(&self) -> impl Iterator<Item = (&'static str, f64, f64)> {
        CHANNELS.into_iter().zip(self.code).zip(self.deviation).map(|((name, code), std)| (name, code, std))
    }
}

/// A fault in words, to go on behind.
pub(super) fn sentence(fault: u8) -> String {
    words::fault(fault).trim_end_matches('.').to_owned()
}

/// Ticks in seconds. The rate is fixed by the board.
#[allow(clippy::cast_precision_loss)]
pub(super) fn seconds(ticks: u64) -> f64 {
    ticks as f64 * 1e-4
}

impl Rig<'_> {
    /// Arms, or puts on record why not.
    pub(super) fn armed_or(why: Option<String>) -> Result<(), String> {
        why.map_or(Ok(()), Err)
    }
}

impl super::Commissioning<'_, '_> {
    /// Arms, or ends the step.
    pub(super) fn arm(&mut self, advice: &str) -> Result<(), Stop> {
        self.rig.begin_rows();
        if let Err(why) = Rig::armed_or(self.rig.arm()?) {
            let advice = self.advice_or_silence(advice);
            self.check("arms", why, "armed, without a fault", false, advice);
        }
        self.settle()
    }
}
