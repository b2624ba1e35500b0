//! Who answers, with which settings, and whether the chip computes as this computer does.

use model_core::selfcheck;
use rig_link::message::{Answer, Command};

use super::{Commissioning, Stop};
use crate::input_error::InputError;
use crate::link::ask::check_hello;
use crate::link::words;
use crate::link::words::{REFERENCE_MV, in_volts};

/// Random steps of each model: enough that every branch is taken, little enough to take a second on the chip.
const STEPS: u32 = 200;

pub(super) fn step(c: &mut Commissioning<'_, '_>) -> Result<(), Stop> {
    let hello = check_hello(&c.rig.ask(Command::Hello)?)?;
    if hello.settings_schema != rig_link::settings::SCHEMA_VERSION {
        return Err(InputError::new("the firmware has another list of settings")
            .key("settings_schema")
            .value(hello.settings_schema)
            .allowed(rig_link::settings::SCHEMA_VERSION.to_string())
            .into());
    }
    c.rig.open()?;
    c.check("firmware", words::hello(&hello), "protocol and settings of this tool", true, "");
    let clock = if hello.crystal { "the 8 MHz of the ST-LINK" } else { "internal oscillator" };
    c.check(
        "clock",
        clock,
        "the 8 MHz of the ST-LINK",
        hello.crystal,
        "times and speeds may be off by 1 %: the 8 MHz of the ST-LINK are missing",
    );
    let [least, most] = [REFERENCE_MV.start(), REFERENCE_MV.end()].map(|mv| in_volts(*mv));
    c.check(
        "3.3 V supply of the converters",
        in_volts(hello.reference_mv),
        &format!("{least} to {most}"),
        REFERENCE_MV.contains(&hello.reference_mv),
        "every analogue reading and torque reference is off by as much: look at the board's supply",
    );
    let different = differing_models(c)?;
    let found = if different.is_empty() {
        format!("identical bits in {STEPS} steps of each of {} models", selfcheck::MODELS)
    } else {
        format!("different bits: {}", different.join(", "))
    };
    c.check(
        "friction models, chip against this computer",
        found,
        "identical bits",
        different.is_empty(),
        "build firmware and tool from the same source",
    );
    // What stands from before is no finding of this commissioning, if it can be cleared.
    if c.rig.row.fault != 0 {
        let _ = c.rig.ask(Command::ClearFault)?;
        c.rig.wait(0.1)?;
    }
    let fault = c.rig.fault();
    let advice = "see host-sim/docs/troubleshooting.md for its number";
    c.check("fault", fault.clone().unwrap_or_else(|| "none".into()), "none latched", fault.is_none(), advice);
    c.report.identify(&hello, &c.rig.settings_by_name());
    c.settle()
}

fn differing_models(c: &mut Commissioning<'_, '_>) -> Result<Vec<&'static str>, Stop> {
    let mut different = Vec::new();
    for (case, name) in selfcheck::NAMES.iter().enumerate() {
        let number = u8::try_from(case).unwrap_or(u8::MAX);
        match c.rig.ask(Command::SelfCheck { case: number, steps: STEPS })? {
            Answer::SelfCheck { digest } if digest == selfcheck::run_model(case, STEPS) => {}
            Answer::SelfCheck { .. } => different.push(*name),
            other => return Err(words::unexpected(&other).into()),
        }
    }
    Ok(different)
}
