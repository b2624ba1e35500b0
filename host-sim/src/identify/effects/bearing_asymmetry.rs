//! `bearing_asymmetry`: the bearing's friction differs per direction.
//!
//! Half the difference is even in speed: Coulomb friction, viscous friction beside it, and a Stribeck curve in one direction where there
//! is one. That of Coulomb friction alone is an offset of the torque (`torque_offset`) wherever the bearing turns. A curve in each would hold the same one in both, which is `bearing_stribeck`: two different ones are that and this.

use super::stribeck_curve::{Curve, turns_both_ways};
use super::{About, DriveLaw, DriveView, Effect};
use crate::identify::balance::Alternative;
use crate::identify::drive::COULOMB;
use crate::identify::term::Parameter;

/// The effect.
pub(super) struct BearingAsymmetry;

/// Ends of the names of what belongs to one direction.
const WAYS: [&str; 2] = ["_forward", "_backward"];

impl Effect for BearingAsymmetry {
    fn about(&self) -> About {
        About {
            id: "bearing_asymmetry",
            meaning: "the bearing's friction differs per direction",
            experiment: "turn the lifted disc steadily at three speeds each way, and rest it: at rest an offset shows and an asymmetry does not",
        }
    }

    fn drive(&self, view: &DriveView<'_>) -> Vec<Alternative> {
        let s = view.scales;
        // Its columns would be those of the bearing itself.
        if !turns_both_ways(view) {
            return Vec::new();
        }
        // Rows of standstill are left out. A column that were less in the rows beside them would be told by these alone, since slow
        // noise hides a level.
        let coulomb = vec![1.0; view.balance.response.len()];
        let viscous: Vec<f64> = view.logs.iter().flat_map(|log| log.speed.iter().map(|v| v.abs())).collect();
        let parameters = || {
            vec![
                Parameter::amplitude("coulomb_half_difference", s.own),
                Parameter::amplitude("viscous_half_difference", s.own / s.speed),
            ]
        };
        let plain = |count: usize| Alternative {
            form: ["of Coulomb friction", ""][count - 1].into(),
            log_prior: -4f64.ln(),
            ..Alternative::columns(
                self.id(),
                parameters().into_iter().take(count).collect(),
                [&coulomb, &viscous].into_iter().take(count).cloned().collect(),
            )
        };
        let curve = Curve::new(view);
        let acts: [fn(f64) -> f64; 2] = [|d| d.max(0.0), |d| d.min(0.0)];
        let one_way = |(way, acts): (&str, _)| Alternative {
            form: format!("a Stribeck curve {}", &way[1..]),
            constants: curve.constants(),
            not_negative: vec![COULOMB],
            log_prior: -4f64.ln(),
            ..Alternative::columns(
                self.id(),
                parameters().into_iter().chain(curve.parameters(way, s.own)).collect(),
                [coulomb.clone(), viscous.clone()].into_iter().chain(curve.columns(view, acts)).collect(),
            )
        };
        let mut forms = vec![plain(1), plain(2)];
        forms.extend(WAYS.into_iter().zip(acts).map(one_way));
        forms
    }

    fn drive_law(&self, value: &dyn Fn(&str) -> Option<f64>) -> Option<DriveLaw> {
        let part = |name: &str| value(&format!("{name}_difference")).or(value(&format!("{name}_half_difference")));
        let (coulomb, viscous) = (part("coulomb"), part("viscous"));
        coulomb.or(viscous)?;
        let (coulomb, viscous) = (coulomb.unwrap_or(0.0), viscous.unwrap_or(0.0));
        let [forward, backward] = WAYS.map(|way| Curve::of_file(way, value));
        Some(DriveLaw::effort(move |v: f64| {
            let excess = |curve: &Option<Box<dyn Fn(f64) -> f64>>| curve.as_ref().map_or(0.0, |of| of(v));
            let fall = if v > 0.0 { excess(&forward) } else { -excess(&backward) };
            coulomb + viscous * v.abs() + fall
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::bearing_stribeck::BearingStribeck;
    use super::super::torque_offset::TorqueOffset;
    use super::*;
    use crate::identify::balance::{Company, Solved};
    use crate::identify::drive::{self, DriveLog, DrivePrior, DriveScales};
    use crate::identify::grid::Grid;
    use crate::identify::noise::tests::white;

    /// What is made of a drive whose bearing adds `drag` of the speed, and of what its base leaves.
    fn of_drag<T>(drag: impl Fn(f64) -> f64, make: impl FnOnce(&DriveView<'_>, &Solved) -> T) -> T {
        let time: Vec<f64> = (0..20_000).map(|i| 1e-3 * f64::from(i)).collect();
        let position: Vec<f64> = time.iter().map(|t| -8.0 * (0.7 * t).cos() - (3.1 * t).cos()).collect();
        let noise = white(time.len(), 3);
        let effort = time.iter().zip(&noise).map(|(t, n)| {
            let speed = 5.6 * (0.7 * t).sin() + 3.1 * (3.1 * t).sin();
            let acceleration = 3.92 * (0.7 * t).cos() + 9.61 * (3.1 * t).cos();
            0.02 * acceleration + 0.2 * speed.signum() + 0.005 * speed + drag(speed) + 0.014 * n
        });
        let (effort, grid) = (effort.collect(), Grid::new(&time));
        let usable = grid.covered.clone();
        let logs = [DriveLog::made("log".into(), grid, effort, position, None, None, usable, 0.0)];
        let scales = DriveScales::new(&logs);
        let balance = drive::balance(&logs, &DrivePrior::default(), &scales);
        let none = balance.solve(&[], &[]);
        let view = DriveView {
            logs: &logs,
            scales: &scales,
            balance: &balance,
            company: Company { forms: &[], residual: &none.residual },
            rotary: true,
            inertia: none.p[drive::INERTIA],
            fixed: None,
            bearing: None,
        };
        make(&view, &none)
    }

    /// Log evidence that each effect's best form gains there.
    fn gains(drag: impl Fn(f64) -> f64) -> [f64; 3] {
        let effects: [&dyn Effect; 3] = [&BearingStribeck, &BearingAsymmetry, &TorqueOffset];
        of_drag(drag, |view, none| {
            effects.map(|effect| {
                let evidence = |form: Alternative| view.balance.solve_forms(&[&form]).log_evidence;
                effect.drive(view).into_iter().map(evidence).fold(f64::NEG_INFINITY, f64::max) - none.log_evidence
            })
        })
    }

    /// A fan's drag over all speeds, beside which a curve that falls would need a Coulomb friction that drives.
    #[test]
    fn a_curve_that_falls_stands_beside_coulomb_friction_that_brakes() {
        let least = |effect: &dyn Effect| {
            of_drag(
                |v| 0.01 * v * v.abs(),
                |view, _| {
                    let curves = effect.drive(view).into_iter().filter(|form| form.parameters.len() > 2);
                    let coulomb = |form: Alternative| view.balance.solve_forms(&[&form]).p[COULOMB];
                    curves.map(coulomb).fold(f64::INFINITY, f64::min)
                },
            )
        };
        assert_eq!([least(&BearingStribeck), least(&BearingAsymmetry)], [0.0, 0.0]);
    }

    #[test]
    fn what_falls_alike_both_ways_is_no_asymmetry_and_what_falls_one_way_is() {
        // Over 2.5 rad/s where 4.5 rad/s are usual.
        let [falls, uneven, _] = gains(|v| 0.3 * v.signum() / (1.0 + (v / 2.5).powi(2)));
        assert!(falls > uneven + 20.0, "{falls} {uneven}");
        for way in [1.0, -1.0] {
            let [falls, uneven, _] =
                gains(|v| if way * v > 0.0 { 0.3 * v.signum() * (-v.abs() / 2.0).exp() } else { 0.0 });
            assert!(uneven > falls + 20.0, "{falls} {uneven}");
        }
    }

    #[test]
    fn coulomb_friction_that_differs_is_as_likely_as_an_offset_where_the_bearing_turns() {
        let [_, uneven, offset] = gains(|_| 0.1);
        assert!(offset > 50.0 && (uneven - offset).abs() < 1e-6, "{uneven} {offset}");
        // Viscous friction that differs is no offset.
        let [_, uneven, offset] = gains(|v| 0.02 * v.abs());
        assert!(uneven > offset + 10.0, "{uneven} {offset}");
    }
}
