//! Where a record tells the force that the element holds: when the disc has come to rest.
//!
//! What a stuck element holds is decided in the last milliseconds of sliding and by every load that it
//! hardly carried; near the limit a newton more or less makes it slip or not, and the force then differs by
//! a tenth for as long as it sticks. No model with noisy inputs can follow that. As at the beginning of
//! the record, the measured torque therefore says what is held: after each stop, after each change of load
//! at rest, and at the end of a rest. Motion and load alone decide where, so it is the same for every model.

use super::super::record::Record;

/// Rest before and after the anchor, s.
const BEFORE_S: f64 = 0.04;
const AFTER_S: f64 = 0.01;
/// Motion that is rest, m: the smallest blocks give 1 % of their largest force over it.
const REST_M: f64 = 2e-5;
/// The same in standard deviations of the motion's noise.
const REST_NOISE: f64 = 6.0;
/// Relative change of the load that is followed by another anchor …
const CHANGE: f64 = 0.03;
/// … and below which the load counts as steady within the window.
const STEADY: f64 = 0.015;
/// Load below which changes are relative to this, N.
const LIGHT_N: f64 = 5.0;

/// Samples and the torque that is held there, N·m.
pub fn find(record: &Record, radius_m: f64, load_n: &[f64]) -> Vec<(usize, f64)> {
    let (before, after) =
        ((BEFORE_S / record.step_s).ceil() as usize, (AFTER_S / record.step_s).ceil() as usize);
    let still_m = REST_M + REST_NOISE * radius_m * record.angle_noise_rad;
    let extent = |values: &[f64]| {
        values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(*x), high.max(*x)))
    };
    let mut anchors: Vec<(usize, f64)> = Vec::new();
    // Load at the last anchor while the disc has not moved since.
    let mut held_n: Option<f64> = None;
    // The latest instant of a rest, and the torque there.
    let mut latest: Option<(usize, f64)> = None;
    for at in before..record.len().saturating_sub(after) {
        let window = at - before..at + after;
        let (low, high) = extent(&record.angle_rad[window.clone()]);
        if radius_m * (high - low) > still_m {
            held_n = None;
            anchors.extend(latest.take());
            continue;
        }
        let (light, heavy) = extent(&load_n[window.clone()]);
        let scale = heavy.max(LIGHT_N);
        let is_new = held_n.is_none_or(|held| (load_n[at] - held).abs() > CHANGE * scale);
        let shown = &record.friction_nm.values[window.clone()];
        let clipped = window.clone().any(|i| record.friction_nm.clipped(i));
        if heavy - light < STEADY * scale && !clipped {
            let anchor = (at, shown.iter().sum::<f64>() / shown.len() as f64);
            if is_new {
                anchors.push(anchor);
                held_n = Some(load_n[at]);
            }
            latest = Some(anchor);
        }
    }
    anchors
}
