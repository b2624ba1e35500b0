//! Fig. 26: deformation u(s) of an element on its way through the contact patch, at constant slip.
//!
//! An element enters undeformed at s = 0 and is carried along at the rolling speed while its root slides over the road
//! at the sliding speed. The patches (eqs. 7, 15, 19) are run until they are steady and give u(s) point by
//! point; the series element is followed along its way, t = s/(rω), which for a steady patch is the same.

use super::candidate_models::five;
use crate::files::experiment_file::PatchCrossing;
use crate::files::log::Log;
use crate::plant::ElementParameters;
use crate::report::{Chart, Line, Panel, Role};
use model_core::error::ParameterError;
use model_core::friction::Contact;
use model_core::friction::brush_patch::{BrushPatch, BrushPatchState};
use model_core::friction::lugre_patch::{
    LugrePatch, ModifiedLugrePatch, ModifiedPatchState, PatchParameters, PatchState,
};
use model_core::friction::series::{Series, SeriesParameters, SeriesState};

/// Points of a patch.
const POINTS: usize = 200;

/// u(s) of one model.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Name of the model.
    pub name: &'static str,
    /// Column in `curves.csv`.
    pub column: &'static str,
    /// Its colour.
    pub role: Role,
    /// Deformation at each place.
    pub deformation_m: Vec<f64>,
    /// Friction force there over normal force.
    pub coefficient: Vec<f64>,
}

/// All profiles.
#[derive(Debug, Clone, PartialEq)]
pub struct Crossing {
    /// Places along the patch.
    pub path_m: Vec<f64>,
    /// One for each model.
    pub profiles: Vec<Profile>,
}

impl Profile {
    /// Largest deformation over that at the end of the patch, less one.
    #[must_use]
    pub fn overshoot(&self) -> f64 {
        let end = self.deformation_m.last().copied().unwrap_or(0.0);
        self.deformation_m.iter().copied().fold(0.0, f64::max) / end - 1.0
    }
}

/// Runs all models across the patch.
///
/// # Errors
/// A parameter out of range.
pub fn run(slip: &PatchCrossing, rubber: &SeriesParameters<f64>) -> Result<Crossing, ParameterError> {
    let (v, roll, load) = (slip.sliding_speed_m_s, slip.rolling_speed_m_s, slip.normal_force_n);
    let spacing = slip.patch_length_m / POINTS as f64;
    // Half the step limit of eq. 8.
    let step_s = 0.5 * spacing / roll;
    let steps = (3.0 * slip.patch_length_m / roll / step_s) as usize;
    let contact = Contact::new(v, load);
    let models = five(rubber, v, load)?;
    let mut profiles = Vec::new();
    let mut add = |column, role, deformation_m: Vec<f64>, force_n: Option<Vec<f64>>| {
        let name = match role {
            Role::Brush => "brush patch, eqs. 7–11",
            Role::ModifiedLugre => "modified LuGre patch, eqs. 17–19",
            role => models.iter().find(|m| m.role == role).map_or("", |m| m.name),
        };
        // All but the series element carry what their deformation says.
        let coefficient = match force_n {
            Some(force_n) => force_n.iter().map(|f| f / load).collect(),
            None => deformation_m.iter().map(|u| u * rubber.k_u_n_per_m / load).collect(),
        };
        profiles.push(Profile { name, column, role, deformation_m, coefficient });
    };
    let patch_parameters = PatchParameters {
        sigma0_per_m: rubber.k_u_n_per_m / load,
        a2_s_per_m: rubber.bristles.a2_s_per_m,
        stribeck: rubber.bristles.stribeck,
        length_m: slip.patch_length_m,
        largest_transport_speed_m_s: roll,
    };
    for model in &models {
        let ElementParameters::Elements(parameters) = &model.parameters else { continue };
        match model.role {
            Role::Brush => {
                let Some(p) = &parameters.as_brush() else { continue };
                let patch = BrushPatch::<f64, POINTS>::new(p, slip.patch_length_m, roll, step_s)?;
                let mut state = BrushPatchState::default();
                (0..steps).for_each(|_| {
                    patch.step(&mut state, &contact, roll);
                });
                let u = state.element.iter().map(|e| e.deformation_m).collect();
                add("brush_m", Role::Brush, u, None);
            }
            Role::Lugre => {
                let patch = LugrePatch::<f64, POINTS>::new(&patch_parameters, step_s)?;
                let mut state = PatchState::default();
                (0..steps).for_each(|_| {
                    patch.step(&mut state, &contact, roll);
                });
                add("lugre_m", Role::LugrePatch, state.deflection_m.to_vec(), None);
            }
            Role::ModifiedLugre => {
                let Some(p) = &parameters.bristles() else { continue };
                let patch = ModifiedLugrePatch::<f64, POINTS>::new(p, slip.patch_length_m, roll, step_s)?;
                let mut state = ModifiedPatchState::default();
                (0..steps).for_each(|_| {
                    patch.step(&mut state, &contact, roll);
                });
                let u = state.element.iter().map(|e| e.deflection_m).collect();
                add("modified_lugre_m", Role::ModifiedLugre, u, None);
            }
            Role::Series => {
                let Some(p) = &parameters.as_series() else { continue };
                let fine = 20;
                let element = Series::new(p, spacing / roll / f64::from(fine))?;
                let mut state = SeriesState::default();
                let (u, force) = (0..POINTS)
                    .map(|_| {
                        let force = (0..fine).map(|_| element.step(&mut state, &contact).force_n).last();
                        (state.deformation_m, force.unwrap_or(0.0))
                    })
                    .unzip();
                add("series_m", Role::Series, u, Some(force));
            }
            _ => {}
        }
    }
    let path_m = (0..POINTS).map(|k| (k + 1) as f64 * spacing).collect();
    Ok(Crossing { path_m, profiles })
}

impl Crossing {
    /// `curves.csv`.
    #[must_use]
    pub fn log(&self) -> Log {
        let mut log = Log::default();
        log.set_numbers("path_m", self.path_m.clone());
        for p in &self.profiles {
            log.set_numbers(p.column, p.deformation_m.clone());
        }
        log
    }

    /// u over s.
    #[must_use]
    pub fn chart(&self) -> Chart {
        let millimetres = |x: &[f64]| x.iter().map(|x| x * 1e3).collect::<Vec<_>>();
        let path = millimetres(&self.path_m);
        let lines = |pick: &dyn Fn(&Profile) -> Vec<f64>| {
            let line = |p: &Profile| Line {
                name: p.name.into(),
                role: p.role,
                x: path.clone(),
                y: pick(p),
                tolerance: 1e-4,
                fine_tolerance: 1e-4,
            };
            self.profiles.iter().map(line).collect::<Vec<_>>()
        };
        Chart {
            title: "Fig. 26: deformation along the contact patch.".into(),
            caption: "An element enters at the left, undeformed. Brush and series element pass through a maximum; LuGre \
                      and modified LuGre rise to their steady value."
                .into(),
            x_title: "place in the patch s, mm".into(),
            panels: vec![
                Panel { y_title: "deformation u, mm".into(), lines: lines(&|p| millimetres(&p.deformation_m)) },
                Panel { y_title: "friction coefficient".into(), lines: lines(&|p| p.coefficient.clone()) },
            ],
            ..Chart::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn brush_and_series_pass_a_maximum_and_the_lugre_patches_rise_monotonically() {
        let rubber = ElementParameters::default().series().unwrap();
        let slip = PatchCrossing {
            sliding_speed_m_s: 0.06,
            rolling_speed_m_s: 0.8,
            patch_length_m: 0.1,
            normal_force_n: 88.0,
        };
        let crossing = run(&slip, &rubber).unwrap();
        assert_eq!(crossing.profiles.len(), 4);
        let steady = 88.0 * (0.5 + 0.7 * (-(0.06f64 / 0.5).sqrt()).exp()) / 3e4;
        for p in &crossing.profiles {
            let end = p.deformation_m[POINTS - 1] / steady;
            match p.role {
                Role::Brush | Role::Series => {
                    assert!(p.overshoot() > 0.01, "{}: {}", p.name, p.overshoot());
                    assert!((end - 1.0).abs() < 1e-3, "{} ends at {end} of its steady value", p.name);
                }
                _ => {
                    assert!(p.deformation_m.windows(2).all(|w| w[1] >= w[0] - 1e-12), "{}", p.name);
                    // 7.5 mm of sliding are 2.6 times the steady deformation: 1 − e^{−2.6} of it.
                    assert!(end > 0.9 && end <= 1.0, "{} ends at {end} of its steady value", p.name);
                }
            }
        }
    }
}
