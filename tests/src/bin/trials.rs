//! Hides effects in logs, has them diagnosed, prints who was named: the confusion table.
//!
//! The diagnosis is the command `rig diagnose`, run on files; this program knows the answer, that one does not.

use std::path::{Path, PathBuf};
use std::process::{Command, ExitCode, Stdio};
use std::time::Instant;

use clap::Parser;
use rig_tests::trial::{Answer, Confusion};
use rig_tests::{Base, Effect, Form, Scenario, generate};

/// Hide effects in logs, diagnose them, print the confusion table
#[derive(Parser)]
#[command(
    name = "rig trials",
    after_long_help = "\
Examples:
  rig trials --seeds 2
  rig trials --seeds 5 --effects thermal_fade wear_drift
  rig trials --effects thermal_fade+m2_ripple
  rig trials --seeds 3 --singles --noise 3

Without --singles, --effects, --pairs, --outside and --none all of them are tried."
)]
struct Arguments {
    /// Seeds for each effect
    #[arg(long, default_value_t = 2)]
    seeds: u64,
    /// First seed
    #[arg(long, default_value_t = 1)]
    first_seed: u64,
    /// Each effect that can be named, alone
    #[arg(long)]
    singles: bool,
    /// Only these effects; some at once are joined by +, as thermal_fade+m2_ripple
    #[arg(long, value_name = "ID", num_args = 1..)]
    effects: Vec<String>,
    /// Two effects at once: so many random pairs for each seed
    #[arg(long, value_name = "COUNT", num_args = 0..=1, default_missing_value = "10")]
    pairs: Option<u64>,
    /// Effects that are not in the library
    #[arg(long)]
    outside: bool,
    /// No effect: so many logs for each seed
    #[arg(long, value_name = "COUNT", num_args = 0..=1, default_missing_value = "1")]
    none: Option<u64>,
    /// Rate of the logs
    #[arg(long, default_value_t = 1000.0)]
    rate_hz: f64,
    /// Factor on the noise of all sensors
    #[arg(long, default_value_t = 1.0)]
    noise: f64,
    /// What is logged
    #[arg(long, value_enum, default_value_t = Form::Contact)]
    form: Form,
    /// Friction model behind the logs
    #[arg(long, value_enum, default_value_t = Base::BySeed)]
    base: Base,
    /// Keep the cases and the results in this folder
    #[arg(long, value_name = "DIR")]
    keep: Option<PathBuf>,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("rig: {message}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let rig = rig_command()?;
    let folder = arguments
        .keep
        .clone()
        .unwrap_or_else(|| std::env::temp_dir().join(format!("rig-trials-{}", std::process::id())));
    let cases = cases(arguments)?;
    let mut confusion = Confusion::default();
    for (done, (effects, seed)) in cases.iter().enumerate() {
        let names: Vec<&str> = effects.iter().map(|effect| effect.id()).collect();
        let name = format!("{}-{seed}", if names.is_empty() { "none".into() } else { names.join("+") });
        let here = folder.join(&name);
        let started = Instant::now();
        let answer = trial(arguments, &rig, effects, *seed, &here);
        let wall_s = started.elapsed().as_secs_f64();
        if let Err(why) = &answer {
            eprintln!("{name}: {why}");
        }
        let answer = answer.ok();
        let right = answer.as_ref().is_some_and(|answer| answer.is_right(effects));
        let words = answer.as_ref().map_or("no answer".into(), Answer::words);
        eprintln!(
            "{:>4}/{} {} {name}: {words} ({wall_s:.0} s)",
            done + 1,
            cases.len(),
            if right { "right" } else { "WRONG" }
        );
        confusion.add(effects, answer.as_ref(), wall_s);
        if arguments.keep.is_none() {
            std::fs::remove_dir_all(&here).map_err(|e| format!("{}: {e}", here.display()))?;
        }
    }
    if arguments.keep.is_none() {
        // It is empty; where it is not, somebody else's files stay.
        let _ = std::fs::remove_dir(&folder);
    }
    print!("{}", confusion.table());
    Ok(())
}

/// The tool under trial: `RIG_BIN`, or the one built beside this program.
fn rig_command() -> Result<PathBuf, String> {
    if let Some(path) = std::env::var_os("RIG_BIN") {
        return Ok(PathBuf::from(path));
    }
    let own = std::env::current_exe().map_err(|e| e.to_string())?;
    let beside = own.with_file_name(format!("rig{}", std::env::consts::EXE_SUFFIX));
    if beside.exists() { Ok(beside) } else { Err("the tool is not built: use cargo rig trials".into()) }
}

fn cases(arguments: &Arguments) -> Result<Vec<(Vec<Effect>, u64)>, String> {
    let all = !arguments.singles
        && arguments.effects.is_empty()
        && arguments.pairs.is_none()
        && !arguments.outside
        && arguments.none.is_none();
    let fits = |effect: &Effect| matches!(arguments.form, Form::Contact) || effect.works_without_contact();
    let mut hidden: Vec<Vec<Effect>> = Vec::new();
    if all || arguments.singles {
        hidden.extend(Effect::known().into_iter().filter(fits).map(|effect| vec![effect]));
    }
    for ids in &arguments.effects {
        let known = |id: &str| {
            Effect::from_id(id).ok_or_else(|| {
                let ids: Vec<&str> = Effect::ALL.iter().map(|e| e.id()).collect();
                format!("--effects: {id}: unknown; allowed, alone or joined by +: {}", ids.join(", "))
            })
        };
        hidden.push(ids.split('+').map(known).collect::<Result<_, _>>()?);
    }
    if all || arguments.outside {
        hidden.extend(Effect::outside().into_iter().filter(fits).map(|effect| vec![effect]));
    }
    let seeds = arguments.first_seed..arguments.first_seed + arguments.seeds;
    let mut cases: Vec<(Vec<Effect>, u64)> = Vec::new();
    for seed in seeds {
        cases.extend(hidden.iter().map(|effects| (effects.clone(), seed)));
        for i in 0..arguments.pairs.unwrap_or(if all { 10 } else { 0 }) {
            let pair = Effect::random_pair(1000 * seed + i);
            if pair.iter().all(fits) {
                cases.push((pair.to_vec(), 1000 * seed + i));
            }
        }
        for i in 0..arguments.none.unwrap_or(u64::from(all)) {
            cases.push((Vec::new(), 1000 * i + seed));
        }
    }
    Ok(cases)
}

fn trial(
    arguments: &Arguments,
    rig: &Path,
    effects: &[Effect],
    seed: u64,
    folder: &Path,
) -> Result<Answer, String> {
    let scenario = Scenario {
        rate_hz: arguments.rate_hz,
        noise_factor: arguments.noise,
        base: arguments.base,
        form: arguments.form,
        ..Scenario::new(effects, seed)
    };
    let case = generate(&scenario).map_err(|e| e.to_string())?;
    let failed = |e: std::io::Error| format!("{}: {e}", folder.display());
    let paths = case.write(folder).map_err(failed)?;
    if arguments.keep.is_some() {
        let truth = case.truth.to_json().map_err(|e| e.to_string())?;
        std::fs::write(folder.join("truth.json"), truth).map_err(failed)?;
    }
    let out = folder.join("out");
    let mut command = Command::new(rig);
    command.arg("diagnose").arg("--train").args(&paths.train).arg("--holdout").arg(&paths.holdout);
    command.arg("--out").arg(&out);
    // A drive's rig file is not needed; the linear stage has none.
    if let (Some(rig), Some(model)) = (&paths.rig, &paths.model) {
        command.arg("--rig").arg(rig).arg("--model").arg(model);
    }
    let run = command.stdout(Stdio::null()).output().map_err(|e| format!("{}: {e}", rig.display()))?;
    if !run.status.success() {
        return Err(String::from_utf8_lossy(&run.stderr).trim().to_string());
    }
    let text = std::fs::read_to_string(out.join("diagnosis.json")).map_err(failed)?;
    Answer::parse(&text).map_err(|e| e.to_string())
}
