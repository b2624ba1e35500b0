//! Which numbers of a model file `fit` may move, and what it found written back into the file.
//!
//! The file is a start and no knowledge: all numbers but the exponents have a normal prior in their logarithm with a
//! deviation of one, a factor of e either way, bounded smoothly at three deviations, a factor of twenty.

use nalgebra::DMatrix;

use super::contact::baseline;
use super::contact::problem::{BaseParameter, Baseline, Role};
use super::term::Parameter;
use crate::files::model_file::{ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::fit::error::FitError;
use crate::input_error::InputError;

/// Deviation of the prior, in ln, of what a start value is good for.
const WITHIN: f64 = 1.0;
/// The same for bristles and viscous friction, of which a file may know no more than the decade.
const WITHIN_A_DECADE: f64 = 2.0;
/// The same for the exponent, which lies between 0.3 and 2.
const WITHIN_EXPONENT: f64 = 0.5;
/// Where a number that stands at zero is started, since a ratio needs one: a tenth of the Coulomb coefficient, …
const SOME_DROP: f64 = 0.1;
/// … s/m, …
const SOME_VISCOUS_S_PER_M: f64 = 0.01;
/// … and N s/m.
const SOME_DAMPING_N_S_PER_M: f64 = 100.0;
/// Step of ln in which derivatives of the file's numbers are taken.
const STEP: f64 = 1e-4;

/// Parameters that are identified where nothing else is asked for.
pub fn default_free(model: &ModelFile) -> Vec<String> {
    let held = |name: &str, value: f64| match name {
        "theta" | "delta" => true,
        "sigma1_n_s_per_m" | "a2_s_per_m" => value == 0.0,
        "sigma0_n_per_m" => model.kind == ModelKind::Series,
        _ => false,
    };
    model.parameters().filter(|(name, value)| !held(name, *value)).map(|(name, _)| name.to_string()).collect()
}

fn role(name: &str, block: bool) -> Option<(Role, f64)> {
    match name {
        "a0" | "mu_c" => Some((Role::A0, WITHIN)),
        "a1" => Some((Role::A1, WITHIN)),
        "mu_s" => Some((Role::Static, WITHIN)),
        "v0_m_s" => Some((Role::V0, WITHIN)),
        "delta" => Some((Role::Delta, WITHIN_EXPONENT)),
        "theta" => Some((Role::Factor, WITHIN)),
        "a2_s_per_m" => Some((Role::A2, WITHIN_A_DECADE)),
        "k_u_n_per_m" => Some((Role::Stiffness, WITHIN)),
        "c_u_n_s_per_m" => Some((Role::Damping, WITHIN)),
        "sigma0_n_per_m" | "c_n_per_m" if !block => Some((Role::Stiffness, WITHIN_A_DECADE)),
        "sigma1_n_s_per_m" if !block => Some((Role::Damping, WITHIN_A_DECADE)),
        _ => None,
    }
}

/// The baseline in which `free` is identified; the errors of the sensors are found beside it, its last parameters.
///
/// # Errors
/// A name that the model does not have, and one that the contact's balance does not show.
pub fn baseline_of(model: &ModelFile, rig: &RigFile, free: &[String]) -> Result<Baseline, InputError> {
    let refuse = |problem: String| InputError::new(problem).file(model.source.as_str());
    if let Some(name) = free.iter().find(|name| model.get(name).is_none()) {
        let names: Vec<&str> = model.parameters().map(|(name, _)| name).collect();
        return Err(refuse("unknown parameter".into()).key(name.as_str()).allowed(names.join(", ")));
    }
    if free.is_empty() {
        return Err(refuse("no parameter is free".into()));
    }
    let block = baseline::has_block(model);
    let hidden: Vec<String> = free.iter().filter(|name| role(name, block).is_none()).cloned().collect();
    if !hidden.is_empty() {
        return Err(refuse(FitError::NoInfluence { names: hidden }.to_string()));
    }
    let Baseline { mut numbers, free: mut usual } = baseline::baseline(model, WITHIN).with_bridge_zeros(rig);
    let wanted = |role: Role| free.iter().any(|name| self::role(name, block).is_some_and(|(r, _)| r == role));
    for (slot, role, some) in [
        (&mut numbers.a2_s_per_m, Role::A2, SOME_VISCOUS_S_PER_M),
        (&mut numbers.damping_n_s_per_m, Role::Damping, SOME_DAMPING_N_S_PER_M),
        (&mut numbers.a1, Role::A1, SOME_DROP * numbers.a0),
    ] {
        if *slot <= 0.0 && wanted(role) {
            *slot = some;
        }
    }
    usual.retain(|base| base.role.is_of_sensor());
    let mut parameters = Vec::new();
    for name in free {
        let Some((role, sd)) = role(name, block) else { continue };
        let value = match role {
            Role::A0 => numbers.a0,
            Role::A1 => numbers.a1,
            Role::Static => numbers.a0 + numbers.a1,
            Role::V0 => numbers.v0_m_s,
            Role::Delta => numbers.delta,
            Role::A2 => numbers.a2_s_per_m,
            Role::Stiffness => numbers.stiffness_n_per_m,
            Role::Damping => numbers.damping_n_s_per_m,
            Role::Factor | Role::Late | Role::FrictionZero | Role::NormalZero => 1.0,
        };
        let parameter =
            Parameter { step: 0.01, reach: 0.5, ..Parameter::logarithm(name.as_str(), value, sd) };
        parameters.push(BaseParameter { role, parameter });
    }
    parameters.sort_by_key(|base| base.role == Role::Factor);
    parameters.extend(usual);
    Ok(Baseline { numbers, free: parameters })
}

/// Value of a file's parameter for the baseline's values.
fn value(model: &ModelFile, baseline: &Baseline, p: &[f64], name: &str) -> f64 {
    let numbers = baseline.numbers(p);
    let of_role = |role: Role| baseline.free.iter().position(|base| base.role == role);
    // θ scales what the engine knows as a0 and a1.
    let factor = of_role(Role::Factor).map_or(1.0, |at| baseline.bounded(p, at).exp());
    let theta = model.get("theta").unwrap_or(1.0) * factor;
    match name {
        "a0" => numbers.a0 / theta,
        "a1" => numbers.a1 / theta,
        "theta" => theta,
        "mu_c" => numbers.a0,
        "mu_s" => numbers.a0 + numbers.static_drop(),
        "v0_m_s" => numbers.v0_m_s,
        "delta" => numbers.delta,
        "a2_s_per_m" => numbers.a2_s_per_m,
        "c_u_n_s_per_m" | "sigma1_n_s_per_m" => numbers.damping_n_s_per_m,
        _ => numbers.stiffness_n_per_m,
    }
}

/// The file's parameters for the baseline's values.
pub fn values(model: &ModelFile, baseline: &Baseline, p: &[f64], free: &[String]) -> Vec<f64> {
    free.iter().map(|name| value(model, baseline, p, name)).collect()
}

/// Sets the file's numbers, whichever way they bound each other.
pub(super) fn set_all(model: &mut ModelFile, names: &[String], values: &[f64]) -> Result<(), InputError> {
    let set = |model: &mut ModelFile| {
        names.iter().zip(values).map(|(name, value)| model.set(name, *value)).fold(Ok(()), Result::and)
    };
    // Kinetic friction may have to wait for static friction to be raised, in the first round.
    set(model).or_else(|_| set(model))
}

/// ∂ ln(file's parameters)/∂(baseline's values), a row for each parameter.
pub fn log_derivatives(model: &ModelFile, baseline: &Baseline, p: &[f64], free: &[String]) -> DMatrix<f64> {
    DMatrix::from_fn(free.len(), p.len(), |row, column| {
        let moved = |step: f64| {
            let mut q = p.to_vec();
            q[column] += step;
            value(model, baseline, &q, &free[row]).ln()
        };
        (moved(STEP) - moved(-STEP)) / (2.0 * STEP)
    })
}
