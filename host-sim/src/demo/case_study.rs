//! The hidden effect, end to end: a model without the rubber block is given the logs of Figs. 18–21.
//!
//! The logs are those of the runs above, as the host tool would have recorded them at 1 kHz. The diagnosis is told
//! a LuGre model and the rig file, not what is on the disc. Figs. 18, 20 and 21 are fitted, Fig. 19 is held out.
//! It is no proof of the diagnosis, since rubber and hypothesis share the core's law: that is what the tests
//! with independent generators are for.

use super::runs::Runs;
use crate::files::log::Log;
use crate::files::model_file::{ModelFile, ModelKind};
use crate::files::rig_file::RigFile;
use crate::identify::command::{Written, diagnose};
use crate::identify::results::Diagnosis;
use crate::input_error::InputError;
use crate::report::Block;
use crate::report::value::with_uncertainty;

/// Ticks from one logged sample to the next.
const EVERY: usize = 10;
/// The run that nothing is fitted to.
const HELD_OUT: &str = "fig19";

/// What the diagnosis found.
#[derive(Debug, Clone)]
pub struct CaseStudy {
    /// The diagnosis, as in `diagnosis.json`.
    pub diagnosis: Diagnosis,
    /// Its page, for this one.
    pub blocks: Vec<Block>,
}

impl CaseStudy {
    /// Diagnoses the runs of Figs. 18–21.
    ///
    /// # Errors
    /// What the diagnosis refuses.
    pub fn new(runs: &Runs) -> Result<Self, InputError> {
        let rig = RigFile::assumed_rig(&[])?;
        let baseline = baseline()?;
        let steps = runs.closed_loop.iter().take(runs.comparisons.len());
        let logs = steps.map(|run| {
            let mut log = run.recording.log(EVERY, rig.counts_per_rev());
            log.source.clone_from(&run.name);
            (run.name.as_str(), log)
        });
        let (holdout, train): (Vec<_>, Vec<_>) = logs.partition(|(name, _)| *name == HELD_OUT);
        let only = |logs: Vec<(&str, Log)>| logs.into_iter().map(|(_, log)| log).collect::<Vec<_>>();
        let (train, holdout): (Vec<Log>, Vec<Log>) = (only(train), only(holdout));
        let Written { diagnosis, page, .. } = diagnose(&train, &holdout, &rig, &baseline, &|| 0.0, &|_| ())?;
        let lead = format!(
            "The logs of Figs. 18–21 (1 kHz; Fig. 19 held out) are given to rig diagnose with a LuGre model. {}",
            diagnosis.sentence
        );
        let mut blocks =
            vec![Block::Heading("What a model without the block gets wrong".into()), Block::Text(lead)];
        // One heading is enough here, and of the subsystems only what the table says.
        blocks.extend(
            page.blocks.into_iter().filter(|block| matches!(block, Block::List(_) | Block::Chart(_))),
        );
        Ok(Self { diagnosis, blocks })
    }

    /// What is printed.
    #[must_use]
    pub fn found(&self) -> String {
        let names: Vec<&str> = self.diagnosis.causes.iter().map(|cause| cause.id.as_str()).collect();
        let name = if names.is_empty() { self.diagnosis.verdict.to_string() } else { names.join(", ") };
        let percent = |x: Option<f64>| x.map_or("–".into(), |x| format!("{:.2} %", 100.0 * x));
        format!(
            "{name}; held-out error {} → {}, noise alone {}",
            percent(self.diagnosis.baseline.holdout_nrmse),
            percent(self.diagnosis.extended.holdout_nrmse),
            percent(self.diagnosis.extended.noise_floor_nrmse)
        )
    }

    /// Parameters of the causes as found, and as they are on the disc.
    ///
    /// # Errors
    /// The assumed model is damaged.
    pub fn parameters(&self) -> Result<String, InputError> {
        let rubber = ModelFile::assumed(&[])?;
        let found = self.diagnosis.causes.iter().flat_map(|cause| &cause.parameters);
        let words = found.filter_map(|(name, parameter)| {
            let (_, truth) = rubber.parameters().find(|(own, _)| own == name)?;
            let off = 100.0 * (parameter.value / truth - 1.0);
            let value = with_uncertainty(parameter.value, parameter.std.unwrap_or_default());
            Some(format!("{name} {value} for {truth} ({off:+.0} %)"))
        });
        Ok(words.collect::<Vec<_>>().join(", "))
    }
}

/// The assumed rubber's bristles without its block.
fn baseline() -> Result<ModelFile, InputError> {
    let rubber = ModelFile::assumed(&[])?;
    let kept: Vec<(&'static str, f64)> = rubber
        .parameters()
        .filter(|(name, _)| ModelKind::Lugre.parameters().iter().any(|p| p.name == *name))
        .collect();
    ModelFile::new("LuGre", ModelKind::Lugre, &kept)
}
