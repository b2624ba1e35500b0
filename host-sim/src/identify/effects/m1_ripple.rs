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
    fn log(rig: &RigFile, order: f64, phase: f64, seed: u64) -> Log {
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
        // The setpoint does not know of the ripple, the force shows it. It is as steep as three quarters of the springs, 40 N m/rad:
        // a steeper one would hold the mechanism.
        let made = |i: usize| carried(i) + 0.05 * (order * angle(i) + phase).sin();
        let force = |i: usize| rig.lever_gain_n_per_nm * made(i) - rig.preload_n;
        log.set_signal(Signal::NormalForce, series(&|i| force(i) + 0.25 * noise[1][i]));
        log.set_signal(Signal::FrictionTorque, vec![2.0; COUNT]);
        log
    }

    #[test]
    fn an_order_that_only_logs_apart_show_is_tried_in_one_phase_too() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        // Opposite phases: in one phase the two logs show nothing at this order.
        let order = 600.0;
        let logs = [(0.3, 1), (0.3 + std::f64::consts::PI, 3)].map(|(phase, seed)| {
            let contact = ContactLog::new(&log(&rig, order, phase, seed), &rig).unwrap();
            NormalLoadLog::new(&contact, &rig).unwrap()
        });
        let scales = NormalLoadScales::new(&logs);
        let balance = balance(&logs, &rig, &scales);
        let residual = balance.solve(&[], &[]).residual;
        let company = Company { forms: &[], residual: &residual };
        let view = NormalLoadView { logs: &logs, scales: &scales, balance: &balance, company, fixed: None };
        let forms = M1Ripple.normal_load(&view);
        let half_step = 0.25 * std::f64::consts::TAU / 0.05;
        let first_is = |form: &&Alternative| {
            let (name, value) = &form.constants[0];
            name == "order_1" && (value - order).abs() < half_step
        };
        let of_order: Vec<&Alternative> = forms.iter().filter(first_is).collect();
        assert!(of_order.iter().any(|form| !form.is_of_each_log()), "in one phase");
        let solved = of_order.iter().find(|form| form.is_of_each_log()).expect("in a phase for each log");
        let left = balance.rms(&balance.solve_forms(&[solved]).residual) / balance.rms(&residual);
        assert!(left < 0.1, "{left}");
    }
}
