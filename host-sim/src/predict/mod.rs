//! A model driven with the measured inputs of a log, next to what was measured.
//!
//! | signal | predicted from | by |
//! |---|---|---|
//! | friction torque | measured speed and normal force | the friction model, then the rig's friction bridge |
//! | normal force | measured torque of M1 | lever, foil springs, mode of the normal-load actuator, then the normal bridge |
//! | torque of M2 | measured speed and friction torque | inertia and bearing, means over 10 ms |
//!
//! The residual is measured minus predicted; nrmse = RMS(residual)/RMS(measured).

mod bridge;
pub mod curve;
mod drive;
pub mod drive_model;
mod extended;
mod friction;
mod inputs;
mod normal_force;
pub mod observed_slip;

pub use bridge::BridgeModel;
pub use drive::predict_drive;
pub use extended::{acts_on_friction, effects_elsewhere};
pub use friction::{
    Accuracy, StepPlan, drive_contact, simulate_friction, simulate_friction_as, simulate_planned,
};
pub use inputs::ContactInputs;
pub(crate) use inputs::integral;
pub use normal_force::{Mechanism, predict_normal_force};

/// A signal as measured and as predicted, sample by sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    /// As in the log.
    pub measured: Vec<f64>,
    /// By the model.
    pub predicted: Vec<f64>,
}

impl Comparison {
    /// Measured minus predicted.
    pub fn residual(&self) -> Vec<f64> {
        self.measured.iter().zip(&self.predicted).map(|(measured, predicted)| measured - predicted).collect()
    }

    /// RMS of the residual over RMS of the measured signal; `None` where nothing was measured but zero.
    pub fn nrmse(&self) -> Option<f64> {
        nrmse(&self.measured, &self.predicted)
    }
}

/// RMS(measured − predicted)/RMS(measured); `None` where nothing was measured but zero.
pub fn nrmse(measured: &[f64], predicted: &[f64]) -> Option<f64> {
    let error: f64 = measured.iter().zip(predicted).map(|(m, p)| (m - p) * (m - p)).sum();
    let size: f64 = measured.iter().map(|m| m * m).sum();
    (size > 0.0).then(|| (error / size).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nrmse_is_the_rms_of_the_error_over_that_of_the_measurement() {
        // Errors 1 and −1 on 3 and 4: √(2/25).
        assert_eq!(nrmse(&[3.0, 4.0], &[2.0, 5.0]), Some((2.0_f64 / 25.0).sqrt()));
        assert_eq!(nrmse(&[0.0], &[1.0]), None);
    }
}
