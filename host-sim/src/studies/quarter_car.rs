//! The vehicle question: a quarter of a car brakes, by a pounce on the brake and by a slow ramp.
//!
//! m v̇ = −F,  J ω̇ = R F − T_b,  v_r = v − R ω, until the wheel is locked or the car stands. A locked wheel stays locked while the
//! brake holds more than R F. The contact patch of length L under F_N = m g is one of
//!
//! * averaged lumped LuGre: z̄˙ = v_r − σ0 |v_r| z̄/g(v_r) − κ R|ω| z̄, F = F_N (σ0 z̄ + a2 v_r), with the κ for which its steady state is
//!   that of the patch under uniform load, κ L = (1 − e^{−x})/(1 − (1 − e^{−x})/x), x = L/Z (between 1 and 2);
//! * LuGre patch, eqs. 15–16, under uniform or parabolic load;
//! * a patch of series elements: a row of rubber blocks, each in series with its bristles, that enter undeformed, are
//!   carried along and leave.
//!
//! σ0, a0, a1, v0 are the published set of Canudas de Wit et al. (Vehicle System Dynamics 39 (2003) 189); in the series patch the
//! block has that stiffness, its bristles a hundred times as much, and its damping time k_u/c_u is that of the rig's
//! assumed rubber. Mass, wheel and brake are assumed. Left out: suspension, load transfer, the tyre's belt and carcass.

use std::collections::VecDeque;

use model_core::error::ParameterError;
use model_core::friction::Contact;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::lugre_patch::{LugrePatch, PatchParameters, PatchState};
use model_core::friction::pressure::Pressure;
use model_core::friction::series::{Series, SeriesParameters, SeriesState};
use model_core::friction::stribeck::{Stribeck, StribeckParameters};

/// Quarter of a car, its wheel and brake (assumed).
const MASS_KG: f64 = 350.0;
const INERTIA_KG_M2: f64 = 1.0;
const RADIUS_M: f64 = 0.3;
const FIRST_SPEED_M_S: f64 = 25.0;
const G_M_S2: f64 = 9.81;
/// The brake ends at this part of what the largest friction would hold.
const BRAKE: f64 = 1.15;
/// Published set; σ0 per unit load.
const SIGMA0_PER_M: f64 = 181.54;
const LENGTH_M: f64 = 0.2;
const CURVE: StribeckParameters<f64> =
    StribeckParameters { a0: 0.8, a1: 0.75, v0_m_s: 6.57, delta: 0.5, theta: 1.0 };
/// c_u/k_u of the rig's assumed rubber.
const BLOCK_TIME_S: f64 = 160.0 / 3e4;
/// Bristles of the series patch, over the stiffness of its blocks.
const BRISTLES: f64 = 100.0;
const POINTS: usize = 40;
const STEP_S: f64 = 1e-4;
const LONGEST_S: f64 = 8.0;
/// Below this the car stands: friction has no more direction.
const STANDS_M_S: f64 = 0.5;

/// How the brake torque rises.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Braking {
    /// Within 20 ms.
    Pounce,
    /// Within 2 s.
    Ramp,
}

impl Braking {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Pounce, Self::Ramp];

    fn rise_s(self) -> f64 {
        match self {
            Self::Pounce => 0.02,
            Self::Ramp => 2.0,
        }
    }

    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Pounce => "pounce, 20 ms",
            Self::Ramp => "ramp, 2 s",
        }
    }
}

/// Which patch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PatchKind {
    /// Averaged lumped LuGre.
    Lumped,
    /// LuGre patch under uniform load.
    Lugre,
    /// LuGre patch under parabolic load.
    LugreParabolic,
    /// Row of series elements.
    Series,
}

impl PatchKind {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Lumped, Self::Lugre, Self::LugreParabolic, Self::Series];

    /// In words.
    #[must_use]
    pub fn words(self) -> &'static str {
        match self {
            Self::Lumped => "averaged lumped LuGre",
            Self::Lugre => "LuGre patch",
            Self::LugreParabolic => "LuGre patch, parabolic load",
            Self::Series => "series patch",
        }
    }
}

/// A patch with its state.
enum Patch {
    Lumped {
        curve: Stribeck<f64>,
        z_m: f64,
    },
    Lugre {
        patch: Box<LugrePatch<f64, POINTS>>,
        state: Box<PatchState<f64, POINTS>>,
        weights: Box<[f64; POINTS]>,
    },
    Series {
        element: Series<f64>,
        row: VecDeque<SeriesState<f64>>,
        carried_m: f64,
    },
}

impl Patch {
    fn new(kind: PatchKind, load_n: f64) -> Result<Self, ParameterError> {
        let lugre = |pressure: Pressure<f64>| -> Result<Self, ParameterError> {
            let parameters = PatchParameters {
                sigma0_per_m: SIGMA0_PER_M,
                a2_s_per_m: 0.0,
                stribeck: CURVE,
                length_m: LENGTH_M,
                largest_transport_speed_m_s: 2.0 * FIRST_SPEED_M_S,
            };
            let patch = Box::new(LugrePatch::new(&parameters, STEP_S)?);
            let weights = Box::new(pressure.checked()?.weights());
            Ok(Self::Lugre { patch, state: Box::default(), weights })
        };
        match kind {
            PatchKind::Lumped => Ok(Self::Lumped { curve: Stribeck::new(&CURVE)?, z_m: 0.0 }),
            PatchKind::Lugre => lugre(Pressure::Uniform),
            PatchKind::LugreParabolic => lugre(Pressure::Parabolic),
            PatchKind::Series => {
                let k_u_n_per_m = SIGMA0_PER_M * load_n / POINTS as f64;
                let bristles = LugreParameters {
                    sigma0_n_per_m: BRISTLES * k_u_n_per_m,
                    sigma1_n_s_per_m: 0.0,
                    a2_s_per_m: 0.0,
                    stribeck: CURVE,
                };
                let block =
                    SeriesParameters { k_u_n_per_m, c_u_n_s_per_m: BLOCK_TIME_S * k_u_n_per_m, bristles };
                let row = (0..POINTS).map(|_| SeriesState::default()).collect();
                Ok(Self::Series { element: Series::new(&block, STEP_S)?, row, carried_m: 0.0 })
            }
        }
    }

    /// Friction force after a step.
    fn step(&mut self, sliding_m_s: f64, rolling_m_s: f64, load_n: f64) -> f64 {
        let contact = Contact::new(sliding_m_s, load_n);
        match self {
            Self::Lumped { curve, z_m } => {
                let slides = SIGMA0_PER_M * sliding_m_s.abs() / curve.coefficient(sliding_m_s);
                let x = LENGTH_M * slides / rolling_m_s.abs().max(1e-9);
                let gone = -(-x).exp_m1();
                // Series for little slip, where numerator and denominator vanish together.
                let kappa = if x < 1e-3 { 2.0 } else { gone / (1.0 - gone / x) } / LENGTH_M;
                let rate = slides + kappa * rolling_m_s.abs();
                *z_m += -(-STEP_S * rate).exp_m1() * (sliding_m_s / rate.max(1e-12) - *z_m);
                load_n * SIGMA0_PER_M * *z_m
            }
            Self::Lugre { patch, state, weights } => {
                patch.step(state, &contact, rolling_m_s);
                patch.force_under_n(state, &contact, weights)
            }
            Self::Series { element, row, carried_m } => {
                let spacing = LENGTH_M / POINTS as f64;
                *carried_m += rolling_m_s * STEP_S;
                while *carried_m >= spacing {
                    *carried_m -= spacing;
                    row.pop_back();
                    row.push_front(SeriesState::default());
                }
                let each = Contact::new(sliding_m_s, load_n / POINTS as f64);
                row.iter_mut().map(|state| element.step(state, &each).force_n).sum()
            }
        }
    }
}

/// A braking.
#[derive(Debug, Clone, PartialEq)]
pub struct Stop {
    /// Patch.
    pub patch: PatchKind,
    /// Brake.
    pub braking: Braking,
    /// Time of each sample, 1 ms apart.
    pub time_s: Vec<f64>,
    /// Car.
    pub speed_m_s: Vec<f64>,
    /// Wheel's rim.
    pub rim_m_s: Vec<f64>,
    /// F/F_N.
    pub coefficient: Vec<f64>,
    /// Largest F/F_N until the wheel locks, of every step.
    pub peak: f64,
    /// Slip (v − Rω)/v there.
    pub slip_at_peak: f64,
    /// Speed of the car there.
    pub speed_at_peak_m_s: f64,
    /// When the wheel locks, and how fast the car is then; `None` where it does not.
    pub lock: Option<(f64, f64)>,
    /// Way from the begin of braking to standstill.
    pub distance_m: f64,
}

/// Brakes a quarter of a car.
///
/// # Errors
/// A parameter out of range.
pub fn brake(kind: PatchKind, braking: Braking) -> Result<Stop, ParameterError> {
    let load_n = MASS_KG * G_M_S2;
    let mut patch = Patch::new(kind, load_n)?;
    let full_nm = BRAKE * load_n * RADIUS_M * (CURVE.a0 + CURVE.a1);
    let (mut v, mut omega, mut distance_m) = (FIRST_SPEED_M_S, FIRST_SPEED_M_S / RADIUS_M, 0.0);
    let mut stop = Stop {
        patch: kind,
        braking,
        time_s: Vec::new(),
        speed_m_s: Vec::new(),
        rim_m_s: Vec::new(),
        coefficient: Vec::new(),
        peak: 0.0,
        slip_at_peak: 0.0,
        speed_at_peak_m_s: FIRST_SPEED_M_S,
        lock: None,
        distance_m: 0.0,
    };
    for k in 0..(LONGEST_S / STEP_S) as usize {
        let t = k as f64 * STEP_S;
        let rim = RADIUS_M * omega;
        let force_n = patch.step(v - rim, rim, load_n);
        let coefficient = force_n / load_n;
        // A locked wheel only slides: what it shows later is the curve at low speed.
        if stop.lock.is_none() && coefficient > stop.peak {
            (stop.peak, stop.slip_at_peak, stop.speed_at_peak_m_s) = (coefficient, (v - rim) / v, v);
        }
        if k % 10 == 0 {
            stop.time_s.push(t);
            stop.speed_m_s.push(v);
            stop.rim_m_s.push(rim);
            stop.coefficient.push(coefficient);
        }
        let brake_nm = full_nm * (t / braking.rise_s()).min(1.0);
        distance_m += STEP_S * v;
        v -= STEP_S * force_n / MASS_KG;
        let free = omega + STEP_S * (RADIUS_M * force_n - brake_nm) / INERTIA_KG_M2;
        // A brake only holds: it never turns the wheel backwards.
        omega = free.max(0.0);
        if omega == 0.0 && stop.lock.is_none() {
            stop.lock = Some((t, v));
        }
        if v < STANDS_M_S {
            break;
        }
    }
    stop.distance_m = distance_m;
    Ok(stop)
}

/// Most that a LuGre patch under uniform load gives in steady slip at a speed of the car, F/F_N, by the closed form.
#[must_use]
pub fn most_steady(speed_m_s: f64) -> f64 {
    let steady = |slip: f64| {
        let (v, roll) = (slip * speed_m_s, (1.0 - slip) * speed_m_s);
        let g = CURVE.a0 + CURVE.a1 * (-(v / CURVE.v0_m_s).powf(CURVE.delta)).exp();
        let reach = g * roll / (SIGMA0_PER_M * v * LENGTH_M);
        g * (1.0 + reach * (-1.0 / reach).exp_m1())
    };
    (1..1000).map(|k| steady(f64::from(k) * 1e-3)).fold(0.0, f64::max)
}

impl Stop {
    /// The peak over [`most_steady`] at the speed that the car had then, less one.
    #[must_use]
    pub fn over_steady(&self) -> f64 {
        self.peak / most_steady(self.speed_at_peak_m_s) - 1.0
    }
}

/// Every patch with both brakings.
///
/// # Errors
/// A parameter out of range.
pub fn all() -> Result<Vec<Stop>, ParameterError> {
    use rayon::prelude::*;
    let both = PatchKind::ALL.into_iter().flat_map(|kind| Braking::ALL.map(|braking| (kind, braking)));
    both.collect::<Vec<_>>().into_par_iter().map(|(kind, braking)| brake(kind, braking)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lumped_patch_settles_where_the_distributed_one_does() {
        let load_n = 3000.0;
        for (v, roll) in [(0.05, 20.0), (0.5, 10.0), (3.0, 3.0)] {
            let settled = |kind| {
                let mut patch = Patch::new(kind, load_n).unwrap();
                (0..20_000).map(|_| patch.step(v, roll, load_n)).last().unwrap()
            };
            let (lumped, patch) = (settled(PatchKind::Lumped), settled(PatchKind::Lugre));
            let g = CURVE.a0 + CURVE.a1 * (-(v / CURVE.v0_m_s).sqrt()).exp();
            let reach = g * roll / (SIGMA0_PER_M * v * LENGTH_M);
            let exact = load_n * g * (1.0 - reach * (1.0 - (-1.0 / reach).exp()));
            assert!((lumped / exact - 1.0).abs() < 1e-3, "{v} {roll}: {lumped} {exact}");
            // Forty points carry as much as the integral to a fortieth.
            assert!((patch / exact - 1.0).abs() < 0.03, "{v} {roll}: {patch} {exact}");
        }
    }

    #[test]
    fn speed_lost_is_friction_over_mass_and_a_locked_wheel_slides_on_the_curve() {
        for kind in PatchKind::ALL {
            let stop = brake(kind, Braking::Pounce).unwrap();
            let lost: f64 = stop.coefficient.iter().map(|c| c * G_M_S2 * 1e-3).sum();
            assert!((lost / (FIRST_SPEED_M_S - STANDS_M_S) - 1.0).abs() < 5e-3, "{kind:?}: {lost}");
            let (at_s, _) = stop.lock.unwrap();
            let later = ((at_s + 0.3) * 1e3) as usize;
            let v = stop.speed_m_s[later];
            let g = CURVE.a0 + CURVE.a1 * (-(v / CURVE.v0_m_s).sqrt()).exp();
            assert!(
                (stop.coefficient[later] / g - 1.0).abs() < 0.01,
                "{kind:?}: {} {g}",
                stop.coefficient[later]
            );
        }
    }
}
