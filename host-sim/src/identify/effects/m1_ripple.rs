//! `m1_ripple`: M1's torque ripples with its position or with the mechanism's.
//!
//! Coordinates: M1's angle; the mechanism's position, which the normal force shows. Where the springs are the only compliance the
//! two are one, and a law over them is a law of the spring force: then nothing parts them. Columns as those of M2's ripple.

use super::joint_waves::{Candidates, Joint};
use super::waves::{self, Wave, Waves};
use super::{About, Effect, NormalLoadView};
use crate::identify::balance::Alternative;

/// The effect.
pub(super) struct M1Ripple;

/// Fewer periods over the travel are a spring's law as well as a ripple.
const LEAST_PERIODS: f64 = 1.7;
/// Before they are sharpened, wave numbers are a half of this part of a half period off at most: a tenth of a radian at the travel's
/// ends.
const PARTS: usize = 8;
/// Most periods over the travel, and most orders at once.
const MOST_PERIODS: usize = 60;
const MOST_ORDERS: usize = 3;

impl Effect for M1Ripple {
    fn about(&self) -> About {
        About {
            id: "m1_ripple",
            meaning: "M1's torque ripples with its position",
            experiment: "ramp M1's torque slowly over its whole range, with the elements lifted and pressed",
        }
    }

    fn normal_load(&self, view: &NormalLoadView<'_>) -> Vec<Alternative> {
        let angle: Option<Vec<&[f64]>> = view.logs.iter().map(|log| log.angle_rad.as_deref()).collect();
        let force: Vec<&[f64]> = view.logs.iter().map(|log| log.filtered_n.as_slice()).collect();
        let torque = waves::travel(view.logs.iter().flat_map(|log| log.smoothed_torque_nm.iter().copied()));
        let mut all = Vec::new();
        for (over, positions) in [("angle", angle), ("force", Some(force))] {
            let Some(positions) = positions else { continue };
            let make = Waves {
                effect: self.id(),
                positions: &positions,
                efforts: &[],
                filtered: &|at, values| view.logs[at].filtered(values),
                size: 0.5 * view.scales.torque_nm,
                rotary: over == "angle",
            };
            if let Some(fixed) = view.fixed {
                let wanted = fixed.iter().any(|(name, _)| name.starts_with("wavelength")) == (over == "force");
                if wanted {
                    all.extend(make.alternatives(&waves::fixed(fixed), 1));
                }
                continue;
            }
            let position = positions.concat();
            let travel = positions.iter().map(|x| waves::travel(x.iter().copied())).fold(0.0, f64::max);
            let mut wave_numbers = waves::of_travel(travel, MOST_PERIODS);
            wave_numbers.retain(|k| k * travel > LEAST_PERIODS * std::f64::consts::TAU);
            let candidates = Candidates { wave_numbers, parts: PARTS };
            // The position dwells at the steps of the force, where a spectrum shows all orders alike. Orders that are the clearer
            // with a phase for each log may have one phase all the same.
            let joints =
                [false, true].map(|own| (own, Joint::new(view.balance, &position, view.company, own)));
            // Where a wave of the torque is steeper than the springs, no position holds: the mechanism jumps from well to well.
            let springs = torque / travel.max(f64::MIN_POSITIVE);
            for (apart, searched) in &joints {
                let orders = searched.orders(&candidates, MOST_ORDERS);
                for (own_phase, joint) in joints.iter().filter(|(own_phase, _)| *apart || !own_phase) {
                    for count in 1..=orders.len() {
                        let sharpened = joint.sharpened(&orders[..count], &candidates);
                        if joint.steepest(&sharpened) > springs {
                            continue;
                        }
                        let orders: Vec<Wave> = sharpened.into_iter().map(Wave::steady).collect();
                        all.push(make.alternative(&orders, candidates.count(), *own_phase));
                    }
                }
            }
        }
        all
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
    use crate::identify::normal_load::{NormalLoadLog, NormalLoadScales, balance};

    /// Slow ramps of the torque, on which a wave over M1's angle rides.
    fn log(rig: &RigFile, [order, phase, size_nm]: [f64; 3], seed: u64) -> Log {
        const COUNT: usize = 8000;
        let swing = |i: usize| 0.5 - 0.5 * (std::f64::consts::TAU * i as f64 / 4000.0).cos();
        let angle = |i: usize| 0.05 * swing(i);
        let series = |of: &dyn Fn(usize) -> f64| (0..COUNT).map(of).collect::<Vec<f64>>();
        let noise = [seed, seed + 1].map(|seed| white(COUNT, seed));
        let carried = |i: usize| 1.0 + 2.0 * swing(i);
        let mut log = Log::default();
        log.set_signal(Signal::Time, series(&|i| 1e-3 * i as f64));
        log.set_signal(Signal::M2Speed, vec![5.0; COUNT]);
        log.set_signal(Signal::M1Torque, series(&|i| carried(i) + 0.005 * noise[0][i]));
        log.set_signal(Signal::M1Angle, series(&angle));
        // The setpoint does not know of the ripple, the force shows it.
        let made = |i: usize| carried(i) + size_nm * (order * angle(i) + phase).sin();
        let force = |i: usize| rig.lever_gain_n_per_nm * made(i) - rig.preload_n;
        log.set_signal(Signal::NormalForce, series(&|i| force(i) + 0.25 * noise[1][i]));
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        log
    }

    const ORDER: f64 = 600.0;

    /// What is made of the effect's forms in two logs in which a ripple of this size has opposite phases: in one phase they show
    /// nothing at its order.
    fn of_forms<T>(size_nm: f64, make: impl FnOnce(Vec<Alternative>, &NormalLoadView<'_>) -> T) -> T {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        let logs = [(0.3, 1), (0.3 + std::f64::consts::PI, 3)].map(|(phase, seed)| {
            let contact = ContactLog::new(&log(&rig, [ORDER, phase, size_nm], seed), &rig).unwrap();
            NormalLoadLog::new(&contact, &rig).unwrap()
        });
        let scales = NormalLoadScales::new(&logs);
        let balance = balance(&logs, &rig, &scales);
        let residual = balance.solve(&[], &[]).residual;
        let company = Company { forms: &[], residual: &residual };
        let view = NormalLoadView { logs: &logs, scales: &scales, balance: &balance, company, fixed: None };
        make(M1Ripple.normal_load(&view), &view)
    }

    fn is_of_order(form: &&Alternative) -> bool {
        let half_step = 0.25 * std::f64::consts::TAU / 0.05;
        let (name, value) = &form.constants[0];
        name == "order_1" && (value - ORDER).abs() < half_step
    }

    #[test]
    fn an_order_that_only_logs_apart_show_is_tried_in_one_phase_too() {
        // As steep as three quarters of the springs, 40 N m/rad.
        of_forms(0.05, |forms, view| {
            let of_order: Vec<&Alternative> = forms.iter().filter(is_of_order).collect();
            assert!(of_order.iter().any(|form| !form.is_of_each_log()), "in one phase");
            let solved = of_order.iter().find(|form| form.is_of_each_log()).expect("in a phase for each log");
            let left =
                view.balance.rms(&view.balance.solve_forms(&[solved]).residual) / view.balance.rms(view.company.residual);
            assert!(left < 0.1, "{left}");
        });
    }

    #[test]
    fn a_wave_that_is_steeper_than_the_springs_is_no_ripple() {
        of_forms(0.2, |forms, _| {
            let apart = forms.iter().filter(is_of_order).filter(|form| form.is_of_each_log());
            assert_eq!(apart.count(), 0);
        });
    }
}
