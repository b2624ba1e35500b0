//! Which parameters of the baseline are refitted with every candidate, and between which bounds.
//!
//! The road factor stays as it is (a0 and a1 carry it). Bristle damping stays where the file has none.
//! The friction channel may be late by up to a sample against the motion: logs are not sampled at one
//! instant, and nobody calls that an effect.

use super::model::ContactModel;
use crate::files::model_file::ModelKind;
use crate::fit::bounds::Parameter;

/// Name of the nuisance parameter for the channel's lateness.
pub const LATE: &str = "channel_late_s";

/// Free parameters of a baseline, starting from the model's values.
pub fn parameters(model: &ContactModel, step_s: f64) -> Vec<Parameter> {
    let mut free = Vec::new();
    for (name, value) in &model.parameters {
        if let Some(parameter) = parameter(model.kind, name, *value) {
            free.push(parameter);
        }
    }
    let most_s = (0.5 * step_s).max(1e-3);
    free.push(Parameter::linear(LATE, model.late_s.clamp(-most_s, most_s), -most_s, most_s));
    free
}

/// Factors on the start values for further starts. A block with too little damping sticks and slips, and
/// a search that starts there finds its way out only by chance, so the damping is also started high. Soft
/// bristles are tried because a record of an elastic element wants them.
pub fn other_starts(kind: ModelKind) -> &'static [&'static [(&'static str, f64)]] {
    match kind {
        ModelKind::Series => &[&[("c_u_n_s_per_m", 2.0)], &[("c_u_n_s_per_m", 4.0), ("k_u_n_per_m", 1.3)]],
        ModelKind::Lugre | ModelKind::ModifiedLugre => &[&[("sigma0_n_per_m", 3e-3)]],
        ModelKind::Brush => &[&[("c_n_per_m", 0.1)]],
        _ => &[],
    }
}

fn parameter(kind: ModelKind, name: &str, value: f64) -> Option<Parameter> {
    let log = |low: f64, high: f64| Some(Parameter::logarithmic(name, value.clamp(low, high), low, high));
    let linear = |low: f64, high: f64| Some(Parameter::linear(name, value.clamp(low, high), low, high));
    match name {
        "a0" => log(0.02, 5.0),
        "a1" => linear(0.0, 4.0),
        "v0_m_s" => log(2e-3, 10.0),
        "a2_s_per_m" => linear(0.0, 3.0),
        "sigma0_n_per_m" => log(1e4, 1e9),
        "sigma1_n_s_per_m" if value > 0.0 && kind != ModelKind::ModifiedLugre => log(1e-1, 1e5),
        "k_u_n_per_m" => log(1e3, 1e6),
        "c_u_n_s_per_m" => log(2.0, 1e4),
        "c_n_per_m" => log(1e3, 1e9),
        "mu_s" | "mu_c" => log(0.02, 5.0),
        _ => None,
    }
}
