//! A channel that clips shows one value, exactly, for many samples on end, and nothing beyond it.
//!
//! Noise changes a channel from sample to sample, so runs of one value are short, except where the
//! channel has none or is coarser than its noise; then runs are long everywhere, a slow crest looks like
//! a clip, and nothing is claimed. Else an end of a channel is a clip where a run at the extreme is long.
//! A torque monitor that stands still because its demand stands at a limit is no clip.

/// Least samples of one value on end.
const LEAST_RUN: usize = 6;
/// Longest that nine tenths of the other runs may be.
const USUAL_RUN: usize = 2;

/// Ends of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Clipping {
    /// Lowest value that it shows, where it clips there.
    pub low: Option<f64>,
    /// Highest value that it shows, where it clips there.
    pub high: Option<f64>,
}

impl Clipping {
    /// Whether a value lies on an end.
    pub fn holds(&self, value: f64) -> bool {
        self.low.is_some_and(|low| value <= low) || self.high.is_some_and(|high| value >= high)
    }

    /// Whether there is no end.
    pub fn is_none(&self) -> bool {
        self.low.is_none() && self.high.is_none()
    }
}

/// Looks for the ends of a channel. `demand` is what a torque monitor should show.
pub fn scan(values: &[f64], demand: Option<&[f64]>) -> Clipping {
    let highest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    let lowest = values.iter().copied().fold(f64::INFINITY, f64::min);
    if values.len() < 2 * LEAST_RUN || highest <= lowest {
        return Clipping::default();
    }
    let end = |value: f64| is_clip(values, value, demand).then_some(value);
    Clipping { low: end(lowest), high: end(highest) }
}

fn is_clip(values: &[f64], extreme: f64, demand: Option<&[f64]>) -> bool {
    let (mut at_extreme, mut elsewhere) = (Vec::new(), Vec::new());
    let mut from = 0;
    for at in 1..=values.len() {
        if at == values.len() || values[at] != values[from] {
            let run = (from, at - from);
            if values[from] == extreme {
                at_extreme.push(run)
            } else {
                elsewhere.push(run.1)
            }
            from = at;
        }
    }
    let Some((start, longest)) = at_extreme.into_iter().max_by_key(|(_, length)| *length) else {
        return false;
    };
    elsewhere.sort_unstable();
    let usual = elsewhere.get(elsewhere.len() * 9 / 10).copied().unwrap_or(0);
    let demanded = demand.is_some_and(|demand| {
        let stretch = &demand[start..start + longest];
        stretch.iter().all(|x| *x == stretch[0])
    });
    longest >= LEAST_RUN && usual <= USUAL_RUN && !demanded
}

#[cfg(test)]
mod tests {
    use super::super::noise::tests::white;
    use super::*;

    fn swinging(noise_std: f64) -> Vec<f64> {
        white(5000, 9).iter().enumerate().map(|(i, e)| (0.01 * i as f64).sin() + noise_std * e).collect()
    }

    #[test]
    fn a_cut_swing_clips_and_a_whole_one_does_not() {
        let cut: Vec<f64> = swinging(0.01).iter().map(|x| x.min(0.8)).collect();
        assert_eq!(scan(&cut, None), Clipping { low: None, high: Some(0.8) });
        assert!(scan(&swinging(0.01), None).is_none());
    }

    #[test]
    fn a_coarse_channel_is_not_taken_for_a_clipped_one() {
        let coarse: Vec<f64> = swinging(0.001).iter().map(|x| (x * 20.0).round() / 20.0).collect();
        assert!(scan(&coarse, None).is_none());
    }

    #[test]
    fn a_torque_at_its_demanded_limit_is_not_clipped() {
        let cut: Vec<f64> = swinging(0.01).iter().map(|x| x.min(0.8)).collect();
        let demand = vec![0.8; cut.len()];
        assert!(scan(&cut, Some(&demand)).is_none());
    }
}
