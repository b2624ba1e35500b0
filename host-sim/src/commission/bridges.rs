//! Both bridges by known weights: sign, scale, zero, and what a straight line leaves.

use model_core::control::settings::BridgeSettings;

use super::line_fit::LineFit;
use super::{Calibration, Commissioning, Stop};
use crate::report::value;

const SPAN_S: f64 = 0.2;
/// Largest deviation from a line, as a share of the largest load: ten times what a good amplifier leaves.
const LINEARITY: f64 = 0.005;
/// How far the scale may be from the setting before it should be stored.
const SCALE: f64 = 0.02;
/// Largest share of its range that the other bridge may show.
const CROSSTALK: f64 = 0.02;

struct Bridge {
    name: &'static str,
    setting: &'static str,
    unit: &'static str,
    x: &'static str,
    channel: usize,
    hang: &'static str,
}

const BRIDGES: [Bridge; 2] = [
    Bridge {
        name: "friction bridge",
        setting: "friction_bridge",
        unit: "N m",
        x: "known torque, N m",
        channel: 0,
        hang: "on the torque ring's lever, as the road drags it when the disc turns forward",
    },
    Bridge {
        name: "normal force bridge",
        setting: "normal_bridge",
        unit: "N",
        x: "known force, N",
        channel: 1,
        hang: "on the frame, as the elements press",
    },
];

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let loads = [c.options.friction_loads_nm.clone(), c.options.normal_loads_n.clone()];
    let settings = [c.rig.settings.friction_bridge, c.rig.settings.normal_bridge];
    for ((bridge, loads), setting) in BRIDGES.iter().zip(&loads).zip(&settings) {
        one(c, bridge, loads, setting)?;
    }
    Ok(())
}

fn one(
    c: &mut Commissioning<'_, '_>,
    bridge: &Bridge,
    loads: &[f64],
    setting: &BridgeSettings,
) -> Result<(), Stop> {
    let Bridge { name, unit, channel, .. } = *bridge;
    let mut points = Vec::new();
    let mut other = Vec::new();
    for load in std::iter::once(&0.0).chain(loads) {
        let ask = if *load == 0.0 {
            format!("take every weight off the {name}")
        } else {
            format!("hang {load} {unit} {}", bridge.hang)
        };
        // Unloaded it is from the step before.
        if *load != 0.0 && !c.rig.entered(&ask)? {
            c.check(&ask, "nobody pressed Enter", "done", false, "press Enter when the weight hangs still");
            c.settle()?;
        }
        let readings = c.rig.readings(SPAN_S)?;
        points.push((*load, readings.code[channel]));
        other.push((*load, readings.code[1 - channel]));
    }
    let _ = c.rig.entered(&format!("take every weight off the {name}"))?;
    let largest = loads.iter().fold(0.0, |most: f64, load| most.max(load.abs()));
    let (Some(fit), Some(crosstalk)) = (LineFit::through(&points), LineFit::through(&other)) else {
        c.check(name, "no line", "two different loads or more", false, "give other loads");
        return c.settle();
    };
    let unit_per_code = 1.0 / fit.slope;
    let (set_scale, set_zero) = (f64::from(setting.unit_per_code), f64::from(setting.zero_code));
    let share = unit_per_code / set_scale;
    let reacts = fit.slope.abs() * largest > 50.0;
    let exchanged = !reacts && crosstalk.slope.abs() * largest > 50.0;
    let advice = match (reacts, exchanged) {
        (_, true) => "the other bridge reacts: their plugs are exchanged",
        (false, _) => "it does not react to the weights: look at its wires",
        _ => "the signal wires are exchanged: exchange them, or give unit_per_code the other sign",
    };
    let found = format!(
        "{} {unit} per code",
        value::with_uncertainty(unit_per_code, relative(&fit) * unit_per_code.abs())
    );
    c.check(
        &format!("{name}, sign"),
        found,
        &format!("the sign of {set_scale:.6}"),
        reacts && share > 0.0,
        advice,
    );
    c.settle()?;
    let most = LINEARITY * largest;
    let residual = fit.largest_residual * unit_per_code.abs();
    c.check(
        &format!("{name}, largest deviation from a line"),
        format!("{residual:.4} {unit}"),
        &format!("{most:.4} {unit}"),
        residual <= most,
        "a load was not what it should be, the lever touches something, or the amplifier is at its end",
    );
    let spill = crosstalk.slope * largest;
    c.check(
        &format!("{name}, what the other bridge shows"),
        format!("{} codes at the largest load", spill.round() + 0.0),
        &format!("{:.0}", CROSSTALK * 65536.0),
        spill.abs() <= CROSSTALK * 65536.0,
        "the load reaches the other bridge: hang it where it does not",
    );
    c.settle()?;
    let commands = format!(
        "rig settings set {0}.unit_per_code={unit_per_code:.7} {0}.zero_code={1:.1}",
        bridge.setting, fit.offset
    );
    let close = (share - 1.0).abs() <= SCALE;
    if c.options.store {
        #[allow(clippy::cast_possible_truncation)]
        let (scale, zero) = (unit_per_code as f32, fit.offset as f32);
        c.rig.store(&format!("{}.unit_per_code", bridge.setting), scale)?;
        c.rig.store(&format!("{}.zero_code", bridge.setting), zero)?;
        c.rig.say(&format!("stored: {commands}"));
    } else {
        c.rig.say(&format!("measured scale and zero: {commands}"));
    }
    c.check(
        &format!("{name}, scale"),
        format!(
            "{:+.2} % from the setting, zero {:+.0} codes from it",
            100.0 * (share - 1.0),
            fit.offset - set_zero
        ),
        &if c.options.store { "any: it was stored".to_owned() } else { format!("± {} %", 100.0 * SCALE) },
        close || c.options.store,
        &format!("store it: {commands} (or --store)"),
    );
    c.report.calibrations.push(Calibration { name: name.into(), x: bridge.x, y: "reading, codes", fit });
    c.settle()
}

fn relative(fit: &LineFit) -> f64 {
    fit.slope_std.map_or(0.0, |std| std / fit.slope.abs())
}
