//! The torque a drive is asked for against the torque its monitor shows.
//!
//! What the DAC was given passes one control period and the drive's lag τ, as in `torque_loop.rs`: that is the torque to
//! expect, τ̂. A broken reference wire, a drive that ignores its reference, takes it with another gain or with the
//! other sign shows as |τ̂ − τ| beyond what offsets and gain errors explain,
//!
//! b = b₀ + g·|τ̂|,
//!
//! and the excess is summed as long as there is some (one-sided CUSUM, Page 1954): S ← max(0, S + (|τ̂ − τ| − b)·Δt).
//! It is a fault when S > A. A lag that is wrong by δτ makes, after a step Δ of the command, two exponentials with an
//! area of exactly |Δ|·δτ between them, whatever the slew; reading the monitor at another instant of the period makes up
//! to |Δ|·Δt. So no step from one rated torque to the other is a fault with
//!
//! A = 2·τ_rated·(l·τ + Δt),  l: how well τ is known.
//!
//! Time to the fault: a deviation D that appears at once is found after A/(D − b); one that comes up with the drive's
//! lag, as from an open wire, at most τ·D/(D − b) later than that, as the excess then lacks the area D·τ. With the
//! defaults (τ = 1 ms, rated 8 N·m, A = 4.8 mN·m·s) an open wire that asks an armed drive for its rated torque is found
//! within 1.7 ms, before M2 has turned its disc by a milliradian; half the gain at 4.8 N·m within 5 ms.
//!
//! That is a matter of the settings: with τ = 0.1 s and l = 1, each within its own range, it would be 0.32 s. So the settings
//! together may ask for 20 ms at most for the open wire of an armed drive, (A + τ·τ_rated)/(τ_rated − b₀)
//! ([`MOST_OPEN_WIRE_S`]). The largest rated torque that is allowed, 10 N·m, then makes 10 rad/s of the assumed disc of
//! 0.02 kg·m², a third of the allowed speed, and turns it by 0.1 rad: 6 mm at the elements. M1 is stopped by over-force
//! before, as its mechanism follows in some ms. Smaller deviations take longer, by the formula.
//!
//! Left out: deviations below b, which the trim makes up for and over-speed and over-force bound; a monitor that fails
//! together with its drive and shows what is expected.

use super::settings::{DriveSettings, TorqueWatchSettings};

/// Longest time in which an open reference wire of an armed drive must show, s; the head of this file has its derivation.
pub(crate) const MOST_OPEN_WIRE_S: f32 = 0.02;

/// Time in which the watch finds an open reference wire that asks an armed drive for its rated torque, s; none if never.
pub(crate) fn open_wire_s(drive: &DriveSettings, watch: &TorqueWatchSettings, tick_s: f32) -> Option<f32> {
    let excess_nm = drive.rated_torque_nm - watch.offset_tolerance_nm;
    let most = 2.0 * drive.rated_torque_nm * (watch.lag_tolerance * drive.torque_lag_s + tick_s);
    (excess_nm > 0.0).then(|| (most + drive.torque_lag_s * drive.rated_torque_nm) / excess_nm)
}

/// Coefficients of the watch over one drive.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TorqueWatch {
    lag_per_tick: f32,
    offset_nm: f32,
    gain: f32,
    /// A/Δt.
    most_nm_ticks: f32,
}

/// What the watch over one drive remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TorqueWatchState {
    commanded_nm: f32,
    delayed_nm: f32,
    expected_nm: f32,
    excess_nm_ticks: f32,
}

impl TorqueWatch {
    pub(crate) fn new(drive: &DriveSettings, watch: &TorqueWatchSettings, tick_s: f32) -> Self {
        let lag_ticks = drive.torque_lag_s / tick_s;
        Self {
            lag_per_tick: -libm::expm1f(-tick_s / drive.torque_lag_s),
            offset_nm: watch.offset_tolerance_nm,
            gain: watch.gain_tolerance,
            most_nm_ticks: 2.0 * drive.rated_torque_nm * (watch.lag_tolerance * lag_ticks + 1.0),
        }
    }

    /// One tick with the torque measured; whether it is not what was asked for.
    #[inline(always)]
    pub(crate) fn step(&self, state: &mut TorqueWatchState, measured_nm: f32) -> bool {
        state.expected_nm += self.lag_per_tick * (state.delayed_nm - state.expected_nm);
        state.delayed_nm = state.commanded_nm;
        let bound_nm = self.offset_nm + self.gain * libm::fabsf(state.expected_nm);
        let sum = state.excess_nm_ticks + (libm::fabsf(state.expected_nm - measured_nm) - bound_nm);
        // What is no number counts for nothing here; the checks of the levels and of the commands find it.
        state.excess_nm_ticks = if sum > 0.0 { sum } else { 0.0 };
        state.excess_nm_ticks > self.most_nm_ticks
    }
}

impl TorqueWatchState {
    /// What the drive was asked for in this tick.
    pub(crate) fn commanded(&mut self, torque_nm: f32) {
        self.commanded_nm = torque_nm;
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::ControlSettings;
    use super::*;

    const TICK_S: f64 = 1e-4;

    fn watch() -> TorqueWatch {
        let s = ControlSettings::default();
        TorqueWatch::new(&s.m2, &s.torque_watch, s.tick_s)
    }

    /// Ticks until the watch finds something, with a drive of this lag that gets `wire` of each command.
    fn found(
        lag_s: f64,
        ticks: usize,
        mut command: impl FnMut(usize) -> f64,
        mut wire: impl FnMut(usize, f64) -> f64,
    ) -> Option<usize> {
        let (watch, mut state) = (watch(), TorqueWatchState::default());
        let keep = (-TICK_S / lag_s).exp();
        let (mut torque, mut acting) = (0.0, 0.0);
        (0..ticks).find(|tick| {
            let mismatch = watch.step(&mut state, torque as f32);
            torque = keep * torque + (1.0 - keep) * wire(*tick, acting);
            acting = command(*tick);
            state.commanded(acting as f32);
            mismatch
        })
    }

    #[test]
    fn steps_between_the_rated_torques_are_no_fault_with_every_tolerance_used_up() {
        let square = |tick: usize| if (tick / 200).is_multiple_of(2) { 8.0 } else { -8.0 };
        for lag_s in [0.8e-3, 1e-3, 1.2e-3] {
            for (gain, offset) in [(1.0, 0.0), (1.09, 0.35), (0.91, -0.35)] {
                let hit = found(lag_s, 4000, square, |_, torque| gain * torque + offset);
                assert_eq!(hit, None, "lag {lag_s}, gain {gain}, offset {offset}");
            }
        }
    }

    #[test]
    fn a_drive_out_of_tolerance_is_found_within_the_time_that_the_head_of_this_file_gives() {
        let most = 4.8e-3;
        for (command, wire, deviation) in [
            (0.0, (0.0, 8.0), 8.0),
            (0.0, (0.0, -8.0), 8.0),
            (4.8, (0.5, 0.0), 2.4),
            (4.8, (-1.0, 0.0), 9.6),
            (2.0, (0.0, 0.0), 2.0),
        ] {
            let (gain, offset) = wire;
            let bound = 0.4 + 0.1 * command;
            let hit = found(
                1e-3,
                1000,
                |_| command,
                |tick, torque| if tick < 300 { torque } else { gain * torque + offset },
            );
            let after_s = (hit.expect("found") - 300) as f64 * TICK_S;
            let promised_s = (most + 1e-3 * deviation) / (deviation - bound) + 2.0 * TICK_S;
            assert!(after_s <= promised_s, "{command}: {after_s} s, promised {promised_s} s");
            // And not much earlier: the tolerances are there to be used.
            assert!(after_s > 0.5 * promised_s, "{command}: {after_s} s, promised {promised_s} s");
        }
    }

    #[test]
    fn an_open_wire_of_an_armed_drive_is_found_in_the_time_that_the_settings_may_ask_for() {
        let s = ControlSettings::default();
        let default_s = open_wire_s(&s.m2, &s.torque_watch, s.tick_s).unwrap();
        assert!((default_s - 1.68e-3).abs() < 1e-5, "{default_s}");
        // The slowest drive that these tolerances allow: 13 ms.
        let slow = |torque_lag_s| {
            let mut s = s;
            (s.m2.torque_lag_s, s.m1.torque_lag_s) = (torque_lag_s, torque_lag_s);
            s
        };
        let most = (1..1000).map(|n| slow(n as f32 * 1e-4)).take_while(|s| s.build().is_ok()).last().unwrap();
        let promised_s = open_wire_s(&most.m2, &most.torque_watch, most.tick_s).unwrap();
        assert!(promised_s <= MOST_OPEN_WIRE_S && promised_s > 0.98 * MOST_OPEN_WIRE_S, "{promised_s}");
        let (watch, mut state) =
            (TorqueWatch::new(&most.m2, &most.torque_watch, most.tick_s), TorqueWatchState::default());
        let mut torque = 0.0;
        let found = (1..1000).find(|_| {
            torque += (8.0 - torque) * (1.0 - libm::exp(-TICK_S / f64::from(most.m2.torque_lag_s)));
            watch.step(&mut state, torque as f32)
        });
        let found_s = found.expect("found") as f64 * TICK_S;
        assert!(found_s <= f64::from(promised_s) + 2.0 * TICK_S, "{found_s} s, promised {promised_s} s");
        // A watch that is blind to the whole rated torque is none.
        let mut blind = s;
        (blind.m2.rated_torque_nm, blind.torque_watch.offset_tolerance_nm) = (1.5, 2.0);
        assert_eq!(blind.build().err().map(|error| error.name), Some("m2.torque_lag_s"));
    }

    #[test]
    fn a_reading_that_is_no_number_does_not_blind_it() {
        let (watch, mut state) = (watch(), TorqueWatchState::default());
        assert!(!watch.step(&mut state, f32::NAN));
        assert!((0..100).any(|_| watch.step(&mut state, 8.0)));
    }
}
