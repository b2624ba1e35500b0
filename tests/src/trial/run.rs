//! Makes a case, has it diagnosed by the command, judges the answer; many at a time.

use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

use crate::generate::generate;
use crate::scenario::{CasePaths, Form, Scenario};
use crate::trial::progress::Progress;
use crate::trial::record::{Answered, Record};
use crate::trial::{Answer, Kind};

/// How cases are run.
#[derive(Debug, Clone)]
pub struct Runner {
    /// The tool under trial.
    pub rig: PathBuf,
    /// Where cases are written.
    pub folder: PathBuf,
    /// Whether they stay there.
    pub keep: bool,
    /// Cases at a time.
    pub jobs: usize,
}

impl Runner {
    /// The tool under trial: `RIG_BIN`, or the one built beside this program.
    ///
    /// # Errors
    /// Where there is none.
    pub fn command() -> Result<PathBuf, String> {
        if let Some(path) = std::env::var_os("RIG_BIN") {
            return Ok(PathBuf::from(path));
        }
        let own = std::env::current_exe().map_err(|e| e.to_string())?;
        let beside = own.with_file_name(format!("rig{}", std::env::consts::EXE_SUFFIX));
        if beside.exists() { Ok(beside) } else { Err("the tool is not built: use cargo rig trials".into()) }
    }

    /// A command of the tool, with its share of the cores where several run at a time.
    #[must_use]
    pub fn tool(&self, subcommand: &str) -> Command {
        let mut command = Command::new(&self.rig);
        // A second run with --keep replaces what the first one kept.
        command.arg(subcommand).arg("--force").stdout(Stdio::null());
        if self.jobs > 1 {
            let cores = std::thread::available_parallelism().map_or(1, usize::from);
            command.env("RAYON_NUM_THREADS", (cores / self.jobs).max(1).to_string());
        }
        command
    }

    /// Runs the work for each item, some at a time, and gives the results in the items' order. `tell` makes a
    /// line of a result.
    pub fn each<T: Sync, R: Send>(
        &self,
        items: &[T],
        work: impl Fn(&T) -> R + Sync,
        tell: impl Fn(&R) -> String + Sync,
    ) -> Vec<R> {
        let next = AtomicUsize::new(0);
        let results: Mutex<Vec<(usize, R)>> = Mutex::new(Vec::new());
        let progress = Mutex::new(Progress::new(items.len()));
        std::thread::scope(|scope| {
            for _ in 0..self.jobs.clamp(1, items.len().max(1)) {
                scope.spawn(|| {
                    loop {
                        let place = next.fetch_add(1, Ordering::Relaxed);
                        let Some(item) = items.get(place) else { break };
                        let result = work(item);
                        progress.lock().unwrap_or_else(PoisonError::into_inner).line(&tell(&result));
                        results.lock().unwrap_or_else(PoisonError::into_inner).push((place, result));
                    }
                });
            }
        });
        let mut results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
        results.sort_by_key(|(place, _)| *place);
        results.into_iter().map(|(_, result)| result).collect()
    }

    /// Runs a case: the `case`-th of `of`.
    #[must_use]
    pub fn case(&self, campaign: &str, case: usize, of: usize, scenario: &Scenario) -> Record {
        let effects = &scenario.effects;
        let mut record = Record {
            campaign: campaign.into(),
            case,
            of,
            kind: Kind::of(effects),
            hidden: effects.iter().map(|effect| effect.id().to_string()).collect(),
            seed: scenario.seed,
            laws: Default::default(),
            sizes: Default::default(),
            stick_slip: None,
            duration_s: scenario.duration_s,
            answer: None,
            failure: None,
            wall_s: 0.0,
        };
        let here = self.folder.join(record.name());
        match self.answer(scenario, &here, &mut record) {
            Ok(answer) => record.answer = Some(answer),
            Err(why) => record.failure = Some(why),
        }
        if !self.keep {
            // Where it cannot be removed it only takes room.
            let _ = std::fs::remove_dir_all(&here);
        }
        record
    }

    fn answer(&self, scenario: &Scenario, here: &Path, record: &mut Record) -> Result<Answered, String> {
        let case = generate(scenario).map_err(|e| e.to_string())?;
        let truth = &case.truth;
        record.laws = truth.law_names.clone();
        record.sizes =
            scenario.effects.iter().map(|effect| (effect.id().to_string(), truth.size(*effect))).collect();
        record.stick_slip = (scenario.form == Form::Contact).then_some(truth.stick_slip);
        record.duration_s = truth.duration_s;
        let failed = |e: std::io::Error| format!("{}: {e}", here.display());
        let paths = case.write(here).map_err(failed)?;
        if self.keep {
            let text = truth.to_json().map_err(|e| e.to_string())?;
            std::fs::write(here.join("truth.json"), text).map_err(failed)?;
        }
        let started = Instant::now();
        let text = self.diagnose(&paths, &here.join("out"));
        record.wall_s = started.elapsed().as_secs_f64();
        let answer = Answer::parse(&text?).map_err(|e| format!("diagnosis.json: {e}"))?;
        Ok(Answered::new(&answer, &scenario.effects, truth))
    }

    fn diagnose(&self, paths: &CasePaths, out: &Path) -> Result<String, String> {
        let mut command = self.tool("diagnose");
        command.arg("--train").args(&paths.train).arg("--holdout").arg(&paths.holdout).arg("--out").arg(out);
        // A drive's rig file is not needed; the linear stage has none.
        if let (Some(rig), Some(model)) = (&paths.rig, &paths.model) {
            command.arg("--rig").arg(rig).arg("--model").arg(model);
        }
        let run = command.output().map_err(|e| format!("{}: {e}", self.rig.display()))?;
        if !run.status.success() {
            return Err(String::from_utf8_lossy(&run.stderr).trim().to_string());
        }
        let file = out.join("diagnosis.json");
        std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))
    }
}
