//! An experiment file as the control core's experiment: seconds become ticks, fractions torques.

use model_core::control::sequencer::{Experiment, M1Mode, M2Mode, Segment as CoreSegment, Shape};

use super::experiment_file::{CONTROL_PERIOD_S, Course, ExperimentFile, Quantity, Segment, Study};
use super::rig_file::RigFile;
use crate::input_error::InputError;

impl ExperimentFile {
    /// The experiment for the control core of this rig.
    pub fn for_core(&self, rig: &RigFile) -> Result<Experiment, InputError> {
        let Study::ClosedLoop { m1, m2 } = &self.study else {
            let why = match &self.study {
                Study::TwoMotors { .. } => "is for the original rig, which has no normal-load actuator",
                _ => "needs no motors and cannot be run on a rig",
            };
            return Err(InputError::new(why).file(self.source.as_str()).key("kind").allowed("closed_loop"));
        };
        let mut experiment = Experiment { duration_ticks: ticks(self.duration_s), ..Experiment::default() };
        for segment in m1 {
            let core = convert(segment, M1Mode::Torque, rig.m1.rated_torque_nm);
            experiment.m1.push(core).map_err(|_| self.too_many("m1", experiment.m1.capacity()))?;
        }
        for segment in m2 {
            let mode = match segment.quantity {
                Quantity::TorqueNm | Quantity::TorqueFraction => M2Mode::Torque,
                Quantity::SpeedRadS => M2Mode::Speed,
            };
            let core = convert(segment, mode, rig.m2.rated_torque_nm);
            experiment.m2.push(core).map_err(|_| self.too_many("m2", experiment.m2.capacity()))?;
        }
        Ok(experiment)
    }

    fn too_many(&self, motor: &str, most: usize) -> InputError {
        let error = InputError::new("too many segments").file(self.source.as_str()).key(motor);
        error.allowed(format!("up to {most}"))
    }
}

fn ticks(time_s: f64) -> u32 {
    (time_s / CONTROL_PERIOD_S).round() as u32
}

fn convert<M>(segment: &Segment, mode: M, rated_torque_nm: f64) -> CoreSegment<M> {
    let factor = if segment.quantity == Quantity::TorqueFraction { rated_torque_nm } else { 1.0 };
    let scaled = |value: f64| (value * factor) as f32;
    let shape = match segment.course {
        Course::Constant { value } => Shape::Constant { value: scaled(value) },
        Course::Ramp { from, to, ramp_s } => {
            Shape::Ramp { from: scaled(from), to: scaled(to), ticks: ticks(ramp_s).max(1) }
        }
        Course::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad } => Shape::Sine {
            offset: scaled(offset),
            amplitude: scaled(amplitude),
            angular_frequency_rad_s: angular_frequency_rad_s as f32,
            phase_rad: phase_rad as f32,
        },
    };
    CoreSegment { start_tick: ticks(segment.start_s), mode, shape }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seconds_become_ticks_and_fractions_torques() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let experiment = ExperimentFile::named_or_read("fig22", &[]).unwrap().for_core(&rig).unwrap();
        assert_eq!(experiment.duration_ticks, 100_000);
        assert_eq!(experiment.m1[0].shape, Shape::Constant { value: 4.8 });
        assert_eq!(experiment.m2[1].start_tick, 5000);
        let Shape::Sine { amplitude, angular_frequency_rad_s, .. } = experiment.m2[1].shape else {
            panic!("fig22 rocks the disc")
        };
        assert_eq!((amplitude, angular_frequency_rad_s), (2.4, 2.0));
        assert_eq!(experiment.m2[1].mode, M2Mode::Torque);
    }

    #[test]
    fn studies_without_motors_are_refused() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let error = ExperimentFile::named_or_read("fig27", &[]).unwrap().for_core(&rig).unwrap_err();
        assert!(error.to_string().starts_with("experiment fig27: kind: needs no motors"));
    }
}
