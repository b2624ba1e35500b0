//! Results are written all or not at all.
//!
//! Files are kept in memory until everything is there, then written beside their places under `NAME.part`, and
//! moved into place. A failure before that leaves nothing behind, neither files nor folders; other files in the
//! folder are kept. What can fail is tried before the work is done: the folder can be made and written to.
//! A folder that holds results already is refused unless overwriting was allowed, as a recording cannot be made
//! again. Moving several files is not one step of the file system.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

use super::journal::{self, Unfinished};
use super::log::Log;
use crate::input_error::InputError;

/// What the commands write: a folder with one of these holds results.
const RESULTS: [&str; 15] = [
    "log.csv",
    "summary.json",
    "report.html",
    "curves.csv",
    "prediction.csv",
    "model.toml",
    "model-extended.toml",
    "diagnosis.json",
    "design.json",
    "experiment.toml",
    "next-experiment.toml",
    "capture.csv",
    "defmt.log",
    "commissioning.json",
    journal::NAME,
];

/// `--force` of this process.
static OVERWRITE: AtomicBool = AtomicBool::new(false);
/// What this process has written.
static WRITTEN: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// From now on results replace those of earlier runs.
pub fn allow_overwriting() {
    OVERWRITE.store(true, Ordering::Relaxed);
}

/// The files written since the last call.
pub fn take_written() -> Vec<PathBuf> {
    WRITTEN.lock().map_or_else(|_| Vec::new(), |mut written| std::mem::take(&mut *written))
}

/// Notes a file that stands for good.
pub fn note_written(path: PathBuf) {
    if let Ok(mut written) = WRITTEN.lock() {
        written.push(path);
    }
}

/// A folder of results that comes into being with [`OutputDir::finish`].
#[derive(Debug)]
pub struct OutputDir {
    target: PathBuf,
    /// Name of the main table where it is to be Parquet.
    parquet_name: Option<String>,
    /// Folders made on the way to the target, innermost last.
    made: Vec<PathBuf>,
    files: Vec<(String, Vec<u8>)>,
    overwrite: bool,
}

impl OutputDir {
    /// Prepares `--out`: a folder, or `X.parquet`, which names the log (or other main table) in its folder.
    ///
    /// Everything that can be known to fail fails here, before the work is done.
    pub fn new(out: &Path) -> Result<Self, InputError> {
        Self::prepare(out, OVERWRITE.load(Ordering::Relaxed))
    }

    /// The same for a folder whose results may be replaced at any time.
    pub fn replacing(out: &Path) -> Result<Self, InputError> {
        Self::prepare(out, true)
    }

    fn prepare(out: &Path, overwrite: bool) -> Result<Self, InputError> {
        let parquet = out.extension().is_some_and(|e| e.eq_ignore_ascii_case("parquet"));
        let (target, parquet_name) = match (parquet, out.file_name()) {
            (true, Some(name)) => {
                let parent = out.parent().filter(|parent| !parent.as_os_str().is_empty());
                (parent.unwrap_or(Path::new(".")).to_path_buf(), Some(name.to_string_lossy().into_owned()))
            }
            _ => (out.to_path_buf(), None),
        };
        if target.as_os_str().is_empty() {
            return Err(InputError::new("is empty").file("--out").allowed("a folder"));
        }
        if target.exists() && !target.is_dir() {
            return Err(
                InputError::in_file(&target, "is a file, not a folder").allowed("a folder for the results")
            );
        }
        let mut output = Self { target, parquet_name, made: Vec::new(), files: Vec::new(), overwrite };
        output.refuse_results()?;
        output.make_folders()?;
        // A file without a name: nothing is left of it, however this ends.
        tempfile::tempfile_in(&output.target)
            .map_err(|e| InputError::io(&output.target, "write into it", &e))?;
        Ok(output)
    }

    fn refuse_results(&self) -> Result<(), InputError> {
        if self.overwrite {
            return Ok(());
        }
        let names = RESULTS.into_iter().chain(self.parquet_name.as_deref());
        let there: Vec<&str> = names.filter(|name| self.target.join(name).exists()).collect();
        if there.is_empty() {
            return Ok(());
        }
        let what = match Unfinished::in_folder(&self.target) {
            Some(unfinished) => format!("holds {}", unfinished.sentence()),
            None => format!("holds results already: {}", there.join(", ")),
        };
        Err(InputError::in_file(&self.target, what).allowed("another folder, or --force to replace them"))
    }

    fn make_folders(&mut self) -> Result<(), InputError> {
        let missing: Vec<PathBuf> = self
            .target
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
            .map(Path::to_path_buf)
            .collect();
        for path in missing.into_iter().rev() {
            match fs::create_dir(&path) {
                Ok(()) => self.made.push(path),
                // Another process was quicker with a folder that both need: it is that one's.
                Err(e) if e.kind() == ErrorKind::AlreadyExists && path.is_dir() => (),
                Err(e) => return Err(InputError::io(&path, "make this folder", &e)),
            }
        }
        Ok(())
    }

    /// The folder in which the results will be.
    pub fn folder(&self) -> &Path {
        &self.target
    }

    /// Where the log will be.
    pub fn log_path(&self) -> PathBuf {
        self.target.join(self.parquet_name.as_deref().unwrap_or("log.csv"))
    }

    /// Adds a file.
    pub fn write(&mut self, name: &str, bytes: impl AsRef<[u8]>) -> Result<(), InputError> {
        let target = self.target.join(name);
        if target.is_dir() {
            return Err(InputError::in_file(&target, "is a folder where a file is to be written"));
        }
        if !self.overwrite && target.exists() {
            return Err(InputError::in_file(&target, "is there already")
                .allowed("another folder, or --force to replace it"));
        }
        self.files.retain(|(known, _)| known != name);
        self.files.push((name.into(), bytes.as_ref().to_vec()));
        Ok(())
    }

    /// Adds the log, as CSV or Parquet as `--out` says.
    pub fn write_log(&mut self, log: &Log) -> Result<(), InputError> {
        self.write_table("log.csv", log)
    }

    /// Adds the main table of a command: under this name as CSV, or as the Parquet file that `--out` names.
    pub fn write_table(&mut self, name: &str, table: &Log) -> Result<(), InputError> {
        match self.parquet_name.clone() {
            Some(parquet) => {
                let bytes = table.to_parquet().map_err(|e| e.file(parquet.as_str()))?;
                self.write(&parquet, bytes)
            }
            None => self.write(name, table.to_csv()),
        }
    }

    /// Adds a JSON file.
    pub fn write_json(&mut self, name: &str, value: &impl serde::Serialize) -> Result<(), InputError> {
        let mut text = serde_json::to_string_pretty(value)
            .map_err(|e| InputError::new(format!("cannot be written as JSON: {e}")).file(name))?;
        text.push('\n');
        self.write(name, text)
    }

    /// Puts everything into place.
    pub fn finish(mut self) -> Result<(), InputError> {
        let files = std::mem::take(&mut self.files);
        let part = |name: &str| self.target.join(format!("{name}.part"));
        for (at, (name, bytes)) in files.iter().enumerate() {
            if let Err(error) = fs::write(part(name), bytes) {
                for (name, _) in files.iter().take(at + 1) {
                    // What cannot be removed is not worth an error of its own.
                    let _ = fs::remove_file(part(name));
                }
                return Err(InputError::io(&self.target.join(name), "write", &error));
            }
        }
        for (name, _) in &files {
            let target = self.target.join(name);
            fs::rename(part(name), &target).map_err(|e| InputError::io(&target, "write", &e))?;
            note_written(target);
        }
        self.made.clear();
        Ok(())
    }
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        // Folders that hold something by now stay.
        for path in self.made.iter().rev() {
            let _ = fs::remove_dir(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn names(folder: &Path) -> Vec<String> {
        let entries =
            fs::read_dir(folder).unwrap().map(|e| e.unwrap().file_name().to_string_lossy().into_owned());
        let mut names: Vec<String> = entries.collect();
        names.sort();
        names
    }

    #[test]
    fn an_unfinished_output_leaves_no_trace() {
        let root = tempfile::tempdir().unwrap();
        let mut output = OutputDir::new(&root.path().join("a/b")).unwrap();
        output.write("x.json", "{}").unwrap();
        drop(output);
        assert!(names(root.path()).is_empty());
    }

    #[test]
    fn two_that_write_beside_each_other_do_not_mind_who_makes_the_folder() {
        for _ in 0..200 {
            let root = tempfile::tempdir().unwrap();
            let start = std::sync::Barrier::new(2);
            let make = &|name: &str| {
                let target = root.path().join("all").join(name);
                start.wait();
                let mut output = OutputDir::new(&target).unwrap();
                output.write("x.json", "{}").unwrap();
                output.finish().unwrap();
            };
            std::thread::scope(|scope| {
                ["a", "b"].map(|name| scope.spawn(move || make(name))).map(|thread| thread.join().unwrap())
            });
            assert_eq!(names(&root.path().join("all")), ["a", "b"]);
        }
    }

    #[test]
    fn results_are_replaced_by_permission_only_and_other_files_are_kept() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("summary.json"), "old").unwrap();
        fs::write(root.path().join("x.json"), "old").unwrap();
        fs::write(root.path().join("mine.txt"), "kept").unwrap();
        let error = OutputDir::prepare(root.path(), false).unwrap_err().to_string();
        assert!(error.contains("holds results already: summary.json; allowed: another folder"), "{error}");
        fs::remove_file(root.path().join("summary.json")).unwrap();
        let mut output = OutputDir::prepare(root.path(), false).unwrap();
        let error = output.write("x.json", "new").unwrap_err().to_string();
        assert!(error.contains("x.json: is there already"), "{error}");
        drop(output);
        let mut output = OutputDir::replacing(root.path()).unwrap();
        output.write("x.json", "new").unwrap();
        assert_eq!(fs::read_to_string(root.path().join("x.json")).unwrap(), "old");
        output.finish().unwrap();
        assert_eq!(fs::read_to_string(root.path().join("x.json")).unwrap(), "new");
        assert_eq!(names(root.path()), ["mine.txt", "x.json"]);
    }

    #[test]
    fn a_parquet_name_is_the_logs_and_its_folder_takes_the_rest() {
        let root = tempfile::tempdir().unwrap();
        let mut output = OutputDir::new(&root.path().join("d/run7.parquet")).unwrap();
        let mut log = Log::default();
        log.set_numbers("time_s", vec![0.0, 1.0]);
        output.write_log(&log).unwrap();
        output.write("summary.json", "{}").unwrap();
        output.finish().unwrap();
        assert_eq!(names(&root.path().join("d")), ["run7.parquet", "summary.json"]);
        assert_eq!(Log::read(&root.path().join("d/run7.parquet")).unwrap().len(), 2);
    }

    #[test]
    fn a_target_that_cannot_be_is_refused_before_any_work() {
        let root = tempfile::tempdir().unwrap();
        let file = root.path().join("file");
        fs::write(&file, "").unwrap();
        for path in [file.clone(), file.join("below")] {
            let error = OutputDir::new(&path).unwrap_err().to_string();
            assert!(error.contains("file"), "{error}");
        }
        assert_eq!(names(root.path()), ["file"]);
    }
}
