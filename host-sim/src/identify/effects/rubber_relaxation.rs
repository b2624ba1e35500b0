//! `rubber_relaxation`: viscoelastic branches in the block: creep, and stiffness that depends on rate.
//!
//! Coordinate: the observed deformation of the block. Law: three Maxwell branches beside its spring, over three decades of
//! time; the chip has the same solid as creeping elements in series with a stiffer block.

use super::{About, ContactView, Effect};
use crate::identify::contact::change::ContactTerm;
use crate::identify::contact::problem::Numbers;
use crate::identify::term::{Parameter, Starts};

/// The effect. Where the baseline has no block it shows beside a cause that has one, and does nothing alone.
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

    fn contact(&self, _: &ContactView<'_>) -> Vec<ContactTerm> {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::model_file::{ModelFile, ModelKind};
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::contact::baseline::{KNOWN_WITHIN, baseline};
    use crate::identify::contact::log::ContactLog;
    use crate::identify::contact::problem::Problem;
    use crate::identify::contact_part::contact_terms;
    use crate::identify::effects::coordinates::Scales;

    #[test]
    fn bristles_alone_do_not_creep_and_a_block_beside_them_does() {
        let series = |of: &dyn Fn(f64) -> f64| (0..600).map(|i| of(5e-3 * f64::from(i))).collect::<Vec<f64>>();
        let mut log = Log::default();
        log.set_signal(Signal::Time, series(&|t| t));
        log.set_signal(Signal::M2Speed, series(&|t| 0.5 * (2.0 * t).sin()));
        log.set_signal(Signal::NormalForce, series(&|_| 60.0));
        log.set_signal(Signal::FrictionTorque, series(&|t| 2.5 * (30.0 * (2.0 * t).sin()).tanh()));
        let logs = [ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()];
        let bristles = [("sigma0_n_per_m", 3e4), ("a0", 0.6), ("a1", 0.4), ("v0_m_s", 0.1)];
        let baseline = baseline(&ModelFile::new("m", ModelKind::Lugre, &bristles).unwrap(), KNOWN_WITHIN);
        let mut terms = contact_terms(&logs, &Scales::new(&logs), true, 1, false);
        terms.retain(|term| term.effect == RubberRelaxation.id());
        terms.push(ContactTerm::any("block", Vec::new(), Starts::At(Vec::new()), |_, change| {
            change.block = Some((3e4, 160.0));
        }));
        let problem = Problem::new(&logs, &baseline, &terms);
        let start: Vec<f64> = baseline.free.iter().map(|b| b.parameter.mean).collect();
        let shown = |terms: &[usize], own: &[f64]| problem.predict(terms, &[&start[..], own].concat()).shown_nm;
        let branches = [1.0; 3];
        assert_eq!(shown(&[0], &branches), shown(&[], &[]));
        assert_ne!(shown(&[0, 1], &branches), shown(&[1], &[]));
    }
}
