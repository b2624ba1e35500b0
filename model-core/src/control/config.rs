//! The prepared configuration: settings turned into coefficients per tick.

use super::settings::ControlSettings;
use crate::error::{ParameterError, require};

/// What the step reads. Built by [`ControlSettings::build`] and swapped whole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ControlConfig {
    pub(crate) settings: ControlSettings,
    pub(crate) boot_ticks: u32,
}

impl ControlSettings {
    /// Checks every setting and prepares the coefficients.
    ///
    /// # Errors
    /// The first setting outside its range, with the range.
    pub fn build(&self) -> Result<ControlConfig, ParameterError> {
        let tick_s = require("tick_s", self.tick_s, (2e-5..=1e-3).contains(&self.tick_s), "20e-6 … 1e-3 s")?;
        let boot_s = self.timing.boot_s;
        let boot_s = require("timing.boot_s", boot_s, (0.0..=10.0).contains(&boot_s), "0 … 10 s")?;
        Ok(ControlConfig { settings: *self, boot_ticks: (boot_s / tick_s) as u32 })
    }
}

impl ControlConfig {
    /// The settings it was built from.
    #[must_use]
    pub fn settings(&self) -> &ControlSettings {
        &self.settings
    }
}
