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

/// Samples in bins of a quantity.
#[derive(Debug, Clone)]
pub struct Bins {
    rows: Vec<usize>,
    size: usize,
    /// Mean of the quantity in each.
    x: Vec<f64>,
}

#[allow(clippy::cast_precision_loss)]
impl Bins {
    /// Of these samples; none where the quantity has fewer than three different bins of them.
    #[must_use]
    pub fn new(over: &[f64], mut rows: Vec<usize>) -> Option<Self> {
        rows.retain(|k| over[*k].is_finite());
        rows.sort_by(|a, b| over[*a].total_cmp(&over[*b]));
        let size = rows.len().div_ceil(MOST).max(FEWEST);
        let mut bins = Self { rows, size, x: Vec::new() };
        bins.x = bins.means(over);
        let span = bins.x.last().zip(bins.x.first()).map_or(0.0, |(last, first)| last - first);
        let size_of_it = bins.x.iter().fold(0.0, |most: f64, x| most.max(x.abs()));
        (bins.x.len() >= 3 && span > 1e-6 * size_of_it).then_some(bins)
    }

    fn each(&self) -> impl Iterator<Item = &[usize]> {
        self.rows.chunks(self.size).filter(|bin| bin.len() >= FEWEST)
    }

    /// Mean of the values in each bin.
    #[must_use]
    pub fn means(&self, values: &[f64]) -> Vec<f64> {
        self.slopes(values, &|_| 1.0)
    }

    /// Slope of the values against a regressor in each bin, Σwy/Σw²; of one that is 1 everywhere the mean.
    #[must_use]
    pub fn slopes(&self, values: &[f64], regressor: &dyn Fn(usize) -> f64) -> Vec<f64> {
        let slope = |bin: &[usize]| {
            let both = |k: &usize| (regressor(*k) * values[*k], regressor(*k).powi(2));
            let (of_both, square) =
                bin.iter().map(both).fold((0.0, 0.0), |sum, of| (sum.0 + of.0, sum.1 + of.1));
            of_both / square.max(f64::MIN_POSITIVE)
        };
        self.each().map(slope).collect()
    }

    /// Share of the values' mean square that these slopes explain, less what chance gives.
    #[must_use]
    pub fn share(&self, values: &[f64], regressor: &dyn Fn(usize) -> f64) -> f64 {
        let slopes = self.slopes(values, regressor);
        let left = |(bin, slope): (&[usize], &f64)| -> f64 {
            bin.iter().map(|k| (values[*k] - slope * regressor(*k)).powi(2)).sum()
        };
        let left: f64 = self.each().zip(&slopes).map(left).sum();
        let all: f64 = self.each().flatten().map(|k| values[*k].powi(2)).sum();
        let chance = slopes.len() as f64 / self.rows.len().max(1) as f64;
        if all > 0.0 { (1.0 - left / all - chance).max(0.0) } else { 0.0 }
    }

    /// A line through these means.
    #[must_use]
    pub fn line(&self, name: &str, role: Role, means: Vec<f64>) -> Line {
        Line { name: name.into(), role, x: self.x.clone(), y: means, tolerance: 0.0, fine_tolerance: 0.0 }
    }

    /// What lies between the means less and plus these widths.
    #[must_use]
    pub fn band(&self, name: &str, means: &[f64], widths: &[f64]) -> Line {
        let edge = |sign: f64| means.iter().zip(widths).map(move |(mean, width)| mean + sign * width);
        let y = edge(1.0).chain(edge(-1.0).rev()).collect();
        let x = self.x.iter().chain(self.x.iter().rev()).copied().collect();
        Line { x, ..self.line(name, Role::Band, y) }
    }

    /// A chart of these lines; `over_title` and `title` carry units behind a comma.
    #[must_use]
    pub fn chart(&self, over_title: &str, title: &str, lines: Vec<Line>) -> Chart {
        let counts: Vec<usize> = self.each().map(<[usize]>::len).collect();
        let quantity = over_title.split(", ").next().unwrap_or(over_title);
        Chart {
            title: format!("By {quantity}"),
            caption: format!("Means of {} bins.", counts.len()),
            x_title: over_title.into(),
            panels: vec![Panel { y_title: title.into(), lines }],
            counts,
            ..Chart::default()
        }
    }

    /// With a panel of the samples in each bin.
    #[must_use]
    pub fn chart_with_counts(&self, over_title: &str, title: &str, lines: Vec<Line>) -> Chart {
        let mut chart = self.chart(over_title, title, lines);
        let counts = chart.counts.iter().map(|n| *n as f64).collect();
        let samples = self.line("samples", Role::Reference, counts);
        chart.panels.push(Panel { y_title: "samples in the bin".into(), lines: vec![samples] });
        chart.caption = format!("Means of {} bins; below, the samples in each.", chart.counts.len());
        chart
    }
}

/// Mean of each series in bins of `over`; none where the quantity has fewer than three different bins. `over_title` and
/// `title` carry units behind a comma.
#[must_use]
pub fn chart(over_title: &str, over: &[f64], title: &str, series: &[Series<'_>]) -> Option<Chart> {
    let finite = |k: &usize| series.iter().all(|s| s.values.get(*k).is_some_and(|v| v.is_finite()));
    let bins = Bins::new(over, (0..over.len()).filter(finite).collect())?;
    let lines = series.iter().map(|s| bins.line(s.name, s.role, bins.means(s.values))).collect();
    Some(bins.chart_with_counts(over_title, title, lines))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::White;

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

    #[test]
    fn a_share_is_what_the_means_of_the_bins_explain() {
        let over: Vec<f64> = (0..8000).map(|k| f64::from(k % 101)).collect();
        let bins = Bins::new(&over, (0..8000).collect()).unwrap();
        let follows: Vec<f64> = over.iter().map(|x| x - 50.0).collect();
        let not: Vec<f64> = (0..8000).map(|k| f64::from(k % 7) - 3.0).collect();
        let mixed: Vec<f64> = follows.iter().zip(&not).map(|(a, b)| a + 14.6 * b).collect();
        let share = |values: &[f64]| bins.share(values, &|_| 1.0);
        assert!(share(&follows) > 0.98 && share(&not) < 0.01, "{} {}", share(&follows), share(&not));
        // Both have a mean square of 850.
        assert!((share(&mixed) - 0.5).abs() < 0.03, "{}", share(&mixed));
        // Against a regressor.
        let sign = |k: usize| if k.is_multiple_of(2) { 2.0 } else { -2.0 };
        let signed: Vec<f64> = follows.iter().enumerate().map(|(k, x)| sign(k) * x).collect();
        assert!(share(&signed) < 0.05 && bins.share(&signed, &sign) > 0.98);
        assert!((bins.slopes(&signed, &sign)[0] - bins.means(&follows)[0]).abs() < 1e-9);
    }

    #[test]
    fn means_of_few_samples_explain_nothing_of_noise() {
        // Forty means of twenty samples take a twentieth of any noise.
        let over: Vec<f64> = (0..800).map(f64::from).collect();
        let bins = Bins::new(&over, (0..800).collect()).unwrap();
        let mut noise = White::new(1);
        let mut values = || (0..800).map(|_| noise.next()).collect::<Vec<f64>>();
        let shares = (0..20).map(|_| bins.share(&values(), &|_| 1.0));
        let mean = shares.sum::<f64>() / 20.0;
        assert!(mean < 0.02, "{mean}");
    }
}
