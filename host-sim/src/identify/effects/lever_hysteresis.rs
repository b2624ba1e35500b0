//! `lever_hysteresis`: normal force lags M1 torque by a Coulomb band.
//!
//! Stops side by side over a force or a torque, or Dahl's spring over M1's angle: in joints that swing to and fro, the spring
//! forgets where stops remember, and only the encoder is quiet enough to tell each swing.

use super::dahl::{self, Spring};
use super::stops::{Stops, coarse, play, stop};
use super::waves::travel;
use super::{About, Effect, NormalLoadLog, NormalLoadView};
use crate::identify::balance::Alternative;

/// The effect.
pub(super) struct LeverHysteresis;

/// The forms, by the usual size of what is lagged.
const FORCE: &str = "usual_force_n";
const CARRIED: &str = "usual_carried_force_n";
const TORQUE: &str = "usual_torque_nm";
const SHARE: &str = "usual_share";
/// Shortest width of the play, in shares of the usual force or torque; the longest, of what it goes over: a wider one slides both
/// ways on less than half of it, and is a spring.
const SHORTEST: f64 = 0.01;
const LONGEST: f64 = 0.25;

/// Torque that the joints hold at most, relative to what goes through them: a friction coefficient of 0.3 on pins of a third of
/// the lever's arm. With more, a band would stand in the gain's place and hide the force's noise.
const JOINTS: f64 = 0.1;

/// The force counts in shares of itself down to this share of the usual one, below which the elements come off.
const LEAST_LOAD: f64 = 0.1;

/// What lags.
struct Lagging<'l> {
    /// Name of the form.
    form: &'static str,
    /// Unit of the widths, as names have it.
    unit: &'static str,
    /// What is shown over it.
    within: &'static str,
    /// Its usual size.
    usual: f64,
    /// The signal in a log.
    signal: &'l dyn Fn(&NormalLoadLog) -> Vec<f64>,
    /// The friction that limits the lag grows with the force.
    grows: bool,
}

impl Effect for LeverHysteresis {
    fn about(&self) -> About {
        About {
            id: "lever_hysteresis",
            meaning: "the normal force lags M1's torque by a Coulomb band",
            experiment: "ramp M1's torque slowly up and down, in loops of three sizes",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        let relative = |force_n: f64| (force_n / s.load_n).max(LEAST_LOAD);
        let ln_carried = |log: &NormalLoadLog| log.carried_n.iter().map(|n| relative(*n).ln()).collect();
        // The joints yield with the force that they carry, or with the torque before them: the force rings after a step,
        // the torque does not. Each swing of a ring slips in the joints, and the force's noise hides it: the torque has less, and
        // says how the force rings. Where the force itself presses the joints their friction grows with it: it is a share of the
        // force that lags.
        let forms = [
            Lagging {
                form: FORCE,
                unit: "n",
                within: "force within the band, N",
                usual: s.load_n,
                signal: &|log| log.smoothed_n.clone(),
                grows: false,
            },
            Lagging {
                form: CARRIED,
                unit: "n",
                within: "carried force within the band, N",
                usual: s.load_n,
                signal: &|log| log.carried_n.clone(),
                grows: false,
            },
            Lagging {
                form: TORQUE,
                unit: "nm",
                within: "torque within the band, N m",
                usual: s.torque_nm,
                signal: &|log| log.smoothed_torque_nm.clone(),
                grows: false,
            },
            Lagging {
                form: SHARE,
                unit: "share",
                within: "carried force within the band over the usual one",
                usual: 1.0,
                signal: &ln_carried,
                grows: true,
            },
        ];
        let over = |lagging: &Lagging<'_>| {
            let signals: Vec<Vec<f64>> = view.logs.iter().map(lagging.signal).collect();
            // A stop remembers peaks: noise makes some, and a filter that is the same everywhere cuts those that are.
            let column = |width: f64| {
                let of = |(log, signal): (&NormalLoadLog, &Vec<f64>)| {
                    let mut within = stop(signal, width);
                    if lagging.grows {
                        within.iter_mut().zip(&log.carried_n).for_each(|(share, n)| *share *= relative(*n));
                    }
                    log.filtered(&within)
                };
                view.logs.iter().zip(&signals).flat_map(of).collect()
            };
            let stops = Stops {
                effect: self.id(),
                size: JOINTS * s.torque_nm,
                units: [lagging.unit, "nm"],
                column: &column,
                deflection: Some(lagging.within),
            };
            let found = match view.fixed {
                Some(fixed) => stops.of_constants(fixed),
                None => {
                    let goes_over = signals.iter().map(|signal| travel(signal.iter().copied()));
                    let longest = LONGEST * goes_over.fold(lagging.usual, f64::max);
                    stops.searched(view.balance, view.company, &coarse([SHORTEST * lagging.usual, longest]))
                }
            };
            let mut constants = found.constants;
            // Which of the forms, as a constant: held-out logs take the one that was found.
            constants.push((lagging.form.into(), lagging.usual));
            Alternative { form: lagging.form.into(), constants, ..found }
        };
        let wanted = |form: &str| view.fixed.is_none_or(|fixed| fixed.iter().any(|(name, _)| name == form));
        let mut all: Vec<Alternative> =
            forms.iter().filter(|lagging| wanted(lagging.form)).map(over).collect();
        all.extend(self.spring(view));
        all
    }
}

impl LeverHysteresis {
    /// Dahl's spring over M1's angle, where each log has it.
    fn spring(&self, view: &NormalLoadView<'_>) -> Option<Alternative> {
        // An angle that rests dithers by a count, and the spring would forget.
        let moved = view.logs.iter().map(|log| {
            Some(play(log.angle_rad.as_deref()?, log.angle_within_rad).collect())
        });
        let moved: Vec<Vec<f64>> = moved.collect::<Option<_>>()?;
        let within_rad = view.logs.iter().map(|log| log.angle_within_rad).fold(0.0, f64::max);
        let travel_rad = moved.iter().map(|angle| travel(angle.iter().copied())).fold(0.0, f64::max);
        let spring = Spring {
            effect: self.id(),
            size: JOINTS * view.scales.torque_nm,
            sliding: "sliding_nm",
            unit: "rad",
            column: &|way| {
                let of = |(log, moved): (&NormalLoadLog, &Vec<f64>)| log.filtered(&dahl::spring(moved, way));
                view.logs.iter().zip(&moved).flat_map(of).collect()
            },
            deflection: Some("deflection of the joints, rad"),
        };
        if let Some(fixed) = view.fixed {
            return spring.of_constants(fixed);
        }
        let ways @ [shortest, longest] = [(SHORTEST * travel_rad).max(within_rad), LONGEST * travel_rad];
        (shortest < longest).then(|| spring.searched(view.balance, view.company, ways))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::balance::Company;
    use crate::identify::contact::log::ContactLog;
    use crate::identify::noise::tests::white;
    use crate::identify::normal_load::{NormalLoadScales, balance};

    const COUNT: usize = 12_000;
    const STEPS_PER_SAMPLE: usize = 20;

    /// Force of the springs over M1's angle, and the way of the joints.
    const STIFFNESS_N_PER_RAD: f64 = 2000.0;
    const WAY_N: f64 = 5.0;

    /// Joints that slip in each swing of the ring after a step of the torque (Dahl 1968), a noisy bridge, and an encoder that
    /// dithers.
    fn log(rig: &RigFile) -> Log {
        let h = 1e-3 / STEPS_PER_SAMPLE as f64;
        let omega = std::f64::consts::TAU * rig.pressure.mode_hz;
        let (mut torque, mut force, mut rate, mut joints) = (2.0, 50.0, 0.0, 0.0f64);
        let level = |i: usize| 1.0 + 0.5 * ((i / 300 * 7) % 9) as f64 * 0.5;
        let (mut torques, mut forces, mut angles) = (Vec::new(), Vec::new(), Vec::new());
        let count_rad = std::f64::consts::TAU / f64::from(rig.counts_per_rev());
        let noise = white(COUNT, 1).into_iter().zip(white(COUNT, 2)).zip(white(COUNT, 3));
        for (i, ((of_torque, of_force), of_angle)) in noise.enumerate() {
            for _ in 0..STEPS_PER_SAMPLE {
                torque += h / rig.m1.torque_lag_s * (level(i) - torque);
                let moved = rate * h;
                let kept = (-moved.abs() / WAY_N).exp();
                joints = joints * kept + moved.signum() * (1.0 - kept);
                let carries = rig.lever_gain_n_per_nm * torque - rig.preload_n - 5.0 * joints;
                rate += h * omega * (omega * (carries - force) - 2.0 * rig.pressure.damping_ratio * rate);
                force += h * rate;
            }
            torques.push(torque + 0.002 * of_torque);
            forces.push(force + 0.5 * of_force);
            let counts = force / STIFFNESS_N_PER_RAD / count_rad;
            angles.push((counts + 0.3 * of_angle).round() * count_rad);
        }
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::M1Torque, torques);
        log.set_signal(Signal::M1Angle, angles);
        log.set_signal(Signal::NormalForce, forces);
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        log
    }

    /// Joints that the force itself presses: a share of it lags, at every load.
    #[test]
    fn friction_that_grows_with_the_force_leaves_a_share_of_it_behind() {
        const LAGS: f64 = 0.03;
        const WIDTH: f64 = 0.04;
        let rig = RigFile::assumed_rig(&[]).unwrap();
        // Loops between levels that differ, slower than the mode.
        let carried = |i: usize| {
            let t = 1e-3 * i as f64;
            60.0 + 35.0 * (0.9 * t).sin() + 15.0 * (3.7 * t).sin()
        };
        let carried: Vec<f64> = (0..COUNT).map(carried).collect();
        let mut slips = 0.0f64;
        let force = carried.windows(2).map(|pair| {
            slips = (slips + (pair[1] / pair[0]).ln()).clamp(-WIDTH, WIDTH);
            pair[1] * (1.0 - LAGS * slips / WIDTH)
        });
        let force: Vec<f64> = std::iter::once(carried[0]).chain(force).collect();
        let (of_torque, of_force) = (white(COUNT, 1), white(COUNT, 2));
        let torque = carried.iter().map(|n| (n + rig.preload_n) / rig.lever_gain_n_per_nm);
        let mut log = Log::default();
        log.set_signal(Signal::Time, (0..COUNT).map(|i| 1e-3 * i as f64).collect());
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::M1Torque, torque.zip(&of_torque).map(|(nm, w)| nm + 0.002 * w).collect());
        log.set_signal(Signal::NormalForce, force.iter().zip(&of_force).map(|(n, w)| n + 0.1 * w).collect());
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        let contact = ContactLog::new(&log, &rig).unwrap();
        let logs = [NormalLoadLog::new(&contact, &rig).unwrap()];
        let left = left_by_form(&logs, &rig);
        let of = |form: &str| left.iter().find(|(known, _)| known == form).unwrap().1;
        let least = [FORCE, CARRIED, TORQUE].into_iter().map(of).fold(f64::INFINITY, f64::min);
        assert!(of(SHARE) < 0.5 * least, "{left:?}");
    }

    /// What each form leaves of a log's balance.
    fn left_by_form(logs: &[NormalLoadLog], rig: &RigFile) -> Vec<(String, f64)> {
        let scales = NormalLoadScales::new(logs);
        let balance = balance(logs, rig, &scales);
        let residual = balance.solve(&[], &[]).residual;
        let company = Company { forms: &[], residual: &residual };
        let view = NormalLoadView { logs, scales: &scales, balance: &balance, company, fixed: None };
        let forms = LeverHysteresis.normal_load(&view);
        let left = forms.iter().map(|form| {
            let solved = balance.solve_forms(&[form]);
            (form.form.clone(), balance.rms(&solved.residual) / balance.rms(&residual))
        });
        left.collect()
    }

    #[test]
    fn joints_slip_in_the_ring_that_the_torque_tells_and_noise_hides() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let contact = ContactLog::new(&log(&rig), &rig).unwrap();
        let logs = [NormalLoadLog::new(&contact, &rig).unwrap()];
        let scales = NormalLoadScales::new(&logs);
        let balance = balance(&logs, &rig, &scales);
        let residual = balance.solve(&[], &[]).residual;
        let company = Company { forms: &[], residual: &residual };
        let view =
            NormalLoadView { logs: &logs, scales: &scales, balance: &balance, company, fixed: None };
        let forms = LeverHysteresis.normal_load(&view);
        let left = forms.iter().map(|form| {
            let solved = balance.solve_forms(&[form]);
            (form.form.clone(), balance.rms(&solved.residual) / balance.rms(&residual))
        });
        let left: Vec<(String, f64)> = left.collect();
        let of = |form: &str| left.iter().find(|(known, _)| known == form).unwrap().1;
        // A fifth less than with either of what is measured.
        assert!(of(CARRIED) < 0.8 * of(FORCE).min(of(TORQUE)), "{left:?}");
        // The spring over the angle leaves less than that, with the way of the joints, but for swings that peak between samples.
        let spring = forms.last().unwrap();
        let way = STIFFNESS_N_PER_RAD * spring.constants[0].1;
        assert!(of(&spring.form) < 0.75 * of(CARRIED) && (way / WAY_N - 1.0).abs() < 0.2, "{left:?} {way}");
        // Shown over what the joints give: within their way, and in proportion to the torque.
        let (_, deflection) = spring.coordinate.as_ref().unwrap();
        let way_rad = spring.constants[0].1;
        let in_proportion = |(x, z): (&f64, &f64)| x.abs() <= way_rad && (x - way_rad * z).abs() < 1e-9;
        assert!(deflection.iter().zip(&spring.columns[0]).all(in_proportion));
        // Held-out logs take what was found.
        let fixed = NormalLoadView { fixed: Some(&spring.constants), ..view };
        let [again] = &LeverHysteresis.normal_load(&fixed)[..] else { panic!("one form") };
        assert_eq!(again.columns, spring.columns);
    }
}
