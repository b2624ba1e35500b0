//! Writes a generated case to a folder: `train1.csv`, `train2.csv` …, `holdout.csv`, `rig.toml`,
//! `model.toml`, and the answer in `truth.json`.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::Parser;
use rig_tests::{Base, Effect, Form, Imperfection, LawFamily, Plan, Scenario, generate};

#[derive(Parser)]
#[command(about = "Make logs with hidden effects")]
struct Arguments {
    /// Hidden effect, by its id; repeat for several, leave out for none
    #[arg(long)]
    effect: Vec<String>,
    /// Decides every random draw
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Rate of the logs
    #[arg(long, default_value_t = 1000.0)]
    rate_hz: f64,
    /// Factor on every sensor's noise
    #[arg(long, default_value_t = 1.0)]
    noise: f64,
    /// Friction model behind the logs
    #[arg(long, value_enum, default_value_t = Base::BySeed)]
    base: Base,
    /// What is logged
    #[arg(long, value_enum, default_value_t = Form::Contact)]
    form: Form,
    /// Which motions are run
    #[arg(long, value_enum, default_value_t = Plan::Random)]
    plan: Plan,
    /// Length of each log
    #[arg(long, default_value_t = 20.0)]
    duration_s: f64,
    /// Relative error of the rig file
    #[arg(long, default_value_t = 0.05)]
    rig_file_error: f64,
    /// Laws behind the effects: those to develop on, or the one kept for a final table
    #[arg(long, value_enum, default_value_t = LawFamily::Common)]
    laws: LawFamily,
    /// Hum, bounce, missing samples, jitter
    #[arg(long, value_enum, default_value_t = Imperfection::Mild)]
    imperfections: Imperfection,
    /// Add a surface temperature
    #[arg(long)]
    temperature: bool,
    /// Folder to write to
    #[arg(long)]
    out: PathBuf,
}

fn main() -> ExitCode {
    match run(&Arguments::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::from(2)
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), String> {
    let effects = arguments
        .effect
        .iter()
        .map(|id| {
            let all = || Effect::ALL.iter().map(|e| e.id()).collect::<Vec<_>>().join(", ");
            Effect::from_id(id).ok_or_else(|| format!("effect {id}: not one of {}", all()))
        })
        .collect::<Result<Vec<_>, _>>()?;
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
        temperature_sensor: arguments.temperature,
        ..Scenario::new(&effects, arguments.seed)
    };
    let case = generate(&scenario).map_err(|error| error.to_string())?;
    let truth = case.truth.to_json().map_err(|error| error.to_string())?;
    let failed = |error: std::io::Error| format!("{}: {error}", arguments.out.display());
    case.write(&arguments.out).map_err(failed)?;
    std::fs::write(arguments.out.join("truth.json"), truth).map_err(failed)?;
    let [friction, normal, drive] = case.truth.residual_to_noise;
    println!("residual over noise: friction {friction:.1}, normal force {normal:.1}, drive {drive:.1}");
    Ok(())
}
