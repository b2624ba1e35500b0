//! Units of other tools, and what one of them is in the unit of a signal.
//!
//! A unit may carry a factor and a sign: `-2.5*kN` is a column that reads 1 where −2500 N press.

use std::f64::consts::{PI, TAU};

use crate::files::signal::Signal;

/// value in the signal's unit = factor · cell + offset.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Conversion {
    /// Factor.
    pub factor: f64,
    /// Offset.
    pub offset: f64,
}

impl Conversion {
    /// The cell is in the signal's unit.
    pub const NONE: Self = Self { factor: 1.0, offset: 0.0 };

    /// Converts one value.
    #[must_use]
    pub fn apply(self, cell: f64) -> f64 {
        // Multiplying by 0.001 is not dividing by 1000: decimals stay what they were.
        let inverse = (1.0 / self.factor).round();
        let scaled =
            if self.factor != 0.0 && inverse.abs() > 1.0 && (inverse * self.factor - 1.0).abs() < 1e-14 {
                cell / inverse
            } else {
                cell * self.factor
            };
        scaled + self.offset
    }
}

const TIME: &[(&str, f64)] =
    &[("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0), ("h", 3600.0)];
const ANGLE: &[(&str, f64)] =
    &[("rad", 1.0), ("mrad", 1e-3), ("deg", PI / 180.0), ("rev", TAU), ("turns", TAU), ("grad", PI / 200.0)];
const SPEED: &[(&str, f64)] =
    &[("rad/s", 1.0), ("deg/s", PI / 180.0), ("rpm", TAU / 60.0), ("rev/s", TAU), ("rps", TAU), ("hz", TAU)];
const TORQUE: &[(&str, f64)] = &[
    ("nm", 1.0),
    ("mnm", 1e-3),
    ("knm", 1e3),
    ("ncm", 1e-2),
    ("nmm", 1e-3),
    ("lbfft", 1.355_817_948_331_4),
    ("lbfin", 0.112_984_829_027_617),
    ("ozin", 0.007_061_551_814_226),
];
const FORCE: &[(&str, f64)] = &[
    ("n", 1.0),
    ("kn", 1e3),
    ("mn", 1e-3),
    ("dan", 10.0),
    ("lbf", 4.448_221_615_260_5),
    ("kgf", 9.806_65),
    ("kp", 9.806_65),
    ("gf", 9.806_65e-3),
];
const LENGTH: &[(&str, f64)] =
    &[("m", 1.0), ("mm", 1e-3), ("um", 1e-6), ("nm", 1e-9), ("cm", 1e-2), ("in", 0.0254), ("inch", 0.0254)];
const TEMPERATURE: &[(&str, f64)] =
    &[("c", 1.0), ("degc", 1.0), ("k", 1.0), ("f", 5.0 / 9.0), ("degf", 5.0 / 9.0)];

/// Known units of a signal.
fn known(signal: Signal) -> &'static [(&'static str, f64)] {
    match signal {
        Signal::Time => TIME,
        Signal::M1Angle | Signal::M2Angle => ANGLE,
        Signal::M2Speed => SPEED,
        Signal::M1TorqueRef
        | Signal::M1Torque
        | Signal::M2TorqueRef
        | Signal::M2Torque
        | Signal::FrictionTorque => TORQUE,
        Signal::NormalForce | Signal::Force => FORCE,
        Signal::Position => LENGTH,
        Signal::SurfaceTemperature => TEMPERATURE,
    }
}

/// Units of a signal, for an error.
#[must_use]
pub fn allowed(signal: Signal) -> String {
    let names: Vec<&str> = known(signal).iter().map(|(name, _)| *name).collect();
    let more = match signal {
        Signal::M1Angle | Signal::M2Angle => ", counts/N (N a revolution)",
        _ => "",
    };
    format!("{}{more}, each with a factor where needed: -2.5*{}", names.join(", "), names[0])
}

/// Lower case, one spelling for each sign: `N·m`, `N m` and `Nm` are `nm`; `1/min`, `U/min` and `min-1` are `rpm`.
fn plain(unit: &str) -> String {
    let mut plain: String = unit
        .trim()
        .trim_matches(['[', ']', '(', ')'])
        .replace(['µ', 'μ'], "u")
        .replace('°', "deg")
        .to_lowercase()
        .chars()
        .filter(|c| !matches!(c, ' ' | '·' | '.' | '*' | '_' | '-' | '⋅'))
        .collect();
    for (from, to) in
        [("degrees", "deg"), ("seconds", "s"), ("sec", "s"), ("newton", "n"), ("radians", "rad")]
    {
        plain = plain.replace(from, to);
    }
    match plain.as_str() {
        "1/min" | "u/min" | "min1" | "min^1" | "rev/min" | "r/min" => "rpm".into(),
        "rads" | "rads1" | "rad/s1" => "rad/s".into(),
        "degs" => "deg/s".into(),
        _ => plain,
    }
}

/// What a unit of a signal means; `None` where it is none.
#[must_use]
pub fn conversion(signal: Signal, unit: &str) -> Option<Conversion> {
    let unit = unit.trim();
    let (sign, unit) = unit.strip_prefix(['-', '−']).map_or((1.0, unit), |rest| (-1.0, rest));
    let (factor, name) = match unit.split_once('*') {
        Some((factor, name)) if factor.trim().parse::<f64>().is_ok() => (factor.trim().parse().ok()?, name),
        _ => (1.0, unit),
    };
    let factor: f64 = sign * factor;
    if factor == 0.0 || !factor.is_finite() {
        return None;
    }
    let name = plain(name);
    if matches!(signal, Signal::M1Angle | Signal::M2Angle)
        && let Some(counts) = name.strip_prefix("counts/")
    {
        let counts: f64 = counts.parse().ok().filter(|counts| *counts > 0.0)?;
        return Some(Conversion { factor: factor * TAU / counts, offset: 0.0 });
    }
    let (_, scale) = known(signal).iter().find(|(known, _)| *known == name)?;
    let offset = match (signal, name.as_str()) {
        (Signal::SurfaceTemperature, "k") => -273.15,
        (Signal::SurfaceTemperature, "f" | "degf") => -32.0 * 5.0 / 9.0,
        _ => 0.0,
    };
    Some(Conversion { factor: factor * scale, offset })
}

/// Whether a text could be the unit of anything: what a row of units is made of.
#[must_use]
pub fn is_unit(text: &str) -> bool {
    let trimmed = text.trim();
    let bracketed = trimmed.starts_with('[') && trimmed.ends_with(']')
        || trimmed.starts_with('(') && trimmed.ends_with(')');
    let name = plain(trimmed);
    bracketed
        || matches!(
            name.as_str(),
            "-" | "" | "v" | "mv" | "a" | "w" | "%" | "bar" | "pa" | "m/s" | "m/s2" | "1" | "counts"
        )
        || [TIME, ANGLE, SPEED, TORQUE, FORCE, LENGTH, TEMPERATURE]
            .iter()
            .any(|units| units.iter().any(|(known, _)| *known == name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_usual_spellings_of_a_unit_are_one_unit() {
        let factor = |signal, unit| conversion(signal, unit).map(|conversion| conversion.factor);
        for unit in ["rpm", "1/min", "U/min", "min-1", "[rev/min]"] {
            assert_eq!(factor(Signal::M2Speed, unit), Some(TAU / 60.0), "{unit}");
        }
        for unit in ["N·m", "N m", "Nm", "(N*m)", "N.m"] {
            assert_eq!(factor(Signal::M2Torque, unit), Some(1.0), "{unit}");
        }
        for unit in ["°", "deg", "Degrees", "[°]"] {
            assert_eq!(factor(Signal::M2Angle, unit), Some(PI / 180.0), "{unit}");
        }
        assert_eq!(factor(Signal::Time, "µs"), Some(1e-6));
        assert_eq!(factor(Signal::NormalForce, "-kN"), Some(-1e3));
        assert_eq!(factor(Signal::NormalForce, "25.5*N"), Some(25.5));
        assert_eq!(factor(Signal::M2Angle, "counts/4096"), Some(TAU / 4096.0));
        for (signal, unit) in
            [(Signal::Time, "N"), (Signal::NormalForce, "0*N"), (Signal::M2Angle, "counts/0")]
        {
            assert_eq!(factor(signal, unit), None, "{unit}");
        }
    }

    #[test]
    fn temperatures_have_offsets_and_decimals_stay_decimals() {
        let celsius = |unit, value| conversion(Signal::SurfaceTemperature, unit).unwrap().apply(value);
        assert!((celsius("K", 300.0) - 26.85).abs() < 1e-9);
        assert!((celsius("°F", 212.0) - 100.0).abs() < 1e-9);
        assert_eq!(conversion(Signal::Time, "ms").unwrap().apply(3.0), 0.003);
    }
}
