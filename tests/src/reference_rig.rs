//! The six experiments' rig as one system of ordinary differential equations in f64, solved by a
//! library at tight tolerance; what the product's plant is compared with.
//!
//! Commands are torques held over each control period. States, in this order of cause:
//! τ1' = (τ1c − τ1)/T1; ẍ + 2ζω ẋ + ω² x = ω² (gain τ1 − preload), F_N = max(0, x);
//! τ2' = (τ2c − τ2)/T2; J ω̇ = τ2 − r F − C tanh(ω/ω_c) − D ω; θ' = ω;
//! block and bristles in series: c_u u̇ = σ0 z − k_u u, v = r ω − u̇, ż = v − σ0 |v| z/(F_N g(v)),
//! F = σ0 z, g = a0 + a1 exp(−(|v|/v0)^δ); torque ring and amplifier: two second-order low-passes of r F.
//! Left out: σ1 and a2 (zero in the assumed rig), encoder, converters, noise, shaft compliance.
//! Solver: Dormand–Prince 8(5,3) per period; where a period is too stiff for it (hardly any normal force at
//! high speed), Radau IIA of order 5 in at least 16 steps, with its Newton tolerance set, since at the
//! library's own it stops short of the tolerance asked for (found by comparison with the other). Lengths are in µm (bristles) and mm (block) so that the solver's
//! scaling and finite differences are sound.

use differential_equations::prelude::{ExplicitRungeKutta, IVP, ImplicitRungeKutta, ODE};
use serde::Serialize;

/// Numbers of the rig; the default is the assumed rig.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[allow(missing_docs)]
pub struct ReferenceRig {
    pub period_s: f64,
    pub m1_lag_s: f64,
    pub lever_gain_n_per_nm: f64,
    pub preload_n: f64,
    pub pressure_mode_hz: f64,
    pub pressure_damping: f64,
    pub m2_lag_s: f64,
    pub inertia_kg_m2: f64,
    pub bearing_coulomb_nm: f64,
    pub bearing_turn_rad_s: f64,
    pub bearing_viscous_nm_s: f64,
    pub friction_radius_m: f64,
    pub k_u_n_per_m: f64,
    pub c_u_n_s_per_m: f64,
    pub sigma0_n_per_m: f64,
    pub a0: f64,
    pub a1: f64,
    pub v0_m_s: f64,
    pub delta: f64,
    pub ring_mode_hz: f64,
    pub ring_damping: f64,
    pub amplifier_hz: f64,
}

impl Default for ReferenceRig {
    fn default() -> Self {
        Self {
            period_s: 1e-4,
            m1_lag_s: 1e-3,
            lever_gain_n_per_nm: 30.0,
            preload_n: 8.0,
            pressure_mode_hz: 120.0,
            pressure_damping: 0.25,
            m2_lag_s: 1e-3,
            inertia_kg_m2: 0.02,
            bearing_coulomb_nm: 0.15,
            bearing_turn_rad_s: 0.01,
            bearing_viscous_nm_s: 0.005,
            friction_radius_m: 0.06,
            k_u_n_per_m: 3e4,
            c_u_n_s_per_m: 160.0,
            sigma0_n_per_m: 1.76e7,
            a0: 0.5,
            a1: 0.7,
            v0_m_s: 0.5,
            delta: 0.5,
            ring_mode_hz: 600.0,
            ring_damping: 0.02,
            amplifier_hz: 1000.0,
        }
    }
}

/// True state of the rig.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct ReferenceState {
    /// Torque of M1.
    pub m1_torque_nm: f64,
    /// Deflection of the pressure side as a force, < 0 where the elements are lifted.
    pub pressure_n: f64,
    /// Its rate.
    pub pressure_rate_n_s: f64,
    /// Torque of M2.
    pub m2_torque_nm: f64,
    /// Disc speed.
    pub speed_rad_s: f64,
    /// Disc angle.
    pub angle_rad: f64,
    /// Bristle deformation.
    pub bristle_m: f64,
    /// Block deformation.
    pub block_m: f64,
    /// Torque ring, and its rate.
    pub ring_nm: [f64; 2],
    /// Amplifier output, and its rate.
    pub amplifier_nm: [f64; 2],
    /// Friction torque on the disc.
    pub friction_torque_nm: f64,
}

impl ReferenceState {
    /// Normal force.
    #[must_use]
    pub fn normal_n(&self) -> f64 {
        self.pressure_n.max(0.0)
    }

    fn packed(&self) -> [f64; STATES] {
        [
            self.m1_torque_nm,
            self.pressure_n,
            self.pressure_rate_n_s * RATE,
            self.m2_torque_nm,
            self.speed_rad_s,
            self.angle_rad,
            self.bristle_m * MICRO,
            self.block_m * MILLI,
            self.ring_nm[0],
            self.ring_nm[1] * RATE,
            self.amplifier_nm[0],
            self.amplifier_nm[1] * RATE,
        ]
    }

    fn unpacked(y: &[f64; STATES], rig: &ReferenceRig) -> Self {
        let bristle_m = y[6] / MICRO;
        Self {
            m1_torque_nm: y[0],
            pressure_n: y[1],
            pressure_rate_n_s: y[2] / RATE,
            m2_torque_nm: y[3],
            speed_rad_s: y[4],
            angle_rad: y[5],
            bristle_m,
            block_m: y[7] / MILLI,
            ring_nm: [y[8], y[9] / RATE],
            amplifier_nm: [y[10], y[11] / RATE],
            friction_torque_nm: rig.friction_radius_m * rig.sigma0_n_per_m * bristle_m,
        }
    }
}

const STATES: usize = 12;
/// Bristles are kept in µm.
const MICRO: f64 = 1e6;
/// The block is kept in mm.
const MILLI: f64 = 1e3;
/// Rates of fast modes are kept per ms.
const RATE: f64 = 1e-3;
/// Normal force below which the bristles only spring back.
const LIFTED_N: f64 = 1e-3;
/// Time in which they do.
const SPRING_BACK_S: f64 = 1e-5;

/// The rig during one period.
struct Period<'a> {
    rig: &'a ReferenceRig,
    m1_command_nm: f64,
    m2_command_nm: f64,
}

impl ODE<f64, [f64; STATES]> for Period<'_> {
    fn diff(&self, _t: f64, y: &[f64; STATES], dydt: &mut [f64; STATES]) {
        let rig = self.rig;
        let mode = |hz: f64, ratio: f64, position: f64, rate: f64, input: f64| {
            let omega = std::f64::consts::TAU * hz;
            omega * omega * (input - position) - 2.0 * ratio * omega * rate
        };
        dydt[0] = (self.m1_command_nm - y[0]) / rig.m1_lag_s;
        let rate = y[2] / RATE;
        dydt[1] = rate;
        let pressed = rig.lever_gain_n_per_nm * y[0] - rig.preload_n;
        dydt[2] = RATE * mode(rig.pressure_mode_hz, rig.pressure_damping, y[1], rate, pressed);
        dydt[3] = (self.m2_command_nm - y[3]) / rig.m2_lag_s;

        let (bristle, block) = (y[6] / MICRO, y[7] / MILLI);
        let force = rig.sigma0_n_per_m * bristle;
        let block_rate = (force - rig.k_u_n_per_m * block) / rig.c_u_n_s_per_m;
        let v = rig.friction_radius_m * y[4] - block_rate;
        let speed = v.abs();
        let g = rig.a0 + rig.a1 * (-(speed / rig.v0_m_s).powf(rig.delta)).exp();
        dydt[6] =
            if y[1] < LIFTED_N { -y[6] / SPRING_BACK_S } else { MICRO * (v - force * speed / (y[1] * g)) };
        dydt[7] = MILLI * block_rate;

        let torque = rig.friction_radius_m * force;
        let bearing =
            rig.bearing_coulomb_nm * (y[4] / rig.bearing_turn_rad_s).tanh() + rig.bearing_viscous_nm_s * y[4];
        dydt[4] = (y[3] - torque - bearing) / rig.inertia_kg_m2;
        dydt[5] = y[4];

        let ring_rate = y[9] / RATE;
        dydt[8] = ring_rate;
        dydt[9] = RATE * mode(rig.ring_mode_hz, rig.ring_damping, y[8], ring_rate, torque);
        let amplifier_rate = y[11] / RATE;
        dydt[10] = amplifier_rate;
        let butterworth = std::f64::consts::FRAC_1_SQRT_2;
        dydt[11] = RATE * mode(rig.amplifier_hz, butterworth, y[10], amplifier_rate, y[8]);
    }
}

/// Which solver a period may use.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Solver {
    /// Explicit, and implicit where that fails.
    Automatic,
    /// Implicit throughout.
    Implicit,
}

impl ReferenceRig {
    /// The rig at rest without torque: elements lifted by the preload.
    #[must_use]
    pub fn at_rest(&self) -> ReferenceState {
        ReferenceState { pressure_n: -self.preload_n, ..ReferenceState::default() }
    }

    /// Runs the rig from `start` under two lists of torque commands of the same length. The answer has one
    /// state more than there are commands: entry k is the state when command k begins to act.
    ///
    /// # Errors
    /// Where a period cannot be solved to the tolerance; says which.
    pub fn run(
        &self,
        start: &ReferenceState,
        m1_commands_nm: &[f64],
        m2_commands_nm: &[f64],
        tolerance: f64,
        solver: Solver,
    ) -> Result<Vec<ReferenceState>, String> {
        let mut y = start.packed();
        let mut states = vec![ReferenceState::unpacked(&y, self)];
        for (k, (m1, m2)) in m1_commands_nm.iter().zip(m2_commands_nm).enumerate() {
            let period = Period { rig: self, m1_command_nm: *m1, m2_command_nm: *m2 };
            y = period.solve(y, tolerance, solver).map_err(|error| format!("period {k}: {error}"))?;
            states.push(ReferenceState::unpacked(&y, self));
        }
        Ok(states)
    }
}

impl Period<'_> {
    fn solve(&self, y: [f64; STATES], tolerance: f64, solver: Solver) -> Result<[f64; STATES], String> {
        let end = self.rig.period_s;
        if solver == Solver::Automatic {
            let method = ExplicitRungeKutta::dop853().rtol(tolerance).atol(tolerance).max_steps(400);
            let solution = IVP::ode(self, 0.0, end, y).method(method).solve();
            if let Some((t, last)) = solution.as_ref().ok().and_then(|s| s.last().ok())
                && (t - end).abs() < 1e-12
                && last.iter().all(|value| value.is_finite())
            {
                return Ok(*last);
            }
        }
        let method = ImplicitRungeKutta::radau5()
            .rtol(tolerance)
            .atol(tolerance)
            .newton_tol(1e-9)
            .h_max(end / 16.0)
            .max_steps(100_000);
        let solution =
            IVP::ode(self, 0.0, end, y).method(method).solve().map_err(|error| format!("{error:?}"))?;
        let (t, last) = solution.last().map_err(|error| error.to_string())?;
        if (t - end).abs() > 1e-12 || !last.iter().all(|value| value.is_finite()) {
            return Err(format!("stopped at {t} s of {end} s"));
        }
        Ok(*last)
    }
}
