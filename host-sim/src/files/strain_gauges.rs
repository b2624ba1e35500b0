//! A strain-gauge bridge from its parts: beams in bending with four gauges each way of a full Wheatstone bridge, then
//! an amplifier.
//!
//! | | |
//! |---|---|
//! | force on one of n beams | F = F_N/n on the frame; F = T/(n r) on the ring, whose beams stand at the radius r |
//! | strain of its surface | ε = M/(E W) = 6 F x/(E b h²), x from the gauges' middle to where the bending moment is zero |
//! | resistance of a gauge | R (1 ± k ε), two stretched and two compressed |
//! | bridge | V/V_s = R1/(R1 + R2) − R4/(R3 + R4) = k ε, linear without approximation |
//! | at the converter's pin | gain · V_s · k ε |
//!
//! Sources: any text on strength of materials (Euler–Bernoulli beam); K. Hoffmann, "An Introduction to Stress Analysis and
//! Transducer Design using Strain Gauges", HBM, for the bridge. The paper says that ring and frame carry four gauges in a
//! full bridge, and no dimension of either: what stands in a file is the owner's.
//!
//! Left out: the strain's change over the length of a gauge, wires' resistance, temperature, which a full bridge cancels, and
//! the beams' shear. A calibration with weights (`rig commission`) measures all of it.

use super::toml_tree::{POSITIVE, TableReader};
use crate::input_error::InputError;

/// What bridge and amplifier make of a unit of load.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sensitivity {
    /// At the converter's pin, V per N or per N m.
    pub volts_per_unit: f64,
    /// Strain of the gauges per N or per N m, where the file gives the beams.
    pub strain_per_unit: Option<f64>,
}

/// Range of the converter, V.
const CONVERTER_V: f64 = 3.3;
/// Codes of that range.
const CODES: f64 = 65536.0;
/// Where in the range nothing is measured: friction acts both ways, normal force presses. Assumed, as in the core's settings
/// (±12 N m; −20 to 220 N).
pub const FRICTION_ZERO: f64 = 0.5;
/// The same of the normal force.
pub const NORMAL_ZERO: f64 = 20.0 / 240.0;

impl Sensitivity {
    /// Load at the lower and at the upper end of the converter's range, with its zero at `zero_share` of it.
    #[must_use]
    pub fn range(&self, zero_share: f64) -> (f64, f64) {
        let width = CONVERTER_V / self.volts_per_unit;
        (-zero_share * width, (1.0 - zero_share) * width)
    }

    /// In words: sensitivity, range, strain at its end, and the setting that a board needs.
    #[must_use]
    pub fn words(&self, unit: &str, zero_share: f64) -> String {
        let (low, high) = self.range(zero_share);
        let strain = self.strain_per_unit.map_or(String::new(), |strain| {
            format!(" by its gauges, which stretch by {:.0} um/m at {high:.4} {unit}", 1e6 * strain * high)
        });
        let per = if unit.contains(' ') { format!("({unit})") } else { unit.to_owned() };
        format!(
            "{:.4e} V/{per}{strain}; range {low:.4} to {high:.4} {unit}, {:.4e} {unit}/code",
            self.volts_per_unit,
            (high - low) / CODES
        )
    }
}

/// Beams with their gauges, and the amplifier.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Gauges {
    /// Force on one beam for a unit of load, N.
    share: f64,
    width_m: f64,
    thickness_m: f64,
    arm_m: f64,
    youngs_modulus_pa: f64,
    gauge_factor: f64,
    excitation_v: f64,
    amplifier_gain: f64,
}

impl Gauges {
    fn read(table: &TableReader<'_>, of_torque: bool) -> Result<Self, InputError> {
        let number = |key| table.required_number(key, POSITIVE);
        let beams = table.integer("beams", 1, 100)?;
        let beams = beams.ok_or_else(|| table.missing("beams", "a whole number from 1 to 100"))? as f64;
        let radius_m = if of_torque { number("beam_radius_m")? } else { 1.0 };
        let gauges = Self {
            share: 1.0 / (beams * radius_m),
            width_m: number("beam_width_m")?,
            thickness_m: number("beam_thickness_m")?,
            arm_m: number("arm_m")?,
            youngs_modulus_pa: number("youngs_modulus_pa")?,
            gauge_factor: number("gauge_factor")?,
            excitation_v: number("excitation_v")?,
            amplifier_gain: number("amplifier_gain")?,
        };
        table.finish()?;
        Ok(gauges)
    }

    fn strain_per_unit(&self) -> f64 {
        let section = self.width_m * self.thickness_m * self.thickness_m / 6.0;
        self.share * self.arm_m / (self.youngs_modulus_pa * section)
    }

    fn sensitivity(&self) -> Sensitivity {
        let strain_per_unit = self.strain_per_unit();
        let bridge_v = self.excitation_v * self.gauge_factor * strain_per_unit;
        Sensitivity { volts_per_unit: self.amplifier_gain * bridge_v, strain_per_unit: Some(strain_per_unit) }
    }
}

/// The sensitivity that a bridge's table gives, plainly under `key` or by `gauges`; `None` where by neither.
pub(super) fn read(
    table: &TableReader<'_>,
    key: &str,
    of_torque: bool,
) -> Result<Option<Sensitivity>, InputError> {
    let plain = table.number(key, POSITIVE)?;
    match (plain, table.table("gauges")?) {
        (Some(_), Some(_)) => Err(table
            .error(key, "is given twice")
            .allowed(format!("{key}, or its parts in a table [….gauges]"))),
        (Some(volts_per_unit), None) => Ok(Some(Sensitivity { volts_per_unit, strain_per_unit: None })),
        (None, Some(gauges)) => Ok(Some(Gauges::read(&gauges, of_torque)?.sensitivity())),
        (None, None) => Ok(None),
    }
}

#[cfg(test)]
mod tests {
    use super::super::toml_tree::Document;
    use super::*;

    const BEAMS: &str = "beams = 4\nbeam_width_m = 0.01\nbeam_thickness_m = 0.004\narm_m = 0.02\n\
                         youngs_modulus_pa = 70e9\ngauge_factor = 2\nexcitation_v = 5\namplifier_gain = 256\n";

    fn sensitivity(text: &str, of_torque: bool) -> Result<Option<Sensitivity>, InputError> {
        let key = if of_torque { "sensitivity_v_per_nm" } else { "sensitivity_v_per_n" };
        let document = Document::parse("r.toml", text).unwrap();
        let root = document.root();
        let found = read(&root, key, of_torque)?;
        root.finish().map(|()| found)
    }

    /// Output over supply of four resistors, R1 and R2 in one branch, R4 and R3 in the other.
    fn wheatstone([r1, r2, r3, r4]: [f64; 4]) -> f64 {
        r1 / (r1 + r2) - r4 / (r3 + r4)
    }

    #[test]
    fn the_full_bridge_gives_what_four_resistors_do_at_any_strain() {
        let found = sensitivity(&format!("[gauges]\n{BEAMS}"), false).unwrap().unwrap();
        for load_n in [1.0, 200.0, 1e5] {
            // Deflection of the beam by its own route: a quarter of the load, moment over modulus of resistance.
            let moment_nm = load_n / 4.0 * 0.02;
            let stress_pa = moment_nm / (0.01 * 0.004 * 0.004 / 6.0);
            let change = 2.0 * stress_pa / 70e9;
            let (stretched, compressed) = (350.0 * (1.0 + change), 350.0 * (1.0 - change));
            let pin_v = 256.0 * 5.0 * wheatstone([stretched, compressed, stretched, compressed]);
            // The difference of two halves keeps ten digits of a change of 5e-6.
            assert!((found.volts_per_unit * load_n / pin_v - 1.0).abs() < 1e-9, "{load_n} N: {pin_v} V");
        }
    }

    #[test]
    fn a_ring_divides_the_torque_by_the_radius_of_its_beams() {
        let frame = sensitivity(&format!("[gauges]\n{BEAMS}"), false).unwrap().unwrap();
        let ring = sensitivity(&format!("[gauges]\nbeam_radius_m = 0.05\n{BEAMS}"), true).unwrap().unwrap();
        assert!((ring.volts_per_unit / frame.volts_per_unit - 20.0).abs() < 1e-12);
        // By hand: 6 · (1/(4·0.05)) · 0.02/(70e9 · 0.01 · 0.004²) = 53.57 µm/m per N m.
        let strain = ring.strain_per_unit.unwrap();
        assert!((strain - 53.571_428e-6).abs() < 1e-12, "{strain}");
    }

    #[test]
    fn the_sensitivities_of_the_assumed_amplifiers_span_the_ranges_of_the_cores_settings() {
        let of = |volts_per_unit| Sensitivity { volts_per_unit, strain_per_unit: None };
        let near = |(a, b): (f64, f64), (c, d): (f64, f64)| (a - c).abs() < 1e-9 && (b - d).abs() < 1e-9;
        assert!(near(of(0.1375).range(FRICTION_ZERO), (-12.0, 12.0)));
        assert!(near(of(0.01375).range(NORMAL_ZERO), (-20.0, 220.0)));
        assert_eq!(
            of(0.01375).words("N", NORMAL_ZERO),
            "1.3750e-2 V/N; range -20.0000 to 220.0000 N, 3.6621e-3 N/code"
        );
    }

    #[test]
    fn a_plain_sensitivity_is_taken_as_it_is_and_not_beside_gauges() {
        let plain = sensitivity("sensitivity_v_per_n = 0.0125\n", false).unwrap().unwrap();
        assert_eq!(plain, Sensitivity { volts_per_unit: 0.0125, strain_per_unit: None });
        assert_eq!(sensitivity("", false).unwrap(), None);
        let twice =
            sensitivity(&format!("sensitivity_v_per_n = 0.0125\n[gauges]\n{BEAMS}"), false).unwrap_err();
        assert!(
            twice.to_string().starts_with("r.toml:1: sensitivity_v_per_n = 0.0125: is given twice"),
            "{twice}"
        );
        let gap = sensitivity(&format!("[gauges]\n{BEAMS}"), true).unwrap_err().to_string();
        assert!(gap.starts_with("r.toml:1: gauges.beam_radius_m: is missing"), "{gap}");
    }
}
