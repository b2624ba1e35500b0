//! `lever_hysteresis`: friction in the lever's joints, a Coulomb band between M1's torque and the force.
//!
//! Source: Dahl (1968), Bouc (1967) and Wen (1976). The friction's state s follows a drive x,
//! ds/dx = (1 − |s|^p (γ + (1 − γ) sgn(s dx)))/L, and stays within ±1; F = P[G τ − F0 − F_c s]. L is the
//! yield length, p the sharpness of the corners (1 is Dahl's exponential, large is a Coulomb band with an
//! elastic flank), γ how the way back differs from the way out (½: straight; 0: Dahl's). Joints between
//! motor and lever see the torque before the press rings, those behind the springs see the ringing too:
//! x = (1 − λ) G τ + λ travel.
//! Sets it apart: on the way up the force is too small and on the way down too large by the same
//! amount, however slow; the difference follows the turning points and not the force.

use std::sync::Arc;

use super::conditioned::PressureLog;
use super::effect::{Column, OwnValue, Prepared, PressureEffect, travel_range};
use crate::fit::bounds::Parameter;

/// Longest step of the drive in yield lengths.
const LONGEST_STEP: f64 = 0.2;
/// Beyond this many yield lengths in one sample the state is at its limit.
const FAR: f64 = 8.0;
/// Start lengths.
const LENGTHS: i32 = 6;

/// The effect.
pub struct LeverHysteresis;

/// Law of the state.
#[derive(Debug, Clone, Copy)]
struct Law {
    length_n: f64,
    sharpness: f64,
    way_back: f64,
}

struct Band {
    shapes: [Parameter; 4],
    starts: Vec<Vec<f64>>,
}

impl Law {
    /// State over a drive.
    fn follow(self, drive_n: &[f64], start: f64) -> Vec<f64> {
        let mut state = start;
        let mut last = drive_n.first().copied().unwrap_or(0.0);
        let mut states = Vec::with_capacity(drive_n.len());
        for x in drive_n {
            let way = (x - last) / self.length_n;
            last = *x;
            if way.abs() > FAR {
                state = way.signum();
            } else if way != 0.0 {
                let steps = (way.abs() / LONGEST_STEP).ceil();
                for _ in 0..steps as usize {
                    let along = if state * way > 0.0 { 1.0 } else { 2.0 * self.way_back - 1.0 };
                    let slope = 1.0 - along * state.abs().powf(self.sharpness);
                    state = (state + slope * way / steps).clamp(-1.0, 1.0);
                }
            }
            states.push(state);
        }
        states
    }
}

impl Prepared for Band {
    fn shapes(&self) -> &[Parameter] {
        &self.shapes
    }

    fn starts(&self) -> &[Vec<f64>] {
        &self.starts
    }

    fn own_value(&self) -> Option<OwnValue> {
        Some(OwnValue { name: "state_at_start", half_span: 1.0, first_stays: false })
    }

    fn columns(&self, shape: &[f64], own: f64, log: &PressureLog) -> Vec<Column> {
        let mix = |(asked, travel): (&f64, &f64)| asked + shape[1] * (travel - asked);
        let drive_n: Vec<f64> = log.asked_n.iter().zip(&log.travel_n).map(mix).collect();
        let law = Law { length_n: shape[0], sharpness: shape[2], way_back: shape[3] };
        vec![Column { name: "friction_n", values: law.follow(&drive_n, own), not_negative: true }]
    }

    fn constants(&self) -> Vec<(&'static str, f64)> {
        Vec::new()
    }
}

impl PressureEffect for LeverHysteresis {
    fn id(&self) -> &'static str {
        "lever_hysteresis"
    }

    fn prepare(&self, logs: &[&PressureLog], _residual_n: &[Vec<f64>]) -> Result<Arc<dyn Prepared>, String> {
        let (low, high) = travel_range(logs)?;
        let (shortest, longest) = (3e-3 * (high - low), 0.3 * (high - low));
        let length = |i: i32| shortest * (longest / shortest).powf(f64::from(i) / f64::from(LENGTHS - 1));
        let shapes = [
            Parameter::logarithmic("yield_length_n", length(LENGTHS / 2), 0.5 * shortest, 2.0 * longest),
            Parameter::linear("travel_share", 0.0, 0.0, 1.0),
            Parameter::logarithmic("sharpness", 1.5, 0.6, 8.0),
            Parameter::linear("way_back", 0.4, 0.0, 0.9),
        ];
        let start = |i, share| vec![length(i), share, 1.5, 0.4];
        let starts = (0..LENGTHS).flat_map(|i| [0.0, 1.0].map(|share| start(i, share))).collect();
        Ok(Arc::new(Band { shapes, starts }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn there_and_back() -> Vec<f64> {
        (0..2000).map(|i| 0.05 * f64::from(if i < 1000 { i } else { 1998 - i })).collect()
    }

    #[test]
    fn sharp_corners_give_a_coulomb_band_with_an_elastic_flank() {
        let law = Law { length_n: 10.0, sharpness: 60.0, way_back: 0.5 };
        let state = law.follow(&there_and_back(), 0.0);
        // The corner of the power 60 rounds off 5 %.
        assert!((state[100] - 0.5).abs() < 1e-6);
        assert!(state[900] > 0.95);
        // The crest is sample 999: 10 down is near the middle of the band, 25 down its other side.
        assert!(state[999 + 200].abs() < 0.06);
        assert!(state[999 + 500] < -0.95);
    }

    #[test]
    fn sharpness_one_is_dahls_exponential() {
        let law = Law { length_n: 4.0, sharpness: 1.0, way_back: 0.0 };
        let state = law.follow(&there_and_back(), 0.0);
        for (i, s) in state[..1000].iter().enumerate() {
            let expected = 1.0 - (-0.05 * i as f64 / 4.0).exp();
            // Steps of 1/80 of the length: first-order error of half of that times e⁻¹.
            assert!((s - expected).abs() < 4e-3, "{i} {s} {expected}");
        }
    }
}
