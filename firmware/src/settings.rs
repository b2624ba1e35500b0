//! The settings in flash: one record a key, appended; the last one counts.
//!
//! `sequential-storage` keeps the records in two sectors, each record with its CRC, so a power cut at any
//! moment leaves the record before it in force. Keys are those of `rig_link::settings`; two more hold the
//! schema version and the model. A record of no bytes means "forgotten". A key this firmware does not
//! know is kept and not looked at.
//!
//! What cannot be read is a fault (`SettingsCorrupt`): all settings are then the defaults, and nothing is
//! written until a person erases the store by command. A model that this firmware does not understand, or cannot run
//! with these settings, is left out alone: no rig moves otherwise for it, the observer predicts with the default model.

use crate::board;
use crate::flash::{Error as FlashError, SETTINGS, SettingsFlash};
use heapless::Vec;
use model_core::control::{ControlConfig, ControlSettings, ObserverModel};
use model_core::error::ParameterError;
use rig_link::model::ModelRecord;
use rig_link::settings::{ALL, SCHEMA_VERSION, SettingInfo, SettingState};
use sequential_storage::cache::NoCache;
use sequential_storage::map::{MapConfig, MapStorage};

const SCHEMA_KEY: u16 = 1;
const MODEL_KEY: u16 = 2;
/// The longest record, its key and the padding to whole flash words.
const RECORD: usize = 512;

type Map = MapStorage<u16, SettingsFlash, NoCache>;
type StoreError = sequential_storage::Error<FlashError>;

/// Why a setting was not changed.
pub enum Refused {
    /// The value, or what it makes of the others, is out of range.
    OutOfRange(ParameterError),
    /// The flash did not take it.
    Storage,
}

impl From<ParameterError> for Refused {
    fn from(error: ParameterError) -> Self {
        Self::OutOfRange(error)
    }
}

impl From<StoreError> for Refused {
    fn from(error: StoreError) -> Self {
        defmt::warn!("settings: {}", error);
        Self::Storage
    }
}

/// What was stored, as far as it could be read.
#[derive(Clone)]
pub struct Stored {
    values: [Option<f32>; ALL.len()],
    model: Option<ModelRecord>,
}

impl Stored {
    const NOTHING: Self = Self { values: [None; ALL.len()], model: None };

    /// The settings these records make of the defaults.
    fn settings(&self) -> Result<ControlSettings, ParameterError> {
        let mut settings = defaults();
        for (info, value) in ALL.iter().zip(self.values) {
            if let Some(value) = value {
                put(info, &mut settings, value)?;
            }
        }
        Ok(settings)
    }

    /// The configuration they make, the model included.
    fn config(&self) -> Result<ControlConfig, ParameterError> {
        let settings = self.settings()?;
        let mut config = settings.build_within(&board::CAPS)?;
        if let Some(model) = &self.model {
            config.set_model(&model.prepare(&settings)?);
        }
        Ok(config)
    }
}

fn put(info: &SettingInfo, settings: &mut ControlSettings, value: f32) -> Result<(), ParameterError> {
    info.set(settings, value).map_err(|_| ParameterError {
        name: info.name,
        value: f64::from(value),
        allowed: "a whole number",
    })
}

/// Defaults, with what the board decides in place.
fn defaults() -> ControlSettings {
    let mut settings = ControlSettings { tick_s: 1.0 / board::TICK_HZ as f32, ..ControlSettings::default() };
    settings.m1_encoder.counter_bits = board::M1_COUNTER_BITS;
    settings.m2_encoder.counter_bits = board::M2_COUNTER_BITS;
    settings
}

/// The store and what is in it.
pub struct Settings {
    map: Map,
    stored: Stored,
    intact: bool,
}

impl Settings {
    /// Reads the store.
    pub async fn load(flash: SettingsFlash) -> Self {
        let mut map = Map::new(flash, const { MapConfig::new(SETTINGS) }, NoCache::new());
        let stored = match read(&mut map).await {
            Ok(stored) => match stored.config() {
                Ok(_) => Some(stored),
                Err(error) => {
                    defmt::error!(
                        "settings: {=str} = {=f64} is not {=str}",
                        error.name,
                        error.value,
                        error.allowed
                    );
                    None
                }
            },
            Err(Unreadable::Store(error)) => {
                defmt::error!("settings: {}", error);
                None
            }
            Err(Unreadable::Record(key)) => {
                defmt::error!("settings: record {=u16} is not understood", key);
                None
            }
            Err(Unreadable::Schema(schema)) => {
                defmt::error!("settings: schema {=u16} is newer than {=u16}", schema, SCHEMA_VERSION);
                None
            }
        };
        let intact = stored.is_some();
        Self { map, stored: stored.unwrap_or(Stored::NOTHING), intact }
    }

    /// Whether all that was stored could be read and is in range.
    #[must_use]
    pub fn intact(&self) -> bool {
        self.intact
    }

    /// The configuration in force.
    ///
    /// # Errors
    /// The defaults themselves are out of range.
    pub fn config(&self) -> Result<ControlConfig, ParameterError> {
        self.stored.config()
    }

    /// Counts per revolution of M2's encoder.
    #[must_use]
    pub fn counts_per_rev(&self) -> u32 {
        self.stored.settings().map_or(0, |settings| settings.m2_encoder.counts_per_rev)
    }

    /// One setting.
    #[must_use]
    pub fn state(&self, info: &SettingInfo) -> SettingState {
        let default = info.get(&defaults());
        let stored = ALL
            .iter()
            .zip(self.stored.values)
            .find(|(other, _)| other.key == info.key)
            .and_then(|found| found.1);
        SettingState { key: info.key, active: stored.unwrap_or(default), stored, default }
    }

    /// What the configuration would be with this value stored, or with none.
    pub fn with_value(
        &self,
        info: &SettingInfo,
        value: Option<f32>,
    ) -> Result<(Stored, ControlConfig), ParameterError> {
        let mut stored = self.stored.clone();
        for (other, place) in ALL.iter().zip(&mut stored.values) {
            if other.key == info.key {
                *place = value;
            }
        }
        let config = stored.config()?;
        Ok((stored, config))
    }

    /// What the observer would run with this model stored, or with none.
    pub fn with_model(&self, model: Option<&ModelRecord>) -> Result<ObserverModel, ParameterError> {
        let settings = self.stored.settings()?;
        model.unwrap_or(&ModelRecord::default()).prepare(&settings)
    }

    /// The stored model.
    #[must_use]
    pub fn model(&self) -> Option<&ModelRecord> {
        self.stored.model.as_ref()
    }

    /// Writes one value; `stored` is what [`Self::with_value`] gave for it.
    pub async fn keep_value(
        &mut self,
        info: &SettingInfo,
        value: Option<f32>,
        stored: Stored,
    ) -> Result<(), Refused> {
        let bytes = value.map(f32::to_le_bytes);
        self.write(info.key, bytes.as_ref().map_or(&[], |bytes| bytes.as_slice())).await?;
        self.stored = stored;
        Ok(())
    }

    /// Writes the model, or that there is none.
    pub async fn keep_model(&mut self, model: Option<ModelRecord>) -> Result<(), Refused> {
        let mut buffer = [0; RECORD];
        let bytes: &[u8] = match &model {
            Some(model) => postcard::to_slice(model, &mut buffer).map_err(|_| Refused::Storage)?,
            None => &[],
        };
        self.write(MODEL_KEY, bytes).await?;
        self.stored.model = model;
        Ok(())
    }

    /// Erases everything that is stored.
    pub async fn erase(&mut self) -> Result<(), Refused> {
        self.map.erase_all().await?;
        self.stored = Stored::NOTHING;
        self.intact = true;
        Ok(())
    }

    async fn write(&mut self, key: u16, bytes: &[u8]) -> Result<(), Refused> {
        if !self.intact {
            return Err(Refused::Storage);
        }
        let mut buffer = [0; RECORD];
        let schema: Option<&[u8]> = self.map.fetch_item(&mut buffer, &SCHEMA_KEY).await?;
        if schema.is_none() {
            let version = SCHEMA_VERSION.to_le_bytes();
            self.map.store_item(&mut buffer, &SCHEMA_KEY, &version.as_slice()).await?;
        }
        self.map.store_item(&mut buffer, &key, &bytes).await?;
        Ok(())
    }
}

enum Unreadable {
    Store(StoreError),
    Record(u16),
    Schema(u16),
}

impl From<StoreError> for Unreadable {
    fn from(error: StoreError) -> Self {
        Self::Store(error)
    }
}

async fn read(map: &mut Map) -> Result<Stored, Unreadable> {
    let mut stored = Stored::NOTHING;
    let mut buffer = [0; RECORD];
    let mut records = map.fetch_all_items(&mut buffer).await?;
    let mut buffer = [0; RECORD];
    let mut model: Option<Vec<u8, RECORD>> = None;
    // The last record of a key comes last, so later ones simply replace earlier ones.
    while let Some((key, bytes)) = records.next::<&[u8]>(&mut buffer).await? {
        match key {
            SCHEMA_KEY => {
                let version =
                    bytes.try_into().map(u16::from_le_bytes).map_err(|_| Unreadable::Record(key))?;
                if version > SCHEMA_VERSION {
                    return Err(Unreadable::Schema(version));
                }
            }
            MODEL_KEY if bytes.is_empty() => model = None,
            // A record is never longer than the buffer that it was read into.
            MODEL_KEY => model = Vec::from_slice(bytes).ok(),
            _ => {
                if let Some((_, place)) = ALL.iter().zip(&mut stored.values).find(|(info, _)| info.key == key)
                {
                    *place = match bytes {
                        [] => None,
                        _ => Some(
                            bytes.try_into().map(f32::from_le_bytes).map_err(|_| Unreadable::Record(key))?,
                        ),
                    };
                }
            }
        }
    }
    if let (Some(bytes), Ok(settings)) = (model, stored.settings()) {
        stored.model = ModelRecord::from_stored(&bytes, &settings)
            .inspect_err(|error| {
                defmt::error!(
                    "settings: the stored model is left out: {=str} = {=f64} is not {=str}",
                    error.name,
                    error.value,
                    error.allowed
                );
            })
            .ok();
    }
    Ok(stored)
}
