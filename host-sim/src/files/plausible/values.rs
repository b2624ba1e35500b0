//! Single values and the rate of sampling.

use super::{Finding, quantile};
use crate::files::log::Log;
use crate::files::signal::{SIGNALS, Signal};
use crate::input_error::InputError;

/// Larger than anything a rig measures in SI units, angles of days of turning apart.
const ABSURD: f64 = 1e7;
/// A value so many times the 99th percentile, alone, is no part of a signal.
const LONE_FACTOR: f64 = 1000.0;
/// Rates the tool is made for, with room for a clock that is not exact.
const RATES_HZ: std::ops::RangeInclusive<f64> = 190.0..=21_000.0;
/// Beyond these no friction model can be told from another one.
const POSSIBLE_HZ: std::ops::RangeInclusive<f64> = 20.0..=200_000.0;

pub(super) fn findings(log: &Log) -> Vec<Finding> {
    let mut found: Vec<Finding> = SIGNALS.into_iter().filter_map(|signal| absurd(log, signal)).collect();
    found.extend(rate(log));
    found
}

fn absurd(log: &Log, signal: Signal) -> Option<Finding> {
    let values = log.signal(signal).filter(|_| signal != Signal::Time)?;
    let (at, largest) = values.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))?;
    let usual = quantile(values.iter().map(|value| value.abs()), 0.99);
    let lone = usual > 0.0 && largest.abs() > LONE_FACTOR * usual && largest.abs() > 1e3;
    (largest.abs() > ABSURD || lone).then(|| {
        Finding::Impossible(
            InputError::new(format!("no value of this quantity: 99 % of the column lie below {usual:.3e}"))
                .line(log.line_of(at))
                .key(signal.column())
                .value(format!("{largest:e}"))
                .allowed("a log without spikes of the recorder; leave the line out"),
        )
    })
}

fn rate(log: &Log) -> Option<Finding> {
    let time_s = log.time_s();
    let step_s = quantile(time_s.windows(2).map(|pair| pair[1] - pair[0]), 0.5);
    if step_s <= 0.0 || time_s.len() < 10 {
        return None;
    }
    let rate_hz = 1.0 / step_s;
    if RATES_HZ.contains(&rate_hz) {
        return None;
    }
    let unit = [("ms", 1e3), ("us", 1e6), ("ns", 1e9), ("min", 1.0 / 60.0)]
        .into_iter()
        .find(|(_, factor)| rate_hz < *RATES_HZ.start() && RATES_HZ.contains(&(rate_hz * factor)));
    let hint = unit.map_or(String::new(), |(unit, factor)| {
        format!("; if time is in {unit}, that is {:.0} Hz: --unit time_s={unit}", rate_hz * factor)
    });
    let what = format!("a sample every {step_s:.4e} s is a rate of {} Hz{hint}", short(rate_hz));
    if POSSIBLE_HZ.contains(&rate_hz) {
        let sentence = format!("{what}; the tool is made for 200 Hz to 20 kHz");
        return Some(Finding::doubt(Signal::Time.column(), sentence));
    }
    Some(Finding::Impossible(InputError::new(what).key(Signal::Time.column()).allowed("200 Hz to 20 kHz")))
}

/// Four digits, without an exponent.
fn short(value: f64) -> String {
    format!("{value:.3e}").parse::<f64>().unwrap_or(value).to_string()
}
