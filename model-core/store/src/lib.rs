//! The settings in flash: one record a key, appended; the last one counts.
//!
//! `sequential-storage` keeps the records in two sectors, each record with its CRC, so a power cut at any
//! moment leaves the record before it in force (`tests/power_cut.rs` cuts at every word). Keys are those of
//! `rig_link::settings`; two more hold the schema version and the model. A record of no bytes means "forgotten". A key
//! this version does not know is kept and not looked at.
//!
//! What cannot be read is damage: all settings are then the defaults, and nothing is written until a person erases the
//! store by command. A model that this version does not understand, or cannot run with these settings, is left out alone:
//! no rig moves otherwise for it, the observer predicts with the default model.
#![no_std]
#![forbid(unsafe_code)]

pub mod erasing;

use embedded_storage_async::nor_flash::NorFlash;
use erasing::Whole;
use heapless::Vec;
use model_core::control::{ControlConfig, ControlSettings, ObserverModel, RawCaps};
use model_core::error::ParameterError;
use rig_link::model::ModelRecord;
use rig_link::settings::{ALL, SCHEMA_VERSION, SettingInfo, SettingState};
use sequential_storage::cache::NoCache;
use sequential_storage::map::{MapConfig, MapStorage};

const SCHEMA_KEY: u16 = 1;
const MODEL_KEY: u16 = 2;
/// The longest record, its key and the padding to whole flash words.
const RECORD: usize = 512;

type Map<F> = MapStorage<u16, Whole<F>, NoCache>;

/// The flash's sectors that the store has; made once, in a constant, so that wrong ones do not compile.
pub struct Place<F: NorFlash> {
    map: MapConfig<Whole<F>>,
    journal: u32,
    pages: [u32; 2],
}

impl<F: NorFlash> Place<F> {
    /// Three sectors from here on: two for the records, one for the journal of their erasing.
    #[must_use]
    pub const fn new(from: u32) -> Self {
        let sector = F::ERASE_SIZE as u32;
        Self {
            map: MapConfig::new(from..from + 2 * sector),
            journal: from + 2 * sector,
            pages: [from, from + sector],
        }
    }
}

/// What the store below says when it cannot go on.
pub type StoreError<E> = sequential_storage::Error<E>;

/// What the board decides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Board {
    /// Settings where none are stored.
    pub defaults: ControlSettings,
    /// Caps that no setting lifts.
    pub caps: RawCaps,
}

/// Why a setting was not changed.
#[derive(Debug)]
pub enum Refused<E> {
    /// The value, or what it makes of the others, is out of range.
    OutOfRange(ParameterError),
    /// The flash did not take it.
    Storage(StoreError<E>),
    /// What is stored is damaged: erase it first.
    Damaged,
    /// The model is longer than a record.
    TooLong,
}

impl<E> From<ParameterError> for Refused<E> {
    fn from(error: ParameterError) -> Self {
        Self::OutOfRange(error)
    }
}

impl<E> From<StoreError<E>> for Refused<E> {
    fn from(error: StoreError<E>) -> Self {
        Self::Storage(error)
    }
}

/// What is wrong with what was stored.
#[derive(Debug)]
pub enum Damage<E> {
    /// A value, or what the values make together, is out of range.
    Range(ParameterError),
    /// The store cannot be read.
    Store(StoreError<E>),
    /// The record of this key is not understood.
    Record(u16),
    /// The schema is newer than this version's.
    Schema(u16),
}

impl<E> From<StoreError<E>> for Damage<E> {
    fn from(error: StoreError<E>) -> Self {
        Self::Store(error)
    }
}

/// What was stored, as far as it could be read.
#[derive(Debug, Clone, PartialEq)]
pub struct Stored {
    values: [Option<f32>; ALL.len()],
    model: Option<ModelRecord>,
}

impl Stored {
    const NOTHING: Self = Self { values: [None; ALL.len()], model: None };

    /// The settings these records make of the defaults.
    fn settings(&self, board: &Board) -> Result<ControlSettings, ParameterError> {
        let mut settings = board.defaults;
        for (info, value) in ALL.iter().zip(self.values) {
            if let Some(value) = value {
                put(info, &mut settings, value)?;
            }
        }
        Ok(settings)
    }

    /// The configuration they make, the model included.
    fn config(&self, board: &Board) -> Result<ControlConfig, ParameterError> {
        let settings = self.settings(board)?;
        let mut config = settings.build_within(&board.caps)?;
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

/// The store and what is in it.
pub struct Settings<F: NorFlash> {
    map: Map<F>,
    board: Board,
    stored: Stored,
    intact: bool,
    left_out: Option<ParameterError>,
}

impl<F: NorFlash> Settings<F> {
    /// Reads the store in these sectors of the flash; says what is wrong with it, if anything is.
    ///
    /// # Errors
    /// The flash does not take what has to be put right before anything is read.
    pub async fn load(
        flash: F,
        place: Place<F>,
        board: Board,
    ) -> Result<(Self, Option<Damage<F::Error>>), F::Error> {
        let whole = Whole::open(flash, place.journal, place.pages).await?;
        let mut map = Map::new(whole, place.map, NoCache::new());
        let (stored, left_out, damage) = match read(&mut map, &board).await {
            Ok((stored, left_out)) => match stored.config(&board) {
                Ok(_) => (stored, left_out, None),
                Err(error) => (Stored::NOTHING, None, Some(Damage::Range(error))),
            },
            Err(damage) => (Stored::NOTHING, None, Some(damage)),
        };
        Ok((Self { map, board, stored, intact: damage.is_none(), left_out }, damage))
    }

    /// The flash.
    pub fn flash(&mut self) -> &F {
        self.map.flash().flash()
    }

    /// The flash, for another who reads it.
    pub fn into_flash(self) -> F {
        self.map.destroy().0.into_flash()
    }

    /// Whether all that was stored could be read and is in range.
    #[must_use]
    pub fn intact(&self) -> bool {
        self.intact
    }

    /// What is wrong with the model that was stored, where it was left out at the start.
    #[must_use]
    pub fn model_left_out(&self) -> Option<&ParameterError> {
        self.left_out.as_ref()
    }

    /// The configuration in force.
    ///
    /// # Errors
    /// The defaults themselves are out of range.
    pub fn config(&self) -> Result<ControlConfig, ParameterError> {
        self.stored.config(&self.board)
    }

    /// Counts per revolution of M2's encoder.
    #[must_use]
    pub fn counts_per_rev(&self) -> u32 {
        self.stored.settings(&self.board).map_or(0, |settings| settings.m2_encoder.counts_per_rev)
    }

    /// One setting.
    #[must_use]
    pub fn state(&self, info: &SettingInfo) -> SettingState {
        let default = info.get(&self.board.defaults);
        let stored = ALL
            .iter()
            .zip(self.stored.values)
            .find(|(other, _)| other.key == info.key)
            .and_then(|found| found.1);
        SettingState { key: info.key, active: stored.unwrap_or(default), stored, default }
    }

    /// What the configuration would be with this value stored, or with none.
    ///
    /// # Errors
    /// A value out of range.
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
        let config = stored.config(&self.board)?;
        Ok((stored, config))
    }

    /// What the observer would run with this model stored, or with none.
    ///
    /// # Errors
    /// A value out of range.
    pub fn with_model(&self, model: Option<&ModelRecord>) -> Result<ObserverModel, ParameterError> {
        let settings = self.stored.settings(&self.board)?;
        model.unwrap_or(&ModelRecord::default()).prepare(&settings)
    }

    /// The stored model.
    #[must_use]
    pub fn model(&self) -> Option<&ModelRecord> {
        self.stored.model.as_ref()
    }

    /// Writes one value; `stored` is what [`Self::with_value`] gave for it.
    ///
    /// # Errors
    /// The flash did not take it.
    pub async fn keep_value(
        &mut self,
        info: &SettingInfo,
        value: Option<f32>,
        stored: Stored,
    ) -> Result<(), Refused<F::Error>> {
        let bytes = value.map(f32::to_le_bytes);
        self.write(info.key, bytes.as_ref().map_or(&[], |bytes| bytes.as_slice())).await?;
        self.stored = stored;
        Ok(())
    }

    /// Writes the model, or that there is none.
    ///
    /// # Errors
    /// The flash did not take it.
    pub async fn keep_model(&mut self, model: Option<ModelRecord>) -> Result<(), Refused<F::Error>> {
        let mut buffer = [0; RECORD];
        let bytes: &[u8] = match &model {
            Some(model) => postcard::to_slice(model, &mut buffer).map_err(|_| Refused::TooLong)?,
            None => &[],
        };
        self.write(MODEL_KEY, bytes).await?;
        self.stored.model = model;
        Ok(())
    }

    /// Erases everything that is stored.
    ///
    /// # Errors
    /// The flash did not take it.
    pub async fn erase(&mut self) -> Result<(), Refused<F::Error>> {
        self.map.erase_all().await?;
        self.stored = Stored::NOTHING;
        self.intact = true;
        Ok(())
    }

    async fn write(&mut self, key: u16, bytes: &[u8]) -> Result<(), Refused<F::Error>> {
        if !self.intact {
            return Err(Refused::Damaged);
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

/// What is stored, and what is wrong with its model if that is left out.
async fn read<F: NorFlash>(
    map: &mut Map<F>,
    board: &Board,
) -> Result<(Stored, Option<ParameterError>), Damage<F::Error>> {
    let mut stored = Stored::NOTHING;
    let mut buffer = [0; RECORD];
    let mut records = map.fetch_all_items(&mut buffer).await?;
    let mut buffer = [0; RECORD];
    let mut model: Option<Vec<u8, RECORD>> = None;
    // The last record of a key comes last, so later ones simply replace earlier ones.
    while let Some((key, bytes)) = records.next::<&[u8]>(&mut buffer).await? {
        match key {
            SCHEMA_KEY => {
                let version = bytes.try_into().map(u16::from_le_bytes).map_err(|_| Damage::Record(key))?;
                if version > SCHEMA_VERSION {
                    return Err(Damage::Schema(version));
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
                        _ => Some(bytes.try_into().map(f32::from_le_bytes).map_err(|_| Damage::Record(key))?),
                    };
                }
            }
        }
    }
    let mut left_out = None;
    if let (Some(bytes), Ok(settings)) = (model, stored.settings(board)) {
        match ModelRecord::from_stored(&bytes, &settings) {
            Ok(model) => stored.model = Some(model),
            Err(error) => left_out = Some(error),
        }
    }
    Ok((stored, left_out))
}
