//! The ticks' times as a line of words: what share of them lies in which range.

use rig_link::telemetry::{Health, Histogram};

/// Shares below this are not worth a word, but the last range that is not empty is: it has the worst.
const LEAST_PERCENT: f64 = 0.05;

/// The ranges that hold something, as `≥ begin: share`, in `unit`; nothing before the first tick.
pub(super) fn shares<const B: u32>(histogram: &Histogram<B>, unit: &str) -> String {
    let total: f64 = histogram.counts.iter().map(|count| f64::from(*count)).sum();
    let last = histogram.counts.iter().rposition(|count| *count > 0);
    let words = histogram.counts.iter().enumerate().filter_map(|(bin, count)| {
        let percent = 100.0 * f64::from(*count) / total;
        let begin = Histogram::<B>::begin(bin);
        match percent {
            percent if percent >= LEAST_PERCENT => Some(format!("≥{begin} {unit} {percent:.1} %")),
            _ if Some(bin) == last => Some(format!("≥{begin} {unit} {count} times")),
            _ => None,
        }
    });
    words.collect::<Vec<_>>().join(", ")
}

/// What was ever used of the stack.
pub(super) fn stack_percent(health: &Health) -> u32 {
    let (used, size) = health.stack;
    (100 * used).checked_div(size).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rig_link::telemetry::CycleHistogram;

    #[test]
    fn rare_ranges_are_left_out_but_for_the_worst() {
        let mut histogram = CycleHistogram::default();
        assert_eq!(shares(&histogram, "cycles"), "");
        histogram.counts[3] = 9_000;
        histogram.counts[4] = 6_000;
        histogram.counts[5] = 1;
        histogram.counts[9] = 2;
        assert_eq!(
            shares(&histogram, "cycles"),
            "≥2048 cycles 60.0 %, ≥3072 cycles 40.0 %, ≥16384 cycles 2 times"
        );
    }
}
