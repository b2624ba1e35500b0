//! Fewer points for a line, with a bound on the error.
//!
//! Points are left out where the straight line between the points kept passes within a tolerance of every one of
//! them, measured along y. It is the swinging-door search: from the last point kept, each new point narrows the
//! sector of slopes that passes all points so far; when a point leaves the sector, the one before it is kept. One
//! pass, every kept point is a sample. Plain decimation would lose a 1 ms peak; this cannot, as long as the
//! peak is higher than the tolerance.

/// Indices of the points to keep; the first and the last always are. `tolerance` may differ from point to point.
pub fn keep(x: &[f64], y: &[f64], tolerance: impl Fn(usize) -> f64) -> Vec<usize> {
    let n = x.len().min(y.len());
    if n < 3 {
        return (0..n).collect();
    }
    let mut kept = vec![0];
    let (mut anchor, mut low, mut high) = (0, f64::NEG_INFINITY, f64::INFINITY);
    let (mut before, mut start) = ((x[0], y[0]), (x[0], y[0]));
    for (i, point) in x.iter().copied().zip(y.iter().copied()).enumerate().skip(1) {
        let slope = (point.1 - start.1) / (point.0 - start.0);
        if !(low..=high).contains(&slope) && i - anchor > 1 {
            (anchor, start) = (i - 1, before);
            kept.push(anchor);
            (low, high) = (f64::NEG_INFINITY, f64::INFINITY);
        }
        let dx = point.0 - start.0;
        let t = tolerance(i);
        low = low.max((point.1 - t - start.1) / dx);
        high = high.min((point.1 + t - start.1) / dx);
        before = point;
    }
    kept.push(n - 1);
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(x: &[f64], y: &[f64], kept: &[usize]) -> f64 {
        kept.windows(2)
            .flat_map(|w| {
                let (a, b) = (w[0], w[1]);
                (a..=b).map(move |i| (y[a] + (y[b] - y[a]) * (x[i] - x[a]) / (x[b] - x[a]) - y[i]).abs())
            })
            .fold(0.0, f64::max)
    }

    #[test]
    fn no_point_left_out_is_further_from_the_line_than_the_tolerance() {
        let x: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let y: Vec<f64> = x.iter().map(|x| (3.0 * x).sin() + 0.2 * (71.0 * x).sin() * (-x).exp()).collect();
        for tolerance in [1e-4, 1e-2, 0.3] {
            let kept = keep(&x, &y, |_| tolerance);
            assert!(worst(&x, &y, &kept) <= tolerance * (1.0 + 1e-9));
            assert!(kept.len() < x.len() / 2, "{} points at {tolerance}", kept.len());
        }
    }

    #[test]
    fn a_peak_of_one_sample_survives() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        let mut y = vec![1.0; 1000];
        y[500] = 2.0;
        let kept = keep(&x, &y, |_| 0.4);
        assert!(kept.contains(&500) && kept.len() <= 5, "{kept:?}");
    }

    #[test]
    fn a_straight_line_is_its_two_ends_and_short_lines_stay() {
        let x: Vec<f64> = (0..1000).map(f64::from).collect();
        assert_eq!(keep(&x, &x, |_| 1e-9), [0, 999]);
        assert_eq!(keep(&x[..2], &x[..2], |_| 1.0), [0, 1]);
        assert!(keep(&[], &[], |_| 1.0).is_empty());
    }
}
