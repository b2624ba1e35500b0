//! Records what the rig does without commanding it: telemetry for a time, or until it is enough.

use rig_link::message::{Answer, Command, CrashRecord, EventMessage, Hello, Message};
use rig_link::telemetry::{Health, TelemetryRow};

use super::ask::{Ask, check_hello};
use super::client::Client;
use super::procedure::Procedure;
use super::rows::Scale;
use super::words;
use crate::input_error::{InputError, Kind};

/// Control ticks a second, where nobody can be asked: it belongs to the board.
const TICK_HZ: u32 = 10_000;
const M1_COUNTS_KEY: u16 = 160;
const M2_COUNTS_KEY: u16 = 170;

/// What was recorded.
#[derive(Debug, Clone, PartialEq)]
pub struct Recorded {
    /// Who sent it.
    pub hello: Hello,
    /// How its counts and ticks are to be read.
    pub scale: Scale,
    /// The crash record from before its last restart.
    pub crash_record: Option<CrashRecord>,
    /// The rows.
    pub rows: Vec<TelemetryRow>,
    /// What happened meanwhile.
    pub events: Vec<EventMessage>,
    /// The last health record.
    pub health: Option<Health>,
}

/// The procedure.
#[derive(Debug)]
pub struct Record {
    every_ticks: u16,
    ticks: u64,
    keep_rows: bool,
    /// Only listens: another command holds the port.
    listens: bool,
    ask: Ask,
    recorded: Option<Recorded>,
    /// Telemetry was switched off again.
    ending: bool,
    done: bool,
    heard_s: f64,
    notes: Vec<String>,
}

impl Record {
    /// Records a row every `every_ticks` ticks, for `duration_s`; without rows to keep it only watches.
    #[must_use]
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    pub fn new(every_ticks: u16, duration_s: f64, keep_rows: bool) -> Self {
        let commands = [
            Command::Hello,
            Command::SettingGet { key: M1_COUNTS_KEY },
            Command::SettingGet { key: M2_COUNTS_KEY },
            Command::CrashRecord,
            Command::Telemetry { every_ticks },
        ];
        Self {
            every_ticks,
            ticks: (duration_s * 1e4) as u64,
            keep_rows,
            listens: false,
            ask: Ask::new(commands),
            recorded: None,
            ending: false,
            done: false,
            heard_s: 0.0,
            notes: Vec::new(),
        }
    }

    /// Records what another command has ordered, without a word to the rig, until it is ended.
    #[must_use]
    pub fn listening() -> Self {
        let scale = Scale { tick_hz: TICK_HZ, m1_counts_per_rev: 0, m2_counts_per_rev: 0 };
        let recorded = Recorded {
            hello: Hello::default(),
            scale,
            crash_record: None,
            rows: Vec::new(),
            events: Vec::new(),
            health: None,
        };
        Self {
            ticks: u64::MAX,
            listens: true,
            ask: Ask::new([]),
            recorded: Some(recorded),
            ..Self::new(1, 0.0, true)
        }
    }

    /// The rows that came since the last call, taken out: for a display that goes on for hours.
    pub fn take_rows(&mut self) -> Vec<TelemetryRow> {
        self.recorded.as_mut().map_or_else(Vec::new, |recorded| std::mem::take(&mut recorded.rows))
    }

    /// What is there so far.
    #[must_use]
    pub fn recorded(&self) -> Option<&Recorded> {
        self.recorded.as_ref()
    }

    /// Ends the recording now.
    pub fn finish_early(&mut self) {
        if self.listens {
            self.done = true;
            return;
        }
        if self.recorded.is_none() {
            self.ask.forget_waiting();
        }
        if !std::mem::replace(&mut self.ending, true) {
            self.ask.push(Command::Telemetry { every_ticks: 0 });
        }
    }

    fn begin(&mut self, answers: &[Answer]) -> Result<(), InputError> {
        let [hello, m1_counts, m2_counts, record, telemetry] = answers else {
            return Err(InputError::new("the rig did not answer the greeting"));
        };
        let hello = check_hello(hello)?;
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // a whole number by its setting
        let counts = |answer: &Answer| match answer {
            Answer::Setting(state) => Ok(state.active as u32),
            other => Err(words::unexpected(other)),
        };
        let crash_record = match record {
            Answer::CrashRecord(record) => record.clone(),
            other => return Err(words::unexpected(other)),
        };
        words::accepted(telemetry)?;
        self.notes.push(words::hello(&hello));
        self.notes.extend(crash_record.iter().map(|record| words::crash_record(record, hello.tick_hz)));
        let scale = Scale {
            tick_hz: hello.tick_hz,
            m1_counts_per_rev: counts(m1_counts)?,
            m2_counts_per_rev: counts(m2_counts)?,
        };
        let (rows, events, health) = (Vec::new(), Vec::new(), None);
        self.recorded = Some(Recorded { hello, scale, crash_record, rows, events, health });
        Ok(())
    }

    fn take(&mut self, message: Message, now_s: f64) {
        let Some(recorded) = &mut self.recorded else { return };
        match message {
            Message::Telemetry(row) => {
                self.heard_s = now_s;
                if self.ending {
                    return;
                }
                if !self.keep_rows {
                    recorded.rows.clear();
                }
                recorded.rows.push(row);
                let enough = u64::from(row.sequence) * u64::from(self.every_ticks) >= self.ticks;
                if enough {
                    self.ending = true;
                    self.ask.push(Command::Telemetry { every_ticks: 0 });
                }
            }
            Message::Health(health) => recorded.health = Some(health),
            Message::Event(event) => {
                self.notes.push(words::event(&event, recorded.scale.tick_hz));
                recorded.events.push(event);
            }
            Message::Answer { .. } => {}
        }
    }
}

impl Procedure for Record {
    type Outcome = Recorded;

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        self.ask.step(now_s, client)?;
        if self.ask.is_idle() {
            let answers = self.ask.take_answers();
            if !answers.is_empty() && self.recorded.is_none() && self.ending {
                return Err(InputError::new("ended before anything was recorded").of_kind(Kind::Run));
            } else if !answers.is_empty() && self.recorded.is_none() {
                self.heard_s = now_s;
                self.begin(&answers)?;
            } else if !answers.is_empty() {
                self.done = true;
            }
        }
        for message in self.ask.take_others() {
            self.take(message, now_s);
        }
        // Whoever holds the port may have no telemetry on.
        if self.recorded.is_some() && !self.ending && !self.listens && now_s - self.heard_s > 2.0 {
            return Err(InputError::new("the rig has gone silent").of_kind(Kind::Rig));
        }
        Ok(())
    }

    fn outcome(&mut self) -> Option<Recorded> {
        if self.done { self.recorded.take() } else { None }
    }

    fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }
}
