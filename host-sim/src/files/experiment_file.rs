//! The experiment file: what each motor is asked for over time, or a study without motors.
//!
//! Four kinds. `closed_loop` (the default) has lists of segments, `[[m1]]` and `[[m2]]`; a segment lasts
//! until the next one of its motor starts. `two_motors` has the same lists, of torques, for the original rig.
//! `patch_crossing` draws elements across a contact patch at a prescribed slip, `speed_sweep` takes the steady friction
//! over speed; both need no motors.
//! Quantities carry their unit in the key: `torque_nm`, `torque_fraction` (of the motor's rated torque),
//! `speed_rad_s`, `speed_rpm`. A segment gives its value (`torque_nm = 3.0`), a ramp also where it ends
//! (`end_torque_nm`, `ramp_s`), a sine its mean under the plain key, `amplitude_torque_nm`,
//! `angular_frequency_rad_s` and `phase_rad`.

use std::path::Path;

use super::overrides;
use super::toml_tree::{Allowed, Document, FINITE, NOT_NEGATIVE, POSITIVE, TableReader};
use crate::input_error::InputError;

/// Control period: segments start on multiples of it.
pub const CONTROL_PERIOD_S: f64 = 1e-4;

/// The experiments that come with the tool.
pub const BUILT_IN: [(&str, &str); 9] = [
    ("fig18", include_str!("../experiments/fig18.toml")),
    ("fig19", include_str!("../experiments/fig19.toml")),
    ("fig20", include_str!("../experiments/fig20.toml")),
    ("fig21", include_str!("../experiments/fig21.toml")),
    ("fig22", include_str!("../experiments/fig22.toml")),
    ("fig23", include_str!("../experiments/fig23.toml")),
    ("fig26", include_str!("../experiments/fig26.toml")),
    ("fig27", include_str!("../experiments/fig27.toml")),
    ("original", include_str!("../experiments/original.toml")),
];

/// What a segment prescribes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Quantity {
    /// Torque in newton metres.
    TorqueNm,
    /// Torque as a fraction of the motor's rated torque.
    TorqueFraction,
    /// Speed in radians per second.
    SpeedRadS,
}

/// Course of a reference, in the unit of its quantity; time counts from the segment's start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Course {
    /// The same value throughout.
    Constant {
        /// The value.
        value: f64,
    },
    /// A straight line that stays at its end value.
    Ramp {
        /// Value at the start.
        from: f64,
        /// Value at the end.
        to: f64,
        /// Time from start to end.
        ramp_s: f64,
    },
    /// offset + amplitude · sin(angular frequency · time + phase).
    Sine {
        /// Mean.
        offset: f64,
        /// Amplitude.
        amplitude: f64,
        /// Angular frequency.
        angular_frequency_rad_s: f64,
        /// Phase at the segment's start.
        phase_rad: f64,
    },
}

impl Course {
    /// Value at a time after the segment's start.
    #[must_use]
    pub fn at(&self, time_s: f64) -> f64 {
        match *self {
            Self::Constant { value } => value,
            Self::Ramp { from, to, ramp_s } => from + (to - from) * (time_s / ramp_s).clamp(0.0, 1.0),
            Self::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad } => {
                offset + amplitude * (angular_frequency_rad_s * time_s + phase_rad).sin()
            }
        }
    }
}

/// A stretch of an experiment for one motor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment {
    /// When it starts.
    pub start_s: f64,
    /// What it prescribes.
    pub quantity: Quantity,
    /// How that goes over time.
    pub course: Course,
}

/// Elements drawn across a contact patch at a prescribed slip (Fig. 26).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PatchCrossing {
    /// Sliding speed of the element's root over the road.
    pub sliding_speed_m_s: f64,
    /// Speed at which an element crosses the patch.
    pub rolling_speed_m_s: f64,
    /// Length of the patch.
    pub patch_length_m: f64,
    /// Normal force on the elements.
    pub normal_force_n: f64,
}

/// Steady friction over speed (Fig. 27).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedSweep {
    /// Lowest speed.
    pub from_m_s: f64,
    /// Highest speed.
    pub to_m_s: f64,
    /// Number of speeds, evenly spaced in their logarithm.
    pub points: usize,
    /// Normal force.
    pub normal_force_n: f64,
}

/// What is done.
#[derive(Debug, Clone, PartialEq)]
pub enum Study {
    /// Both motors in closed loop.
    ClosedLoop {
        /// Segments of M1, in order.
        m1: Vec<Segment>,
        /// Segments of M2, in order.
        m2: Vec<Segment>,
    },
    /// Torques of both motors of the original rig.
    TwoMotors {
        /// Segments of M1, in order.
        m1: Vec<Segment>,
        /// Segments of M2, in order.
        m2: Vec<Segment>,
    },
    /// Fig. 26.
    PatchCrossing(PatchCrossing),
    /// Fig. 27.
    SpeedSweep(SpeedSweep),
}

/// What the plant behind the control core does beyond the rig file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PlantOptions {
    /// Noise of the sensors. Converters and encoders quantise in any case.
    pub sensor_noise: bool,
    /// Integration steps of the plant in a control period in which load or slip change fast.
    pub substeps: u32,
}

impl Default for PlantOptions {
    fn default() -> Self {
        Self { sensor_noise: true, substeps: 16 }
    }
}

/// An experiment.
#[derive(Debug, Clone, PartialEq)]
pub struct ExperimentFile {
    /// The file as the user named it.
    pub source: String,
    /// Short name, goes into `summary.json`.
    pub name: String,
    /// What it shows, in words.
    pub title: String,
    /// Length.
    pub duration_s: f64,
    /// Seed of the sensor noise.
    pub seed: u64,
    /// Samples per second in `log.csv`; divides 10 kHz.
    pub log_rate_hz: u32,
    /// The plant behind it.
    pub plant: PlantOptions,
    /// What is done.
    pub study: Study,
}

#[derive(Clone, Copy)]
enum Kind {
    ClosedLoop,
    TwoMotors,
    PatchCrossing,
    SpeedSweep,
}

impl ExperimentFile {
    /// A built-in experiment by its name, else a file.
    pub fn named_or_read(name: &str, changes: &[(String, String)]) -> Result<Self, InputError> {
        let (source, mut document) = match BUILT_IN.iter().find(|(known, _)| *known == name) {
            Some((_, text)) => {
                (format!("experiment {name}"), Document::parse(&format!("experiment {name}"), text)?)
            }
            None if !name.contains(['.', '/', '\\']) && !Path::new(name).exists() => {
                let names: Vec<&str> = BUILT_IN.iter().map(|(name, _)| *name).collect();
                return Err(InputError::new("no such experiment and no such file")
                    .file("--experiment")
                    .value(name)
                    .allowed(format!("{} or a .toml file", names.join(", "))));
            }
            None => (name.to_string(), Document::read(Path::new(name))?),
        };
        overrides::apply(&mut document, changes)?;
        Self::from_root(&document.root(), &source)
    }

    /// Parses and checks a text.
    pub fn parse(source: &str, text: &str) -> Result<Self, InputError> {
        Self::from_root(&Document::parse(source, text)?.root(), source)
    }

    fn from_root(root: &TableReader<'_>, source: &str) -> Result<Self, InputError> {
        let text = |key| Ok::<_, InputError>(root.text(key)?.map(str::to_string));
        let name = text("name")?.ok_or_else(|| root.missing("name", "a short name in quotes"))?;
        let title = text("title")?.unwrap_or_default();
        let kinds = [
            ("closed_loop", Kind::ClosedLoop),
            ("two_motors", Kind::TwoMotors),
            ("patch_crossing", Kind::PatchCrossing),
            ("speed_sweep", Kind::SpeedSweep),
        ];
        let kind = root.choice("kind", &kinds)?.unwrap_or(Kind::ClosedLoop);
        let seed = root.integer("seed", 0, i64::MAX as u64)?.unwrap_or(1);
        let mut experiment = Self {
            source: source.into(),
            name,
            title,
            duration_s: 0.0,
            seed,
            log_rate_hz: 1000,
            plant: PlantOptions::default(),
            study: match kind {
                Kind::PatchCrossing => Study::PatchCrossing(read_patch_crossing(root)?),
                Kind::SpeedSweep => Study::SpeedSweep(read_speed_sweep(root)?),
                // Filled below, once the duration is known.
                Kind::ClosedLoop | Kind::TwoMotors => Study::ClosedLoop { m1: Vec::new(), m2: Vec::new() },
            },
        };
        if let Kind::ClosedLoop | Kind::TwoMotors = kind {
            let duration =
                Allowed { check: |x| (CONTROL_PERIOD_S..=3600.0).contains(&x), words: "0.0001 to 3600 s" };
            experiment.duration_s = root.required_number("duration_s", duration)?;
            experiment.log_rate_hz = read_log_rate(root)?;
            if let Some(table) = root.table("plant")? {
                experiment.plant = read_plant(&table)?;
            }
            let in_loop = matches!(kind, Kind::ClosedLoop);
            let m1 = read_segments(root, "m1", experiment.duration_s, false)?;
            let m2 = read_segments(root, "m2", experiment.duration_s, in_loop)?;
            experiment.study =
                if in_loop { Study::ClosedLoop { m1, m2 } } else { Study::TwoMotors { m1, m2 } };
        }
        root.finish()?;
        Ok(experiment)
    }
}

fn read_log_rate(root: &TableReader<'_>) -> Result<u32, InputError> {
    let rate_hz = root.integer("log_rate_hz", 1, 10_000)?.unwrap_or(1000);
    if 10_000 % rate_hz == 0 {
        Ok(rate_hz as u32)
    } else {
        Err(root.error("log_rate_hz", "does not divide the control rate").allowed("a divisor of 10000"))
    }
}

fn read_plant(table: &TableReader<'_>) -> Result<PlantOptions, InputError> {
    let default = PlantOptions::default();
    let options = PlantOptions {
        sensor_noise: table.boolean("sensor_noise")?.unwrap_or(default.sensor_noise),
        substeps: table.integer("substeps", 1, 10_000)?.map_or(default.substeps, |n| n as u32),
    };
    table.finish()?;
    Ok(options)
}

fn read_patch_crossing(root: &TableReader<'_>) -> Result<PatchCrossing, InputError> {
    let table = root.table("slip")?.ok_or_else(|| root.missing("slip", "a table [slip]"))?;
    let slip = PatchCrossing {
        sliding_speed_m_s: table.required_number("sliding_speed_m_s", POSITIVE)?,
        rolling_speed_m_s: table.required_number("rolling_speed_m_s", POSITIVE)?,
        patch_length_m: table.required_number("patch_length_m", POSITIVE)?,
        normal_force_n: table.required_number("normal_force_n", POSITIVE)?,
    };
    table.finish()?;
    Ok(slip)
}

fn read_speed_sweep(root: &TableReader<'_>) -> Result<SpeedSweep, InputError> {
    let table = root.table("sweep")?.ok_or_else(|| root.missing("sweep", "a table [sweep]"))?;
    let sweep = SpeedSweep {
        from_m_s: table.required_number("from_m_s", POSITIVE)?,
        to_m_s: table.required_number("to_m_s", POSITIVE)?,
        points: table.integer("points", 2, 100_000)?.unwrap_or(60) as usize,
        normal_force_n: table.required_number("normal_force_n", POSITIVE)?,
    };
    if sweep.to_m_s <= sweep.from_m_s {
        return Err(table.error("to_m_s", "not above from_m_s").allowed(format!("> {}", sweep.from_m_s)));
    }
    table.finish()?;
    Ok(sweep)
}

/// A key with its unit, what it prescribes, and its factor to the quantity's unit.
type Unit = (&'static str, Quantity, f64);

const TORQUES: [Unit; 2] =
    [("torque_nm", Quantity::TorqueNm, 1.0), ("torque_fraction", Quantity::TorqueFraction, 1.0)];
const SPEEDS: [Unit; 2] = [
    ("speed_rad_s", Quantity::SpeedRadS, 1.0),
    ("speed_rpm", Quantity::SpeedRadS, std::f64::consts::TAU / 60.0),
];

fn read_segments(
    root: &TableReader<'_>,
    motor: &'static str,
    end_s: f64,
    may_be_speed: bool,
) -> Result<Vec<Segment>, InputError> {
    let tables = root.tables(motor)?;
    if tables.is_empty() {
        return Err(root.missing(motor, &format!("one or more segments, each headed [[{motor}]]")));
    }
    let mut segments: Vec<Segment> = Vec::new();
    for table in &tables {
        let segment = read_segment(table, may_be_speed)?;
        let refuse = |problem: String, allowed: String| Err(table.error("start_s", problem).allowed(allowed));
        match segments.last() {
            None if segment.start_s != 0.0 => {
                return refuse("the first segment does not start at 0".into(), "0".into());
            }
            Some(last) if segment.start_s < last.start_s + 0.5 * CONTROL_PERIOD_S => {
                let problem = format!("not after the segment before it, at {} s", last.start_s);
                return refuse(problem, "starts that rise by 0.0001 s or more".into());
            }
            _ if segment.start_s >= end_s => {
                return refuse("not before the end".into(), format!("< {end_s} s"));
            }
            _ => segments.push(segment),
        }
    }
    Ok(segments)
}

#[derive(Clone, Copy)]
enum Shape {
    Constant,
    Ramp,
    Sine,
}

fn read_segment(table: &TableReader<'_>, may_be_speed: bool) -> Result<Segment, InputError> {
    let start_s = table.required_number("start_s", NOT_NEGATIVE)?;
    let modes = [("torque", false), ("speed", true)];
    let modes = if may_be_speed { &modes[..] } else { &modes[..1] };
    let mode = table.choice("mode", modes)?;
    let shapes = [("constant", Shape::Constant), ("ramp", Shape::Ramp), ("sine", Shape::Sine)];
    let shape = table.choice("shape", &shapes)?.unwrap_or(Shape::Constant);
    let units =
        || TORQUES.iter().filter(|_| mode != Some(true)).chain(SPEEDS.iter().filter(|_| mode != Some(false)));
    let units: Vec<Unit> =
        units().filter(|unit| may_be_speed || unit.1 != Quantity::SpeedRadS).copied().collect();

    let prefix = if let Shape::Sine = shape { "amplitude_" } else { "" };
    let named = |unit: &Unit| format!("{prefix}{}", unit.0);
    let names: Vec<String> = units.iter().map(named).collect();
    let given: Vec<&Unit> = units.iter().filter(|unit| table.has(&named(unit))).collect();
    let unit = match given.as_slice() {
        [unit] => **unit,
        [] => return Err(table.missing(&names[0], &format!("one of {}", names.join(", ")))),
        [_, second, ..] => {
            return Err(table
                .error(&named(second), "a second reference")
                .allowed(format!("one of {}", names.join(", "))));
        }
    };
    let (key, quantity, factor) = unit;
    let scaled = |key: &str| Ok::<_, InputError>(table.number(key, FINITE)?.map(|value| value * factor));
    let needed = |key: &str| scaled(key)?.ok_or_else(|| table.missing(key, "a finite number"));
    let course = match shape {
        Shape::Constant => Course::Constant { value: needed(key)? },
        Shape::Ramp => Course::Ramp {
            from: needed(key)?,
            to: needed(&format!("end_{key}"))?,
            ramp_s: table.required_number("ramp_s", POSITIVE)?,
        },
        Shape::Sine => Course::Sine {
            offset: scaled(key)?.unwrap_or(0.0),
            amplitude: needed(&format!("amplitude_{key}"))?,
            angular_frequency_rad_s: table.required_number("angular_frequency_rad_s", POSITIVE)?,
            phase_rad: table.number("phase_rad", FINITE)?.unwrap_or(0.0),
        },
    };
    table.finish()?;
    Ok(Segment { start_s, quantity, course })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_experiment_reads_and_bears_its_name() {
        for (name, _) in BUILT_IN {
            let experiment = ExperimentFile::named_or_read(name, &[]).unwrap();
            assert_eq!(experiment.name, name);
            assert!(!experiment.title.is_empty());
        }
    }

    #[test]
    fn units_are_converted_and_fractions_kept() {
        let experiment = ExperimentFile::named_or_read("fig19", &[]).unwrap();
        let Study::ClosedLoop { m1, m2 } = experiment.study else { panic!("fig19 runs in closed loop") };
        assert_eq!(m1[1].start_s, 4.0);
        assert_eq!(
            (m1[1].quantity, m1[1].course),
            (Quantity::TorqueFraction, Course::Constant { value: 0.4 })
        );
        let Course::Constant { value } = m2[1].course else { panic!("a step") };
        // 20 rpm; one rounding of the factor.
        assert!((value - 2.094_395_102_393_195).abs() < 1e-15);
    }

    const HEAD: &str = "name = \"x\"\nduration_s = 2\n[[m1]]\nstart_s = 0\ntorque_nm = 1\n";

    #[test]
    fn bad_segments_are_named() {
        let refused =
            |text: &str| ExperimentFile::parse("e.toml", &format!("{HEAD}{text}")).unwrap_err().to_string();
        assert_eq!(
            refused("[[m2]]\nstart_s = 0\nmode = \"speed\"\ntorque_nm = 1\n"),
            "e.toml:6: m2.0.speed_rad_s: is missing; allowed: one of speed_rad_s, speed_rpm"
        );
        assert_eq!(
            refused("[[m2]]\nstart_s = 0\nspeed_rpm = 1\ntorque_nm = 1\n"),
            "e.toml:8: m2.0.speed_rpm = 1: a second reference; allowed: one of torque_nm, torque_fraction, speed_rad_s, speed_rpm"
        );
        assert!(
            refused("[[m2]]\nstart_s = 1\nspeed_rpm = 1\n").contains("the first segment does not start at 0")
        );
        assert!(
            refused("[[m2]]\nstart_s = 0\nspeed_rpm = 1\n[[m2]]\nstart_s = 0\nspeed_rpm = 1\n")
                .contains("m2.1.start_s = 0: not after")
        );
        assert!(
            refused("[[m2]]\nstart_s = 0\nspeed_rpm = 1\n[[m2]]\nstart_s = 2\nspeed_rpm = 1\n")
                .contains("not before the end; allowed: < 2 s")
        );
        assert!(refused("").contains("m2: is missing"));
        assert!(
            refused("[[m2]]\nstart_s = 0\nshape = \"ramp\"\nspeed_rpm = 1\nramp_s = 1\n")
                .contains("m2.0.end_speed_rpm: is missing")
        );
        assert!(
            refused("[[m2]]\nstart_s = 0\nspeed_rpm = 1\nramp_s = 1\n")
                .contains("ramp_s = 1: unknown key; allowed: start_s, mode, shape, speed_rpm")
        );
    }

    #[test]
    fn an_unknown_name_lists_the_built_in_experiments() {
        let error = ExperimentFile::named_or_read("fig99", &[]).unwrap_err().to_string();
        assert!(
            error.starts_with("--experiment: fig99: no such experiment and no such file; allowed: fig18, ")
        );
    }
}
