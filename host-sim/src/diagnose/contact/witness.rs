//! M2's torque as a second witness of the friction torque.
//!
//! τ2 = J ω̇ + τ_bearing(ω) + T, all as means over [`BLOCK_S`]. What the friction channel shows beyond the
//! true torque (drift, crosstalk, delay) is missing in τ2; what changes friction itself is in both. So
//!
//! y = τ2 − T_shown + (T_shown − T)_model = J ω̇ + b₊\[ω>0\] + b₋\[ω<0\] + c₊ω\[ω>0\] + c₋ω\[ω<0\]
//!
//! must hold with one set of coefficients for all logs, found by linear least squares inside the residual.
//! They are free per direction so that an asymmetric bearing or an offset of M2 does not speak against the
//! bridge. Blocks near standstill or with a change of direction are left out.

use nalgebra::{DMatrix, DVector};

use super::super::record::Record;
use super::bins::Bin;
use super::model::Torques;

/// Length of a block, s.
pub const BLOCK_S: f64 = 0.02;
/// Slowest speed of a block that counts, rad/s.
const SLOWEST_RAD_S: f64 = 0.1;

/// Blocks of the training logs, ready for any number of models.
#[derive(Debug, Clone)]
pub struct DriveWitness {
    /// For each log: bins that lie in each block, and its centre in time.
    blocks: Vec<Vec<(std::ops::Range<usize>, f64)>>,
    /// For each log: number of samples of each bin.
    sizes: Vec<Vec<f64>>,
    /// τ2 − T_shown of all blocks.
    measured: DVector<f64>,
    /// Orthonormal columns that span the regressors.
    span: DMatrix<f64>,
    /// Standard deviation of a block.
    noise_std: f64,
}

impl DriveWitness {
    /// Blocks of the given records; `None` where M2's torque is not logged or the disc hardly turns.
    pub fn new(records: &[&Record], bins: &[&[Bin]]) -> Option<Self> {
        let mut blocks = Vec::new();
        let mut rows: Vec<[f64; 5]> = Vec::new();
        let mut measured = Vec::new();
        let mut jumps = Vec::new();
        let mut channel_noise: f64 = 0.0;
        for (record, bins) in records.iter().zip(bins) {
            let bin_of = |sample: usize| bins.partition_point(|bin| bin.to <= sample);
            let torque = record.m2_torque_nm.as_ref()?;
            let (speed, _) = record.inputs(None);
            let mut own = Vec::new();
            let mut from = 0;
            let mut last: Option<(usize, f64)> = None;
            while from + 1 < record.len() {
                let end_s = record.time_s[from] + BLOCK_S;
                let mut to = from + 1;
                while to + 1 < record.len() && record.time_s[to] < end_s - 1e-9 {
                    to += 1;
                }
                let inside = from..to;
                let direction = speed[from].signum();
                let slides = (from..=to).all(|i| speed[i] * direction > SLOWEST_RAD_S);
                let clipped = inside.clone().any(|i| torque.clipped(i) || record.friction_nm.clipped(i));
                if slides && !clipped {
                    let mean = |values: &[f64]| {
                        inside.clone().map(|i| 0.5 * (values[i] + values[i + 1])).sum::<f64>()
                            / inside.len() as f64
                    };
                    let span_s = record.time_s[to] - record.time_s[from];
                    let acceleration = (speed[to] - speed[from]) / span_s;
                    let turning = mean(&speed);
                    let value = mean(&torque.values) - mean(&record.friction_nm.values);
                    let forward = f64::from(u8::from(turning > 0.0));
                    rows.push([
                        acceleration,
                        forward,
                        1.0 - forward,
                        forward * turning,
                        (1.0 - forward) * turning,
                    ]);
                    if let Some((end, before)) = last
                        && end == from
                        && acceleration.abs() < 2.0
                    {
                        jumps.push((value - before).abs());
                    }
                    last = Some((to, value));
                    measured.push(value);
                    own.push((
                        bin_of(from)..bin_of(to).max(bin_of(from) + 1),
                        0.5 * (record.time_s[from] + record.time_s[to]),
                    ));
                }
                from = to;
            }
            let per_block = (BLOCK_S / record.step_s).max(1.0);
            let variance = torque.noise_std.powi(2) + record.friction_nm.noise_std.powi(2);
            channel_noise = channel_noise.max((variance / per_block).sqrt());
            blocks.push(own);
        }
        if rows.len() < 50 || jumps.len() < 20 {
            return None;
        }
        let matrix = DMatrix::from_fn(rows.len(), 5, |i, j| rows[i][j]);
        let middle = jumps.len() / 2;
        let median = *jumps.select_nth_unstable_by(middle, f64::total_cmp).1;
        // The difference of two blocks has √2 of the deviation of one; 0.6745 is the median of |N(0,1)|.
        let noise_std = (median / (0.6745 * std::f64::consts::SQRT_2)).max(channel_noise);
        (noise_std > 0.0).then(|| Self {
            blocks,
            sizes: bins.iter().map(|bins| bins.iter().map(|bin| bin.len() as f64).collect()).collect(),
            measured: DVector::from_vec(measured),
            span: orthonormal(matrix),
            noise_std,
        })
    }

    /// Residuals of all blocks over their standard deviation, for the models' torques of each log.
    pub fn residuals(&self, torques: &[Torques]) -> Vec<f64> {
        let logs = self.blocks.iter().zip(&self.sizes).zip(torques);
        let beyond = logs.flat_map(|((blocks, sizes), torques)| {
            blocks.iter().map(|(bins, _)| {
                let (mut sum, mut count) = (0.0, 0.0);
                for bin in bins.clone() {
                    sum += sizes[bin] * (torques.shown_nm[bin] - torques.true_nm[bin]);
                    count += sizes[bin];
                }
                sum / count
            })
        });
        let y = &self.measured + DVector::from_iterator(self.measured.len(), beyond);
        let explained = &self.span * (self.span.transpose() * &y);
        ((y - explained) / self.noise_std).iter().copied().collect()
    }

    /// Times of the blocks of each log.
    pub fn times_s(&self) -> Vec<Vec<f64>> {
        self.blocks.iter().map(|blocks| blocks.iter().map(|block| block.1).collect()).collect()
    }
}

/// Orthonormal basis of the columns; columns that add nothing are dropped.
fn orthonormal(matrix: DMatrix<f64>) -> DMatrix<f64> {
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in matrix.column_iter() {
        let mut vector: DVector<f64> = column.into_owned();
        let size = vector.norm();
        for other in &basis {
            let share = other.dot(&vector);
            vector -= other * share;
        }
        if vector.norm() > 1e-6 * size && size > 0.0 {
            let norm = vector.norm();
            basis.push(vector / norm);
        }
    }
    if basis.is_empty() { DMatrix::zeros(matrix.nrows(), 1) } else { DMatrix::from_columns(&basis) }
}
