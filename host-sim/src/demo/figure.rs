//! The figure of the README: friction torque after the load step at four speeds, as a small SVG.
//!
//! Coordinates are whole numbers and the runs are deterministic, so remaking it gives the same bytes. Colours are
//! readable on white and on black paper.

use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::runs::Runs;
use crate::input_error::InputError;
use crate::report::simplify;

/// Size in pixels as shown; coordinates are finer by [`SCALE`], as the library writes whole numbers.
const SIZE: (u32, u32) = (860, 430);
const SCALE: u32 = 8;
const SPAN_MS: (f64, f64) = (-10.0, 100.0);
const COLOURS: [RGBColor; 4] =
    [RGBColor(48, 132, 204), RGBColor(0, 158, 115), RGBColor(213, 94, 0), RGBColor(190, 80, 160)];
const INK: RGBColor = RGBColor(118, 126, 136);
/// A twelfth of a pixel in N·m.
const TOLERANCE_NM: f64 = 0.0015;

/// The figure of Figs. 18–21.
///
/// # Errors
/// What the drawing library refuses.
pub fn overshoot_svg(runs: &Runs) -> Result<String, InputError> {
    let mut svg = String::new();
    draw(runs, &mut svg).map_err(|e| InputError::new(format!("the figure cannot be drawn: {e}")))?;
    svg.push('\n');
    let drawn = format!("width=\"{}\" height=\"{}\"", SIZE.0 * SCALE, SIZE.1 * SCALE);
    let shown = format!("width=\"{}\" height=\"{}\"", SIZE.0, SIZE.1);
    Ok(svg.replacen(&drawn, &shown, 1))
}

type DrawResult<T> = Result<T, Box<dyn std::error::Error>>;

fn draw(runs: &Runs, svg: &mut String) -> DrawResult<()> {
    let root = SVGBackend::with_string(svg, (SIZE.0 * SCALE, SIZE.1 * SCALE)).into_drawing_area();
    let pixels = |n: u32| n * SCALE;
    let text = |size: u32| ("sans-serif", pixels(size)).into_font().color(&INK);
    let mut chart = ChartBuilder::on(&root)
        .margin(pixels(12))
        .margin_right(pixels(26))
        .x_label_area_size(pixels(44))
        .y_label_area_size(pixels(56))
        .build_cartesian_2d(SPAN_MS.0..SPAN_MS.1, 0.0..7.0)?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.25).stroke_width(SCALE))
        .axis_style(INK.stroke_width(SCALE))
        .set_all_tick_mark_size(pixels(4))
        .label_style(text(14))
        .axis_desc_style(text(15))
        .x_labels(12)
        .y_labels(8)
        .x_label_formatter(&|x| format!("{x:.0}"))
        .y_label_formatter(&|y| format!("{y:.0}"))
        .x_desc("time after the load step, ms")
        .y_desc("friction torque, N m")
        .draw()?;
    for (c, colour) in runs.comparisons.iter().zip(COLOURS) {
        let Some(series) = c.of(crate::report::Role::Series) else { continue };
        let inside: Vec<(f64, f64)> = c
            .time_s
            .iter()
            .zip(&series.closed_nm)
            .map(|(t, nm)| (1e3 * (t - super::comparison::LOAD_STEP_S), *nm))
            .filter(|(ms, _)| (SPAN_MS.0..=SPAN_MS.1).contains(ms))
            .collect();
        let (x, y): (Vec<f64>, Vec<f64>) = inside.into_iter().unzip();
        let points = simplify::keep(&x, &y, |_| TOLERANCE_NM).into_iter().map(|i| (x[i], y[i]));
        chart.draw_series(LineSeries::new(points, colour.stroke_width(pixels(2))))?;
        let peak = (0..y.len()).max_by(|a, b| y[*a].total_cmp(&y[*b])).unwrap_or(0);
        let label =
            ("sans-serif", pixels(14)).into_font().color(&colour).pos(Pos::new(HPos::Center, VPos::Bottom));
        let place = (x[peak], y[peak] + 0.12);
        chart.draw_series(std::iter::once(Text::new(format!("{:.0} rpm", c.rpm), place, label)))?;
    }
    root.present()?;
    Ok(())
}
