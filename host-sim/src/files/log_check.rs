//! What time and the names of a log must fulfil before anything is computed from it.

use super::log::Log;
use super::signal::Signal;
use crate::input_error::InputError;

/// Longest step that is never a gap: a little over the 5 ms of 200 Hz.
const ALWAYS_ALLOWED_STEP_S: f64 = 6e-3;
/// A longer step is a gap where it is this much longer than nine tenths of the log's steps.
const GAP_FACTOR: f64 = 10.0;

/// Checks names, time and gaps.
pub(super) fn check(log: &Log) -> Result<(), InputError> {
    check_units(log)?;
    let time_s = log.require(Signal::Time)?;
    if time_s.len() < 2 {
        return Err(InputError::new("has only one sample").file(log.source.as_str()).allowed("two or more"));
    }
    check_time(log, time_s)
}

/// A known quantity in another unit must not pass as an unknown column.
fn check_units(log: &Log) -> Result<(), InputError> {
    let rotary = log.columns.iter().filter_map(|column| Signal::named(&column.name)).any(|signal| {
        !matches!(signal, Signal::Time | Signal::Force | Signal::Position | Signal::SurfaceTemperature)
    });
    for column in &log.columns {
        let Some(meant) = Signal::meant_by(&column.name) else { continue };
        let is_linear = matches!(meant, Signal::Force | Signal::Position);
        if log.signal(meant).is_none() && !(is_linear && rotary) {
            return Err(InputError::new("wrong unit or spelling in the column's name")
                .file(log.source.as_str())
                .key(column.name.as_str())
                .allowed(format!("{} with values in {}", meant.column(), meant.unit())));
        }
    }
    Ok(())
}

fn check_time(log: &Log, time_s: &[f64]) -> Result<(), InputError> {
    let refuse = |sample: usize, problem: String| {
        InputError::new(problem)
            .file(log.source.as_str())
            .line(log.line_of(sample))
            .key(Signal::Time.column())
            .value(time_s[sample])
    };
    let mut steps_s = Vec::with_capacity(time_s.len());
    for (at, pair) in time_s.windows(2).enumerate() {
        let step_s = pair[1] - pair[0];
        if step_s <= 0.0 {
            let what = if step_s < 0.0 { "time goes back" } else { "time stands still" };
            return Err(refuse(at + 1, format!("{what}, the sample before is at {} s", pair[0]))
                .allowed("strictly increasing time"));
        }
        steps_s.push(step_s);
    }
    let longest_s = steps_s.iter().copied().fold(0.0, f64::max);
    if longest_s <= ALWAYS_ALLOWED_STEP_S {
        return Ok(());
    }
    let mut sorted = steps_s.clone();
    let rank = (sorted.len() - 1) * 9 / 10;
    let (_, ninetieth_s, _) = sorted.select_nth_unstable_by(rank, f64::total_cmp);
    let limit_s = (*ninetieth_s * GAP_FACTOR).max(ALWAYS_ALLOWED_STEP_S);
    match steps_s.iter().position(|step_s| *step_s > limit_s) {
        Some(at) => Err(refuse(at + 1, format!("gap of {:.6} s before this sample", steps_s[at]))
            .allowed(format!("{} (here {limit_s:.6} s)", Log::GAP_RULE))),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn log(times_s: impl IntoIterator<Item = f64>) -> String {
        let lines: Vec<String> = times_s.into_iter().map(|t| format!("{t}\n")).collect();
        format!("# a: b\ntime_s\n{}", lines.concat())
    }

    fn refused(text: &str) -> String {
        Log::parse_csv("l.csv", text.as_bytes()).unwrap_err().to_string()
    }

    #[test]
    fn time_that_stands_still_or_goes_back_is_refused_with_its_line() {
        assert_eq!(
            refused(&log([0.0, 0.1, 0.05])),
            "l.csv:5: time_s = 0.05: time goes back, the sample before is at 0.1 s; allowed: strictly increasing time"
        );
        assert!(refused(&log([0.0, 0.1, 0.1])).contains("time stands still"));
        assert!(refused(&log([0.0])).contains("only one sample"));
    }

    #[test]
    fn a_gap_is_refused_with_its_line() {
        let times = (0..100).map(|i| f64::from(i) * 1e-3 + if i < 50 { 0.0 } else { 0.02 });
        let error = refused(&log(times));
        assert!(
            error.starts_with("l.csv:53: time_s = 0.07: gap of 0.021000 s before this sample"),
            "{error}"
        );
    }

    #[test]
    fn uneven_sampling_is_no_gap() {
        // Steps drawn from an exponential distribution with a mean of 1 ms, by its inverse at golden-ratio points.
        let mut time_s = 0.0;
        let times: Vec<f64> = (1..20_000)
            .map(|i| {
                time_s += -1e-3 * (1.0 - (f64::from(i) * 0.618_033_988_749_895).fract()).ln();
                time_s
            })
            .collect();
        assert!(Log::parse_csv("l.csv", log(times).as_bytes()).is_ok());
        // 20 kHz with some stretches of 200 Hz.
        let mut time_s = 0.0;
        let times: Vec<f64> = (0..4000)
            .map(|i| {
                time_s += if i % 1000 > 970 { 5e-3 } else { 5e-5 };
                time_s
            })
            .collect();
        assert!(Log::parse_csv("l.csv", log(times).as_bytes()).is_ok());
    }

    #[test]
    fn a_known_quantity_in_another_unit_names_the_column_that_was_meant() {
        let error = refused("time_s,normal_force_kn\n0,1\n1,2\n");
        assert_eq!(
            error,
            "l.csv: normal_force_kn: wrong unit or spelling in the column's name; \
             allowed: normal_force_n with values in newtons"
        );
        assert!(refused("time_ms,normal_force_n\n0,1\n1,2\n").contains("time_s with values in seconds"));
        let both = "time_s,m2_speed_rad_s,m2_speed_rpm\n0,1,9.5\n1,1,9.5\n";
        assert!(Log::parse_csv("l.csv", both.as_bytes()).is_ok(), "both units there: the SI one counts");
    }

    #[test]
    fn a_missing_column_is_named_and_those_there_are_listed() {
        let log = Log::parse_csv("l.csv", b"time_s,m2_speed_rad_s,normal_force_n\n0,1,2\n1,1,2\n").unwrap();
        assert_eq!(
            log.contact().unwrap_err().to_string(),
            "l.csv: column friction_torque_nm is missing; allowed: this column in SI units; \
             the file has time_s, m2_speed_rad_s, normal_force_n"
        );
    }
}
