//! A log: signals over time from the rig, the PC rig or another machine.
//!
//! Format: one header line of comma-separated names with SI units in them, one line a sample, `.`
//! decimals, time strictly increasing; lines that start with `#` are `# key: value` metadata. Parquet
//! files hold the same columns. Column order is free. Columns the tool does not know are kept: as
//! numbers where every cell is one, else as text.
//! Refused, with the line: NaN and infinities in known columns, time that stands still or goes back,
//! gaps ([`gap rule`](Log::GAP_RULE)), ragged lines, two columns of one name, a known quantity in
//! another unit.
//! Left out: resampling. Uneven sampling is passed on as it is; stamps that are uneven where the samples are not can be replaced
//! ([`Log::as_sampled`]).

use std::borrow::Cow;
use std::path::Path;

use super::signal::{SIGNALS, Signal};
use super::speed_lag::{self, Lag};
use super::stamp_wobble::even_samples;
use super::{import, log_check, log_csv, log_mcap, log_parquet, plausible};
use crate::input_error::InputError;
use crate::notices;

/// Cells of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum Cells {
    /// Finite numbers.
    Numbers(Vec<f64>),
    /// An unknown column with at least one cell that is not a finite number, as it was written.
    Text(Vec<String>),
}

impl Cells {
    /// Number of cells.
    pub fn len(&self) -> usize {
        match self {
            Self::Numbers(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

/// A named column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Name with unit.
    pub name: String,
    /// One cell a sample.
    pub cells: Cells,
}

/// What a log can be used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum LogKind {
    /// The elements touch the disc: motion, normal force and friction torque are there.
    Contact,
    /// A rotary drive alone: torque in, angle out.
    RotaryDrive,
    /// A linear stage alone: force in, position out.
    LinearDrive,
}

/// Key of the metadata that say of time stamps that were replaced.
const REPLACED_STAMPS: &str = "time stamps replaced";

/// Signals over time.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Log {
    /// The file as the user named it; what errors about this log say.
    pub source: String,
    /// `# key: value` lines in their order; a comment without `:` has an empty key.
    pub metadata: Vec<(String, String)>,
    /// Columns in their order.
    pub columns: Vec<Column>,
    /// Line in the file of each sample where lines were left out between (metadata, blank lines):
    /// `(sample, line)` from which the lines count on; empty for Parquet.
    pub(super) line_marks: Vec<(usize, u64)>,
}

/// What the contact models are driven with and compared to.
#[derive(Debug, Clone)]
pub struct ContactSignals<'a> {
    /// Time, strictly increasing.
    pub time_s: &'a [f64],
    /// Speed of the disc, as logged or differentiated from its angle.
    pub m2_speed_rad_s: Cow<'a, [f64]>,
    /// Angle of the disc, where it is logged.
    pub m2_angle_rad: Option<&'a [f64]>,
    /// Normal force.
    pub normal_force_n: &'a [f64],
    /// Friction torque.
    pub friction_torque_nm: &'a [f64],
}

/// Force (or torque) in, position (or angle) out.
#[derive(Debug, Clone, Copy)]
pub struct DriveSignals<'a> {
    /// Time, strictly increasing.
    pub time_s: &'a [f64],
    /// Newtons, or newton metres for a rotary drive.
    pub effort: &'a [f64],
    /// Metres, or radians for a rotary drive.
    pub position: &'a [f64],
}

impl Log {
    /// When two samples are too far apart to belong to one log.
    pub const GAP_RULE: &'static str =
        "steps up to 6 ms, and any step up to 10 times the 90th percentile of the log's steps";

    /// Reads a log, Parquet if the name ends so, else text ([`import`]), and checks it: its form, and whether its
    /// values can be what their columns say. Doubts become notices.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        let log = import::read(path)?;
        log_check::check(&log)?;
        plausible::check(&log)?;
        Ok(log)
    }

    /// Reads a log as [`Self::read`] does, and takes its samples at the times at which they were taken ([`Self::as_sampled`]).
    pub fn read_as_sampled(path: &Path) -> Result<Self, InputError> {
        Self::read(path).map(Self::as_sampled)
    }

    /// Parses and checks a CSV text; `source` is the name that errors will give.
    pub fn parse_csv(source: &str, bytes: &[u8]) -> Result<Self, InputError> {
        let log = log_csv::parse(source, bytes)?;
        log_check::check(&log)?;
        Ok(log)
    }

    /// The log as CSV: equal logs give equal bytes.
    pub fn to_csv(&self) -> String {
        log_csv::write(self)
    }

    /// The log as the bytes of a Parquet file: equal logs give equal bytes.
    pub fn to_parquet(&self) -> Result<Vec<u8>, InputError> {
        log_parquet::write(self)
    }

    /// The log as the bytes of an MCAP file, for viewers: equal logs give equal bytes.
    pub fn to_mcap(&self) -> Result<Vec<u8>, InputError> {
        log_mcap::write(self)
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        self.columns.first().map_or(0, |column| column.cells.len())
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// A numeric column by its name.
    pub fn numbers(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|column| column.name == name).and_then(|column| match &column.cells {
            Cells::Numbers(values) => Some(values.as_slice()),
            Cells::Text(_) => None,
        })
    }

    /// A known column.
    pub fn signal(&self, signal: Signal) -> Option<&[f64]> {
        self.numbers(signal.column())
    }

    /// A known column that must be there; the error lists what is there instead.
    pub fn require(&self, signal: Signal) -> Result<&[f64], InputError> {
        self.signal(signal).ok_or_else(|| self.missing(&[signal]))
    }

    /// Time of each sample; empty only in a log made in memory without it.
    pub fn time_s(&self) -> &[f64] {
        self.signal(Signal::Time).unwrap_or_default()
    }

    /// The metadata value of a key.
    pub fn metadata(&self, key: &str) -> Option<&str> {
        self.metadata.iter().find(|(name, _)| name == key).map(|(_, value)| value.as_str())
    }

    /// Appends a numeric column, or replaces the one of this name.
    pub fn set_numbers(&mut self, name: &str, values: Vec<f64>) {
        match self.columns.iter_mut().find(|column| column.name == name) {
            Some(column) => column.cells = Cells::Numbers(values),
            None => self.columns.push(Column { name: name.into(), cells: Cells::Numbers(values) }),
        }
    }

    /// Appends a known column, or replaces it.
    pub fn set_signal(&mut self, signal: Signal, values: Vec<f64>) {
        self.set_numbers(signal.column(), values);
    }

    /// Line in the file of a sample; sample + 1 where the log has no lines.
    pub fn line_of(&self, sample: usize) -> u64 {
        let after = self.line_marks.partition_point(|(first, _)| *first <= sample);
        match after.checked_sub(1).and_then(|at| self.line_marks.get(at)) {
            Some((first, line)) => line + (sample - first) as u64,
            None => sample as u64 + 1,
        }
    }

    /// What this log can be used for, from its columns.
    ///
    /// A log with a normal force or a friction torque is meant as a contact log. Else it is a drive log.
    pub fn kind(&self) -> Result<LogKind, InputError> {
        let has = |signal| self.signal(signal).is_some();
        if has(Signal::NormalForce) || has(Signal::FrictionTorque) {
            let motion = has(Signal::M2Speed) || has(Signal::M2Angle);
            let mut missing: Vec<Signal> = if motion { vec![] } else { vec![Signal::M2Speed] };
            missing.extend([Signal::NormalForce, Signal::FrictionTorque].into_iter().filter(|s| !has(*s)));
            return if missing.is_empty() { Ok(LogKind::Contact) } else { Err(self.missing(&missing)) };
        }
        let (rotary, linear) = ([Signal::M2Torque, Signal::M2Angle], [Signal::Force, Signal::Position]);
        if rotary.into_iter().all(has) {
            Ok(LogKind::RotaryDrive)
        } else if linear.into_iter().all(has) {
            Ok(LogKind::LinearDrive)
        } else if linear.into_iter().any(has) {
            Err(self.missing(&linear.into_iter().filter(|s| !has(*s)).collect::<Vec<_>>()))
        } else if has(Signal::M2Speed) {
            Err(self.missing(&[Signal::NormalForce, Signal::FrictionTorque]))
        } else {
            let missing: Vec<Signal> = rotary.into_iter().filter(|s| !has(*s)).collect();
            Err(self.missing(&missing))
        }
    }

    /// With the times at which its samples were taken, where the motion shows that the stamps wobble and the samples do not; what is
    /// replaced is said, and kept with the log.
    #[must_use]
    pub fn as_sampled(mut self) -> Self {
        let position = self.signal(Signal::M2Angle).map(unwrapped);
        let position = position.or_else(|| self.signal(Signal::Position).map(<[f64]>::to_vec));
        let Some(even) = position.and_then(|position| even_samples(self.time_s(), &position)) else {
            return self;
        };
        let said = format!(
            "{}: the time stamps wobble by {:.1} % of a step (RMS), the samples do not (the motion shows {:.1} ± {:.1} % of it): even \
             times, {:.4} ms apart, are used in their place",
            self.source,
            100.0 * even.off_s / even.step_s,
            100.0 * even.shown.0,
            100.0 * even.shown.1,
            1e3 * even.step_s,
        );
        notices::warn(&said);
        self.metadata.push((REPLACED_STAMPS.into(), said));
        self.set_signal(Signal::Time, even.time_s);
        self
    }

    /// What was said of the time stamps where [`Self::as_sampled`] replaced them.
    pub fn replaced_stamps(&self) -> Option<&str> {
        self.metadata(REPLACED_STAMPS)
    }

    /// By how much the speed lags the angle, where it surely does.
    pub fn speed_lag(&self) -> Option<Lag> {
        let (speed, angle) = (self.signal(Signal::M2Speed)?, self.signal(Signal::M2Angle)?);
        speed_lag::lag(self.time_s(), speed, angle)
    }

    /// The speed column, where there is one that is in time with the angle.
    pub fn speed_in_time(&self) -> Option<&[f64]> {
        self.signal(Signal::M2Speed).filter(|_| self.speed_lag().is_none())
    }

    /// The signals of a contact log. Speed is taken from the angle where there is no speed column that is in time with it:
    /// the slope of the parabola through a sample and its neighbours.
    pub fn contact(&self) -> Result<ContactSignals<'_>, InputError> {
        let time_s = self.require(Signal::Time)?;
        let missing: Vec<Signal> = [Signal::NormalForce, Signal::FrictionTorque]
            .into_iter()
            .filter(|signal| self.signal(*signal).is_none())
            .collect();
        let m2_speed_rad_s = match (self.speed_in_time(), self.signal(Signal::M2Angle)) {
            (Some(speed), _) => Cow::Borrowed(speed),
            (None, Some(angle)) => Cow::Owned(slope(time_s, &unwrapped(angle))),
            (None, None) => return Err(self.missing(&[&[Signal::M2Speed], missing.as_slice()].concat())),
        };
        if !missing.is_empty() {
            return Err(self.missing(&missing));
        }
        Ok(ContactSignals {
            time_s,
            m2_speed_rad_s,
            m2_angle_rad: self.signal(Signal::M2Angle),
            normal_force_n: self.require(Signal::NormalForce)?,
            friction_torque_nm: self.require(Signal::FrictionTorque)?,
        })
    }

    /// The signals of a drive log (or of the drive in a contact log).
    pub fn drive(&self) -> Result<DriveSignals<'_>, InputError> {
        let linear = self.signal(Signal::Force).is_some() && self.signal(Signal::M2Torque).is_none();
        let (effort, position) =
            if linear { (Signal::Force, Signal::Position) } else { (Signal::M2Torque, Signal::M2Angle) };
        Ok(DriveSignals {
            time_s: self.require(Signal::Time)?,
            effort: self.require(effort)?,
            position: self.require(position)?,
        })
    }

    fn missing(&self, missing: &[Signal]) -> InputError {
        let wanted: Vec<String> = missing
            .iter()
            .map(|s| match s {
                Signal::M2Speed => "m2_speed_rad_s (or m2_angle_rad)".to_string(),
                s => s.column().to_string(),
            })
            .collect();
        let there: Vec<&str> = self.columns.iter().map(|column| column.name.as_str()).collect();
        let (word, verb) = if wanted.len() == 1 { ("column", "is") } else { ("columns", "are") };
        InputError::new(format!("{word} {} {verb} missing", wanted.join(", ")))
            .file(self.source.as_str())
            .allowed(format!("this column in SI units; the file has {}", there.join(", ")))
    }

    /// The log in two parts: the first share of its samples, and the rest.
    #[must_use]
    pub fn split(&self, share: f64) -> (Self, Self) {
        let at = (share * self.len() as f64) as usize;
        let part = |name: &str, from: usize, to: usize| {
            let mut log = self.clone();
            log.source = format!("{} ({name})", self.source);
            for column in &mut log.columns {
                column.cells = match &column.cells {
                    Cells::Numbers(values) => Cells::Numbers(values[from..to].to_vec()),
                    Cells::Text(values) => Cells::Text(values[from..to].to_vec()),
                };
            }
            log
        };
        (part("first part", 0, at), part("last part", at, self.len()))
    }

    /// Signals in the order in which the tool writes them, then all other columns.
    pub fn sort_columns(&mut self) {
        let rank = |name: &str| SIGNALS.iter().position(|s| s.column() == name).unwrap_or(SIGNALS.len());
        self.columns.sort_by_key(|column| rank(&column.name));
    }
}

/// Takes out jumps by a revolution.
pub fn unwrapped(angle_rad: &[f64]) -> Vec<f64> {
    use std::f64::consts::{PI, TAU};
    let (mut turns, mut last) = (0.0, angle_rad.first().copied().unwrap_or(0.0));
    let unwrap = |angle: &f64| {
        let jump = angle - last;
        last = *angle;
        if jump.abs() > PI {
            turns -= (jump / TAU).round();
        }
        angle + turns * TAU
    };
    angle_rad.iter().map(unwrap).collect()
}

/// Median of the steps; `None` if time stands still or goes back.
pub(crate) fn median_step(time_s: &[f64]) -> Option<f64> {
    let mut steps: Vec<f64> = time_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if steps.is_empty() || steps.iter().any(|step| !step.is_finite() || *step <= 0.0) {
        return None;
    }
    let middle = steps.len() / 2;
    Some(*steps.select_nth_unstable_by(middle, f64::total_cmp).1)
}

/// Slope at each sample of the parabola through it and its neighbours; one-sided at the ends.
pub(crate) fn slope(x: &[f64], y: &[f64]) -> Vec<f64> {
    let secant = |i: usize| (y[i + 1] - y[i]) / (x[i + 1] - x[i]);
    match x.len() {
        0 | 1 => vec![0.0; x.len()],
        2 => vec![secant(0); 2],
        n => (0..n)
            .map(|i| {
                // Slopes left and right, each weighted with the other side's width.
                let at = i.clamp(1, n - 2);
                let (left, right) = (x[at] - x[at - 1], x[at + 1] - x[at]);
                let (a, b) = (secant(at - 1), secant(at));
                let curvature = (b - a) / (left + right);
                (a * right + b * left) / (left + right) + 2.0 * curvature * (x[i] - x[at])
            })
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn even_samples_behind_uneven_stamps_are_put_in_their_place_and_it_is_said() {
        let even: Vec<f64> = (0..5000).map(|i| 2e-3 * f64::from(i)).collect();
        // Swings at random, as the digits of a square root are.
        let wobble = |i: usize| 2e-4 * ((1e4 * (i as f64).sqrt()).fract() - 0.5);
        let mut log = Log::default();
        log.set_signal(Signal::Time, even.iter().enumerate().map(|(i, t)| t + wobble(i)).collect());
        let angle = |t: &f64| (9.0 * t - 3.0 * t.cos()).rem_euclid(std::f64::consts::TAU);
        log.set_signal(Signal::M2Angle, even.iter().map(angle).collect());
        let taken = log.clone().as_sampled();
        for (taken, even) in taken.time_s().iter().zip(&even) {
            assert!((taken - even).abs() < 1e-5, "{taken} {even}");
        }
        assert!(taken.replaced_stamps().is_some_and(|said| said.contains("2.0000 ms apart")));
        log.set_signal(Signal::M2Angle, log.time_s().iter().map(angle).collect());
        assert_eq!(log.clone().as_sampled(), log);
    }

    #[test]
    fn an_angle_that_begins_anew_at_each_turn_gives_the_speed_where_the_column_lags() {
        let time_s: Vec<f64> = (0..5000).map(|i| 1e-3 * f64::from(i)).collect();
        let speed = |t: f64| 9.0 + 3.0 * t.sin();
        let angle = |t: f64| (9.0 * t - 3.0 * t.cos()).rem_euclid(std::f64::consts::TAU);
        let mut log = Log::default();
        log.set_signal(Signal::M2Speed, time_s.iter().map(|t| speed(t - 2e-3)).collect());
        log.set_signal(Signal::M2Angle, time_s.iter().map(|t| angle(*t)).collect());
        log.set_signal(Signal::NormalForce, vec![80.0; time_s.len()]);
        log.set_signal(Signal::FrictionTorque, vec![5.0; time_s.len()]);
        log.set_signal(Signal::Time, time_s.clone());
        let taken = log.contact().unwrap().m2_speed_rad_s;
        // The column is up to 6 mrad/s off.
        for (t, taken) in time_s.iter().zip(taken.iter()) {
            assert!((taken - speed(*t)).abs() < 1e-5, "{t}: {taken}");
        }
    }

    #[test]
    fn the_slope_of_a_parabola_is_exact_on_uneven_samples() {
        let x = [0.0, 0.1, 0.15, 0.4, 0.5];
        let y: Vec<f64> = x.iter().map(|x| 3.0 * x * x - x).collect();
        for (x, slope) in x.iter().zip(slope(&x, &y)) {
            // Rounding of differences of order 0.1.
            assert!((slope - (6.0 * x - 1.0)).abs() < 1e-12);
        }
    }
}
