//! M2 turns the disc: a speed loop, or a torque loop.
//!
//! Plant: J·dω/dt = τ2 − T − b(ω), b(ω) = τ_C·sign(ω) + d·ω, T the friction torque on the ring, and τ2 behind the
//! drive's lag. With
//!
//! τ2 = J·dω_ref/dt + b(ω_ref) + φ·T_measured + Kp·e + I,   e = ω_ref − ω
//!
//! and Kp = 2ζω₀J, Ki = ω₀²J the error obeys s²+ 2ζω₀s + ω₀² = 0, driven only by what the feed-forward leaves.
//! Friction rises by some 5 N·m within tens of milliseconds; PI alone would let the disc slow by
//! Ṫ/(J·ω₀²), 0.4 rad/s at 200 N·m/s and 25 Hz, a third of the speed at 10 rpm. The measured torque takes that out
//! but for the delay of bridge and drive (about 1.5 ms). Fed through that delay it also damps the mode of disc
//! and rubber, since −T(t) + T(t − δ) ≈ −δ·dT/dt works against the motion.
//!
//! Torque mode is `torque_loop.rs`. In both, torque that drives the disc faster is folded back to zero between the
//! allowed speed and over-speed. Changing the mode makes no bump: the loop taken up starts from the
//! last command, and the speed loop with the present speed for its reference.
//!
//! Left out: a torsional mode of the shaft; ω₀ must stay well below it.

use super::limit::{Limit, LimitSet};
use super::m1::MotorCommand;
use super::pi::{Pi, PiState, Span, slew};
use super::sequencer::M2Mode;
use super::settings::ControlSettings;
use super::torque_loop::{TorqueLoop, TorqueState};
use core::f32::consts::TAU;

/// Coefficients of M2.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct M2 {
    torque: TorqueLoop,
    speed: Pi,
    limit: Span,
    speed_limit: Span,
    slew_rad_s_per_tick: f32,
    inertia_per_tick: f32,
    coulomb_nm: f32,
    viscous_nm_s: f32,
    friction_share: f32,
    foldback_from_rad_s: f32,
    foldback_per_rad_s: f32,
}

/// What M2 remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct M2State {
    mode: Option<M2Mode>,
    torque: TorqueState,
    speed: PiState,
    speed_ref_rad_s: f32,
    command_nm: f32,
}

/// What M2 knows of the rig in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct M2Measured {
    pub(crate) torque_nm: f32,
    pub(crate) speed_rad_s: f32,
    /// Filtered.
    pub(crate) friction_torque_nm: f32,
}

impl M2 {
    pub(crate) fn new(settings: &ControlSettings) -> Self {
        let (s, dt) = (&settings.speed_loop, settings.tick_s);
        let torque = TorqueLoop::new(&settings.m2, dt);
        let omega = TAU * s.bandwidth_hz;
        let limits = &settings.limits;
        Self {
            torque,
            speed: Pi {
                kp: 2.0 * s.damping_ratio * omega * s.inertia_kg_m2,
                ki_per_tick: omega * omega * s.inertia_kg_m2 * dt,
                slew_per_tick: settings.m2.slew_nm_per_s * dt,
            },
            limit: torque.limit(),
            speed_limit: Span::symmetric(limits.speed_rad_s),
            slew_rad_s_per_tick: s.slew_rad_s2 * dt,
            inertia_per_tick: s.inertia_kg_m2 / dt,
            coulomb_nm: s.bearing_coulomb_nm,
            viscous_nm_s: s.bearing_viscous_nm_s,
            friction_share: s.friction_feed_forward,
            foldback_from_rad_s: limits.speed_rad_s,
            foldback_per_rad_s: 1.0 / (limits.over_speed_rad_s - limits.speed_rad_s),
        }
    }

    /// Largest torque an experiment may ask for, either way.
    pub(crate) fn torque_limit_nm(&self) -> f32 {
        self.limit.high
    }

    /// Torque limits at this speed: what drives the disc on is folded back near the allowed speed.
    fn span_at(&self, speed_rad_s: f32) -> Span {
        let over = |speed: f32| {
            Span { low: 0.0, high: 1.0 }.hold((speed - self.foldback_from_rad_s) * self.foldback_per_rad_s)
        };
        Span {
            low: self.limit.low * (1.0 - over(-speed_rad_s)),
            high: self.limit.high * (1.0 - over(speed_rad_s)),
        }
    }

    /// One tick towards `wanted`, rad/s or N·m by `mode`.
    pub(crate) fn step(
        &self,
        state: &mut M2State,
        mode: M2Mode,
        wanted: f32,
        measured: &M2Measured,
        limits: &mut LimitSet,
    ) -> MotorCommand {
        let span = self.span_at(measured.speed_rad_s);
        let folded = span != self.limit;
        let command = match mode {
            M2Mode::Torque => {
                if state.mode != Some(mode) {
                    state.torque = TorqueState::taking_over(state.command_nm, measured.torque_nm);
                    state.speed_ref_rad_s = 0.0;
                }
                let c = self.torque.step(&mut state.torque, wanted, measured.torque_nm, span);
                limits.insert_if(Limit::SpeedFoldback, folded && c.saturated);
                limits.insert_if(Limit::M2Torque, !folded && c.saturated);
                limits.insert_if(Limit::M2Slew, c.slewing);
                limits.insert_if(Limit::M2Trim, c.trim_saturated);
                MotorCommand { reference_nm: c.reference_nm, command_nm: c.command_nm }
            }
            M2Mode::Speed => {
                let fresh = state.mode != Some(mode);
                if fresh {
                    state.speed_ref_rad_s = measured.speed_rad_s;
                }
                let allowed = self.speed_limit.hold(wanted);
                let reference = slew(state.speed_ref_rad_s, allowed, self.slew_rad_s_per_tick);
                let rise = reference - state.speed_ref_rad_s;
                state.speed_ref_rad_s = reference;
                let friction_nm = self.friction_share * measured.friction_torque_nm;
                let feed_forward = self.inertia_per_tick * rise + self.bearing_nm(reference) + friction_nm;
                let error = reference - measured.speed_rad_s;
                if fresh {
                    state.speed = PiState::taking_over(state.command_nm, friction_nm);
                }
                let c = self.speed.step(&mut state.speed, error, feed_forward, span);
                limits.insert_if(Limit::SpeedReference, allowed != wanted);
                limits.insert_if(Limit::SpeedSlew, reference != allowed);
                limits.insert_if(Limit::SpeedFoldback, folded && c.saturated);
                limits.insert_if(Limit::M2Torque, !folded && c.saturated);
                limits.insert_if(Limit::M2Slew, c.slewing);
                MotorCommand { reference_nm: c.value, command_nm: c.value }
            }
        };
        state.mode = Some(mode);
        state.command_nm = command.command_nm;
        command
    }

    /// Friction of the bearing at the speed asked for; none in rest, where its sign is not known.
    fn bearing_nm(&self, speed_rad_s: f32) -> f32 {
        let coulomb = if speed_rad_s > 0.0 {
            self.coulomb_nm
        } else if speed_rad_s < 0.0 {
            -self.coulomb_nm
        } else {
            0.0
        };
        coulomb + self.viscous_nm_s * speed_rad_s
    }
}

impl M2State {
    /// Speed the loop follows; 0 in torque mode.
    pub(crate) fn speed_ref_rad_s(&self) -> f32 {
        self.speed_ref_rad_s
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// First command of a speed step, with a slew limit of the torque that does not act.
    fn first_command(wanted: f32, friction_torque_nm: f32) -> f32 {
        let mut settings = ControlSettings::default();
        settings.m2.slew_nm_per_s = 1e5;
        let m2 = M2::new(&settings);
        let (mut state, mut limits) = (M2State::default(), LimitSet::EMPTY);
        let measured = M2Measured { friction_torque_nm, ..M2Measured::default() };
        m2.step(&mut state, M2Mode::Speed, wanted, &measured, &mut limits).command_nm
    }

    #[test]
    fn the_first_command_is_the_feed_forward_of_inertia_bearing_and_friction_with_their_signs() {
        // J · 100 rad/s² = 2, Coulomb 0.15, viscous 0.005 · 0.01, Kp · 0.01 rad/s = 2 · 157 · 0.02 · 0.01 = 0.0628.
        let ramp_nm = 2.0 + 0.15 + 5e-5 + 0.062_83;
        for sign in [1.0, -1.0] {
            let got = first_command(sign * 10.0, 0.0);
            assert!((got - sign * ramp_nm).abs() < 1e-4, "{sign}: {got}");
        }
        // The friction is part of what the state is taken over from, so at first it moves nothing.
        assert!((first_command(10.0, 1.0) - ramp_nm).abs() < 1e-4);
    }

    #[test]
    fn the_torque_limits_fold_back_only_the_torque_that_drives_on() {
        let m2 = M2::new(&ControlSettings::default());
        assert_eq!(m2.span_at(30.0), Span::symmetric(8.0));
        let half = m2.span_at(0.5 * (31.5 + 34.0));
        assert!((half.high - 4.0).abs() < 1e-4 && half.low == -8.0, "{half:?}");
        let gone = m2.span_at(-40.0);
        assert!(gone.low == 0.0 && gone.high == 8.0, "{gone:?}");
    }
}
