//! A chart of the report: stacked panels over one x axis, written as data for plotly.js.
//!
//! Each line is simplified with an error bound before it is written ([`super::simplify`]): a coarse one for the
//! whole run, a fine one in the stretches that matter. Numbers carry as many decimals as the bound asks for.

use std::fmt::Write;

use super::simplify;

/// What a line stands for; the page's script gives each a colour and a dash for light and for dark.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[allow(missing_docs, reason = "the names say it")]
pub enum Role {
    Series,
    Brush,
    Lugre,
    LugrePatch,
    ModifiedLugre,
    /// A measured signal.
    Measured,
    /// What was asked for, or a bound.
    Reference,
    /// What lies between two courses: its line goes along one and back along the other.
    Band,
}

impl Role {
    fn name(self) -> &'static str {
        match self {
            Self::Series => "series",
            Self::Brush => "brush",
            Self::Lugre => "lugre",
            Self::LugrePatch => "lugre_patch",
            Self::ModifiedLugre => "modified_lugre",
            Self::Measured => "measured",
            Self::Reference => "reference",
            Self::Band => "band",
        }
    }
}

/// A line.
#[derive(Debug, Clone)]
pub struct Line {
    /// Name in the legend.
    pub name: String,
    /// What it stands for.
    pub role: Role,
    /// Abscissa, rising unless `simplified` is off.
    pub x: Vec<f64>,
    /// Ordinate.
    pub y: Vec<f64>,
    /// Largest error of the drawn line in the panel's unit.
    pub tolerance: f64,
    /// Largest error in the stretches of interest.
    pub fine_tolerance: f64,
}

/// One set of axes.
#[derive(Debug, Clone, Default)]
pub struct Panel {
    /// Quantity and unit.
    pub y_title: String,
    /// What is drawn.
    pub lines: Vec<Line>,
}

/// A stretch of the x axis that a button shows.
#[derive(Debug, Clone)]
pub struct Window {
    /// Words on the button.
    pub label: String,
    /// From, to.
    pub range: (f64, f64),
}

/// Panels over one x axis.
#[derive(Debug, Clone, Default)]
pub struct Chart {
    /// Heading.
    pub title: String,
    /// One or two sentences below the heading: what to look at.
    pub caption: String,
    /// Quantity and unit of the x axis.
    pub x_title: String,
    /// From top to bottom.
    pub panels: Vec<Panel>,
    /// Stretches with a button; the first is shown first. Inside all but the widest the fine tolerance holds.
    pub windows: Vec<Window>,
    /// The x axis is logarithmic.
    pub log_x: bool,
    /// The lines are curves in a plane (a loop), not functions of x: no simplification.
    pub plane: bool,
    /// Every point is the mean of so many samples, the same for all lines: points get markers, and tell it. Empty: the
    /// points are samples.
    pub counts: Vec<usize>,
}

impl Chart {
    /// The windows in which full detail is kept: all but the widest, where there are several.
    fn fine(&self) -> Vec<(f64, f64)> {
        let mut ranges: Vec<(f64, f64)> = self.windows.iter().map(|w| w.range).collect();
        if ranges.len() > 1 {
            ranges.sort_by(|a, b| (a.1 - a.0).total_cmp(&(b.1 - b.0)));
            ranges.pop();
        }
        ranges
    }

    /// Traces, layout and windows for the page's script.
    pub(super) fn to_json(&self) -> String {
        let fine = self.fine();
        let mut traces = Vec::new();
        let mut seen: Vec<&str> = Vec::new();
        for (row, panel) in self.panels.iter().enumerate() {
            for line in &panel.lines {
                let first = !seen.contains(&line.name.as_str());
                seen.push(&line.name);
                traces.push(self.trace(row, line, first, &fine));
            }
        }
        let titles: Vec<String> = self.panels.iter().map(|p| quote(&p.y_title)).collect();
        let windows: Vec<String> = self
            .windows
            .iter()
            .map(|w| format!("{{\"label\":{},\"range\":[{},{}]}}", quote(&w.label), w.range.0, w.range.1))
            .collect();
        let counts: Vec<String> = self.counts.iter().map(usize::to_string).collect();
        format!(
            "{{\"title\":{},\"x\":{},\"log\":{},\"counts\":[{}],\"panels\":[{}],\"windows\":[{}],\"traces\":[{}]}}",
            quote(&self.title),
            quote(&self.x_title),
            self.log_x,
            counts.join(","),
            titles.join(","),
            windows.join(","),
            traces.join(",")
        )
    }

    /// Every point is written as it is.
    fn is_exact(&self) -> bool {
        self.plane || self.log_x || !self.counts.is_empty()
    }

    fn trace(&self, row: usize, line: &Line, first: bool, fine: &[(f64, f64)]) -> String {
        // Places of the fine stretches: x rises where the line is simplified.
        let place = |x: f64, beyond: fn(f64, f64) -> bool| line.x.partition_point(|here| beyond(*here, x));
        let stretches: Vec<(usize, usize)> =
            fine.iter().map(|(from, to)| (place(*from, |x, a| x < a), place(*to, |x, b| x <= b))).collect();
        let tolerance = |i: usize| {
            let inside = stretches.iter().any(|(from, to)| (*from..*to).contains(&i));
            if inside { line.fine_tolerance } else { line.tolerance }
        };
        let kept = if self.is_exact() {
            (0..line.x.len().min(line.y.len())).collect()
        } else {
            simplify::keep(&line.x, &line.y, tolerance)
        };
        let mut x = String::new();
        let mut y = String::new();
        let decimals = decimals(line.fine_tolerance);
        for (k, i) in kept.into_iter().enumerate() {
            if k > 0 {
                x.push(',');
                y.push(',');
            }
            if self.is_exact() {
                push_significant(&mut x, line.x[i]);
            } else {
                push(&mut x, line.x[i], 4);
            }
            push(&mut y, line.y[i], decimals);
        }
        format!(
            "{{\"row\":{row},\"name\":{},\"role\":\"{}\",\"legend\":{first},\"x\":[{x}],\"y\":[{y}]}}",
            quote(&line.name),
            line.role.name()
        )
    }
}

/// Decimals that keep rounding to a tenth of the tolerance.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn decimals(tolerance: f64) -> usize {
    if tolerance > 0.0 { (1.0 - tolerance.log10()).ceil().clamp(0.0, 12.0) as usize } else { 9 }
}

/// 10^n, exact.
const POWERS: [u32; 10] =
    [1, 10, 100, 1_000, 10_000, 100_000, 1_000_000, 10_000_000, 100_000_000, 1_000_000_000];
/// Largest value in units of its last decimal that is rounded in binary: the product then errs by less than 1e-6.
const MOST_UNITS: f64 = 1e9;

/// The value rounded to so many decimals, in units of the last; `None` where that is too large for binary rounding or too near a
/// tie to trust it.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn units(value: f64, decimals: usize) -> Option<u32> {
    let units = value.abs() * f64::from(*POWERS.get(decimals)?);
    if units >= MOST_UNITS {
        return None;
    }
    let whole = units as u32;
    let part = units - f64::from(whole);
    ((part - 0.5).abs() > 1e-6).then_some(whole + u32::from(part > 0.5))
}

fn push(text: &mut String, value: f64, decimals: usize) {
    if !value.is_finite() {
        text.push_str("null");
        return;
    }
    // A report has some hundred thousand numbers, and the formatter of the standard library is exact at the cost of long
    // arithmetic wherever a value has a short decimal. Both ways give the same bytes.
    match units(value, decimals) {
        Some(units) => push_units(text, value < 0.0, units, decimals),
        None => push_exactly(text, value, decimals),
    }
}

/// `units` of the last of so many decimals, without zeros at the end.
fn push_units(text: &mut String, negative: bool, units: u32, decimals: usize) {
    let scale = POWERS[decimals];
    let (whole, mut part) = (units / scale, units % scale);
    if negative && units > 0 {
        text.push('-');
    }
    let mut buffer = itoa::Buffer::new();
    text.push_str(buffer.format(whole));
    if part == 0 {
        return;
    }
    let mut places = decimals;
    while part.is_multiple_of(10) {
        part /= 10;
        places -= 1;
    }
    text.push('.');
    let digits = buffer.format(part);
    (digits.len()..places).for_each(|_| text.push('0'));
    text.push_str(digits);
}

fn push_exactly(text: &mut String, value: f64, decimals: usize) {
    let start = text.len();
    // Writing to a string cannot fail.
    let _ = write!(text, "{value:.decimals$}");
    if text[start..].contains('.') {
        let short = text.trim_end_matches('0').trim_end_matches('.').len();
        text.truncate(short);
    }
    if &text[start..] == "-0" {
        text.truncate(start);
        text.push('0');
    }
}

fn push_significant(text: &mut String, value: f64) {
    if value.is_finite() {
        let _ = write!(text, "{value:.5e}");
    } else {
        text.push_str("null");
    }
}

/// A JSON string that is safe inside a script element too.
pub(super) fn quote(text: &str) -> String {
    serde_json::Value::from(text).to_string().replace('<', "\\u003c")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_short_as_the_tolerance_allows() {
        assert_eq!(decimals(1e-3), 4);
        let mut text = String::new();
        push(&mut text, 1.230_04, 4);
        text.push(' ');
        push(&mut text, -0.000_01, 4);
        text.push(' ');
        push(&mut text, 100.0, 0);
        text.push(' ');
        push(&mut text, f64::NAN, 2);
        assert_eq!(text, "1.23 0 100 null");
    }

    #[test]
    fn numbers_rounded_in_binary_have_the_digits_of_the_exact_ones() {
        let (mut x, mut binary) = (1e-9_f64, 0);
        while x < 1e7 {
            x *= 1.003_7;
            // Also what a time of the control period looks like, and ties.
            for value in
                [x, -x, (x * 1e4).round() / 1e4, (x * 8.0).round() / 8.0, (x * 100.0).floor() / 100.0 + 0.005]
            {
                for decimals in 0..=9 {
                    let (mut fast, mut exact) = (String::new(), String::new());
                    push(&mut fast, value, decimals);
                    push_exactly(&mut exact, value, decimals);
                    assert_eq!(fast, exact, "{value:?} to {decimals}");
                    binary += u32::from(units(value, decimals).is_some());
                }
            }
        }
        assert!(binary > 100_000, "{binary}");
    }

    #[test]
    fn detail_is_kept_in_all_windows_but_the_widest_and_the_json_is_json() {
        let x: Vec<f64> = (0..10_000).map(|k| f64::from(k) * 1e-3).collect();
        let y: Vec<f64> = x.iter().map(|x| 0.01 * (300.0 * x).sin()).collect();
        let line = Line {
            name: "</script>".into(),
            role: Role::Measured,
            x,
            y,
            tolerance: 0.1,
            fine_tolerance: 1e-4,
        };
        let window = |label: &str, range| Window { label: label.into(), range };
        let chart = Chart {
            panels: vec![Panel { y_title: "N m".into(), lines: vec![line] }],
            windows: vec![window("step", (4.0, 4.5)), window("all", (0.0, 10.0))],
            ..Chart::default()
        };
        let json = chart.to_json();
        assert!(!json.contains("</script>"));
        let value: serde_json::Value = serde_json::from_str(&json).unwrap();
        let times = value["traces"][0]["x"].as_array().unwrap();
        let inside = times.iter().filter(|x| (4.0..=4.5).contains(&x.as_f64().unwrap())).count();
        assert!(inside > 400, "{inside} points inside");
        assert!(times.len() - inside < 5, "{} points outside", times.len() - inside);
        assert_eq!(value["traces"][0]["name"], "</script>");
    }
}
