//! The press alone: lever, foil springs and M1, from M1's torque to the normal force.
//!
//! The baseline is F_N = P[G τ − F0] with gain and preload fitted, P the mode of the rig file with a
//! small change of its lag. Errors are judged below 30 Hz, outside the ringing after jumps of the torque
//! and only while the elements touch; there the noise of torque and force is white and known, so the
//! residual of a true model has variance one.
//! Left out: the mode's frequency and damping, which only the ringing shows.

pub mod conditioned;
pub mod effect;
pub mod foil_hardening;
pub mod lever_hysteresis;
pub mod m1_ripple;
pub mod model;
pub mod output;
pub mod solve;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use effect::PressureEffect;
use model::{Filtered, Model, Part, Shapes};
use solve::Solved;

use super::analysis::{Analysis, Fit, Role};
use super::selection::sorted;
use crate::files::effect_id::Subsystem;
use crate::files::log::Log;
use crate::files::rig_file::RigFile;
use crate::files::signal::Signal;

/// The press's effects in the order of the contract.
static EFFECTS: [&dyn PressureEffect; 3] =
    [&lever_hysteresis::LeverHysteresis, &foil_hardening::FoilHardening, &m1_ripple::M1Ripple];

/// The press's analysis of a set of contact logs.
pub struct PressureAnalysis {
    logs: Vec<Filtered>,
    solved: Mutex<HashMap<Vec<&'static str>, Arc<Solved>>>,
}

impl PressureAnalysis {
    /// Conditions logs; training logs must come first. `None` where a log lacks M1's torque.
    pub fn new(rig: &RigFile, logs: &[(&Log, Role)]) -> Result<Option<Self>, String> {
        if logs.iter().any(|(log, _)| log.signal(Signal::M1Torque).is_none()) {
            return Ok(None);
        }
        let logs = conditioned::condition(rig, logs)?;
        let logs = logs.into_iter().map(|log| Filtered::new(rig, log)).collect();
        Ok(Some(Self { logs, solved: Mutex::new(HashMap::new()) }))
    }

    /// Fits a combination, from a fit with fewer effects.
    pub fn solve(&self, effects: &[&'static str], near: &[&'static str]) -> Result<Arc<Solved>, String> {
        let known = |key: &[&'static str]| {
            let solved = self.solved.lock().unwrap_or_else(PoisonError::into_inner);
            solved.get(&sorted(key)).cloned()
        };
        if let Some(solved) = known(effects) {
            return Ok(solved);
        }
        let mut so_far: Vec<&'static str> = near.iter().copied().filter(|id| effects.contains(id)).collect();
        let mut solved = match known(&so_far) {
            Some(solved) if so_far.len() < effects.len() => solved,
            _ => {
                so_far.clear();
                self.remember(&[], || {
                    let model = Model { logs: &self.logs, parts: &[] };
                    solve::solve(&model, Shapes { values: Vec::new(), own: Vec::new() }, &[])
                })?
            }
        };
        for id in effects {
            if !so_far.contains(id) {
                so_far.push(id);
                solved = self.remember(&so_far, || self.extend(&solved, id))?;
            }
        }
        Ok(solved)
    }

    fn remember(
        &self,
        effects: &[&'static str],
        solve: impl FnOnce() -> Result<Solved, String>,
    ) -> Result<Arc<Solved>, String> {
        let key = sorted(effects);
        if let Some(solved) = self.solved.lock().unwrap_or_else(PoisonError::into_inner).get(&key) {
            return Ok(solved.clone());
        }
        let solved = Arc::new(solve()?);
        self.solved.lock().unwrap_or_else(PoisonError::into_inner).insert(key, solved.clone());
        Ok(solved)
    }

    fn extend(&self, from: &Solved, id: &str) -> Result<Solved, String> {
        let effect = EFFECTS
            .iter()
            .find(|effect| effect.id() == id)
            .ok_or_else(|| format!("{id}: not an effect of the press"))?;
        let train = solve::training(&self.logs);
        let logs: Vec<&conditioned::PressureLog> = train.iter().map(|&i| &self.logs[i].log).collect();
        let residual_n: Vec<Vec<f64>> = train.iter().map(|&i| self.residual_n(from, i)).collect();
        let prepared = effect.prepare(&logs, &residual_n)?;
        let mut shapes = from.shapes.clone();
        shapes.values.extend(prepared.shapes().iter().map(|shape| shape.start));
        shapes.own.push(vec![0.0; self.logs.len()]);
        let grid = prepared.starts().to_vec();
        let mut parts = from.parts.clone();
        parts.push(Part { id: effect.id(), prepared });
        solve::solve(&Model { logs: &self.logs, parts: &parts }, shapes, &grid)
    }

    fn residual_n(&self, solved: &Solved, index: usize) -> Vec<f64> {
        let model = Model { logs: &self.logs, parts: &solved.parts };
        let mut left = self.logs[index].log.normal_n.clone();
        for (column, size) in model.columns(&solved.shapes, index).iter().zip(&solved.sizes) {
            left.iter_mut().zip(column).for_each(|(left, x)| *left -= size * x);
        }
        left
    }
}

impl Analysis for PressureAnalysis {
    fn subsystem(&self) -> Subsystem {
        Subsystem::Pressure
    }

    fn baseline_kind(&self) -> &str {
        "pressure"
    }

    fn candidates(&self) -> Vec<&'static str> {
        EFFECTS.iter().map(|effect| effect.id()).collect()
    }

    fn fit(&self, effects: &[&'static str], near: Option<&Fit>) -> Result<Fit, String> {
        let near = near.map_or(&[][..], |fit| &fit.effects);
        let solved = self.solve(effects, near)?;
        Ok(output::fit(&self.logs, &solved, effects))
    }

    fn evidence(&self, effect: &'static str, fit: &Fit) -> Vec<String> {
        output::evidence(effect, fit)
    }
}
