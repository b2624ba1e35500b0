//! The baseline that a model file asks for: which numbers are free, and how sure the file is of them.

use super::problem::{BaseParameter, Baseline, Numbers, Role};
use crate::files::model_file::{ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::identify::bridge_zero;
use crate::identify::term::Parameter;

/// A model file's numbers are known within 20 %.
pub const KNOWN_WITHIN: f64 = 0.2;
/// Bristles' stiffness is known within a factor of two: what slides does not show it.
const BRISTLES_WITHIN: f64 = 0.7;
/// The channels of a log are sampled within 0.2 ms of each other.
const LATE_MS: f64 = 0.2;
/// Brush friction falls from its static to its kinetic value over this speed, m/s: a step, for every motion that is seen.
const BRUSH_STEP_M_S: f64 = 1e-4;

/// The baseline of a model file; `within` is how sure its numbers are.
pub fn baseline(model: &ModelFile, within: f64) -> Baseline {
    let get = |name: &str| model.get(name).unwrap_or(0.0);
    let theta = model.get("theta").unwrap_or(1.0);
    let block = has_block(model);
    let brush = model.kind == ModelKind::Brush;
    let numbers = if brush {
        Numbers {
            a0: get("mu_c"),
            a1: get("mu_s") - get("mu_c"),
            v0_m_s: BRUSH_STEP_M_S,
            delta: 1.0,
            a2_s_per_m: 0.0,
            stiffness_n_per_m: get("c_n_per_m"),
            damping_n_s_per_m: 0.0,
            bristles_n_per_m: f64::INFINITY,
            bristles_alone: false,
            slips_on: true,
            late_ms: 0.0,
            friction_zero_nm: 0.0,
            normal_zero_n: 0.0,
        }
    } else {
        Numbers {
            a0: theta * get("a0"),
            a1: theta * get("a1"),
            v0_m_s: get("v0_m_s"),
            delta: get("delta"),
            a2_s_per_m: get("a2_s_per_m"),
            stiffness_n_per_m: if block { get("k_u_n_per_m") } else { get("sigma0_n_per_m") },
            damping_n_s_per_m: if block { get("c_u_n_s_per_m") } else { get("sigma1_n_s_per_m") },
            bristles_n_per_m: if block { get("sigma0_n_per_m") } else { f64::INFINITY },
            bristles_alone: !block,
            slips_on: false,
            late_ms: 0.0,
            friction_zero_nm: 0.0,
            normal_zero_n: 0.0,
        }
    };
    let mut free = Vec::new();
    let mut add = |role, name: &str, value: f64, sd: f64| {
        if value > 0.0 {
            free.push(BaseParameter {
                role,
                parameter: Parameter { step: 0.01, reach: 0.3, ..Parameter::logarithm(name, value, sd) },
            });
        }
    };
    add(Role::A0, if brush { "mu_c" } else { "a0" }, numbers.a0, within);
    if brush {
        // Each of the two is known so well, and their difference as badly as that leaves it.
        add(Role::Static, "mu_s", get("mu_s"), within);
    } else {
        add(Role::A1, "a1", numbers.a1, within);
        add(Role::V0, "v0_m_s", numbers.v0_m_s, within);
        add(Role::Delta, "delta", numbers.delta, 0.5 * within);
        add(Role::A2, "a2_s_per_m", numbers.a2_s_per_m, 2.0 * within);
    }
    let (stiffness, damping, sure) = match (brush, block) {
        (_, true) => ("k_u_n_per_m", "c_u_n_s_per_m", within),
        (true, _) => ("c_n_per_m", "", BRISTLES_WITHIN),
        _ => ("sigma0_n_per_m", "sigma1_n_s_per_m", BRISTLES_WITHIN),
    };
    add(Role::Stiffness, stiffness, numbers.stiffness_n_per_m, sure);
    add(Role::Damping, damping, numbers.damping_n_s_per_m, sure);
    let late = Parameter {
        amplitude: false,
        step: 0.05,
        reach: 0.5,
        ..Parameter::amplitude("channel_late_ms", LATE_MS)
    };
    free.push(BaseParameter { role: Role::Late, parameter: late });
    Baseline { numbers, free }
}

impl Baseline {
    /// With the zeros of the bridges, which are known as well as bridges are.
    #[must_use]
    pub fn with_bridge_zeros(mut self, rig: &RigFile) -> Self {
        let [friction_nm, normal_n] = bridge_zero::standard_deviations(rig);
        for (role, name, sd) in [
            (Role::FrictionZero, "friction_zero_nm", friction_nm),
            (Role::NormalZero, "normal_zero_n", normal_n),
        ] {
            let (step, reach) = (0.5 * sd, sd);
            let parameter = Parameter { amplitude: false, step, reach, ..Parameter::amplitude(name, sd) };
            self.free.push(BaseParameter { role, parameter });
        }
        self
    }
}

/// Whether the model has a block in series with the slip.
pub fn has_block(model: &ModelFile) -> bool {
    model.get("k_u_n_per_m").is_some()
}
