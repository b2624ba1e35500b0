//! Encoder: unwraps the hardware counter and keeps the position without drift.
//!
//! The step since the last tick is the difference of two counter readings in the counter's own width, taken as a
//! signed number: right for every motion below half the counter's range per tick. The position is kept as an
//! exact count, and beside it as whole turns and counts within the turn, so that no resolution is lost after
//! hours of motion: angles are made from these when asked for, never accumulated.
//!
//! A step no motion can make (too fast, or a change of speed no torque can cause) is reported as a jump. That is
//! what a stuck or broken line looks like at speed. Slow losses are `encoder_watch.rs`.
//!
//! Left out: the index pulse. The origin is the position at the first tick.

use super::settings::EncoderSettings;
use core::f32::consts::TAU;
use fixed::types::{I32F32, U0F64};

/// How far the instant at which a counter is latched may be from the begin of its period: the arbitration of the DMA
/// that does it, some ten cycles of its bus.
const LATCH_JITTER_S: f32 = 1e-7;

/// Coefficients of one encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Encoder {
    unused_bits: u32,
    reversed: bool,
    counts_per_rev: i32,
    turns_per_count: U0F64,
    rad_per_count: f32,
    most_counts: i32,
    most_change: i32,
}

/// Position of one encoder.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct EncoderState {
    primed: bool,
    raw: u32,
    count: i64,
    turns: i32,
    in_turn: i32,
    step: i32,
}

/// Motion of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct EncoderStep {
    /// Counts since the last tick.
    pub(crate) counts: i32,
    /// No motion can do that.
    pub(crate) jump: bool,
}

impl Encoder {
    /// With the fastest motion and the strongest acceleration there can be.
    pub(crate) fn new(
        settings: &EncoderSettings,
        max_speed_rad_s: f32,
        max_acceleration_rad_s2: f32,
        tick_s: f32,
    ) -> Self {
        let counts_per_rad = settings.counts_per_rev as f32 / TAU;
        let jitter_counts = LATCH_JITTER_S * max_speed_rad_s * counts_per_rad;
        Self {
            unused_bits: 32 - settings.counter_bits.clamp(1, 32),
            reversed: settings.reversed,
            counts_per_rev: i32::try_from(settings.counts_per_rev).unwrap_or(i32::MAX),
            turns_per_count: U0F64::from_bits(u64::MAX / u64::from(settings.counts_per_rev.max(1))),
            rad_per_count: 1.0 / counts_per_rad,
            // A position is cut to whole counts: below one count of error, so below one in a step and below two in a
            // change of step. The jitter of two instants is in a step, that of three, the middle one twice, in a change.
            most_counts: (max_speed_rad_s * tick_s * counts_per_rad + 1.0 + 2.0 * jitter_counts) as i32,
            most_change: (max_acceleration_rad_s2 * tick_s * tick_s * counts_per_rad
                + 2.0
                + 4.0 * jitter_counts) as i32,
        }
    }

    /// Whether a position counted by one is one of the other.
    pub(crate) fn counts_like(&self, other: &Self) -> bool {
        (self.unused_bits, self.reversed, self.counts_per_rev)
            == (other.unused_bits, other.reversed, other.counts_per_rev)
    }

    /// Takes one reading of the counter. Where the time since the last one is not `regular`, one period, the step says
    /// nothing of the speed: it counts, and is no jump.
    pub(crate) fn step(&self, state: &mut EncoderState, raw: u32, regular: bool) -> EncoderStep {
        if !state.primed {
            *state = EncoderState { primed: true, raw, ..EncoderState::default() };
            return EncoderStep { counts: 0, jump: false };
        }
        let counts = signed_difference(raw, state.raw, self.unused_bits);
        let counts = if self.reversed { counts.wrapping_neg() } else { counts };
        let change = counts.wrapping_sub(state.step);
        let jump = regular
            && (counts.unsigned_abs() > self.most_counts.unsigned_abs()
                || change.unsigned_abs() > self.most_change.unsigned_abs());
        state.raw = raw;
        if regular {
            state.step = counts;
        }
        state.count = state.count.wrapping_add(i64::from(counts));
        self.turn(state, counts);
        EncoderStep { counts, jump }
    }

    /// Turns and counts within the turn. One subtraction for each motion there can be; the division is for a jump.
    fn turn(&self, state: &mut EncoderState, counts: i32) {
        let n = self.counts_per_rev;
        let whole =
            if counts.unsigned_abs() < n.unsigned_abs() { 0 } else { counts.checked_div(n).unwrap_or(0) };
        state.turns = state.turns.wrapping_add(whole);
        state.in_turn += counts.wrapping_sub(whole.wrapping_mul(n));
        if state.in_turn >= n {
            state.in_turn -= n;
            state.turns = state.turns.wrapping_add(1);
        } else if state.in_turn < 0 {
            state.in_turn += n;
            state.turns = state.turns.wrapping_sub(1);
        }
    }

    /// Angle since the start, rounded to what `f32` holds.
    pub(crate) fn angle_rad(&self, state: &EncoderState) -> f32 {
        state.turns as f32 * TAU + state.in_turn as f32 * self.rad_per_count
    }

    /// Angle within the turn, 0 … 2π, exact to the count.
    pub(crate) fn angle_in_turn_rad(&self, state: &EncoderState) -> f32 {
        state.in_turn as f32 * self.rad_per_count
    }

    /// Angle in turns, to 2⁻³² of a turn, however many turns there were.
    pub(crate) fn turns(&self, state: &EncoderState) -> I32F32 {
        let within = self.turns_per_count.wrapping_mul_int(u64::from(state.in_turn.unsigned_abs()));
        let fraction = (within.to_bits() >> 32) as i64;
        I32F32::from_bits((i64::from(state.turns) << 32) | fraction)
    }

    pub(crate) fn rad_per_count(&self) -> f32 {
        self.rad_per_count
    }
}

impl EncoderState {
    /// Exact position in counts since the start.
    pub(crate) fn count(&self) -> i64 {
        self.count
    }
}

/// `new − old` of a counter of `32 − unused_bits` bits, as a signed number.
fn signed_difference(new: u32, old: u32, unused_bits: u32) -> i32 {
    let unused_bits = unused_bits & 31;
    (new.wrapping_sub(old) << unused_bits) as i32 >> unused_bits
}

#[cfg(test)]
mod tests {
    use super::super::settings::ControlSettings;
    use super::*;
    use proptest::prelude::*;

    fn encoder(counter_bits: u32) -> Encoder {
        let s = ControlSettings::default();
        Encoder::new(&EncoderSettings { counter_bits, ..s.m2_encoder }, 60.0, 5000.0, s.tick_s)
    }

    fn unwraps(counter_bits: u32, start: u32, steps: &[i32]) {
        let encoder = encoder(counter_bits);
        let mask = u32::MAX >> (32 - counter_bits);
        let mut state = EncoderState::default();
        let mut truth = 0_i64;
        encoder.step(&mut state, start & mask, true);
        for &step in steps {
            truth += i64::from(step);
            let raw = (i64::from(start) + truth) as u32 & mask;
            assert_eq!(encoder.step(&mut state, raw, true).counts, step);
            assert_eq!(state.count(), truth);
            let n = i64::from(encoder.counts_per_rev);
            assert_eq!(i64::from(state.in_turn), truth.rem_euclid(n));
            assert_eq!(i64::from(state.turns), truth.div_euclid(n));
        }
    }

    proptest! {
        #[test]
        fn a_16_bit_counter_unwraps_whatever_it_passes(
            start in any::<u32>(), steps in prop::collection::vec(-32768..=32767_i32, 1..200)
        ) {
            unwraps(16, start, &steps);
        }

        #[test]
        fn a_32_bit_counter_unwraps_whatever_it_passes(
            start in any::<u32>(), steps in prop::collection::vec(any::<i32>(), 1..200)
        ) {
            unwraps(32, start, &steps);
        }

        #[test]
        fn a_reversed_encoder_gives_the_same_motion_with_the_other_sign(
            steps in prop::collection::vec(-300..300_i32, 1..50)
        ) {
            let plain = encoder(32);
            let turned = Encoder { reversed: true, ..plain };
            let (mut a, mut b) = (EncoderState::default(), EncoderState::default());
            let mut raw = 0_u32;
            for step in std::iter::once(0).chain(steps) {
                raw = raw.wrapping_add_signed(step);
                prop_assert_eq!(plain.step(&mut a, raw, true).counts, -turned.step(&mut b, raw, true).counts);
                prop_assert_eq!(a.count(), -b.count());
            }
        }
    }

    #[test]
    fn the_first_reading_is_the_origin() {
        let encoder = encoder(32);
        let mut state = EncoderState::default();
        assert_eq!(encoder.step(&mut state, 0xdead_beef, true), EncoderStep { counts: 0, jump: false });
        assert_eq!(state.count(), 0);
    }

    #[test]
    fn the_angle_keeps_its_resolution_over_ten_hours_at_300_rpm() {
        // 240 counts a tick, 3.6e8 ticks: too many to run one by one, so each step is a quarter of a turn.
        let encoder = encoder(32);
        let mut state = EncoderState::default();
        encoder.step(&mut state, 0, true);
        let mut raw = 0_u32;
        for _ in 0..720_000 {
            raw = raw.wrapping_add(120_000);
            encoder.step(&mut state, raw, true);
        }
        encoder.step(&mut state, raw.wrapping_add(1), true);
        assert_eq!(state.count(), 720_000 * 120_000 + 1);
        assert_eq!(state.turns, 180_000);
        // One count is 1/480 000 of a turn; 2⁻³² of a turn is 0.0001 counts.
        let fraction: f64 = (encoder.turns(&state) - I32F32::from_num(180_000)).to_num();
        assert!((fraction * 480_000.0 - 1.0).abs() < 2e-4, "{fraction}");
    }

    #[test]
    fn turns_are_exact_for_every_count_of_a_revolution_and_backwards_too() {
        let encoder = encoder(32);
        for (raw, expected) in
            [(120_000_u32, 0.25_f64), (0_u32.wrapping_sub(120_000), -0.25), (479_999, 479_999.0 / 480_000.0)]
        {
            let mut state = EncoderState::default();
            encoder.step(&mut state, 0, true);
            encoder.step(&mut state, raw, true);
            let turns: f64 = encoder.turns(&state).to_num();
            assert!((turns - expected).abs() < 1e-9, "{turns} {expected}");
            assert!((f64::from(encoder.angle_rad(&state)) - expected * f64::from(TAU)).abs() < 1e-6);
        }
    }

    #[test]
    fn fast_motion_is_no_jump_and_a_stuck_line_at_speed_is() {
        let encoder = encoder(32);
        let mut state = EncoderState::default();
        let mut raw = 0_u32;
        let mut step = 0;
        encoder.step(&mut state, raw, true);
        // 1000 rad/s², far more than 8 N·m give 0.02 kg·m², up to 300 rpm.
        while step < 240 {
            step += 1;
            raw = raw.wrapping_add(step);
            assert!(!encoder.step(&mut state, raw, true).jump, "at {step} counts a tick");
        }
        assert!(encoder.step(&mut state, raw, true).jump);
    }

    #[test]
    fn speed_beyond_the_possible_is_a_jump_however_it_is_reached() {
        // 60 rad/s are 458.4 counts a tick, 1 for whole counts and 0.9 for the instants of latching.
        let (encoder, mut state) = (encoder(32), EncoderState::default());
        let mut raw = 0_u32;
        encoder.step(&mut state, raw, true);
        let first = (1..1000_u32).find(|step| {
            raw = raw.wrapping_add(*step);
            encoder.step(&mut state, raw, true).jump
        });
        assert_eq!(first, Some(461));
    }
}
