//! The experiment that tells models apart that a tournament cannot.
//!
//! Two models look alike where one, fitted to the other's logs, predicts the logs held out within the noise. Of the experiments
//! of `rig design` the one is sought on which they differ most, the rival with the numbers that were fitted.

use rayon::prelude::*;

use super::candidates::Candidate;
use super::tournament::{Match, Tournament};
use crate::design::{Effort, propose};
use crate::files::rig_file::RigFile;
use crate::input_error::InputError;
use crate::studies::bristle_damping::file;

/// Two models that look alike, and what separates them.
#[derive(Debug, Clone, PartialEq)]
pub struct Separation {
    /// Place of the model that plays the rubber.
    pub truth: usize,
    /// Place of the rival that looks like it.
    pub rival: usize,
    /// RMS of what the rival misses on the best experiment, over the noise of a sample.
    pub separation: f64,
    /// The experiment in words.
    pub experiment: String,
    /// Its file.
    pub toml: String,
}

impl Separation {
    /// Whether an experiment can tell them apart: the rival misses by more than the noise of a sample.
    #[must_use]
    pub fn is_possible(&self) -> bool {
        self.separation > 1.0
    }
}

/// Every pair that looks alike, with the best experiment to tell it apart. Where both look like the other, the worse fit counts.
///
/// # Errors
/// A model that the rig cannot run.
pub fn separate(
    candidates: &[Candidate],
    tournament: &Tournament,
    noise: f64,
    progress: impl Fn(usize, usize) + Sync,
) -> Result<Vec<Separation>, InputError> {
    let rig = RigFile::assumed_rig(&[])?;
    let alike = |m: &&Match| m.truth != m.fitted && m.held_out() < noise;
    let first = |m: &&Match| {
        let other = tournament.of(m.fitted, m.truth).filter(alike);
        other.is_none_or(|other| (m.held_out(), m.truth) > (other.held_out(), other.truth))
    };
    let pairs: Vec<&Match> = tournament.matches.iter().filter(alike).filter(first).collect();
    let done = std::sync::atomic::AtomicUsize::new(0);
    let one = |m: &&Match| {
        let models = [file(&candidates[m.truth].typical)?, file(&m.parameters)?];
        let proposals = propose(&rig, &models, Effort::BRIEF, |_, _| ())?;
        progress(done.fetch_add(1, std::sync::atomic::Ordering::Relaxed) + 1, pairs.len());
        let best = proposals.into_iter().next();
        let best = best.ok_or_else(|| InputError::new("no experiment runs without a fault"))?;
        let setting = &best.setting;
        Ok(Separation {
            truth: m.truth,
            rival: m.fitted,
            separation: best.separation(),
            experiment: format!(
                "{} at up to {:.0} rpm and {:.0} N",
                setting.family.words(),
                setting.speed_rpm,
                setting.load_n
            ),
            toml: best.toml,
        })
    };
    pairs.par_iter().map(one).collect()
}
