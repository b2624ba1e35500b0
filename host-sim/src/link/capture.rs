//! The triggered capture: arm it, wait for it, read it, make a log of it.
//!
//! The rig records raw codes of every tick. Here they become SI units with the settings the rig has at that
//! moment; a tare made since the firmware's start is not in them, as it is no setting. Time 0 is the trigger.

use rig_link::capture::{CaptureInfo, CaptureRow, CaptureState, CaptureTrigger};
use rig_link::message::{Answer, Command, Hello, Message};
use rig_link::settings::by_name;

use super::ask::{Ask, check_hello};
use super::client::Client;
use super::procedure::Procedure;
use super::words;
use crate::files::log::Log;
use crate::files::number::widen;
use crate::files::signal::Signal;
use crate::input_error::{InputError, Kind};

/// Time between two looks at the state.
const LOOK_S: f64 = 0.1;

/// Settings that turn codes into units, in the order in which they are asked for.
const SCALES: [&str; 13] = [
    "friction_bridge.zero_code",
    "friction_bridge.unit_per_code",
    "normal_bridge.zero_code",
    "normal_bridge.unit_per_code",
    "m1.monitor_zero_code",
    "m1.monitor_nm_per_code",
    "m2.monitor_zero_code",
    "m2.monitor_nm_per_code",
    "m1_encoder.counts_per_rev",
    "m2_encoder.counts_per_rev",
    "m1.rated_torque_nm",
    "m2.rated_torque_nm",
    "supply.volt_per_code",
];

/// A capture as it was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Captured {
    /// Who recorded it.
    pub hello: Hello,
    /// Its size and its trigger.
    pub info: CaptureInfo,
    /// One row a tick, oldest first.
    pub rows: Vec<CaptureRow>,
    scales: [f64; SCALES.len()],
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Phase {
    Greeting,
    /// When to look at the state next.
    Waiting(f64),
    Looking,
    Triggering,
    Reading,
    Done,
}

/// The procedure.
#[derive(Debug)]
pub struct ReadCapture {
    phase: Phase,
    ask: Ask,
    hello: Option<Hello>,
    info: CaptureInfo,
    trigger_when_full: bool,
    bytes: Vec<u8>,
    scales: [f64; SCALES.len()],
    notes: Vec<String>,
    given_up: Option<String>,
}

impl ReadCapture {
    /// Arms a capture, waits until it is complete, and reads it; without a trigger the one that is armed.
    #[must_use]
    pub fn new(trigger: Option<CaptureTrigger>) -> Self {
        let mut ask = Ask::new([Command::Hello]);
        for key in SCALES.iter().filter_map(|name| by_name(name)).map(|info| info.key) {
            ask.push(Command::SettingGet { key });
        }
        if let Some(trigger) = trigger {
            ask.push(Command::CaptureArm(trigger));
        }
        Self {
            phase: Phase::Greeting,
            ask,
            hello: None,
            info: CaptureInfo::default(),
            trigger_when_full: false,
            bytes: Vec::new(),
            scales: [0.0; SCALES.len()],
            notes: Vec::new(),
            given_up: None,
        }
    }

    /// Arms a capture, triggers it as soon as there is a second to put ahead of it, and reads it.
    #[must_use]
    pub fn now() -> Self {
        Self { trigger_when_full: true, ..Self::new(Some(CaptureTrigger::Command)) }
    }

    /// Stops waiting and reading; the capture stays armed, or complete, in the rig.
    pub fn give_up(&mut self, why: &str) {
        self.given_up.get_or_insert_with(|| why.to_owned());
    }

    fn take_answers(&mut self, answers: &[Answer], now_s: f64) -> Result<(), InputError> {
        match self.phase {
            Phase::Greeting => {
                let (hello, rest) = answers.split_first().ok_or_else(|| InputError::new("no answer"))?;
                self.hello = Some(check_hello(hello)?);
                for (scale, answer) in self.scales.iter_mut().zip(rest) {
                    let Answer::Setting(state) = answer else { return Err(words::unexpected(answer)) };
                    *scale = widen(state.active);
                }
                rest.iter().try_for_each(words::accepted)?;
                self.phase = Phase::Waiting(now_s);
            }
            Phase::Looking => {
                let Some(Answer::Capture(info)) = answers.first() else {
                    return Err(answers
                        .first()
                        .map_or_else(|| InputError::new("no answer"), words::unexpected));
                };
                if info.state != self.info.state {
                    self.notes.push(state_words(info.state).into());
                }
                self.info = *info;
                match info.state {
                    CaptureState::Idle => return Err(InputError::new("no capture is armed")),
                    CaptureState::Frozen => {
                        self.ask.push(Command::CaptureRead { offset: 0 });
                        self.phase = Phase::Reading;
                    }
                    CaptureState::Waiting if std::mem::take(&mut self.trigger_when_full) => {
                        self.ask.push(Command::CaptureTrigger);
                        self.phase = Phase::Triggering;
                    }
                    _ => self.phase = Phase::Waiting(now_s + LOOK_S),
                }
            }
            Phase::Reading => {
                let Some(Answer::CaptureBytes { offset, bytes }) = answers.first() else {
                    return Err(answers
                        .first()
                        .map_or_else(|| InputError::new("no answer"), words::unexpected));
                };
                if *offset as usize != self.bytes.len() || bytes.is_empty() {
                    return Err(InputError::new("the capture came out of order"));
                }
                self.bytes.extend_from_slice(bytes);
                let wanted = self.info.rows as usize * CaptureRow::BYTES;
                if self.bytes.len() >= wanted {
                    self.phase = Phase::Done;
                } else {
                    #[allow(clippy::cast_possible_truncation)] // half a megabyte
                    self.ask.push(Command::CaptureRead { offset: self.bytes.len() as u32 });
                }
            }
            Phase::Triggering => {
                answers.iter().try_for_each(words::accepted)?;
                self.phase = Phase::Waiting(now_s + LOOK_S);
            }
            Phase::Waiting(_) | Phase::Done => {}
        }
        Ok(())
    }
}

fn state_words(state: CaptureState) -> &'static str {
    match state {
        CaptureState::Idle => "no capture",
        CaptureState::Filling => "filling what comes before the trigger",
        CaptureState::Waiting => "waiting for the trigger",
        CaptureState::Finishing => "triggered",
        CaptureState::Frozen => "complete; reading it",
    }
}

impl Procedure for ReadCapture {
    type Outcome = Captured;

    fn step(&mut self, now_s: f64, client: &mut Client) -> Result<(), InputError> {
        if let Some(why) = &self.given_up {
            let allowed = "rig record --capture armed reads it later";
            return Err(InputError::new(format!("the capture was not read: {why}"))
                .of_kind(Kind::Run)
                .allowed(allowed));
        }
        self.ask.step(now_s, client)?;
        for message in self.ask.take_others() {
            if let Message::Event(event) = message {
                let tick_hz = self.hello.as_ref().map_or(0, |hello| hello.tick_hz);
                self.notes.push(words::event(&event, tick_hz));
            }
        }
        if !self.ask.is_idle() {
            return Ok(());
        }
        let answers = self.ask.take_answers();
        if !answers.is_empty() {
            self.take_answers(&answers, now_s)?;
        }
        if let Phase::Waiting(look_s) = self.phase
            && now_s >= look_s
        {
            self.ask.push(Command::CaptureStatus);
            self.phase = Phase::Looking;
        }
        Ok(())
    }

    fn outcome(&mut self) -> Option<Captured> {
        if self.phase != Phase::Done {
            return None;
        }
        let (rows, _) = self.bytes.as_chunks::<{ CaptureRow::BYTES }>();
        let rows = rows.iter().map(CaptureRow::from_bytes).collect();
        Some(Captured { hello: self.hello.take()?, info: self.info, rows, scales: self.scales })
    }

    fn notes(&mut self) -> Vec<String> {
        std::mem::take(&mut self.notes)
    }
}

impl Captured {
    /// The capture as a log. Angles count from the first row.
    #[must_use]
    #[allow(clippy::cast_precision_loss)]
    pub fn log(&self) -> Log {
        let [
            friction_zero,
            friction,
            normal_zero,
            normal,
            m1_zero,
            m1,
            m2_zero,
            m2,
            counts1,
            counts2,
            rated1,
            rated2,
            volt,
        ] = self.scales;
        let scaled = |code: fn(&CaptureRow) -> u16, zero: f64, unit: f64| {
            self.rows.iter().map(|row| (f64::from(code(row)) - zero) * unit).collect::<Vec<f64>>()
        };
        // 2048 codes around mid-scale are the rated torque.
        let torque_ref = |code: fn(&CaptureRow) -> u16, rated: f64| scaled(code, 2048.0, rated / 2048.0);
        let before = f64::from(self.info.rows_before);
        let tick_hz = f64::from(self.hello.tick_hz.max(1));
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..self.rows.len()).map(|k| (k as f64 - before) / tick_hz).collect());
        log.set_signal(Signal::M1TorqueRef, torque_ref(|row| row.m1_dac, rated1));
        log.set_signal(Signal::M1Torque, scaled(|row| row.m1_torque, m1_zero, m1));
        log.set_signal(Signal::M1Angle, angle(&self.rows, |row| row.m1_count, counts1));
        log.set_signal(Signal::M2TorqueRef, torque_ref(|row| row.m2_dac, rated2));
        log.set_signal(Signal::M2Torque, scaled(|row| row.m2_torque, m2_zero, m2));
        log.set_signal(Signal::M2Angle, angle(&self.rows, |row| row.m2_count, counts2));
        log.set_signal(Signal::NormalForce, scaled(|row| row.normal_bridge, normal_zero, normal));
        log.set_signal(Signal::FrictionTorque, scaled(|row| row.friction_bridge, friction_zero, friction));
        log.set_numbers("supply_v", scaled(|row| row.supply, 0.0, volt));
        let predicted = self.rows.iter().map(|row| f64::from(row.predicted_mnm) / 1000.0).collect();
        log.set_numbers("predicted_friction_torque_nm", predicted);
        let speed_ref = self.rows.iter().map(|row| f64::from(row.m2_speed_ref_crad_s) / 100.0).collect();
        log.set_numbers("m2_speed_ref_rad_s", speed_ref);
        log.set_numbers("mode", self.rows.iter().map(|row| f64::from(row.mode())).collect());
        log.set_numbers("fault", self.rows.iter().map(|row| f64::from(row.fault())).collect());
        log
    }
}

/// Angle from the low 16 bits of a position: between two ticks the count changes by far less than half of them.
fn angle(rows: &[CaptureRow], count: fn(&CaptureRow) -> u16, counts_per_rev: f64) -> Vec<f64> {
    let mut position = 0i64;
    let mut last = rows.first().map_or(0, count);
    rows.iter()
        .map(|row| {
            position += i64::from(count(row).wrapping_sub(last).cast_signed());
            last = count(row);
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            // a whole number by its setting
            crate::files::number::angle_rad(position, counts_per_rev as u32)
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_angle_survives_the_wrap_of_its_counter() {
        let counts = [65_500u16, 65_530, 24, 54, 10, 65_500];
        let rows: Vec<CaptureRow> = counts
            .iter()
            .map(|m2_count| CaptureRow { m2_count: *m2_count, ..CaptureRow::default() })
            .collect();
        let quarter = |angle: f64| (angle / std::f64::consts::TAU * 360.0).round();
        let angles: Vec<f64> = angle(&rows, |row| row.m2_count, 360.0).into_iter().map(quarter).collect();
        assert_eq!(angles, [0.0, 30.0, 60.0, 90.0, 46.0, 0.0]);
    }

    #[test]
    fn every_scale_is_a_setting() {
        assert!(SCALES.iter().all(|name| by_name(name).is_some()));
    }
}
