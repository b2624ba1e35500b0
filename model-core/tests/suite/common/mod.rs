//! Parameters that several tests share.

use model_core::friction::lugre::LugreParameters;
use model_core::friction::stribeck::StribeckParameters;

/// LuGre bristles without damping and viscous friction.
pub(crate) fn bristles(a0: f64, a1: f64, v0: f64, delta: f64, sigma0: f64) -> LugreParameters<f64> {
    LugreParameters {
        sigma0_n_per_m: sigma0,
        sigma1_n_s_per_m: 0.0,
        a2_s_per_m: 0.0,
        stribeck: StribeckParameters { a0, a1, v0_m_s: v0, delta, theta: 1.0 },
    }
}
