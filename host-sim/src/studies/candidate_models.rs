//! The five models, made comparable: the same rubber, seen through five sets of equations.
//!
//! All share the static curve g(v) and the stiffness with which friction winds up, k_u of the series element. So
//! they differ in one thing only, how the asperities' speed enters, and that is what decides about the overshoot.
//! The brush knows no curve, only two coefficients: µ_s = g(0), and µ_c = g at the speed of the comparison, to which
//! it must be set anew for each speed.

use crate::plant::{ElementModel, ElementParameters};
use crate::report::Role;
use model_core::error::ParameterError;
use model_core::friction::brush::BrushParameters;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::lugre_patch::PatchParameters;
use model_core::friction::series::SeriesParameters;
use model_core::friction::stribeck::Stribeck;
use model_core::friction::{Contact, FrictionParameters};

/// One of the five.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateModel {
    /// Name with its equations.
    pub name: &'static str,
    /// Its colour in charts.
    pub role: Role,
    /// Whether it can overshoot at constant sliding speed and normal force, and why.
    pub why: &'static str,
    /// Its numbers, all elements together.
    pub parameters: ElementParameters,
}

/// The rubber behind a set of parameters: only the series element names block and bristles both.
#[must_use]
pub fn rubber_of(parameters: &ElementParameters) -> Option<SeriesParameters<f64>> {
    parameters.series()
}

/// The five models of one rubber, for comparisons at a sliding speed and a normal force.
///
/// # Errors
/// A parameter out of range.
pub fn five(
    rubber: &SeriesParameters<f64>,
    sliding_speed_m_s: f64,
    normal_force_n: f64,
) -> Result<[CandidateModel; 5], ParameterError> {
    let curve = Stribeck::new(&rubber.bristles.stribeck)?;
    let bristles = LugreParameters { sigma0_n_per_m: rubber.k_u_n_per_m, ..rubber.bristles };
    let element = ElementParameters::Elements;
    Ok([
        CandidateModel {
            name: "brush, eqs. 4–6",
            role: Role::Brush,
            why: "It drops from µ_s to µ_c at once when it breaks loose. The size of the drop is put in by hand, and \
                  so is µ_c, for each speed anew.",
            parameters: element(FrictionParameters::brush(&BrushParameters {
                c_n_per_m: rubber.k_u_n_per_m,
                mu_s: curve.largest(),
                mu_c: curve.coefficient(sliding_speed_m_s),
            })),
        },
        CandidateModel {
            name: "LuGre, eqs. 12–14",
            role: Role::Lugre,
            why: "It cannot: at constant speed g(v) is one number, and the deflection rises monotonically to \
                  F_N g(v)/σ0. Its force could with σ1 v > F_N g(v); here σ1 = 0.",
            parameters: element(FrictionParameters::lugre(&bristles)),
        },
        CandidateModel {
            name: "LuGre patch, eqs. 15–16",
            role: Role::LugrePatch,
            why: "It cannot, for the same reason. As printed it drops F_N from the deflection, so its force follows the \
                  normal force at once.",
            parameters: ElementParameters::LugrePatch(PatchParameters {
                sigma0_per_m: rubber.k_u_n_per_m / normal_force_n,
                a2_s_per_m: rubber.bristles.a2_s_per_m,
                stribeck: rubber.bristles.stribeck,
                length_m: 0.01,
                largest_transport_speed_m_s: 0.0,
            }),
        },
        CandidateModel {
            name: "modified LuGre, eqs. 17–19",
            role: Role::ModifiedLugre,
            why: "It cannot: the equation for the asperities' speed s has exactly one root, so u̇ depends on u alone, \
                  and u rises monotonically (a0 > a1 δ e^{−(1 + 1/δ)}, σ1 = 0). A rate that lags gives an overshoot.",
            parameters: element(FrictionParameters::modified_lugre(&bristles)),
        },
        CandidateModel {
            name: "series element, Fig. 25",
            role: Role::Series,
            why: "It does: while the block winds up, the asperities slide slower than the root, so they feel a larger \
                  g than that of steady sliding; when they have caught up, friction falls to F_N g(v).",
            parameters: element(FrictionParameters::series(rubber)),
        },
    ])
}

/// Force of a model at rest at first, then driven: each entry holds mean sliding speed and final normal force of
/// one step.
pub fn drive(model: &ElementModel, motion: impl IntoIterator<Item = (f64, f64)>) -> Vec<f64> {
    let mut state = model.rest();
    motion.into_iter().map(|(v, n)| model.step(&mut state, &Contact::new(v, n)).force_n).collect()
}

/// Peak over final value, less one, at constant speed and normal force, started from rest.
///
/// # Errors
/// A parameter out of range.
pub fn constant_overshoot(
    parameters: &ElementParameters,
    sliding_speed_m_s: f64,
    normal_force_n: f64,
) -> Result<f64, ParameterError> {
    // Fine enough that the instant of breaking loose is right to 1e-3 of the wind-up.
    let step_s = 2e-6;
    let steps = 300_000;
    let force = drive(&parameters.model(step_s)?, (0..steps).map(|_| (sliding_speed_m_s, normal_force_n)));
    let settled = force.last().copied().unwrap_or(0.0);
    let peak = force.iter().copied().fold(0.0, f64::max);
    Ok(peak / settled - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rubber() -> SeriesParameters<f64> {
        ElementParameters::default().series().unwrap()
    }

    #[test]
    fn of_five_models_only_series_element_and_brush_overshoot_at_constant_speed_and_load() {
        for rpm in [10.0, 20.0, 30.0, 120.0] {
            let v = rpm * std::f64::consts::TAU / 60.0 * 0.06;
            for c in five(&rubber(), v, 88.0).unwrap() {
                let overshoot = constant_overshoot(&c.parameters, v, 88.0).unwrap();
                match c.role {
                    Role::Series => assert!(overshoot > 0.1, "{} at {rpm} rpm: {overshoot}", c.name),
                    Role::Brush => {
                        let g = 0.5 + 0.7 * (-(v / 0.5f64).sqrt()).exp();
                        assert!(
                            (overshoot - (1.2 / g - 1.0)).abs() < 2e-3,
                            "{} at {rpm} rpm: {overshoot}",
                            c.name
                        );
                    }
                    _ => assert!(overshoot.abs() < 1e-6, "{} at {rpm} rpm: {overshoot}", c.name),
                }
            }
        }
    }

    #[test]
    fn all_five_settle_at_the_static_curve() {
        let v = 0.2;
        let expected = 88.0 * (0.5 + 0.7 * (-(v / 0.5f64).sqrt()).exp());
        for c in five(&rubber(), v, 88.0).unwrap() {
            let force = drive(&c.parameters.model(1e-5).unwrap(), (0..50_000).map(|_| (v, 88.0)));
            assert!((force[49_999] / expected - 1.0).abs() < 1e-6, "{}: {}", c.name, force[49_999]);
        }
    }
}
