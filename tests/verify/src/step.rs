//! One step: the command as it is run, how it ended, how long it took.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, ExitStatus, Stdio};
use std::time::Instant;

/// How a step ended.
pub(crate) enum Ended {
    /// It held; with what there is to say.
    Passed(String),
    /// It did not.
    Failed(String),
    /// It could not be run, and without it the result stands for less.
    Lacking(String),
    /// It could not be run here, and nothing else depends on it.
    Skipped(String),
}

struct Step {
    name: String,
    ended: Ended,
    seconds: f64,
}

/// Runs the steps from the workspace's root and keeps what became of them.
pub(crate) struct Runner {
    root: PathBuf,
    cargo: String,
    steps: Vec<Step>,
    /// Where what it runs is written, in place of the terminal.
    log: Option<(PathBuf, File)>,
}

impl Runner {
    pub(crate) fn new(root: &Path) -> Self {
        let cargo = std::env::var("CARGO").unwrap_or_else(|_| "cargo".into());
        Self { root: root.to_path_buf(), cargo, steps: Vec::new(), log: None }
    }

    /// One that runs beside another one: what it prints goes to this file of the workspace until that one is done.
    pub(crate) fn beside(root: &Path, log: &Path) -> io::Result<Self> {
        let path = root.join(log);
        std::fs::create_dir_all(path.parent().unwrap_or(root))?;
        let log = File::create(&path)?;
        Ok(Self { log: Some((path, log)), ..Self::new(root) })
    }

    /// Takes over the steps of one that ran beside this one, and shows what it has printed.
    pub(crate) fn join(&mut self, other: Self) {
        if let Some((path, _)) = &other.log {
            let shown = File::open(path).and_then(|mut log| io::copy(&mut log, &mut io::stdout()));
            if let Err(error) = shown {
                // How its steps ended is known all the same.
                println!("verify: {}: {error}", path.display());
            }
        }
        self.steps.extend(other.steps);
    }

    /// A line of what this runner does.
    fn say(&mut self, line: &str) {
        let said = match &mut self.log {
            Some((_, log)) => writeln!(log, "{line}"),
            None => writeln!(io::stdout(), "{line}"),
        };
        if let Err(error) = said {
            eprintln!("verify: {error}: {line}");
        }
    }

    /// Runs a command whose output goes where this runner's does.
    fn ended(&self, command: &mut Command) -> io::Result<ExitStatus> {
        if let Some((_, log)) = &self.log {
            command.stdout(log.try_clone()?).stderr(log.try_clone()?);
        }
        command.status()
    }

    /// Runs cargo in a folder of the workspace, printed first.
    pub(crate) fn cargo(&mut self, name: &str, folder: &str, arguments: &[&str]) {
        self.cargo_env(name, folder, arguments, &[]);
    }

    /// As [`Self::cargo`], with variables set.
    pub(crate) fn cargo_env(&mut self, name: &str, folder: &str, arguments: &[&str], set: &[(&str, &str)]) {
        let place = if folder == "." { String::new() } else { format!("cd {folder} && ") };
        let variables: String = set.iter().map(|(key, value)| format!("{key}='{value}' ")).collect();
        self.say(&format!("\n$ {place}{variables}cargo {}", arguments.join(" ")));
        let started = Instant::now();
        let mut command = self.command(arguments);
        command.current_dir(self.root.join(folder)).envs(set.iter().copied());
        let ended = match self.ended(&mut command) {
            Ok(status) if status.success() => Ended::Passed(String::new()),
            Ok(status) => Ended::Failed(format!("{status}")),
            Err(error) => Ended::Failed(error.to_string()),
        };
        self.steps.push(Step { name: name.into(), ended, seconds: started.elapsed().as_secs_f64() });
    }

    /// cargo without the variables that this process was itself started with by cargo.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.cargo);
        command.args(arguments).current_dir(&self.root).stdin(Stdio::null());
        for (key, _) in std::env::vars_os() {
            if key.to_str().is_some_and(|key| key.starts_with("CARGO_PKG_") || key == "CARGO_MANIFEST_DIR") {
                command.env_remove(key);
            }
        }
        command
    }

    /// Whether a cargo command succeeds, without showing anything.
    pub(crate) fn quietly(&self, arguments: &[&str]) -> bool {
        let status = self.command(arguments).stdout(Stdio::null()).stderr(Stdio::null()).status();
        status.is_ok_and(|status| status.success())
    }

    /// Whether a cargo subcommand is there.
    pub(crate) fn has(&self, arguments: &[&str]) -> bool {
        self.quietly(arguments)
    }

    /// Whether the compiler has a target's core library; asks rustup for it where it has not.
    pub(crate) fn target(&mut self, target: &str) -> bool {
        let here = || {
            let libraries =
                Command::new("rustc").args(["--print", "target-libdir", "--target", target]).output();
            libraries.is_ok_and(|out| Path::new(String::from_utf8_lossy(&out.stdout).trim()).is_dir())
        };
        if !here() {
            self.say(&format!("\n$ rustup target add {target}"));
            let asked = self.ended(Command::new("rustup").args(["target", "add", target]));
            if let Err(error) = asked {
                self.say(&format!("rustup: {error}"));
            }
        }
        here()
    }

    /// Records a step that is not a command.
    pub(crate) fn note(&mut self, name: &str, ended: Ended) {
        self.steps.push(Step { name: name.into(), ended, seconds: 0.0 });
    }

    /// Prints the table; fails unless every step held.
    pub(crate) fn summary(&self) -> ExitCode {
        println!("\n{:<26} {:<8} {:>7}", "step", "result", "time");
        let mut held = true;
        for step in &self.steps {
            let (word, text) = match &step.ended {
                Ended::Passed(text) => ("ok", text),
                Ended::Failed(text) => ("FAILED", text),
                Ended::Lacking(text) => ("LACKING", text),
                Ended::Skipped(text) => ("skipped", text),
            };
            held &= matches!(step.ended, Ended::Passed(_) | Ended::Skipped(_));
            println!("{:<26} {word:<8} {:>5.0} s  {text}", step.name, step.seconds);
        }
        if held { ExitCode::SUCCESS } else { ExitCode::FAILURE }
    }
}
