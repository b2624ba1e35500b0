//! A log whose friction and normal force are at the full control rate where the firmware's capture has them.
//!
//! Telemetry sends each tenth tick; the capture has every tick for two seconds. Both come from the same record of
//! the control tick, so where they meet they must agree: the friction torques are compared, and a capture that
//! is shifted by a tick is refused. Signals the capture does not hold are interpolated.

use crate::error::BenchError;
use host_sim::files::log::Log;
use host_sim::files::signal::Signal;
use host_sim::link::capture::Captured;

/// The log with the capture's rows in place of its own. `start_tick` is the experiment's first control tick.
pub(crate) fn spliced(
    log: &Log,
    captured: &Captured,
    start_tick: u64,
    tick_hz: u32,
) -> Result<Log, BenchError> {
    let first = captured.info.trigger_tick as f64 - f64::from(captured.info.rows_before) - start_tick as f64;
    // Whole ticks over the rate, as in the log: the same instants are the same numbers.
    let times: Vec<f64> =
        (0..captured.rows.len()).map(|row| (first + row as f64) / f64::from(tick_hz)).collect();
    splice(log, &captured.log(), &times)
}

fn column(table: &Log, signal: Signal) -> Result<&[f64], BenchError> {
    table.signal(signal).ok_or_else(|| BenchError::Check(format!("the log has no {}", signal.column())))
}

fn splice(log: &Log, capture: &Log, fine: &[f64]) -> Result<Log, BenchError> {
    let times = column(log, Signal::Time)?;
    let (Some(&from_s), Some(&to_s)) = (times.first(), times.last()) else { return Ok(log.clone()) };
    let first = fine.partition_point(|t| *t < from_s);
    let last = fine.partition_point(|t| *t <= to_s);
    if first >= last {
        return Ok(log.clone());
    }
    let before = times.partition_point(|t| *t < fine[first]);
    let after = times.partition_point(|t| *t <= fine[last - 1]);
    agree(log, capture, &times[before..after], fine, before)?;
    let join =
        |coarse: &[f64], fine: &[f64]| [&coarse[..before], &fine[first..last], &coarse[after..]].concat();
    let mut whole = Log::default();
    for signal in [Signal::FrictionTorque, Signal::NormalForce] {
        whole.set_signal(signal, join(column(log, signal)?, column(capture, signal)?));
    }
    for signal in [Signal::M2Speed, Signal::M2Angle] {
        let coarse = column(log, signal)?;
        let interpolated: Vec<f64> = fine.iter().map(|t| interpolate(times, coarse, *t)).collect();
        whole.set_signal(signal, join(coarse, &interpolated));
    }
    whole.set_signal(Signal::Time, join(times, fine));
    Ok(whole)
}

/// Friction torque in both tables at the instants they share: the same code, so the same number but for rounding.
fn agree(log: &Log, capture: &Log, shared: &[f64], fine: &[f64], before: usize) -> Result<(), BenchError> {
    let (Some(coarse), Some(full)) =
        (log.signal(Signal::FrictionTorque), capture.signal(Signal::FrictionTorque))
    else {
        return Ok(());
    };
    for (nth, time_s) in shared.iter().enumerate() {
        let at = fine.partition_point(|t| t < time_s);
        let both = (coarse[before + nth], full[at]);
        // A hundredth of a code of the friction bridge (0.37 mN·m): `f32` in the firmware, `f64` here.
        if (both.0 - both.1).abs() > 1e-5 {
            return Err(BenchError::Check(format!(
                "log and capture disagree at {time_s} s: friction torque {} and {}",
                both.0, both.1
            )));
        }
    }
    Ok(())
}

fn interpolate(times: &[f64], values: &[f64], at: f64) -> f64 {
    let next = times.partition_point(|t| *t < at).clamp(1, times.len() - 1);
    let (t0, t1) = (times[next - 1], times[next]);
    values[next - 1] + (values[next] - values[next - 1]) * (at - t0) / (t1 - t0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Friction 2 + sin, normal 80 + t, every `step` ticks from `from` to `to`.
    fn table(from: u32, to: u32, step: usize) -> Log {
        let times: Vec<f64> = (from..to).step_by(step).map(|tick| f64::from(tick) / 10_000.0).collect();
        let signal = |f: fn(f64) -> f64| times.iter().map(|t| f(*t)).collect::<Vec<f64>>();
        let mut log = Log::default();
        log.set_signal(Signal::FrictionTorque, signal(|t| 2.0 + (300.0 * t).sin()));
        log.set_signal(Signal::NormalForce, signal(|t| 80.0 + t));
        log.set_signal(Signal::M2Speed, signal(|t| 3.0 * t));
        log.set_signal(Signal::M2Angle, signal(|t| 1.5 * t));
        log.set_signal(Signal::Time, times);
        log
    }

    #[test]
    fn the_fine_rows_take_the_place_of_the_coarse_ones_and_nothing_else_changes() {
        let (log, capture) = (table(0, 1000, 10), table(295, 605, 1));
        let whole = splice(&log, &capture, capture.time_s()).unwrap();
        assert!(whole.time_s().windows(2).all(|pair| pair[0] < pair[1]));
        assert_eq!(whole.time_s().len(), 100 + 310 - 31);
        let friction = whole.signal(Signal::FrictionTorque).unwrap();
        for (t, value) in whole.time_s().iter().zip(friction) {
            assert!((value - (2.0 + (300.0 * t).sin())).abs() < 1e-12);
        }
        // Linear signals survive the interpolation; 1e-12 is rounding.
        let speed = whole.signal(Signal::M2Speed).unwrap();
        assert!(whole.time_s().iter().zip(speed).all(|(t, value)| (value - 3.0 * t).abs() < 1e-12));
    }

    #[test]
    fn a_capture_that_is_off_by_one_tick_is_refused() {
        let (log, capture) = (table(0, 1000, 10), table(295, 605, 1));
        for shift in [-1.0, 1.0] {
            let times: Vec<f64> = (0..310).map(|k| (295.0 + f64::from(k) + shift) / 10_000.0).collect();
            let refused = splice(&log, &capture, &times).unwrap_err();
            assert!(refused.to_string().contains("disagree"), "{refused}");
        }
    }

    #[test]
    fn a_capture_outside_the_log_changes_nothing() {
        let (log, capture) = (table(0, 1000, 10), table(2000, 2100, 1));
        assert_eq!(splice(&log, &capture, capture.time_s()).unwrap().time_s(), log.time_s());
    }
}
