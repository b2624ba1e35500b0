//! A chart as a still picture, for readers whose browser runs no scripts: an SVG of some ten kilobytes.

use plotters::coord::Shift;
use plotters::prelude::*;

use super::chart::{Chart, Line, Panel, Role};

const WIDTH: u32 = 860;
const PANEL: u32 = 220;
const INK: RGBColor = RGBColor(118, 126, 136);
const COLOURS: [RGBColor; 5] = [
    RGBColor(48, 132, 204),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(190, 80, 160),
    RGBColor(138, 90, 0),
];
/// Height of the row of names, room for the labels of the vertical axis, and width of a letter, pixels.
const LEGEND: i32 = 22;
const LABELS: i32 = 78;
const LETTER: i32 = 7;
/// How much of a band's colour is seen.
const BAND: f64 = 0.2;
/// Points of a line: two a pixel column, its lowest and its highest, keep every spike.
const COLUMNS: usize = 300;

type Drawn<T> = Result<T, Box<dyn std::error::Error>>;

/// The picture of what the chart shows first; empty where there is nothing to draw.
#[must_use]
pub(super) fn svg(chart: &Chart) -> String {
    if chart.panels.is_empty() {
        return String::new();
    }
    let mut svg = String::new();
    #[allow(clippy::cast_possible_truncation)]
    let height = PANEL * chart.panels.len() as u32 + 30;
    match draw(chart, height, &mut svg) {
        // It scales with the page.
        Ok(()) => svg.replacen(
            &format!("width=\"{WIDTH}\" height=\"{height}\""),
            "style=\"max-width:100%;height:auto\"",
            1,
        ),
        Err(_) => String::new(),
    }
}

fn draw(chart: &Chart, height: u32, svg: &mut String) -> Drawn<()> {
    let root = SVGBackend::with_string(svg, (WIDTH, height)).into_drawing_area();
    let areas = root.split_evenly((chart.panels.len().max(1), 1));
    for (at, (panel, area)) in chart.panels.iter().zip(&areas).enumerate() {
        draw_panel(chart, panel, area, at + 1 == chart.panels.len())?;
    }
    root.present()?;
    Ok(())
}

fn draw_panel(
    chart: &Chart,
    panel: &Panel,
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    last: bool,
) -> Drawn<()> {
    let shown = chart.windows.first().map(|window| window.range);
    // A line that is a function of a rising abscissa has its columns at places of the record, and no point of it is copied.
    let rising = !(chart.log_x || chart.plane) && chart.counts.is_empty();
    let lines: Vec<(&Line, Vec<(f64, f64)>)> = panel
        .lines
        .iter()
        .map(|line| {
            let (from, to) = if rising { inside(&line.x, shown) } else { (0, line.x.len()) };
            let (from, to) = (from.min(line.y.len()), to.min(line.y.len()));
            let (x, y) = (&line.x[from..to], &line.y[from..to]);
            if rising && y.iter().all(|y| y.is_finite()) {
                return (line, columns(x, y));
            }
            let points: Vec<(f64, f64)> = x
                .iter()
                .zip(y)
                .map(|(x, y)| (if chart.log_x { x.log10() } else { *x }, *y))
                .filter(|(x, y)| x.is_finite() && y.is_finite())
                .filter(|(x, _)| shown.is_none_or(|(from, to)| chart.log_x || (from..=to).contains(x)))
                .collect();
            let exact = chart.plane || !chart.counts.is_empty();
            (line, if exact { every(&points) } else { envelope(&points) })
        })
        .collect();
    let (x, y) = (
        bounds(lines.iter().flat_map(|(_, p)| p).map(|p| p.0)),
        bounds(lines.iter().flat_map(|(_, p)| p).map(|p| p.1)),
    );
    let (Some(x), Some(y)) = (x, y) else { return Ok(()) };
    let room = 0.06 * (y.1 - y.0);
    let (names, area) = area.split_vertically(LEGEND);
    draw_names(panel, &names)?;
    let text = ("sans-serif", 13).into_font().color(&INK);
    let mut axes = ChartBuilder::on(&area)
        .margin(6)
        .margin_top(0)
        .x_label_area_size(if last { 40 } else { 20 })
        .y_label_area_size(LABELS)
        .build_cartesian_2d(x.0..x.1, y.0 - room..y.1 + room)?;
    let log_x = chart.log_x;
    axes.configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(INK.mix(0.25))
        .axis_style(INK)
        .label_style(text.clone())
        .axis_desc_style(text)
        .x_label_formatter(&move |at| if log_x { super::value::plain(10f64.powf(*at)) } else { tick(*at, x) })
        .y_label_formatter(&|at| tick(*at, y))
        .x_desc(if last { chart.x_title.as_str() } else { "" })
        .y_desc(panel.y_title.as_str())
        .draw()?;
    for ((line, points), colour) in lines.into_iter().zip(colours(panel)) {
        if line.role == Role::Band {
            axes.draw_series([Polygon::new(points, colour.mix(BAND))])?;
            continue;
        }
        // Means of what was measured stand against a law as points, the law as a line.
        let measured = line.role == Role::Measured;
        let alone = panel.lines.len() == 1;
        if !chart.counts.is_empty() && (measured || alone) {
            axes.draw_series(points.iter().map(|point| Circle::new(*point, 3, colour.filled())))?;
            if !alone {
                continue;
            }
        }
        axes.draw_series(LineSeries::new(points, colour.stroke_width(2)))?;
    }
    Ok(())
}

/// A colour for each line; a band has that of the line after it, whose band it is.
fn colours(panel: &Panel) -> Vec<RGBColor> {
    let mut own = COLOURS.into_iter().cycle().peekable();
    let of = |line: &Line| if line.role == Role::Band { own.peek().copied() } else { own.next() };
    panel.lines.iter().filter_map(of).collect()
}

/// Names of the lines in one row above the axes, where they hide nothing.
fn draw_names(panel: &Panel, area: &DrawingArea<SVGBackend<'_>, Shift>) -> Drawn<()> {
    let text = ("sans-serif", 12).into_font().color(&INK);
    let mut left = LABELS;
    for (line, colour) in panel.lines.iter().zip(colours(panel)) {
        let middle = LEGEND / 2;
        if line.role == Role::Band {
            area.draw(&Rectangle::new(
                [(left, middle - 5), (left + 16, middle + 5)],
                colour.mix(BAND).filled(),
            ))?;
        } else {
            area.draw(&PathElement::new([(left, middle), (left + 16, middle)], colour.stroke_width(2)))?;
        }
        area.draw(&Text::new(line.name.as_str(), (left + 21, middle - 6), text.clone()))?;
        #[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)]
        let letters = line.name.chars().count() as i32;
        left += 21 + LETTER * letters + 20;
    }
    Ok(())
}

/// Label of a tick of a linear axis: zero is a sum of steps that do not add up to it in the last place.
fn tick(at: f64, (low, high): (f64, f64)) -> String {
    let rounding = 1e-9 * (high - low);
    let text = super::value::plain(if at.abs() < rounding { 0.0 } else { at });
    // Ticks are at round numbers: zeros at the end say nothing, and take room.
    let (digits, power) = text.split_at(text.find('e').unwrap_or(text.len()));
    let short =
        if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits };
    format!("{short}{power}")
}

/// First and last place of a rising abscissa within a range.
fn inside(x: &[f64], range: Option<(f64, f64)>) -> (usize, usize) {
    let Some((from, to)) = range else { return (0, x.len()) };
    let first = x.partition_point(|x| *x < from);
    (first, first + x[first..].partition_point(|x| *x <= to))
}

fn bounds(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    // A line that is flat has some room too.
    (low <= high).then_some(if high > low { (low, high) } else { (low - 0.5, high + 0.5) })
}

/// [`envelope`] of a function over a rising abscissa.
fn columns(x: &[f64], y: &[f64]) -> Vec<(f64, f64)> {
    let size = y.len().div_ceil(COLUMNS).max(1);
    if size <= 2 {
        return x.iter().copied().zip(y.iter().copied()).collect();
    }
    let column = |from: usize| {
        let (mut low, mut high) = (from, from);
        for (at, y_here) in y.iter().enumerate().take((from + size).min(y.len())).skip(from + 1) {
            if y_here.total_cmp(&y[low]).is_lt() {
                low = at;
            }
            if y_here.total_cmp(&y[high]).is_ge() {
                high = at;
            }
        }
        [low.min(high), low.max(high)].map(|at| (x[at], y[at]))
    };
    (0..y.len()).step_by(size).flat_map(column).collect()
}

/// The lowest and the highest point of each column.
fn envelope(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    let size = points.len().div_ceil(COLUMNS).max(1);
    if size <= 2 {
        return points.to_vec();
    }
    points
        .chunks(size)
        .flat_map(|column| {
            let by = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
            let mut ends: Vec<(f64, f64)> =
                [column.iter().min_by(by), column.iter().max_by(by)].into_iter().flatten().copied().collect();
            ends.sort_by(|a, b| a.0.total_cmp(&b.0));
            ends
        })
        .collect()
}

/// As many points of a curve in a plane.
fn every(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    points.iter().step_by(points.len().div_ceil(2 * COLUMNS).max(1)).copied().collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::Window;

    #[test]
    fn a_tick_at_zero_says_so() {
        let steps = -0.3 + 0.1 + 0.1 + 0.1;
        assert!(steps != 0.0);
        assert_eq!(tick(steps, (-0.3, 0.2)), "0");
        assert_eq!(tick(2.5e-16, (0.0, 1e-15)), "2.5e-16");
    }

    fn chart() -> Chart {
        let x: Vec<f64> = (0..20_000).map(|k| f64::from(k) * 1e-3).collect();
        let y = x.iter().map(|x| x.sin() + if (*x - 5.0).abs() < 5e-4 { 3.0 } else { 0.0 }).collect();
        let line =
            Line { name: "measured".into(), role: Role::Measured, x, y, tolerance: 0.1, fine_tolerance: 0.1 };
        Chart {
            x_title: "time, s".into(),
            panels: vec![Panel { y_title: "torque, N m".into(), lines: vec![line] }],
            windows: vec![Window { label: "all".into(), range: (0.0, 20.0) }],
            ..Chart::default()
        }
    }

    #[test]
    fn a_picture_has_its_axes_with_units_and_is_small() {
        let svg = svg(&chart());
        assert!(svg.starts_with("<svg") && svg.contains("time, s") && svg.contains("torque, N m"), "{svg}");
        assert!(svg.contains("measured") && svg.len() < 40_000, "{}", svg.len());
    }

    #[test]
    fn the_part_of_a_record_that_is_shown_has_both_its_ends() {
        let x = [0.0, 1.0, 2.0, 3.0, 4.0];
        assert_eq!(inside(&x, Some((1.0, 3.0))), (1, 4));
        assert_eq!(inside(&x, Some((0.5, 9.0))), (1, 5));
        assert_eq!(inside(&x, Some((5.0, 9.0))), (5, 5));
        assert_eq!(inside(&x, None), (0, 5));
    }

    #[test]
    fn columns_over_a_rising_abscissa_are_the_envelope_of_the_points() {
        for count in [1_u32, 599, 601, 20_000, 20_017] {
            let x: Vec<f64> = (0..count).map(f64::from).collect();
            // With plateaus, where the first of the lowest and the last of the highest count.
            let y: Vec<f64> = x.iter().map(|x| (7.0 * (0.03 * x).sin()).round()).collect();
            let points: Vec<(f64, f64)> = x.iter().copied().zip(y.iter().copied()).collect();
            assert_eq!(columns(&x, &y), envelope(&points), "{count} points");
        }
    }

    #[test]
    fn a_lone_spike_is_not_lost() {
        let chart = chart();
        let line = &chart.panels[0].lines[0];
        let points: Vec<(f64, f64)> = line.x.iter().copied().zip(line.y.iter().copied()).collect();
        let drawn = envelope(&points);
        assert!(drawn.len() <= 2 * COLUMNS);
        let highest = |points: &[(f64, f64)]| points.iter().map(|p| p.1).fold(f64::NEG_INFINITY, f64::max);
        assert_eq!(highest(&drawn), highest(&points));
        assert_eq!(svg(&Chart::default()), "");
    }
}
