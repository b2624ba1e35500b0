//! Peak, settled value and returns of a signal within a stretch of time.

/// Samples of a signal from one time to another.
#[derive(Debug, Clone, Copy)]
pub(super) struct Phase<'a> {
    time_s: &'a [f64],
    values: &'a [f64],
}

/// Whether and when a signal comes back to a value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Return {
    /// It stays near it.
    NeverLeft,
    /// It leaves and crosses it again at this time.
    At(f64),
    /// It leaves for good.
    Never,
}

impl<'a> Phase<'a> {
    /// The samples of [from, to); `None` where there are fewer than two.
    pub(super) fn new(time_s: &'a [f64], values: &'a [f64], from_s: f64, to_s: f64) -> Option<Self> {
        let from = time_s.partition_point(|t| *t < from_s);
        let to = time_s.partition_point(|t| *t < to_s);
        (to >= from + 2).then(|| Self { time_s: &time_s[from..to], values: &values[from..to] })
    }

    fn span(&self) -> (f64, f64) {
        (self.time_s[0], self.time_s[self.time_s.len() - 1])
    }

    /// Mean over the last second, or over the last quarter of a phase shorter than 4 s.
    pub(super) fn settled(&self) -> f64 {
        let (start_s, end_s) = self.span();
        let from_s = end_s - (0.25 * (end_s - start_s)).min(1.0);
        let from = self.time_s.partition_point(|t| *t < from_s);
        let last = &self.values[from..];
        last.iter().sum::<f64>() / last.len() as f64
    }

    /// Time and value of the extreme on the side of `side`.
    pub(super) fn peak(&self, side: f64) -> (f64, f64) {
        let sign = if side < 0.0 { -1.0 } else { 1.0 };
        let mut best = (self.time_s[0], self.values[0]);
        for (t, x) in self.time_s.iter().zip(self.values) {
            if sign * x > sign * best.1 {
                best = (*t, *x);
            }
        }
        best
    }

    /// The value that is farthest from zero.
    pub(super) fn largest_magnitude(&self) -> f64 {
        self.values.iter().fold(0.0, |best: f64, x| if x.abs() > best.abs() { *x } else { best })
    }

    /// When the signal enters the band of ± `part` around its settled value for the last time.
    /// `None` where it is outside at the end.
    pub(super) fn settled_time(&self, part: f64) -> Option<f64> {
        let settled = self.settled();
        let outside = |x: &f64| (x - settled).abs() > part * settled.abs();
        match self.values.iter().rposition(outside) {
            None => Some(self.time_s[0]),
            Some(at) => self.time_s.get(at + 1).copied(),
        }
    }

    /// The value at a time, by straight lines.
    pub(super) fn at(&self, time_s: f64) -> f64 {
        let after = self.time_s.partition_point(|t| *t < time_s).clamp(1, self.time_s.len() - 1);
        let (t0, t1) = (self.time_s[after - 1], self.time_s[after]);
        let (x0, x1) = (self.values[after - 1], self.values[after]);
        x0 + (x1 - x0) * ((time_s - t0) / (t1 - t0)).clamp(0.0, 1.0)
    }

    /// When the signal, after `time_s`, has left `value` by more than `part` of it and crosses it again.
    pub(super) fn comes_back(&self, time_s: f64, value: f64, part: f64) -> Return {
        let from = self.time_s.partition_point(|t| *t <= time_s);
        let off = |x: f64| x - value;
        let Some(left) = self.values[from..].iter().position(|x| off(*x).abs() > part * value.abs()) else {
            return Return::NeverLeft;
        };
        let left = from + left;
        let side = off(self.values[left]).signum();
        match self.values[left..].iter().position(|x| off(*x) * side <= 0.0) {
            None => Return::Never,
            Some(back) => {
                let at = left + back;
                let (x0, x1) = (off(self.values[at - 1]), off(self.values[at]));
                let (t0, t1) = (self.time_s[at - 1], self.time_s[at]);
                Return::At(t0 + (t1 - t0) * x0 / (x0 - x1))
            }
        }
    }
}

/// Mean over whole periods, but the first where there are more, of ∮ torque dθ.
pub(super) fn loop_energy(
    time_s: &[f64],
    angle_rad: &[f64],
    torque_nm: &[f64],
    (from_s, to_s): (f64, f64),
    period_s: f64,
) -> Option<f64> {
    let end_s = to_s.min(*time_s.last()?);
    let whole = ((end_s - from_s) / period_s * (1.0 + 1e-9)).floor();
    if whole < 1.0 {
        return None;
    }
    let skipped = if whole > 1.0 { 1.0 } else { 0.0 };
    let mut work = vec![0.0];
    for (angle, torque) in angle_rad.windows(2).zip(torque_nm.windows(2)) {
        work.push(work[work.len() - 1] + 0.5 * (torque[0] + torque[1]) * (angle[1] - angle[0]));
    }
    let work = Phase { time_s, values: &work };
    let (start_s, end_s) = (from_s + skipped * period_s, from_s + whole * period_s);
    Some((work.at(end_s) - work.at(start_s)) / (whole - skipped))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_energy_of_an_ellipse_is_its_area() {
        let time_s: Vec<f64> = (0..20_000).map(|i| f64::from(i) * 1e-3).collect();
        let angle: Vec<f64> = time_s.iter().map(|t| 0.02 * (2.0 * t).sin()).collect();
        let torque: Vec<f64> = time_s.iter().map(|t| 1.5 * (2.0 * t + 0.3).sin()).collect();
        let energy = loop_energy(&time_s, &angle, &torque, (0.5, 20.0), std::f64::consts::PI);
        let expected = std::f64::consts::PI * 0.02 * 1.5 * 0.3_f64.sin();
        // Trapezia of 1 ms on 2 rad/s: (2e-3)²/6, and ends between samples.
        assert!(energy.is_some_and(|energy| (energy / expected - 1.0).abs() < 1e-5), "{energy:?} {expected}");
        assert_eq!(loop_energy(&time_s, &angle, &torque, (0.5, 3.0), std::f64::consts::PI), None);
    }
}
