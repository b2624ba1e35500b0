//! The settings in flash bank 2: `rig-store` over the chip's flash, with what the board decides in place.

use crate::board;
use crate::flash::{SETTINGS, SettingsFlash};
use model_core::control::ControlSettings;
use rig_link::settings::SCHEMA_VERSION;
use rig_store::{Board, Damage, Place};

/// The store and what is in it.
pub type Settings = rig_store::Settings<SettingsFlash>;
/// Why a setting was not changed.
pub type Refused = rig_store::Refused<crate::flash::Error>;

/// Defaults, with what the board decides in place.
fn of_the_board() -> Board {
    let mut defaults = ControlSettings { tick_s: 1.0 / board::TICK_HZ as f32, ..ControlSettings::default() };
    defaults.m1_encoder.counter_bits = board::M1_COUNTER_BITS;
    defaults.m2_encoder.counter_bits = board::M2_COUNTER_BITS;
    defaults.timing.adc_frozen_ticks = board::FROZEN_TICKS;
    Board { defaults, caps: board::CAPS }
}

/// Reads the store; what is wrong with it goes to the log.
///
/// # Errors
/// The flash does not take what has to be put right first.
pub async fn load(flash: SettingsFlash) -> Result<Settings, crate::flash::Error> {
    let (settings, damage) =
        Settings::load(flash, const { Place::new(SETTINGS.start) }, of_the_board()).await?;
    match damage {
        None => {}
        Some(Damage::Range(error)) => {
            defmt::error!("settings: {=str} = {=f64} is not {=str}", error.name, error.value, error.allowed);
        }
        Some(Damage::Store(error)) => defmt::error!("settings: {}", error),
        Some(Damage::Record(key)) => defmt::error!("settings: record {=u16} is not understood", key),
        Some(Damage::Schema(schema)) => {
            defmt::error!("settings: schema {=u16} is newer than {=u16}", schema, SCHEMA_VERSION);
        }
    }
    if let Some(error) = settings.model_left_out() {
        defmt::error!(
            "settings: the stored model is left out: {=str} = {=f64} is not {=str}",
            error.name,
            error.value,
            error.allowed
        );
    }
    Ok(settings)
}
