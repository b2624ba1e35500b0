//! Slow noise of the friction bridge: what contact and drive leave alike.
//!
//! The bridge shows the torque on the disc with an error e. Where the tip slides the contact's residual has e as it is, and the
//! drive's has −e everywhere, since the motor bears the true torque. No wrong law of friction or bearing is in both. So
//!
//! var e̅ = −mean(r̅_contact r̅_drive)
//!
//! of means over blocks; as far as that is no larger than the bridge's white noise, it is noise that is slower than from sample to
//! sample, as amplifiers have it.

use std::collections::BTreeMap;

/// Residuals of a balance, all points of all logs on end, and the rows that take part.
#[derive(Debug, Clone, Copy)]
pub(super) struct Left<'l> {
    pub(super) residual: &'l [f64],
    pub(super) rows: &'l [usize],
}

impl Left<'_> {
    /// Means over blocks of so many points, by log and place in it.
    fn means(
        &self,
        starts: &[usize],
        block: usize,
        counts: impl Fn(usize) -> bool,
    ) -> BTreeMap<(usize, usize), f64> {
        let mut sums: BTreeMap<(usize, usize), (f64, f64)> = BTreeMap::new();
        for &i in self.rows.iter().filter(|i| counts(**i)) {
            let log = starts.partition_point(|start| *start <= i).saturating_sub(1);
            let (sum, count) = sums.entry((log, (i - starts[log]) / block)).or_default();
            (*sum, *count) = (*sum + self.residual[i], *count + 1.0);
        }
        sums.into_iter().map(|(block, (sum, count))| (block, sum / count)).collect()
    }
}

/// Variance of means of the bridge's error over blocks of so many points, at the points that count; the logs begin at these points.
/// Between none and that of its white noise.
pub(super) fn variance_of_mean(
    [contact, drive]: [Left<'_>; 2],
    starts: &[usize],
    block: usize,
    white: f64,
    counts: impl Fn(usize) -> bool,
) -> f64 {
    let of_drive = drive.means(starts, block, &counts);
    let of_contact = contact.means(starts, block, &counts);
    let alike = of_contact.iter().filter_map(|(block, contact)| Some(-contact * of_drive.get(block)?));
    let (sum, count) = alike.fold((0.0, 0.0f64), |(sum, count), product| (sum + product, count + 1.0));
    (sum / count.max(1.0)).clamp(0.0, white)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    const POINTS: usize = 40_000;
    const BLOCK: usize = 50;

    /// Variance found in two logs of an error of this size that lasts a block and a half, where the tip slides in every other
    /// block; beside it a law of friction and one of a bearing that are wrong.
    fn found(size: f64, own: f64) -> [f64; 2] {
        let kept = f64::exp(-1.0 / (1.5 * BLOCK as f64));
        let mut state = 0.0;
        let error: Vec<f64> = white(POINTS, 3)
            .into_iter()
            .map(|new| {
                state = kept * state + (1.0 - kept * kept).sqrt() * new;
                size * state
            })
            .collect();
        let slides = |i: usize| (i / BLOCK).is_multiple_of(2);
        let wrong = |turn: f64| move |i: usize| own * (turn * i as f64).sin();
        let contact: Vec<f64> =
            (0..POINTS).map(|i| if slides(i) { error[i] } else { 0.0 } + wrong(0.013)(i)).collect();
        let drive: Vec<f64> = (0..POINTS).map(|i| wrong(0.0071)(i) - error[i]).collect();
        let rows: Vec<usize> = (0..POINTS).collect();
        let left = [&contact, &drive].map(|residual| Left { residual, rows: &rows });
        let starts = [0, POINTS / 2];
        [
            variance_of_mean(left, &starts, BLOCK, 1.0, |_| true),
            variance_of_mean(left, &starts, BLOCK, 1.0, slides),
        ]
    }

    #[test]
    fn what_both_leave_is_the_bridges_and_what_one_leaves_is_not() {
        // Means over two thirds of its time constant keep four fifths of its variance.
        let [of_all, sliding] = found(0.5, 0.0);
        assert!((sliding / (0.8 * 0.25) - 1.0).abs() < 0.15, "{sliding}");
        assert!((2.0 * of_all / sliding - 1.0).abs() < 0.05, "{of_all} of {sliding}");
        let [_, beside_wrong_laws] = found(0.5, 0.5);
        assert!((beside_wrong_laws / sliding - 1.0).abs() < 0.2, "{beside_wrong_laws} for {sliding}");
        let [of_all, sliding] = found(0.0, 0.5);
        assert!(of_all.max(sliding) < 0.01, "{of_all} {sliding}");
        // What is larger than its white noise is no noise.
        assert_eq!(found(3.0, 0.0)[1], 1.0);
    }
}
