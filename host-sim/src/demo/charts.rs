//! Charts of the demo's runs.

use super::comparison::{Comparison, LOAD_STEP_S};
use super::runs::ClosedLoop;
use crate::lockstep::Frame;
use crate::report::{Chart, Line, Panel, Role, Window};
use model_core::friction::series::SeriesParameters;

/// Converts rad/s to rpm.
const RPM: f64 = 60.0 / std::f64::consts::TAU;

fn window(label: &str, from: f64, to: f64) -> Window {
    Window { label: label.into(), range: (from, to) }
}

/// The charts of one experiment.
pub(crate) fn experiment(run: &ClosedLoop) -> Vec<Chart> {
    let end = run.recording.time_s(run.recording.frames.len());
    if run.summary.loop_energy_j.is_some() {
        return vec![
            hysteresis(run),
            time_chart(run, vec![window("whole run", 0.0, end), window("one second", 4.0, 5.0)], true),
        ];
    }
    if run.summary.damping_ratio.is_some() {
        let from = LOAD_STEP_S;
        let windows = vec![
            window("0.5 s from the step", from - 0.05, from + 0.45),
            window("20 ms", from, from + 0.02),
            window("whole run", 0.0, end),
        ];
        return vec![time_chart(run, windows, true)];
    }
    let windows = match run.summary.friction_peak_time_s {
        Some(peak) if run.summary.friction_overshoot.is_some() => vec![
            window("120 ms from the load step", LOAD_STEP_S - 0.02, LOAD_STEP_S + 0.1),
            window("20 ms around the peak", peak - 0.01, peak + 0.01),
            window("the disc starts", 3.45, 3.75),
            window("whole run", 0.0, end),
        ],
        _ => vec![window("whole run", 0.0, end)],
    };
    vec![time_chart(run, windows, false)]
}

/// Charts of any experiment: the one of a figure where its windows fit, else everything over time.
pub(crate) fn own_experiment(run: &ClosedLoop) -> Vec<Chart> {
    let end = run.recording.time_s(run.recording.frames.len());
    let windows = match run.summary.friction_peak_time_s {
        Some(peak) => vec![
            window("whole run", 0.0, end),
            window("100 ms around the friction peak", peak - 0.05, peak + 0.05),
            window("20 ms", peak - 0.01, peak + 0.01),
        ],
        None => vec![window("whole run", 0.0, end)],
    };
    let mut charts = vec![time_chart(run, windows, run.summary.loop_energy_j.is_some())];
    if run.summary.loop_energy_j.is_some() {
        charts.push(hysteresis(run));
    }
    charts
}

fn line(name: &str, role: Role, run: &ClosedLoop, tolerances: (f64, f64), y: impl Fn(&Frame) -> f64) -> Line {
    let x = (0..run.recording.frames.len()).map(|k| run.recording.time_s(k)).collect();
    Line {
        name: name.into(),
        role,
        x,
        y: run.recording.column(y),
        tolerance: tolerances.0,
        fine_tolerance: tolerances.1,
    }
}

/// Friction torque, normal force and motion over time. Measured signals outside the windows of interest are
/// drawn within three standard deviations of their noise.
fn time_chart(run: &ClosedLoop, windows: Vec<Window>, torque_mode: bool) -> Chart {
    let friction = vec![
        line("measured", Role::Measured, run, (0.015, 5e-4), |f| f64::from(f.record.friction_torque_nm)),
        line("true", Role::Series, run, (0.003, 5e-4), |f| f.truth.friction_torque_nm),
    ];
    let friction = if torque_mode {
        let motor = line("torque of M2", Role::Brush, run, (0.003, 5e-4), |f| f.truth.m2_torque_nm);
        friction.into_iter().chain([motor]).collect()
    } else {
        friction
    };
    let normal = vec![
        line("measured", Role::Measured, run, (0.2, 0.01), |f| f64::from(f.record.normal_force_n)),
        line("true", Role::Series, run, (0.05, 0.01), |f| f.truth.normal_force_n),
    ];
    let motion = if torque_mode {
        Panel {
            y_title: "angle of the disc, mrad".into(),
            lines: vec![line("true", Role::Series, run, (0.05, 0.005), |f| 1e3 * f.truth.disc_angle_rad)],
        }
    } else {
        Panel {
            y_title: "speed of the disc, rpm".into(),
            lines: vec![
                line("asked for", Role::Reference, run, (0.01, 0.01), |f| {
                    RPM * f64::from(f.record.m2_speed_ref_rad_s)
                }),
                line("measured", Role::Measured, run, (0.1, 0.005), |f| {
                    RPM * f64::from(f.record.m2_speed_rad_s)
                }),
                line("true", Role::Series, run, (0.02, 0.002), |f| RPM * f.truth.disc_speed_rad_s),
            ],
        }
    };
    Chart {
        title: format!("{}: {}.", capitalised(&run.label()), run.title),
        caption: "“Measured” is what the core gets through torque ring, amplifier and converter; “true” is the plant."
            .into(),
        x_title: "time, s".into(),
        panels: vec![
            Panel {
                y_title: if torque_mode { "torque, N m" } else { "friction torque, N m" }.into(),
                lines: friction,
            },
            Panel { y_title: "normal force, N".into(), lines: normal },
            motion,
        ],
        windows,
        ..Chart::default()
    }
}

/// Friction torque over the disc's angle, by every 20th sample after the first period. The loop is narrow beside the
/// spring of the blocks, so what differs from a straight line stands below it.
fn hysteresis(run: &ClosedLoop) -> Chart {
    let frames: Vec<&Frame> = run.recording.frames.iter().skip(37_000).step_by(20).collect();
    let angle: Vec<f64> = frames.iter().map(|f| f.truth.disc_angle_rad).collect();
    let moment = |torque: &[f64]| angle.iter().zip(torque).map(|(a, t)| a * t).sum::<f64>();
    let lines = |less_spring: bool| {
        let line = |name: &str, role, torque: Vec<f64>| {
            let spring = if less_spring { moment(&torque) / moment(&angle) } else { 0.0 };
            Line {
                name: name.into(),
                role,
                x: angle.iter().map(|a| 1e3 * a).collect(),
                y: torque.iter().zip(&angle).map(|(t, a)| t - spring * a).collect(),
                tolerance: 1e-3,
                fine_tolerance: 1e-3,
            }
        };
        let measured = frames.iter().map(|f| f64::from(f.record.friction_torque_nm)).collect();
        let truth = frames.iter().map(|f| f.truth.friction_torque_nm).collect();
        vec![line("measured", Role::Measured, measured), line("true", Role::Series, truth)]
    };
    let beside = |name: &str, role, pick: fn(&Frame) -> f64| Line {
        name: name.into(),
        role,
        x: angle.iter().map(|a| 1e3 * a).collect(),
        y: frames.iter().map(|f| pick(f)).collect(),
        tolerance: 1e-3,
        fine_tolerance: 1e-3,
    };
    Chart {
        title: format!("{}: friction torque over the disc's angle.", capitalised(&run.label())),
        caption: "The area of the loop is the energy that the elements take in one period. Below, the torque less the \
                  straight line through it; lowest, what M2 sees, as the paper plots it, beside the ring's."
            .into(),
        x_title: "angle of the disc, mrad".into(),
        panels: vec![
            Panel { y_title: "friction torque, N m".into(), lines: lines(false) },
            Panel { y_title: "less the line, N m".into(), lines: lines(true) },
            Panel {
                y_title: "motor and bearing, N m".into(),
                lines: vec![
                    beside("torque of M2", Role::Brush, |f| f.truth.m2_torque_nm),
                    beside("friction torque of the ring", Role::Series, |f| f.truth.friction_torque_nm),
                    beside("torque of the bearing", Role::Lugre, |f| f.truth.bearing_torque_nm),
                ],
            },
        ],
        plane: true,
        ..Chart::default()
    }
}

/// Figs. 5, 24 and 25: the history of an element's stress, from the deformation that the plant has.
pub(super) fn stress(run: &ClosedLoop, rubber: &SeriesParameters<f64>, radius_m: f64) -> Chart {
    let pick = |name: &str, role, y: &dyn Fn(&Frame) -> f64| line(name, role, run, (0.2, 0.02), y);
    let spring = |f: &Frame| rubber.k_u_n_per_m * f.truth.deformation_m;
    let force = |f: &Frame| f.truth.friction_torque_nm / radius_m;
    let end = run.recording.time_s(run.recording.frames.len());
    Chart {
        title: format!("Figs. 5, 24, 25: stress and deformation in {}.", run.label()),
        caption: "All elements together. The spring's part follows the deformation; the damper carries the rest while the block \
                  winds up and unwinds, so one deformation goes with many forces: the stress has a history."
            .into(),
        x_title: "time, s".into(),
        panels: vec![
            Panel {
                y_title: "force, N".into(),
                lines: vec![
                    pick("friction", Role::Series, &force),
                    pick("spring, k_u u", Role::Lugre, &spring),
                    pick("damper, c_u u\u{307}", Role::Brush, &|f| force(f) - spring(f)),
                ],
            },
            Panel {
                y_title: "deformation u, mm".into(),
                lines: vec![line("of the block", Role::Series, run, (0.01, 0.001), |f| {
                    1e3 * f.truth.deformation_m
                })],
            },
        ],
        windows: vec![
            window("120 ms from the load step", LOAD_STEP_S - 0.02, LOAD_STEP_S + 0.1),
            window("the disc starts", 3.45, 3.75),
            window("whole run", 0.0, end),
        ],
        ..Chart::default()
    }
}

/// The five models in one experiment.
pub(super) fn comparison(c: &Comparison) -> Chart {
    let lines = |pick: &dyn Fn(&super::comparison::Candidate) -> Vec<f64>| {
        c.candidates
            .iter()
            .map(|k| Line {
                name: k.contender.name.into(),
                role: k.contender.role,
                x: c.time_s.clone(),
                y: pick(k),
                tolerance: 0.01,
                fine_tolerance: 1e-3,
            })
            .collect()
    };
    let end = c.time_s.last().copied().unwrap_or(1.0);
    Chart {
        title: format!("Five models at {:.0} rpm.", c.rpm),
        caption: "Above: each model on the disc, in the same closed loop. Below: each model driven by one and the same \
                  true motion and load, that of the rig with the series element."
            .into(),
        x_title: "time, s".into(),
        panels: vec![
            Panel { y_title: "closed loop, N m".into(), lines: lines(&|k| k.closed_nm.clone()) },
            Panel { y_title: "driven, N m".into(), lines: lines(&|k| k.open_nm.clone()) },
        ],
        windows: vec![
            window("120 ms from the load step", LOAD_STEP_S - 0.02, LOAD_STEP_S + 0.1),
            window("20 ms", LOAD_STEP_S + 0.005, LOAD_STEP_S + 0.025),
            window("the disc starts", 3.45, 3.75),
            window("whole run", 0.0, end),
        ],
        ..Chart::default()
    }
}

pub(super) fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}
