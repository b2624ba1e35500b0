//! What a model leaves, in bins of a quantity: the mean of each bin with its count.
//!
//! Bins hold the same number of samples, so that every mean is known about as well; where the quantity hardly changes
//! there is nothing to show.

use super::chart::{Chart, Line, Panel, Role};

/// Most bins, and the fewest samples in one.
const MOST: usize = 40;
const FEWEST: usize = 20;

/// One thing to average.
#[derive(Debug, Clone, Copy)]
pub struct Series<'a> {
    /// Name in the legend.
    pub name: &'a str,
    /// What it stands for.
    pub role: Role,
    /// A value for each sample.
    pub values: &'a [f64],
}

/// Mean of each series in bins of `over`, with the standard error of the first in the caption; none where the quantity
/// has fewer than three different bins. `over_title` and `title` carry units behind a comma.
#[must_use]
#[allow(clippy::cast_precision_loss)]
pub fn chart(over_title: &str, over: &[f64], title: &str, series: &[Series<'_>]) -> Option<Chart> {
    let finite = |k: &usize| {
        over[*k].is_finite() && series.iter().all(|s| s.values.get(*k).is_some_and(|v| v.is_finite()))
    };
    let mut rows: Vec<usize> = (0..over.len()).filter(finite).collect();
    rows.sort_by(|a, b| over[*a].total_cmp(&over[*b]));
    let size = rows.len().div_ceil(MOST).max(FEWEST);
    let bins: Vec<&[usize]> = rows.chunks(size).filter(|bin| bin.len() >= FEWEST).collect();
    let mean = |bin: &[usize], of: &[f64]| bin.iter().map(|k| of[*k]).sum::<f64>() / bin.len() as f64;
    let x: Vec<f64> = bins.iter().map(|bin| mean(bin, over)).collect();
    let span = x.last().zip(x.first()).map_or(0.0, |(last, first)| last - first);
    let size_of_it = x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
    if x.len() < 3 || span <= 1e-6 * size_of_it {
        return None;
    }
    let line = |s: &Series<'_>| {
        let y = bins.iter().map(|bin| mean(bin, s.values)).collect();
        Line { name: s.name.into(), role: s.role, x: x.clone(), y, tolerance: 0.0, fine_tolerance: 0.0 }
    };
    let lines: Vec<Line> = series.iter().map(line).collect();
    let counts: Vec<usize> = bins.iter().map(|bin| bin.len()).collect();
    let samples = Line {
        name: "samples".into(),
        role: Role::Reference,
        x: x.clone(),
        y: counts.iter().map(|n| *n as f64).collect(),
        tolerance: 0.0,
        fine_tolerance: 0.0,
    };
    let quantity = over_title.split(", ").next().unwrap_or(over_title);
    Some(Chart {
        title: format!("By {quantity}"),
        caption: format!("Means of {} bins; below, the samples in each.", bins.len()),
        x_title: over_title.into(),
        panels: vec![
            Panel { y_title: title.into(), lines },
            Panel { y_title: "samples in the bin".into(), lines: vec![samples] },
        ],
        counts,
        ..Chart::default()
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_bin_has_its_mean_and_its_count_and_bad_samples_are_in_none() {
        let over: Vec<f64> = (0..1010).map(|k| f64::from(k % 101)).collect();
        let mut values: Vec<f64> = over.iter().map(|x| 2.0 * x).collect();
        values[5] = f64::NAN;
        let series = [Series { name: "residual", role: Role::Measured, values: &values }];
        let chart = chart("speed, rad/s", &over, "residual, N m", &series).unwrap();
        assert_eq!((chart.counts.iter().sum::<usize>(), chart.counts.len()), (1009, 39));
        let line = &chart.panels[0].lines[0];
        assert!(line.x.iter().zip(&line.y).all(|(x, y)| (y - 2.0 * x).abs() < 1e-9));
        assert_eq!(chart.panels[1].lines[0].y[0], 26.0);
        assert!(chart.to_json().contains("\"counts\":[26,"));
    }

    #[test]
    fn a_quantity_that_does_not_change_has_no_chart() {
        let values = vec![1.0; 500];
        let series = [Series { name: "residual", role: Role::Measured, values: &values }];
        assert!(chart("speed, rad/s", &[3.0; 500], "residual, N m", &series).is_none());
        assert!(chart("speed, rad/s", &[1.0, 2.0], "residual, N m", &series).is_none());
    }
}
