//! Once-per-revolution errors of an encoder (`encoder_eccentricity`), θ the true angle.
//!
//! - exact: the code disc's centre is off the shaft's, read angle that of e^{iθ} + e·e^{iψ}:
//!   θ + arg(1 + e·e^{i(ψ − θ)});
//! - first order: θ + e sin(ψ − θ), its usual approximation (J. R. R. Mayer, IEEE Trans. Instrum. Meas. 43,
//!   1994);
//! - with tilt: first order, and e₂ sin(2(χ − θ)) of a disc that is not square to the shaft, e₂ ≤ e/4;
//! - reserved, bent: first order with a sharper half, e sin(ψ − θ + b sin(ψ − θ)) (grating stretched on one
//!   side by its glue).

use serde::Serialize;

use crate::laws::family::LawFamily;
use crate::random::Stream;

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
enum Error {
    Exact,
    FirstOrder,
    Tilt { second_rad: f64, second_phase_rad: f64 },
    Bent { bend: f64 },
}

/// The error.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct Eccentricity {
    #[serde(flatten)]
    error: Error,
    amplitude_rad: f64,
    phase_rad: f64,
}

impl Eccentricity {
    /// Draws one. The size is what a rig without an encoder of its own on the disc may have (a code wheel
    /// on a coupling); a mounted encoder's is a hundred times smaller and shows in no torque.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let amplitude_rad = s.log_uniform(0.025, 0.09);
        let error = match family.pick(s, &[0, 1, 2], 3) {
            0 => Error::Exact,
            1 => Error::FirstOrder,
            2 => {
                Error::Tilt { second_rad: amplitude_rad * s.uniform(0.1, 0.25), second_phase_rad: s.phase() }
            }
            _ => Error::Bent { bend: s.uniform(0.2, 0.5) },
        };
        Self { error, amplitude_rad, phase_rad: s.phase() }
    }

    /// Read angle at a true one.
    #[must_use]
    pub fn angle(&self, true_angle: f64) -> f64 {
        let (e, turn) = (self.amplitude_rad, self.phase_rad - true_angle);
        true_angle
            + match self.error {
                Error::Exact => (e * turn.sin()).atan2(1.0 + e * turn.cos()),
                Error::FirstOrder => e * turn.sin(),
                Error::Tilt { second_rad, second_phase_rad } => {
                    e * turn.sin() + second_rad * (2.0 * (second_phase_rad - true_angle)).sin()
                }
                Error::Bent { bend } => e * (turn + bend * turn.sin()).sin(),
            }
    }

    /// Read speed per true speed.
    #[must_use]
    pub fn rate(&self, true_angle: f64) -> f64 {
        let (e, turn) = (self.amplitude_rad, self.phase_rad - true_angle);
        let cosine = turn.cos();
        1.0 - match self.error {
            Error::Exact => (e * cosine + e * e) / (1.0 + 2.0 * e * cosine + e * e),
            Error::FirstOrder => e * cosine,
            Error::Tilt { second_rad, second_phase_rad } => {
                e * cosine + 2.0 * second_rad * (2.0 * (second_phase_rad - true_angle)).cos()
            }
            Error::Bent { bend } => e * (turn + bend * turn.sin()).cos() * (1.0 + bend * cosine),
        }
    }
}
