//! `cargo verify`: host suite, lints, dependency policy, the firmware for the chip with its size, and
//! the same ELF on the virtual bench.
//!
//! Every command is printed before it runs, so that it can be repeated alone. All steps run even where
//! one fails; the table at the end says how each ended. What this machine lacks is fetched where that
//! is possible, and named with the command that would get it where it is not.
//!
//! Policy, firmware, and building and lints of the bench do not wait for the host suite: they run beside it, so that both cores have
//! work while one crate is compiled or one test is left. What they print comes after what the suite prints.
//!
//! `cargo verify firmware bench` runs only these parts; the parts are host, policy, firmware, bench. `cargo verify layout`
//! draws the project's floors from the source (`layout.rs`).

mod layout;
mod size;
mod step;

use std::io;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use step::{Ended, Runner};

/// The firmware's target.
const TARGET: &str = "thumbv7em-none-eabihf";

/// The package that needs a newer declared Rust than the workspace's, and builds on it all the same.
const BENCH: [&str; 3] = ["--package", "virtual-bench", "--ignore-rust-version"];

/// Where what runs beside the host suite prints, from the workspace's root.
const BESIDE: &str = "target/verify/beside-the-host-suite.log";

/// The parts.
const PARTS: [&str; 4] = ["host", "policy", "firmware", "bench"];

fn main() -> ExitCode {
    let wanted: Vec<String> = std::env::args().skip(1).collect();
    if wanted == ["layout"] {
        return match layout::write(&root()) {
            Ok(wrote) => {
                println!("{wrote}");
                ExitCode::SUCCESS
            }
            Err(error) => {
                eprintln!("verify: {error}");
                ExitCode::FAILURE
            }
        };
    }
    if let Some(unknown) = wanted.iter().find(|part| !PARTS.contains(&part.as_str())) {
        eprintln!("verify: {unknown}: no such part; allowed: {}", PARTS.join(", "));
        return ExitCode::from(2);
    }
    match verified(&root(), |part| wanted.is_empty() || wanted.iter().any(|name| name == part)) {
        Ok(ended) => ended,
        Err(error) => {
            eprintln!("verify: {BESIDE}: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Runs the wanted parts; an error is one of making the file that those beside the host suite print to.
fn verified(root: &Path, wants: impl Fn(&str) -> bool + Sync) -> io::Result<ExitCode> {
    let mut run = Runner::new(root);
    // Before anything compiles: rustup does one thing at a time.
    let has_target = wants("firmware") && run.target(TARGET);
    let others = |run: &mut Runner| {
        if wants("policy") {
            policy(run);
        }
        if wants("firmware") {
            firmware(run, root, has_target);
        }
        if wants("bench") {
            bench_build(run);
        }
    };
    if wants("host") {
        let mut beside = Runner::beside(root, Path::new(BESIDE))?;
        println!("what runs beside the host suite prints to {BESIDE}, and is shown behind it");
        std::thread::scope(|scope| {
            scope.spawn(|| others(&mut beside));
            host(&mut run);
        });
        run.join(beside);
    } else {
        others(&mut run);
    }
    if wants("bench") {
        bench(&mut run);
    }
    Ok(run.summary())
}

/// The workspace: this package lies in tests/verify.
fn root() -> PathBuf {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    here.ancestors().nth(2).unwrap_or(here).to_path_buf()
}

fn host(run: &mut Runner) {
    run.cargo("format", ".", &["fmt", "--all", "--check"]);
    run.cargo("lints", ".", &["clippy", "--quiet", "--all-targets", "--", "-D", "warnings"]);
    let demo =
        ["clippy", "--quiet", "--package", "host-sim", "--no-default-features", "--", "-D", "warnings"];
    run.cargo("lints as for the demo", ".", &demo);
    run.cargo_env("docs", ".", &["doc", "--quiet", "--no-deps"], &[("RUSTDOCFLAGS", "-D warnings")]);
    run.cargo("host suite", ".", &["test", "--no-fail-fast"]);
    // What takes too long for every change: tests in modules of that name.
    run.cargo("host suite, long", ".", &["test", "--no-fail-fast", "long::", "--", "--ignored"]);
}

fn policy(run: &mut Runner) {
    let name = "dependencies";
    if !run.has(&["deny", "--version"]) {
        // Unoptimised and not for a debugger: it is built in a third of the time, and its check takes three seconds.
        let install = ["install", "--quiet", "--locked", "--debug", "cargo-deny"];
        run.cargo_env("cargo-deny", ".", &install, &[("CARGO_PROFILE_DEV_DEBUG", "0")]);
    }
    if !run.has(&["deny", "--version"]) {
        run.note(
            name,
            Ended::Lacking("cargo-deny could not be had: cargo install --locked cargo-deny".into()),
        );
        return;
    }
    run.cargo(name, ".", &["deny", "--workspace", "check", "bans", "licenses", "sources"]);
    let manifest = ["deny", "--manifest-path", "firmware/Cargo.toml", "check"];
    run.cargo("firmware's dependencies", ".", &[&manifest[..], &["bans", "licenses", "sources"]].concat());
    // The list of advisories is fetched from the network at each run; without it nothing can be said.
    if run.quietly(&["deny", "--workspace", "fetch", "db"]) {
        run.cargo("advisories", ".", &["deny", "--workspace", "check", "advisories"]);
    } else {
        let how = "the advisory list could not be fetched: cargo deny fetch db, with a network";
        run.note("advisories", Ended::Skipped(how.into()));
    }
}

fn firmware(run: &mut Runner, root: &Path, has_target: bool) {
    if !has_target {
        let how = format!("the target could not be had: rustup target add {TARGET}");
        run.note("firmware", Ended::Lacking(how));
        return;
    }
    run.cargo("firmware format", "firmware", &["fmt", "--check"]);
    run.cargo("firmware lints", "firmware", &["clippy", "--quiet", "--release", "--", "-D", "warnings"]);
    // The lints above have refused every warning; with flags of its own this would be another build than the bench's.
    run.cargo("firmware", "firmware", &["build", "--quiet", "--release"]);
    // They are for a board; that they link is all that can be said here.
    run.cargo("firmware's tests", "firmware", &["test", "--quiet", "--release", "--no-run"]);
    let elf = root.join("firmware/target").join(TARGET).join("release/rig-firmware");
    match size::of(&elf, &root.join("host-sim/virtual-bench/budget.toml")) {
        Ok(size) => run.note("firmware size", Ended::Passed(size.to_string())),
        Err(error) => run.note("firmware size", Ended::Failed(error)),
    }
}

/// The arguments that build the bench's suite, and with more run it.
fn bench_suite(more: &[&'static str]) -> Vec<&'static str> {
    [&["test", "--release"][..], &BENCH, more].concat()
}

/// All of the bench that does not wait for a test.
fn bench_build(run: &mut Runner) {
    run.cargo("bench build", ".", &bench_suite(&["--quiet", "--no-run"]));
    // In the profile of the host's lints, whose work it shares.
    let lints = [&["clippy", "--quiet", "--all-targets"][..], &BENCH, &["--", "-D", "warnings"]];
    run.cargo("bench lints", ".", &lints.concat());
}

fn bench(run: &mut Runner) {
    // Its tables are what a reader of the log wants to see.
    run.cargo("bench suite", ".", &bench_suite(&["--", "--nocapture"]));
}
