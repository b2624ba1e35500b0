//! Runs the emulator against the plant and the operator, one control period after the other.
//!
//! The bench's period begins where the firmware's does: with TIM6's trigger, which starts the scan. At that
//! instant the voltages at the analogue inputs become those of the plant now; then the plant goes one
//! period on with the torque references and enables that stand at the pins, and its encoders' edges are queued
//! over the period. So what a tick computes from the samples of one period acts from the start of the next: one
//! control period of delay, as in the PC rig.

use crate::branch::{Branches, Side};
use crate::elf::Firmware;
use crate::endpoint::{BenchEnd, Question, ToBench, ToEndpoint};
use crate::interference::Obstacle;
use crate::meter::{Meter, Moment};
use crate::outside::{Action, DriveInputs, Outside, PlantSide, Sensors};
use crate::part::Part;
use crate::part::adc_trigger::REFERENCE_MICROVOLT;
use crate::part::encoder_timer::{Disturbance, Edge};
use crate::record::{Record, Saved};
use crate::rtt::Rtt;
use crate::sighting::{Deviations, Lookout};
use crate::{board::RigBoard, interference, pins, probe, serial};
use rigless::device::ResetCause;
use rigless::emulator::{AccessKind, Driver, HitKind, Host, Settled, Stop, Watch};
use rigless::mcu::Mcu;
use rigless::session::Session;
use rigless::snapshot;
use rigless::soc::Width;
use rigless::soc::stm32h743::generated::{DAC, GPIOD};
use rigless::time::VirtualNanos;
use std::sync::{Mutex, OnceLock};

/// The control period, ns.
pub const PERIOD: u64 = 100_000;
/// Interrupt of the link's DMA, DMA1 stream 0 (RM0433 table 147).
const LOW_LINE: u64 = 11;
/// That of the executor's time, TIM3, which comes twice a millisecond, and the tick's, DMA1 stream 7.
const EXECUTOR_LINE: u64 = 29;
const TICK_LINE: u64 = 47;
/// What a loose contact reads as while it is open, µV.
const OPEN_MICROVOLT: u32 = 3_299_000;
/// Time between two counts of a jump, ns: longer than the input's filter.
const JUMP_NS: u64 = 150;
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

/// Where the chance of loose contacts begins, the same in every run.
const CHANCE_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// The next of a series of numbers without order (xorshift).
fn draw(state: &mut u64) -> u64 {
    *state ^= *state << 13;
    *state ^= *state >> 7;
    *state ^= *state << 17;
    *state
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
    /// Flash that a fault changed, as it was: address, width, value.
    patched: Vec<(u64, Width, u64)>,
    /// Code that a fault put in the core's way.
    in_the_way: Option<u64>,
    /// The stack is painted for a crash to come (`probe.rs`).
    crash_painted: bool,
    /// The crystal fails as the core arrives there: the same code asks for the interrupt that the failure is.
    crystal_fails: bool,
    lookout: Lookout,
    deviations: Deviations,
    /// Scans spoilt when the operator began to look out.
    spoilt: u64,
    /// Counts still to jump, and counts jumped so far.
    jumps: [(u32, i64); 2],
    chance: u64,
    /// Loose contacts that are open in this period.
    open: [bool; 5],
    /// In the last period a drive got another reference than the chip gave.
    wrong_reference: bool,
    next: u64,
    branches: Branches,
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
            patched: Vec::new(),
            in_the_way: None,
            crash_painted: false,
            crystal_fails: false,
            lookout: Lookout::default(),
            deviations: Deviations::default(),
            spoilt: 0,
            jumps: Default::default(),
            chance: CHANCE_SEED,
            open: [false; 5],
            wrong_reference: false,
            next: PERIOD,
            branches: Branches::default(),
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
    pub(crate) fn into_record(mut self) -> Record {
        self.record.seen = self.lookout.seen;
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
        let Outside { arm_switch, stop_pressed, healthy, held_microvolt, loose, wiring, .. } = &self.outside;
        pins::drive(part, at, pins::ARM_SWITCH, *arm_switch != wiring.arm_switch_inverted);
        pins::drive(part, at, pins::STOP_RELEASED, wiring.stop_bridged || !stop_pressed);
        for (place, healthy) in pins::DRIVE_HEALTHY.into_iter().zip(healthy) {
            pins::drive(part, at, place, *healthy);
        }
        let arriving = wiring.arriving(&self.sensors, REFERENCE_MICROVOLT / 2);
        for (index, channel) in pins::ADC_CHANNELS.into_iter().enumerate() {
            let open = loose[index] && self.open[index];
            let microvolt = match held_microvolt[index] {
                _ if open => OPEN_MICROVOLT,
                Some(held) => held,
                None => arriving[index],
            };
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

    /// What the scan of the coming period finds at the inputs.
    fn deviate(&mut self, wrong_reference: bool) {
        let Outside { held_microvolt, loose, wiring, .. } = &self.outside;
        let arriving = wiring.arriving(&self.sensors, REFERENCE_MICROVOLT / 2);
        for open in &mut self.open {
            *open = draw(&mut self.chance) & 1 != 0;
        }
        let held = held_microvolt.iter().zip(arriving);
        let is_other = |held: u32, plant: u32| held.abs_diff(plant) > REFERENCE_MICROVOLT >> 16;
        self.deviations.analogue = wrong_reference
            || held.into_iter().any(|(held, plant)| held.is_some_and(|held| is_other(held, plant)))
            || loose.iter().zip(self.open).any(|(loose, open)| *loose && open);
    }

    /// One period of the plant, and its edges into the encoders' timers. Says whether a drive gets another reference
    /// than the chip gives.
    fn step_plant(&mut self, part: &mut Part, at: VirtualNanos) -> bool {
        let mut inputs = Self::outputs(part, at);
        let mut wrong = false;
        for ((code, wire), enabled) in inputs.dac.iter_mut().zip(self.outside.references).zip(inputs.enabled)
        {
            let passed = wire.pass(*code);
            wrong |= enabled && passed != *code;
            *code = passed;
        }
        let wiring = self.outside.wiring;
        inputs.dac = wiring.followed(inputs.dac);
        let (encoders, jumps) = (&mut part.encoders, &mut self.jumps);
        let mut edges: [Vec<Edge>; 2] = Default::default();
        self.sensors = self.plant.step(at, &inputs, &mut |motor, edge| {
            let plug = motor as usize;
            edges[if wiring.encoders_exchanged { 1 - plug } else { plug }].push(edge);
        });
        for (which, edges) in edges.into_iter().enumerate() {
            jump(&mut jumps[which], at, edges, encoders[which].last_count(), &mut |edge| {
                encoders[which].push(edge);
            });
        }
        if self.lookout.is_on() {
            self.record.motion.push((at.0 + PERIOD, self.plant.motion()));
        }
        wrong
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
            Action::LowSpeedCrystal(hz) => part.fit_low_speed_crystal(hz),
            Action::AnalogSupply(millivolt) => part.set_analog_supply(millivolt),
            Action::AdcScanCut => part.adc1.cut_next_scan(),
            Action::SerialStreamsLockUp => {
                interference::lock_up_serial_streams(part, stop.at);
            }
            Action::MaskInterrupts { times, from_ns, for_ns } => {
                let stub = interference::masking_stub(host, self.addresses.low_handler, from_ns, for_ns);
                interference::mask_times(part, stop.at, times);
                self.program(interference::vector(LOW_LINE), Width::W32, stub, host);
                self.watch(interference::MASKED_AT, host);
            }
            Action::AnalogueFrozen(index) => {
                if let Some(input) = self.outside.held_microvolt.get_mut(index) {
                    *input = self.sensors.microvolt.get(index).copied();
                }
            }
            Action::AnalogueLoose(index, loose) => {
                if let Some(input) = self.outside.loose.get_mut(index) {
                    *input = loose;
                }
            }
            Action::EncoderJump(motor, counts) => {
                self.jumps[motor as usize].0 = counts;
                self.deviations.encoders[motor as usize] = true;
            }
            Action::HangMasked => self.obstruct(EXECUTOR_LINE, Obstacle::HangMasked, host),
            Action::BusError => self.obstruct(TICK_LINE, Obstacle::Reads(interference::NOTHING), host),
            Action::SupplyFalls => self.obstruct(TICK_LINE, Obstacle::SupplyFalls, host),
            Action::StrayRead(address) => self.obstruct(TICK_LINE, Obstacle::Reads(address), host),
            Action::StrayWrite(address) => self.obstruct(TICK_LINE, Obstacle::Writes(address), host),
            Action::ReadMap => {
                let vector = interference::vector(TICK_LINE);
                if let Ok(original) = host.read(vector, Width::W32) {
                    let reader = probe::map_reader(host, original);
                    self.program(vector, Width::W32, reader, host);
                }
            }
            Action::MeasureStack => {
                for (which, (line, painted, _)) in (0..).zip(probe::MEASURED) {
                    let vector = interference::vector(line);
                    if let Ok(original) = host.read(vector, Width::W32) {
                        let meter = probe::depth_meter(host, which, original, painted);
                        self.program(vector, Width::W32, meter, host);
                    }
                }
            }
            Action::MeasureCrash(crash) => {
                let vector = interference::vector(TICK_LINE);
                if let Ok(original) = host.read(vector, Width::W32) {
                    let meter = probe::crash_meter(host, crash, original);
                    self.program(vector, Width::W32, meter, host);
                    self.crash_painted = true;
                }
            }
            Action::ReceiverLocked(locked) => interference::lock_receiver(part, stop.at, locked),
            Action::ClockFails => {
                self.crystal_fails = true;
                self.obstruct(TICK_LINE, Obstacle::ClockFailure, host);
            }
            Action::FlipBit { address, bit } => {
                if let Ok(byte) = host.read(address, Width::W8) {
                    // It is RAM: it was read just now.
                    let _ = host.write(address, Width::W8, byte ^ 1 << (bit & 7));
                }
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
        self.program(address, Width::W16, instruction, host);
        self.watch(address, host);
    }

    /// Puts code before the handler of an interrupt; the next reset puts the vector back.
    fn obstruct(&mut self, line: u64, what: Obstacle, host: &mut dyn Host) {
        let vector = interference::vector(line);
        if let Ok(original) = host.read(vector, Width::W32) {
            let stub = interference::obstacle(host, original, what);
            self.program(vector, Width::W32, stub, host);
            self.watch(interference::STUB, host);
        }
    }

    /// Changes code or a vector until the next reset: in flash, or in ITCM, where the start puts everything anew.
    fn program(&mut self, address: u64, width: Width, value: u64, host: &mut dyn Host) {
        let Ok(original) = host.read(address, width) else { return };
        if host.program(address, width, value).is_ok() {
            self.patched.push((address, width, original));
        } else {
            // It is RAM: it was read just now.
            let _ = host.write(address, width, value);
        }
    }

    /// Sees to it that the core's arrival at this instruction is noticed.
    fn watch(&mut self, address: u64, host: &mut dyn Host) {
        host.watch(Watch::Instruction(address));
        self.in_the_way = Some(address);
    }

    fn drain_log(&mut self, host: &mut dyn Host) {
        let bytes = self.rtt.drain(host);
        self.record.log_bytes(&bytes);
    }

    /// The part restarts: the core has not run since.
    fn restarted(&mut self, session: &mut Session<RigBoard>, host: &mut dyn Host, at: VirtualNanos) {
        let new = session.resets().get(self.resets_seen..).unwrap_or_default().to_vec();
        self.resets_seen = session.resets().len();
        if std::mem::take(&mut self.crash_painted) {
            self.record.crash_depths.push(probe::crash_depth(host));
        }
        let powered_on = new.iter().any(|reset| reset.cause == ResetCause::PowerOn);
        if !powered_on {
            self.drain_log(host);
            self.rtt.restarted(host);
        }
        for (address, width, original) in self.patched.drain(..).rev() {
            // It was programmed there before.
            let _ = host.program(address, width, original);
        }
        self.lookout.restarted(at.0);
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
                ToBench::Branch { jobs, at_once } => self.branches = Branches::new(jobs, at_once),
                ToBench::NextBranch { begin_more } => {
                    if !begin_more {
                        self.branches.begin_no_more();
                    }
                    let result = match self.branches.next() {
                        Ok(Side::Trunk(result)) => Ok(result),
                        Ok(Side::Branch(job)) => {
                            // In a process of its own, with an operator of its own; the other branches are the trunk's.
                            self.branches = Branches::default();
                            let trunks = std::mem::replace(&mut self.end, job.begin(stop.at.0));
                            // Never closed: the trunk's operator may have been on its way into its wait at the fork, and hold a
                            // lock of the channel that nobody here will ever release.
                            std::mem::forget(trunks);
                            continue;
                        }
                        Err(error) => Err(error.to_string()),
                    };
                    if self.end.to_endpoint.send(ToEndpoint::Branched(result)).is_err() {
                        return false;
                    }
                }
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
            Question::LookOut(wanted) => {
                self.lookout.begin(wanted);
                self.spoilt = part.adc1.spoilt();
                ToEndpoint::Done(Ok(()))
            }
            Question::Record => {
                let mut record = std::mem::take(&mut self.record);
                record.seen.clone_from(&self.lookout.seen);
                ToEndpoint::Record(Box::new(record))
            }
            Question::Motion => ToEndpoint::Motion(self.plant.motion()),
            Question::Seen => ToEndpoint::Seen(self.lookout.seen.clone()),
            Question::Snapshot => {
                let taken = snapshot::take(session, host, stop, &self.addresses.digest, &NothingMore);
                ToEndpoint::Done(taken.map_err(|error| error.to_string()).map(|taken| {
                    self.record.saved = Some(Saved {
                        file: Mutex::new(taken.file),
                        read: OnceLock::new(),
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

/// Hands an encoder's edges of a period on, with the counts between them that a jump adds.
fn jump(
    (left, jumped): &mut (u32, i64),
    at: VirtualNanos,
    mut edges: Vec<Edge>,
    last: i64,
    push: &mut dyn FnMut(Edge),
) {
    let mut count = last;
    if *left > 0 {
        // Each edge of the plant becomes a step up or down from where the jump has come to by then.
        let mut steps: Vec<(VirtualNanos, i64)> = Vec::new();
        let mut before = last - *jumped;
        for edge in edges.drain(..) {
            steps.push((edge.at, edge.count - before));
            before = edge.count;
        }
        steps.extend((1..=u64::from(*left)).map(|nth| (VirtualNanos(at.0 + nth * JUMP_NS), 1)));
        steps.sort_unstable();
        (*jumped, *left) = (*jumped + i64::from(*left), 0);
        for (at, step) in steps {
            count += step;
            push(Edge { at, count });
        }
    }
    for edge in edges {
        push(Edge { at: edge.at, count: edge.count + *jumped });
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
    let mut noise = CHANCE_SEED;
    for (base, size) in regions {
        for address in (base..base + size).step_by(8) {
            // What cannot be written is no RAM.
            if host.write(address, Width::W64, draw(&mut noise)).is_err() {
                break;
            }
        }
    }
}

impl Driver<RigBoard> for BenchDriver {
    fn on_settled(&mut self, session: &mut Session<RigBoard>, host: &mut dyn Host, settled: Settled) {
        match settled {
            Settled::Access { access, value } => {
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
                if self.lookout.is_looking() {
                    let part = &session.board().part;
                    self.deviations.scan = part.adc1.spoilt() != self.spoilt;
                    for (deviated, encoder) in self.deviations.encoders.iter_mut().zip(&part.encoders) {
                        *deviated |= encoder.deviated();
                    }
                    self.lookout.access(&access, value, &self.deviations);
                }
                self.look_for_restart(session, host, access.virtual_time);
            }
            Settled::Hit(hit) if hit.kind == HitKind::Instruction => {
                if self.in_the_way == Some(hit.address) {
                    if std::mem::take(&mut self.crystal_fails) {
                        session.board_mut().part.fail_crystal(hit.at);
                    }
                    self.lookout.arrived(hit.address, hit.at.0);
                    self.record.arrivals.push(hit.at.0);
                }
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
        part.run_low_speed_crystal(stop.at);
        self.show_outside(part, stop.at);
        self.note_outputs(part, stop.at);
        let wrong_reference = std::mem::take(&mut self.wrong_reference);
        self.deviate(wrong_reference);
        self.wrong_reference = self.step_plant(part, stop.at);
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
