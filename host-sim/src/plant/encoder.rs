//! Incremental encoder: exact counts, and the instants of the edges inside a step.
//!
//! count = ⌊angle · counts/2π⌋, as a counter that wraps at 2³². Nothing accumulates, so there is no drift.
//! Within a step the angle is taken as quadratic, from the speeds at both ends; edge instants come from that.
//!
//! Left out: eccentricity of the disc, jitter of the edges.

/// Position of one shaft over one sub-step.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Sweep {
    pub(crate) start_s: f64,
    pub(crate) duration_s: f64,
    pub(crate) angle_rad: f64,
    pub(crate) speed_rad_s: f64,
    pub(crate) end_angle_rad: f64,
}

/// One change of an encoder line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Edge {
    /// Instant after the start of the control period, s.
    pub offset_s: f64,
    /// The count after the edge.
    pub count: i64,
}

impl Edge {
    /// Levels of the lines A and B after the edge; A leads B when the angle rises.
    #[must_use]
    pub fn levels(&self) -> (bool, bool) {
        match self.count.rem_euclid(4) {
            0 => (false, false),
            1 => (true, false),
            2 => (true, true),
            _ => (false, true),
        }
    }
}

/// An encoder.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Encoder {
    counts_per_rad: f64,
}

impl Encoder {
    pub(crate) fn new(counts_per_rev: u32) -> Self {
        Self { counts_per_rad: f64::from(counts_per_rev) / std::f64::consts::TAU }
    }

    /// The count at an angle.
    #[inline]
    #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss)]
    pub(crate) fn count(&self, angle_rad: f64) -> i64 {
        let counts = angle_rad * self.counts_per_rad;
        // ⌊x⌋ without a call into the C library, which is what `floor` is where the target has no instruction for it.
        let towards_zero = counts as i64;
        towards_zero - i64::from(towards_zero as f64 > counts)
    }

    /// Edges of one sweep in order of time.
    pub(crate) fn edges(&self, sweep: &Sweep, into: &mut Vec<Edge>) {
        let x0 = sweep.angle_rad * self.counts_per_rad;
        let x1 = sweep.end_angle_rad * self.counts_per_rad;
        let v = sweep.speed_rad_s * self.counts_per_rad;
        let h = sweep.duration_s;
        // x(t) = x0 + v t + b t²/2 through the end point.
        let b = 2.0 * (x1 - x0 - v * h) / (h * h);
        let turn = if b != 0.0 { -v / b } else { -1.0 };
        if turn > 0.0 && turn < h {
            self.monotone(sweep, [x0, v, b], (0.0, turn), into);
            self.monotone(sweep, [x0, v, b], (turn, h), into);
        } else {
            self.monotone(sweep, [x0, v, b], (0.0, h), into);
        }
    }

    #[allow(clippy::cast_possible_truncation, clippy::cast_precision_loss)]
    fn monotone(&self, sweep: &Sweep, [x0, v, b]: [f64; 3], (from, to): (f64, f64), into: &mut Vec<Edge>) {
        let at = |t: f64| x0 + t * (v + 0.5 * b * t);
        // The ends of a sweep are taken as given, so that counts and edges agree to the last.
        let first = (if from == 0.0 { x0 } else { at(from) }).floor() as i64;
        let end = if to >= sweep.duration_s { sweep.end_angle_rad * self.counts_per_rad } else { at(to) };
        let last = end.floor() as i64;
        let rising = last > first;
        for k in 1..=(last - first).abs() {
            let (count, border) =
                if rising { (first + k, (first + k) as f64) } else { (first - k, (first - k + 1) as f64) };
            let t = crossing(border - x0, v, b, (from, to));
            into.push(Edge { offset_s: sweep.start_s + t, count });
        }
    }
}

/// The time in `range` at which v t + b t²/2 = d.
fn crossing(d: f64, v: f64, b: f64, range: (f64, f64)) -> f64 {
    let mean = 0.5 * (range.0 + range.1);
    // On a monotone stretch v + b t keeps its sign, which picks the root that does not cancel.
    let root = (v * v + 2.0 * b * d).max(0.0).sqrt().copysign(v + b * mean);
    let t = if (v + root).abs() > 0.0 && v * root >= 0.0 { 2.0 * d / (v + root) } else { (root - v) / b };
    if t.is_finite() { t.clamp(range.0, range.1) } else { mean }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sweep(angle: f64, speed: f64, end_speed: f64) -> Sweep {
        let h = 1e-4;
        Sweep {
            start_s: 0.0,
            duration_s: h,
            angle_rad: angle,
            speed_rad_s: speed,
            end_angle_rad: angle + 0.5 * (speed + end_speed) * h,
        }
    }

    #[test]
    fn edges_lead_from_the_count_at_the_start_to_the_count_at_the_end_one_by_one() {
        let encoder = Encoder::new(480_000);
        for (angle, v0, v1) in [
            (0.1, 31.4, 31.4),
            (-3.0, 5.0, 9.0),
            (7.0, -20.0, -19.0),
            (0.0, 0.3, -0.3),
            (0.0, -2.0, 2.0),
            (1e3, 0.0, 3.0),
        ] {
            let s = sweep(angle, v0, v1);
            let mut edges = Vec::new();
            encoder.edges(&s, &mut edges);
            let mut count = encoder.count(s.angle_rad);
            let mut time = 0.0;
            for e in &edges {
                assert_eq!((e.count - count).abs(), 1, "an edge skips a count at {v0} to {v1}");
                assert!(e.offset_s >= time - 1e-18 && e.offset_s <= s.duration_s);
                // Where the edge is due the angle is on a border between counts, to 1e-6 of a count.
                let b = (v1 - v0) / s.duration_s;
                let x = (s.angle_rad + e.offset_s * (v0 + 0.5 * b * e.offset_s)) * encoder.counts_per_rad;
                assert!((x - x.round()).abs() < 1e-4, "edge at {x}");
                (count, time) = (e.count, e.offset_s);
            }
            assert_eq!(count, encoder.count(s.end_angle_rad));
        }
    }

    #[test]
    fn a_leads_b_when_the_angle_rises() {
        let levels: Vec<_> = (0..4).map(|count| Edge { offset_s: 0.0, count }.levels()).collect();
        assert_eq!(levels, [(false, false), (true, false), (true, true), (false, true)]);
        assert_eq!(Edge { offset_s: 0.0, count: -1 }.levels(), (false, true));
    }
}
