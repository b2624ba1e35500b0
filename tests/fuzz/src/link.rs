//! The link and the control core behind it.

use model_core::control::{
    Command as Core, ControlConfig, ControlSettings, ControlState, Mode, Outputs, Samples, apply, step,
};
use rig_link::frame::{MAX_FRAME, Receiver, checksum, encode};
use rig_link::message::{Command, Message, Request};
use rig_link::model::ModelRecord;
use rig_link::program::{ProgramHeader, ProgramSegment, Upload};
use rig_link::settings::by_key;
use std::sync::LazyLock;

/// Any bytes on the line: whatever comes out as a message is encoded to the same message again, and after one 0x00 the
/// receiver takes the next whole frame.
pub fn frames(bytes: &[u8]) {
    let mut receiver = Receiver::new();
    let mut to_host = Receiver::new();
    let mut frame = [0; MAX_FRAME];
    for byte in bytes {
        if let Some(Ok(request)) = receiver.push::<Request>(*byte) {
            let length = encode(&request, &mut frame).expect("what was decoded can be encoded");
            let again = whole(&frame[..length], &mut Receiver::new());
            // Bits, as a number in it may be none.
            assert_eq!(format!("{again:?}"), format!("{request:?}"));
        }
        let _ = to_host.push::<Message>(*byte);
    }
    let _ = receiver.push::<Request>(0);
    let request = Request { id: 7, command: Command::Hello };
    let length = encode(&request, &mut frame).expect("it is short");
    assert_eq!(whole(&frame[..length], &mut receiver), request);
}

fn whole(frame: &[u8], receiver: &mut Receiver) -> Request {
    let mut last = None;
    for byte in frame {
        last = receiver.push::<Request>(*byte);
    }
    last.expect("a frame ends with 0x00").expect("it was just encoded")
}

/// The bytes of a script, taken from the front.
struct Script<'a>(&'a [u8]);

impl<'a> Script<'a> {
    fn byte(&mut self) -> Option<u8> {
        let (first, rest) = self.0.split_first()?;
        self.0 = rest;
        Some(*first)
    }

    fn bytes(&mut self, most: usize) -> &'a [u8] {
        let (now, later) = self.0.split_at(most.min(self.0.len()));
        self.0 = later;
        now
    }

    fn word(&mut self) -> u16 {
        u16::from_le_bytes([self.byte().unwrap_or_default(), self.byte().unwrap_or_default()])
    }
}

/// A body as a frame: with its checksum, so that what is fuzzed is what comes after.
fn framed(body: &[u8]) -> Vec<u8> {
    let mut plain = body.to_vec();
    plain.extend(checksum(body).to_le_bytes());
    let mut frame = cobs::encode_vec(&plain);
    frame.push(0);
    frame
}

/// The control core with what the firmware's operator puts before it.
#[derive(Clone)]
struct Rig {
    config: ControlConfig,
    settings: ControlSettings,
    state: ControlState,
    upload: Upload,
    receiver: Receiver,
    samples: Samples,
    /// The switch as the last tick saw it: what changed since, the core sees in the next, before any output.
    switch_seen: bool,
    /// The switch was seen off, long enough, since the start and the last fault.
    released_ticks: u32,
    released: bool,
    /// The last command was an accepted arm, and nothing disarmed since.
    may_be_live: bool,
}

/// A rig after its self-check, its switch seen off: most of a script's time would else go by before it can arm.
static STARTED: LazyLock<Rig> = LazyLock::new(|| {
    let mut rig = Rig::new();
    for _ in 0..1_100 {
        rig.tick();
    }
    rig
});

/// Ticks for which the switch must be off, and a line must permit: 5 ms.
const PERMISSION_TICKS: u32 = 49;

impl Rig {
    fn new() -> Self {
        let settings = ControlSettings::default();
        let config = settings.build().expect("the defaults are in range");
        let mut samples = Samples { adc_fresh: true, ..Samples::default() };
        samples.adc.friction_bridge = 32_768;
        samples.adc.normal_bridge = 5_461;
        (samples.adc.m1_torque, samples.adc.m2_torque) = (32_768, 32_768);
        samples.adc.supply = 43_330;
        Self {
            state: ControlState::new(&config),
            config,
            settings,
            upload: Upload::default(),
            receiver: Receiver::new(),
            samples,
            switch_seen: false,
            released_ticks: 0,
            released: false,
            may_be_live: false,
        }
    }

    /// A request, as `firmware/src/link/operator.rs` carries it out.
    fn carry_out(&mut self, command: Command) {
        let done =
            |rig: &mut Self, command: Core<'_>| apply(&mut rig.config, &mut rig.state, command).is_ok();
        match command {
            Command::Arm => {
                let was = self.state.mode();
                if done(self, Core::Arm) {
                    assert_eq!(was, Mode::Disabled, "armed from another mode");
                    assert!(self.switch_seen, "armed with the switch off");
                    assert!(self.released, "armed though the switch was not released");
                    self.may_be_live = true;
                }
            }
            Command::Disarm => {
                done(self, Core::Disarm);
            }
            Command::Start => {
                done(self, Core::Start);
            }
            Command::Stop => {
                done(self, Core::Stop);
            }
            Command::ClearFault => {
                done(self, Core::ClearFault);
            }
            Command::Tare => {
                done(self, Core::Tare);
            }
            Command::ProgramBegin(header) => self.upload.begin(header),
            Command::ProgramSegment(segment) => {
                let _ = self.upload.push(&segment);
            }
            Command::ProgramCommit => {
                if let Ok(experiment) = self.upload.complete()
                    && let Ok(prepared) = experiment.prepare(&self.config)
                {
                    done(self, Core::LoadExperiment(&prepared));
                }
            }
            Command::SettingSet { key, value } => {
                let mut settings = self.settings;
                if let Some(info) = by_key(key)
                    && info.set(&mut settings, value).is_ok()
                    && let Ok(config) = settings.build()
                    && done(self, Core::SetConfig(&config))
                {
                    self.settings = settings;
                }
            }
            Command::ModelSet(model) => {
                if !self.state.mode().is_live()
                    && let Ok(prepared) = model.prepare(&self.settings)
                {
                    done(self, Core::SetModel(&prepared));
                }
            }
            Command::KeepAlive => self.samples.link_heard = true,
            _ => {}
        }
    }

    fn tick(&mut self) {
        let before = self.state.mode();
        self.released_ticks = if self.samples.arm_switch { 0 } else { self.released_ticks + 1 };
        self.released |= self.released_ticks > PERMISSION_TICKS - 1;
        self.switch_seen = self.samples.arm_switch;
        let outputs = step(&self.config, &mut self.state, &self.samples);
        while self.state.pop_event().is_some() {}
        self.samples.link_heard = false;
        let live = outputs.drive_enable != [false; 2];
        self.check(&outputs, live);
        let fault = self.state.mode() == Mode::Fault;
        if fault && before != Mode::Fault {
            (self.released, self.released_ticks) = (false, 0);
        }
        self.may_be_live &= live;
    }

    /// No enable without switch, permission and an accepted arm; none with a fault; no torque but while running.
    fn check(&self, outputs: &Outputs, live: bool) {
        let s = &self.samples;
        if live {
            assert!(self.may_be_live, "drives enabled that nobody armed");
            assert!(s.arm_switch, "drives enabled with the switch off");
            assert!(!(s.emergency_stop || s.m1_drive_fault || s.m2_drive_fault), "drives enabled: {s:?}");
            assert!(outputs.record.faults.is_empty() && outputs.record.causes.is_empty(), "with a fault");
            assert_eq!(outputs.drive_enable, [true; 2]);
        } else {
            assert!(outputs.is_safe(), "torque with the drives off: {:?}", outputs.dac);
        }
        if !outputs.record.mode.has_torque() {
            assert_eq!(
                outputs.dac,
                [model_core::control::DAC_ZERO; 2],
                "torque in {:?}",
                outputs.record.mode
            );
        }
        assert!(outputs.dac.iter().all(|code| *code <= model_core::control::DAC_MAX));
    }
}

/// Any sequence of requests, inputs and ticks, against the control core itself: from power-on where the first byte is 0,
/// after its self-check where it is not.
pub fn commands(bytes: &[u8]) {
    let mut script = Script(bytes);
    let (mut rig, most_ticks) = match script.byte() {
        Some(0) => (Rig::new(), 1_500),
        _ => (STARTED.clone(), 600),
    };
    let mut ticks = 0_u32;
    while let Some(what) = script.byte() {
        match what % 8 {
            0 => {
                for _ in 0..=script.byte().unwrap_or_default() {
                    rig.tick();
                    ticks += 1;
                }
            }
            // The time that a permission takes.
            1 => {
                for _ in 0..60 {
                    rig.tick();
                    ticks += 1;
                }
            }
            2 => {
                let bits = script.byte().unwrap_or_default();
                let s = &mut rig.samples;
                s.arm_switch = bits & 1 != 0;
                s.emergency_stop = bits & 6 == 6;
                s.m1_drive_fault = bits & 24 == 24;
                s.m2_drive_fault = bits & 96 == 96;
            }
            3 => {
                let code = script.word();
                let adc = &mut rig.samples.adc;
                match script.byte().unwrap_or_default() % 5 {
                    0 => adc.friction_bridge = code,
                    1 => adc.normal_bridge = code,
                    2 => adc.m1_torque = code,
                    3 => adc.m2_torque = code,
                    _ => adc.supply = code,
                }
            }
            4 => {
                let s = &mut rig.samples;
                s.m1_count = s.m1_count.wrapping_add(u32::from(script.byte().unwrap_or_default() >> 4));
                s.m2_count = s.m2_count.wrapping_add(u32::from(script.word() >> 6));
            }
            5 => {
                let bits = script.byte().unwrap_or_default();
                let s = &mut rig.samples;
                (s.adc_fresh, s.adc_overrun) = (bits & 3 != 3, bits & 12 == 12);
                (s.tick_irregular, s.deadline_missed) = (bits & 48 == 48, bits & 192 == 192);
            }
            // The commands that matter most, without luck with their encoding.
            6 => {
                let commands = [
                    Command::Arm,
                    Command::Start,
                    Command::KeepAlive,
                    Command::ClearFault,
                    Command::Stop,
                    Command::Tare,
                ];
                let nth = usize::from(script.byte().unwrap_or_default()) % commands.len();
                rig.carry_out(commands[nth].clone());
            }
            _ => {
                let length = usize::from(script.byte().unwrap_or_default());
                for byte in framed(script.bytes(length)) {
                    if let Some(Ok(Request { command, .. })) = rig.receiver.push::<Request>(byte) {
                        rig.carry_out(command);
                    }
                }
            }
        }
        // Bounded, whatever the script asks for.
        if ticks > most_ticks {
            break;
        }
    }
}

/// Any experiment and model: refused, or run for a while with finite numbers and codes within the converter's.
pub fn upload(bytes: &[u8]) {
    let settings = ControlSettings::default();
    let config = settings.build().expect("the defaults are in range");
    let mut rest = bytes;
    if let Ok((model, more)) = postcard::take_from_bytes::<ModelRecord>(rest) {
        let _ = model.prepare(&settings);
        rest = more;
    }
    let Ok((header, mut rest)) = postcard::take_from_bytes::<ProgramHeader>(rest) else { return };
    let mut upload = Upload::default();
    upload.begin(header);
    while let Ok((segment, more)) = postcard::take_from_bytes::<ProgramSegment>(rest) {
        rest = more;
        if upload.push(&segment).is_err() {
            break;
        }
    }
    let Ok(experiment) = upload.complete() else { return };
    let Ok(prepared) = experiment.prepare(&config) else { return };
    let mut rig = STARTED.clone();
    rig.samples.arm_switch = true;
    for _ in 0..60 {
        rig.tick();
    }
    apply(&mut rig.config, &mut rig.state, Core::LoadExperiment(&prepared)).expect("disabled");
    apply(&mut rig.config, &mut rig.state, Core::Arm).expect("nothing stands in the way");
    rig.may_be_live = true;
    apply(&mut rig.config, &mut rig.state, Core::Start).expect("armed and loaded");
    for _ in 0..200 {
        rig.samples.link_heard = true;
        rig.tick();
        let _ = rig.state.pop_event();
    }
}
