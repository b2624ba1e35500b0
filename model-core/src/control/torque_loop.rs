//! Torque loop of one drive: feed-forward with a PI correction from the drive's torque monitor.
//!
//! reference → limit → slew → r;   command = r + trim;   trim = PI(r̂ − measured), |trim| ≤ its limit.
//!
//! The drive closes its own torque loop with a lag τ, so the reference itself is the right command, and the trim
//! only removes what offset and gain error leave. r̂ is r as the drive should show it (one period of delay, lag τ), so
//! a step of the reference makes no error and the trim does not fight the lag. Kp = τω, Ki = ω place one closed loop
//! pole at −ω and cancel the drive's; ω is far below 1/τ.
//!
//! Left out: ripple faster than ω, which the trim neither removes nor excites.

use super::pi::{Pi, PiState, Span, slew};
use super::settings::DriveSettings;
use core::f32::consts::TAU;

/// Coefficients of one torque loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct TorqueLoop {
    trim: Pi,
    trim_limit_nm: f32,
    slew_per_tick_nm: f32,
    lag_per_tick: f32,
    limit: Span,
}

/// What a torque loop remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TorqueState {
    reference_nm: f32,
    delayed_nm: f32,
    expected_nm: f32,
    trim: PiState,
}

/// Command of one tick and what held it back.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct TorqueCommand {
    /// Reference after limit and slew.
    pub(crate) reference_nm: f32,
    /// What the drive is asked for.
    pub(crate) command_nm: f32,
    pub(crate) saturated: bool,
    pub(crate) slewing: bool,
    pub(crate) trim_saturated: bool,
}

impl TorqueLoop {
    pub(crate) fn new(settings: &DriveSettings, tick_s: f32) -> Self {
        let omega = TAU * settings.trim_bandwidth_hz;
        Self {
            trim: Pi {
                kp: settings.torque_lag_s * omega,
                ki_per_tick: omega * tick_s,
                slew_per_tick: f32::MAX,
            },
            trim_limit_nm: settings.trim_limit_nm,
            slew_per_tick_nm: settings.slew_nm_per_s * tick_s,
            lag_per_tick: -libm::expm1f(-tick_s / settings.torque_lag_s),
            limit: Span::symmetric(settings.rated_torque_nm * settings.torque_limit),
        }
    }

    /// Largest torque, either way.
    pub(crate) fn limit(&self) -> Span {
        self.limit
    }

    /// One tick towards `wanted_nm`, which `span` limits further.
    pub(crate) fn step(
        &self,
        state: &mut TorqueState,
        wanted_nm: f32,
        measured_nm: f32,
        span: Span,
    ) -> TorqueCommand {
        let held_nm = span.hold(wanted_nm);
        let reference_nm = slew(state.reference_nm, held_nm, self.slew_per_tick_nm);
        state.expected_nm += self.lag_per_tick * (state.delayed_nm - state.expected_nm);
        let error_nm = state.expected_nm - measured_nm;
        let trim = self.trim.step(&mut state.trim, error_nm, 0.0, Span::symmetric(self.trim_limit_nm));
        let untrimmed_nm = reference_nm + trim.value;
        let command_nm = self.limit.hold(untrimmed_nm);
        state.delayed_nm = state.reference_nm;
        state.reference_nm = reference_nm;
        TorqueCommand {
            reference_nm,
            command_nm,
            saturated: held_nm != wanted_nm || command_nm != untrimmed_nm,
            slewing: reference_nm != held_nm,
            trim_saturated: trim.saturated && self.trim_limit_nm > 0.0,
        }
    }
}

impl TorqueState {
    /// Takes over from another controller that commanded `command_nm`.
    pub(crate) fn taking_over(command_nm: f32, measured_nm: f32) -> Self {
        Self {
            reference_nm: command_nm,
            delayed_nm: command_nm,
            expected_nm: measured_nm,
            trim: PiState::default(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f32 = 1e-4;

    /// A drive with lag, gain error and offset, one period of output delay.
    struct Drive {
        torque_nm: f64,
        command_nm: f64,
        gain: f64,
        offset_nm: f64,
    }

    impl Drive {
        fn new(gain: f64, offset_nm: f64) -> Self {
            Self { torque_nm: offset_nm, command_nm: 0.0, gain, offset_nm }
        }
        fn step(&mut self, next_command_nm: f32) {
            let keep = (-0.1_f64).exp();
            let wanted = self.gain * self.command_nm + self.offset_nm;
            self.torque_nm = keep * self.torque_nm + (1.0 - keep) * wanted;
            self.command_nm = f64::from(next_command_nm);
        }
    }

    fn torque_loop(trim_bandwidth_hz: f32) -> TorqueLoop {
        TorqueLoop::new(&DriveSettings { trim_bandwidth_hz, ..DriveSettings::default() }, TICK_S)
    }

    fn run(torque_loop: &TorqueLoop, drive: &mut Drive, state: &mut TorqueState, wanted_nm: f32, ticks: u32) {
        for _ in 0..ticks {
            let c = torque_loop.step(state, wanted_nm, drive.torque_nm as f32, torque_loop.limit());
            drive.step(c.command_nm);
        }
    }

    #[test]
    fn a_perfect_drive_gets_the_reference_and_no_trim() {
        let torque_loop = torque_loop(5.0);
        let (mut drive, mut state) = (Drive::new(1.0, 0.0), TorqueState::default());
        let mut largest = 0.0_f32;
        for _ in 0..3000 {
            let c = torque_loop.step(&mut state, 3.0, drive.torque_nm as f32, torque_loop.limit());
            largest = largest.max((c.command_nm - c.reference_nm).abs());
            drive.step(c.command_nm);
        }
        // The expected torque is computed as the drive does it; rounding of f32 near 3 is 2e-7.
        assert!(largest < 5e-6, "{largest}");
        assert!((drive.torque_nm - 3.0).abs() < 1e-5);
    }

    #[test]
    fn gain_and_offset_errors_vanish_with_the_trim_and_stay_without() {
        let wanted = 3.0;
        for (hz, left) in [(5.0, 1e-3), (0.0, 0.12)] {
            let torque_loop = torque_loop(hz);
            let (mut drive, mut state) = (Drive::new(1.05, -0.03), TorqueState::default());
            run(&torque_loop, &mut drive, &mut state, wanted, 5000);
            let error = (drive.torque_nm - f64::from(wanted)).abs();
            // Without: 0.05 · 3 − 0.03 = 0.12. With: e^{−2π·5·0.5} = 1.5e-7 of it.
            assert!(if hz > 0.0 { error < left } else { (error - left).abs() < 1e-4 }, "{hz}: {error}");
        }
    }

    #[test]
    fn the_trim_closes_an_offset_with_its_own_bandwidth() {
        let torque_loop = torque_loop(5.0);
        let (mut drive, mut state) = (Drive::new(1.0, 0.2), TorqueState::default());
        let ticks = 500;
        run(&torque_loop, &mut drive, &mut state, 0.0, ticks);
        let expected = 0.2 * (-core::f64::consts::TAU * 5.0 * f64::from(ticks) * 1e-4).exp();
        // The drive's delay of 0.15 ms shifts the exponential by ω·0.15 ms = 0.5 %.
        assert!((drive.torque_nm / expected - 1.0).abs() < 0.01, "{} {expected}", drive.torque_nm);
    }

    #[test]
    fn limit_and_slew_hold_the_reference_and_say_so() {
        let torque_loop = torque_loop(5.0);
        let mut state = TorqueState::default();
        let c = torque_loop.step(&mut state, 20.0, 0.0, torque_loop.limit());
        assert!(c.saturated && c.slewing, "{c:?}");
        assert!((c.reference_nm - 0.4).abs() < 1e-6, "4000 N·m/s for 100 µs: {c:?}");
        for _ in 0..100 {
            let c = torque_loop.step(&mut state, -20.0, 0.0, Span { low: 0.0, high: 8.0 });
            assert!(c.reference_nm >= 0.0 && c.saturated);
        }
    }

    #[test]
    fn a_dead_monitor_cannot_pull_the_command_further_than_the_trim_limit() {
        let torque_loop = torque_loop(5.0);
        let mut state = TorqueState::default();
        for k in 0..20_000 {
            let c = torque_loop.step(&mut state, 3.0, 0.0, torque_loop.limit());
            assert!(c.command_nm <= c.reference_nm + 0.8 + 1e-6);
            assert!(k < 10_000 || c.trim_saturated);
        }
    }
}
