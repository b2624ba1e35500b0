//! One control tick: `step(&config, &mut state, &samples) -> outputs`.
//!
//! The firmware calls it from the control interrupt, the PC from its simulation; both get the same bits.
//! Between two ticks [`apply`] takes at most one command.
//!
//! This is the frame: it counts ticks, scales the analogue inputs and keeps the outputs safe. Nothing arms yet.

use super::command::{Command, Refusal, Refused};
use super::config::ControlConfig;
use super::event::{Event, EventKind, EventQueue, Reason};
use super::fault::FaultSet;
use super::limit::LimitSet;
use super::outputs::{DAC_ZERO, Leds, Outputs, Record};
use super::samples::Samples;
use super::sequencer::SequencerState;
use super::supervisor::{Mode, Restart};

/// Everything that changes from tick to tick.
#[derive(Debug, Clone)]
pub struct ControlState {
    tick: u64,
    mode: Mode,
    restart: Restart,
    events: EventQueue,
}

impl ControlState {
    /// The state after an ordinary start.
    #[must_use]
    pub fn new(config: &ControlConfig) -> Self {
        Self::after(config, Restart::Ordinary, true)
    }

    /// The state after a restart of another kind, or with settings that could not be read: the fault is latched
    /// when the self-check ends.
    #[must_use]
    pub fn after(_config: &ControlConfig, restart: Restart, _settings_intact: bool) -> Self {
        Self { tick: 0, mode: Mode::Boot, restart, events: EventQueue::default() }
    }

    /// Mode of the supervisor.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.mode
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
    let result = match command {
        Command::SetConfig(new) if state.mode == Mode::Disabled => {
            *config = *new;
            state.events.push(state.tick, EventKind::ConfigChanged);
            Ok(())
        }
        _ => Err(Refused::because(Refusal::Starting)),
    };
    if let Err(refused) = result {
        state.events.push(state.tick, EventKind::CommandRefused(refused));
    }
    result
}

/// One control tick.
pub fn step(config: &ControlConfig, state: &mut ControlState, samples: &Samples) -> Outputs {
    let settings = &config.settings;
    let scale = |code: u16, zero: f32, gain: f32| (f32::from(code) - zero) * gain;
    if state.mode == Mode::Boot && state.tick >= u64::from(config.boot_ticks) {
        let (from, to, reason) = (Mode::Boot, Mode::Disabled, Reason::SelfCheckDone);
        state.mode = to;
        state.events.push(state.tick, EventKind::ModeChanged { from, to, reason });
    }
    let record = Record {
        tick: state.tick,
        m1_torque_ref_nm: 0.0,
        m1_torque_nm: scale(
            samples.adc.m1_torque,
            settings.m1.monitor_zero_code,
            settings.m1.monitor_nm_per_code,
        ),
        m1_angle_rad: 0.0,
        m1_count: 0,
        m2_torque_ref_nm: 0.0,
        m2_torque_nm: scale(
            samples.adc.m2_torque,
            settings.m2.monitor_zero_code,
            settings.m2.monitor_nm_per_code,
        ),
        m2_angle_rad: 0.0,
        m2_count: 0,
        m2_revolution: 0.0,
        m2_speed_ref_rad_s: 0.0,
        m2_speed_rad_s: 0.0,
        normal_force_n: scale(
            samples.adc.normal_bridge,
            settings.normal_bridge.zero_code,
            settings.normal_bridge.unit_per_code,
        ),
        friction_torque_nm: scale(
            samples.adc.friction_bridge,
            settings.friction_bridge.zero_code,
            settings.friction_bridge.unit_per_code,
        ),
        predicted_friction_torque_nm: 0.0,
        residual_nm: 0.0,
        residual_mean_square_nm2: 0.0,
        supply_v: scale(samples.adc.supply, 0.0, settings.supply.volt_per_code),
        mode: state.mode,
        fault: None,
        faults: FaultSet::EMPTY,
        causes: FaultSet::EMPTY,
        limits: LimitSet::EMPTY,
        sequencer: SequencerState::Empty,
        experiment_tick: 0,
        deadline_misses: 0,
    };
    state.tick += 1;
    Outputs { dac: [DAC_ZERO; 2], drive_enable: [false; 2], leds: Leds::default(), record }
}

#[cfg(test)]
mod tests {
    use super::super::settings::ControlSettings;
    use super::*;

    #[test]
    fn outputs_are_safe_from_the_first_tick_on() {
        let config = ControlSettings::default().build().unwrap();
        let mut state = ControlState::new(&config);
        for _ in 0..2000 {
            assert!(step(&config, &mut state, &Samples::default()).is_safe());
        }
        assert_eq!(state.mode(), Mode::Disabled);
    }
}
