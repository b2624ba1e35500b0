//! What the tool refuses: exit status 2, one line on stderr that says where and what, and nothing written.

use std::fs;
use std::path::Path;
use std::process::{Command, Output};

use model_core::friction::ModelKind;
use tempfile::TempDir;

const RIG: &str = "[geometry]\nfriction_radius_m = 0.06\n";
const MODEL: &str =
    "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1e6\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n";
const HEADER: &str = "time_s,m2_speed_rad_s,normal_force_n,friction_torque_nm,note";

fn log() -> String {
    let rows =
        (0..200).map(|i| format!("{},{},80,{},a", f64::from(i) * 1e-3, 1.0, 3.0 - 0.001 * f64::from(i)));
    format!("# rig: test\n{HEADER}\n{}\n", rows.collect::<Vec<_>>().join("\n"))
}

/// A folder with good files, of which each case spoils one.
struct Bench(TempDir);

impl Bench {
    fn new() -> Self {
        let bench = Self(tempfile::tempdir().unwrap());
        bench.put("rig.toml", RIG);
        bench.put("model.toml", MODEL);
        bench.put("log.csv", &log());
        bench
    }

    fn path(&self) -> &Path {
        self.0.path()
    }

    fn put(&self, name: &str, text: &str) {
        fs::write(self.path().join(name), text).unwrap();
    }

    fn rig(&self, arguments: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).current_dir(self.path()).output().unwrap()
    }

    fn predict(&self, more: &[&str]) -> Output {
        let files = ["predict", "--rig", "rig.toml", "--model", "model.toml", "--log", "log.csv"];
        let out: &[&str] = if more.contains(&"--out") { &[] } else { &["--out", "out/deep"] };
        self.rig(&[&files, out, more].concat())
    }

    fn files(&self) -> Vec<String> {
        let names = fs::read_dir(self.path()).unwrap().map(|e| e.unwrap().file_name().into_string().unwrap());
        let mut names: Vec<String> = names.collect();
        names.sort();
        names
    }

    /// Checks a refusal and returns its line.
    #[track_caller]
    fn refused(&self, output: &Output) -> String {
        let stderr = String::from_utf8(output.stderr.clone()).unwrap();
        assert_eq!(output.status.code(), Some(2), "{stderr}");
        assert_eq!(stderr.lines().count(), 1, "more than one line: {stderr}");
        assert!(output.stdout.is_empty());
        assert_eq!(self.files(), ["log.csv", "model.toml", "rig.toml"], "something was left behind");
        let line = stderr.trim_end();
        line.strip_prefix("rig: ").unwrap_or_else(|| panic!("{line}")).to_string()
    }
}

/// The good log with one change is refused with a line that begins so.
#[track_caller]
fn log_refused(change: impl Fn(&str) -> String, expected: &str) {
    let bench = Bench::new();
    bench.put("log.csv", &change(&log()));
    let line = bench.refused(&bench.predict(&[]));
    assert!(line.starts_with(expected), "{line}");
}

#[track_caller]
fn file_refused(name: &str, text: &str, expected: &str) {
    let bench = Bench::new();
    bench.put(name, text);
    let line = bench.refused(&bench.predict(&[]));
    assert!(line.starts_with(expected), "{line}");
}

#[test]
fn good_input_is_not_refused() {
    let bench = Bench::new();
    let output = bench.predict(&[]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let said = String::from_utf8(output.stderr).unwrap();
    assert!(said.lines().count() == 1 && said.starts_with("rig: wrote "), "{said}");
    let names = |folder: &str| fs::read_dir(bench.path().join(folder)).unwrap().count();
    assert_eq!(names("out/deep"), 3);
}

#[test]
fn a_missing_column_is_refused_and_those_there_are_listed() {
    log_refused(
        |log| log.replace("normal_force_n", "something_n"),
        "log.csv: column normal_force_n is missing; allowed: this column in SI units; the file has time_s, \
         m2_speed_rad_s, something_n, friction_torque_nm, note",
    );
}

#[test]
fn nan_and_infinity_are_refused_with_line_and_column() {
    log_refused(
        |log| log.replacen(",80,", ",NaN,", 1),
        "log.csv:3: normal_force_n = NaN: not a finite number; allowed: a finite number",
    );
    log_refused(
        |log| log.replacen(",1,80", ",inf,80", 1),
        "log.csv:3: m2_speed_rad_s = inf: not a finite number",
    );
}

#[test]
fn a_word_or_an_empty_cell_is_refused_with_line_and_column() {
    log_refused(
        |log| log.replacen(",80,", ",eighty,", 1),
        "log.csv:3: normal_force_n = eighty: not a number",
    );
    log_refused(|log| log.replacen(",80,", ",,", 1), "log.csv:3: normal_force_n = : the cell is empty");
}

#[test]
fn time_that_goes_back_or_stands_still_is_refused_with_its_line() {
    log_refused(
        |log| log.replacen("\n0.005,", "\n0.0035,", 1),
        "log.csv:8: time_s = 0.0035: time goes back, the sample before is at 0.004 s; allowed: strictly increasing",
    );
    log_refused(
        |log| log.replacen("\n0.005,", "\n0.004,", 1),
        "log.csv:8: time_s = 0.004: time stands still",
    );
}

#[test]
fn a_gap_is_refused_with_its_line() {
    let without_a_tenth = |log: &str| {
        let kept = log.lines().enumerate().filter(|(i, _)| !(52..152).contains(i)).map(|(_, line)| line);
        kept.collect::<Vec<_>>().join("\n")
    };
    log_refused(
        without_a_tenth,
        "log.csv:53: time_s = 0.15: gap of 0.101000 s before this sample; allowed: steps up",
    );
}

#[test]
fn an_empty_log_is_refused() {
    log_refused(|_| String::new(), "log.csv: is empty; allowed: a header line");
    log_refused(|_| format!("{HEADER}\n"), "log.csv: has a header but no samples");
}

#[test]
fn a_wrong_unit_in_a_name_says_which_column_was_meant() {
    for (right, wrong, unit) in [
        ("normal_force_n", "normal_force_kn", "newtons"),
        ("time_s", "time_ms", "seconds"),
        ("m2_speed_rad_s", "m2_speed_rpm", "radians per second"),
    ] {
        log_refused(
            |log| log.replacen(right, wrong, 1),
            &format!(
                "log.csv: {wrong}: wrong unit or spelling in the column's name; allowed: {right} with values in {unit}"
            ),
        );
    }
}

#[test]
fn a_column_twice_and_a_ragged_line_are_refused() {
    log_refused(|log| log.replacen("note", "time_s", 1), "log.csv:2: time_s: this column is there twice");
    log_refused(
        |log| log.replacen(",a\n", "\n", 1),
        "log.csv:3: has 4 cells, the header has 5; allowed: 5 cells",
    );
}

#[test]
fn a_drive_log_is_no_contact_log() {
    log_refused(
        |_| "time_s,force_n,position_m\n0,1,0\n0.001,1,0\n".into(),
        "log.csv: columns m2_speed_rad_s (or m2_angle_rad), normal_force_n, friction_torque_nm are missing",
    );
}

#[test]
fn what_is_no_parquet_file_is_refused() {
    let bench = Bench::new();
    let output = bench.predict(&["--set", "rig.geometry.friction_radius_m=0.05"]);
    assert!(output.status.success());
    fs::remove_dir_all(bench.path().join("out")).unwrap();
    let arguments = ["predict", "--model", "model.toml", "--log", "model.toml.parquet", "--out", "out"];
    assert!(
        bench.refused(&bench.rig(&arguments)).starts_with("model.toml.parquet: cannot read: no such file")
    );
}

#[test]
fn a_negative_stiffness_is_refused_with_its_range() {
    file_refused(
        "model.toml",
        &MODEL.replace("1e6", "-1e6"),
        "model.toml:3: parameters.sigma0_n_per_m = -1e6: out of range; allowed: 1 to 1e10 N/m",
    );
}

#[test]
fn an_unknown_key_is_refused_and_the_known_ones_are_listed() {
    file_refused(
        "rig.toml",
        &format!("{RIG}radius = 3\n"),
        "rig.toml:3: geometry.radius = 3: unknown key; allowed: friction_radius_m, lever_gain_n_per_nm",
    );
    file_refused(
        "model.toml",
        &format!("{MODEL}k_u_n_per_m = 3e4\n"),
        "model.toml:7: parameters.k_u_n_per_m = 3e4: unknown key; allowed: sigma0_n_per_m, sigma1_n_s_per_m, a0",
    );
    file_refused(
        "model.toml",
        &format!("color = 1\n{MODEL}"),
        "model.toml:1: color = 1: unknown key; allowed: kind",
    );
}

#[test]
fn unknown_kinds_and_effects_are_refused_and_the_known_ones_are_listed() {
    let kinds: Vec<&str> = ModelKind::ALL.iter().map(|kind| kind.name()).collect();
    file_refused(
        "model.toml",
        &MODEL.replace("lugre", "glue"),
        &format!("model.toml:1: kind = \"glue\": not known; allowed: {}", kinds.join(", ")),
    );
    file_refused(
        "model.toml",
        &format!("{MODEL}[[extension]]\nid = \"rust\"\n"),
        "model.toml:8: extension.0.id = \"rust\": unknown effect; allowed: element_compliance, ",
    );
}

#[test]
fn a_missing_key_and_a_wrong_type_are_refused() {
    file_refused("model.toml", &MODEL.replace("a0 = 0.5\n", ""), "model.toml:2: parameters.a0: is missing");
    file_refused(
        "rig.toml",
        "[geometry]\nfriction_radius_m = \"6 cm\"\n",
        "rig.toml:2: geometry.friction_radius_m = \"6 cm\": is a string; allowed: a number, > 0",
    );
    file_refused("rig.toml", "[geometry\n", "rig.toml:1: not valid TOML: ");
}

#[test]
fn an_output_that_cannot_be_written_is_refused_with_its_path() {
    let bench = Bench::new();
    let line = bench.refused(&bench.predict(&["--out", "rig.toml"]));
    assert_eq!(line, "rig.toml: is a file, not a folder; allowed: a folder for the results");
    let line = bench.refused(&bench.predict(&["--out", "rig.toml/below"]));
    assert!(line.starts_with("rig.toml"), "{line}");
    // Even the superuser cannot make folders there.
    if cfg!(target_os = "linux") {
        let line = bench.refused(&bench.predict(&["--out", "/proc/rig-out"]));
        assert!(line.starts_with("/proc/rig-out: cannot make this folder: "), "{line}");
    }
}

#[test]
fn earlier_results_survive_a_refusal() {
    let bench = Bench::new();
    let out = tempfile::tempdir().unwrap();
    let folder = out.path().to_str().unwrap();
    assert!(bench.predict(&["--out", folder]).status.success());
    let before = fs::read(out.path().join("prediction.csv")).unwrap();
    bench.put("log.csv", &log().replacen(",80,", ",NaN,", 1));
    bench.refused(&bench.predict(&["--out", folder]));
    assert_eq!(fs::read(out.path().join("prediction.csv")).unwrap(), before);
    assert_eq!(fs::read_dir(out.path()).unwrap().count(), 3);
}

#[test]
fn wrong_arguments_are_refused_in_one_line() {
    let bench = Bench::new();
    for (arguments, expected) in [
        (&["predict"][..], "the following required arguments were not provided: "),
        (&["predict", "--speed", "3"], "unexpected argument '--speed' found"),
        (&["dance"], "unrecognized subcommand 'dance'"),
    ] {
        let line = bench.refused(&bench.rig(arguments));
        assert!(line.starts_with(expected), "{line}");
    }
    let line = bench.refused(&bench.predict(&["--set", "model.parameters.a9=1"]));
    assert!(line.starts_with("model.toml with --set: parameters.a9 = 1: unknown key; allowed: "), "{line}");
    let line = bench.refused(&bench.predict(&["--set", "experiment.seed=1"]));
    assert_eq!(line, "--set: experiment.seed = 1: this command reads no experiment file");
    let line = bench.refused(&bench.predict(&["--set", "a1"]));
    assert!(line.starts_with("--set: a1: has no '='; allowed: KEY=VALUE"), "{line}");
}
