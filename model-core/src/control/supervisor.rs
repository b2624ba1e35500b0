//! The supervisor: which mode the rig is in, and whether the drives may have torque.
//!
//! ```text
//!         self-check             arm               start
//!  Boot ────────────▶ Disabled ───────▶ Armed ────────────▶ Running
//!   │                  ▲    ▲  ◀───────   ▲                    │ end, stop
//!   │ damaged settings,│    │   disarm    └──── Stopping ◀─────┘
//!   ▼ watchdog, panic  │    │                at rest, or too long
//!  Fault ──────────────┘    └── disarm or arm switch off, from Armed, Running, Stopping
//!    ▲      clear
//!    └── any cause while Armed, Running, Stopping
//! ```
//!
//! Drives are enabled in `Armed`, `Running` and `Stopping` only, and torque other than zero exists in the last two
//! only. To arm takes the command **and** the arm switch, and the switch must have been seen off since the start and
//! since the last fault, so a switch left on never arms by itself.
//!
//! Arming asks for no tare. A tare makes the readings better and nothing safer: it moves the bridges' zeros by no more than
//! `tare_limit` (1 N·m, 15 N), no torque is enabled by a reading of theirs, and the normal force at which the drives go off
//! is held by the bridge's raw code too, which no tare moves (`caps.rs`). It may also be taken while armed.
//!
//! A cause latches while the drives are enabled. While they are disabled it only stands in the way of arming and is
//! shown: nothing had to be stopped, so there is nothing to clear. What is found at the start (damaged settings,
//! watchdog, panic, trap) is latched when the self-check ends. Faults are cleared by command, with no cause left; new
//! causes while in `Fault` are added, so that all of them can be read.

use super::command::{Refusal, Refused};
use super::event::{EventKind, EventQueue, Reason};
use super::fault::{Fault, FaultSet};
use super::numbered::numbered;

numbered! {
    /// Mode of the rig. `Boot`, `Stopping` and `Fault` cannot be commanded.
    pub enum Mode {
        Boot = 0, "The controller checks itself after its start.";
        Disabled = 1, "Drives are off.";
        Armed = 2, "Drives are on, at zero torque.";
        Running = 3, "An experiment runs.";
        Stopping = 4, "The motors are being brought to rest.";
        Fault = 5, "A fault is latched; drives are off.";
    }
}

impl Mode {
    /// Whether the drives are enabled.
    #[must_use]
    pub const fn is_live(self) -> bool {
        matches!(self, Self::Armed | Self::Running | Self::Stopping)
    }

    /// Whether there may be torque.
    #[must_use]
    pub const fn has_torque(self) -> bool {
        matches!(self, Self::Running | Self::Stopping)
    }
}

/// Why the controller started, as the firmware found out from reset flags and kept memory.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Restart {
    /// Power came on, or a person pressed reset.
    #[default]
    Ordinary,
    /// The watchdog.
    Watchdog,
    /// The firmware stopped itself.
    Panic,
    /// The processor trapped.
    HardFault,
}

impl Restart {
    const fn fault(self) -> Option<Fault> {
        match self {
            Self::Ordinary => None,
            Self::Watchdog => Some(Fault::WatchdogReset),
            Self::Panic => Some(Fault::Panic),
            Self::HardFault => Some(Fault::HardFault),
        }
    }
}

/// The mode with its complement: whoever reads it while they do not fit reads [`Mode::Fault`]. One bit of memory that turns
/// over would else make `Running` of `Disabled`, and enable the drives with nobody having armed them.
#[derive(Debug, Clone, Copy, PartialEq)]
struct KeptMode {
    number: u8,
    complement: u8,
}

impl KeptMode {
    const fn new(mode: Mode) -> Self {
        Self { number: mode.number(), complement: !mode.number() }
    }

    /// The mode; none if it does not fit its complement.
    #[inline(always)]
    const fn get(self) -> Option<Mode> {
        if self.number ^ self.complement == 0xFF { Mode::from_number(self.number) } else { None }
    }
}

/// Coefficients of the supervisor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Timing {
    pub(crate) boot_ticks: u32,
    pub(crate) stop_ticks: u32,
    pub(crate) rest_ticks: u32,
    /// A line permits after so many ticks (`inputs.rs`), and the arm switch counts as released after as many.
    pub(crate) permission_ticks: u32,
}

/// What the supervisor remembers.
#[derive(Debug, Clone)]
pub(crate) struct Supervisor {
    mode: KeptMode,
    ticks_in_mode: u32,
    ticks_at_rest: u32,
    latched: FaultSet,
    first: Option<Fault>,
    /// Latched at the end of the self-check.
    found_at_start: FaultSet,
    causes: FaultSet,
    arm_switch: bool,
    switch_released: bool,
    /// Ticks in a row with the switch off.
    ticks_off: u32,
}

/// What the supervisor looks at in one tick.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Watch {
    pub(crate) causes: FaultSet,
    /// On, without its bounces.
    pub(crate) arm_switch: bool,
    /// It reads off in this tick.
    pub(crate) arm_switch_off: bool,
    pub(crate) at_rest: bool,
}

impl Supervisor {
    pub(crate) fn new(restart: Restart, settings_intact: bool) -> Self {
        let mut found_at_start = FaultSet::EMPTY;
        if let Some(fault) = restart.fault() {
            found_at_start.insert(fault);
        }
        found_at_start.insert_if(Fault::SettingsCorrupt, !settings_intact);
        Self {
            mode: KeptMode::new(Mode::Boot),
            ticks_in_mode: 0,
            ticks_at_rest: 0,
            latched: FaultSet::EMPTY,
            first: None,
            found_at_start,
            causes: FaultSet::EMPTY,
            arm_switch: false,
            switch_released: false,
            ticks_off: 0,
        }
    }

    /// One tick, before the control laws.
    pub(crate) fn step(&mut self, timing: &Timing, watch: Watch, tick: u64, events: &mut EventQueue) {
        self.ticks_in_mode = self.ticks_in_mode.saturating_add(1);
        self.ticks_at_rest = if watch.at_rest { self.ticks_at_rest.saturating_add(1) } else { 0 };
        self.causes = watch.causes;
        self.arm_switch = watch.arm_switch;
        // A bounce of a switch that is on is no release.
        self.ticks_off = if watch.arm_switch_off { self.ticks_off.saturating_add(1) } else { 0 };
        self.switch_released |= self.ticks_off >= timing.permission_ticks;
        let Some(mode) = self.mode.get() else {
            let mut corrupt = FaultSet::EMPTY;
            corrupt.insert(Fault::StateCorrupt);
            self.mode = KeptMode::new(Mode::Fault);
            self.latch(corrupt.union(watch.causes).union(self.found_at_start), tick, events);
            return;
        };
        match mode {
            Mode::Boot => {
                if self.ticks_in_mode > timing.boot_ticks {
                    if self.found_at_start.is_empty() {
                        self.change(Mode::Disabled, Reason::SelfCheckDone, tick, events);
                    } else {
                        self.latch(self.found_at_start, tick, events);
                    }
                }
            }
            Mode::Disabled => {}
            Mode::Fault => self.latch(watch.causes, tick, events),
            Mode::Armed | Mode::Running | Mode::Stopping => {
                if !watch.causes.is_empty() {
                    self.latch(watch.causes, tick, events);
                } else if !watch.arm_switch {
                    self.change(Mode::Disabled, Reason::ArmSwitchOff, tick, events);
                } else if mode == Mode::Stopping {
                    if self.ticks_at_rest >= timing.rest_ticks && self.ticks_in_mode >= timing.rest_ticks {
                        self.change(Mode::Armed, Reason::AtRest, tick, events);
                    } else if self.ticks_in_mode >= timing.stop_ticks {
                        self.change(Mode::Disabled, Reason::StopTimeout, tick, events);
                    }
                }
            }
        }
    }

    /// Latches faults and makes the drives go off.
    pub(crate) fn latch(&mut self, faults: FaultSet, tick: u64, events: &mut EventQueue) {
        let new = faults.without(self.latched);
        if new.is_empty() {
            return;
        }
        self.first = self.first.or(new.first());
        self.latched = self.latched.union(new);
        (self.switch_released, self.ticks_off) = (false, 0);
        for fault in new.iter() {
            events.push(tick, EventKind::FaultLatched(fault));
        }
        if self.mode() != Mode::Fault {
            self.change(Mode::Fault, Reason::FaultLatched, tick, events);
        }
    }

    fn change(&mut self, to: Mode, reason: Reason, tick: u64, events: &mut EventQueue) {
        let from = self.mode();
        (self.mode, self.ticks_in_mode, self.ticks_at_rest) = (KeptMode::new(to), 0, 0);
        events.push(tick, EventKind::ModeChanged { from, to, reason });
    }

    pub(crate) fn arm(&mut self, tick: u64, events: &mut EventQueue) -> Result<(), Refused> {
        let refuse = |reason| Err(Refused::because(reason));
        match self.mode() {
            Mode::Boot => refuse(Refusal::Starting),
            Mode::Fault => Err(Refused::by_fault(Refusal::FaultLatched, self.first)),
            Mode::Armed | Mode::Running | Mode::Stopping => refuse(Refusal::NotDisabled),
            Mode::Disabled if !self.arm_switch => refuse(Refusal::ArmSwitchOff),
            Mode::Disabled if !self.switch_released => refuse(Refusal::ArmSwitchNotReleased),
            Mode::Disabled if !self.causes.is_empty() => {
                Err(Refused::by_fault(Refusal::CausePresent, self.causes.first()))
            }
            Mode::Disabled => {
                self.change(Mode::Armed, Reason::ArmCommand, tick, events);
                Ok(())
            }
        }
    }

    pub(crate) fn disarm(&mut self, tick: u64, events: &mut EventQueue) {
        if self.mode().is_live() {
            self.change(Mode::Disabled, Reason::DisarmCommand, tick, events);
        }
    }

    /// From `Armed` to `Running`; `ready` tells whether there is something to run.
    pub(crate) fn start(&mut self, ready: bool, tick: u64, events: &mut EventQueue) -> Result<(), Refused> {
        match self.mode() {
            Mode::Fault => Err(Refused::by_fault(Refusal::FaultLatched, self.first)),
            Mode::Running | Mode::Stopping => Err(Refused::because(Refusal::Running)),
            Mode::Boot | Mode::Disabled => Err(Refused::because(Refusal::NotArmed)),
            Mode::Armed if !ready => Err(Refused::because(Refusal::NoExperiment)),
            Mode::Armed => {
                self.change(Mode::Running, Reason::StartCommand, tick, events);
                Ok(())
            }
        }
    }

    pub(crate) fn stop(&mut self, tick: u64, events: &mut EventQueue) -> Result<(), Refused> {
        if self.mode() == Mode::Running {
            self.change(Mode::Stopping, Reason::StopCommand, tick, events);
            Ok(())
        } else {
            Err(Refused::because(Refusal::NotRunning))
        }
    }

    /// The experiment came to its end.
    pub(crate) fn finish(&mut self, tick: u64, events: &mut EventQueue) {
        if self.mode() == Mode::Running {
            self.change(Mode::Stopping, Reason::ExperimentFinished, tick, events);
        }
    }

    pub(crate) fn clear(&mut self, tick: u64, events: &mut EventQueue) -> Result<(), Refused> {
        if self.mode() != Mode::Fault {
            return Err(Refused::because(Refusal::NoFault));
        }
        if !self.causes.is_empty() {
            return Err(Refused::by_fault(Refusal::CausePresent, self.causes.first()));
        }
        for fault in self.latched.iter() {
            events.push(tick, EventKind::FaultCleared(fault));
        }
        (self.latched, self.first) = (FaultSet::EMPTY, None);
        self.change(Mode::Disabled, Reason::FaultCleared, tick, events);
        Ok(())
    }

    #[inline(always)]
    pub(crate) fn mode(&self) -> Mode {
        self.mode.get().unwrap_or(Mode::Fault)
    }
    /// Turns one bit of the mode in memory over.
    #[cfg(test)]
    pub(crate) fn flip_bit_of_mode(&mut self, bit: u32) {
        if bit < 8 {
            self.mode.number ^= 1 << bit;
        } else {
            self.mode.complement ^= 1 << (bit - 8);
        }
    }
    pub(crate) fn first_fault(&self) -> Option<Fault> {
        self.first
    }
    pub(crate) fn latched(&self) -> FaultSet {
        self.latched
    }
    pub(crate) fn causes(&self) -> FaultSet {
        self.causes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIMING: Timing = Timing { boot_ticks: 10, stop_ticks: 10, rest_ticks: 10, permission_ticks: 10 };
    const QUIET: Watch =
        Watch { causes: FaultSet::EMPTY, arm_switch: true, arm_switch_off: false, at_rest: true };

    #[test]
    fn one_bit_of_the_mode_that_turns_over_enables_no_drive_and_is_a_fault() {
        for from in Mode::ALL {
            for bit in 0..16 {
                let mut supervisor = Supervisor::new(Restart::Ordinary, true);
                let mut events = EventQueue::default();
                supervisor.mode = KeptMode::new(*from);
                supervisor.flip_bit_of_mode(bit);
                assert!(!supervisor.mode().is_live(), "{from:?}, bit {bit}");
                supervisor.step(&TIMING, QUIET, 1, &mut events);
                assert_eq!(supervisor.mode(), Mode::Fault, "{from:?}, bit {bit}");
                assert!(supervisor.latched().contains(Fault::StateCorrupt), "{from:?}, bit {bit}");
                assert_eq!(supervisor.clear(2, &mut events), Ok(()));
            }
        }
    }
}
