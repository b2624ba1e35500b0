//! The runs of a campaign on disk, each as soon as it is done: a campaign that was ended goes on where it stood.
//!
//! One line of JSON a run. The first line says which campaign it is: the plan, the firmware, and this program, as another one
//! may judge otherwise. A line that was cut short by the end of the process is forgotten, and its run made again.

use super::{Done, Plan, Run};
use crate::elf::Firmware;
use crate::error::BenchError;
use host_sim::input_error::InputError;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::collections::BTreeMap;
use std::fs::{self, File, OpenOptions};
use std::io::{Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// Name of the file in the folder of the results.
pub const NAME: &str = "faults.jsonl";

/// Which campaign the runs belong to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Campaign {
    /// What is run, but for how many at a time, which changes nothing.
    plan: Plan,
    elf_sha256: String,
    bench_sha256: String,
}

impl Campaign {
    /// This plan with this firmware, run by this program.
    ///
    /// # Errors
    /// The program cannot read itself.
    pub fn new(plan: &Plan, firmware: &Firmware) -> Result<Self, BenchError> {
        let itself = std::env::current_exe().and_then(fs::read);
        let itself = itself.map_err(|error| BenchError::Emulator(format!("its own program: {error}")))?;
        let bench_sha256 = Sha256::digest(&itself).iter().map(|byte| format!("{byte:02x}")).collect();
        let plan = Plan { at_once: 1, ..plan.clone() };
        Ok(Self { plan, elf_sha256: firmware.sha256.clone(), bench_sha256 })
    }
}

// Not flattened: that goes wrong on numbers where any package of the build asks serde_json for arbitrary precision.
#[derive(Serialize)]
struct Line<'a> {
    nth: usize,
    run: &'a Run,
}

#[derive(Deserialize)]
struct ReadLine {
    nth: usize,
    run: Run,
}

/// The file, open.
#[derive(Debug)]
pub struct Kept {
    path: PathBuf,
    file: File,
}

impl Kept {
    /// Opens the file of this campaign in `folder`, and gives the runs that are in it. With `anew` it begins from nothing.
    ///
    /// # Errors
    /// The file belongs to another campaign, or cannot be read or written.
    pub fn open(
        folder: &Path,
        campaign: &Campaign,
        anew: bool,
    ) -> Result<(Self, BTreeMap<usize, Run>), InputError> {
        let path = folder.join(NAME);
        let mut kept = String::new();
        if path.exists() && !anew {
            kept = fs::read_to_string(&path).map_err(|error| InputError::io(&path, "read", &error))?;
        }
        let mut runs = BTreeMap::new();
        let mut whole = 0;
        for line in kept.split_inclusive('\n').filter(|line| line.ends_with('\n')) {
            if whole == 0 {
                if serde_json::from_str::<Campaign>(line).ok().as_ref() != Some(campaign) {
                    return Err(InputError::in_file(
                        &path,
                        "has the runs of another campaign: its seed, faults, firmware or bench differ",
                    )
                    .allowed("another folder, or --force to begin anew"));
                }
            } else {
                let Ok(ReadLine { nth, run }) = serde_json::from_str(line) else { break };
                runs.insert(nth, run);
            }
            whole += line.len();
        }
        let wrong = |error: std::io::Error| InputError::io(&path, "write", &error);
        let mut file =
            OpenOptions::new().write(true).create(true).truncate(false).open(&path).map_err(wrong)?;
        file.set_len(whole as u64).map_err(wrong)?;
        file.seek(SeekFrom::End(0)).map_err(wrong)?;
        let mut kept = Self { path: path.clone(), file };
        if whole == 0 {
            kept.line(campaign)?;
        }
        Ok((kept, runs))
    }

    /// Adds a run.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, Done { nth, run }: &Done<'_>) -> Result<(), InputError> {
        self.line(&Line { nth: *nth, run })
    }

    fn line(&mut self, what: &impl Serialize) -> Result<(), InputError> {
        let mut line = serde_json::to_vec(what).map_err(|error| {
            InputError::in_file(&self.path, format!("cannot be written as JSON: {error}"))
        })?;
        line.push(b'\n');
        // One write a line: what ends the process leaves at most the last line cut short.
        self.file.write_all(&line).map_err(|error| InputError::io(&self.path, "write", &error))
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::Row;
    use super::super::states::State;
    use super::*;

    fn campaign(seed: u64) -> Campaign {
        let plan = Plan { seed, ..Plan::whole() };
        Campaign { plan, elf_sha256: "ab".to_owned(), bench_sha256: "cd".to_owned() }
    }

    fn run(fault: &str) -> Run {
        let row = Row { safe_ns: Some(7), torque_nm: [0.25, 0.375], ..Row::default() };
        Run { fault: fault.to_owned(), state: State::Sliding, at_ns: 5, row }
    }

    #[test]
    fn a_campaign_that_was_ended_goes_on_after_its_last_whole_line() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(NAME);
        let (mut kept, none) = Kept::open(folder.path(), &campaign(1), false).unwrap();
        assert!(none.is_empty());
        for (nth, fault) in [(4, "first"), (2, "second")] {
            kept.add(&Done { nth, run: &run(fault) }).unwrap();
        }
        drop(kept);
        let whole = fs::read_to_string(&path).unwrap();
        fs::write(&path, format!("{whole}{{\"nth\":9,\"fau")).unwrap();
        let (mut kept, runs) = Kept::open(folder.path(), &campaign(1), false).unwrap();
        assert_eq!(runs, BTreeMap::from([(2, run("second")), (4, run("first"))]));
        kept.add(&Done { nth: 9, run: &run("third") }).unwrap();
        drop(kept);
        let (_, runs) = Kept::open(folder.path(), &campaign(1), false).unwrap();
        assert_eq!(runs.keys().copied().collect::<Vec<_>>(), [2, 4, 9]);
    }

    #[test]
    fn runs_of_another_campaign_are_neither_taken_nor_lost() {
        let folder = tempfile::tempdir().unwrap();
        let (mut kept, _) = Kept::open(folder.path(), &campaign(1), false).unwrap();
        kept.add(&Done { nth: 0, run: &run("first") }).unwrap();
        drop(kept);
        let error = Kept::open(folder.path(), &campaign(2), false).unwrap_err().to_string();
        assert!(error.contains("another campaign") && error.contains("--force"), "{error}");
        assert_eq!(Kept::open(folder.path(), &campaign(1), false).unwrap().1.len(), 1);
        assert!(Kept::open(folder.path(), &campaign(2), true).unwrap().1.is_empty());
    }
}
