//! What a model predicts against what was measured: the course, the residual, and the residual by what it may follow.

use super::bins::{self, Series};
use super::chart::{Chart, Line, Panel, Role, Window};
use super::page::Block;

/// A signal with its prediction, and the quantities that its residual may follow.
#[derive(Debug, Clone)]
pub struct Prediction<'a> {
    /// Heading.
    pub name: String,
    /// Quantity and unit, "friction torque, N m".
    pub quantity: &'a str,
    /// Time, s.
    pub time_s: &'a [f64],
    /// Measured.
    pub measured: &'a [f64],
    /// Predicted.
    pub predicted: &'a [f64],
    /// Quantities with units, and their values.
    pub over: Vec<(&'a str, Vec<f64>)>,
}

/// Seconds shown first, about where the residual is largest.
const OPENS_WITH_S: f64 = 1.0;

impl Prediction<'_> {
    /// Heading and charts.
    #[must_use]
    pub fn blocks(&self) -> Vec<Block> {
        let residual: Vec<f64> = self.measured.iter().zip(self.predicted).map(|(m, p)| m - p).collect();
        let mut blocks = vec![Block::Heading(self.name.clone()), Block::Chart(self.course(&residual))];
        let series = [Series { name: "mean residual", role: Role::Measured, values: &residual }];
        let unit = self.quantity.split(", ").nth(1).unwrap_or_default();
        let charts = self.over.iter().filter_map(|(over, values)| {
            bins::chart(over, values, &format!("mean residual, {unit}"), &series)
        });
        blocks.extend(charts.map(Block::Chart));
        blocks
    }

    fn course(&self, residual: &[f64]) -> Chart {
        let size = |values: &[f64]| values.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        let line = |name: &str, role, values: &[f64]| {
            let full = size(values).max(1e-12);
            Line {
                name: name.into(),
                role,
                x: self.time_s.to_vec(),
                y: values.to_vec(),
                tolerance: 4e-3 * full,
                fine_tolerance: 5e-4 * full,
            }
        };
        let (begin, end) = (self.time_s.first(), self.time_s.last());
        let (begin, end) = (begin.copied().unwrap_or_default(), end.copied().unwrap_or_default());
        let largest = residual.iter().enumerate().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()));
        let centre = largest.and_then(|(k, _)| self.time_s.get(k)).copied().unwrap_or(begin);
        let from = (centre - 0.4 * OPENS_WITH_S).clamp(begin, (end - OPENS_WITH_S).max(begin));
        let unit = self.quantity.split(", ").nth(1).unwrap_or_default();
        Chart {
            title: "Measured and predicted".into(),
            caption: "Opens where the residual is largest.".into(),
            x_title: "time, s".into(),
            panels: vec![
                Panel {
                    y_title: self.quantity.into(),
                    lines: vec![
                        line("measured", Role::Measured, self.measured),
                        line("predicted", Role::Series, self.predicted),
                    ],
                },
                Panel {
                    y_title: format!("residual, {unit}"),
                    lines: vec![line("residual", Role::Lugre, residual)],
                },
            ],
            windows: vec![
                Window { label: "largest residual".into(), range: (from, (from + OPENS_WITH_S).min(end)) },
                Window { label: "all".into(), range: (begin, end) },
            ],
            ..Chart::default()
        }
    }
}
