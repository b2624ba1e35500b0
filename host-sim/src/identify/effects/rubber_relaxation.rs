//! `rubber_relaxation`: viscoelastic branches in the block: creep, and stiffness that depends on rate.
//!
//! Coordinate: the observed deformation of the block. Law: three Maxwell branches beside its spring, over three decades of
//! time; the chip has the same solid as creeping elements in series with a stiffer block.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::problem::Numbers;
use crate::identify::term::{Parameter, Starts};

/// The effect.
pub(super) struct RubberRelaxation;

/// Relaxation times, s.
const TIMES_S: [f64; 3] = [0.02, 0.2, 2.0];
/// Stiffness that a parameter of 1 stands for, N/m: a third of the assumed block.
const UNIT_N_PER_M: f64 = 1e4;
/// Stiffness of a branch that is not there, N/m.
const RIGID_N_PER_M: f64 = 1e12;

impl Effect for RubberRelaxation {
    fn about(&self) -> About {
        About {
            id: "rubber_relaxation",
            meaning: "the block creeps under load and is stiffer in fast motion than in slow",
            experiment: "hold a constant torque below breakaway for 10 s and watch the disc creep; repeat the paper's speed step at 10 and 120 rpm",
        }
    }

    fn contact(&self, view: &ContactView<'_>) -> Vec<ContactTerm> {
        if !view.block {
            return Vec::new();
        }
        let parameters = TIMES_S.map(|time_s| Parameter::positive(format!("branch_{time_s}s"), 3.0)).to_vec();
        let act = |p: &[f64], change: &mut super::Change| {
            for ((branch, size), time_s) in change.branches.iter_mut().zip(p).zip(TIMES_S) {
                *branch = (size.max(0.0) * UNIT_N_PER_M, time_s);
            }
        };
        let export = |p: &[f64], numbers: &mut Numbers| {
            // From the slowest to the fastest: what has relaxed before is gone.
            let mut after = numbers.stiffness_n_per_m;
            let mut out = Vec::new();
            for (i, (size, time_s)) in p.iter().zip(TIMES_S).enumerate().rev() {
                let before = after + size.max(0.0) * UNIT_N_PER_M;
                let creep = if before > after { 1.0 / (1.0 / after - 1.0 / before) } else { RIGID_N_PER_M };
                let number = if i == 0 { String::new() } else { format!("_{}", i + 1) };
                out.insert(0, (format!("relaxation{number}_s"), time_s * before / after));
                out.insert(0, (format!("creep_stiffness{number}_n_per_m"), creep.min(RIGID_N_PER_M)));
                after = before;
            }
            numbers.stiffness_n_per_m = after;
            out
        };
        vec![ContactTerm::any(self.id(), parameters, Starts::At(vec![vec![0.0; 3]]), act).exported(export)]
    }
}
