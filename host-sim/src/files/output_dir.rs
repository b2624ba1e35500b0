//! Results are written all or not at all.
//!
//! Files are collected in a hidden folder beside the wanted one, then moved into place when everything
//! is there. A failure before that leaves nothing behind, neither files nor folders. Files of the same
//! names from an earlier run are replaced, other files in the folder are kept. Moving several files is
//! not one step of the file system: what can fail there is tried before (the folder can be made and
//! written to, no target is a folder).

use std::fs;
use std::path::{Path, PathBuf};

use super::log::Log;
use crate::input_error::InputError;

/// A folder of results that comes into being with [`OutputDir::finish`].
#[derive(Debug)]
pub struct OutputDir {
    target: PathBuf,
    /// Name of the main table where it is to be Parquet.
    parquet_name: Option<String>,
    staging: Option<PathBuf>,
    /// Folders made on the way to the target, innermost last.
    made: Vec<PathBuf>,
    names: Vec<String>,
}

impl OutputDir {
    /// Prepares `--out`: a folder, or `X.parquet`, which names the log (or other main table) in its folder.
    ///
    /// Everything that can be known to fail fails here, before the work is done.
    pub fn new(out: &Path) -> Result<Self, InputError> {
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
        let mut output = Self { target, parquet_name, staging: None, made: Vec::new(), names: Vec::new() };
        output.make_folders()?;
        let staging = output.target.join(format!(".rig-{}", std::process::id()));
        fs::create_dir(&staging).map_err(|e| InputError::io(&output.target, "write into it", &e))?;
        output.staging = Some(staging);
        Ok(output)
    }

    fn make_folders(&mut self) -> Result<(), InputError> {
        let missing: Vec<PathBuf> = self
            .target
            .ancestors()
            .take_while(|path| !path.as_os_str().is_empty() && !path.exists())
            .map(Path::to_path_buf)
            .collect();
        for path in missing.into_iter().rev() {
            fs::create_dir(&path).map_err(|e| InputError::io(&path, "make this folder", &e))?;
            self.made.push(path);
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
        let Some(staging) = &self.staging else {
            return Err(InputError::new("results are already in place"));
        };
        fs::write(staging.join(name), bytes).map_err(|e| InputError::io(&target, "write", &e))?;
        if !self.names.iter().any(|known| known == name) {
            self.names.push(name.into());
        }
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

    /// Moves everything into place.
    pub fn finish(mut self) -> Result<(), InputError> {
        let Some(staging) = self.staging.clone() else { return Ok(()) };
        for name in &self.names {
            let target = self.target.join(name);
            fs::rename(staging.join(name), &target).map_err(|e| InputError::io(&target, "write", &e))?;
        }
        self.made.clear();
        Ok(())
    }
}

impl Drop for OutputDir {
    fn drop(&mut self) {
        // Tidying up: what cannot be removed is not worth an error of its own.
        if let Some(staging) = &self.staging {
            let _ = fs::remove_dir_all(staging);
        }
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
    fn a_finished_output_replaces_its_files_and_keeps_others() {
        let root = tempfile::tempdir().unwrap();
        fs::write(root.path().join("x.json"), "old").unwrap();
        fs::write(root.path().join("mine.txt"), "kept").unwrap();
        let mut output = OutputDir::new(root.path()).unwrap();
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
