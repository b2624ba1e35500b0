//! A rig made of the control core and the plant that answers like the firmware, for tests of the host's side.
#![allow(dead_code, unreachable_pub)] // each test uses a part of it

#[cfg(unix)]
pub mod bench;
#[cfg(unix)]
pub mod terminal;

use host_sim::files::experiment_file::ExperimentFile;
use host_sim::files::model_file::ModelFile;
use host_sim::files::rig_file::RigFile;
use host_sim::lockstep::Setup;
use host_sim::plant::{Plant, PlantInput, PlantOutput};
use model_core::control::{
    Command as Core, ControlConfig, ControlSettings, ControlState, Refusal, Refused, Samples, SequencerState,
    apply, step,
};
use rig_link::frame::{MAX_FRAME, Receiver, encode};
use rig_link::message::{Answer, Command, Hello, Message, PROTOCOL_VERSION, Rejection, Request};
use rig_link::model::ModelRecord;
use rig_link::program::Upload;
use rig_link::settings::{SCHEMA_VERSION, SettingState, by_key};
use rig_link::telemetry::TelemetryRow;

pub const TICK_S: f64 = 1e-4;

/// Control core and plant behind the link.
pub struct Rig {
    pub config: ControlConfig,
    pub state: ControlState,
    pub plant: Plant,
    pub seen: PlantOutput,
    pub drive: PlantInput,
    pub arm_switch: bool,
    pub emergency_stop: bool,
    pub upload: Upload,
    pub every_ticks: u16,
    pub until_row: u16,
    pub sequence: u32,
    pub receiver: Receiver,
    pub out: Vec<u8>,
    pub hello: Hello,
    /// Rows it forgets to send.
    pub lose: fn(u32) -> bool,
    /// Turns its arm switch by itself when arming was refused.
    pub willing: bool,
    /// The stored model.
    pub model: Option<ModelRecord>,
    /// Answers no more.
    pub dead: bool,
}

pub fn setup(experiment: &str) -> (ExperimentFile, Setup) {
    let rig = RigFile::assumed_rig(&[]).unwrap();
    let model = ModelFile::assumed(&[]).unwrap();
    let file = ExperimentFile::named_or_read(experiment, &[]).unwrap();
    let setup = Setup::from_files(&file, &rig, &model, &model).unwrap();
    (file, setup)
}

impl Rig {
    pub fn new(setup: &Setup) -> Self {
        let mut plant = Plant::new(&setup.plant, setup.seed).unwrap();
        let seen = plant.sample();
        Self {
            state: ControlState::new(&setup.config),
            config: setup.config,
            plant,
            seen,
            drive: PlantInput::OFF,
            arm_switch: false,
            emergency_stop: false,
            upload: Upload::default(),
            every_ticks: 0,
            until_row: 0,
            sequence: 0,
            receiver: Receiver::new(),
            out: Vec::new(),
            hello: Hello {
                protocol: PROTOCOL_VERSION,
                settings_schema: SCHEMA_VERSION,
                tick_hz: 10_000,
                crystal: true,
                reference_mv: 3_300,
                ..Hello::default()
            },
            lose: |_| false,
            willing: false,
            model: None,
            dead: false,
        }
    }

    fn say(&mut self, message: &Message) {
        let mut frame = [0; MAX_FRAME];
        let length = encode(message, &mut frame).unwrap();
        self.out.extend_from_slice(&frame[..length]);
    }

    fn core(&mut self, command: Core<'_>) -> Answer {
        match apply(&mut self.config, &mut self.state, command) {
            Ok(()) => Answer::Done,
            Err(refused) => Refused::into(refused),
        }
    }

    fn set(&mut self, key: u16, value: f32) -> Answer {
        let info = by_key(key).unwrap();
        let mut settings = *self.config.settings();
        info.set(&mut settings, value).unwrap();
        match settings.build() {
            Ok(config) => {
                self.config = config;
                self.carry_out(Command::SettingGet { key })
            }
            Err(error) => Answer::Rejected(Rejection::OutOfRange {
                name: heapless::String::try_from(error.name).unwrap(),
                value,
                allowed: heapless::String::try_from(error.allowed).unwrap_or_default(),
            }),
        }
    }

    fn carry_out(&mut self, command: Command) -> Answer {
        match command {
            Command::Hello => Answer::Hello(self.hello.clone()),
            Command::KeepAlive => Answer::Done,
            Command::CrashRecord => Answer::CrashRecord(None),
            Command::SettingGet { key } => {
                let info = by_key(key).unwrap();
                let (active, default) =
                    (info.get(self.config.settings()), info.get(&ControlSettings::default()));
                let stored = (active.to_bits() != default.to_bits()).then_some(active);
                Answer::Setting(SettingState { key, active, stored, default })
            }
            Command::SettingSet { key, value } => self.set(key, value),
            Command::ModelSet(model) => {
                self.model = Some(model);
                Answer::Model(self.model.clone())
            }
            Command::ModelGet => Answer::Model(self.model.clone()),
            Command::ModelForget => {
                self.model = None;
                Answer::Model(None)
            }
            Command::SettingsErase => Answer::Done,
            Command::Telemetry { every_ticks } => {
                (self.every_ticks, self.until_row, self.sequence) = (every_ticks, every_ticks, 0);
                Answer::Done
            }
            Command::ProgramBegin(header) => {
                self.upload.begin(header);
                Answer::Done
            }
            Command::ProgramSegment(segment) => {
                self.upload.push(&segment).unwrap();
                Answer::Done
            }
            Command::ProgramCommit => match self.upload.complete().unwrap().prepare(&self.config) {
                Ok(prepared) => self.core(Core::LoadExperiment(&prepared)),
                Err(error) => {
                    let why = heapless::String::try_from(error.to_string().as_str()).unwrap_or_default();
                    Answer::Rejected(Rejection::ImpossibleProgram { why })
                }
            },
            Command::Arm => {
                let answer = self.core(Core::Arm);
                let off = Refusal::ArmSwitchOff.number();
                self.arm_switch |=
                    self.willing && matches!(answer, Answer::Refused { reason, .. } if reason == off);
                answer
            }
            Command::Disarm => self.core(Core::Disarm),
            Command::Start => self.core(Core::Start),
            Command::Stop => self.core(Core::Stop),
            _ => Answer::Rejected(Rejection::UnknownCase),
        }
    }

    fn tick(&mut self, heard: bool) {
        let samples = Samples {
            m1_count: self.seen.counts[0],
            m2_count: self.seen.counts[1],
            adc: self.seen.codes,
            adc_fresh: true,
            arm_switch: self.arm_switch,
            emergency_stop: self.emergency_stop,
            link_heard: heard,
            ..Samples::default()
        };
        let outputs = step(&self.config, &mut self.state, &samples);
        self.seen = self.plant.step(&self.drive);
        self.drive = PlantInput { dac: outputs.dac, drive_enable: outputs.drive_enable };
        while let Some(event) = self.state.pop_event() {
            self.say(&Message::Event(event.into()));
        }
        if self.every_ticks != 0 {
            let record = &outputs.record;
            let first = record.sequencer == SequencerState::Running && record.experiment_tick == 1;
            self.until_row = if first { 0 } else { self.until_row - 1 };
            if self.until_row == 0 {
                self.until_row = self.every_ticks;
                if !(self.lose)(self.sequence) {
                    self.say(&Message::Telemetry(TelemetryRow::new(record, self.sequence, 0)));
                }
                self.sequence += 1;
            }
        }
    }

    /// A millisecond of rig time: what came in is carried out, what goes out is returned.
    pub fn millisecond(&mut self, bytes: &[u8]) -> Vec<u8> {
        let mut heard = false;
        for byte in bytes {
            if let Some(Ok(Request { id, command })) = self.receiver.push::<Request>(*byte) {
                heard |= command.is_sign_of_life();
                let answer = self.carry_out(command);
                self.say(&Message::Answer { id, answer });
            }
        }
        for tick in 0..10 {
            self.tick(heard && tick == 0);
        }
        let out = std::mem::take(&mut self.out);
        if self.dead { Vec::new() } else { out }
    }
}
