//! M1 presses the elements on the disc: a torque loop, held to torques the contact may take.
//!
//! In rest F_N = lever gain · τ1 − preload, so the torque limit is the smaller of the drive's own and
//! (F_N,max + preload)/lever gain. M1 never pulls: the foil springs lift the elements off.
//!
//! Left out: the transient of the normal force mode, which may exceed the limit by its overshoot; over-force
//! watches that.

use super::limit::{Limit, LimitSet};
use super::pi::Span;
use super::settings::ControlSettings;
use super::torque_loop::{TorqueLoop, TorqueState};

/// Coefficients of M1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct M1 {
    torque: TorqueLoop,
    drive_limit_nm: f32,
    force_limit_nm: f32,
}

/// What a motor is asked for in one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct MotorCommand {
    /// For the record.
    pub(crate) reference_nm: f32,
    /// For the drive.
    pub(crate) command_nm: f32,
}

impl M1 {
    pub(crate) fn new(settings: &ControlSettings) -> Self {
        let torque = TorqueLoop::new(&settings.m1, settings.tick_s);
        let g = &settings.geometry;
        Self {
            torque,
            drive_limit_nm: torque.limit().high,
            force_limit_nm: (settings.limits.normal_force_n + g.preload_n) / g.lever_gain_n_per_nm,
        }
    }

    /// Largest torque an experiment may ask for.
    pub(crate) fn torque_limit_nm(&self) -> f32 {
        if self.force_limit_nm < self.drive_limit_nm { self.force_limit_nm } else { self.drive_limit_nm }
    }

    /// One tick towards `wanted_nm`.
    pub(crate) fn step(
        &self,
        state: &mut TorqueState,
        wanted_nm: f32,
        measured_nm: f32,
        limits: &mut LimitSet,
    ) -> MotorCommand {
        let span = Span { low: 0.0, high: self.torque_limit_nm() };
        let c = self.torque.step(state, wanted_nm, measured_nm, span);
        let by_force = wanted_nm > self.force_limit_nm && self.force_limit_nm < self.drive_limit_nm;
        limits.insert_if(Limit::NormalForce, by_force);
        limits.insert_if(Limit::M1Torque, c.saturated && !by_force);
        limits.insert_if(Limit::M1Slew, c.slewing);
        limits.insert_if(Limit::M1Trim, c.trim_saturated);
        MotorCommand { reference_nm: c.reference_nm, command_nm: c.command_nm }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_torque_is_held_to_what_the_contact_may_take() {
        let mut settings = ControlSettings::default();
        settings.limits.normal_force_n = 100.0;
        let m1 = M1::new(&settings);
        // (100 + 8)/30
        assert!((m1.torque_limit_nm() - 3.6).abs() < 1e-6);
        let (mut state, mut limits, mut last) =
            (TorqueState::default(), LimitSet::EMPTY, MotorCommand::default());
        for _ in 0..100 {
            limits = LimitSet::EMPTY;
            last = m1.step(&mut state, 5.0, last.command_nm, &mut limits);
        }
        assert!((last.reference_nm - 3.6).abs() < 1e-6, "{last:?}");
        assert!(limits.contains(Limit::NormalForce) && !limits.contains(Limit::M1Torque), "{limits:?}");
    }

    #[test]
    fn m1_never_pulls() {
        let m1 = M1::new(&ControlSettings::default());
        let (mut state, mut limits) = (TorqueState::default(), LimitSet::EMPTY);
        for _ in 0..100 {
            assert_eq!(m1.step(&mut state, -1.0, 0.0, &mut limits).reference_nm, 0.0);
        }
        assert!(limits.contains(Limit::M1Torque));
    }
}
