//! Single moments that a verdict must not hang on.
//!
//! A stuck element breaks away when its load falls; a micrometre more or less of creep and it does so some
//! hundredths of a second earlier, with an error of the size of the signal. A few such moments can hold most of a residual and
//! say nothing about a law: a cause that is there acts again and again. So what is left is judged once more
//! without the worst `SHARE` of the windows of `WINDOW_S`, and must still be there.

use std::ops::Range;

use super::analysis::{Channel, Fit, Role};

/// Length of a window, s.
const WINDOW_S: f64 = 0.25;
/// Windows that may be single moments.
const SHARE: f64 = 0.05;

/// Which residuals of a fit lie in its worst windows, in the order of logs, channels and samples.
pub struct Moments(Vec<Vec<Vec<bool>>>);

impl Moments {
    /// The worst windows of a fit, over all logs of a role, for each channel on its own.
    pub fn of(fit: &Fit, role: Role) -> Self {
        let mut masks: Vec<Vec<Vec<bool>>> = fit
            .logs
            .iter()
            .map(|log| log.channels.iter().map(|c| vec![false; c.residual.len()]).collect())
            .collect();
        let most = fit.logs.iter().map(|log| log.channels.len()).max().unwrap_or(0);
        for (log, which, range) in (0..most).flat_map(|which| worst(fit, role, which)) {
            masks[log][which][range].fill(true);
        }
        Self(masks)
    }

    /// The fit with these moments masked.
    pub fn taken_from(&self, fit: &Fit) -> Fit {
        let mut rest = fit.clone();
        for (log, masks) in rest.logs.iter_mut().zip(&self.0) {
            for (channel, mask) in log.channels.iter_mut().zip(masks) {
                for (residual, _) in channel.residual.iter_mut().zip(mask).filter(|(_, masked)| **masked) {
                    *residual = f64::NAN;
                }
            }
        }
        rest
    }
}

/// The worst windows of a channel over all logs of a role: log, channel, residuals.
fn worst(fit: &Fit, role: Role, which: usize) -> Vec<(usize, usize, Range<usize>)> {
    let logs = fit.logs.iter().enumerate().filter(|(_, log)| log.role == role);
    let mut all: Vec<(f64, usize, Range<usize>)> = logs
        .filter_map(|(at, log)| Some((at, log.channels.get(which)?)))
        .flat_map(|(at, channel)| windows(channel).into_iter().map(move |(size, range)| (size, at, range)))
        .collect();
    all.sort_by(|a, b| b.0.total_cmp(&a.0));
    all.truncate((SHARE * all.len() as f64).floor() as usize);
    all.into_iter().map(|(_, log, range)| (log, which, range)).collect()
}

/// Windows of a channel that hold residuals, with the sum of their squares.
fn windows(channel: &Channel) -> Vec<(f64, Range<usize>)> {
    let mut found = Vec::new();
    let mut from = 0;
    while from < channel.residual.len() {
        let end_s = channel.time_s[from] + WINDOW_S;
        let to = from + channel.time_s[from..].partition_point(|t| *t < end_s).max(1);
        let own = || channel.residual[from..to].iter().filter(|r| r.is_finite());
        if own().next().is_some() {
            found.push((own().map(|r| r * r).sum(), from..to));
        }
        from = to;
    }
    found
}

#[cfg(test)]
mod tests {
    use super::super::coordinates::Coordinates;
    use super::super::noise::tests::white;
    use super::super::pooled::tests::fit_of;
    use super::super::structure::structures;
    use super::*;
    use crate::files::log::Log;
    use crate::files::signal::Signal;

    fn coordinates() -> Coordinates {
        let time: Vec<f64> = (0..6000).map(|i| f64::from(i) * 0.01).collect();
        let mut log = Log::default();
        log.set_signal(Signal::Position, time.iter().map(|t| t.sin()).collect());
        log.set_signal(Signal::Force, time.iter().map(|t| t.cos()).collect());
        log.set_signal(Signal::Time, time);
        Coordinates::new(&log)
    }

    fn is_material(fit: &Fit) -> bool {
        structures(fit, Role::Train, &[coordinates()])[0].is_material()
    }

    #[test]
    fn two_bursts_in_a_minute_are_moments_and_a_burst_each_second_is_not() {
        let burst_every = |samples: usize, most: usize| {
            let mut residual = white(6000, 5);
            for start in (500..6000).step_by(samples).take(most) {
                residual[start..start + 15].iter_mut().for_each(|r| *r += 20.0);
            }
            fit_of(residual)
        };
        let (few, many) = (burst_every(2000, 2), burst_every(100, 60));
        assert!(is_material(&few) && is_material(&many));
        assert!(!is_material(&Moments::of(&few, Role::Train).taken_from(&few)));
        assert!(is_material(&Moments::of(&many, Role::Train).taken_from(&many)));
    }
}
