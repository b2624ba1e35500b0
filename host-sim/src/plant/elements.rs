//! The three rubber elements that touch the disc, 120° apart, each with a third of stiffness and damping.
//!
//! Each is one of the friction models of the core, in `f64`. Where all three bear the same load they do the same,
//! so one is integrated and its force taken three times: exact, and three times as fast.

use super::effects::Affected;
use crate::files::model_file::SOME_STEP_S;
use model_core::error::ParameterError;
use model_core::extension::{ExtendedState, Extensions};
use model_core::friction::lugre_patch::{LugrePatch, PatchParameters, PatchState};
use model_core::friction::series::SeriesParameters;
use model_core::friction::{
    Contact, FrictionForce, FrictionModel, FrictionParameters, FrictionState, ModelKind,
};

/// Friction parameters of all elements together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementParameters {
    /// One of the core's models.
    Elements(FrictionParameters<f64>),
    /// LuGre tyre patch, eq. 15, on elements that slide but do not roll: without transport all points of the patch
    /// do the same, and what is left of the difference to LuGre is that stiffness grows with the load.
    LugrePatch(PatchParameters<f64>),
}

impl Default for ElementParameters {
    /// The series element with the assumed numbers.
    fn default() -> Self {
        Self::Elements(FrictionParameters::typical(ModelKind::Series))
    }
}

impl ElementParameters {
    /// Name of the kind, as in a model file.
    #[must_use]
    pub fn kind(&self) -> &'static str {
        match self {
            Self::Elements(p) => p.kind().name(),
            Self::LugrePatch(_) => "lugre_patch",
        }
    }

    /// The rubber's numbers, where the model has a block in series with bristles.
    #[must_use]
    pub fn series(&self) -> Option<SeriesParameters<f64>> {
        match self {
            Self::Elements(p) => p.as_series(),
            Self::LugrePatch(_) => None,
        }
    }

    /// Parameters of an element with this share of stiffness and damping.
    #[must_use]
    pub fn share(&self, share: f64) -> Self {
        match self {
            Self::Elements(p) => Self::Elements(p.share(share)),
            // Stiffness per unit load is the same for each part of the load.
            Self::LugrePatch(p) => Self::LugrePatch(*p),
        }
    }

    /// The model, prepared for a step.
    ///
    /// # Errors
    /// The parameter out of range.
    pub fn model(&self, step_s: f64) -> Result<ElementModel, ParameterError> {
        Ok(match self {
            Self::Elements(p) => ElementModel::Single(p.model(step_s)?),
            Self::LugrePatch(p) => ElementModel::Patch(LugrePatch::new(p, step_s)?),
        })
    }

    /// Stiffness that the disc feels while the elements stick.
    pub(crate) fn sticking_stiffness_n_per_m(&self) -> f64 {
        match self {
            Self::Elements(p) => {
                p.model(SOME_STEP_S).map_or(0.0, |m| m.sticking_stiffness_n_per_m(LARGE_LOAD_N))
            }
            Self::LugrePatch(p) => p.sigma0_per_m * LARGE_LOAD_N,
        }
    }
}

/// What the rig presses with at most, about.
const LARGE_LOAD_N: f64 = 200.0;

/// A friction model, prepared for a step size: one of the core's, or a patch of one point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementModel {
    /// An element of the core.
    Single(FrictionModel<f64>),
    /// A patch without transport.
    Patch(LugrePatch<f64, 1>),
}

/// State of an [`ElementModel`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ElementState {
    /// An element of the core.
    Single(FrictionState<f64>),
    /// A patch without transport.
    Patch(PatchState<f64, 1>),
}

impl ElementModel {
    /// The undeformed state.
    #[must_use]
    pub fn rest(&self) -> ElementState {
        match self {
            Self::Single(model) => ElementState::Single(model.rest()),
            Self::Patch(_) => ElementState::Patch(PatchState::default()),
        }
    }

    /// Advances the element by one step. A state of another kind is first replaced by the undeformed one.
    #[inline]
    pub fn step(&self, state: &mut ElementState, contact: &Contact<f64>) -> FrictionForce<f64> {
        match (self, &mut *state) {
            (Self::Single(model), ElementState::Single(s)) => model.step(s, contact),
            (Self::Patch(patch), ElementState::Patch(s)) => FrictionForce {
                force_n: patch.step(s, contact, 0.0),
                tip_speed_m_s: contact.sliding_speed_m_s,
            },
            _ => {
                *state = self.rest();
                FrictionForce::default()
            }
        }
    }
}

impl ElementState {
    /// Deformation of the block, or of the bristles where there is no block.
    #[must_use]
    pub fn deformation_m(&self) -> f64 {
        match self {
            Self::Single(e) => e.deformation_m(),
            Self::Patch(e) => e.deflection_m[0],
        }
    }
}

/// The elements, prepared for a step size.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Elements {
    model: ElementModel,
    load_shares: [f64; 3],
    equal: bool,
    affected: Option<Affected>,
}

/// State of the elements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ElementsState {
    pub(crate) element: [ElementState; 3],
    pub(crate) force_n: f64,
    /// Tip speed of the first element, the root's where it has no block.
    pub(crate) tip_speed_m_s: f64,
    /// In place of the elements' own where effects act on them.
    affected: Option<ExtendedState<f64>>,
}

impl ElementsState {
    /// Deformation of the first element's block, or of its bristles where there is no block.
    pub(crate) fn deformation_m(&self) -> f64 {
        match &self.affected {
            Some(affected) => ElementState::Single(affected.friction()).deformation_m(),
            None => self.element[0].deformation_m(),
        }
    }
}

impl Elements {
    pub(crate) fn new(
        p: &ElementParameters,
        load_shares: [f64; 3],
        step_s: f64,
    ) -> Result<Self, ParameterError> {
        // The model's own ranges are those of all elements together, so that is what an error must name.
        p.model(step_s)?;
        let equal = load_shares.iter().all(|s| (s - 1.0 / 3.0).abs() < 1e-12);
        Ok(Self { model: p.share(1.0 / 3.0).model(step_s)?, load_shares, equal, affected: None })
    }

    /// The same elements with effects on their friction.
    pub(crate) fn with_effects(
        self,
        p: &ElementParameters,
        effects: Option<Extensions<f64>>,
        radius_m: f64,
        step_s: f64,
    ) -> Result<Self, ParameterError> {
        let affected = effects.map(|effects| Affected::new(p, effects, radius_m, step_s)).transpose()?;
        Ok(Self { affected: affected.flatten(), ..self })
    }

    pub(crate) fn rest(&self) -> ElementsState {
        ElementsState {
            element: [self.model.rest(); 3],
            force_n: 0.0,
            tip_speed_m_s: 0.0,
            affected: self.affected.as_ref().map(Affected::rest),
        }
    }

    /// Moves the elements' roots at `speed_m_s` for one step under `normal_force_n` at its end.
    #[inline]
    pub(crate) fn step(
        &self,
        state: &mut ElementsState,
        speed_m_s: f64,
        disc_angle_rad: f64,
        normal_force_n: f64,
    ) -> f64 {
        if let (Some(affected), Some(s)) = (&self.affected, &mut state.affected) {
            state.force_n = affected.step(s, speed_m_s, disc_angle_rad, normal_force_n);
            state.tip_speed_m_s = s.tip_speed_m_s();
            return state.force_n;
        }
        let third = Contact::new(speed_m_s, normal_force_n * self.load_shares[0]);
        let first = self.model.step(&mut state.element[0], &third);
        state.tip_speed_m_s = first.tip_speed_m_s;
        state.force_n = if self.equal {
            3.0 * first.force_n
        } else {
            let rest = state.element.iter_mut().zip(self.load_shares).skip(1);
            rest.fold(first.force_n, |sum, (element, share)| {
                sum + self.model.step(element, &Contact::new(speed_m_s, normal_force_n * share)).force_n
            })
        };
        state.force_n
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_equal_elements_do_what_one_with_all_the_stiffness_does() {
        let step = 1e-4;
        for p in [
            ElementParameters::default(),
            ElementParameters::Elements(FrictionParameters::typical(ModelKind::Brush)),
        ] {
            let equal = Elements::new(&p, [1.0 / 3.0; 3], step).unwrap();
            let each = Elements { equal: false, ..equal };
            let whole = p.model(step).unwrap();
            let (mut a, mut b, mut c) = (equal.rest(), each.rest(), whole.rest());
            for k in 0..3000 {
                let t = f64::from(k) * step;
                let (v, n) = ((9.0 * t).sin() * 0.3, 60.0 + 40.0 * (31.0 * t).cos());
                let forces = [
                    equal.step(&mut a, v, 0.0, n),
                    each.step(&mut b, v, 0.0, n),
                    whole.step(&mut c, &Contact::new(v, n)).force_n,
                ];
                // Only rounding tells them apart; bristles multiply it by σ0/k_u ≈ 600.
                assert!((forces[0] - forces[1]).abs() < 1e-7, "{forces:?} at {k}");
                assert!((forces[0] - forces[2]).abs() < 1e-7, "{forces:?} at {k}");
            }
        }
    }

    #[test]
    fn unequal_loads_add_up_to_the_whole_in_steady_sliding() {
        let step = 1e-4;
        let p = ElementParameters::default();
        let elements = Elements::new(&p, [0.5, 0.3, 0.2], step).unwrap();
        let mut state = elements.rest();
        for _ in 0..20_000 {
            elements.step(&mut state, 0.3, 0.0, 90.0);
        }
        let steady = 90.0 * (0.5 + 0.7 * (-(0.3f64 / 0.5).sqrt()).exp());
        assert!((state.force_n / steady - 1.0).abs() < 1e-9, "{} against {steady}", state.force_n);
    }
}
