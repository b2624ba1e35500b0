//! The guard: which causes of faults are there in this tick.
//!
//! It decides nothing; the supervisor latches. Levels that may flicker need some ticks in a row; events that must not
//! pile up (late ticks, ticks at the wrong distance, lost scans) fill a bucket that leaks one a second, and a bucket that
//! runs over is a cause until it has leaked.
//!
//! Nearly always nothing is wrong, so what counts ticks or fills buckets is passed by while nothing is there to count
//! and everything is empty.

use super::bridge::BridgeFailure;
use super::encoder_watch::Loss;
use super::fault::{Fault, FaultSet};
use super::frozen::{self, FrozenState};
use super::inputs::Lines;
use super::samples::Samples;
use super::settings::ControlSettings;

/// Coefficients of the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Guard {
    over_speed_rad_s: f32,
    over_torque_nm: f32,
    over_force_n: f32,
    limit_ticks: u32,
    supply_low_v: f32,
    supply_high_v: f32,
    supply_ticks: u32,
    stall_ticks: u32,
    /// Scans of a window in which a channel must move; 0: not watched.
    frozen_ticks: u32,
    overrun_budget: u32,
    deadline_budget: u32,
    leak_ticks: u32,
    link_ticks: u32,
}

/// What the guard remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct GuardState {
    m1_torque: u32,
    m2_torque: u32,
    force: u32,
    supply_low: u32,
    supply_high: u32,
    stale: u32,
    frozen: FrozenState,
    overruns: u32,
    late: u32,
    irregular: u32,
    leak: u32,
    silent: u32,
    misses: u32,
    /// A bucket or the count of stale scans is not empty.
    disturbed: bool,
    /// A level was beyond its limit in the last tick.
    violated: bool,
}

/// What the guard looks at, in SI units.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Sight {
    pub(crate) speed_rad_s: f32,
    pub(crate) m1_torque_nm: f32,
    pub(crate) m2_torque_nm: f32,
    pub(crate) normal_force_n: f32,
    pub(crate) supply_v: f32,
    pub(crate) friction_bridge: Option<BridgeFailure>,
    pub(crate) normal_bridge: Option<BridgeFailure>,
    pub(crate) m1_jump: bool,
    pub(crate) m2_jump: bool,
    pub(crate) m1_loss: Option<Loss>,
    pub(crate) m2_loss: Option<Loss>,
    pub(crate) m1_mismatch: bool,
    pub(crate) m2_mismatch: bool,
    /// The host must be heard.
    pub(crate) link_needed: bool,
}

/// Counts ticks in a row and tells whether there were enough.
fn lasts(count: &mut u32, present: bool, ticks: u32) -> bool {
    *count = if present { count.saturating_add(1) } else { 0 };
    present && *count >= ticks
}

impl Guard {
    pub(crate) fn new(settings: &ControlSettings) -> Self {
        let (l, s, t) = (&settings.limits, &settings.supply, &settings.timing);
        let ticks = |time_s: f32| ((time_s / settings.tick_s) as u32).max(1);
        Self {
            over_speed_rad_s: l.over_speed_rad_s,
            over_torque_nm: l.over_torque_nm,
            over_force_n: l.over_force_n,
            limit_ticks: l.persistence_ticks,
            supply_low_v: s.low_v,
            supply_high_v: s.high_v,
            supply_ticks: ticks(s.persistence_s),
            stall_ticks: t.adc_stall_ticks,
            frozen_ticks: t.adc_frozen_ticks,
            overrun_budget: t.adc_overrun_budget,
            deadline_budget: t.deadline_budget,
            leak_ticks: ticks(1.0),
            link_ticks: ticks(t.link_timeout_s),
        }
    }

    /// The causes of this tick.
    pub(crate) fn step(
        &self,
        state: &mut GuardState,
        samples: &Samples,
        lines: &Lines,
        sight: &Sight,
    ) -> FaultSet {
        let mut causes = FaultSet::EMPTY;
        if lines.emergency_stop || lines.m1_drive_fault || lines.m2_drive_fault || sight.shows_failure() {
            failures(&mut causes, lines, sight);
        }
        let regular =
            samples.adc_fresh && !(samples.adc_overrun || samples.deadline_missed || samples.tick_irregular);
        if !regular || state.disturbed {
            self.time(state, samples, &mut causes);
        }
        let silent = sight.link_needed && !samples.link_heard;
        causes.insert_if(Fault::LinkLost, lasts(&mut state.silent, silent, self.link_ticks));
        self.levels(state, sight, &mut causes);
        if self.frozen_ticks != 0 && samples.adc_fresh {
            let frozen = frozen::step(&mut state.frozen, self.frozen_ticks, &samples.adc);
            // What stays at a code that means another fault is told as that.
            causes.insert_if(Fault::AnalogueFrozen, frozen && causes.is_empty());
        }
        causes
    }

    /// Something disturbed the tick, or did so lately.
    #[cold]
    fn time(&self, state: &mut GuardState, samples: &Samples, causes: &mut FaultSet) {
        causes.insert_if(Fault::AdcStalled, lasts(&mut state.stale, !samples.adc_fresh, self.stall_ticks));
        let fill = |bucket: &mut u32, drop: bool, budget: u32| {
            if drop {
                *bucket = bucket.saturating_add(1).min(budget + 1);
            }
            *bucket > budget
        };
        state.misses = state.misses.saturating_add(u32::from(samples.deadline_missed));
        let overrun = fill(&mut state.overruns, samples.adc_overrun, self.overrun_budget);
        causes.insert_if(Fault::AdcOverrun, overrun);
        let late = fill(&mut state.late, samples.deadline_missed, self.deadline_budget);
        causes.insert_if(Fault::DeadlineBudget, late);
        let irregular = fill(&mut state.irregular, samples.tick_irregular, self.deadline_budget);
        causes.insert_if(Fault::TickIrregular, irregular);
        state.leak += 1;
        if state.leak >= self.leak_ticks {
            state.leak = 0;
            for bucket in [&mut state.overruns, &mut state.late, &mut state.irregular] {
                *bucket = bucket.saturating_sub(1);
            }
        }
        state.disturbed = (state.stale | state.overruns | state.late | state.irregular) != 0;
    }

    fn levels(&self, state: &mut GuardState, sight: &Sight, causes: &mut FaultSet) {
        // Each comparison is written so that not-a-number counts as a violation.
        let within = libm::fabsf(sight.speed_rad_s) <= self.over_speed_rad_s
            && libm::fabsf(sight.m1_torque_nm) <= self.over_torque_nm
            && libm::fabsf(sight.m2_torque_nm) <= self.over_torque_nm
            && sight.normal_force_n <= self.over_force_n
            && sight.supply_v >= self.supply_low_v
            && sight.supply_v <= self.supply_high_v;
        if !within || state.violated {
            state.violated = !within;
            self.count(state, sight, causes);
        }
    }

    /// Some level is beyond its limit, or was in the tick before.
    #[cold]
    #[allow(clippy::neg_cmp_op_on_partial_ord)]
    fn count(&self, state: &mut GuardState, sight: &Sight, causes: &mut FaultSet) {
        let n = self.limit_ticks;
        let beyond = |value: f32, most: f32| !(libm::fabsf(value) <= most);
        causes.insert_if(Fault::OverSpeed, beyond(sight.speed_rad_s, self.over_speed_rad_s));
        let m1 = beyond(sight.m1_torque_nm, self.over_torque_nm);
        causes.insert_if(Fault::M1OverTorque, lasts(&mut state.m1_torque, m1, n));
        let m2 = beyond(sight.m2_torque_nm, self.over_torque_nm);
        causes.insert_if(Fault::M2OverTorque, lasts(&mut state.m2_torque, m2, n));
        let force = !(sight.normal_force_n <= self.over_force_n);
        causes.insert_if(Fault::OverForce, lasts(&mut state.force, force, n));
        let low = !(sight.supply_v >= self.supply_low_v);
        causes.insert_if(Fault::SupplyLow, lasts(&mut state.supply_low, low, self.supply_ticks));
        let high = sight.supply_v > self.supply_high_v;
        causes.insert_if(Fault::SupplyHigh, lasts(&mut state.supply_high, high, self.supply_ticks));
    }
}

impl Sight {
    /// Something other than a level or the time is not as it must be.
    fn shows_failure(&self) -> bool {
        self.friction_bridge.is_some()
            || self.normal_bridge.is_some()
            || self.m1_jump
            || self.m2_jump
            || self.m1_loss.is_some()
            || self.m2_loss.is_some()
            || self.m1_mismatch
            || self.m2_mismatch
    }
}

/// What lines and readings show as failed.
#[cold]
fn failures(causes: &mut FaultSet, lines: &Lines, sight: &Sight) {
    causes.insert_if(Fault::EmergencyStop, lines.emergency_stop);
    causes.insert_if(Fault::M1DriveFault, lines.m1_drive_fault);
    causes.insert_if(Fault::M2DriveFault, lines.m2_drive_fault);
    insert_bridge(
        causes,
        sight.friction_bridge,
        [Fault::FrictionBridgeOpen, Fault::FrictionBridgeShort, Fault::FrictionBridgeSaturated],
    );
    insert_bridge(
        causes,
        sight.normal_bridge,
        [Fault::NormalBridgeOpen, Fault::NormalBridgeShort, Fault::NormalBridgeSaturated],
    );
    causes.insert_if(Fault::M1TorqueMismatch, sight.m1_mismatch);
    causes.insert_if(Fault::M2TorqueMismatch, sight.m2_mismatch);
    causes.insert_if(Fault::M1EncoderJump, sight.m1_jump);
    causes.insert_if(Fault::M2EncoderJump, sight.m2_jump);
    causes.insert_if(Fault::M1EncoderNoCounts, sight.m1_loss == Some(Loss::NoCounts));
    causes.insert_if(Fault::M1EncoderNoTorque, sight.m1_loss == Some(Loss::NoTorque));
    causes.insert_if(Fault::M2EncoderNoCounts, sight.m2_loss == Some(Loss::NoCounts));
    causes.insert_if(Fault::M2EncoderNoTorque, sight.m2_loss == Some(Loss::NoTorque));
}

impl GuardState {
    /// Late ticks since the start.
    pub(crate) fn deadline_misses(&self) -> u32 {
        self.misses
    }
}

fn insert_bridge(causes: &mut FaultSet, failure: Option<BridgeFailure>, faults: [Fault; 3]) {
    let [open, short, saturated] = faults;
    match failure {
        None => {}
        Some(BridgeFailure::Open) => causes.insert(open),
        Some(BridgeFailure::Short) => causes.insert(short),
        Some(BridgeFailure::Saturated) => causes.insert(saturated),
    }
}
