//! Analogue inputs: code to SI, tare, a light filter, and what a broken, shorted or saturated bridge looks like.
//!
//! value = (code − zero) · unit per code. The record takes the value as it is; control and limits take it through
//! a first order low-pass y ← y + (1 − e^{−2πf·Δt})(x − y), which costs 1/(2πf) of delay (0.1 ms at 1.5 kHz).
//!
//! The code itself tells a failed bridge (`settings.rs` has the convention). A failure counts once it has been there
//! for `persistence_ticks` ticks in a row, so that one disturbed conversion does not stop the rig.
//!
//! Tare: the mean code over a time at rest becomes the new zero, unless it lies further from the calibrated zero than
//! allowed: then something presses, or the bridge is damaged.
//!
//! Left out: non-linearity and crosstalk of the bridges, which are identified from logs, not corrected here.

use super::settings::{BridgeSettings, ControlSettings};
use core::f32::consts::TAU;

/// Coefficients of one bridge.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Bridge {
    unit_per_code: f32,
    smoothing: f32,
    short_code: u16,
    saturated_low_code: u16,
    saturated_high_code: u16,
    open_code: u16,
    persistence_ticks: u32,
    pub(crate) calibrated_zero_code: f32,
    tare_limit_codes: f32,
}

/// What a bridge remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BridgeState {
    zero_code: f32,
    filtered: f32,
    primed: bool,
    suspect_ticks: u32,
}

/// Why a reading cannot be trusted.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum BridgeFailure {
    Open,
    Short,
    Saturated,
}

/// One reading.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct BridgeReading {
    /// Tared.
    pub(crate) value: f32,
    /// Tared and filtered.
    pub(crate) filtered: f32,
    /// A failure that has lasted long enough.
    pub(crate) failure: Option<BridgeFailure>,
}

impl Bridge {
    pub(crate) fn new(s: &BridgeSettings, tick_s: f32) -> Self {
        Self {
            unit_per_code: s.unit_per_code,
            smoothing: -libm::expm1f(-TAU * s.lowpass_hz * tick_s),
            short_code: s.short_code,
            saturated_low_code: s.saturated_low_code,
            saturated_high_code: s.saturated_high_code,
            open_code: s.open_code,
            persistence_ticks: s.persistence_ticks,
            calibrated_zero_code: s.zero_code,
            tare_limit_codes: libm::fabsf(s.tare_limit / s.unit_per_code),
        }
    }

    pub(crate) fn fresh(&self) -> BridgeState {
        BridgeState { zero_code: self.calibrated_zero_code, filtered: 0.0, primed: false, suspect_ticks: 0 }
    }

    fn failure_of(&self, code: u16) -> Option<BridgeFailure> {
        if code >= self.open_code {
            Some(BridgeFailure::Open)
        } else if code <= self.short_code {
            Some(BridgeFailure::Short)
        } else if code >= self.saturated_high_code || code <= self.saturated_low_code {
            Some(BridgeFailure::Saturated)
        } else {
            None
        }
    }

    /// Takes one code.
    pub(crate) fn step(&self, state: &mut BridgeState, code: u16) -> BridgeReading {
        let value = (f32::from(code) - state.zero_code) * self.unit_per_code;
        if state.primed {
            state.filtered += self.smoothing * (value - state.filtered);
        } else {
            (state.filtered, state.primed) = (value, true);
        }
        let suspect = self.failure_of(code);
        // Open, short and saturated take turns while a wire breaks: any of them counts on, the last one is reported.
        state.suspect_ticks = if suspect.is_some() { state.suspect_ticks.saturating_add(1) } else { 0 };
        let lasting = suspect.is_some() && state.suspect_ticks >= self.persistence_ticks;
        BridgeReading { value, filtered: state.filtered, failure: if lasting { suspect } else { None } }
    }

    /// Whether `zero_code` may become the zero.
    pub(crate) fn accepts_zero(&self, zero_code: f32) -> bool {
        libm::fabsf(zero_code - self.calibrated_zero_code) <= self.tare_limit_codes
    }

    /// What the bridge reads at `code` with its calibrated zero.
    pub(crate) fn untared(&self, code: f32) -> f32 {
        (code - self.calibrated_zero_code) * self.unit_per_code
    }
}

impl BridgeState {
    pub(crate) fn set_zero(&mut self, zero_code: f32) {
        self.zero_code = zero_code;
        self.primed = false;
    }
}

/// Coefficients of the tare of both bridges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Tare {
    ticks: u32,
    per_tick: f32,
}

/// A tare that may be going on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub(crate) struct TareState {
    left: u32,
    friction_sum: u64,
    normal_sum: u64,
}

/// Mean codes of both bridges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Zeros {
    pub(crate) friction_code: f32,
    pub(crate) normal_code: f32,
}

impl Tare {
    pub(crate) fn new(settings: &ControlSettings) -> Self {
        let ticks = ((settings.tare_time_s / settings.tick_s) as u32).max(1);
        Self { ticks, per_tick: 1.0 / ticks as f32 }
    }

    pub(crate) fn start(&self, state: &mut TareState) {
        *state = TareState { left: self.ticks, friction_sum: 0, normal_sum: 0 };
    }

    /// Takes the codes of one tick; gives the means when the time is over.
    pub(crate) fn step(&self, state: &mut TareState, friction_code: u16, normal_code: u16) -> Option<Zeros> {
        if state.left == 0 {
            return None;
        }
        state.friction_sum += u64::from(friction_code);
        state.normal_sum += u64::from(normal_code);
        state.left -= 1;
        if state.left > 0 {
            return None;
        }
        Some(Zeros {
            friction_code: state.friction_sum as f32 * self.per_tick,
            normal_code: state.normal_sum as f32 * self.per_tick,
        })
    }
}

impl TareState {
    pub(crate) fn is_going_on(&self) -> bool {
        self.left > 0
    }
    pub(crate) fn abort(&mut self) {
        self.left = 0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn friction() -> Bridge {
        let s = ControlSettings::default();
        Bridge::new(&s.friction_bridge, s.tick_s)
    }

    fn normal() -> Bridge {
        let s = ControlSettings::default();
        Bridge::new(&s.normal_bridge, s.tick_s)
    }

    #[test]
    fn codes_become_newtons_with_their_sign() {
        let (f, n) = (friction(), normal());
        // 24 N·m and 240 N over 65536 codes, zeros at 1/2 and 1/12 of the range.
        let value = |b: &Bridge, code: u16| f64::from(b.step(&mut b.fresh(), code).value);
        assert!((value(&f, 32768) - 0.0).abs() < 1e-6);
        assert!((value(&f, 49152) - 6.0).abs() < 1e-5);
        assert!((value(&f, 16384) + 6.0).abs() < 1e-5);
        assert!((value(&n, 5461) + 0.00122).abs() < 1e-4);
        assert!((value(&n, 32768) - 100.0).abs() < 1e-4);
        assert!((value(&n, 1000) + 16.3379).abs() < 1e-3);
    }

    #[test]
    fn a_negative_gain_turns_the_sign() {
        let s = ControlSettings::default();
        let turned = BridgeSettings { unit_per_code: -s.friction_bridge.unit_per_code, ..s.friction_bridge };
        let bridge = Bridge::new(&turned, s.tick_s);
        assert!((bridge.step(&mut bridge.fresh(), 49152).value + 6.0).abs() < 1e-5);
        assert!(
            bridge.accepts_zero(32768.0) && bridge.accepts_zero(34000.0) && !bridge.accepts_zero(36000.0)
        );
    }

    #[test]
    fn the_filter_answers_a_step_as_its_corner_says() {
        let bridge = friction();
        let mut state = bridge.fresh();
        bridge.step(&mut state, 32768);
        for k in 1..=20 {
            let got = f64::from(bridge.step(&mut state, 49152).filtered);
            let expected = 6.0 * (1.0 - (-std::f64::consts::TAU * 1500.0 * 1e-4 * f64::from(k)).exp());
            // f32: six figures.
            assert!((got - expected).abs() < 1e-5, "{k}: {got} {expected}");
        }
    }

    #[test]
    fn failures_count_after_their_persistence_and_by_their_kind() {
        for (code, failure) in [
            (65535, BridgeFailure::Open),
            (65404, BridgeFailure::Open),
            (65403, BridgeFailure::Saturated),
            (64880, BridgeFailure::Saturated),
            (656, BridgeFailure::Saturated),
            (132, BridgeFailure::Saturated),
            (131, BridgeFailure::Short),
            (0, BridgeFailure::Short),
        ] {
            let bridge = friction();
            let mut state = bridge.fresh();
            assert_eq!(bridge.step(&mut state, code).failure, None);
            assert_eq!(bridge.step(&mut state, 40000).failure, None, "one good code starts the count again");
            assert_eq!(bridge.step(&mut state, code).failure, None);
            assert_eq!(bridge.step(&mut state, code).failure, Some(failure), "{code}");
        }
        let bridge = friction();
        let mut state = bridge.fresh();
        assert!((657..64880).all(|code| bridge.step(&mut state, code).failure.is_none()));
    }

    #[test]
    fn a_wire_that_breaks_in_jumps_counts_all_the_same() {
        let bridge = friction();
        let mut state = bridge.fresh();
        bridge.step(&mut state, 65000);
        assert_eq!(bridge.step(&mut state, 65535).failure, Some(BridgeFailure::Open));
    }

    #[test]
    fn a_tare_gives_the_mean_code_after_its_time() {
        let settings = ControlSettings { tare_time_s: 0.1, ..ControlSettings::default() };
        let (tare, mut state) = (Tare::new(&settings), TareState::default());
        assert_eq!(tare.step(&mut state, 1, 1), None, "not started");
        tare.start(&mut state);
        let mut zeros = None;
        for k in 0..1000_u16 {
            assert!(zeros.is_none());
            zeros = tare.step(&mut state, 32000 + k % 2, 5000 + k % 3);
        }
        // Means of 0, 1 and of 0, 1, 2 (1000 = 333 · 3 + 1).
        let zeros = zeros.expect("1000 ticks are over");
        assert!((zeros.friction_code - 32000.5).abs() < 0.01 && (zeros.normal_code - 5000.999).abs() < 0.01);
        assert!(!state.is_going_on());
    }

    #[test]
    fn after_a_tare_the_zero_code_reads_zero() {
        let bridge = normal();
        let mut state = bridge.fresh();
        state.set_zero(6000.0);
        let reading = bridge.step(&mut state, 6000);
        assert_eq!((reading.value, reading.filtered), (0.0, 0.0));
        assert!((bridge.untared(6000.0) - 1.9727).abs() < 1e-3);
    }
}
