//! Logs of a drive without contact: a rotary one, or a linear stage.
//!
//! Course: a shuffled deck of moves out and back at several speeds, crawls, slow and fast sines, quick
//! reversals, dwells, and pushes that stay below the Coulomb drag; every move ends where it began.

use std::fmt::Write as _;

use crate::contact_log::STEPS_PER_S;
use crate::course::{Motion, Shape, active};
use crate::drive::{Drive, DriveNumbers, SpeedLoop};
use crate::imperfections::Imperfections;
use crate::laws::{Laws, Setting, Units};
use crate::random::Stream;
use crate::rig::Rig;
use crate::scenario::{Form, GeneratedCase, Scenario};
use crate::sensors::Noise;
use crate::shadow::Residual;
use crate::truth::Truth;

/// Steps per control period.
const STEPS_PER_CONTROL: usize = 10;
/// Window over which the balance of torques is taken, in steps.
const STEPS_PER_WINDOW: usize = 400;
/// Resolution of the linear stage's encoder.
const STAGE_LSB_M: f64 = 1e-7;

#[derive(Clone, Copy)]
enum Move {
    OutAndBack(f64),
    Crawl,
    SlowSine,
    FastSine,
    Reversals,
    Dwell,
    Push,
}

fn course(s: &mut Stream, numbers: &DriveNumbers, duration_s: f64) -> Vec<(f64, Motion)> {
    let decks = (duration_s / 30.0).ceil().max(1.0) as usize;
    let mut moves = Vec::new();
    for _ in 0..decks {
        let mut deck = vec![
            Move::OutAndBack(15.0),
            Move::OutAndBack(9.0),
            Move::OutAndBack(5.0),
            Move::OutAndBack(2.5),
            Move::Crawl,
            Move::Crawl,
            Move::SlowSine,
            Move::SlowSine,
            Move::FastSine,
            Move::FastSine,
            Move::Reversals,
            Move::Dwell,
            Move::Push,
            Move::Push,
        ];
        s.shuffle(&mut deck);
        moves.extend(deck);
    }
    let lengths: Vec<f64> = moves.iter().map(|_| s.uniform(0.9, 1.7)).collect();
    let stretch = (duration_s - 0.2) / lengths.iter().sum::<f64>();
    let travel = numbers.units.travel;
    let mut list = vec![(0.0, Motion::Speed(Shape::Hold(0.0), 100.0 * travel))];
    let mut time = 0.2;
    for (kind, length) in moves.iter().zip(&lengths) {
        let length = length * stretch;
        let slew = s.log_uniform(40.0, 140.0) * travel;
        let speed = |shape| Motion::Speed(shape, slew);
        match kind {
            Move::OutAndBack(top) => {
                let top = s.sign() * s.about(*top, 0.2) * travel;
                list.push((time, speed(Shape::Hold(top))));
                list.push((time + 0.44 * length, speed(Shape::Hold(-top))));
                list.push((time + 0.88 * length, speed(Shape::Hold(0.0))));
            }
            Move::Crawl => {
                let top = s.signed(0.2, 0.7) * travel;
                list.push((time, speed(Shape::Hold(top))));
                list.push((time + 0.5 * length, speed(Shape::Hold(-top))));
            }
            Move::SlowSine | Move::FastSine => {
                let (amplitude, cycles) = if matches!(kind, Move::SlowSine) {
                    (s.log_uniform(1.5, 8.0), 1.0 + s.below(2) as f64)
                } else {
                    (s.uniform(0.8, 2.0), (s.uniform(4.0, 11.0) * length).round())
                };
                let hz = cycles / length;
                let amplitude = s.sign() * amplitude * travel;
                list.push((time, Motion::Speed(Shape::Sine { mean: 0.0, amplitude, hz }, 1e3 * travel)));
            }
            Move::Reversals => {
                let hz = (s.uniform(2.0, 4.0) * length).round() / length;
                let amplitude = s.signed(1.0, 4.0) * travel;
                list.push((time, speed(Shape::Square { amplitude, hz })));
            }
            Move::Dwell => list.push((time, speed(Shape::Hold(0.0)))),
            Move::Push => {
                list.push((time, speed(Shape::Hold(0.0))));
                let amplitude = numbers.coulomb * s.signed(0.5, 0.85);
                let hz = (s.uniform(1.0, 3.0) * 0.8 * length).round().max(1.0) / (0.8 * length);
                let push = Shape::Sine { mean: 0.0, amplitude, hz };
                list.push((time + 0.2 * length, Motion::Torque(push)));
            }
        }
        time += length;
    }
    list
}

struct Run {
    rows: Vec<(f64, f64, f64)>,
    residual: Residual,
}

fn run(
    numbers: DriveNumbers,
    laws: &Laws,
    list: &[(f64, Motion)],
    limit: f64,
    schedule: &[usize],
    scenario: &Scenario,
    s: &mut Stream,
) -> Run {
    let h = 1.0 / STEPS_PER_S;
    let steps = (scenario.duration_s * STEPS_PER_S).round() as usize;
    let travel = numbers.units.travel;
    let start_angle = s.phase() * travel;
    let origin = if s.chance(0.5) { start_angle } else { start_angle - s.uniform(-20.0, 20.0) * travel };
    let mut laws = laws.clone();
    laws.begin_log(s, scenario.duration_s);
    let mut drive = Drive::new(numbers, &laws, h, start_angle);
    let mut speed_loop =
        SpeedLoop::new(numbers.inertia, s.uniform(55.0, 85.0), limit, h * STEPS_PER_CONTROL as f64);
    let mut rows = Vec::with_capacity(schedule.len());
    let mut next_sample = schedule.iter().copied().peekable();
    let (mut command, mut balance, mut torque, mut last_speed) = (0.0, 0.0, 0.0, 0.0);
    let mut squares = [0.0, 0.0];
    let mut ran_away = false;
    let mut segment = -1.0;
    for n in 0..=steps {
        let time = n as f64 * h;
        if n % STEPS_PER_CONTROL == 0 {
            let (start, motion) = active(list, time);
            if start > segment {
                segment = start;
                ran_away = false;
            }
            let speed = drive.motor_speed();
            command = match motion {
                Motion::Speed(shape, slew) => speed_loop.step(shape.at(time - start), slew, speed),
                Motion::Torque(_) if ran_away => speed_loop.step(0.0, 100.0 * travel, speed),
                Motion::Torque(shape) => {
                    ran_away = speed.abs() > 3.0 * travel;
                    let asked = shape.at(time - start);
                    speed_loop.follow(asked, speed);
                    asked
                }
            };
        }
        drive.step(command, 0.0, 0.0);
        let speed = drive.motor_speed();
        balance += drive.reported_torque() - drive.plain_drag(speed);
        torque += drive.reported_torque();
        if (n + 1) % STEPS_PER_WINDOW == 0 {
            let count = STEPS_PER_WINDOW as f64;
            let left = balance / count - numbers.inertia * (speed - last_speed) / (count * h);
            squares[0] += left * left;
            squares[1] += (torque / count).powi(2);
            (balance, torque, last_speed) = (0.0, 0.0, speed);
        }
        if next_sample.next_if_eq(&n).is_some() {
            rows.push((n as f64 / STEPS_PER_S, drive.reported_torque(), drive.motor_angle() - origin));
        }
    }
    let windows = (steps / STEPS_PER_WINDOW).max(1) as f64;
    let residual = Residual {
        drive_nm: (squares[0] / windows).sqrt(),
        drive_signal_nm: (squares[1] / windows).sqrt(),
        ..Residual::default()
    };
    Run { rows, residual }
}

fn csv(rows: &[(f64, f64, f64)], form: Form, noise: &Noise, units: Units, s: &mut Stream) -> String {
    let mut text = String::with_capacity(rows.len() * 32 + 60);
    let linear = form == Form::LinearStage;
    text.push_str(if linear { "time_s,force_n,position_m\n" } else { "time_s,m2_torque_nm,m2_angle_rad\n" });
    let lsb = if linear { STAGE_LSB_M } else { std::f64::consts::TAU / 480_000.0 };
    for (time, torque, angle) in rows {
        let torque = torque + noise.m2_torque_nm * units.torque * s.normal();
        let angle = ((angle / lsb + noise.angle_counts * s.normal()).round()) * lsb;
        let _ = writeln!(text, "{time:.6},{torque:.6},{angle:.9}");
    }
    text
}

/// Generates a drive case; the scenario must have been checked.
pub(crate) fn drive_case(scenario: &Scenario) -> GeneratedCase {
    // A linear stage is another machine, not the rotary drive in other units.
    let linear = scenario.form == Form::LinearStage;
    let seed = if linear { !scenario.seed } else { scenario.seed };
    let rig = Rig::draw(seed);
    let units = if linear { Units::LINEAR } else { Units::ROTARY };
    let setting = Setting {
        rig: &rig,
        rate_hz: scenario.rate_hz,
        duration_s: scenario.duration_s,
        greatest_normal_n: 0.0,
        units,
        family: scenario.laws,
    };
    let laws = Laws::draw(&scenario.effects, seed, &setting);
    let numbers = DriveNumbers {
        inertia: rig.inertia_kg_m2 * units.torque / units.travel,
        coulomb: rig.bearing_coulomb_nm * units.torque,
        viscous: rig.bearing_viscous_nm_s * units.torque / units.travel,
        lag_s: rig.m2_lag_s,
        units,
    };
    let noise = Noise::draw(seed, scenario.noise_factor);
    let imperfections = Imperfections::draw(seed, scenario.imperfection, &noise, scenario.rate_hz);
    let mut texts = Vec::new();
    let mut residuals = Vec::new();
    for i in 0..3 {
        let list = course(&mut Stream::new(seed, &format!("course {i}")), &numbers, scenario.duration_s);
        let limit = rig.rated_torque_nm * units.torque;
        let mut s = Stream::new(seed, &format!("log {i}"));
        let mut instants = Stream::new(seed, &format!("instants {i}"));
        let schedule = imperfections.schedule(scenario.rate_hz, scenario.duration_s, &mut instants);
        let log = run(numbers, &laws, &list, limit, &schedule, scenario, &mut s);
        let mut s = Stream::new(seed, &format!("noise {i}"));
        texts.push(csv(&log.rows, scenario.form, &noise, units, &mut s));
        residuals.push(log.residual);
    }
    let holdout = texts.pop().unwrap_or_default();
    let rms = (residuals.iter().map(|r| r.drive_nm.powi(2)).sum::<f64>() / residuals.len() as f64).sqrt();
    let drive_noise = noise.m2_torque_nm * units.torque / (0.01 * scenario.rate_hz).max(1.0).sqrt();
    let ratio = if drive_noise > 0.0 { rms / drive_noise } else { 0.0 };
    let rig_toml = if scenario.form == Form::Drive {
        let mut s = Stream::new(seed, "rig file");
        crate::files::rig_toml(&rig, scenario.rig_file_error, &mut s)
    } else {
        String::new()
    };
    GeneratedCase {
        train: texts,
        holdout,
        rig_toml,
        model_toml: String::new(),
        truth: Truth {
            effects: scenario.effects.clone(),
            seed: scenario.seed,
            rate_hz: scenario.rate_hz,
            noise_factor: scenario.noise_factor,
            baseline_kind: "drive".to_owned(),
            rig,
            duration_s: scenario.duration_s,
            plan: scenario.plan,
            imperfections,
            stick_slip: false,
            law_names: laws.names(),
            friction: None,
            nominal: None,
            laws,
            noise,
            residuals,
            residual_to_noise: [0.0, 0.0, ratio],
        },
    }
}
