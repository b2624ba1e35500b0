//! Hides effects in logs, has them diagnosed, prints who was named with exact intervals.
//!
//! The diagnosis is the command `rig diagnose`, run on files; this program knows the answer, that one does not.

use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use clap::Parser;
use rig_tests::trial::campaign::{Commit, Shard, Wanted};
use rig_tests::trial::record::Record;
use rig_tests::trial::run::Runner;
use rig_tests::trial::{coverage, table};
use rig_tests::{Base, Effect, Form, Imperfection, LawFamily, Plan, Scenario};

/// Hide effects in logs, diagnose them, print how often the answer is right
#[derive(Parser)]
#[command(
    name = "rig trials",
    after_long_help = "\
Examples:
  rig trials --rounds 2 --jobs 2
  rig trials --rounds 5 --effects thermal_fade wear_drift
  rig trials --effects thermal_fade+m2_ripple --exact-seed 180012 --keep DIR
  rig trials --rounds 4 --laws reserved --seeds-from-commit        a table to publish
  rig trials --rounds 4 --case 3/20 --json-lines shard3.jsonl      one of 20 shards
  rig trials --collect shard*.jsonl                                their table
  rig trials --fit-coverage 200                                    intervals of rig fit

Without --singles, --effects, --pairs, --outside and --none all of them are tried."
)]
struct Arguments {
    /// Rounds: so many cases of each effect (each with a rig, a plan, a law and noise of its own)
    #[arg(long, default_value_t = 2, alias = "seeds")]
    rounds: u64,
    /// Number of the first round, which decides the seeds
    #[arg(long, default_value_t = 1, alias = "first-seed")]
    first_round: u64,
    /// Take the first round's number from the hash of this commit, so that nothing can be tuned on the cases;
    /// it must be checked out, with no change
    #[arg(long, value_name = "HASH", num_args = 0..=1, default_missing_value = "HEAD", conflicts_with = "first_round")]
    seeds_from_commit: Option<String>,
    /// Take seeds from a commit though the sources differ from it; the table says so
    #[arg(long)]
    allow_dirty: bool,
    /// Take exactly this seed for every case, to see one again
    #[arg(long, value_name = "SEED", conflicts_with = "seeds_from_commit")]
    exact_seed: Option<u64>,
    /// Each effect that can be named, alone
    #[arg(long)]
    singles: bool,
    /// Only these effects; some at once are joined by +, as thermal_fade+m2_ripple
    #[arg(long, value_name = "ID", num_args = 1..)]
    effects: Vec<String>,
    /// Two effects at once: so many random pairs in each round
    #[arg(long, value_name = "COUNT", num_args = 0..=1, default_missing_value = "10")]
    pairs: Option<u64>,
    /// Effects that are not in the library
    #[arg(long)]
    outside: bool,
    /// No effect: so many cases in each round
    #[arg(long, value_name = "COUNT", num_args = 0..=1, default_missing_value = "5")]
    none: Option<u64>,
    /// Laws behind the effects: those to develop on, or the one of each effect that is kept for a final table
    #[arg(long, value_enum, default_value_t = LawFamily::Common)]
    laws: LawFamily,
    /// Rate of the logs
    #[arg(long, default_value_t = 1000.0)]
    rate_hz: f64,
    /// Factor on the noise of all sensors
    #[arg(long, default_value_t = 1.0)]
    noise: f64,
    /// Hum, bounce, missing samples, jitter
    #[arg(long, value_enum, default_value_t = Imperfection::Mild)]
    imperfections: Imperfection,
    /// Relative error of the rig file
    #[arg(long, default_value_t = 0.05)]
    rig_file_error: f64,
    /// What is logged
    #[arg(long, value_enum, default_value_t = Form::Contact)]
    form: Form,
    /// Friction model behind the logs
    #[arg(long, value_enum, default_value_t = Base::BySeed)]
    base: Base,
    /// Which motions are run
    #[arg(long, value_enum, default_value_t = Plan::Drawn)]
    plan: Plan,
    /// Length of each log where the plan is random
    #[arg(long, default_value_t = 20.0)]
    duration_s: f64,
    /// Cases at a time; each diagnosis gets its share of the cores
    #[arg(long, default_value_t = 1)]
    jobs: usize,
    /// Run one shard of the cases only: the i-th of n
    #[arg(long, value_name = "I/N")]
    case: Option<Shard>,
    /// Write one line of JSON for each case to this file
    #[arg(long, value_name = "FILE")]
    json_lines: Option<PathBuf>,
    /// Run nothing: make the table from lines that shards wrote
    #[arg(long, value_name = "FILE", num_args = 1..)]
    collect: Vec<PathBuf>,
    /// Instead of diagnoses: so many fits of clean logs, and how many of their 95 % intervals hold the truth
    #[arg(long, value_name = "COUNT", conflicts_with_all = ["case", "json_lines", "singles", "effects", "pairs", "outside", "none"])]
    fit_coverage: Option<usize>,
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
    if !arguments.collect.is_empty() {
        print!("{}", table::table(&table::collect(read_lines(&arguments.collect)?)?));
        return Ok(());
    }
    let (wanted, campaign) = campaign(arguments)?;
    let runner = Runner {
        rig: Runner::command()?,
        folder: arguments
            .keep
            .clone()
            .unwrap_or_else(|| std::env::temp_dir().join(format!("rig-trials-{}", std::process::id()))),
        keep: arguments.keep.is_some(),
        jobs: arguments.jobs.max(1),
    };
    let result = match arguments.fit_coverage {
        Some(count) => {
            println!("{campaign}");
            fits(&runner, &wanted, count);
            Ok(())
        }
        None => cases(arguments, &runner, &wanted, &campaign),
    };
    if !runner.keep {
        // It is empty; where it is not, somebody else's files stay.
        let _ = std::fs::remove_dir(&runner.folder);
    }
    result
}

fn fits(runner: &Runner, wanted: &Wanted, count: usize) {
    let first = wanted.first_round.wrapping_mul(10_000);
    let drawn = || (0..count as u64).map(|i| first.wrapping_add(i)).collect();
    let seeds: Vec<u64> = wanted.exact_seed.map_or_else(drawn, |seed| vec![seed]);
    let fit = |seed: &u64| coverage::fit(runner, &wanted.scenario, *seed);
    print!("{}", coverage::table(&runner.each(&seeds, fit, coverage::Fitted::words)));
}

fn cases(arguments: &Arguments, runner: &Runner, wanted: &Wanted, campaign: &str) -> Result<(), String> {
    let all = wanted.cases();
    let mine: Vec<(usize, &Scenario)> = all
        .iter()
        .enumerate()
        .filter(|(place, _)| arguments.case.is_none_or(|shard| shard.has(*place)))
        .collect();
    let records = runner.each(
        &mine,
        |(place, scenario)| runner.case(campaign, place + 1, all.len(), scenario),
        |record| {
            let verdict = if record.right() { "right" } else { "WRONG" };
            let why = record.failure.as_ref().map_or(String::new(), |why| format!(": {why}"));
            format!("{verdict} {}: {}{why} ({:.0} s)", record.name(), record.words(), record.wall_s)
        },
    );
    if let Some(path) = &arguments.json_lines {
        write_lines(path, &records)?;
    }
    match arguments.case {
        // A table of a part would look like one of the whole.
        Some(_) if arguments.json_lines.is_some() => Ok(()),
        Some(_) => records.iter().try_for_each(|record| {
            serde_json::to_string(record).map(|line| println!("{line}")).map_err(|e| e.to_string())
        }),
        None => {
            print!("{}", table::table(&records));
            Ok(())
        }
    }
}

/// The cases wanted, and the words that say which they are.
fn campaign(arguments: &Arguments) -> Result<(Wanted, String), String> {
    let sources = Path::new(env!("CARGO_MANIFEST_DIR"));
    let commit = match &arguments.seeds_from_commit {
        Some(name) => Some(Commit::of(sources, name, arguments.allow_dirty)?),
        None => None,
    };
    let scenario = Scenario {
        rate_hz: arguments.rate_hz,
        noise_factor: arguments.noise,
        base: arguments.base,
        form: arguments.form,
        plan: arguments.plan,
        duration_s: arguments.duration_s,
        rig_file_error: arguments.rig_file_error,
        laws: arguments.laws,
        imperfection: arguments.imperfections,
        ..Scenario::new(&[], 0)
    };
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
    let wanted = Wanted {
        rounds: arguments.rounds,
        first_round: commit.as_ref().map_or(arguments.first_round, Commit::first_round),
        hidden,
        pairs: arguments.pairs.unwrap_or(if all { 10 } else { 0 }),
        clean: arguments.none.unwrap_or(if all { 5 } else { 0 }),
        exact_seed: arguments.exact_seed,
        scenario,
    };
    let seeds = match &commit {
        Some(commit) => format!("seeds from {}", commit.words()),
        None => format!("rounds {} to {}", wanted.first_round, wanted.first_round + wanted.rounds.max(1) - 1),
    };
    let Scenario { laws, form, base, plan, imperfection, .. } = &wanted.scenario;
    let campaign = format!(
        "laws {laws:?}, {form:?} logs, base {base:?}, plan {plan:?} {} s, {} Hz, noise × {}, imperfections {imperfection:?}, \
         rig file ± {} %, {seeds}",
        arguments.duration_s,
        arguments.rate_hz,
        arguments.noise,
        100.0 * arguments.rig_file_error
    );
    Ok((wanted, campaign))
}

fn write_lines(path: &Path, records: &[Record]) -> Result<(), String> {
    let failed = |e: std::io::Error| format!("{}: {e}", path.display());
    let mut file = std::fs::File::create(path).map_err(failed)?;
    for record in records {
        let line = serde_json::to_string(record).map_err(|e| e.to_string())?;
        writeln!(file, "{line}").map_err(failed)?;
    }
    Ok(())
}

fn read_lines(paths: &[PathBuf]) -> Result<Vec<Record>, String> {
    let mut records = Vec::new();
    for path in paths {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        for (i, line) in text.lines().enumerate() {
            let record = serde_json::from_str(line);
            records.push(record.map_err(|e| format!("{} line {}: {e}", path.display(), i + 1))?);
        }
    }
    Ok(records)
}
