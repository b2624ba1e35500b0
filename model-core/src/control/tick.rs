//! One control tick: `step(&config, &mut state, &samples) -> outputs`.
//!
//! The firmware calls it from the control interrupt, the PC from its simulation; both get the same bits. Between two
//! ticks [`apply`] takes commands.
//!
//! Order within a tick: measure → guard → supervisor → sequencer → loops → observer → outputs. A fault that can be
//! known from the samples of a tick makes the outputs of that same tick safe, because the outputs are gated by the mode
//! after everything else.

use super::bridge::{BridgeReading, BridgeState, TareState};
use super::command::{Command, Refusal, Refused};
use super::config::ControlConfig;
use super::encoder::EncoderState;
use super::encoder_watch::{FreeWatchState, SprungWatchState};
use super::event::{Event, EventKind, EventQueue};
use super::fault::{Fault, FaultSet};
use super::guard::{GuardState, Sight};
use super::inputs::InputState;
use super::limit::LimitSet;
use super::m1::MotorCommand;
use super::m2::{M2Measured, M2State};
use super::observer::{Observed, ObserverState};
use super::outputs::{Leds, Outputs, Record};
use super::samples::Samples;
use super::sequencer::{Demand, M2Mode, Sequencer, SequencerState};
use super::speed::SpeedState;
use super::supervisor::{Mode, Restart, Supervisor, Watch};
use super::torque_loop::TorqueState;
use super::torque_watch::TorqueWatchState;
use crate::extension::ExtendedInput;

/// Torque of M1 below which the contact counts as left alone, for a tare.
const M1_AT_REST_NM: f32 = 0.2;

/// Half of a blink of a lamp, as a bit of the tick counter: 0.2 s at 10 kHz.
const BLINK_TICKS: u64 = 1 << 11;

/// What the motors are asked for while they are brought to rest.
const STOP: Demand = Demand { m1_torque_nm: 0.0, m2_mode: M2Mode::Speed, m2: 0.0 };

/// Everything that changes from tick to tick. In the order in which it is written here: the observer, which remembers hundreds of
/// samples, comes last, so that an instruction of the chip reaches what comes before without an address of its own.
#[derive(Debug, Clone)]
#[repr(C)]
pub struct ControlState {
    tick: u64,
    restart: Restart,
    supervisor: Supervisor,
    sequencer: Sequencer,
    events: EventQueue,
    limits_reported: LimitSet,
    guard: GuardState,
    inputs: InputState,
    measuring: MeasuringState,
    tare: TareState,
    m1: TorqueState,
    m2: M2State,
    torque_watch: [TorqueWatchState; 2],
    observer: ObserverState,
}

/// What turns samples into SI units.
#[derive(Debug, Clone)]
struct MeasuringState {
    m1_encoder: EncoderState,
    m2_encoder: EncoderState,
    speed: SpeedState,
    friction: BridgeState,
    normal: BridgeState,
    m1_watch: SprungWatchState,
    m2_watch: FreeWatchState,
    at_rest: bool,
    counts_irregular: bool,
}

/// Samples of one tick in SI units.
struct Measured {
    m1_torque_nm: f32,
    m2_torque_nm: f32,
    m2_speed_rad_s: f32,
    friction: BridgeReading,
    normal: BridgeReading,
    supply_v: f32,
    m1_jump: bool,
    m2_jump: bool,
}

impl MeasuringState {
    fn new(config: &ControlConfig) -> Self {
        Self {
            m1_encoder: EncoderState::default(),
            m2_encoder: EncoderState::default(),
            speed: SpeedState::default(),
            friction: config.friction_bridge.fresh(),
            normal: config.normal_bridge.fresh(),
            m1_watch: SprungWatchState::default(),
            m2_watch: FreeWatchState::default(),
            at_rest: false,
            counts_irregular: false,
        }
    }

    fn step(&mut self, config: &ControlConfig, samples: &Samples) -> Measured {
        let (s, adc) = (&config.settings, &samples.adc);
        // The change of a step needs two regular ones in a row.
        let was_irregular = core::mem::replace(&mut self.counts_irregular, samples.counts_irregular);
        let regular = !(samples.counts_irregular || was_irregular);
        let m1 = config.m1_encoder.step(&mut self.m1_encoder, samples.m1_count, regular);
        let m2 = config.m2_encoder.step(&mut self.m2_encoder, samples.m2_count, regular);
        let m2_speed_rad_s = config.speed.step(&mut self.speed, m2.counts);
        let m1_torque_nm = (f32::from(adc.m1_torque) - s.m1.monitor_zero_code) * s.m1.monitor_nm_per_code;
        let m2_torque_nm = (f32::from(adc.m2_torque) - s.m2.monitor_zero_code) * s.m2.monitor_nm_per_code;
        self.at_rest = libm::fabsf(m2_speed_rad_s) < s.timing.rest_speed_rad_s
            && libm::fabsf(m1_torque_nm) < M1_AT_REST_NM;
        Measured {
            m1_torque_nm,
            m2_torque_nm,
            m2_speed_rad_s,
            friction: config.friction_bridge.step(&mut self.friction, adc.friction_bridge),
            normal: config.normal_bridge.step(&mut self.normal, adc.normal_bridge),
            supply_v: f32::from(adc.supply) * s.supply.volt_per_code,
            m1_jump: m1.jump,
            m2_jump: m2.jump,
        }
    }

    /// What the guard looks at. Lost encoders are looked for only while the drives are enabled: before that a hand
    /// may turn the disc.
    fn sight(&mut self, config: &ControlConfig, m: &Measured, mode: Mode) -> Sight {
        let (mut m1_loss, mut m2_loss) = (None, None);
        if mode.is_live() {
            let count = self.m1_encoder.count();
            m1_loss = config.m1_watch.step(&mut self.m1_watch, count, m.m1_torque_nm);
            let (count, friction_nm) = (self.m2_encoder.count(), m.friction.filtered);
            let (speed, torque) = (m.m2_speed_rad_s, m.m2_torque_nm);
            m2_loss = config.m2_watch.step(&mut self.m2_watch, count, speed, torque, friction_nm);
        } else {
            (self.m1_watch, self.m2_watch) = (SprungWatchState::default(), FreeWatchState::default());
        }
        Sight {
            speed_rad_s: m.m2_speed_rad_s,
            m1_torque_nm: m.m1_torque_nm,
            m2_torque_nm: m.m2_torque_nm,
            normal_force_n: m.normal.filtered,
            supply_v: m.supply_v,
            friction_bridge: m.friction.failure,
            normal_bridge: m.normal.failure,
            m1_jump: m.m1_jump,
            m2_jump: m.m2_jump,
            m1_loss,
            m2_loss,
            m1_mismatch: false,
            m2_mismatch: false,
            link_needed: mode.is_live(),
        }
    }
}

impl ControlState {
    /// The state after an ordinary start.
    #[must_use]
    pub fn new(config: &ControlConfig) -> Self {
        Self::after(config, Restart::Ordinary, true)
    }

    /// The state after a restart of another kind, or with settings that could not be read: the fault is latched when
    /// the self-check ends.
    #[must_use]
    pub fn after(config: &ControlConfig, restart: Restart, settings_intact: bool) -> Self {
        Self {
            tick: 0,
            restart,
            supervisor: Supervisor::new(restart, settings_intact),
            sequencer: Sequencer::default(),
            events: EventQueue::default(),
            limits_reported: LimitSet::EMPTY,
            guard: GuardState::default(),
            inputs: InputState::new(config.timing.permission_ticks),
            measuring: MeasuringState::new(config),
            tare: TareState::default(),
            m1: TorqueState::default(),
            m2: M2State::default(),
            torque_watch: Default::default(),
            observer: config.observer.fresh(),
        }
    }

    #[cfg(test)]
    pub(super) fn flip_bit_of_mode(&mut self, bit: u32) {
        self.supervisor.flip_bit_of_mode(bit);
    }

    /// Mode of the supervisor.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.supervisor.mode()
    }

    /// Why the controller started.
    #[must_use]
    pub fn restart(&self) -> Restart {
        self.restart
    }

    /// The oldest event that waits; call it after each tick until it gives none.
    pub fn pop_event(&mut self) -> Option<Event> {
        self.events.pop()
    }

    /// Events lost because nobody took them.
    #[must_use]
    pub fn events_lost(&self) -> u32 {
        self.events.lost()
    }

    /// Takes a new configuration: everything measured starts afresh but the positions that are `kept`, for whoever
    /// compares where the disc was in two experiments; mode, tick and events go on.
    fn adopt(&mut self, config: &ControlConfig, kept: [Option<EncoderState>; 2]) {
        self.measuring = MeasuringState::new(config);
        self.measuring.m1_encoder = kept[0].unwrap_or_default();
        self.measuring.m2_encoder = kept[1].unwrap_or_default();
        self.sequencer.unload();
        self.tare = TareState::default();
        self.observer = config.observer.fresh();
    }

    /// Averages both bridges, if that was asked for, and sets their zeros at the end.
    fn step_tare(&mut self, config: &ControlConfig, samples: &Samples) {
        if !self.tare.is_going_on() {
            return;
        }
        if !self.measuring.at_rest || self.mode().has_torque() {
            self.tare.abort();
            self.events.push(self.tick, EventKind::TareAborted);
            return;
        }
        let (friction, normal) = (samples.adc.friction_bridge, samples.adc.normal_bridge);
        let Some(zeros) = config.tare.step(&mut self.tare, friction, normal) else { return };
        let (friction, normal) = (&config.friction_bridge, &config.normal_bridge);
        let (friction_zero_code, normal_zero_code) = (zeros.friction_code, zeros.normal_code);
        let kind = if friction.accepts_zero(friction_zero_code) && normal.accepts_zero(normal_zero_code) {
            self.measuring.friction.set_zero(friction_zero_code);
            self.measuring.normal.set_zero(normal_zero_code);
            EventKind::TareDone { friction_zero_code, normal_zero_code }
        } else {
            EventKind::TareRefused {
                friction_nm: friction.untared(friction_zero_code),
                normal_n: normal.untared(normal_zero_code),
            }
        };
        self.events.push(self.tick, kind);
    }

    /// What the motors are asked for in this tick, and the limits that act.
    fn step_loops(&mut self, config: &ControlConfig, m: &Measured) -> ([MotorCommand; 2], LimitSet) {
        let demand = match self.mode() {
            Mode::Running => self.sequencer.step().unwrap_or_else(|| {
                self.supervisor.finish(self.tick, &mut self.events);
                STOP
            }),
            Mode::Stopping => STOP,
            _ => {
                (self.m1, self.m2) = (TorqueState::default(), M2State::default());
                return ([MotorCommand::default(); 2], LimitSet::EMPTY);
            }
        };
        let mut limits = LimitSet::EMPTY;
        let m1 = config.m1.step(&mut self.m1, demand.m1_torque_nm, m.m1_torque_nm, &mut limits);
        let measured = M2Measured {
            torque_nm: m.m2_torque_nm,
            speed_rad_s: m.m2_speed_rad_s,
            friction_torque_nm: m.friction.filtered,
        };
        let m2 = config.m2.step(&mut self.m2, demand.m2_mode, demand.m2, &measured, &mut limits);
        if !(m1.command_nm.is_finite() && m2.command_nm.is_finite()) {
            let mut faults = FaultSet::EMPTY;
            faults.insert(Fault::CalculationInvalid);
            self.supervisor.latch(faults, self.tick, &mut self.events);
        }
        for limit in limits.without(self.limits_reported).iter() {
            self.events.push(self.tick, EventKind::LimitReached(limit));
        }
        self.limits_reported = self.limits_reported.union(limits);
        ([m1, m2], limits)
    }

    fn record(
        &self,
        config: &ControlConfig,
        m: &Measured,
        commands: &[MotorCommand; 2],
        limits: LimitSet,
        observed: &Observed,
    ) -> Record {
        let [m1, m2] = commands;
        let x = &self.measuring;
        Record {
            tick: self.tick,
            m1_torque_ref_nm: m1.reference_nm,
            m1_torque_nm: m.m1_torque_nm,
            m1_angle_rad: config.m1_encoder.angle_rad(&x.m1_encoder),
            m1_count: x.m1_encoder.count(),
            m2_torque_ref_nm: m2.reference_nm,
            m2_torque_nm: m.m2_torque_nm,
            m2_angle_rad: config.m2_encoder.angle_rad(&x.m2_encoder),
            m2_count: x.m2_encoder.count(),
            m2_turns: config.m2_encoder.turns(&x.m2_encoder),
            m2_speed_ref_rad_s: self.m2.speed_ref_rad_s(),
            m2_speed_rad_s: m.m2_speed_rad_s,
            normal_force_n: m.normal.value,
            friction_torque_nm: m.friction.value,
            predicted_friction_torque_nm: observed.predicted_nm,
            residual_nm: observed.residual_nm,
            residual_mean_square_nm2: observed.mean_square_nm2,
            supply_v: m.supply_v,
            mode: self.mode(),
            fault: self.supervisor.first_fault(),
            faults: self.supervisor.latched(),
            causes: self.supervisor.causes(),
            limits,
            sequencer: self.sequencer.state(),
            experiment_tick: self.sequencer.elapsed(),
            deadline_misses: self.guard.deadline_misses(),
        }
    }

    fn leds(&self) -> Leds {
        let blink = self.tick & BLINK_TICKS == 0;
        let mode = self.mode();
        let hindered = !self.supervisor.causes().is_empty();
        Leds {
            ready: mode.is_live() || (mode == Mode::Disabled && !hindered),
            live: mode == Mode::Armed || (mode.has_torque() && blink),
            fault: mode == Mode::Fault || (hindered && blink),
        }
    }
}

/// Carries out one command between two ticks.
///
/// # Errors
/// Why the command was refused; the same goes into the events.
pub fn apply(
    config: &mut ControlConfig,
    state: &mut ControlState,
    command: Command<'_>,
) -> Result<(), Refused> {
    let result = carry_out(config, state, command);
    if let Err(refused) = result {
        state.events.push(state.tick, EventKind::CommandRefused(refused));
    }
    result
}

fn carry_out(
    config: &mut ControlConfig,
    state: &mut ControlState,
    command: Command<'_>,
) -> Result<(), Refused> {
    let (tick, mode) = (state.tick, state.mode());
    let (supervisor, events) = (&mut state.supervisor, &mut state.events);
    let refuse = |reason| Err(Refused::because(reason));
    match command {
        Command::Arm => supervisor.arm(tick, events)?,
        Command::Disarm => {
            supervisor.disarm(tick, events);
            state.sequencer.stop();
        }
        Command::Start => {
            let ready = state.sequencer.state() != SequencerState::Empty;
            supervisor.start(ready, tick, events)?;
            state.sequencer.start();
            state.limits_reported = LimitSet::EMPTY;
        }
        Command::Stop => {
            supervisor.stop(tick, events)?;
            state.sequencer.stop();
        }
        Command::ClearFault => supervisor.clear(tick, events)?,
        Command::Tare => match mode {
            Mode::Boot => return refuse(Refusal::Starting),
            Mode::Running | Mode::Stopping => return refuse(Refusal::Running),
            _ if !state.measuring.at_rest => return refuse(Refusal::NotAtRest),
            _ => config.tare.start(&mut state.tare),
        },
        Command::LoadExperiment(_) if mode.has_torque() => return refuse(Refusal::Running),
        Command::LoadExperiment(experiment) => {
            state.sequencer.load(experiment);
            events.push(tick, EventKind::ExperimentLoaded { duration_ticks: experiment.duration_ticks() });
        }
        Command::SetModel(model) => {
            config.set_model(model);
            state.observer = config.observer.fresh();
            events.push(tick, EventKind::ModelChanged);
        }
        Command::SetConfig(_) if !matches!(mode, Mode::Disabled | Mode::Fault) => {
            return refuse(if mode == Mode::Boot { Refusal::Starting } else { Refusal::NotDisabled });
        }
        Command::SetConfig(new) => {
            let kept = [
                config.m1_encoder.counts_like(&new.m1_encoder).then_some(state.measuring.m1_encoder),
                config.m2_encoder.counts_like(&new.m2_encoder).then_some(state.measuring.m2_encoder),
            ];
            *config = *new;
            events.push(tick, EventKind::ConfigChanged);
            state.adopt(config, kept);
        }
    }
    Ok(())
}

/// One control tick.
pub fn step(config: &ControlConfig, state: &mut ControlState, samples: &Samples) -> Outputs {
    let m = state.measuring.step(config, samples);
    let lines = state.inputs.step(samples, config.timing.permission_ticks);
    let mut sight = state.measuring.sight(config, &m, state.supervisor.mode());
    if state.mode().is_live() {
        let [m1, m2] = &mut state.torque_watch;
        sight.m1_mismatch = config.m1_torque_watch.step(m1, m.m1_torque_nm);
        sight.m2_mismatch = config.m2_torque_watch.step(m2, m.m2_torque_nm);
    } else {
        state.torque_watch = Default::default();
    }
    let watch = Watch {
        causes: config.guard.step(&mut state.guard, samples, &lines, &sight),
        arm_switch: lines.arm_switch,
        arm_switch_off: !samples.arm_switch,
        at_rest: state.measuring.at_rest,
    };
    state.supervisor.step(&config.timing, watch, state.tick, &mut state.events);
    state.step_tare(config, samples);
    let (commands, limits) = state.step_loops(config, &m);
    let measured = ExtendedInput {
        disc_speed_rad_s: m.m2_speed_rad_s,
        disc_angle_rad: config.m2_encoder.angle_in_turn_rad(&state.measuring.m2_encoder),
        normal_force_n: m.normal.value,
    };
    let observed = config.observer.step(&mut state.observer, &measured, m.friction.value);
    let mode = state.mode();
    // Whatever the loops say, there is no torque and no enable but by the mode at the end of the tick.
    let commands = if mode.has_torque() { commands } else { [MotorCommand::default(); 2] };
    if !mode.has_torque() {
        state.sequencer.stop();
    }
    let dac = [config.m1_dac.code(commands[0].command_nm), config.m2_dac.code(commands[1].command_nm)];
    let [m1, m2] = &mut state.torque_watch;
    m1.commanded(config.m1_dac.torque_nm(dac[0]));
    m2.commanded(config.m2_dac.torque_nm(dac[1]));
    let record = state.record(config, &m, &commands, limits, &observed);
    let outputs = Outputs { dac, drive_enable: [mode.is_live(); 2], leds: state.leds(), record };
    state.tick = state.tick.wrapping_add(1);
    outputs
}
