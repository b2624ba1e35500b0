//! An experiment on the rig: greet, upload, arm, run, record, disarm.
//!
//! The rig arms only with its arm switch turned on by a person after the last disarming, so the procedure
//! says so and tries again until it is. It ends when the rig is at rest again, or with a fault: what was
//! recorded until then is kept. From the first try to arm until the drives are off it sends the signs of life without
//! which the rig stops by itself.

use model_core::control::{Experiment, Fault, Mode, Refusal, SequencerState};
use rig_link::message::{Answer, Command, EventKind, EventMessage, Hello, Message};
use rig_link::program;
use rig_link::telemetry::{Health, TelemetryRow};

use super::ask::{Ask, check_hello};
use super::client::Client;
use super::procedure::{KeepAlive, Procedure};
use super::rows::Scale;
use super::words;
use crate::input_error::{InputError, Kind};

/// Time between two tries to arm.
const ARM_AGAIN_S: f64 = 0.2;
/// Without a row for this long the rig counts as gone.
const SILENCE_S: f64 = 2.0;
/// Longest time from the end of an experiment to rest.
const REST_S: f64 = 15.0;
const M1_COUNTS_KEY: u16 = 160;
const M2_COUNTS_KEY: u16 = 170;

/// What a run left.
#[derive(Debug, Clone, PartialEq)]
pub struct RunRecord {
    /// Who ran it.
    pub hello: Hello,
    /// How its counts and ticks are to be read.
    pub scale: Scale,
    /// Rows while the experiment ran.
    pub rows: Vec<TelemetryRow>,
    /// What happened, from the greeting on.
    pub events: Vec<EventMessage>,
    /// The last health record.
    pub health: Option<Health>,
    /// The fault that ended the run early.
    pub fault: Option<u8>,
    /// Why the host ended it early.
    pub stopped: Option<String>,
    /// Frames that came in damaged.
    pub frames_rejected: u32,
}

/// How it is done.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RunOptions {
    /// Distance of two rows in ticks.
    pub every_ticks: u16,
    /// How long to wait for the arm switch.
    pub arm_patience_s: f64,
}

impl Default for RunOptions {
    fn default() -> Self {
        Self { every_ticks: 10, arm_patience_s: 120.0 }
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Greeting,
    Uploading,
    /// Since when, and when to try again.
    Arming {
        since_s: f64,
        again_s: f64,
    },
    Starting,
    Running,
    /// Since when.
    ComingToRest {
        since_s: f64,
    },
    Disarming,
    Done,
}

/// The procedure.
#[derive(Debug)]
pub struct RunExperiment {
    experiment: Experiment,
    options: RunOptions,
    phase: Phase,
    ask: Ask,
    record: RunRecord,
    asked_for_switch: bool,
    keep_alive: KeepAlive,
    heard_s: f64,
    now_s: f64,
    notes: Vec<String>,
}

impl RunExperiment {
    /// Runs this experiment.
    #[must_use]
    pub fn new(experiment: Experiment, options: RunOptions) -> Self {
        let greeting = [
            Command::Hello,
            Command::SettingGet { key: M1_COUNTS_KEY },
            Command::SettingGet { key: M2_COUNTS_KEY },
            Command::Telemetry { every_ticks: 0 },
        ];
        Self {
            experiment,
            options,
            phase: Phase::Greeting,
            ask: Ask::new(greeting),
            record: RunRecord {
                hello: Hello::default(),
                scale: Scale { tick_hz: 0, m1_counts_per_rev: 0, m2_counts_per_rev: 0 },
                rows: Vec::new(),
                events: Vec::new(),
                health: None,
                fault: None,
                stopped: None,
                frames_rejected: 0,
            },
            asked_for_switch: false,
            keep_alive: KeepAlive::default(),
            heard_s: 0.0,
            now_s: 0.0,
            notes: Vec::new(),
        }
    }

    /// Whether the rig waits for its arm switch: off and on again. The virtual bench turns it then.
    #[must_use]
    pub fn wants_arm_switch(&self) -> bool {
        self.asked_for_switch && matches!(self.phase, Phase::Arming { .. })
    }

    /// Ends the run before its time, for this reason: stop, wait for rest, disarm.
    pub fn stop(&mut self, why: &str) {
        if self.record.stopped.is_some() || matches!(self.phase, Phase::Disarming | Phase::Done) {
            return;
        }
        self.record.stopped = Some(why.to_owned());
        self.ask.forget_waiting();
        match self.phase {
            Phase::Starting | Phase::Running => {
                self.notes.push("stopping; waiting until the rig is at rest".into());
                self.ask.push(Command::Stop);
                self.phase = Phase::ComingToRest { since_s: self.now_s };
            }
            Phase::ComingToRest { .. } => {}
            _ => self.disarm(),
        }
    }

    /// Ends the run at once: the drives lose their torque wherever the rig is.
    pub fn abort(&mut self, why: &str) {
        self.record.stopped.get_or_insert_with(|| why.to_owned());
        if !matches!(self.phase, Phase::Disarming | Phase::Done) {
            self.ask.forget_all();
            self.disarm();
        }
    }

    fn disarm(&mut self) {
        self.ask.push(Command::Disarm);
        self.ask.push(Command::Telemetry { every_ticks: 0 });
        self.phase = Phase::Disarming;
    }

    /// Whether the rig moves, or may: it must be told to stop before the host leaves.
    #[must_use]
    pub fn is_live(&self) -> bool {
        !matches!(self.phase, Phase::Greeting | Phase::Uploading | Phase::Done)
    }

    /// Ticks of the experiment that have run, for a progress bar.
    #[must_use]
    pub fn progress_ticks(&self) -> u32 {
        self.record.rows.last().map_or(0, |row| row.experiment_tick)
    }

    /// The record so far: what is left of a run that cannot go on.
    #[must_use]
    pub fn record(&self) -> &RunRecord {
        &self.record
    }

    fn take_messages(&mut self, now_s: f64) {
        for message in self.ask.take_others() {
            match message {
                Message::Telemetry(row) => {
                    self.heard_s = now_s;
                    self.take_row(row, now_s);
                }
                Message::Health(health) => self.record.health = Some(health),
                Message::Event(event) => {
                    self.notes.push(words::event(&event, self.record.scale.tick_hz));
                    if let EventKind::FaultLatched(number) = event.kind
                        && self.record.fault.is_none()
                        && self.phase != Phase::Greeting
                    {
                        self.record.fault = Some(number);
                    }
                    self.record.events.push(event);
                }
                Message::Answer { .. } => {}
            }
        }
    }

    fn take_row(&mut self, row: TelemetryRow, now_s: f64) {
        if row.fault != 0 {
            self.record.fault.get_or_insert(row.fault);
        }
        let running = row.sequencer == SequencerState::Running as u8;
        match self.phase {
            Phase::Starting | Phase::Running if running => {
                self.phase = Phase::Running;
                self.record.rows.push(row);
            }
            Phase::Running => self.phase = Phase::ComingToRest { since_s: now_s },
            _ => {}
        }
        let at_rest = [Mode::Armed, Mode::Disabled, Mode::Fault].iter().any(|mode| mode.number() == row.mode);
        if matches!(self.phase, Phase::ComingToRest { .. }) && at_rest {
            self.disarm();
        }
    }

    fn greeted(&mut self, answers: &[Answer]) -> Result<(), InputError> {
        let [hello, m1_counts, m2_counts, telemetry] = answers else {
            return Err(InputError::new("the rig did not answer the greeting"));
        };
        let hello = check_hello(hello)?;
        let counts = |answer: &Answer| match answer {
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            // a whole number by its setting
            Answer::Setting(state) => Ok(state.active as u32),
            other => Err(words::unexpected(other)),
        };
        self.record.scale = Scale {
            tick_hz: hello.tick_hz,
            m1_counts_per_rev: counts(m1_counts)?,
            m2_counts_per_rev: counts(m2_counts)?,
        };
        words::accepted(telemetry)?;
        self.notes.push(words::hello(&hello));
        if hello.crash_record {
            self.notes
                .push("there is a crash record from before its last restart: rig monitor shows it".into());
        }
        self.record.hello = hello;
        self.ask.push(Command::ProgramBegin(program::header(&self.experiment)));
        program::segments(&self.experiment)
            .for_each(|segment| self.ask.push(Command::ProgramSegment(segment)));
        self.ask.push(Command::ProgramCommit);
        self.phase = Phase::Uploading;
        Ok(())
    }

    fn armed_or_not(&mut self, answer: &Answer, since_s: f64, now_s: f64) -> Result<(), InputError> {
        let waits = [Refusal::ArmSwitchOff, Refusal::ArmSwitchNotReleased, Refusal::Starting];
        match answer {
            Answer::Done => {
                self.ask.push(Command::Telemetry { every_ticks: self.options.every_ticks });
                self.ask.push(Command::Start);
                self.phase = Phase::Starting;
                self.heard_s = now_s;
                Ok(())
            }
            Answer::Refused { reason, .. } if waits.iter().any(|refusal| refusal.number() == *reason) => {
                if !self.asked_for_switch && *reason != Refusal::Starting.number() {
                    self.asked_for_switch = true;
                    self.notes.push("keep clear of the rig, and turn its arm switch off and on".into());
                }
                if now_s - since_s > self.options.arm_patience_s {
                    return Err(InputError::new("the arm switch was not turned on").of_kind(Kind::Run));
                }
                self.phase = Phase::Arming { since_s, again_s: now_s + ARM_AGAIN_S };
                Ok(())
            }
            other => words::accepted(other),
        }
    }

    fn advance(&mut self, now_s: f64) -> Result<(), InputError> {
        if let Phase::Arming { since_s, again_s } = self.phase
            && now_s >= again_s
            && self.ask.is_idle()
            && again_s > since_s
        {
            self.ask.push(Command::Arm);
            self.phase = Phase::Arming { since_s, again_s: f64::INFINITY };
        }
        if !self.ask.is_idle() {
            return Ok(());
        }
        let answers = self.ask.take_answers();
        if answers.is_empty() {
            return Ok(());
        }
        match self.phase {
            Phase::Greeting => self.greeted(&answers),
            Phase::Uploading => {
                answers.iter().try_for_each(words::accepted)?;
                self.phase = Phase::Arming { since_s: now_s, again_s: f64::INFINITY };
                self.ask.push(Command::Arm);
                Ok(())
            }
            Phase::Arming { since_s, .. } => {
                answers.iter().try_for_each(|answer| self.armed_or_not(answer, since_s, now_s))
            }
            // A stop that comes too late or too early is refused; the rig is disarmed in any case.
            Phase::ComingToRest { .. } if self.record.stopped.is_some() => Ok(()),
            Phase::Starting | Phase::Running | Phase::ComingToRest { .. } => {
                answers.iter().try_for_each(words::accepted)
            }
            Phase::Disarming => {
                self.phase = Phase::Done;
                Ok(())
            }
            Phase::Done => Ok(()),
        }
    }

    fn check_time(&self, now_s: f64) -> Result<(), InputError> {
        let silent = matches!(self.phase, Phase::Starting | Phase::Running | Phase::ComingToRest { .. })
            && now_s - self.heard_s > SILENCE_S;
        if silent {
            return Err(
                InputError::new("the rig has gone silent in the middle of the run").of_kind(Kind::Rig)
            );
        }
        match self.phase {
            Phase::ComingToRest { since_s } if now_s - since_s > REST_S => {
                Err(InputError::new("the rig did not come to rest after the run").of_kind(Kind::Run))
            }
            _ => Ok(()),
        }
    }
}

impl Procedure for RunExperiment {
    type Outcome = RunRecord;

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        self.now_s = now_s;
        self.ask.step(now_s, client)?;
        self.take_messages(now_s);
        self.advance(now_s)?;
        // An answer may be lost, and asking again takes longer than an armed rig waits.
        if self.is_live() {
            self.keep_alive.step(now_s, client);
        }
        self.record.frames_rejected = client.frames_rejected();
        self.check_time(now_s)
    }

    fn outcome(&mut self) -> Option<RunRecord> {
        (self.phase == Phase::Done).then(|| self.record.clone())
    }

    fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }
}

impl RunRecord {
    /// Why the run ended, for the log.
    #[must_use]
    pub fn ended(&self) -> String {
        match (&self.stopped, self.fault_words()) {
            (_, Some(fault)) => fault,
            (Some(why), None) => why.clone(),
            (None, None) => "at the end of the experiment".into(),
        }
    }

    /// The sentence of the fault that ended the run, if one did.
    #[must_use]
    pub fn fault_words(&self) -> Option<String> {
        self.fault.map(words::fault)
    }

    /// The fault as the control core knows it.
    #[must_use]
    pub fn known_fault(&self) -> Option<Fault> {
        self.fault.and_then(Fault::from_number)
    }
}
