//! Scenario in, case out.

use crate::contact_log::{CleanLog, STEPS_PER_S, World};
use crate::course::{Course, Limits, paper};
use crate::curve::Curve;
use crate::effect::Effect;
use crate::files;
use crate::imperfections::{Disturbance, Imperfections};
use crate::laws::{Laws, Setting, Units};
use crate::random::Stream;
use crate::rig::{Friction, Rig, kind};
use crate::scenario::{Base, Form, GeneratedCase, Plan, Scenario, ScenarioError};
use crate::sensors::{Clip, Noise, contact_csv};
use crate::truth::Truth;

/// Torque of M2 that steady sliding may take; the rest is for breakaway and speeding up.
const SLIDING_TORQUE_NM: f64 = 5.4;
/// Normal force above which no course goes.
const GREATEST_NORMAL_N: f64 = 105.0;

/// So many times the bandwidth of a speed loop that hunts is halved at most.
const MOST_HALVINGS: i32 = 3;

/// Generates a case.
///
/// # Errors
/// Where the scenario asks for something that does not exist; see [`ScenarioError`].
pub fn generate(scenario: &Scenario) -> Result<GeneratedCase, ScenarioError> {
    let scenario = scenario.with_plan_drawn();
    check(&scenario)?;
    match scenario.form {
        Form::Contact => Ok(contact_case(&scenario)),
        Form::Drive | Form::LinearStage => Ok(crate::drive_log::drive_case(&scenario)),
    }
}

fn check(scenario: &Scenario) -> Result<(), ScenarioError> {
    let every = STEPS_PER_S / scenario.rate_hz;
    if !(every >= 1.0 && (every - every.round()).abs() < 1e-9) {
        return Err(ScenarioError::Rate(scenario.rate_hz));
    }
    if !(scenario.duration_s >= 2.0 && scenario.duration_s.is_finite()) {
        return Err(ScenarioError::Duration(scenario.duration_s));
    }
    for (i, effect) in scenario.effects.iter().enumerate() {
        if scenario.form != Form::Contact && !effect.works_without_contact() {
            return Err(ScenarioError::NeedsContact(*effect));
        }
        for other in &scenario.effects[i + 1..] {
            if !effect.goes_with(*other) {
                return Err(ScenarioError::Exclusive(*effect, *other));
            }
        }
    }
    if scenario.form != Form::Contact && scenario.plan == Plan::Paper {
        return Err(ScenarioError::PlanNeedsContact);
    }
    Ok(())
}

fn base(scenario: &Scenario) -> Base {
    let has = |effect| scenario.effects.contains(&effect);
    if has(Effect::ElementCompliance) || has(Effect::RubberRelaxation) {
        return Base::Series;
    }
    match scenario.base {
        Base::BySeed if Stream::new(scenario.seed, "base").chance(0.8) => Base::Series,
        Base::BySeed => Base::Lugre,
        decided => decided,
    }
}

fn contact_case(scenario: &Scenario) -> GeneratedCase {
    let seed = scenario.seed;
    let rig = Rig::draw(seed);
    let friction = Friction::draw(seed, base(scenario));
    let mut baseline = friction.clone();
    if scenario.effects.contains(&Effect::ElementCompliance) {
        baseline.base = Base::Lugre;
    }
    let nominal = baseline.nominal(seed);

    // The loads are sized for the plain curve, so that they are the same with an effect and without.
    let plain = Curve::new(&friction, None, None);
    let greatest = (SLIDING_TORQUE_NM / (rig.friction_radius_m * plain.peak())).min(GREATEST_NORMAL_N);
    let setting = Setting {
        rig: &rig,
        rate_hz: scenario.rate_hz,
        duration_s: scenario.duration_s,
        greatest_normal_n: greatest,
        units: Units::ROTARY,
        family: scenario.laws,
    };
    let laws = Laws::draw(&scenario.effects, seed, &setting);
    let mut sizes = Stream::new(seed, "course limits");
    let limits = Limits {
        normal_n: greatest,
        holding_nm_per_n: 0.85 * plain.least() * rig.friction_radius_m,
        speed_rad_s: sizes.uniform(14.0, 19.0),
    };
    let bandwidth_rad_s = sizes.uniform(55.0, 85.0);
    let courses: Vec<Course> = match scenario.plan {
        Plan::Random | Plan::Drawn => (0..3)
            .map(|i| {
                let mut s = Stream::new(seed, &format!("course {i}"));
                Course::draw(&mut s, limits, scenario.duration_s)
            })
            .collect(),
        Plan::Paper => {
            let force = |share: f64| share * rig.rated_torque_nm * rig.lever_gain_n_per_nm - rig.preload_n;
            [10.0, 30.0, 120.0, 20.0].iter().map(|rpm| paper(*rpm, force(0.055), force(0.4))).collect()
        }
    };
    let noise = Noise::draw(seed, scenario.noise_factor);
    let imperfections = Imperfections::draw(seed, scenario.imperfection, &noise, scenario.rate_hz);
    let logs_at = |bandwidth_rad_s: f64| -> Vec<CleanLog> {
        let world =
            World { rig: &rig, friction: &friction, baseline: &baseline, laws: &laws, bandwidth_rad_s };
        let log = |(i, course): (usize, &Course)| {
            let mut instants = Stream::new(seed, &format!("instants {i}"));
            let schedule = imperfections.schedule(scenario.rate_hz, course.duration_s, &mut instants);
            let disturbance = Disturbance::new(&imperfections, seed, i);
            world.run(course, &schedule, disturbance, &mut Stream::new(seed, &format!("log {i}")))
        };
        courses.iter().enumerate().map(log).collect()
    };
    // A speed loop that hunts (a late drive on a soft shaft) is turned down before anything is logged.
    let mut turned_down = (0..=MOST_HALVINGS).map(|halvings| logs_at(bandwidth_rad_s / 2f64.powi(halvings)));
    let hunts = |logs: &Vec<CleanLog>| logs.iter().any(|log| log.hunts(rig.rated_torque_nm));
    let logs = turned_down.find(|logs| !hunts(logs)).unwrap_or_else(|| logs_at(bandwidth_rad_s));

    let mut residuals: Vec<_> = logs.iter().map(|log| log.residual).collect();
    let samples: Vec<_> = logs.into_iter().map(|log| log.samples).collect();
    let clip = laws.adc_saturation.as_ref().map(|law| Clip::new(law, &samples));
    if let Some(clip) = &clip {
        for (residual, samples) in residuals.iter_mut().zip(&samples) {
            let (friction, normal) = clip.lost(samples);
            residual.friction_nm = residual.friction_nm.hypot(friction);
            residual.normal_n = residual.normal_n.hypot(normal);
        }
    }
    let mut texts: Vec<String> = samples
        .iter()
        .enumerate()
        .map(|(i, samples)| {
            let mut s = Stream::new(seed, &format!("noise {i}"));
            contact_csv(samples, &noise, clip.as_ref(), scenario.temperature_sensor, &mut s)
        })
        .collect();
    let holdout = texts.pop().unwrap_or_default();
    let rms = |pick: fn(&crate::shadow::Residual) -> f64| {
        (residuals.iter().map(|r| pick(r).powi(2)).sum::<f64>() / residuals.len() as f64).sqrt()
    };
    let friction_noise = noise.friction_nm.hypot(0.8 * rig.friction_radius_m * noise.normal_n);
    let normal_noise = noise.normal_n.hypot(0.6 * rig.lever_gain_n_per_nm * noise.m1_torque_nm);
    let in_window = (0.01 * scenario.rate_hz).max(1.0);
    let drive_noise = (noise.m2_torque_nm.hypot(noise.friction_nm) / in_window.sqrt())
        .hypot(rig.inertia_kg_m2 * noise.speed_rad_s * 2.0_f64.sqrt() / 0.01);
    let ratio = |size: f64, noise: f64| if noise > 0.0 { size / noise } else { 0.0 };
    let residual_to_noise = [
        ratio(rms(|r| r.friction_nm), friction_noise),
        ratio(rms(|r| r.normal_n), normal_noise),
        ratio(rms(|r| r.drive_nm), drive_noise),
    ];
    GeneratedCase {
        train: texts,
        holdout,
        rig_toml: files::rig_toml(&rig, scenario.rig_file_error, &mut Stream::new(seed, "rig file")),
        model_toml: files::model_toml(&nominal),
        truth: Truth {
            effects: scenario.effects.clone(),
            seed,
            rate_hz: scenario.rate_hz,
            noise_factor: scenario.noise_factor,
            baseline_kind: kind(nominal.base).to_owned(),
            rig,
            stick_slip: friction.sticks_and_slips(),
            law_names: laws.names(),
            plan: scenario.plan,
            duration_s: scenario.duration_s,
            imperfections,
            friction: Some(friction),
            nominal: Some(nominal),
            laws,
            noise,
            residuals,
            residual_to_noise,
        },
    }
}
