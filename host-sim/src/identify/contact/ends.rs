//! Ends of a channel's range, hard or with a knee.
//!
//! What is shown is the core's law, [`AdcSaturation`]. The way back is taken up to where the channel follows by a fifth: from
//! there on noise is all that it would show.

use model_core::extension::adc_saturation::AdcSaturation;
use wide::f64x4;

use super::bristles::FORGOTTEN;

/// The smallest slope of the channel that is worth a way back.
const LEAST_SLOPE: f64 = 0.2;

/// Changes each of these values.
fn in_lanes(values: &mut [f64], of: impl Fn(f64x4) -> f64x4) {
    for some in values.chunks_mut(4) {
        let mut four = [0.0; 4];
        four[..some.len()].copy_from_slice(some);
        some.copy_from_slice(&of(f64x4::from(four)).to_array()[..some.len()]);
    }
}

/// Ends of a range, in the unit of what is shown.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ends {
    low: f64,
    high: f64,
    knee: f64,
    /// What is shown where the channel follows by a fifth, on either side.
    told: (f64, f64),
}

impl Ends {
    /// Without a knee.
    pub fn hard((low, high): (f64, f64)) -> Self {
        Self::with_knee((low, high), 0.0)
    }

    /// With a knee so wide, a small part of the range.
    pub fn with_knee((low, high): (f64, f64), knee: f64) -> Self {
        let near = -knee * (1.0 - LEAST_SLOPE).ln();
        Self { low, high, knee, told: (low + near, high - near) }
    }

    /// Lower and upper end.
    pub fn range(&self) -> (f64, f64) {
        (self.low, self.high)
    }

    /// Whether what is shown between the ends is another than what acts.
    pub fn bend(&self) -> bool {
        self.knee > 0.0
    }

    /// What is shown of these values, in their place: [`Self::shown`] but for its last digits, some at once.
    pub fn show(&self, values: &mut [f64]) {
        if !self.bend() {
            return values.iter_mut().for_each(|x| *x = self.shown(*x));
        }
        let knee = f64x4::splat(self.knee);
        let beyond = |excess: f64x4| {
            let small = (-(excess / knee).abs()).max(f64x4::splat(-FORGOTTEN)).exp();
            excess.max(f64x4::ZERO) + knee * (small + f64x4::ONE).ln()
        };
        let [low, high] = [self.low, self.high].map(f64x4::splat);
        in_lanes(values, |acts| acts + beyond(low - acts) - beyond(acts - high));
    }

    /// What is shown of a value.
    pub fn shown(&self, acts: f64) -> f64 {
        AdcSaturation::shown(&[self.low, self.high, self.knee], acts)
    }

    /// What is shown where the channel follows by a fifth, on either side.
    pub fn told_between(&self) -> (f64, f64) {
        self.told
    }

    /// What acts where these are shown, in their place; further out as much more as is shown more.
    pub fn act(&self, values: &mut [f64]) {
        if !self.bend() {
            return;
        }
        let knee = f64x4::splat(self.knee);
        let held_back = |inside: f64x4| {
            let small = (-inside / knee).max(f64x4::splat(-FORGOTTEN)).exp();
            -knee * (f64x4::ONE - small).ln()
        };
        let [low, high] = [self.low, self.high].map(f64x4::splat);
        let told = [self.told.0, self.told.1].map(f64x4::splat);
        in_lanes(values, |shown| {
            let at = shown.max(told[0]).min(told[1]);
            shown + held_back(high - at) - held_back(at - low)
        });
    }

    /// The same of one value.
    pub fn acts(&self, shown: f64) -> f64 {
        let mut one = [shown];
        self.act(&mut one);
        one[0]
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
    fn many_values_are_shown_as_each_is() {
        for ends in [
            Ends::hard((-2.0, 3.0)),
            Ends::with_knee((-2.0, 3.0), 0.2),
            Ends::with_knee((f64::NEG_INFINITY, 3.0), 0.01),
        ] {
            let values: Vec<f64> = (-50..=51).map(|step| 0.1 * f64::from(step)).collect();
            let mut shown = values.clone();
            ends.show(&mut shown);
            for (shown, acts) in shown.iter().zip(&values) {
                // The lanes' logarithm has ln 2 to 5e-14, and there are some of it.
                assert!((shown - ends.shown(*acts)).abs() < 1e-12, "{acts}: {shown}");
            }
        }
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
