//! `rubber_relaxation`: viscoelastic branches in the block: creep, and stiffness that depends on rate.

use super::{ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::law::BRANCH_TIMES_S;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub struct RubberRelaxation;

/// Stiffness that a parameter of 1 stands for, N/m: a third of the assumed block.
const UNIT_N_PER_M: f64 = 1e4;

impl Effect for RubberRelaxation {
    fn id(&self) -> &'static str {
        "rubber_relaxation"
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        if !view.block {
            return Vec::new();
        }
        let parameters = BRANCH_TIMES_S.map(|time_s| Parameter::positive(format!("branch_{time_s}s"), 3.0)).to_vec();
        vec![ContactTerm::any(self.id(), parameters, Starts::At(vec![vec![0.02; 3]]), |p, change| {
            for (sum, size) in change.branches_n_per_m.iter_mut().zip(p) {
                *sum += size.max(0.0) * UNIT_N_PER_M;
            }
        })]
    }
}
