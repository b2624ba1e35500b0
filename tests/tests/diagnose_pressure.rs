//! The press's side of the diagnosis on logs of the independent generator.
#![allow(clippy::unwrap_used)]

use host_sim::diagnose::analysis::{Analysis, Fit, Role};
use host_sim::diagnose::pressure::PressureAnalysis;
use host_sim::files::log::Log;
use host_sim::files::rig_file::RigFile;
use rig_tests::{Effect, Scenario, generate};

fn analysis(effects: &[Effect], seed: u64) -> PressureAnalysis {
    let case = generate(&Scenario::new(effects, seed)).unwrap();
    let log = |text: &String| Log::parse_csv("log", text.as_bytes()).unwrap();
    let (train, holdout) = (case.train.iter().map(log).collect::<Vec<_>>(), log(&case.holdout));
    let mut logs: Vec<(&Log, Role)> = train.iter().map(|log| (log, Role::Train)).collect();
    logs.push((&holdout, Role::Holdout));
    let rig = RigFile::parse("rig", &case.rig_toml).unwrap();
    PressureAnalysis::new(&rig, &logs).unwrap().unwrap()
}

/// Mean square of the held-out residual, 1 for noise.
fn held_out(fit: &Fit) -> f64 {
    let logs = fit.logs.iter().filter(|log| log.role == Role::Holdout);
    let residual: Vec<f64> =
        logs.flat_map(|log| &log.channels[0].residual).copied().filter(|r| r.is_finite()).collect();
    residual.iter().map(|r| r * r).sum::<f64>() / residual.len() as f64
}

fn over_floor(fit: &Fit) -> f64 {
    fit.nrmse(Role::Holdout).unwrap() / fit.noise_floor(Role::Holdout).unwrap()
}

fn hides_and_is_found(effect: Effect, seed: u64) {
    let analysis = analysis(&[effect], seed);
    let baseline = analysis.fit(&[], None).unwrap();
    // The generator's effects are a few per cent of the force, its noise half a per cent.
    assert!(held_out(&baseline) > 20.0, "{}", held_out(&baseline));
    for candidate in analysis.candidates() {
        let fit = analysis.fit(&[candidate], Some(&baseline)).unwrap();
        println!("{} as {candidate}: {:.2}", effect.id(), held_out(&fit));
        if candidate == effect.id() {
            assert!(over_floor(&fit) < 1.2, "{candidate}: {}", over_floor(&fit));
            // 1600 residuals, 600 of them independent: three deviations of their mean square are 0.17. The
            // state of a hysteresis keeps every small error of the torque, so it is allowed twice the noise.
            let allowed = if effect == Effect::LeverHysteresis { 2.0 } else { 1.25 };
            assert!(held_out(&fit) < allowed, "{candidate}: {}", held_out(&fit));
            assert!(analysis.evidence(candidate, &fit).len() == 2);
        } else {
            assert!(held_out(&fit) > 3.0, "{candidate} explains {}: {}", effect.id(), held_out(&fit));
        }
    }
}

#[test]
fn a_coulomb_band_of_the_lever_is_told_from_its_rivals() {
    hides_and_is_found(Effect::LeverHysteresis, 11);
}

#[test]
fn stiffening_springs_are_told_from_their_rivals() {
    hides_and_is_found(Effect::FoilHardening, 12);
}

#[test]
fn a_ripple_of_m1_is_told_from_its_rivals() {
    hides_and_is_found(Effect::M1Ripple, 13);
}

#[test]
fn a_press_without_an_effect_needs_none() {
    let analysis = analysis(&[], 14);
    let baseline = analysis.fit(&[], None).unwrap();
    assert!((held_out(&baseline) - 1.0).abs() < 0.2, "{}", held_out(&baseline));
    for candidate in analysis.candidates() {
        let fit = analysis.fit(&[candidate], Some(&baseline)).unwrap();
        assert!(held_out(&fit) > 0.98 * held_out(&baseline), "{candidate}: {}", held_out(&fit));
    }
}

#[test]
fn two_effects_of_the_press_are_fitted_together() {
    let analysis = analysis(&[Effect::LeverHysteresis, Effect::FoilHardening], 15);
    let one = analysis.fit(&["lever_hysteresis"], None).unwrap();
    let both = analysis.fit(&["lever_hysteresis", "foil_hardening"], Some(&one)).unwrap();
    assert!(held_out(&one) > 3.0, "{}", held_out(&one));
    assert!(held_out(&both) < 1.3, "{}", held_out(&both));
}
