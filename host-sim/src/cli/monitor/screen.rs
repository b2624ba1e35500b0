//! The screen: five plots and the state of the rig in words.
//!
//! Everything fits 80 × 24, but for the histograms of the ticks' times, which come last. Two lines in one plot differ by
//! their marks, a drawn line and dots, not by colour alone.

use std::io::{Stdout, stdout};
use std::time::{Duration, Instant};

use ratatui::Frame;
use ratatui::Terminal;
use ratatui::backend::CrosstermBackend;
use ratatui::crossterm::event::{Event, KeyCode, KeyEvent, KeyEventKind, KeyModifiers, poll, read};
use ratatui::crossterm::execute;
use ratatui::crossterm::terminal::{
    EnterAlternateScreen, LeaveAlternateScreen, disable_raw_mode, enable_raw_mode,
};
use ratatui::layout::{Constraint, Layout, Rect};
use ratatui::style::{Color, Modifier, Style};
use ratatui::symbols::Marker;
use ratatui::text::{Line, Span};
use ratatui::widgets::{Axis, Block, Borders, Chart, Dataset, GraphType, Paragraph, Wrap};
use rig_link::telemetry::TelemetryRow;

use super::history::History;
use super::timing;
use crate::input_error::InputError;
use crate::link::words;

/// 50 rows a second.
pub(super) const EVERY_TICKS: u16 = 200;
/// Time between two pictures.
const REDRAW: Duration = Duration::from_millis(100);
/// Cycles of the processor in a control tick: 480 MHz, 10 kHz.
const CYCLES_PER_TICK: f64 = 48_000.0;
const SPANS_S: [f64; 8] = [1.0, 2.0, 5.0, 10.0, 20.0, 40.0, 60.0, 120.0];

/// The terminal as long as the picture is on it.
pub(super) struct Screen {
    terminal: Terminal<CrosstermBackend<Stdout>>,
    port: String,
    drawn: Option<Instant>,
    held: Option<History>,
    colour: bool,
}

fn failed(error: impl std::fmt::Display) -> InputError {
    InputError::new(format!("the terminal cannot show the screen: {error}")).allowed("--plain")
}

impl Screen {
    pub(super) fn open(port: &str) -> Result<Self, InputError> {
        enable_raw_mode().map_err(failed)?;
        let entered = execute!(stdout(), EnterAlternateScreen)
            .and_then(|()| Terminal::new(CrosstermBackend::new(stdout())));
        match entered {
            Ok(terminal) => Ok(Self {
                terminal,
                port: port.to_owned(),
                drawn: None,
                held: None,
                colour: std::env::var_os("NO_COLOR").is_none_or(|value| value.is_empty()),
            }),
            Err(error) => {
                // The error is what matters.
                let _ = disable_raw_mode();
                Err(failed(error))
            }
        }
    }

    /// Draws when it is time, and takes keys; says whether the person has had enough.
    pub(super) fn look(&mut self, history: &mut History) -> bool {
        while poll(Duration::ZERO).unwrap_or(false) {
            match read() {
                Ok(Event::Key(key)) => {
                    let down = key.kind != KeyEventKind::Release;
                    if down && self.pressed(key, history) {
                        return true;
                    }
                }
                Ok(Event::Resize(..)) => self.drawn = None,
                _ => {}
            }
        }
        if self.drawn.is_none_or(|drawn| drawn.elapsed() >= REDRAW) {
            self.drawn = Some(Instant::now());
            let shown = self.held.as_ref().unwrap_or(history);
            let (port, colour, held) = (&self.port, self.colour, self.held.is_some());
            // A picture that fails is followed by another one.
            let _ = self.terminal.draw(|frame| draw(frame, shown, port, colour, held));
        }
        false
    }

    fn pressed(&mut self, key: KeyEvent, history: &mut History) -> bool {
        let shown = self.held.as_mut().unwrap_or(history);
        match key.code {
            KeyCode::Char('c') if key.modifiers.contains(KeyModifiers::CONTROL) => return true,
            KeyCode::Char('q') | KeyCode::Esc => return true,
            KeyCode::Char('+' | '=') => {
                shown.span_s = SPANS_S.into_iter().find(|s| *s > shown.span_s).unwrap_or(shown.span_s);
            }
            KeyCode::Char('-') => {
                shown.span_s = SPANS_S.into_iter().rfind(|s| *s < shown.span_s).unwrap_or(shown.span_s);
            }
            KeyCode::Char(' ') => self.held = if self.held.is_some() { None } else { Some(history.clone()) },
            _ => return false,
        }
        self.drawn = None;
        false
    }
}

impl Drop for Screen {
    fn drop(&mut self) {
        // Whatever fails here, there is nothing better to do.
        let _ = execute!(stdout(), LeaveAlternateScreen);
        let _ = disable_raw_mode();
        let _ = self.terminal.show_cursor();
    }
}

/// A line of a plot.
struct Curve {
    name: &'static str,
    value: fn(&TelemetryRow) -> f32,
}

/// A plot: what it shows, in which unit, with how many decimals, and the least range of its axis.
struct Plot {
    title: &'static str,
    unit: &'static str,
    decimals: usize,
    least: f64,
    curves: &'static [Curve],
}

const PLOTS: [Plot; 5] = [
    Plot {
        title: "normal force",
        unit: "N",
        decimals: 1,
        least: 10.0,
        curves: &[Curve { name: "", value: |row| row.normal_force_n }],
    },
    Plot {
        title: "friction",
        unit: "N m",
        decimals: 3,
        least: 0.5,
        curves: &[
            Curve { name: "", value: |row| row.friction_torque_nm },
            Curve { name: "observer", value: |row| row.predicted_friction_torque_nm },
        ],
    },
    Plot {
        title: "speed",
        unit: "rad/s",
        decimals: 2,
        least: 1.0,
        curves: &[
            Curve { name: "", value: |row| row.m2_speed_rad_s },
            Curve { name: "setpoint", value: |row| row.m2_speed_ref_rad_s },
        ],
    },
    Plot {
        title: "torque M1",
        unit: "N m",
        decimals: 2,
        least: 1.0,
        curves: &[
            Curve { name: "", value: |row| row.m1_torque_nm },
            Curve { name: "M2", value: |row| row.m2_torque_nm },
        ],
    },
    Plot {
        title: "residual",
        unit: "N m",
        decimals: 3,
        least: 0.1,
        curves: &[Curve { name: "", value: |row| row.friction_torque_nm - row.predicted_friction_torque_nm }],
    },
];

/// Draws everything.
fn draw(frame: &mut Frame<'_>, history: &History, port: &str, colour: bool, held: bool) {
    let [top, middle, bottom] =
        Layout::vertical([Constraint::Length(1), Constraint::Min(3), Constraint::Length(3)])
            .areas(frame.area());
    frame.render_widget(status(history, port, colour, held), top);
    let rows: [Rect; 3] = Layout::vertical([Constraint::Ratio(1, 3); 3]).areas(middle);
    let places: Vec<Rect> = rows
        .into_iter()
        .flat_map(|row| Layout::horizontal([Constraint::Ratio(1, 2); 2]).areas::<2>(row))
        .collect();
    let [first @ .., last] = places.as_slice() else { return };
    for (plot, place) in PLOTS.iter().zip(first) {
        draw_plot(frame, history, plot, *place, colour);
    }
    let words = Paragraph::new(state(history, colour))
        .wrap(Wrap { trim: true })
        .block(Block::new().borders(Borders::TOP).title("state"));
    frame.render_widget(words, *last);
    let mut lines: Vec<Line<'_>> =
        history.notes.iter().rev().take(2).rev().map(|n| Line::raw(n.as_str())).collect();
    lines
        .push(Line::styled("q quit   + - time shown   space hold", Style::new().add_modifier(Modifier::DIM)));
    frame.render_widget(Paragraph::new(lines), bottom);
}

fn status<'a>(history: &History, port: &'a str, colour: bool, held: bool) -> Line<'a> {
    let row = history.rows.back();
    let mode = row.map_or("waiting for the rig".to_owned(), |row| words::mode(row.mode).to_uppercase());
    let style = match row {
        Some(row) if row.fault != 0 && colour => Style::new().fg(Color::Red),
        _ => Style::new(),
    };
    let supply = row.map_or(String::new(), |row| format!("   supply {:.1} V", row.supply_v));
    let hold = if held { "   HELD" } else { "" };
    Line::from(vec![
        Span::styled(mode, style.add_modifier(Modifier::BOLD)),
        Span::raw(format!("   {port}{supply}   last {} s{hold}", history.span_s)),
    ])
}

/// The rig in words: fault, limits, load of the loop, what was lost.
fn state(history: &History, colour: bool) -> Vec<Line<'static>> {
    let mut lines = Vec::new();
    let alarm =
        if colour { Style::new().fg(Color::Red) } else { Style::new().add_modifier(Modifier::REVERSED) };
    if let Some(row) = history.rows.back() {
        if row.fault == 0 {
            lines.push(Line::raw("no fault"));
        } else {
            lines.push(Line::styled(words::fault(row.fault), alarm));
        }
        let limits = words::limits(row.limits);
        if !limits.is_empty() {
            lines.push(Line::raw(limits));
        }
    }
    if let Some(health) = &history.health {
        let load = 100.0 * f64::from(health.cycles_max) / CYCLES_PER_TICK;
        lines.push(Line::raw(format!(
            "loop: at most {load:.0} % of a tick, {} late, jitter {} ns",
            health.deadline_misses,
            health.start_max_ns.saturating_sub(health.start_min_ns)
        )));
    }
    lines.push(Line::raw(format!(
        "link: {} rows lost, {} frames damaged",
        history.rows_lost, history.frames_rejected
    )));
    // Last, for larger windows: what must be seen in 80 × 24 is above.
    if let Some(health) = &history.health {
        lines.push(Line::raw(format!("ticks: {}", timing::shares(&health.cycles, "cycles"))));
        lines.push(Line::raw(format!(
            "start after the scan: {}; stack {} %",
            timing::shares(&health.starts, "ns"),
            timing::stack_percent(health)
        )));
    }
    lines
}

fn draw_plot(frame: &mut Frame<'_>, history: &History, plot: &Plot, place: Rect, colour: bool) {
    let points: Vec<Vec<(f64, f64)>> = plot.curves.iter().map(|curve| history.points(curve.value)).collect();
    let (low, high) = range(points.iter().flatten().map(|(_, y)| *y), plot.least);
    let colours = [Color::Cyan, Color::Yellow];
    let datasets: Vec<Dataset<'_>> = points
        .iter()
        .enumerate()
        .rev()
        .map(|(at, points)| {
            let style = if colour { Style::new().fg(colours[at.min(1)]) } else { Style::new() };
            let (marker, kind) =
                if at == 0 { (Marker::Braille, GraphType::Line) } else { (Marker::Dot, GraphType::Scatter) };
            Dataset::default().data(points).marker(marker).graph_type(kind).style(style)
        })
        .collect();
    let decimals = plot.decimals.min(2);
    let chart = Chart::new(datasets)
        .block(Block::new().borders(Borders::TOP).title(title(history, plot)))
        .x_axis(Axis::default().bounds([-history.span_s, 0.0]))
        .y_axis(
            Axis::default()
                .bounds([low, high])
                .labels([format!("{low:7.decimals$}"), format!("{high:7.decimals$}")]),
        )
        .legend_position(None);
    frame.render_widget(chart, place);
}

/// Quantity and value now: `friction 4.231 N m, • observer 4.198`.
fn title(history: &History, plot: &Plot) -> String {
    let decimals = plot.decimals;
    let value = |curve: &Curve| {
        history.rows.back().map_or("-".to_owned(), |row| format!("{:.decimals$}", (curve.value)(row)))
    };
    let mut title = String::new();
    for (at, curve) in plot.curves.iter().enumerate() {
        title += &match at {
            0 => format!("{} {} {}", plot.title, value(curve), plot.unit),
            _ => format!(", • {} {}", curve.name, value(curve)),
        };
    }
    title
}

/// The axis: all values with room around them, and never narrower than noise.
fn range(values: impl Iterator<Item = f64>, least: f64) -> (f64, f64) {
    let (low, high) = values
        .filter(|v| v.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
    if low > high {
        return (-0.5 * least, 0.5 * least);
    }
    let half = (0.55 * (high - low)).max(0.5 * least);
    let middle = 0.5 * (low + high);
    (middle - half, middle + half)
}

#[cfg(test)]
mod tests {
    use super::*;
    use model_core::control::Mode;
    use ratatui::backend::TestBackend;
    use rig_link::telemetry::Health;

    fn history() -> History {
        let mut history = History::new(10.0);
        let rows: Vec<TelemetryRow> = (0..500_u32)
            .map(|sequence| TelemetryRow {
                sequence,
                tick: u64::from(sequence) * 200,
                normal_force_n: 88.0,
                friction_torque_nm: 4.25,
                predicted_friction_torque_nm: 4.20,
                m2_speed_rad_s: 3.17,
                m2_speed_ref_rad_s: if sequence < 250 { 0.0 } else { 3.0 },
                supply_v: 24.0,
                mode: Mode::Running.number(),
                limits: 1 << 4,
                ..TelemetryRow::default()
            })
            .collect();
        history.take(&rows);
        history.health = Some(Health { cycles_max: 12_000, ..Health::default() });
        history.note("0.1000 s  armed -> running: started".into());
        history
    }

    fn picture(history: &History, width: u16, height: u16, colour: bool) -> (String, bool) {
        let mut terminal = Terminal::new(TestBackend::new(width, height)).unwrap();
        terminal.draw(|frame| draw(frame, history, "/dev/ttyACM0", colour, false)).unwrap();
        let buffer = terminal.backend().buffer();
        let coloured = buffer.content().iter().any(|cell| cell.fg != Color::Reset || cell.bg != Color::Reset);
        let lines: Vec<String> = buffer
            .content()
            .chunks(usize::from(width))
            .map(|line| line.iter().map(|cell| cell.symbol()).collect::<String>().trim_end().to_owned())
            .collect();
        (lines.join("\n"), coloured)
    }

    #[test]
    fn eighty_by_twenty_four_has_room_for_all_of_it() {
        let (text, coloured) = picture(&history(), 80, 24, true);
        for words in [
            "RUNNING   /dev/ttyACM0   supply 24.0 V   last 10 s",
            "normal force 88.0 N",
            "friction 4.250 N m, • observer 4.200",
            "speed 3.17 rad/s, • setpoint 3.00",
            "torque M1 0.00 N m, • M2 0.00",
            "residual 0.050 N m",
            "no fault",
            "loop: at most 25 % of a tick",
            "link: 0 rows lost, 0 frames damaged",
            "armed -> running",
            "q quit",
        ] {
            assert!(text.contains(words), "{words}\n{text}");
        }
        assert!(coloured);
        // Curves are drawn: the setpoint's step as dots, the speed as a line of Braille dots.
        let drawn =
            |range: std::ops::RangeInclusive<char>| text.chars().filter(|c| range.contains(c)).count();
        assert!(drawn('\u{2801}'..='\u{28ff}') > 30, "{text}");
        assert!(drawn('•'..='•') > 20, "{text}");
    }

    #[test]
    fn without_colour_nothing_is_lost_and_a_fault_stands_out() {
        let mut history = history();
        let (with, _) = picture(&history, 80, 24, true);
        let (without, coloured) = picture(&history, 80, 24, false);
        assert_eq!(with, without);
        assert!(!coloured);
        if let Some(row) = history.rows.back_mut() {
            row.fault = 1;
        }
        assert!(picture(&history, 80, 24, false).0.contains("fault 1: The emergency stop"));
    }

    #[test]
    fn any_size_is_drawn() {
        for (width, height) in [(1, 1), (20, 5), (40, 12), (200, 60)] {
            picture(&history(), width, height, true);
            picture(&History::new(1.0), width, height, true);
        }
    }
}
