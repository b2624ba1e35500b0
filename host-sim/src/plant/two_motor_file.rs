//! The file of a rig of two motors on one shaft: the paper's original rig (`rigs/original.toml`).
//!
//! Its tables are complete: nothing is filled in where a file is given, but what is optional. The shaft's stiffness is a
//! number or follows from a round bar, k = G π d⁴/(32 l).

use std::path::Path;

use crate::files::overrides;
use crate::files::toml_tree::{Allowed, Document, NOT_NEGATIVE, POSITIVE, TableReader};
use crate::input_error::InputError;
use crate::plant::parameters::{BearingParameters, DriveParameters, ShaftParameters};
use crate::plant::two_motors::{MotorParameters, ResolverParameters, TwoMotorParameters};

const ORIGINAL: &str = include_str!("../../rigs/original.toml");
const ORIGINAL_NAME: &str = "assumed original rig";
/// `kind` of such a file.
const KIND: &str = "two_motors";

/// Reads and checks a file, or takes the assumed original rig where none is given.
///
/// # Errors
/// What cannot be read, or is not allowed, by file, line and key.
pub fn read_or_assumed(
    path: Option<&Path>,
    changes: &[(String, String)],
) -> Result<TwoMotorParameters, InputError> {
    let mut document = match path {
        Some(path) => Document::read(path)?,
        None => {
            crate::provenance::note("rig", "assumed original rig: no file was given");
            Document::parse(ORIGINAL_NAME, ORIGINAL)?
        }
    };
    overrides::apply(&mut document, changes)?;
    read(&document.root())
}

fn read(root: &TableReader<'_>) -> Result<TwoMotorParameters, InputError> {
    root.choice("kind", &[(KIND, ())])?.ok_or_else(|| root.missing("kind", "\"two_motors\""))?;
    let table = |name: &str| root.table(name)?.ok_or_else(|| root.missing(name, "a table"));
    let parameters = TwoMotorParameters {
        m1: motor(&table("m1")?)?,
        m2: motor(&table("m2")?)?,
        shaft: shaft(&table("shaft")?)?,
        resolver: resolver(&table("resolver")?)?,
    };
    root.finish()?;
    Ok(parameters)
}

fn motor(table: &TableReader<'_>) -> Result<MotorParameters, InputError> {
    let own = table.required_number("inertia_kg_m2", POSITIVE)?;
    let parameters = MotorParameters {
        drive: DriveParameters {
            rated_torque_nm: table.required_number("rated_torque_nm", POSITIVE)?,
            torque_lag_s: table.required_number("torque_lag_s", NOT_NEGATIVE)?,
        },
        inertia_kg_m2: own + crate::files::rig_file::inertia_discs(table)?,
        bearing: BearingParameters {
            coulomb_nm: table.required_number("coulomb_nm", NOT_NEGATIVE)?,
            viscous_nm_s: table.required_number("viscous_nm_s_per_rad", NOT_NEGATIVE)?,
            ..BearingParameters::default()
        },
    };
    table.finish()?;
    Ok(parameters)
}

fn shaft(table: &TableReader<'_>) -> Result<ShaftParameters, InputError> {
    let plain = table.number("stiffness_nm_per_rad", POSITIVE)?;
    let bar = ["diameter_m", "length_m", "shear_modulus_pa"];
    let [diameter, length, modulus] = bar.map(|key| table.number(key, POSITIVE));
    let stiffness_nm_per_rad = match (plain, diameter?, length?, modulus?) {
        (Some(stiffness), None, None, None) => stiffness,
        (None, Some(d), Some(l), Some(g)) => g * std::f64::consts::PI * d.powi(4) / (32.0 * l),
        (Some(_), ..) => {
            let error = table.error("stiffness_nm_per_rad", "is given twice");
            return Err(error.allowed("the stiffness, or diameter_m, length_m and shear_modulus_pa"));
        }
        (None, ..) => {
            let gap = bar.into_iter().find(|key| !table.has(key)).unwrap_or(bar[0]);
            return Err(
                table.missing(gap, "diameter_m, length_m and shear_modulus_pa, or stiffness_nm_per_rad")
            );
        }
    };
    let parameters = ShaftParameters {
        stiffness_nm_per_rad,
        damping_nm_s: table.number("damping_nm_s_per_rad", NOT_NEGATIVE)?.unwrap_or(0.0),
        backlash_rad: table.number("backlash_rad", NOT_NEGATIVE)?.unwrap_or(0.0),
        // The motors' inertias stand in their own tables.
        motor_inertia_kg_m2: 0.0,
    };
    table.finish()?;
    Ok(parameters)
}

fn resolver(table: &TableReader<'_>) -> Result<ResolverParameters, InputError> {
    let share = Allowed { check: |x| x.abs() <= 0.1, words: "-0.1 to 0.1" };
    let bits = table.integer("bits", 8, 24)?;
    let parameters = ResolverParameters {
        bits: bits.ok_or_else(|| table.missing("bits", "a whole number from 8 to 24"))? as u32,
        imbalance: table.number("imbalance", share)?.unwrap_or(0.0),
    };
    table.finish()?;
    Ok(parameters)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changed(key: &str, value: &str) -> Result<TwoMotorParameters, InputError> {
        read_or_assumed(None, &[(key.to_string(), value.to_string())])
    }

    #[test]
    fn the_assumed_original_rig_reads_with_the_stiffness_of_its_bar_and_its_discs() {
        let rig = read_or_assumed(None, &[]).unwrap();
        // 80e9 · π · 0.012⁴/(32 · 0.3), by hand.
        assert!(
            (rig.shaft.stiffness_nm_per_rad - 542.867_2).abs() < 1e-3,
            "{}",
            rig.shaft.stiffness_nm_per_rad
        );
        assert!(
            (rig.m1.inertia_kg_m2 - 0.0214).abs() < 1e-15 && (rig.m2.inertia_kg_m2 - 0.0014).abs() < 1e-15
        );
        let soft = changed("shaft", "{ stiffness_nm_per_rad = 40.0 }").unwrap();
        assert_eq!((soft.shaft.stiffness_nm_per_rad, soft.shaft.backlash_rad), (40.0, 0.0));
    }

    #[test]
    fn bad_entries_are_named_with_what_is_allowed() {
        let refused = |key: &str, value: &str| changed(key, value).unwrap_err().to_string();
        assert!(refused("kind", "press").contains("kind = press: not known; allowed: two_motors"));
        assert!(refused("shaft.stiffness_nm_per_rad", "40").contains("is given twice"));
        assert!(
            refused("shaft", "{ diameter_m = 0.01, length_m = 0.1 }")
                .contains("shaft.shear_modulus_pa: is missing")
        );
        assert!(
            refused("resolver.bits", "30")
                .contains("resolver.bits = 30: out of range; allowed: a whole number from 8 to 24")
        );
        assert!(
            refused("m1.stiffness_n_per_rad", "3000").contains("m1.stiffness_n_per_rad = 3000: unknown key")
        );
    }
}
