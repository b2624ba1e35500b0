//! The fault campaign: what can go wrong on the rig is made to go wrong, and the firmware must end it.
//!
//! One run of fig20 is brought to the middle of its load phase, both loops at work, and kept; each fault starts
//! from there. Asked each time: are the outputs safe within two control periods of the moment the fault can be known,
//! do they stay so with nobody at the rig, is the reason in the firmware's log and said over the link. When a
//! fault "can be known" follows from the firmware's own settings (how many samples in a row, which time-out) or from
//! the watchdog's, and is written down with each fault.

mod faults;
mod link_noise;
pub mod listening_host;
mod settings_cut;
pub mod states;

use crate::driver::PERIOD;
use crate::elf::Firmware;
use crate::error::BenchError;
use std::path::Path;

/// Outputs are safe so long after the moment the fault can be known.
pub const PROMISED_NS: u64 = 2 * PERIOD;

/// What became of one fault.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// The fault in words.
    pub name: &'static str,
    /// From the fault to the moment it can be known, ns.
    pub known_ns: u64,
    /// From the fault to safe outputs that stay safe, ns.
    pub safe_ns: Option<u64>,
    /// What the firmware said it was.
    pub said: String,
    /// Everything that was not as it must be.
    pub problems: Vec<String>,
}

impl Verdict {
    /// Whether all was as it must be.
    #[must_use]
    pub fn held(&self) -> bool {
        self.problems.is_empty()
    }
}

/// Runs the whole campaign. `scratch` is a folder for temporary files; `tell` hears each verdict.
///
/// # Errors
/// The bench itself failed. A firmware that fails a fault is no error: see [`Verdict::problems`].
pub fn run(
    firmware: &Firmware,
    scratch: &Path,
    tell: &mut dyn FnMut(&Verdict),
) -> Result<Vec<Verdict>, BenchError> {
    let mut verdicts = Vec::new();
    let mut add = |verdict: Verdict| {
        tell(&verdict);
        verdicts.push(verdict);
    };
    let running = states::State::Sliding.kept(firmware)?;
    for case in faults::all() {
        add(faults::verdict(firmware, &running, scratch, &case)?);
    }
    add(link_noise::verdict(firmware, &running, scratch)?);
    add(settings_cut::verdict(firmware, scratch)?);
    Ok(verdicts)
}

/// The verdicts as a table.
#[must_use]
pub fn table(verdicts: &[Verdict]) -> String {
    let ms = |nanos: u64| format!("{:.2}", nanos as f64 * 1e-6);
    let mut text =
        format!("{:<38} {:>9} {:>9}  {}\n", "fault", "known ms", "safe ms", "what the firmware said");
    for verdict in verdicts {
        let safe = verdict.safe_ns.map_or_else(|| "never".to_owned(), ms);
        text += &format!("{:<38} {:>9} {safe:>9}  {}\n", verdict.name, ms(verdict.known_ns), verdict.said);
        for problem in &verdict.problems {
            text += &format!("    FAILED: {problem}\n");
        }
    }
    text
}
