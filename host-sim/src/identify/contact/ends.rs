//! Ends of a channel's range, hard or with a knee.
//!
//! What is shown is the core's law, [`AdcSaturation`]. The way back is taken up to where the channel follows by a fifth: from
//! there on noise is all that it would show.

use model_core::extension::adc_saturation::AdcSaturation;

/// The smallest slope of the channel that is worth a way back.
const LEAST_SLOPE: f64 = 0.2;

/// Ends of a range, in the unit of what is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    low: f64,
    high: f64,
    knee: f64,
}

impl Ends {
    /// Without a knee.
    pub fn hard((low, high): (f64, f64)) -> Self {
        Self::with_knee((low, high), 0.0)
    }

    /// With a knee so wide, a small part of the range.
    pub fn with_knee((low, high): (f64, f64), knee: f64) -> Self {
        Self { low, high, knee }
    }

    /// Lower and upper end.
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Whether what is shown between the ends is another than what acts.
    pub fn bend(&self) -> bool {
        self.knee > 0.0
    }

    /// What is shown of a value.
    pub fn shown(&self, acts: f64) -> f64 {
        AdcSaturation::shown(&[self.low, self.high, self.knee], acts)
    }

    /// What is shown where the channel follows by a fifth, on either side.
    pub fn told_between(&self) -> (f64, f64) {
        let near = -self.knee * (1.0 - LEAST_SLOPE).ln();
        (self.low + near, self.high - near)
    }

    /// What acts where this is shown; further out as much more as is shown more.
    pub fn acts(&self, shown: f64) -> f64 {
        if !self.bend() {
            return shown;
        }
        let (low, high) = self.told_between();
        let told = shown.max(low).min(high);
        let held_back = |inside: f64| -self.knee * (-(-inside / self.knee).exp()).ln_1p();
        shown + held_back(self.high - told) - held_back(told - self.low)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn without_a_knee_it_cuts() {
        let ends = Ends::hard((-2.0, 3.0));
        let values = [-5.0, -2.0, -0.5, 0.0, 1.0, 3.0, 5.0];
        assert_eq!(values.map(|u| ends.shown(u)), [-2.0, -2.0, -0.5, 0.0, 1.0, 3.0, 3.0]);
        assert_eq!(values.map(|y| ends.acts(y)), values);
        assert_eq!(ends.told_between(), (-2.0, 3.0));
        let one = Ends::hard((f64::NEG_INFINITY, 0.5));
        assert_eq!([one.shown(-9.0), one.shown(9.0)], [-9.0, 0.5]);
    }

    #[test]
    fn a_knee_bends_to_its_end_and_back_as_far_as_it_tells() {
        for knee in [0.01, 0.1, 0.3] {
            let ends = Ends::with_knee((-2.0, 3.0), knee);
            let (low, high) = ends.told_between();
            assert!(low > -2.0 && high < 3.0);
            for step in -40..=40 {
                let u = 0.1 * f64::from(step);
                let y = ends.shown(u);
                assert!((-2.0..=3.0).contains(&y), "{u}: {y}");
                if (low..high).contains(&y) {
                    // The other end's knee is e^-15 there.
                    assert!((ends.acts(y) - u).abs() < 1e-6, "{knee}, {u}: {}", ends.acts(y));
                }
            }
            assert!((ends.shown(0.5) - 0.5).abs() < 1e-3 && (ends.shown(1e3) - 3.0).abs() < 1e-9);
            // Its slope is a fifth there, and what is shown beyond is no longer taken back.
            let at = ends.acts(high);
            let slope = (ends.shown(at + 1e-6) - ends.shown(at - 1e-6)) / 2e-6;
            assert!((slope - LEAST_SLOPE).abs() < 1e-4, "{knee}: {slope}");
            assert!((ends.acts(high + 0.1) - at - 0.1).abs() < 1e-6);
        }
    }
}
