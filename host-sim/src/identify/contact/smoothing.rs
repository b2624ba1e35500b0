//! How widely the friction channel of a log is smoothed, sample by sample, before the slip is observed from it.
//!
//! The channel's noise n makes a noise n/c in the slip. Where that is as fast as the motion, no sample tells slip from stick:
//! the channel is then smoothed further where it is steady, as widely as intersecting confidence intervals allow
//! ([`widest_agreeing`]) and no wider than the noise asks for. The widths are the log's, found once in what the channel shows,
//! so that every hypothesis sees the same filter.

use crate::identify::filters::{gaussian, white_share, white_share_flat, widest_agreeing};

/// Width over which the friction channel is smoothed in any case, samples: at a kilohertz 94 % of
/// what rings at 120 Hz, as the load does, pass, and 6 % of what a torque ring of 600 Hz shows at 400.
pub const OBSERVED_OVER: f64 = 1.2;
/// Wider ones that follow it, in turn, samples: the widest is a few of a block's time constants at a kilohertz.
const WIDER: [f64; 4] = [2.0, 4.0, 8.0, 16.0];
/// Slip that is told from its noise is at most this share of the usual speed: the slowest stretches of a plan are about so slow.
const SLOW_SHARE: f64 = 0.2;

/// Widths of a log.
#[derive(Debug, Clone, Default)]
pub struct Smoothing {
    /// At each sample, the place in `WIDER` from 1 on; 0 where nothing is smoothed further. Empty where it is so everywhere.
    places: Vec<u8>,
}

impl Smoothing {
    /// Of a channel with white noise of this deviation, through which slip is told from noise above `told_m_s` and should be at
    /// this speed, m/s.
    pub fn new(channel: &[f64], noise: f64, told_m_s: f64, usual_m_s: f64) -> Self {
        let enough = |left: f64| left * told_m_s < SLOW_SHARE * usual_m_s;
        let mut places = Vec::new();
        if noise > 0.0 && !enough(1.0) {
            let count = WIDER.iter().position(|width| enough(kept(*width))).map_or(WIDER.len(), |at| at + 1);
            places.resize(channel.len(), 0);
            widest_agreeing([(channel, noise)], &WIDER[..count], |i, at, _| places[i] = at as u8 + 1);
        }
        Self { places }
    }

    /// A channel that was taken ahead by so many samples, and smoothed as far as in any case, smoothed further.
    pub fn further(&self, mut smooth: Vec<f64>, ahead: f64) -> Vec<f64> {
        let places = self.ahead(ahead);
        let wider: Vec<Vec<f64>> =
            WIDER.iter().take(self.most()).map(|width| gaussian(&smooth, *width, 0)).collect();
        for (i, place) in places.into_iter().enumerate().filter(|(_, place)| *place > 0) {
            smooth[i] = wider[usize::from(place) - 1][i];
        }
        smooth
    }

    /// Width at each sample of a channel that was taken ahead by so many: places in [`widths`].
    pub fn ahead(&self, ahead: f64) -> Vec<u8> {
        let last = self.places.len() as isize - 1;
        let by = ahead.round() as isize;
        (0..=last).map(|i| self.places[(i + by).clamp(0, last) as usize]).collect()
    }

    /// How many of the wider ones are in use.
    fn most(&self) -> usize {
        self.places.iter().copied().max().map_or(0, usize::from)
    }
}

/// By place: the width of what follows (0 is nothing), and the deviation of white noise behind both over that behind the first.
pub fn widths() -> impl Iterator<Item = (f64, f64)> {
    std::iter::once((0.0, 1.0)).chain(WIDER.into_iter().map(|width| (width, kept(width))))
}

/// What is left behind both is what the wider one leaves: all that passes it passes the first.
fn kept(width: f64) -> f64 {
    white_share(width) / white_share_flat(OBSERVED_OVER)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::filters::{rms, smoothed_flat};
    use crate::identify::noise::tests::white;

    const NOISE: f64 = 0.1;
    const USUAL_M_S: f64 = 0.3;

    /// A step of thirty deviations in noise.
    fn channel() -> (Vec<f64>, Vec<f64>) {
        let clean: Vec<f64> = (0..4000).map(|i| if i < 2000 { 1.0 } else { 4.0 }).collect();
        let noisy = clean.iter().zip(white(4000, 3)).map(|(x, n)| x + NOISE * n).collect();
        (clean, noisy)
    }

    #[test]
    fn what_is_quiet_enough_is_smoothed_no_further() {
        let (_, noisy) = channel();
        let quiet = Smoothing::new(&noisy, NOISE, 0.19 * USUAL_M_S, USUAL_M_S);
        assert_eq!(quiet.further(noisy.clone(), 0.0), noisy);
        assert!(quiet.ahead(0.0).is_empty());
    }

    #[test]
    fn noise_goes_where_the_channel_is_steady_and_a_step_stays_one() {
        let (clean, noisy) = channel();
        let smooth = smoothed_flat(&noisy, OBSERVED_OVER);
        let off = |values: &[f64], range: std::ops::Range<usize>| {
            rms(&range.map(|i| values[i] - clean[i]).collect::<Vec<_>>())
        };
        // Told above its usual speed: all that is left of the noise at the widest is a quarter of what it was.
        let smoothing = Smoothing::new(&noisy, NOISE, USUAL_M_S, USUAL_M_S);
        let further = smoothing.further(smooth.clone(), 0.0);
        let (_, kept) = widths().last().unwrap();
        let (before, after) = (off(&smooth, 100..1900), off(&further, 100..1900));
        assert!(after < 1.2 * kept * before, "{before} {after}, expected a share of {kept}");
        assert!(off(&further, 1996..2004) < 1.1 * off(&smooth, 1996..2004) + NOISE, "the step is a slope");
        // Half as much noise asks for half as much.
        let less = Smoothing::new(&noisy, NOISE, 0.5 * USUAL_M_S, USUAL_M_S).further(smooth, 0.0);
        assert!(off(&less, 100..1900) > 1.2 * after);
    }

    #[test]
    fn widths_follow_a_channel_that_is_taken_ahead() {
        let (_, noisy) = channel();
        let smoothing = Smoothing::new(&noisy, NOISE, USUAL_M_S, USUAL_M_S);
        let (here, ahead) = (smoothing.ahead(0.0), smoothing.ahead(6.7));
        assert_eq!(here[1000..3000], ahead[993..2993]);
    }
}
