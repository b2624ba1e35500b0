//! The load beyond the end of a normal bridge that clips.
//!
//! Where the bridge shows its end, the load is a + b x, with x the torque of M1 behind the mode of the press
//! and a, b from the samples that the bridge shows; never less than the end itself.

use super::super::record::Record;
use crate::files::rig_file::RigFile;
use crate::predict::SecondOrder;

/// Least samples that tell a and b.
const LEAST: usize = 200;

/// Load at the samples, N; `None` where the bridge does not clip or nothing is known about M1.
pub fn load(record: &Record, rig: &RigFile, load_n: &[f64]) -> Option<Vec<f64>> {
    let clipping = record.normal_n.clipping;
    if clipping.is_none() {
        return None;
    }
    let torque = record.m1_torque_nm.as_ref().map(|m| &m.values).or(record.m1_torque_ref_nm.as_ref())?;
    let mut press =
        SecondOrder::new(rig.pressure.mode_hz, rig.pressure.damping_ratio, torque.first().copied()?);
    let mut pressed = vec![torque[0]];
    for (times, torque_nm) in record.time_s.windows(2).zip(torque.iter().skip(1)) {
        pressed.push(press.step(times[1] - times[0], *torque_nm));
    }
    let (mut n, mut sx, mut sy, mut sxx, mut sxy) = (0.0, 0.0, 0.0, 0.0, 0.0);
    // The upper half of the range: a press lifted off does not follow the same line.
    let half = 0.5 * load_n.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    for i in (0..record.len()).filter(|i| !record.normal_n.clipped(*i) && load_n[*i] > half) {
        n += 1.0;
        sx += pressed[i];
        sy += load_n[i];
        sxx += pressed[i] * pressed[i];
        sxy += pressed[i] * load_n[i];
    }
    let spread = n * sxx - sx * sx;
    if n < LEAST as f64 || spread <= 1e-9 * n * sxx {
        return None;
    }
    let slope = (n * sxy - sx * sy) / spread;
    let level = (sy - slope * sx) / n;
    let restored = (0..record.len()).map(|i| {
        let value = record.normal_n.values[i];
        let expected = level + slope * pressed[i];
        match (clipping.low, clipping.high) {
            (_, Some(high)) if value >= high => expected.max(high),
            (Some(low), _) if value <= low => expected.min(low),
            _ => load_n[i],
        }
    });
    Some(restored.collect())
}
