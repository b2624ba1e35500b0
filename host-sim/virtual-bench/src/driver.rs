//! Runs the emulator against the plant and the operator, one control period after the other.
//!
//! The bench's period begins where the firmware's does: with TIM6's trigger, which starts the scan. At that
//! instant the voltages at the analogue inputs become those of the plant now; then the plant goes one
//! period on with the torque references and enables that stand at the pins, and its encoders' edges are queued
//! over the period. So what a tick computes from the samples of one period acts from the start of the next: one
//! control period of delay, as in the PC rig.

use crate::elf::Firmware;
use crate::endpoint::{BenchEnd, Question, ToBench, ToEndpoint};
use crate::meter::{Meter, Moment};
use crate::outside::{Action, DriveInputs, Outside, PlantSide, Sensors};
use crate::part::Part;
use crate::part::adc_trigger::REFERENCE_MICROVOLT;
use crate::part::encoder_timer::Disturbance;
use crate::record::{Record, Saved};
use crate::rtt::Rtt;
use crate::{board::RigBoard, interference, pins, serial};
use rigless::device::ResetCause;
use rigless::emulator::{AccessKind, Driver, HitKind, Host, Settled, Stop};
use rigless::mcu::Mcu;
use rigless::session::Session;
use rigless::snapshot;
use rigless::soc::Width;
use rigless::soc::stm32h743::generated::{DAC, GPIOD};
use rigless::time::VirtualNanos;

/// The control period, ns.
pub const PERIOD: u64 = 100_000;
/// Interrupt of the link's DMA, DMA1 stream 0 (RM0433 table 147).
const LOW_LINE: u64 = 11;
/// A branch to itself, Thumb.
const ENDLESS_LOOP: u64 = 0xE7FE;
/// `udf #0`: for ever undefined.
const UNDEFINED: u64 = 0xDE00;

/// Addresses the driver needs from the ELF.
#[derive(Debug, Clone)]
pub(crate) struct Addresses {
    rtt_block: u64,
    tick_handler: u64,
    low_handler: u64,
    digest: [u8; 32],
}

impl Addresses {
    pub(crate) fn of(firmware: &Firmware) -> Self {
        Self {
            rtt_block: firmware.rtt_block,
            tick_handler: firmware.tick_handlers[0],
            low_handler: firmware.low_handler,
            digest: firmware.digest,
        }
    }
}

/// The driver.
pub(crate) struct BenchDriver {
    addresses: Addresses,
    rtt: Rtt,
    meter: Meter,
    plant: Box<dyn PlantSide>,
    sensors: Sensors,
    outside: Outside,
    end: BenchEnd,
    /// The operator waits, until this instant at most.
    wakes_at: Option<u64>,
    received: Vec<u8>,
    resets_seen: usize,
    patched: Option<(u64, u64)>,
    next: u64,
    record: Record,
}

/// Keeps nothing of the driver in a snapshot: [`Saved`] has it.
pub(crate) struct NothingMore;

impl snapshot::Store for NothingMore {
    fn store(&self, _to: &mut snapshot::Writer) -> Result<(), snapshot::Error> {
        Ok(())
    }
    fn load(&mut self, _from: &mut snapshot::Reader) -> Result<(), snapshot::Error> {
        Ok(())
    }
}

impl BenchDriver {
    pub(crate) fn new(
        addresses: Addresses,
        mut plant: Box<dyn PlantSide>,
        outside: Outside,
        end: BenchEnd,
    ) -> Self {
        let rtt = Rtt::new(addresses.rtt_block);
        let sensors = plant.sensors();
        Self {
            addresses,
            rtt,
            meter: Meter::default(),
            plant,
            sensors,
            outside,
            end,
            wakes_at: None,
            received: Vec::new(),
            resets_seen: 0,
            patched: None,
            next: PERIOD,
            record: Record::default(),
        }
    }

    /// The driver of a run that goes on from `saved`, with another operator.
    pub(crate) fn resumed(addresses: Addresses, saved: &Saved, end: BenchEnd) -> Self {
        let mut driver = Self::new(addresses, saved.plant.duplicate(), saved.outside.clone(), end);
        driver.sensors = saved.sensors;
        driver.next = saved.next;
        driver.resets_seen = saved.resets_seen;
        driver
    }

    /// What the run leaves behind.
    pub(crate) fn into_record(self) -> Record {
        self.record
    }

    /// The pins and inputs as they are before the first instruction.
    pub(crate) fn wire_up(&self, part: &mut Part) {
        let at = VirtualNanos(0);
        for place in pins::DRIVE_ENABLE {
            pins::drive(part, at, place, false);
        }
        self.show_outside(part, at);
    }

    /// Switches and drives to their pins, voltages to their inputs.
    fn show_outside(&self, part: &mut Part, at: VirtualNanos) {
        let Outside { arm_switch, stop_pressed, healthy, held_microvolt, wiring, .. } = &self.outside;
        pins::drive(part, at, pins::ARM_SWITCH, *arm_switch != wiring.arm_switch_inverted);
        pins::drive(part, at, pins::STOP_RELEASED, wiring.stop_bridged || !stop_pressed);
        for (place, healthy) in pins::DRIVE_HEALTHY.into_iter().zip(healthy) {
            pins::drive(part, at, place, *healthy);
        }
        let arriving = wiring.arriving(&self.sensors, REFERENCE_MICROVOLT / 2);
        for (index, channel) in pins::ADC_CHANNELS.into_iter().enumerate() {
            let microvolt = held_microvolt[index].unwrap_or(arriving[index]);
            part.adc1.set_input(channel, microvolt);
        }
    }

    fn outputs(part: &mut Part, at: VirtualNanos) -> DriveInputs {
        DriveInputs {
            dac: [part.dac.pin(0), part.dac.pin(1)],
            enabled: pins::DRIVE_ENABLE.map(|place| pins::is_high(part, at, place)),
        }
    }

    fn note_outputs(&mut self, part: &mut Part, at: VirtualNanos) {
        let outputs = Self::outputs(part, at);
        // The converter's inputs at the DAC's own pins.
        for (code, channel) in outputs.dac.into_iter().zip(pins::DAC_CHANNELS) {
            let microvolt = u64::from(code.unwrap_or_default()) * u64::from(REFERENCE_MICROVOLT) / 4096;
            part.adc1.set_input(channel, u32::try_from(microvolt).unwrap_or_default());
        }
        self.record.note_outputs(at.0, outputs);
    }

    /// One period of the plant, and its edges into the encoders' timers.
    fn step_plant(&mut self, part: &mut Part, at: VirtualNanos) {
        let mut inputs = Self::outputs(part, at);
        for (code, wire) in inputs.dac.iter_mut().zip(self.outside.references) {
            *code = wire.pass(*code);
        }
        let wiring = self.outside.wiring;
        inputs.dac = wiring.followed(inputs.dac);
        let encoders = &mut part.encoders;
        self.sensors = self.plant.step(at, &inputs, &mut |motor, edge| {
            let plug = motor as usize;
            encoders[if wiring.encoders_exchanged { 1 - plug } else { plug }].push(edge);
        });
    }

    fn act(&mut self, action: Action, session: &mut Session<RigBoard>, stop: Stop, host: &mut dyn Host) {
        let part = &mut session.board_mut().part;
        match action {
            Action::ArmSwitch(on) => self.outside.arm_switch = on,
            Action::EmergencyStop(pressed) => self.outside.stop_pressed = pressed,
            Action::DriveHealthy(motor, healthy) => self.outside.healthy[motor as usize] = healthy,
            Action::AnalogueInput(index, held) => {
                if let Some(input) = self.outside.held_microvolt.get_mut(index) {
                    *input = held;
                }
            }
            Action::EncoderLine(motor, line, level) => part.encoders[motor as usize].stick(line, level),
            Action::EncodersExchanged(exchanged) => self.outside.wiring.encoders_exchanged = exchanged,
            Action::BridgesExchanged(exchanged) => self.outside.wiring.bridges_exchanged = exchanged,
            Action::BridgeReversed(bridge, reversed) => {
                if let Some(wires) = self.outside.wiring.bridge_reversed.get_mut(bridge) {
                    *wires = reversed;
                }
            }
            Action::MotorReversed(motor, reversed) => {
                self.outside.wiring.motor_reversed[motor as usize] = reversed;
            }
            Action::ArmSwitchInverted(inverted) => self.outside.wiring.arm_switch_inverted = inverted,
            Action::StopBridged(bridged) => self.outside.wiring.stop_bridged = bridged,
            Action::Hand(hand) => self.plant.touch(hand),
            Action::EncoderSwapped(motor, swapped) => part.encoders[motor as usize].swap(swapped),
            Action::EncoderDisturbed(motor, width_ns) => {
                part.encoders[motor as usize].disturb(Disturbance { at: stop.at, width_ns });
            }
            Action::Reference(motor, wire) => self.outside.references[motor as usize] = wire,
            Action::AdcScanCut => part.adc1.cut_next_scan(),
            Action::SerialStreamsLockUp => {
                interference::lock_up_serial_streams(part, stop.at);
            }
            Action::MaskInterrupts { times, from_ns, for_ns } => {
                let stub =
                    interference::masking_stub(host, self.addresses.low_handler, times, from_ns, for_ns);
                // Flash, which the bench may program as the models do.
                let _ = host.program(interference::vector(LOW_LINE), Width::W32, stub);
            }
            Action::AdcStalled(stalled) => part.adc1.stall(stalled),
            Action::LinkSilent(silent) => serial::silence(part, silent),
            Action::LinkGarbled(per_million) => serial::garble(part, per_million, 1),
            Action::Power(on) => {
                part.power(stop.at, on);
                if on {
                    // Now, while the core is still held: afterwards its start-up may have run.
                    lose_memory(session, host);
                    self.rtt.restarted(host);
                } else {
                    self.drain_log(host);
                }
            }
            Action::ResetPin => {
                self.drain_log(host);
                session.reset_by_pin(stop.at, stop.instruction_count, host);
                return;
            }
            Action::FlashWord(address, bytes) => {
                for (at, eight) in (address..).step_by(8).zip(bytes.as_chunks().0) {
                    // It is flash, which the bench may program as the models do.
                    let _ = host.program(at, Width::W64, u64::from_le_bytes(*eight));
                }
            }
            Action::HangTick => self.patch(self.addresses.tick_handler, ENDLESS_LOOP, host),
            Action::TrapTick => self.patch(self.addresses.tick_handler, UNDEFINED, host),
            Action::HangThreads => self.patch(self.addresses.low_handler, ENDLESS_LOOP, host),
        }
        self.show_outside(&mut session.board_mut().part, stop.at);
    }

    /// Puts an instruction where a handler begins; the next reset puts the handler back.
    fn patch(&mut self, address: u64, instruction: u64, host: &mut dyn Host) {
        if let Ok(original) = host.read(address, Width::W16)
            && host.program(address, Width::W16, instruction).is_ok()
        {
            self.patched = Some((address, original));
        }
    }

    fn drain_log(&mut self, host: &mut dyn Host) {
        let bytes = self.rtt.drain(host);
        self.record.log_bytes(&bytes);
    }

    /// The part restarts: the core has not run since.
    fn restarted(&mut self, session: &mut Session<RigBoard>, host: &mut dyn Host, at: VirtualNanos) {
        let new = session.resets().get(self.resets_seen..).unwrap_or_default().to_vec();
        self.resets_seen = session.resets().len();
        let powered_on = new.iter().any(|reset| reset.cause == ResetCause::PowerOn);
        if !powered_on {
            self.drain_log(host);
            self.rtt.restarted(host);
        }
        if let Some((address, original)) = self.patched.take() {
            // It was programmed there before.
            let _ = host.program(address, Width::W16, original);
        }
        self.meter.restarted();
        self.record.restarted(&new);
        self.note_outputs(&mut session.board_mut().part, at);
    }

    fn look_for_restart(&mut self, session: &mut Session<RigBoard>, host: &mut dyn Host, at: VirtualNanos) {
        if session.resets().len() != self.resets_seen {
            self.restarted(session, host, at);
        }
    }

    /// Lets the operator work until it waits; says whether it is still there.
    fn exchange(&mut self, session: &mut Session<RigBoard>, stop: Stop, host: &mut dyn Host) -> bool {
        if self.wakes_at.is_some_and(|at| self.received.is_empty() && stop.at.0 < at) {
            return true;
        }
        if self.wakes_at.take().is_some() {
            let bytes = std::mem::take(&mut self.received);
            if self.end.to_endpoint.send(ToEndpoint::Woken { now: stop.at.0, bytes }).is_err() {
                return false;
            }
        }
        loop {
            let Ok(message) = self.end.from_endpoint.recv() else { return false };
            match message {
                ToBench::Wait(until) => {
                    self.wakes_at = Some(until);
                    return true;
                }
                ToBench::Send(bytes) => serial::send(&mut session.board_mut().part, &bytes),
                ToBench::Act(action) => self.act(action, session, stop, host),
                ToBench::Ask(question) => {
                    let answer = self.answer(question, session, stop, host);
                    if self.end.to_endpoint.send(answer).is_err() {
                        return false;
                    }
                }
            }
        }
    }

    fn answer(
        &mut self,
        question: Question,
        session: &mut Session<RigBoard>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> ToEndpoint {
        let part = &mut session.board_mut().part;
        match question {
            Question::BeginMeasuring => {
                self.meter.begin();
                ToEndpoint::Done(Ok(()))
            }
            Question::EndMeasuring => ToEndpoint::Measured(Box::new(self.meter.end())),
            Question::Outputs => ToEndpoint::Outputs(Self::outputs(part, stop.at)),
            Question::WrongPins => ToEndpoint::WrongPins(pins::wrong_modes(part, stop.at)),
            Question::Memory { address, length } => ToEndpoint::Memory(
                (address..address + length)
                    .step_by(8)
                    .map_while(|at| host.read(at, Width::W64).ok())
                    .flat_map(u64::to_le_bytes)
                    .collect(),
            ),
            Question::TakeLog => {
                self.record.outputs.clear();
                ToEndpoint::Log(std::mem::replace(&mut self.record.log, vec![Vec::new()]))
            }
            Question::Register(address) => ToEndpoint::Register(interference::read(part, stop.at, address)),
            Question::Snapshot => {
                let taken = snapshot::take(session, host, stop, &self.addresses.digest, &NothingMore);
                ToEndpoint::Done(taken.map_err(|error| error.to_string()).map(|taken| {
                    self.record.saved = Some(Saved {
                        file: taken.file,
                        plant: self.plant.duplicate(),
                        sensors: self.sensors,
                        outside: self.outside.clone(),
                        next: self.next_after(session, stop.at.0),
                        resets_seen: self.resets_seen,
                    });
                }))
            }
        }
    }

    /// The start of the period after `now`.
    fn next_after(&self, session: &mut Session<RigBoard>, now: u64) -> u64 {
        let origin = session.board().part.tim6.last_trigger().map_or(0, |trigger| trigger.0);
        origin + PERIOD * ((now - origin) / PERIOD + 1)
    }
}

/// Fills all RAM with bytes that mean nothing, as it is found after a power-on.
fn lose_memory(session: &mut Session<RigBoard>, host: &mut dyn Host) {
    let regions: Vec<(u64, u64)> = session
        .board()
        .part
        .bus()
        .memory()
        .iter()
        .filter(|region| region.name != "flash")
        .map(|region| (region.base, region.size))
        .collect();
    let mut noise = 0x9E37_79B9_7F4A_7C15_u64;
    for (base, size) in regions {
        for address in (base..base + size).step_by(8) {
            noise ^= noise << 13;
            noise ^= noise >> 7;
            noise ^= noise << 17;
            // What cannot be written is no RAM.
            if host.write(address, Width::W64, noise).is_err() {
                break;
            }
        }
    }
}

impl Driver<RigBoard> for BenchDriver {
    fn on_settled(&mut self, session: &mut Session<RigBoard>, host: &mut dyn Host, settled: Settled) {
        match settled {
            Settled::Access { access, .. } => {
                if access.kind == AccessKind::Write {
                    let moment =
                        Moment { instructions: access.instruction_count, nanos: access.virtual_time.0 };
                    if access.address == pins::TICK_PULSE_BSRR {
                        if access.value & pins::TICK_PULSE_SET != 0 {
                            self.meter.pulse_up();
                        } else if access.value & (pins::TICK_PULSE_SET << 16) != 0 {
                            let trigger = session.board().part.tim6.last_trigger().map(|trigger| trigger.0);
                            self.meter.pulse_down(moment, trigger, PERIOD);
                        }
                    } else if access.address & !0x3FF == DAC.base || access.address & !0x3FF == GPIOD.base {
                        self.note_outputs(&mut session.board_mut().part, access.virtual_time);
                    }
                }
                self.look_for_restart(session, host, access.virtual_time);
            }
            Settled::Hit(hit) if hit.kind == HitKind::Instruction => {
                self.meter.handler_entered(Moment { instructions: hit.instruction_count, nanos: hit.at.0 });
            }
            Settled::Stop(stop) => self.look_for_restart(session, host, stop.at),
            _ => {}
        }
    }

    fn on_stop(
        &mut self,
        session: &mut Session<RigBoard>,
        stop: Stop,
        host: &mut dyn Host,
    ) -> Option<VirtualNanos> {
        self.look_for_restart(session, host, stop.at);
        if !session.unpowered() {
            self.drain_log(host);
        }
        let part = &mut session.board_mut().part;
        self.show_outside(part, stop.at);
        self.note_outputs(part, stop.at);
        self.step_plant(part, stop.at);
        self.received.extend(serial::take_received(part));
        self.record.last_at = stop.at.0;
        self.record.instructions = stop.instruction_count;
        if !self.exchange(session, stop, host) {
            return None;
        }
        self.next = self.next_after(session, stop.at.0);
        Some(VirtualNanos(self.next))
    }
}
