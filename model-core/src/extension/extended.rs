//! A friction model with effects around it, from measured motion and load to the torque that the
//! friction channel shows.
//!
//! v = r ω (corrected for the encoder), F_N (corrected for drift) → road factor, creep → friction model
//! → torque r (F + F_film) → the friction channel, a [`SensorChain`].
//!
//! Effects that depend on the force or the tip's speed take those of the step before.

use super::channel::{AtRest, ChannelState, Moving};
use super::rubber_relaxation::{BRANCHES, Creep};
use super::set::Extensions;
use super::static_ageing::StaticAgeing;
use super::thermal_fade::Heat;
use super::wear_drift::Distance;
use crate::error::{ParameterError, require};
use crate::friction::{Contact, FrictionForce, FrictionModel, FrictionState};
use crate::real::Real;
use crate::sensor::{SensorChain, SensorUndo};

/// What is measured over one step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExtendedInput<T> {
    /// Speed of the disc, mean over the step, rad/s.
    pub disc_speed_rad_s: T,
    /// Angle of the disc at the end of the step, rad.
    pub disc_angle_rad: T,
    /// Normal force at the end of the step, N.
    pub normal_force_n: T,
}

/// What the extended model says.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct ExtendedOutput<T> {
    /// Friction torque on the disc, N·m.
    pub torque_nm: T,
    /// What the friction channel shows of it, N·m.
    pub shown_nm: T,
}

/// A friction model with its effects, prepared for a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtendedFriction<T> {
    friction: FrictionModel<T>,
    effects: Extensions<T>,
    radius_m: T,
}

/// State of an extended model; the channel, which remembers many samples, last.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct ExtendedState<T> {
    friction: FrictionState<T>,
    force_n: T,
    tip_speed_m_s: T,
    time_s: T,
    time_missing_s: T,
    heat_j: Heat<T>,
    distance: Distance<T>,
    age_s: T,
    creep_m: Creep<T>,
    channel: ChannelState<T>,
}

impl<T: Real> ExtendedState<T> {
    /// State of the friction model inside.
    pub fn friction(&self) -> FrictionState<T> {
        self.friction
    }

    /// Sliding speed at the road: of the block's tip, or the root's where there is no block, m/s.
    pub fn tip_speed_m_s(&self) -> T {
        self.tip_speed_m_s
    }
}

impl<T: Real> ExtendedFriction<T> {
    /// A model whose elements touch the disc at `radius_m`. Model and effects are prepared for the same
    /// step.
    pub fn new(
        friction: FrictionModel<T>,
        effects: Extensions<T>,
        radius_m: T,
    ) -> Result<Self, ParameterError> {
        let allowed = radius_m > T::ZERO && radius_m <= T::from_f64(100.0);
        let radius_m = require("friction_radius_m", radius_m, allowed, "0 to 100 m")?;
        Ok(Self { friction, effects, radius_m })
    }

    /// Changes the step size, s, for unevenly sampled inputs. The caller keeps it positive.
    pub fn set_step_s(&mut self, step_s: T) {
        self.friction.set_step_s(step_s);
        self.effects.set_step_s(step_s);
    }

    /// The state in which the friction channel shows `shown_nm` at the given input, as far as the load can
    /// carry it; cold and unworn.
    pub fn holding(&self, shown_nm: T, input: &ExtendedInput<T>) -> ExtendedState<T> {
        let contact = self.contact(input, T::ZERO, T::ONE);
        let torque_nm = self.at_rest(T::ZERO, input.normal_force_n).undo(shown_nm);
        ExtendedState {
            friction: self.friction.holding(torque_nm / self.radius_m, &contact),
            force_n: torque_nm / self.radius_m,
            tip_speed_m_s: contact.sliding_speed_m_s,
            time_s: T::ZERO,
            time_missing_s: T::ZERO,
            heat_j: [T::ZERO; 2],
            distance: Distance::default(),
            age_s: self.effects.static_ageing.as_ref().map_or(T::ZERO, StaticAgeing::first_age_s),
            creep_m: [T::ZERO; BRANCHES],
            channel: ChannelState::holding(torque_nm, shown_nm),
        }
    }

    /// Takes the element anew from what the friction channel shows at rest: a stuck element holds what it
    /// stuck with, and that depends on how it came to rest more finely than a model can follow. Heat,
    /// wear, age and creep stay as they are.
    pub fn hold(&self, state: &mut ExtendedState<T>, shown_nm: T, input: &ExtendedInput<T>) {
        let torque_nm = self.at_rest(state.time_s, input.normal_force_n).undo(shown_nm);
        let mut contact = self.contact(input, state.time_s, T::ONE);
        // What the load can carry includes what the effects make of friction.
        contact.road_factor = self.road_factor(state, &contact, input.disc_angle_rad);
        state.force_n = torque_nm / self.radius_m;
        state.friction = self.friction.holding(state.force_n, &contact);
    }

    fn at_rest(&self, time_s: T, normal_force_n: T) -> AtRest<'_, T> {
        AtRest { effects: &self.effects, time_s, normal_force_n }
    }

    #[inline]
    fn contact(&self, input: &ExtendedInput<T>, time_s: T, road_factor: T) -> Contact<T> {
        let mut sliding_speed_m_s = self.radius_m * input.disc_speed_rad_s;
        if let Some(encoder) = &self.effects.encoder_eccentricity {
            sliding_speed_m_s = sliding_speed_m_s * encoder.speed_factor(input.disc_angle_rad);
        }
        let normal_force_n = match &self.effects.bridge_drift {
            Some(drift) => drift.true_normal_force_n(input.normal_force_n, time_s),
            None => input.normal_force_n,
        };
        Contact { sliding_speed_m_s, normal_force_n, road_factor }
    }

    #[inline]
    fn road_factor(&self, state: &ExtendedState<T>, contact: &Contact<T>, disc_angle_rad: T) -> T {
        let effects = &self.effects;
        let mut factor = T::ONE;
        if let Some(thermal) = &effects.thermal_fade {
            factor = factor * thermal.factor(&state.heat_j);
        }
        if let Some(wear) = &effects.wear_drift {
            factor = factor * wear.factor(&state.distance);
        }
        if let Some(disc) = &effects.disc_angle {
            factor = factor * disc.factor(disc_angle_rad);
        }
        if let Some(load) = &effects.load_dependence {
            factor = factor * load.factor(contact.normal_force_n);
        }
        if let Some(ageing) = &effects.static_ageing {
            factor = factor * ageing.factor(state.age_s);
        }
        if let Some(asymmetry) = &effects.direction_asymmetry {
            factor = factor * asymmetry.factor(state.force_n, state.tip_speed_m_s);
        }
        if let Some(bell) = &effects.bell_curve {
            factor = factor * bell.factor(state.tip_speed_m_s);
        }
        factor
    }

    /// Advances everything by one step.
    #[inline]
    pub fn step(&self, state: &mut ExtendedState<T>, input: &ExtendedInput<T>) -> ExtendedOutput<T> {
        self.step_filtered(state, input, |torque_nm| torque_nm)
    }

    /// The same with the low-pass of the friction channel's amplifier, which is no effect but the rig's: `low_pass` takes a step.
    #[inline]
    pub fn step_filtered(
        &self,
        state: &mut ExtendedState<T>,
        input: &ExtendedInput<T>,
        low_pass: impl FnMut(T) -> T,
    ) -> ExtendedOutput<T> {
        let mut friction = state.friction;
        let force = |contact: &Contact<T>| self.friction.step(&mut friction, contact);
        let output = self.step_around(state, input, force, low_pass);
        state.friction = friction;
        output
    }

    /// The same around a contact that the caller computes: `contact_force` gives the friction force of all of it.
    #[inline]
    pub(crate) fn step_around(
        &self,
        state: &mut ExtendedState<T>,
        input: &ExtendedInput<T>,
        contact_force: impl FnOnce(&Contact<T>) -> FrictionForce<T>,
        low_pass: impl FnMut(T) -> T,
    ) -> ExtendedOutput<T> {
        let effects = &self.effects;
        let step_s = effects.step_s();
        let piece = step_s + state.time_missing_s;
        let time_s = state.time_s + piece;
        state.time_missing_s = piece - (time_s - state.time_s);
        state.time_s = time_s;

        let mut contact = self.contact(input, time_s, T::ONE);
        contact.road_factor = self.road_factor(state, &contact, input.disc_angle_rad);
        let root_speed_m_s = contact.sliding_speed_m_s;
        if let Some(relaxation) = &effects.rubber_relaxation {
            let creep = relaxation.advance(&mut state.creep_m, state.force_n, step_s);
            contact.sliding_speed_m_s = root_speed_m_s - creep;
        }
        let friction = contact_force(&contact);
        state.force_n = friction.force_n;
        state.tip_speed_m_s = friction.tip_speed_m_s;
        if let Some(thermal) = &effects.thermal_fade {
            thermal.advance(&mut state.heat_j, friction.force_n * friction.tip_speed_m_s, step_s);
        }
        if effects.wear_drift.is_some() {
            state.distance.add(friction.tip_speed_m_s.abs() * step_s);
        }
        if let Some(ageing) = &effects.static_ageing {
            ageing.advance(&mut state.age_s, friction.tip_speed_m_s, step_s);
        }
        let film_n = effects.viscous_film.as_ref().map_or(T::ZERO, |film| film.force_n(root_speed_m_s));
        let torque_nm = self.radius_m * (friction.force_n + film_n);
        let mut channel = Moving {
            effects,
            state: &mut state.channel,
            time_s,
            normal_force_n: input.normal_force_n,
            low_pass,
        };
        ExtendedOutput { torque_nm, shown_nm: channel.show(torque_nm) }
    }
}

#[cfg(test)]
mod tests {
    use super::super::set::Extension;
    use super::*;
    use crate::friction::lugre::LugreParameters;
    use crate::friction::stribeck::StribeckParameters;

    const STEP_S: f64 = 1e-4;
    const RADIUS_M: f64 = 0.06;

    fn model(effects: &[(Extension, &[f64])]) -> ExtendedFriction<f64> {
        let stribeck = StribeckParameters { a0: 0.5, a1: 0.7, v0_m_s: 0.5, delta: 0.5, theta: 1.0 };
        let p = LugreParameters { sigma0_n_per_m: 1.76e7, sigma1_n_s_per_m: 0.0, a2_s_per_m: 0.0, stribeck };
        let mut set = Extensions::none(STEP_S);
        for (extension, values) in effects {
            set.set(*extension, values).unwrap();
        }
        ExtendedFriction::new(FrictionModel::lugre(&p, STEP_S).unwrap(), set, RADIUS_M).unwrap()
    }

    fn slide(
        model: &ExtendedFriction<f64>,
        speed_rad_s: f64,
        load_n: f64,
        seconds: f64,
    ) -> ExtendedOutput<f64> {
        let mut input =
            ExtendedInput { disc_speed_rad_s: speed_rad_s, disc_angle_rad: 0.0, normal_force_n: load_n };
        let mut state = model.holding(0.0, &input);
        let mut out = ExtendedOutput::default();
        for _ in 0..(seconds / STEP_S).round() as usize {
            input.disc_angle_rad += speed_rad_s * STEP_S;
            out = model.step(&mut state, &input);
        }
        out
    }

    #[test]
    fn without_effects_it_is_the_friction_model() {
        let out = slide(&model(&[]), 5.0, 88.0, 0.5);
        let g = 0.5 + 0.7 * (-(0.3f64 / 0.5).sqrt()).exp();
        // The bristles settle within microseconds.
        assert!((out.torque_nm - RADIUS_M * 88.0 * g).abs() < 1e-12);
        assert_eq!(out.torque_nm, out.shown_nm);
    }

    #[test]
    fn contact_effects_change_the_torque_and_channel_effects_only_what_is_shown() {
        let plain = slide(&model(&[]), 5.0, 88.0, 2.0);
        let contact: [(Extension, &[f64]); 8] = [
            (Extension::ThermalFade, &[1e-3, 5.0, 0.0, 50.0, 0.5, 1.0]),
            (Extension::WearDrift, &[0.1, 100.0]),
            (Extension::LoadDependence, &[0.1, 50.0, 0.0]),
            (Extension::StaticAgeing, &[0.1, 1e-3, 1e-3, 0.0]),
            (Extension::DirectionAsymmetry, &[0.1, 0.05, 0.5, 0.5]),
            (Extension::BellCurve, &[0.5, 0.2, 1.0, 1.0, 5.0]),
            (Extension::ViscousFilm, &[10.0]),
            (
                Extension::DiscAngle,
                &[
                    0.0, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0,
                    0.0, 0.0, 0.0,
                ],
            ),
        ];
        for effect in contact {
            let out = slide(&model(&[effect]), 5.0, 88.0, 2.0);
            assert!((out.torque_nm / plain.torque_nm - 1.0).abs() > 1e-3, "{:?}", effect.0);
            assert_eq!(out.torque_nm, out.shown_nm);
        }
        let channel: [(Extension, &[f64], f64); 4] = [
            (Extension::BridgeCrosstalk, &[0.01, 0.0], plain.torque_nm + 0.88),
            (Extension::BridgeDrift, &[0.1, 0.01, 0.0, 0.0, 0.0], plain.torque_nm * 1.02 + 0.2),
            (Extension::AdcSaturation, &[-3.0, 3.0], 3.0),
            (Extension::FrictionDelay, &[0.01], plain.torque_nm),
        ];
        for (extension, values, shown) in channel {
            let out = slide(&model(&[(extension, values)]), 5.0, 88.0, 2.0);
            assert_eq!(out.torque_nm, plain.torque_nm);
            assert!((out.shown_nm - shown).abs() < 1e-9, "{extension:?} {}", out.shown_nm);
        }
    }

    #[test]
    fn a_delayed_channel_shows_a_start_late_and_a_soft_ring_overshoots_it() {
        let late = slide(&model(&[(Extension::FrictionDelay, &[0.02])]), 5.0, 88.0, 0.019);
        assert_eq!(late.shown_nm, 0.0);
        let ring: (Extension, &[f64]) = (Extension::RingResonance, &[100.0, 0.02]);
        let half_period = slide(&model(&[ring]), 5.0, 88.0, 0.005);
        assert!((half_period.shown_nm / half_period.torque_nm - 1.94).abs() < 0.02);
    }

    #[test]
    fn drift_of_the_normal_bridge_is_taken_off_the_load() {
        let drift: (Extension, &[f64]) = (Extension::BridgeDrift, &[0.0, 0.0, 4.0, 0.0, 0.0]);
        let drifted = slide(&model(&[drift]), 5.0, 96.0, 2.0);
        let plain = slide(&model(&[]), 5.0, 88.0, 2.0);
        // The bristles lag the falling load by e^-6.6 of a step's change, 5e-6 of it.
        assert!((drifted.torque_nm / plain.torque_nm - 1.0).abs() < 1e-7);
    }

    #[test]
    fn relaxing_rubber_gives_way_under_a_held_force() {
        let effect: (Extension, &[f64]) = (Extension::RubberRelaxation, &[1e5, 0.05, 1e12, 1.0, 1e12, 1.0]);
        let model = model(&[effect]);
        let input = ExtendedInput { disc_speed_rad_s: 0.0, disc_angle_rad: 0.0, normal_force_n: 88.0 };
        let mut state = model.holding(2.0, &input);
        let first = model.step(&mut state, &input).torque_nm;
        let mut last = first;
        for _ in 0..10_000 {
            last = model.step(&mut state, &input).torque_nm;
        }
        assert!(last < 0.6 * first && last >= 0.0, "{first} {last}");
    }
}
