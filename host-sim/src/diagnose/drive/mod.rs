//! The drive alone: inertia, bearing, shaft and motor, from torque and angle or force and position.
//!
//! Works on drive logs and on contact logs; in the latter the friction torque that the bridge measured
//! is a known load. The baseline is M q̈ + Fv q̇ + Fc d(q) and the timing of the channels; an offset is
//! not part of it, because it is a cause that can be named.
//!
//! What is minimised is the error of force, not of position: force noise is white and the encoder's is
//! known, so the whitened residual ([`whitening`]) is a maximum-likelihood one where both hold. Noise
//! in the regressors is small behind the position filter and enters through the whitening's density.

pub mod backlash;
pub mod bearing_asymmetry;
pub mod bearing_stribeck;
pub mod conditioned;
pub mod drive_delay;
pub mod effect;
pub mod encoder_eccentricity;
pub mod m2_ripple;
pub mod model;
pub mod noise;
pub mod output;
pub mod presliding;
pub mod resonance;
pub mod shaft;
pub mod shaft_torsion;
pub mod slow;
pub mod solve;
pub mod torque_offset;
pub mod units;
pub mod whitening;

use std::collections::HashMap;
use std::sync::{Arc, Mutex, PoisonError};

use conditioned::DriveLog;
use effect::{DriveEffect, Known};
use model::{Filtered, Model, Part, Shapes, baseline_names};
use solve::Solved;

use super::analysis::{Analysis, Fit, Role};
use super::selection::sorted;
use crate::files::effect_id::Subsystem;
use crate::files::log::Log;
use crate::fit::drive::record::central_difference;

/// The effects that show in the drive, in the order of the contract.
static EFFECTS: [&dyn DriveEffect; 9] = [
    &encoder_eccentricity::EncoderEccentricity,
    &shaft_torsion::ShaftTorsion,
    &backlash::Backlash,
    &m2_ripple::M2Ripple,
    &bearing_asymmetry::BearingAsymmetry,
    &torque_offset::TorqueOffset,
    &bearing_stribeck::BearingStribeck,
    &presliding::Presliding,
    &drive_delay::DriveDelay,
];

/// The drive's analysis of a set of logs.
pub struct DriveAnalysis {
    logs: Vec<Filtered>,
    solved: Mutex<HashMap<Vec<&'static str>, Arc<Solved>>>,
}

impl DriveAnalysis {
    /// Conditions logs; training logs must come first.
    pub fn new(logs: &[(&Log, Role)]) -> Result<Self, String> {
        let conditioned =
            logs.iter().map(|(log, role)| DriveLog::new(log, *role)).collect::<Result<Vec<_>, _>>()?;
        Self::from_logs(conditioned)
    }

    /// An analysis of conditioned logs.
    pub fn from_logs(logs: Vec<DriveLog>) -> Result<Self, String> {
        // The whitening needs the inertia: it is found with force noise alone, twice is enough since
        // the filter's gain depends on it only where encoder noise outweighs force noise.
        let mut inertia = 0.0;
        let mut filtered: Vec<Filtered> = logs.into_iter().map(|log| Filtered::new(log, inertia)).collect();
        for _ in 0..2 {
            let rest = Shapes { values: Vec::new(), origins: vec![0.0; filtered.len()] };
            let model = Model { logs: &filtered, parts: &[] };
            inertia = solve::solve(&model, rest, &[])?.sizes.values[0].max(0.0);
            filtered = filtered.into_iter().map(|f| Filtered::new(f.log, inertia)).collect();
        }
        Ok(Self { logs: filtered, solved: Mutex::new(HashMap::new()) })
    }

    fn train(&self) -> Vec<&DriveLog> {
        self.logs.iter().map(|f| &f.log).filter(|log| log.role == Role::Train).collect()
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
        let near: Vec<&'static str> = near.iter().copied().filter(|id| effects.contains(id)).collect();
        let start = match known(&near) {
            Some(solved) => Some(solved),
            None if effects.is_empty() => None,
            None => Some(self.solve(&near, &[]).or_else(|_| self.solve(&[], &[]))?),
        };
        let solved = Arc::new(self.extend(start.as_deref(), effects)?);
        self.solved.lock().unwrap_or_else(PoisonError::into_inner).insert(sorted(effects), solved.clone());
        Ok(solved)
    }

    fn extend(&self, from: Option<&Solved>, effects: &[&'static str]) -> Result<Solved, String> {
        if ["shaft_torsion", "backlash"].iter().all(|id| effects.contains(id)) {
            return Err("a gap has the shaft's spring in it: the two are not added up".into());
        }
        let mut parts: Vec<Part> = Vec::new();
        let mut shapes = Shapes { values: Vec::new(), origins: vec![0.0; self.logs.len()] };
        let mut grids = Vec::new();
        let known = from.map(|from| self.known(from, effects));
        if let Some(from) = from {
            shapes.origins.clone_from(&from.shapes.origins);
        }
        for id in effects {
            let old = from.and_then(|from| {
                let at = from.parts.iter().position(|part| part.id == *id)?;
                Some((from, at))
            });
            // The asymmetry's columns depend on whether an offset is in the model.
            let rebuilt = *id == "bearing_asymmetry";
            if let Some((from, at)) = old.filter(|_| !rebuilt) {
                let before: usize = from.parts[..at].iter().map(|p| p.prepared.shapes().len()).sum();
                let count = from.parts[at].prepared.shapes().len();
                shapes.values.extend(&from.shapes.values[before..before + count]);
                parts.push(from.parts[at].clone());
                continue;
            }
            let effect = EFFECTS
                .iter()
                .find(|effect| effect.id() == *id)
                .ok_or_else(|| format!("{id}: not an effect of the drive"))?;
            let Some(known) = &known else { return Err("an effect needs a baseline".into()) };
            let prepared = effect.prepare(&self.train(), known)?;
            let at = shapes.values.len();
            shapes.values.extend(prepared.shapes().iter().map(|shape| shape.start));
            if !prepared.starts().is_empty() {
                grids.push((at, prepared.starts().to_vec()));
            }
            // Effects locked to position share each log's origin: the first of them has found it.
            let found = parts.iter().any(|part| part.prepared.origins().is_some());
            if let Some(origins) = prepared.origins().filter(|_| !found) {
                shapes.origins[..origins.starts.len()].copy_from_slice(origins.starts);
            }
            parts.push(Part { id: effect.id(), prepared });
        }
        let model = Model { logs: &self.logs, parts: &parts };
        solve::solve(&model, shapes, &grids)
    }

    fn known(&self, solved: &Solved, effects: &[&'static str]) -> Known {
        let model = Model { logs: &self.logs, parts: &solved.parts };
        let residual = (0..self.logs.len())
            .filter(|&i| self.logs[i].log.role == Role::Train)
            .map(|i| {
                let mut left = model.net_effort(&solved.shapes, i);
                for (column, size) in model.regressors(&solved.shapes, i).iter().zip(&solved.sizes.values) {
                    left.iter_mut().zip(column).for_each(|(left, x)| *left -= size * x);
                }
                left
            })
            .collect();
        let effects = effects.to_vec();
        Known { slow: slow::fit(&self.train(), &solved.sizes.values), residual, effects }
    }
}

/// Where the disc is against the encoder's angle in a log.
pub struct DiscOffset {
    /// Time since the log's start, s.
    pub time_s: Vec<f64>,
    /// Angle of the disc less the measured one, rad.
    pub angle_rad: Vec<f64>,
    /// Its rate, rad/s.
    pub speed_rad_s: Vec<f64>,
}

impl DriveAnalysis {
    /// Where the disc is against the encoder's angle, in each log; `None` where no effect takes them apart.
    pub fn disc_offsets(&self, effects: &[&'static str]) -> Option<Vec<DiscOffset>> {
        let solved = self.solve(effects, effects).ok()?;
        let model = Model { logs: &self.logs, parts: &solved.parts };
        let mut any = false;
        let offsets = (0..self.logs.len()).map(|index| {
            let log = &self.logs[index].log;
            let mut angle_rad = vec![0.0; log.len()];
            for offset in model.disc_offsets(&solved.shapes, &solved.names, &solved.sizes, index) {
                any = true;
                angle_rad.iter_mut().zip(offset).for_each(|(sum, x)| *sum += x);
            }
            let step_s = log.record.step_s;
            DiscOffset {
                time_s: (0..log.len()).map(|i| step_s * i as f64).collect(),
                speed_rad_s: central_difference(&angle_rad, step_s),
                angle_rad,
            }
        });
        let offsets: Vec<DiscOffset> = offsets.collect();
        any.then_some(offsets)
    }
}

impl Analysis for DriveAnalysis {
    fn subsystem(&self) -> Subsystem {
        Subsystem::Drive
    }

    fn baseline_kind(&self) -> &str {
        "drive"
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
        output::evidence(effect, fit, baseline_names(self.logs[0].log.motion))
    }
}
