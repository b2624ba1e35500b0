//! The rig file: geometry, motors, bearing, pressure and sensors of a rig, in SI units.
//!
//! A table or key left out takes the value of the assumed rig (`rigs/assumed.toml`) and is listed in
//! [`RigFile::assumed`]; only the friction radius must be there, as every friction force hangs on it.
//! A bridge table left out is an ideal sensor; so is one half of it (`mode_hz` with `damping_ratio`, or
//! `lowpass_hz`) where it is left out.
//!
//! Some entries can be given by their parts. The lever's gain by its arms, F_N = (τ/l1)(l2/l3): M1's torque τ on the arm
//! `lever_l1_m` gives a force, which the lever `lever_l2_m` : `lever_l3_m` brings to the elements. The inertia that M2 turns by
//! `inertia_discs` further discs of `inertia_disc_kg_m2` each, as the original rig has them. What a bridge gives at the
//! converter's pin by `sensitivity_v_per_nm` (friction) and `sensitivity_v_per_n` (normal force), or by the beams, gauges and
//! amplifier of a table `[friction_bridge.gauges]`, `[normal_bridge.gauges]`: see [`super::strain_gauges`].

use std::path::Path;

use super::overrides;
use super::strain_gauges::{self, Sensitivity};
use super::toml_tree::{Allowed, Document, FINITE, NOT_NEGATIVE, POSITIVE, TableReader};
use crate::input_error::InputError;

const ASSUMED: &str = include_str!("../../rigs/assumed.toml");
const ASSUMED_NAME: &str = "assumed rig";

/// A second-order mode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mode {
    /// Undamped natural frequency.
    pub mode_hz: f64,
    /// Damping ratio, 1 is critical.
    pub damping_ratio: f64,
}

/// A strain-gauge bridge: a mechanical mode in front, an amplifier low-pass behind.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Bridge {
    /// Mode of the ring or frame; `None` is rigid.
    pub mode: Option<Mode>,
    /// Corner of the amplifier's second-order Butterworth low-pass; `None` is none.
    pub lowpass_hz: Option<f64>,
    /// What the amplifier gives at the converter's pin; `None` is the assumed one.
    pub sensitivity: Option<Sensitivity>,
}

impl Bridge {
    /// Neither mode nor low-pass.
    pub fn is_ideal(&self) -> bool {
        self.mode.is_none() && self.lowpass_hz.is_none()
    }
}

/// A motor with its torque loop.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motor {
    /// Rated torque.
    pub rated_torque_nm: f64,
    /// First-order lag of the torque loop.
    pub torque_lag_s: f64,
}

/// A torsional spring between M2 and the disc, with an optional dead zone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shaft {
    /// Torsional stiffness.
    pub stiffness_nm_per_rad: f64,
    /// Torsional damping.
    pub damping_nm_s_per_rad: f64,
    /// Full width of the dead zone.
    pub backlash_rad: f64,
    /// Inertia on the motor's side; the rest of `m2.inertia_kg_m2` is the disc's.
    pub motor_inertia_kg_m2: f64,
}

/// Edges of both channels of an encoder in a pulse.
const COUNTS_PER_PULSE: u32 = 4;

/// A rig in SI units.
#[derive(Debug, Clone, PartialEq)]
pub struct RigFile {
    /// The file as the user named it.
    pub source: String,
    /// Keys that the file left out and the assumed rig filled in.
    pub assumed: Vec<String>,
    /// Radius at which the elements touch the disc.
    pub friction_radius_m: f64,
    /// Normal force of all elements per torque of M1.
    pub lever_gain_n_per_nm: f64,
    /// The pressing motor.
    pub m1: Motor,
    /// Normal force per angle of M1.
    pub m1_stiffness_n_per_rad: f64,
    /// The motor that turns the disc.
    pub m2: Motor,
    /// Inertia of M2 with its disc and all further inertia discs.
    pub m2_inertia_kg_m2: f64,
    /// Coulomb friction of the disc's bearing.
    pub bearing_coulomb_nm: f64,
    /// Viscous friction of the disc's bearing.
    pub bearing_viscous_nm_s_per_rad: f64,
    /// Pulses per revolution of each encoder, four counts a pulse.
    pub pulses_per_rev: u32,
    /// Force of the foil springs that M1 must overcome.
    pub preload_n: f64,
    /// Mode of the pressure mechanism.
    pub pressure: Mode,
    /// Torque ring and amplifier.
    pub friction_bridge: Bridge,
    /// Frame and amplifier.
    pub normal_bridge: Bridge,
    /// Coupling between M2 and disc; `None` is rigid.
    pub shaft: Option<Shaft>,
}

impl RigFile {
    /// Counts per revolution of each encoder.
    pub fn counts_per_rev(&self) -> u32 {
        self.pulses_per_rev.saturating_mul(COUNTS_PER_PULSE)
    }

    /// The assumed rig, with changes.
    pub fn assumed_rig(changes: &[(String, String)]) -> Result<Self, InputError> {
        let mut document = Document::parse(ASSUMED_NAME, ASSUMED)?;
        overrides::apply(&mut document, changes)?;
        Reading { given: &document.root(), assumed: None, filled: Vec::new() }.rig(ASSUMED_NAME)
    }

    /// Reads and checks a file, with changes.
    pub fn read(path: &Path, changes: &[(String, String)]) -> Result<Self, InputError> {
        Self::from_document(Document::read(path)?, &path.display().to_string(), changes)
    }

    /// Reads a file, or takes the assumed rig where none is given.
    pub fn read_or_assumed(path: Option<&Path>, changes: &[(String, String)]) -> Result<Self, InputError> {
        let Some(path) = path else {
            crate::provenance::note("rig", "assumed: no file was given");
            return Self::assumed_rig(changes);
        };
        Self::read(path, changes)
    }

    /// Parses and checks a text.
    pub fn parse(source: &str, text: &str) -> Result<Self, InputError> {
        Self::from_document(Document::parse(source, text)?, source, &[])
    }

    fn from_document(
        mut given: Document,
        source: &str,
        changes: &[(String, String)],
    ) -> Result<Self, InputError> {
        overrides::apply(&mut given, changes)?;
        let assumed = Document::parse(ASSUMED_NAME, ASSUMED)?;
        Reading { given: &given.root(), assumed: Some(&assumed.root()), filled: Vec::new() }.rig(source)
    }
}

/// A file being read, with the assumed rig behind it.
struct Reading<'a> {
    given: &'a TableReader<'a>,
    assumed: Option<&'a TableReader<'a>>,
    filled: Vec<String>,
}

/// A table of the file and the same of the assumed rig.
struct Pair<'a> {
    name: &'static str,
    given: Option<TableReader<'a>>,
    assumed: Option<TableReader<'a>>,
}

impl<'a> Reading<'a> {
    fn pair(&self, name: &'static str) -> Result<Pair<'a>, InputError> {
        let assumed = self.assumed.map(|root| root.table(name)).transpose()?.flatten();
        Ok(Pair { name, given: self.given.table(name)?, assumed })
    }

    /// A number of the file, else of the assumed rig.
    fn number(&mut self, pair: &Pair<'a>, key: &'static str, allowed: Allowed) -> Result<f64, InputError> {
        if let Some(value) =
            pair.given.as_ref().map(|table| table.number(key, allowed)).transpose()?.flatten()
        {
            return Ok(value);
        }
        if let Some(value) =
            pair.assumed.as_ref().map(|table| table.number(key, allowed)).transpose()?.flatten()
        {
            self.filled.push(format!("{}.{key}", pair.name));
            return Ok(value);
        }
        Err(self.missing(pair, key, allowed))
    }

    fn missing(&self, pair: &Pair<'a>, key: &str, allowed: Allowed) -> InputError {
        let wanted = format!("a number, {}", allowed.words);
        match &pair.given {
            Some(table) => table.missing(key, &wanted),
            None => self.given.missing(&format!("{}.{key}", pair.name), &wanted),
        }
    }

    fn motor(&mut self, pair: &Pair<'a>) -> Result<Motor, InputError> {
        Ok(Motor {
            rated_torque_nm: self.number(pair, "rated_torque_nm", POSITIVE)?,
            torque_lag_s: self.number(pair, "torque_lag_s", NOT_NEGATIVE)?,
        })
    }

    fn rig(mut self, source: &str) -> Result<RigFile, InputError> {
        let geometry = self.pair("geometry")?;
        let radius = geometry.given.as_ref().map(|table| table.number("friction_radius_m", POSITIVE));
        let friction_radius_m = radius
            .transpose()?
            .flatten()
            .ok_or_else(|| self.missing(&geometry, "friction_radius_m", POSITIVE))?;
        let by_arms = geometry.given.as_ref().map(lever_gain).transpose()?.flatten();
        let lever_gain_n_per_nm = match by_arms {
            Some(gain) => gain,
            None => self.number(&geometry, "lever_gain_n_per_nm", POSITIVE)?,
        };

        let (m1, m2) = (self.pair("m1")?, self.pair("m2")?);
        let (bearing, encoder, pressure) =
            (self.pair("bearing")?, self.pair("encoder")?, self.pair("pressure")?);
        let pulses = Allowed {
            check: |x| x.fract() == 0.0 && (1.0..=1e8).contains(&x),
            words: "a whole number from 1 to 1e8",
        };
        let friction_bridge = self.given.table("friction_bridge")?;
        let normal_bridge = self.given.table("normal_bridge")?;
        let shaft = self.given.table("shaft")?;
        let own_inertia_kg_m2 = self.number(&m2, "inertia_kg_m2", POSITIVE)?;
        let discs_kg_m2 = m2.given.as_ref().map(inertia_discs).transpose()?.unwrap_or(0.0);
        let m2_inertia_kg_m2 = own_inertia_kg_m2 + discs_kg_m2;
        let rig = RigFile {
            source: source.into(),
            friction_radius_m,
            lever_gain_n_per_nm,
            m1: self.motor(&m1)?,
            m1_stiffness_n_per_rad: self.number(&m1, "stiffness_n_per_rad", POSITIVE)?,
            m2: self.motor(&m2)?,
            m2_inertia_kg_m2,
            bearing_coulomb_nm: self.number(&bearing, "coulomb_nm", NOT_NEGATIVE)?,
            bearing_viscous_nm_s_per_rad: self.number(&bearing, "viscous_nm_s_per_rad", NOT_NEGATIVE)?,
            pulses_per_rev: self.number(&encoder, "pulses_per_rev", pulses)? as u32,
            preload_n: self.number(&pressure, "preload_n", FINITE)?,
            pressure: Mode {
                mode_hz: self.number(&pressure, "mode_hz", POSITIVE)?,
                damping_ratio: self.number(&pressure, "damping_ratio", NOT_NEGATIVE)?,
            },
            friction_bridge: bridge(friction_bridge.as_ref(), "sensitivity_v_per_nm", true)?,
            normal_bridge: bridge(normal_bridge.as_ref(), "sensitivity_v_per_n", false)?,
            shaft: shaft.as_ref().map(|table| read_shaft(table, m2_inertia_kg_m2)).transpose()?,
            assumed: self.filled,
        };
        let pairs = [geometry, m1, m2, bearing, encoder, pressure];
        let tables = pairs.iter().filter_map(|pair| pair.given.as_ref());
        for table in tables.chain(&friction_bridge).chain(&normal_bridge).chain(&shaft) {
            table.finish()?;
        }
        self.given.finish()?;
        Ok(rig)
    }
}

/// F_N/τ by the lever's arms, where the file gives them.
fn lever_gain(table: &TableReader<'_>) -> Result<Option<f64>, InputError> {
    let twice = table.number("lever_gain_n_per_nm", POSITIVE)?.is_some();
    let arms = ["lever_l1_m", "lever_l2_m", "lever_l3_m"];
    let [l1, l2, l3] = arms.map(|key| table.number(key, POSITIVE));
    match (l1?, l2?, l3?) {
        (None, None, None) => Ok(None),
        (Some(l1), Some(l2), Some(l3)) if !twice => Ok(Some(l2 / l3 / l1)),
        (Some(_), Some(_), Some(_)) => Err(table
            .error("lever_gain_n_per_nm", "is given twice")
            .allowed("the gain, or the arms lever_l1_m, lever_l2_m, lever_l3_m")),
        _ => {
            let gap = arms.into_iter().find(|key| !table.has(key)).unwrap_or(arms[0]);
            Err(table.missing(gap, "all three arms, or none"))
        }
    }
}

/// Inertia of the discs that are put on besides.
pub(crate) fn inertia_discs(table: &TableReader<'_>) -> Result<f64, InputError> {
    let count = table.integer("inertia_discs", 0, 100)?.unwrap_or(0);
    let each = table.number("inertia_disc_kg_m2", POSITIVE)?;
    match (count, each) {
        (0, _) => Ok(0.0),
        (_, Some(each)) => Ok(count as f64 * each),
        _ => Err(table.missing("inertia_disc_kg_m2", "the inertia of one disc, a number, > 0")),
    }
}

fn bridge(table: Option<&TableReader<'_>>, sensitivity: &str, of_torque: bool) -> Result<Bridge, InputError> {
    let Some(table) = table else { return Ok(Bridge::default()) };
    let mode_hz = table.number("mode_hz", POSITIVE)?;
    let damping_ratio = table.number("damping_ratio", NOT_NEGATIVE)?;
    let lowpass_hz = table.number("lowpass_hz", POSITIVE)?;
    let mode = match (mode_hz, damping_ratio) {
        (Some(mode_hz), Some(damping_ratio)) => Some(Mode { mode_hz, damping_ratio }),
        (None, None) => None,
        (Some(_), None) => {
            return Err(table.missing("damping_ratio", "both mode_hz and damping_ratio, or neither"));
        }
        (None, Some(_)) => return Err(table.missing("mode_hz", "both mode_hz and damping_ratio, or neither")),
    };
    Ok(Bridge { mode, lowpass_hz, sensitivity: strain_gauges::read(table, sensitivity, of_torque)? })
}

fn read_shaft(table: &TableReader<'_>, inertia_kg_m2: f64) -> Result<Shaft, InputError> {
    let shaft = Shaft {
        stiffness_nm_per_rad: table.required_number("stiffness_nm_per_rad", POSITIVE)?,
        damping_nm_s_per_rad: table.number("damping_nm_s_per_rad", NOT_NEGATIVE)?.unwrap_or(0.0),
        backlash_rad: table.number("backlash_rad", NOT_NEGATIVE)?.unwrap_or(0.0),
        motor_inertia_kg_m2: table.required_number("motor_inertia_kg_m2", POSITIVE)?,
    };
    if shaft.motor_inertia_kg_m2 >= inertia_kg_m2 {
        return Err(table
            .error("motor_inertia_kg_m2", "leaves nothing for the disc")
            .allowed(format!("less than m2.inertia_kg_m2 = {inertia_kg_m2}")));
    }
    Ok(shaft)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_assumed_rig_reads_and_assumes_nothing_beyond_itself() {
        let rig = RigFile::assumed_rig(&[]).unwrap();
        assert!(rig.assumed.is_empty());
        assert_eq!((rig.friction_radius_m, rig.pulses_per_rev, rig.preload_n), (0.06, 120_000, 8.0));
        assert_eq!(rig.friction_bridge.mode, Some(Mode { mode_hz: 600.0, damping_ratio: 0.02 }));
        assert_eq!(rig.friction_bridge.lowpass_hz, Some(1000.0));
    }

    #[test]
    fn what_a_file_leaves_out_is_assumed_and_listed_but_bridges_are_ideal() {
        let rig =
            RigFile::parse("r.toml", "[geometry]\nfriction_radius_m = 0.05\n[m2]\ninertia_kg_m2 = 0.03\n");
        let rig = rig.unwrap();
        assert_eq!(
            (rig.friction_radius_m, rig.m2_inertia_kg_m2, rig.lever_gain_n_per_nm),
            (0.05, 0.03, 30.0)
        );
        assert!(rig.assumed.contains(&"m2.rated_torque_nm".to_string()));
        assert!(!rig.assumed.contains(&"m2.inertia_kg_m2".to_string()));
        assert!(rig.friction_bridge.is_ideal() && rig.normal_bridge.is_ideal());
    }

    #[test]
    fn bad_entries_are_named_with_file_line_and_what_is_allowed() {
        let refused = |text: &str| RigFile::parse("r.toml", text).unwrap_err().to_string();
        let geometry = "[geometry]\nfriction_radius_m = 0.05\n";
        assert_eq!(refused(""), "r.toml:1: geometry.friction_radius_m: is missing; allowed: a number, > 0");
        assert_eq!(
            refused(&format!("{geometry}lever_gain = 30\n")),
            "r.toml:3: geometry.lever_gain = 30: unknown key; allowed: friction_radius_m, lever_gain_n_per_nm, \
             lever_l1_m, lever_l2_m, lever_l3_m"
        );
        assert_eq!(
            refused(&format!("{geometry}lever_l1_m = 0.05\nlever_l3_m = 0.1\n")),
            "r.toml:1: geometry.lever_l2_m: is missing; allowed: all three arms, or none"
        );
        assert!(
            refused(&format!(
                "{geometry}lever_l1_m = 0.05\nlever_l2_m = 0.1\nlever_l3_m = 0.1\nlever_gain_n_per_nm = 30\n"
            ))
            .contains("lever_gain_n_per_nm = 30: is given twice")
        );
        assert!(
            refused(&format!("{geometry}[m2]\ninertia_discs = 2\n"))
                .contains("m2.inertia_disc_kg_m2: is missing")
        );
        assert_eq!(
            refused(&format!("{geometry}[pressure]\nmode_hz = -120\n")),
            "r.toml:4: pressure.mode_hz = -120: out of range; allowed: > 0"
        );
        assert!(
            refused(&format!("{geometry}[friction_bridge]\nmode_hz = 600\n"))
                .starts_with("r.toml:3: friction_bridge.damping_ratio: is missing")
        );
        assert!(
            refused(&format!("{geometry}[brake]\n"))
                .starts_with("r.toml:3: brake: unknown key; allowed: geometry, m1")
        );
    }

    #[test]
    fn lever_and_inertia_can_be_given_by_their_parts() {
        let text = "[geometry]\nfriction_radius_m = 0.05\nlever_l1_m = 0.05\nlever_l2_m = 0.15\nlever_l3_m = 0.1\n\
                    [m2]\ninertia_kg_m2 = 0.02\ninertia_discs = 3\ninertia_disc_kg_m2 = 0.01\n";
        let rig = RigFile::parse("r.toml", text).unwrap();
        assert!((rig.lever_gain_n_per_nm - 30.0).abs() < 1e-12, "{}", rig.lever_gain_n_per_nm);
        assert!((rig.m2_inertia_kg_m2 - 0.05).abs() < 1e-15, "{}", rig.m2_inertia_kg_m2);
        assert!(!rig.assumed.contains(&"geometry.lever_gain_n_per_nm".to_string()));
    }

    #[test]
    fn the_command_line_changes_an_entry() {
        let changes = [("pressure.mode_hz".to_string(), "90".to_string())];
        assert_eq!(RigFile::assumed_rig(&changes).unwrap().pressure.mode_hz, 90.0);
    }
}
