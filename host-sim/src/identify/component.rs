//! What a cause adds to its balance, over what it follows: component-plus-residual plots.
//!
//! What is measured less all of the answer but one cause should lie on that cause's law. It is drawn in bins of the
//! coordinate that the law follows most, or over time where it follows none.

use std::ops::Range;

use nalgebra::{DMatrix, DVector};

use super::balance::Alternative;
use super::contact::problem::Fit;
use super::contact::search;
use super::contact_part::{ContactPart, coordinates_of};
use super::effects::coordinates::TIME;
use super::extended_model::FittedLaws;
use super::filters::rms;
use super::linear_part::Linear;
use super::table::Part;
use crate::files::effect_id::{Subsystem, subsystem_of};
use crate::fit::covariance::INTERVAL_95;
use crate::report::bins::Bins;
use crate::report::chart::{Chart, Line, Panel, Role, Window};

/// A law follows a coordinate that explains this share of its variance.
const FOLLOWS: f64 = 0.5;
/// What is less than this share of its usual size is nothing that a law could be relative to.
const LEAST_BASE: f64 = 0.1;
/// Swings of the law in the stretch of time that is shown first, and the fewest points of it.
const SWINGS: usize = 6;
const FEWEST_POINTS: usize = 200;
/// Residuals are drawn over so many coordinates.
const MOST_RESIDUALS: usize = 2;

/// What a cause of the answer adds to a balance.
struct Component {
    effect: &'static str,
    /// At each point.
    values: Vec<f64>,
    /// Of its parameters' units, with their covariance.
    columns: Vec<Vec<f64>>,
    covariance: DMatrix<f64>,
    /// What its form says that it follows.
    coordinate: Option<(String, Vec<f64>)>,
    /// What it is relative to; `None` where it adds to the balance.
    relative_to: Option<Vec<f64>>,
}

/// A balance, as it is drawn.
pub struct Drawn {
    /// Which.
    pub part: Part,
    /// Its unit.
    unit: &'static str,
    /// What may be followed, with units.
    coordinates: Vec<(String, Vec<f64>)>,
    /// Points that count.
    rows: Vec<usize>,
    /// What the baseline and what the answer leaves.
    left: [Vec<f64>; 2],
    components: Vec<Component>,
}

impl Drawn {
    /// A linear balance with the set at a place.
    pub fn of_balance(part: Part, linear: &Linear, place: usize) -> Self {
        let (balance, solved) = (&linear.balance, &linear.solved[place]);
        let none = linear.solved.iter().find(|s| s.set.is_empty()).unwrap_or(solved);
        let component = |(form, own): (&Alternative, Range<usize>)| {
            let mut values = form.response.as_ref().map_or_else(
                || vec![0.0; balance.response.len()],
                |added| added.iter().map(|added| -added).collect(),
            );
            for (p, column) in solved.p[own.clone()].iter().zip(&form.columns) {
                values.iter_mut().zip(column).for_each(|(v, x)| *v += p * x);
            }
            Component {
                effect: form.effect,
                values,
                columns: form.columns.clone(),
                covariance: block(&solved.covariance, &own),
                coordinate: form.coordinate.clone(),
                relative_to: None,
            }
        };
        Self {
            part,
            unit: linear.unit,
            coordinates: linear.coordinates.clone(),
            rows: balance.used.clone(),
            left: [none.residual.clone(), solved.residual.clone()],
            components: solved.forms(&linear.alternatives).map(component).collect(),
        }
    }

    /// The contact with a fit of its answer and the covariance of that.
    pub fn of_contact(contact: &ContactPart, laws: &FittedLaws) -> Self {
        let FittedLaws { fit, columns, covariance } = laws;
        let problem = contact.problem();
        let deviation = &problem.noise.deviation;
        let none = contact.ranked.iter().find(|r| r.fit.terms.is_empty()).map_or(fit, |r| &r.fit);
        let in_nm = |r: &[f64]| -> Vec<f64> { r.iter().zip(deviation).map(|(r, s)| r * s).collect() };
        let limit = problem.well_known_nm();
        let friction_nm: Vec<f64> =
            contact.logs.iter().flat_map(|log| log.smooth_nm.iter().copied()).collect();
        let mut from = contact.baseline.free.len();
        let without = search::without_each_as_they_are(&problem, fit);
        let component = |(term, without): (&usize, &Fit)| {
            let term = &contact.terms[*term];
            let own = from..from + term.parameters.len();
            from = own.end;
            Component {
                effect: term.effect,
                values: in_nm(&without.r.iter().zip(&fit.r).map(|(a, b)| a - b).collect::<Vec<_>>()),
                columns: columns[own.clone()].iter().map(|c| in_nm(c)).collect(),
                covariance: block(covariance, &own),
                coordinate: term.coordinate.clone(),
                relative_to: (subsystem_of(term.effect) == Some(Subsystem::Friction))
                    .then(|| friction_nm.clone()),
            }
        };
        Self {
            part: Part::Friction,
            unit: "N m",
            coordinates: coordinates_of(&contact.logs, &contact.scales),
            rows: (0..deviation.len()).filter(|i| deviation[*i] < limit && fit.r[*i] != 0.0).collect(),
            left: [in_nm(&none.r), in_nm(&fit.r)],
            components: fit.terms.iter().zip(&without).map(component).collect(),
        }
    }

    /// The law of an effect against what is measured less all else; `None` where the effect adds nothing to this balance.
    pub fn law(&self, effect: &str) -> Option<Chart> {
        let component = self.components.iter().find(|c| c.effect == effect)?;
        if rms(&component.values) == 0.0 {
            return None;
        }
        Some(self.over_coordinate(component).unwrap_or_else(|| self.over_time(component)))
    }

    fn over_coordinate(&self, component: &Component) -> Option<Chart> {
        let base = |i: usize| component.relative_to.as_ref().map_or(1.0, |base| base[i]);
        let least = LEAST_BASE * component.relative_to.as_ref().map_or(0.0, |base| rms(base));
        let rows: Vec<usize> = self.rows.iter().copied().filter(|i| base(*i).abs() > least).collect();
        let mut over: Vec<(f64, &str, Bins)> = component
            .coordinate
            .iter()
            .chain(&self.coordinates)
            .filter_map(|(name, values)| {
                let bins = Bins::new(values, rows.clone())?;
                Some((bins.share(&component.values, &base), name.as_str(), bins))
            })
            .collect();
        over.sort_by(|a, b| b.0.total_cmp(&a.0));
        let (share, name, bins) = over.into_iter().next().filter(|best| best.0 > FOLLOWS)?;
        let law = bins.slopes(&component.values, &base);
        let rest = bins.slopes(&self.left[1], &base);
        let columns: Vec<Vec<f64>> = component.columns.iter().map(|c| bins.slopes(c, &base)).collect();
        let width = |bin: usize| {
            let slope = DVector::from_fn(columns.len(), |i, _| columns[i][bin]);
            INTERVAL_95 * (&component.covariance * &slope).dot(&slope).max(0.0).sqrt()
        };
        let widths: Vec<f64> = (0..law.len()).map(width).collect();
        let measured = law.iter().zip(&rest).map(|(law, rest)| law + rest).collect();
        let lines = vec![
            bins.band("95 % of the law", &law, &widths),
            bins.line("law", Role::Series, law),
            bins.line("partial residual", Role::Measured, measured),
        ];
        let title = match component.relative_to {
            Some(_) => format!("change of the {}, relative", self.part.quantity()),
            None => format!("{}, {}", self.part.quantity(), self.unit),
        };
        let mut chart = bins.chart(name, &title, lines);
        chart.title = self.title(component);
        chart.caption = format!(
            "The partial residual is what is measured less all else of the answer; means of {} bins of training samples, which hold {:.0} % of the law's mean square.",
            chart.counts.len(),
            100.0 * share
        );
        Some(chart)
    }

    fn title(&self, component: &Component) -> String {
        format!("Law of {} in the balance of the {}.", component.effect, self.part.name())
    }

    /// Where its own coordinates do not show it: the log in which it is largest, opened where it is.
    fn over_time(&self, component: &Component) -> Chart {
        let time_s = self.coordinates.iter().find(|c| c.0 == TIME).map_or(&[][..], |c| &c.1);
        let mut logs: Vec<Range<usize>> = Vec::new();
        for i in 0..time_s.len() {
            match logs.last_mut() {
                Some(log) if time_s[i] > time_s[log.end - 1] => log.end = i + 1,
                _ => logs.push(i..i + 1),
            }
        }
        let largest = |log: &Range<usize>| rms(&component.values[log.clone()]);
        let log = logs.into_iter().max_by(|a, b| largest(a).total_cmp(&largest(b))).unwrap_or(0..0);
        let (time, law) = (&time_s[log.clone()], &component.values[log.clone()]);
        let measured: Vec<f64> =
            self.left[1][log.clone()].iter().zip(law).map(|(rest, law)| rest + law).collect();
        let counted = self.counted(&log);
        let (from, to) = strongest(law, &counted);
        let size = law.iter().chain(&measured).fold(1e-12, |most: f64, v| most.max(v.abs()));
        let line = |name: &str, role, y: &[f64]| Line {
            name: name.into(),
            role,
            x: time.to_vec(),
            y: y.to_vec(),
            tolerance: 4e-3 * size,
            fine_tolerance: 5e-4 * size,
        };
        let range = |from: usize, to: usize| (time[from], time[to - 1]);
        Chart {
            title: self.title(component),
            caption: "The partial residual is what is measured less all else of the answer. No coordinate explains most of the law: over time, in the training log in which it is largest.".into(),
            x_title: TIME.into(),
            panels: vec![Panel {
                y_title: format!("{}, {}", self.part.quantity(), self.unit),
                lines: vec![line("partial residual", Role::Measured, &measured), line("law", Role::Series, law)],
            }],
            windows: vec![
                Window { label: "where it is largest".into(), range: range(from, to) },
                Window { label: "all".into(), range: range(0, time.len()) },
            ],
            ..Chart::default()
        }
    }

    /// Which points of a stretch count.
    fn counted(&self, stretch: &Range<usize>) -> Vec<bool> {
        let mut counted = vec![false; stretch.len()];
        let own = self.rows.iter().filter(|i| stretch.contains(*i));
        own.for_each(|i| counted[i - stretch.start] = true);
        counted
    }

    /// What baseline and answer leave, over the coordinates that explain most of what the baseline leaves.
    pub fn residuals(&self) -> Vec<Chart> {
        let [before, after] = &self.left;
        let mut charts: Vec<(f64, Chart)> = self
            .coordinates
            .iter()
            .filter_map(|(name, values)| {
                let bins = Bins::new(values, self.rows.clone())?;
                let lines = vec![
                    bins.line("baseline", Role::Measured, bins.means(before)),
                    bins.line("answer", Role::Series, bins.means(after)),
                ];
                let mut chart = bins.chart(name, &format!("mean residual, {}", self.unit), lines);
                chart.title = format!("Residual of the {} by {}", self.part.name(), name.split(", ").next()?);
                Some((bins.share(before, &|_| 1.0), chart))
            })
            .collect();
        charts.sort_by(|a, b| b.0.total_cmp(&a.0));
        charts.into_iter().take(MOST_RESIDUALS).map(|(_, chart)| chart).collect()
    }
}

/// What a covariance says of these values alone.
fn block(covariance: &DMatrix<f64>, own: &Range<usize>) -> DMatrix<f64> {
    covariance.view((own.start, own.start), (own.len(), own.len())).into_owned()
}

/// The stretch in which a signal is strongest at the points that count, as long as some swings of it.
fn strongest(signal: &[f64], counted: &[bool]) -> (usize, usize) {
    let own: Vec<f64> =
        signal.iter().zip(counted).filter(|(_, counted)| **counted).map(|(x, _)| *x).collect();
    let mean = own.iter().sum::<f64>() / own.len().max(1) as f64;
    let turns = own.windows(2).filter(|w| (w[0] > mean) != (w[1] > mean)).count();
    let length = (2 * SWINGS * signal.len() / (turns + 1)).max(FEWEST_POINTS).min(signal.len());
    let mut sums = vec![0.0];
    for (x, counted) in signal.iter().zip(counted) {
        sums.push(sums[sums.len() - 1] + if *counted { (x - mean) * (x - mean) } else { 0.0 });
    }
    let strength = |from: &usize| sums[from + length] - sums[*from];
    let from = (0..=signal.len() - length).max_by(|a, b| strength(a).total_cmp(&strength(b))).unwrap_or(0);
    (from, from + length)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::noise::tests::white;

    const POINTS: usize = 4000;

    /// Two logs of a drive whose cause adds `law` of the speed and the place.
    fn drawn(law: &dyn Fn(f64, usize) -> f64) -> Drawn {
        let time_s: Vec<f64> = (0..POINTS).map(|i| 1e-3 * (i % (POINTS / 2)) as f64).collect();
        let speed: Vec<f64> = time_s.iter().map(|t| 3.0 * (2.0 * t).sin()).collect();
        let values: Vec<f64> = speed.iter().enumerate().map(|(i, v)| law(*v, i)).collect();
        let component = Component {
            effect: "bearing_stribeck",
            columns: vec![values.iter().map(|v| v / 2.0).collect()],
            values,
            covariance: DMatrix::from_element(1, 1, 0.01),
            coordinate: None,
            relative_to: None,
        };
        let left: Vec<f64> = white(POINTS, 3).iter().map(|n| 0.1 * n).collect();
        Drawn {
            part: Part::Drive,
            unit: "N m",
            coordinates: vec![(TIME.into(), time_s), ("speed, rad/s".into(), speed)],
            rows: (0..POINTS).collect(),
            left: [left.clone(), left],
            components: vec![component],
        }
    }

    #[test]
    fn a_law_is_drawn_over_what_it_follows_with_its_band_through_what_is_measured() {
        let drawn = drawn(&|speed, _| speed * speed);
        assert!(drawn.law("presliding").is_none());
        let chart = drawn.law("bearing_stribeck").unwrap();
        assert_eq!(
            (chart.x_title.as_str(), chart.panels[0].y_title.as_str()),
            ("speed, rad/s", "effort of the drive, N m")
        );
        let [band, law, measured] = &chart.panels[0].lines[..] else { panic!("three lines") };
        let bins = law.x.len();
        for bin in 0..bins {
            // A mean of a hundred values whose deviation is 0.1; a bin is not wider than a seventh of the speed.
            assert!((law.y[bin] - law.x[bin].powi(2)).abs() < 0.05, "{} at {}", law.y[bin], law.x[bin]);
            assert!((measured.y[bin] - law.y[bin]).abs() < 0.04 && measured.y[bin] != law.y[bin]);
            // The parameter is 2 ± 0.1: the law is known to a twentieth.
            let width = 0.5 * (band.y[bin] - band.y[2 * bins - 1 - bin]);
            assert!((width / (INTERVAL_95 * 0.05 * law.y[bin]) - 1.0).abs() < 1e-9);
        }
    }

    #[test]
    fn a_law_is_drawn_over_a_coordinate_of_its_own() {
        let mut drawn = drawn(&|_, i| wander(i));
        // By the time of each log and by the speed nothing is seen of it.
        assert_eq!(drawn.law("bearing_stribeck").unwrap().x_title, TIME);
        drawn.components[0].coordinate =
            Some(("log after log, s".into(), (0..POINTS).map(|i| 1e-3 * i as f64).collect()));
        let chart = drawn.law("bearing_stribeck").unwrap();
        assert_eq!(chart.x_title, "log after log, s");
        let law = &chart.panels[0].lines[1];
        assert!(law.x.iter().zip(&law.y).all(|(x, y)| (y - wander((1e3 * x) as usize)).abs() < 0.05));
    }

    /// Half a turn over both logs: the second takes back what the first one does.
    fn wander(i: usize) -> f64 {
        (std::f64::consts::PI * i as f64 / POINTS as f64).cos()
    }

    #[test]
    fn a_law_of_friction_is_relative_to_the_friction() {
        let mut drawn = drawn(&|speed, i| 0.3 * speed * friction(i));
        drawn.components[0].relative_to = Some((0..POINTS).map(friction).collect());
        let chart = drawn.law("bearing_stribeck").unwrap();
        let [_, law, measured] = &chart.panels[0].lines[..] else { panic!("three lines") };
        assert!(measured.y.iter().zip(&law.y).all(|(a, b)| (a - b).abs() < 0.02));
        assert!(law.x.iter().zip(&law.y).all(|(x, y)| (y - 0.3 * x).abs() < 0.05));
        assert!(chart.panels[0].y_title.contains("relative"));
        // At rest there is no friction, and all that is left is noise.
        fn friction(i: usize) -> f64 {
            if i < 100 { 1e-6 } else { [5.0, -5.0][i % 2] }
        }
    }

    #[test]
    fn what_follows_no_coordinate_is_drawn_over_time_where_it_is_strongest() {
        // It swings in the second log, most around its middle.
        let size = |i: usize| (-((i as f64 - 0.75 * POINTS as f64) / 300.0).powi(2)).exp();
        let mut drawn = drawn(&|_, i| size(i) * (0.3 * i as f64).sin());
        let shown = |drawn: &Drawn| drawn.law("bearing_stribeck").unwrap().windows[0].range;
        let (from, to) = shown(&drawn);
        assert!(from < 1.0 && to > 1.0 && to - from < 0.4, "{from} to {to}");
        assert_eq!(drawn.law("bearing_stribeck").unwrap().panels[0].lines[0].x.len(), POINTS / 2);
        // Points that do not count are not what is looked at.
        drawn.rows.retain(|i| !(2800..3200).contains(i));
        let (from, to) = shown(&drawn);
        assert!(to < 1.0 || from > 1.0, "{from} to {to}");
    }
}
