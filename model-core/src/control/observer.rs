//! Model observer: what friction should be by the model, from measured speed and normal force, and what is left.
//!
//! Three elements touch the disc at 120°, so the model of the whole contact is split into [`N_ELEMENTS`] equal ones:
//! each has a third of the load, of the stiffnesses and of the dampings; coefficients of friction stay. They do the same,
//! so one is stepped. Around
//! the three stand the effects of [`crate::extension`] that a diagnosis added: they act on speed, load and friction
//! coefficient of the contact, and on what the friction channel shows.
//! A patch is one of [`PATCH_BRISTLES`] bristles for the whole contact. Rubber is taken to run through it at the sliding
//! speed, as on a wheel; a block that is held fast has no transport, and costs the same.
//!
//! predicted = r·Σ F_i with its effects, as a friction channel with a second order Butterworth low-pass like the bridge's
//! amplifier shows it ([`crate::sensor::SensorChain`]), so that measurement and prediction are late by the same time.
//! residual = measured − predicted, with a running mean square (one pole; its root is taken by whoever shows it).
//!
//! Left out: the torque ring's own mode (600 Hz), which is fast against anything the model predicts.

use super::settings::ObserverSettings;
use crate::error::ParameterError;
use crate::extension::{ExtendedFriction, ExtendedInput, ExtendedState, Extensions};
use crate::friction::lugre::LugreParameters;
use crate::friction::lugre_patch::{LugrePatch, PatchParameters, PatchState};
use crate::friction::{Contact, FrictionForce, FrictionModel, FrictionParameters, FrictionState};
use core::f32::consts::PI;

/// Elements on the disc.
pub const N_ELEMENTS: usize = 3;

/// The load of the paper's experiments, at which a patch is as stiff as its stand-in.
const PATCH_LOAD_N: f32 = 88.0;

/// Bristles of a patch in the observer.
pub const PATCH_BRISTLES: usize = 20;

/// Parameters of a friction model of the whole contact, all elements together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ModelParameters {
    /// Elements of a kind.
    Elements(FrictionParameters<f32>),
    /// LuGre contact patch, for its cost on the chip: model files have no such kind.
    LugrePatch(PatchParameters<f32>),
}

/// The friction of the contact, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Rubber {
    Element(FrictionModel<f32>),
    Patch(LugrePatch<f32, PATCH_BRISTLES>),
}

/// What the rubber remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
enum RubberState {
    Element(FrictionState<f32>),
    Patch(PatchState<f32, PATCH_BRISTLES>),
}

impl Rubber {
    fn rest(&self) -> RubberState {
        match self {
            Self::Element(element) => RubberState::Element(element.rest()),
            Self::Patch(_) => RubberState::Patch(PatchState::default()),
        }
    }

    /// One step under the whole load.
    #[inline(always)]
    fn step(&self, state: &mut RubberState, whole: &Contact<f32>) -> FrictionForce<f32> {
        match (self, &mut *state) {
            (Self::Element(element), RubberState::Element(state)) => {
                let load_n = whole.normal_force_n * (1.0 / N_ELEMENTS as f32);
                let part = Contact { normal_force_n: load_n, ..*whole };
                // Equal elements under equal loads do the same to the last bit, so one is stepped and counted for all.
                let one = element.step(state, &part);
                let force_n = (0..N_ELEMENTS).fold(0.0, |sum, _| sum + one.force_n);
                FrictionForce { force_n, ..one }
            }
            (Self::Patch(patch), RubberState::Patch(bristles)) => FrictionForce {
                force_n: patch.step(bristles, whole, whole.sliding_speed_m_s),
                tip_speed_m_s: whole.sliding_speed_m_s,
            },
            _ => {
                *state = self.rest();
                FrictionForce::default()
            }
        }
    }
}

/// A model prepared for the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ObserverModel {
    rubber: Rubber,
    around: ExtendedFriction<f32>,
}

impl ModelParameters {
    /// The whole contact as one element.
    fn prepare(&self, tick_s: f32) -> Result<FrictionModel<f32>, ParameterError> {
        match self {
            Self::Elements(p) => p.model(tick_s),
            // What stands for it where the effects ask for a model: the same curve.
            Self::LugrePatch(p) => FrictionModel::lugre(
                &LugreParameters {
                    sigma0_n_per_m: p.sigma0_per_m * PATCH_LOAD_N,
                    sigma1_n_s_per_m: 0.0,
                    a2_s_per_m: p.a2_s_per_m,
                    stribeck: p.stribeck,
                },
                tick_s,
            ),
        }
    }

    /// The friction of the whole contact, in elements or as a patch.
    fn rubber(&self, tick_s: f32) -> Result<Rubber, ParameterError> {
        match self {
            Self::LugrePatch(p) => LugrePatch::new(p, tick_s).map(Rubber::Patch),
            Self::Elements(p) => p.share(1.0 / N_ELEMENTS as f32).model(tick_s).map(Rubber::Element),
        }
    }
}

impl ObserverModel {
    /// Splits the model of the whole contact into elements and prepares them, without further effects.
    ///
    /// # Errors
    /// The parameter that is out of its range.
    pub fn new(whole: &ModelParameters, friction_radius_m: f32, tick_s: f32) -> Result<Self, ParameterError> {
        Self::extended(whole, Extensions::none(tick_s), friction_radius_m)
    }

    /// The same with the effects of an extended model file, prepared for the control period.
    ///
    /// # Errors
    /// The parameter that is out of its range.
    pub fn extended(
        whole: &ModelParameters,
        effects: Extensions<f32>,
        friction_radius_m: f32,
    ) -> Result<Self, ParameterError> {
        let tick_s = effects.step_s();
        let around = ExtendedFriction::new(whole.prepare(tick_s)?, effects, friction_radius_m)?;
        Ok(Self { rubber: whole.rubber(tick_s)?, around })
    }
}

/// Coefficients of the observer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Observer {
    model: ObserverModel,
    lowpass: Lowpass,
    averaging: f32,
}

/// What the observer remembers; what is large of it last.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(crate) struct ObserverState {
    rubber: RubberState,
    lowpass: LowpassState,
    mean_square: f32,
    around: ExtendedState<f32>,
}

/// Result of one tick.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Observed {
    pub(crate) predicted_nm: f32,
    pub(crate) residual_nm: f32,
    pub(crate) mean_square_nm2: f32,
}

impl Observer {
    pub(crate) fn new(
        settings: &ObserverSettings,
        friction_radius_m: f32,
        tick_s: f32,
    ) -> Result<Self, ParameterError> {
        Ok(Self {
            model: ObserverModel::new(&settings.model, friction_radius_m, tick_s)?,
            lowpass: Lowpass::new(settings.bridge_lowpass_hz, tick_s),
            averaging: -libm::expm1f(-tick_s / settings.residual_time_s),
        })
    }

    pub(crate) fn set_model(&mut self, model: &ObserverModel) {
        self.model = *model;
    }

    pub(crate) fn fresh(&self) -> ObserverState {
        ObserverState {
            rubber: self.model.rubber.rest(),
            around: self.model.around.holding(0.0, &ExtendedInput::default()),
            lowpass: LowpassState::default(),
            mean_square: 0.0,
        }
    }

    /// One tick from what was measured: motion, load, and the friction torque to compare with.
    pub(crate) fn step(
        &self,
        state: &mut ObserverState,
        measured: &ExtendedInput<f32>,
        friction_torque_nm: f32,
    ) -> Observed {
        let (rubber, rubber_state) = (&self.model.rubber, &mut state.rubber);
        let (lowpass, lowpass_state) = (&self.lowpass, &mut state.lowpass);
        let shown = self.model.around.step_around(
            &mut state.around,
            measured,
            |whole| rubber.step(rubber_state, whole),
            |torque_nm| lowpass.step(lowpass_state, torque_nm),
        );
        let predicted_nm = shown.shown_nm;
        let residual_nm = friction_torque_nm - predicted_nm;
        state.mean_square += self.averaging * (residual_nm * residual_nm - state.mean_square);
        if !state.mean_square.is_finite() {
            // A model out of the range of f32, or a measurement that is no number: again from rest.
            *state = self.fresh();
            return Observed::default();
        }
        Observed { predicted_nm, residual_nm, mean_square_nm2: state.mean_square }
    }
}

/// Second order Butterworth low-pass by the bilinear rule with the corner kept; transposed direct form.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lowpass {
    b0: f32,
    b1: f32,
    a1: f32,
    a2: f32,
}

#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct LowpassState {
    s1: f32,
    s2: f32,
}

impl Lowpass {
    /// A corner of 0 lets everything through.
    fn new(corner_hz: f32, tick_s: f32) -> Self {
        if corner_hz <= 0.0 {
            return Self { b0: 1.0, b1: 0.0, a1: 0.0, a2: 0.0 };
        }
        let k = libm::tanf(PI * corner_hz * tick_s);
        let damping = core::f32::consts::SQRT_2 * k;
        let norm = 1.0 / (1.0 + damping + k * k);
        let b0 = k * k * norm;
        Self { b0, b1: 2.0 * b0, a1: 2.0 * (k * k - 1.0) * norm, a2: (1.0 - damping + k * k) * norm }
    }

    fn step(&self, state: &mut LowpassState, x: f32) -> f32 {
        let y = self.b0 * x + state.s1;
        state.s1 = self.b1 * x - self.a1 * y + state.s2;
        // The numerator is b0(1 + z⁻¹)², or 1 where everything passes.
        state.s2 = 0.5 * self.b1 * x - self.a2 * y;
        y
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::ControlSettings;
    use super::*;
    use crate::extension::Extension;
    use crate::friction::ModelKind;
    use core::f32::consts::TAU;

    const TICK_S: f32 = 1e-4;

    fn run(model: ObserverModel, lowpass_hz: f32, ticks: u32) -> Observed {
        let settings = ControlSettings::default();
        let s =
            ObserverSettings { bridge_lowpass_hz: lowpass_hz, residual_time_s: 0.01, ..settings.observer };
        let mut observer = Observer::new(&s, 0.06, TICK_S).unwrap();
        observer.set_model(&model);
        let mut state = observer.fresh();
        let mut observed = Observed::default();
        for k in 0..ticks {
            let disc_angle_rad = (3.0 * TICK_S * k as f32) % TAU;
            let measured = ExtendedInput { disc_speed_rad_s: 3.0, disc_angle_rad, normal_force_n: 88.0 };
            observed = observer.step(&mut state, &measured, 4.0);
        }
        observed
    }

    /// LuGre slides steadily after microseconds: T = r F_N g(v).
    fn lugre() -> ModelParameters {
        ModelParameters::Elements(FrictionParameters::typical(ModelKind::Lugre))
    }

    fn steady_nm() -> f64 {
        0.06 * 88.0 * (0.5 + 0.7 * (-(0.18_f64 / 0.5).sqrt()).exp())
    }

    #[test]
    fn each_model_split_into_three_gives_the_friction_of_the_whole() {
        for kind in ModelKind::ALL {
            let whole = ModelParameters::Elements(FrictionParameters::typical(*kind));
            let model = whole.prepare(TICK_S).unwrap();
            let contact = Contact::new(0.18, 88.0);
            // In the middle of the transient, where stiffness and damping count.
            for ticks in [3, 50, 150] {
                let (mut state, mut force_n) = (model.rest(), 0.0);
                for _ in 0..ticks {
                    force_n = model.step(&mut state, &contact).force_n;
                }
                let observed = run(ObserverModel::new(&whole, 0.06, TICK_S).unwrap(), 0.0, ticks);
                // Rounding of a third, and the tolerance of the series element's root.
                let error = (observed.predicted_nm - 0.06 * force_n).abs();
                assert!(error < 1e-5 * 0.06 * 88.0, "{whole:?} {ticks}: {error}");
            }
        }
    }

    #[test]
    fn a_patch_in_the_observer_gives_the_friction_of_the_patch() {
        let bristles = FrictionParameters::typical(ModelKind::Lugre).bristles().unwrap();
        let p = PatchParameters {
            sigma0_per_m: 2e5,
            a2_s_per_m: 0.0,
            stribeck: bristles.stribeck,
            length_m: 0.01,
            largest_transport_speed_m_s: 3.0,
        };
        let patch = LugrePatch::<f32, PATCH_BRISTLES>::new(&p, TICK_S).unwrap();
        let (mut state, contact) = (PatchState::default(), Contact::new(0.18, 88.0));
        let force_n = (0..200).map(|_| patch.step(&mut state, &contact, 0.18)).last().unwrap();
        let observed =
            run(ObserverModel::new(&ModelParameters::LugrePatch(p), 0.06, TICK_S).unwrap(), 0.0, 200);
        // The speed goes through the disc's: rounding.
        assert!((observed.predicted_nm - 0.06 * force_n).abs() < 1e-5, "{} {force_n}", observed.predicted_nm);
        // A bristle of 5 µm in 10 mm of patch: sliding friction but for a thousandth.
        assert!((f64::from(observed.predicted_nm) / steady_nm() - 1.0).abs() < 2e-3);
    }

    #[test]
    fn the_residual_is_what_was_measured_less_what_was_predicted() {
        let observed = run(ObserverModel::new(&lugre(), 0.06, TICK_S).unwrap(), 0.0, 2000);
        let expected = 4.0 - steady_nm();
        assert!((f64::from(observed.predicted_nm) - steady_nm()).abs() < 1e-5);
        assert!((f64::from(observed.residual_nm) - expected).abs() < 1e-5);
        // 20 time constants of 10 ms.
        assert!((f64::from(observed.mean_square_nm2) - expected * expected).abs() < 1e-5);
    }

    #[test]
    fn effects_of_a_diagnosis_act_around_the_elements() {
        let predicted = |extension: Extension, values: &[f32]| {
            let mut effects = Extensions::none(TICK_S);
            effects.set(extension, values).unwrap();
            f64::from(run(ObserverModel::extended(&lugre(), effects, 0.06).unwrap(), 0.0, 2000).predicted_nm)
        };
        let crosstalk = predicted(Extension::BridgeCrosstalk, &[0.01, 0.0]);
        assert!((crosstalk - steady_nm() - 0.88).abs() < 1e-4, "0.01 N·m/N of 88 N: {crosstalk}");
        let film = predicted(Extension::ViscousFilm, &[10.0]);
        assert!((film - steady_nm() - 0.06 * 10.0 * 0.18).abs() < 1e-4, "r · 10 N·s/m · v: {film}");
        let fade = predicted(Extension::ThermalFade, &[1e-2, 5.0, 0.0, 50.0, 0.5, 1.0]);
        assert!(fade < 0.99 * steady_nm(), "it heats up: {fade}");
    }

    #[test]
    fn the_prediction_passes_a_butterworth_like_the_amplifiers() {
        let lowpass = Lowpass::new(1000.0, TICK_S);
        for (hz, gain) in [(10.0, 1.0), (1000.0, core::f32::consts::FRAC_1_SQRT_2), (4000.0, 0.013)] {
            let mut state = LowpassState::default();
            let mut largest = 0.0_f32;
            for k in 0..20_000_u32 {
                // A phase step that is no fraction of the period samples the whole sine.
                let phase = TAU * ((k as f32 * hz * TICK_S) % 1.0);
                let y = lowpass.step(&mut state, libm::sinf(phase));
                largest = if k > 1000 { largest.max(y) } else { largest };
            }
            assert!((largest - gain).abs() < 0.04, "{hz} Hz: {largest}");
        }
        let mut state = LowpassState::default();
        let all: [f32; 3] = [1.0, -2.0, 3.0];
        assert_eq!(all.map(|x| Lowpass::new(0.0, TICK_S).step(&mut state, x)), all);
    }

    #[test]
    fn a_residual_that_is_not_a_number_starts_the_observer_again_from_rest() {
        let settings = ControlSettings::default();
        let observer = Observer::new(&settings.observer, 0.06, TICK_S).unwrap();
        let mut state = observer.fresh();
        let fine = ExtendedInput { disc_speed_rad_s: 3.0, disc_angle_rad: 0.0, normal_force_n: 88.0 };
        assert_eq!(observer.step(&mut state, &fine, f32::NAN), Observed::default());
        for _ in 0..1000 {
            assert!(observer.step(&mut state, &fine, 1.0).mean_square_nm2.is_finite());
        }
    }
}
