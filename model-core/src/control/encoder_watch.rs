//! Lost encoders: torque without counts, and counts without torque.
//!
//! M2 turns freely, so torque beyond friction must turn it, and speed can only come from torque:
//! * no counts: |τ2 − T| > breakaway torque for a whole window, and the position stayed within two counts (a stuck
//!   line of a quadrature pair dithers by one);
//! * no torque: within a window the speed changed otherwise than by ∫(τ2 − T)/J dt, and the difference is more than
//!   ∫(|τ2| + |T|)/J dt, the bearing and an allowance explain. So an inertia set wrong by half goes through, and a
//!   speed that rises against the torque does not.
//!
//! M1 moves against springs, so its angle follows its torque:
//! * no counts: the torque moved by more than its breakaway for a window, and the position stayed within two counts;
//! * no torque: the torque was quiet for a window (the motion of the last change has died out), and is still, but the
//!   angle moves away.
//!
//! Sudden losses at speed are the jumps of `encoder.rs`. Left out: errors smaller than these bounds, such as a few
//! lost counts; the once-per-turn index that would show them is not wired.

use super::settings::ControlSettings;

/// Most that a position with a dead line moves.
const DITHER_COUNTS: u64 = 2;
/// Share of the breakaway torque within which M1 counts as quiet.
const QUIET_SHARE: f32 = 0.25;

/// A lost encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Loss {
    NoCounts,
    NoTorque,
}

/// Coefficients of the watch over M2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct FreeWatch {
    breakaway_nm: f32,
    window_ticks: u32,
    speed_per_torque: f32,
    free_speed_rad_s: f32,
}

/// What the watch over M2 remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct FreeWatchState {
    anchor_count: i64,
    pushed_ticks: u32,
    window_left: u32,
    expected_rad_s: f32,
    possible_rad_s: f32,
}

impl FreeWatch {
    pub(crate) fn new(settings: &ControlSettings) -> Self {
        let (w, l) = (&settings.encoder_watch, &settings.speed_loop);
        let bearing_nm = l.bearing_coulomb_nm + l.bearing_viscous_nm_s * settings.limits.over_speed_rad_s;
        Self {
            breakaway_nm: w.m2_breakaway_nm,
            window_ticks: ((w.window_s / settings.tick_s) as u32).max(1),
            speed_per_torque: settings.tick_s / l.inertia_kg_m2,
            free_speed_rad_s: w.m2_free_speed_rad_s + bearing_nm * w.window_s / l.inertia_kg_m2,
        }
    }

    /// One tick with position, speed, torque of the motor and friction torque.
    pub(crate) fn step(
        &self,
        state: &mut FreeWatchState,
        count: i64,
        speed_rad_s: f32,
        torque_nm: f32,
        friction_nm: f32,
    ) -> Option<Loss> {
        let pushed = libm::fabsf(torque_nm - friction_nm) > self.breakaway_nm;
        if pushed && count.wrapping_sub(state.anchor_count).unsigned_abs() <= DITHER_COUNTS {
            state.pushed_ticks = state.pushed_ticks.saturating_add(1);
        } else {
            (state.anchor_count, state.pushed_ticks) = (count, 0);
        }
        if state.window_left == 0 {
            state.window_left = self.window_ticks;
            state.expected_rad_s = speed_rad_s;
            state.possible_rad_s = self.free_speed_rad_s;
        }
        state.window_left -= 1;
        state.expected_rad_s += self.speed_per_torque * (torque_nm - friction_nm);
        state.possible_rad_s += self.speed_per_torque * (libm::fabsf(torque_nm) + libm::fabsf(friction_nm));
        if state.pushed_ticks >= self.window_ticks {
            Some(Loss::NoCounts)
        } else if libm::fabsf(speed_rad_s - state.expected_rad_s) > state.possible_rad_s {
            Some(Loss::NoTorque)
        } else {
            None
        }
    }
}

/// Coefficients of the watch over M1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SprungWatch {
    breakaway_nm: f32,
    quiet_nm: f32,
    window_ticks: u32,
    free_counts: u64,
}

/// What the watch over M1 remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct SprungWatchState {
    moved_count: i64,
    moved_torque_nm: f32,
    pushed_ticks: u32,
    quiet_torque_nm: f32,
    quiet_ticks: u32,
    quiet_count: i64,
}

impl SprungWatch {
    pub(crate) fn new(settings: &ControlSettings, rad_per_count: f32) -> Self {
        let w = &settings.encoder_watch;
        Self {
            breakaway_nm: w.m1_breakaway_nm,
            quiet_nm: QUIET_SHARE * w.m1_breakaway_nm,
            window_ticks: ((w.window_s / settings.tick_s) as u32).max(1),
            free_counts: (w.m1_free_angle_rad / rad_per_count) as u64,
        }
    }

    /// One tick with position and torque of the motor.
    pub(crate) fn step(&self, state: &mut SprungWatchState, count: i64, torque_nm: f32) -> Option<Loss> {
        let moved = count.wrapping_sub(state.moved_count).unsigned_abs() > DITHER_COUNTS;
        if moved {
            (state.moved_count, state.moved_torque_nm, state.pushed_ticks) = (count, torque_nm, 0);
        } else if libm::fabsf(torque_nm - state.moved_torque_nm) > self.breakaway_nm {
            state.pushed_ticks = state.pushed_ticks.saturating_add(1);
        } else {
            state.pushed_ticks = 0;
        }
        if libm::fabsf(torque_nm - state.quiet_torque_nm) > self.quiet_nm {
            (state.quiet_torque_nm, state.quiet_ticks) = (torque_nm, 0);
        }
        if state.quiet_ticks <= self.window_ticks {
            (state.quiet_count, state.quiet_ticks) = (count, state.quiet_ticks + 1);
        }
        if state.pushed_ticks >= self.window_ticks {
            Some(Loss::NoCounts)
        } else if count.wrapping_sub(state.quiet_count).unsigned_abs() > self.free_counts {
            Some(Loss::NoTorque)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn free() -> (FreeWatch, FreeWatchState) {
        (FreeWatch::new(&ControlSettings::default()), FreeWatchState::default())
    }

    fn sprung() -> (SprungWatch, SprungWatchState) {
        let rad_per_count = core::f32::consts::TAU / 480_000.0;
        (SprungWatch::new(&ControlSettings::default(), rad_per_count), SprungWatchState::default())
    }

    #[test]
    fn m2_pushed_without_counts_is_found_after_a_window_even_if_it_dithers() {
        let (watch, mut state) = free();
        let found = (0..1000).position(|k| watch.step(&mut state, k % 2, 0.0, 3.0, 0.5).is_some());
        assert_eq!(found, Some(199), "20 ms");
    }

    #[test]
    fn m2_held_by_friction_is_not_lost() {
        let (watch, mut state) = free();
        for _ in 0..10_000 {
            assert_eq!(watch.step(&mut state, 7, 0.0, 4.8, 4.0), None);
        }
    }

    #[test]
    fn m2_that_moves_under_torque_is_not_lost() {
        // 4 N·m on 0.02 kg·m² from rest: 200 rad/s², through the reversal of the torque and back.
        let (watch, mut state) = free();
        let (mut angle, mut speed) = (0.0_f64, 0.0_f64);
        for k in 0..6000 {
            let torque = if (k / 1000) % 2 == 0 { 4.0 } else { -4.0 };
            speed += torque / 0.02 * 1e-4;
            angle += speed * 1e-4;
            let count = (angle * 480_000.0 / core::f64::consts::TAU) as i64;
            assert_eq!(watch.step(&mut state, count, speed as f32, torque as f32, 0.0), None, "tick {k}");
        }
    }

    #[test]
    fn speed_that_no_torque_explains_is_found() {
        let (watch, mut state) = free();
        let found = (0..200_i64).find_map(|k| watch.step(&mut state, k * k, 0.5 * k as f32, 0.1, 0.0));
        assert_eq!(found, Some(Loss::NoTorque));
    }

    #[test]
    fn m1_pushed_without_counts_is_found() {
        let (watch, mut state) = sprung();
        for _ in 0..500 {
            assert_eq!(watch.step(&mut state, 100, 0.4), None);
        }
        let found = (0..1000).position(|_| watch.step(&mut state, 101, 3.0) == Some(Loss::NoCounts));
        assert_eq!(found, Some(199));
    }

    #[test]
    fn m1_that_swings_after_a_step_of_its_torque_is_not_lost() {
        // 2.8 N·m through 30 N/(N·m) and 3000 N/rad: 28 mrad, 120 Hz with damping ratio 0.25.
        let (watch, mut state) = sprung();
        let omega = core::f64::consts::TAU * 120.0;
        for k in 0..5000 {
            let t = f64::from(k) * 1e-4 - 0.1;
            let (torque, angle) = if t < 0.0 {
                (0.44, 0.0)
            } else {
                (3.24, 0.028 * (1.0 - (-0.25 * omega * t).exp() * (0.968 * omega * t).cos()))
            };
            let count = (angle * 480_000.0 / core::f64::consts::TAU) as i64;
            assert_eq!(watch.step(&mut state, count, torque as f32), None, "tick {k}");
        }
    }

    #[test]
    fn m1_that_moves_away_under_a_quiet_torque_is_found() {
        let (watch, mut state) = sprung();
        let found = (0..5000_i64).find_map(|k| watch.step(&mut state, k, 1.0).map(|loss| (k, loss)));
        // 0.02 rad are 1527 counts, counted from the end of the quiet window.
        assert_eq!(found, Some((200 + 1528, Loss::NoTorque)));
    }
}
