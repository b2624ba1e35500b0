//! The paper's original rig under torques of both motors: what a log of it holds, and the twist of its shaft.

use crate::files::experiment_file::{ExperimentFile, Quantity, Segment};
use crate::files::log::Log;
use crate::files::signal::Signal;
use crate::input_error::InputError;
use crate::plant::parameters::NoiseParameters;
use crate::plant::two_motors::{TwoMotorParameters, TwoMotorReading, TwoMotorTruth, TwoMotors};
use crate::plant::{PERIOD_S, PERIODS_PER_S, time_s};
use crate::report::{Chart, Line, Panel, Role};

/// A run; one entry a sample of the log.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Time of each sample.
    pub time_s: Vec<f64>,
    /// What both motors were asked for.
    pub asked_nm: Vec<[f64; 2]>,
    /// What was read.
    pub read: Vec<TwoMotorReading>,
    /// What was true.
    pub truth: Vec<TwoMotorTruth>,
}

/// The torque that the segments ask for at a time, N m.
fn torque_nm(segments: &[Segment], rated_torque_nm: f64, time_s: f64) -> f64 {
    // Starts are multiples of the control period, as times are, but for rounding.
    let begun = segments.iter().rev().find(|s| s.start_s <= time_s + 0.5 * PERIOD_S);
    begun.map_or(0.0, |segment| {
        let factor = if segment.quantity == Quantity::TorqueFraction { rated_torque_nm } else { 1.0 };
        factor * segment.course.at(time_s - segment.start_s)
    })
}

/// Runs an experiment whose segments are torques.
///
/// # Errors
/// A torque beyond what a drive can give.
pub fn run(
    experiment: &ExperimentFile,
    [m1, m2]: [&[Segment]; 2],
    rig: &TwoMotorParameters,
) -> Result<Run, InputError> {
    let noise = if experiment.plant.sensor_noise { NoiseParameters::default().torque_nm } else { 0.0 };
    let mut motors = TwoMotors::new(rig, noise, experiment.seed);
    let rated = [rig.m1.drive.rated_torque_nm, rig.m2.drive.rated_torque_nm];
    #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
    let periods = (experiment.duration_s / PERIOD_S).round() as usize;
    let every = PERIODS_PER_S / experiment.log_rate_hz as usize;
    let mut out = Run { time_s: vec![], asked_nm: vec![], read: vec![], truth: vec![] };
    for k in 0..periods {
        let time_s = time_s(k);
        let asked_nm = [torque_nm(m1, rated[0], time_s), torque_nm(m2, rated[1], time_s)];
        for (name, asked, most) in [("m1", asked_nm[0], rated[0]), ("m2", asked_nm[1], rated[1])] {
            if asked.abs() > most {
                let error = InputError::new(format!("asks for {asked} N m at {time_s} s"));
                let error = error.file(experiment.source.as_str()).key(name);
                return Err(error.allowed(format!("up to the rated {most} N m, either way")));
            }
        }
        if k % every == 0 {
            out.time_s.push(time_s);
            out.asked_nm.push(asked_nm);
            out.read.push(motors.read());
            out.truth.push(motors.truth());
        }
        motors.advance(asked_nm);
    }
    Ok(out)
}

impl Run {
    /// The log: a drive log by M2's columns, M1's beside them, and the true torque of the shaft, which nothing measures.
    #[must_use]
    pub fn log(&self) -> Log {
        let mut log = Log::default();
        let read = |pick: fn(&TwoMotorReading) -> f64| self.read.iter().map(pick).collect::<Vec<_>>();
        log.set_signal(Signal::Time, self.time_s.clone());
        log.set_signal(Signal::M1TorqueRef, self.asked_nm.iter().map(|t| t[0]).collect());
        log.set_signal(Signal::M1Torque, read(|r| r.torque_nm[0]));
        log.set_signal(Signal::M1Angle, read(|r| r.angle_rad[0]));
        log.set_signal(Signal::M2TorqueRef, self.asked_nm.iter().map(|t| t[1]).collect());
        log.set_signal(Signal::M2Torque, read(|r| r.torque_nm[1]));
        log.set_signal(Signal::M2Angle, read(|r| r.angle_rad[1]));
        log.set_numbers("true_shaft_torque_nm", self.truth.iter().map(|t| t.shaft_nm).collect());
        log
    }

    /// Largest torque of the shaft, N m, and largest twist, rad, both true.
    #[must_use]
    pub fn largest(&self) -> (f64, f64) {
        self.truth.iter().fold((0.0, 0.0), |(torque, twist), t| {
            (torque.max(t.shaft_nm.abs()), twist.max((t.angle_rad[1] - t.angle_rad[0]).abs()))
        })
    }

    /// Torques, speeds, twist.
    #[must_use]
    pub fn chart(&self) -> Chart {
        let line = |name: &str, role, pick: &dyn Fn(&TwoMotorTruth) -> f64, tolerance| Line {
            name: name.into(),
            role,
            x: self.time_s.clone(),
            y: self.truth.iter().map(pick).collect(),
            tolerance,
            fine_tolerance: tolerance,
        };
        let panel = |y_title: &str, lines| Panel { y_title: y_title.into(), lines };
        Chart {
            title: "Two motors on a shaft.".into(),
            caption: "The original rig: M2 drives, M1 loads. All true values; the rig's numbers are assumed."
                .into(),
            x_title: "time, s".into(),
            panels: vec![
                panel(
                    "torque, N m",
                    vec![
                        line("M1", Role::Reference, &|t| t.torque_nm[0], 2e-3),
                        line("M2", Role::Measured, &|t| t.torque_nm[1], 2e-3),
                        line("shaft", Role::Series, &|t| t.shaft_nm, 2e-3),
                    ],
                ),
                panel(
                    "speed, rad/s",
                    vec![
                        line("M1", Role::Reference, &|t| t.speed_rad_s[0], 1e-2),
                        line("M2", Role::Measured, &|t| t.speed_rad_s[1], 1e-2),
                    ],
                ),
                panel(
                    "twist, mrad",
                    vec![line(
                        "M2 less M1",
                        Role::Series,
                        &|t| 1e3 * (t.angle_rad[1] - t.angle_rad[0]),
                        1e-2,
                    )],
                ),
            ],
            ..Chart::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::experiment_file::Study;
    use crate::plant::two_motor_file::read_or_assumed;

    #[test]
    fn the_original_experiment_loads_the_shaft_and_its_log_is_one_of_a_drive() {
        let experiment = ExperimentFile::named_or_read("original", &[]).unwrap();
        let Study::TwoMotors { m1, m2 } = &experiment.study else { panic!("two motors") };
        let run = run(&experiment, [m1, m2], &read_or_assumed(None, &[]).unwrap()).unwrap();
        assert_eq!(run.time_s.len(), 8_000);
        // After the first stroke the shaft accelerates M1 with its discs, and turns its bearing.
        let struck = &run.truth[4_050..=4_450];
        let mean = |of: &dyn Fn(&TwoMotorTruth) -> f64| struck.iter().map(of).sum::<f64>() / 401.0;
        let gained_rad_s = struck[400].speed_rad_s[0] - struck[0].speed_rad_s[0];
        let needed_nm = 0.0214 * gained_rad_s / 0.4
            + mean(&|t| 0.1 * t.speed_rad_s[0].signum() + 0.002 * t.speed_rad_s[0]);
        let seen_nm = mean(&|t| t.shaft_nm);
        assert!(seen_nm > 1.0 && (seen_nm / needed_nm - 1.0).abs() < 0.02, "{seen_nm} N m, {needed_nm} N m");
        let log = run.log();
        assert!(log.drive().is_ok());
        // Noise of the monitor, and a step of the resolver.
        let worst = |a: &[f64], b: Vec<f64>| a.iter().zip(&b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        let torque = log.signal(Signal::M2Torque).unwrap();
        assert!(worst(torque, run.truth.iter().map(|t| t.torque_nm[1]).collect()) < 6.0 * 0.005);
        let angle = log.signal(Signal::M1Angle).unwrap();
        assert!(worst(angle, run.truth.iter().map(|t| t.angle_rad[0]).collect()) < 1.2e-3);
    }

    #[test]
    fn a_torque_beyond_the_drive_is_refused() {
        let changes = [("m2.1.torque_nm".to_string(), "9".to_string())];
        let experiment = ExperimentFile::named_or_read("original", &changes).unwrap();
        let Study::TwoMotors { m1, m2 } = &experiment.study else { panic!("two motors") };
        let error = run(&experiment, [m1, m2], &read_or_assumed(None, &[]).unwrap()).unwrap_err();
        assert_eq!(
            error.to_string(),
            "experiment original: m2: asks for 9 N m at 4 s; allowed: up to the rated 8 N m, either way"
        );
    }
}
