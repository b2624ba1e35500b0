//! The trials' program, with a tool that answers at once: shards make the table that one process makes, on a
//! cluster too.

use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

/// A tool that names a friction delay in every contact log, with a posterior, and fits with intervals.
const FAKE: &str = r#"#!/bin/sh
while [ $# -gt 0 ]; do [ "$1" = --out ] && out="$2"; shift; done
mkdir -p "$out"
cat > "$out/diagnosis.json" <<'JSON'
{"verdict": "named",
 "baseline": {"kind": "series", "train_nrmse": 0.1, "holdout_nrmse": 0.1},
 "causes": [{"id": "friction_delay", "subsystem": "measurement", "probability": 0.8,
             "parameters": {"delay_s": {"value": 0.005, "std": 0.1}}, "evidence": []}],
 "rejected": [], "indistinguishable": [["friction_delay", "ring_resonance"]],
 "extended": {"holdout_nrmse": 0.011, "gain": 0.9, "noise_floor_nrmse": 0.01},
 "posterior": {"none": 0.05, "unknown": 0.15, "friction_delay": 0.6, "friction_delay+wear_drift": 0.2},
 "remaining": {"share_of_baseline": 0.1, "times_noise": 1.5, "follows": [], "balance": "friction", "sentence": ""},
 "next_experiment": ""}
JSON
cat > "$out/model.toml" <<'TOML'
kind = "series"
[intervals]
a0 = { std = 1.0, low = 0.0, high = 9.0 }
a1 = { std = 1.0, low = -2.0, high = -1.0 }
TOML
"#;

fn fake(folder: &Path) -> PathBuf {
    let path = folder.join("rig");
    std::fs::write(&path, FAKE).unwrap();
    std::fs::set_permissions(&path, std::fs::Permissions::from_mode(0o755)).unwrap();
    path
}

const CASES: [&str; 9] = [
    "--rounds",
    "1",
    "--effects",
    "friction_delay",
    "ring_resonance",
    "--none=2",
    "--plan=random",
    "--duration-s",
    "2",
];

fn trials(folder: &Path, arguments: &[&str]) -> Output {
    let program = env!("CARGO_BIN_EXE_trials");
    Command::new(program).args(arguments).env("RIG_BIN", folder.join("rig")).output().unwrap()
}

fn text(output: &Output) -> String {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout.clone()).unwrap()
}

/// A table without its times, which no two runs share.
fn timeless(table: &str) -> String {
    let cut = |line: &str| match line.rfind(" / ") {
        Some(at) if line[at..].trim_start_matches(" / ").parse::<f64>().is_ok() => {
            line[..at].trim_end_matches(|c: char| c.is_ascii_digit() || c == '.').trim_end().to_string()
        }
        _ => line.to_string(),
    };
    table.lines().map(cut).collect::<Vec<_>>().join("\n")
}

#[test]
fn shards_together_make_the_table_of_one_process() {
    let folder = tempfile::tempdir().unwrap();
    fake(folder.path());
    let whole = text(&trials(folder.path(), &[&CASES[..], &["--jobs", "2"]].concat()));
    let lines: Vec<String> =
        (1..=3).map(|i| folder.path().join(format!("{i}.jsonl")).to_string_lossy().into_owned()).collect();
    for (i, file) in lines.iter().enumerate() {
        let shard = format!("{}/3", i + 1);
        let output = trials(folder.path(), &[&CASES[..], &["--case", &shard, "--json-lines", file]].concat());
        assert_eq!(text(&output), "", "a part prints no table");
    }
    let of = |files: &[&String]| {
        let files: Vec<&str> = files.iter().map(|file| file.as_str()).collect();
        trials(folder.path(), &[&["--collect"], &files[..]].concat())
    };
    let collected = text(&of(&[&lines[2], &lines[0], &lines[1]]));
    assert_eq!(timeless(&collected), timeless(&whole));
    assert!(whole.contains("one effect                   2 of 2, 100 % [16, 100]"), "{whole}");
    // A delay named for a ring that stands in one group with it counts, and is counted.
    assert!(whole.contains("1 of the right"), "{whole}");
    assert!(
        whole.contains("no effect                    2 of 2, 100 % [16, 100]    0 of 2, 0 % [0, 84]"),
        "{whole}"
    );
    // Statements of 1 % and more: none 0.05, wear 0.2, unknown 0.15, delay 0.8, of four cases of which one hides a
    // delay and two hide nothing: bins at 0.05, 0.15 (twice as many as the others), 0.2 and 0.8.
    let expected = (4.0 * 0.45 + 4.0 * 0.15 + 4.0 * 0.2 + 4.0 * 0.55) / 16.0;
    assert!(whole.contains(&format!("expected calibration error {expected:.3}")), "{expected}: {whole}");

    let missing = of(&[&lines[0], &lines[2]]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(String::from_utf8_lossy(&missing.stderr).contains("missing of 4 cases: 2"), "{missing:?}");
    let twice = of(&[&lines[0], &lines[0], &lines[1], &lines[2]]);
    assert_eq!(twice.status.code(), Some(2));
}

#[test]
fn lines_hold_the_same_answers_whoever_runs_them_and_other_rounds_hide_other_cases() {
    let folder = tempfile::tempdir().unwrap();
    fake(folder.path());
    let run = |extra: &[&str]| -> Vec<serde_json::Value> {
        let output = trials(folder.path(), &[&CASES[..], &["--case", "1/1"], extra].concat());
        let mut lines: Vec<serde_json::Value> =
            text(&output).lines().map(|line| serde_json::from_str(line).unwrap()).collect();
        for line in &mut lines {
            assert!(line["wall_s"].as_f64().unwrap() > 0.0);
            line["wall_s"] = 0.into();
        }
        lines
    };
    let (one, two, other) = (run(&["--jobs", "1"]), run(&["--jobs", "3"]), run(&["--first-round", "2"]));
    assert_eq!(one, two);
    assert_eq!(one.len(), 4);
    assert!(one.iter().zip(&other).all(|(a, b)| a["seed"] != b["seed"]));
    assert_eq!(one[0]["answer"]["recovered"][0]["name"], "friction_delay.delay_s");
}

#[test]
fn intervals_of_fits_are_counted() {
    let folder = tempfile::tempdir().unwrap();
    fake(folder.path());
    let table = text(&trials(folder.path(), &["--fit-coverage", "3", "--plan=random", "--duration-s", "2"]));
    assert!(table.contains("a0                   3 of 3, 100 % [29, 100]"), "{table}");
    assert!(table.contains("a1                   0 of 3, 0 % [0, 71]"), "{table}");
}

#[test]
fn wrong_options_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    fake(folder.path());
    for (arguments, word) in [
        (&["--effects", "thermal_fad"][..], "thermal_fade"),
        (&["--case", "4/3"], "i/n"),
        (&["--seeds-from-commit", "no-such-commit"], "no-such-commit"),
        (&["--collect", "no-such-file"], "no-such-file"),
    ] {
        let output = trials(folder.path(), arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(String::from_utf8_lossy(&output.stderr).contains(word), "{arguments:?}: {output:?}");
    }
}

/// Python with the package, or why there is none.
fn python() -> Option<String> {
    let python = std::env::var("RIG_PYTHON").unwrap_or_else(|_| "python3".into());
    let found = Command::new(&python).args(["-c", "import hyperqueue"]).output();
    if found.is_ok_and(|output| output.status.success()) {
        return Some(python);
    }
    eprintln!(
        "skipped: {python} has no package hyperqueue (pip install hyperqueue; RIG_PYTHON names a Python)"
    );
    None
}

#[test]
fn two_workers_of_a_cluster_make_the_table_of_one_process() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let rig = fake(folder.path());
    let programs = Path::new(env!("CARGO_BIN_EXE_trials")).parent().unwrap();
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("cluster/trials.py");
    let out = folder.path().join("out");
    let mut command = Command::new(&python);
    command.arg(&script).args(["--shards", "3", "--local-workers", "2", "--out"]).arg(&out);
    command.arg("--programs").arg(programs).arg("--rig").arg(&rig).arg("--").args(CASES);
    let clustered = text(&command.output().unwrap());
    let whole = text(&trials(folder.path(), &CASES));
    let from_table = |output: &str| timeless(&output[output.find("laws Common").unwrap()..]);
    assert_eq!(from_table(&clustered), from_table(&whole));
    assert!(out.join("shard-0003.jsonl").exists());
}
