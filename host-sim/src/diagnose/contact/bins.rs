//! A record cut into bins: single samples where something happens, up to `MOST_SAMPLES` together where
//! nothing does.
//!
//! A mean over samples that lie on a straight line loses nothing of what a model could be told by them, so
//! a fit costs a third of what it would cost on all samples. Samples are put together where speed and load
//! hardly change and the friction torque deviates from a straight line by no more than its noise; a ringing
//! channel, a peak or a spike keeps its samples. Towards a jump the bins become narrow by halves.

use super::super::record::Record;

/// Most samples in a bin.
const MOST_SAMPLES: usize = 16;
/// Largest change of the disc's angle in a bin, rad: a thirtieth of the period of the sixth order.
const MOST_ANGLE_RAD: f64 = 0.035;
/// Longest bin, s.
const LONGEST_S: f64 = 0.02;
/// Relative change of speed or load in a bin …
const CHANGE: f64 = 0.02;
/// … where it is not below this speed, m/s, …
const SLOW_M_S: f64 = 5e-3;
/// … or this load, N.
const LIGHT_N: f64 = 2.0;

/// Samples `from` to before `to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Bin {
    /// First sample.
    pub from: usize,
    /// One after the last sample.
    pub to: usize,
}

impl Bin {
    /// Number of samples.
    pub fn len(&self) -> usize {
        self.to - self.from
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.to == self.from
    }

    /// Mean of a signal over the samples.
    pub fn mean(&self, values: &[f64]) -> f64 {
        values[self.from..self.to].iter().sum::<f64>() / self.len() as f64
    }
}

/// Every sample a bin.
pub fn single(record: &Record) -> Vec<Bin> {
    (0..record.len()).map(|from| Bin { from, to: from + 1 }).collect()
}

/// Cuts a record.
pub fn adaptive(record: &Record, radius_m: f64, speed_rad_s: &[f64], load_n: &[f64]) -> Vec<Bin> {
    let friction = &record.friction_nm;
    let fits = |from: usize, to: usize| {
        let last = to - 1;
        let (v0, v1) = (radius_m * speed_rad_s[from], radius_m * speed_rad_s[last]);
        let (n0, n1) = (load_n[from], load_n[last]);
        let turned = (record.angle_rad[last] - record.angle_rad[from]).abs();
        (v1 - v0).abs() <= CHANGE * v0.abs().max(v1.abs()).max(SLOW_M_S)
            && (n1 - n0).abs() <= CHANGE * n0.max(n1).max(LIGHT_N)
            && turned <= MOST_ANGLE_RAD
            && record.time_s[last] - record.time_s[from] <= LONGEST_S
            && (from..to).all(|i| friction.clipped(i) == friction.clipped(from))
            && is_straight(&friction.values[from..to], friction.noise_std)
    };
    // Widest allowed at each sample, then narrowed so that neighbours differ by at most a factor of two.
    let count = record.len();
    let mut widest = vec![1usize; count];
    let mut from = 0;
    while from < count {
        let mut size = MOST_SAMPLES;
        while size > 1 && !(from + size <= count && fits(from, from + size)) {
            size /= 2;
        }
        widest[from..from + size].fill(size);
        from += size;
    }
    for i in 1..count {
        widest[i] = widest[i].min(2 * widest[i - 1]);
    }
    for i in (1..count).rev() {
        widest[i - 1] = widest[i - 1].min(2 * widest[i]);
    }
    let mut bins = Vec::new();
    let mut from = 0;
    while from < count {
        let mut size = widest[from];
        while size > 1 && (from + size > count || widest[from..from + size].iter().any(|w| *w < size)) {
            size /= 2;
        }
        bins.push(Bin { from, to: from + size });
        from += size;
    }
    bins
}

/// Whether values deviate from a straight line by no more than white noise would in 999 of 1000 cases.
fn is_straight(values: &[f64], noise_std: f64) -> bool {
    let count = values.len();
    if count < 3 {
        return count < 2 || (values[1] - values[0]).abs() <= 4.5 * noise_std;
    }
    let centre = 0.5 * (count - 1) as f64;
    let mean = values.iter().sum::<f64>() / count as f64;
    let (mut product, mut norm) = (0.0, 0.0);
    for (i, value) in values.iter().enumerate() {
        let x = i as f64 - centre;
        product += x * (value - mean);
        norm += x * x;
    }
    let slope = product / norm;
    let left: f64 =
        values.iter().enumerate().map(|(i, v)| (v - mean - slope * (i as f64 - centre)).powi(2)).sum();
    // χ² of n − 2 degrees of freedom at 0.999, by Wilson and Hilferty's cube.
    let freedom = (count - 2) as f64;
    let spread = 2.0 / (9.0 * freedom);
    left <= noise_std * noise_std * freedom * (1.0 - spread + 3.09 * spread.sqrt()).powi(3)
}

#[cfg(test)]
mod tests {
    use super::super::super::noise::tests::white;
    use super::*;

    #[test]
    fn noise_on_a_line_is_straight_and_a_curve_is_not() {
        let noise = white(4000, 11);
        let straight = noise
            .chunks_exact(16)
            .filter(|chunk| {
                let line: Vec<f64> = chunk.iter().enumerate().map(|(i, e)| 0.3 * i as f64 + e).collect();
                is_straight(&line, 1.0)
            })
            .count();
        assert!(straight >= 247, "{straight} of 250");
        let swing: Vec<f64> = (0..16).map(|i| 4.0 * (1.3 * f64::from(i)).sin() + noise[i as usize]).collect();
        assert!(!is_straight(&swing, 1.0));
    }
}
