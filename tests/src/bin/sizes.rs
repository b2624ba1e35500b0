//! How large the hidden effects are: for each effect and law the RMS of what it changes over the RMS of the channel,
//! measured on generated logs. By hand: `cargo run --release -p rig-tests --bin sizes -- --seeds 30`.

use std::collections::BTreeMap;
use std::process::ExitCode;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use clap::Parser;
use rig_tests::{Effect, Form, LawFamily, Scenario, generate};

#[derive(Parser)]
#[command(about = "Measure how large the hidden effects are, by effect and law")]
struct Arguments {
    /// Seeds for each effect
    #[arg(long, default_value_t = 30)]
    seeds: u64,
    /// Only these effects
    #[arg(long, num_args = 1..)]
    effects: Vec<String>,
    /// Laws behind the effects
    #[arg(long, value_enum, default_value_t = LawFamily::Common)]
    laws: LawFamily,
    /// What is logged
    #[arg(long, value_enum, default_value_t = Form::Contact)]
    form: Form,
    /// Length of each log
    #[arg(long, default_value_t = 20.0)]
    duration_s: f64,
    /// Threads
    #[arg(long, default_value_t = 1)]
    jobs: usize,
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    let wanted = |effect: &&Effect| {
        (arguments.form == Form::Contact || effect.works_without_contact())
            && (arguments.effects.is_empty() || arguments.effects.iter().any(|id| id == effect.id()))
    };
    let effects: Vec<Effect> = Effect::ALL.iter().filter(wanted).copied().collect();
    let cases: Vec<(Effect, u64)> =
        effects.iter().flat_map(|effect| (1..=arguments.seeds).map(|seed| (*effect, seed))).collect();
    let next = AtomicUsize::new(0);
    let sizes: Mutex<BTreeMap<(usize, String), Vec<f64>>> = Mutex::new(BTreeMap::new());
    std::thread::scope(|scope| {
        for _ in 0..arguments.jobs.max(1) {
            scope.spawn(|| {
                while let Some((effect, seed)) = cases.get(next.fetch_add(1, Ordering::Relaxed)) {
                    let scenario = Scenario {
                        laws: arguments.laws,
                        form: arguments.form,
                        duration_s: arguments.duration_s,
                        ..Scenario::new(&[*effect], *seed)
                    };
                    let Ok(case) = generate(&scenario) else { continue };
                    let law = case.truth.law_names.get(effect.id()).cloned().unwrap_or_default();
                    let place = effects.iter().position(|other| other == effect).unwrap_or(0);
                    let mut sizes = sizes.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
                    sizes.entry((place, law)).or_default().push(case.truth.size(*effect));
                }
            });
        }
    });
    println!("{:22} {:18} {:>4} {:>8} {:>8} {:>8}", "effect", "law", "n", "least", "median", "most");
    let sizes = sizes.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    for ((place, law), mut list) in sizes {
        list.sort_by(f64::total_cmp);
        let at = |i: usize| 100.0 * list.get(i).copied().unwrap_or(f64::NAN);
        println!(
            "{:22} {law:18} {:>4} {:7.2}% {:7.2}% {:7.2}%",
            effects[place].id(),
            list.len(),
            at(0),
            at(list.len() / 2),
            at(list.len() - 1)
        );
    }
    ExitCode::SUCCESS
}
