//! One sub-step of the plant, and when a control period needs many of them.
//!
//! Order: normal load and M2's torque (exact), half a kick of the disc, elements at the speed of the middle, half a
//! kick, bridges.
//!
//! The element's own step is of first order in the normal force it is given and in the instant at which it breaks
//! loose, and a break shifted by 60 µs already costs 1e-3 of the torque's RMS over a 10 s experiment. So a period
//! is *busy*, and is divided finely, where the last one changed the load or the tip's speed by more than a small
//! part, or where a torque command steps. All else is calm. The choice depends on the state alone, so a run
//! repeats to the last bit.

use super::PERIOD_S;
use super::bridge::{Bridge, BridgeState};
use super::disc::{Disc, DiscState};
use super::elements::{Elements, ElementsState};
use super::hands::Hands;
use super::normal_load::{NormalLoad, NormalLoadState};
use super::parameters::PlantParameters;
use model_core::error::ParameterError;
use model_core::real::Real;

/// Everything that changes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct State {
    pub(super) normal_load: NormalLoadState,
    pub(super) m2_torque_nm: f64,
    pub(super) disc: DiscState,
    pub(super) elements: ElementsState,
    pub(super) friction_torque_nm: f64,
    pub(super) sliding_speed_m_s: f64,
    pub(super) bridges: [BridgeState; 2],
}

/// The plant's parts, prepared for one number of sub-steps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Grid {
    pub(super) substeps: u32,
    pub(super) step_s: f64,
    pub(super) normal_load: NormalLoad,
    /// Decay of M2's torque over half a sub-step.
    m2_half_decay: f64,
    m2_lag_s: f64,
    elements: Elements,
    pub(super) bridges: [Bridge; 2],
}

impl Grid {
    pub(super) fn new(p: &PlantParameters, substeps: u32) -> Result<Self, ParameterError> {
        let step_s = PERIOD_S / f64::from(substeps);
        Ok(Self {
            substeps,
            step_s,
            normal_load: NormalLoad::new(p, step_s),
            m2_half_decay: Real::exp(-0.5 * step_s / p.m2.lag_s()),
            m2_lag_s: p.m2.lag_s(),
            elements: Elements::new(&p.elements, p.load_shares, step_s)?.with_effects(
                &p.elements,
                p.effects,
                p.geometry.friction_radius_m,
                step_s,
            )?,
            bridges: [&p.friction_bridge, &p.normal_bridge].map(|b| Bridge::new(b, step_s)),
        })
    }

    /// At rest, with the elements lifted off.
    pub(super) fn rest(&self) -> State {
        State {
            normal_load: self.normal_load.rest(),
            m2_torque_nm: 0.0,
            disc: DiscState::default(),
            elements: self.elements.rest(),
            friction_torque_nm: 0.0,
            sliding_speed_m_s: 0.0,
            bridges: [BridgeState::default(); 2],
        }
    }

    #[inline]
    pub(super) fn advance(
        &self,
        disc: &Disc,
        radius_m: f64,
        s: &mut State,
        [m1_nm, m2_nm]: [f64; 2],
        (hands, hand_on_disc_nm): (&Hands, f64),
    ) {
        let h = self.step_s;
        self.normal_load.step(&mut s.normal_load, m1_nm, hands.m1_nm);
        let normal_force_n = s.normal_load.normal_force_n();
        // ∫ τ dt of a lag: u dt + T (τ − τ⁺).
        let mut impulse = || {
            let next = m2_nm + (s.m2_torque_nm - m2_nm) * self.m2_half_decay;
            let impulse = 0.5 * h * m2_nm + self.m2_lag_s * (s.m2_torque_nm - next);
            s.m2_torque_nm = next;
            impulse
        };
        let (first, second) = (impulse(), impulse());
        disc.kick(&mut s.disc, 0.5 * h, first, s.friction_torque_nm - hand_on_disc_nm);
        s.sliding_speed_m_s = s.disc.speed_rad_s * radius_m;
        let (speed_m_s, angle_rad) = (s.sliding_speed_m_s, s.disc.angle_rad);
        let force = self.elements.step(&mut s.elements, speed_m_s, angle_rad, normal_force_n);
        s.friction_torque_nm = force * radius_m;
        disc.drift(&mut s.disc, h);
        disc.kick(&mut s.disc, 0.5 * h, second, s.friction_torque_nm - hand_on_disc_nm);
        self.bridges[0].step(&mut s.bridges[0], s.friction_torque_nm + hands.friction_load_nm);
        self.bridges[1].step(&mut s.bridges[1], normal_force_n + hands.normal_load_n);
    }
}

/// What the last control period began with.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Activity {
    normal_force_n: f64,
    tip_speed_m_s: f64,
    commands_nm: [f64; 2],
}

impl Activity {
    /// Whether the period that begins needs the fine grid.
    #[inline]
    pub(super) fn is_busy(&mut self, s: &State, commands_nm: [f64; 2]) -> bool {
        let now = Self {
            normal_force_n: s.normal_load.normal_force_n(),
            tip_speed_m_s: s.elements.tip_speed_m_s,
            commands_nm,
        };
        let moved = |now: f64, before: f64, part: f64, floor: f64| {
            (now - before).abs() > part * (now.abs().min(before.abs()) + floor)
        };
        let busy = moved(now.normal_force_n, self.normal_force_n, 3e-3, 1.0)
            || moved(now.tip_speed_m_s, self.tip_speed_m_s, 2e-2, 1e-3)
            || commands_nm.iter().zip(self.commands_nm).any(|(now, before)| moved(*now, before, 0.02, 1.0));
        *self = now;
        busy
    }
}
