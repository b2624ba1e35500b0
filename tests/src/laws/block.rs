//! Laws of the rubber block in series with the bristles: its spring, and how it creeps.
//!
//! Spring, u the deformation (also that of the hidden block of `element_compliance`):
//! - linear: k u;
//! - cubic: k u (1 + ε u²) (A. E. Green's and J. E. Adkins' *Large Elastic Deformations*, 1960: simple
//!   shear beyond Mooney and Rivlin);
//! - Payne: k u (1 − d + d/(1 + (u/u0)²)), filled rubber softens with amplitude (A. R. Payne, J. Appl.
//!   Polym. Sci. 6, 1962; form of G. Kraus, 1984);
//! - reserved, locking: k sinh(β u)/β (Y. C. Fung, Am. J. Physiol. 213, 1967: soft tissue and rubber at
//!   large strains).
//!
//! Creep (`rubber_relaxation`), branches beside the spring:
//! - Zener: one Maxwell branch (C. Zener, *Elasticity and Anelasticity of Metals*, 1948);
//! - Maxwell: three, from hundredths of a second to seconds (E. Wiechert, Ann. Phys. 286, 1893);
//! - power: a modulus that falls as t^−α over three decades, seven branches (R. A. Schapery, Polym. Eng.
//!   Sci. 9, 1969; K. S. Cole, R. H. Cole, J. Chem. Phys. 9, 1941);
//! - reserved, box: a constant spectrum between two times, eight branches of one stiffness (H. P. Neubert,
//!   Aeronaut. Q. 14, 1963; Y. C. Fung, *Biomechanics*, 1981).

use serde::Serialize;

use crate::laws::family::{LawFamily, size};
use crate::random::Stream;

/// Law of the block's spring, relative to its stiffness k.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
#[serde(tag = "law", rename_all = "snake_case")]
pub enum Spring {
    /// k u.
    #[default]
    Linear,
    /// k u (1 + ε u²).
    Cubic {
        /// ε.
        hardening_per_m2: f64,
    },
    /// k u (1 − d + d/(1 + (u/u0)²)).
    Payne {
        /// d.
        drop: f64,
        /// u0.
        scale_m: f64,
    },
    /// k sinh(β u)/β.
    Locking {
        /// β.
        per_m: f64,
    },
}

impl Spring {
    /// Draws that of a hidden block.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        match family.pick(s, &[0, 1, 2], 3) {
            0 => Self::Linear,
            1 => Self::Cubic { hardening_per_m2: s.uniform(3e3, 3e4) },
            2 => Self::Payne { drop: s.uniform(0.1, 0.35), scale_m: s.uniform(0.8e-3, 2.5e-3) },
            _ => Self::Locking { per_m: s.uniform(150.0, 500.0) },
        }
    }

    /// Force over k and its derivative.
    #[must_use]
    pub fn at(&self, u: f64) -> (f64, f64) {
        match *self {
            Self::Linear => (u, 1.0),
            Self::Cubic { hardening_per_m2 } => {
                let square = hardening_per_m2 * u * u;
                (u * (1.0 + square), 1.0 + 3.0 * square)
            }
            Self::Payne { drop, scale_m } => {
                let square = (u / scale_m).powi(2);
                let fall = drop / (1.0 + square);
                (u * (1.0 - drop + fall), 1.0 - drop + fall * (1.0 - square) / (1.0 + square))
            }
            Self::Locking { per_m } => ((per_m * u).sinh() / per_m, (per_m * u).cosh()),
        }
    }
}

/// A spring and a dashpot in series with each other, beside the block's spring.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Branch {
    /// Spring; in a law, as a share of the block's.
    pub stiffness_n_per_m: f64,
    /// Time in which its force fades at constant deformation.
    pub relaxation_s: f64,
}

#[derive(Debug, Clone, Copy, Serialize)]
#[serde(rename_all = "snake_case")]
enum Spectrum {
    Zener,
    Maxwell,
    Power,
    Box,
}

/// A block that creeps.
#[derive(Debug, Clone, Serialize)]
pub struct Relaxation {
    law: Spectrum,
    branches: Vec<Branch>,
}

impl Relaxation {
    /// Draws one; all branches together have 0.2 to 1.5 times the block's stiffness.
    pub fn draw(s: &mut Stream, family: LawFamily) -> Self {
        let all = (10.0 * size(s)).clamp(0.3, 1.5);
        let law = family.pick(s, &[Spectrum::Zener, Spectrum::Maxwell, Spectrum::Power], Spectrum::Box);
        let weighted: Vec<(f64, f64)> = match law {
            Spectrum::Zener => vec![(1.0, s.log_uniform(0.05, 1.0))],
            Spectrum::Maxwell => [(0.02, 0.05), (0.15, 0.4), (0.8, 2.0)]
                .iter()
                .map(|(fast, slow)| (s.uniform(0.25, 0.6), s.log_uniform(*fast, *slow)))
                .collect(),
            Spectrum::Power => {
                let alpha = s.uniform(0.15, 0.4);
                let first = s.log_uniform(0.01, 0.02);
                (0..7).map(|i| first * 10_f64.powf(0.5 * f64::from(i))).map(|t| (t.powf(-alpha), t)).collect()
            }
            Spectrum::Box => {
                let (first, last) = (s.log_uniform(0.01, 0.04), s.log_uniform(1.0, 4.0));
                (0..8).map(|i| (1.0, first * (last / first).powf(f64::from(i) / 7.0))).collect()
            }
        };
        let sum: f64 = weighted.iter().map(|(weight, _)| weight).sum();
        let branches = weighted
            .into_iter()
            .map(|(weight, relaxation_s)| Branch { stiffness_n_per_m: all * weight / sum, relaxation_s })
            .collect();
        Self { law, branches }
    }

    /// Its branches beside a spring of this stiffness.
    #[must_use]
    pub fn beside(&self, stiffness_n_per_m: f64) -> Vec<Branch> {
        self.branches
            .iter()
            .map(|b| Branch { stiffness_n_per_m: b.stiffness_n_per_m * stiffness_n_per_m, ..*b })
            .collect()
    }
}
