//! `rig run`, `record`, `monitor` and `settings` as a user runs them, against a rig behind a pseudo-terminal.

use std::path::PathBuf;

use crate::fake_rig::bench::Bench;
use host_sim::files::log::Log;
use host_sim::files::signal::Signal;

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

fn folder() -> (tempfile::TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("out");
    (parent, out)
}

#[test]
fn settings_are_listed_changed_and_refused() {
    let bench = Bench::new();
    let list = bench.rig(&["settings", "list"]);
    assert!(list.status.success(), "{}", text(&list.stderr));
    assert_eq!(text(&list.stdout).lines().count(), rig_link::settings::ALL.len() + 1);
    let set = bench.rig(&["settings", "set", "geometry.friction_radius_m=0.07"]);
    let line = text(&set.stdout);
    let words: Vec<&str> = line.split_whitespace().collect();
    assert_eq!(words, ["geometry.friction_radius_m", "0.07", "0.07", "0.06", "m"]);
    let refused = bench.rig(&["settings", "set", "geometry.friction_radius_m=-1"]);
    assert_eq!(refused.status.code(), Some(2));
    let error = text(&refused.stderr);
    assert!(error.contains("geometry.friction_radius_m = -1: refused by the rig; allowed: 0.001"), "{error}");
    assert_eq!(bench.rig.lock().unwrap().config.settings().geometry.friction_radius_m, 0.07);
}

#[test]
fn a_model_file_reaches_the_rig() {
    let bench = Bench::new();
    let (parent, _) = folder();
    let file = parent.path().join("model.toml");
    std::fs::write(&file, host_sim::files::model_file::ModelFile::assumed(&[]).unwrap().to_toml()).unwrap();
    let output = bench.rig(&["settings", "model", file.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert_eq!(bench.rig.lock().unwrap().model, Some(rig_link::model::ModelRecord::default()));
    // Without a file the model is shown, as the file it could have come from.
    let shown = text(&bench.rig(&["settings", "model"]).stdout);
    let again = host_sim::files::model_file::ModelFile::parse("shown", &shown).unwrap();
    assert_eq!(
        host_sim::link::model_upload::record(&again).unwrap(),
        rig_link::model::ModelRecord::default(),
        "{shown}"
    );
    assert!(bench.rig.lock().unwrap().model.is_some(), "showing it does not forget it");
    assert!(bench.rig(&["settings", "model", "forget"]).status.success());
    assert_eq!(bench.rig.lock().unwrap().model, None);
}

#[test]
fn the_port_may_stand_anywhere_and_erasing_wants_a_yes() {
    let bench = Bench::new();
    for arguments in [
        ["settings", "--port", "PORT", "get", "m1.reversed"],
        ["settings", "get", "m1.reversed", "--port", "PORT"],
    ] {
        let arguments: Vec<&str> = arguments
            .into_iter()
            .map(|word| if word == "PORT" { bench.port.as_str() } else { word })
            .collect();
        let output = bench.command(&arguments).output().unwrap();
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(text(&output.stdout).contains("m1.reversed"));
    }
    let refused = bench.rig(&["settings", "erase"]);
    assert_eq!(refused.status.code(), Some(2));
    assert!(text(&refused.stderr).contains("allowed: --yes"), "{}", text(&refused.stderr));
    assert!(bench.rig(&["settings", "erase", "--yes"]).status.success());
}

#[test]
fn a_second_command_on_the_same_port_is_refused_and_names_it() {
    let bench = Bench::new();
    let mut first = bench.command(&["monitor", "--plain", "--seconds", "60", "--port", &bench.port]);
    let mut first =
        first.stdout(std::process::Stdio::null()).stderr(std::process::Stdio::null()).spawn().unwrap();
    let refused = (0..100)
        .map(|_| {
            std::thread::sleep(std::time::Duration::from_millis(20));
            bench.rig(&["settings", "get", "m1.reversed"])
        })
        .find(|output| !output.status.success());
    first.kill().unwrap();
    first.wait().unwrap();
    let refused = refused.unwrap();
    assert_eq!(refused.status.code(), Some(4));
    assert!(
        text(&refused.stderr).contains("another rig command uses this port"),
        "{}",
        text(&refused.stderr)
    );
}

#[test]
fn json_is_one_object_with_what_was_written_and_its_contents() {
    let bench = Bench::new();
    let (_parent, out) = folder();
    let arguments = ["record", "--seconds", "0.1", "--json", "--out", out.to_str().unwrap()];
    let object: serde_json::Value = serde_json::from_slice(&bench.rig(&arguments).stdout).unwrap();
    assert_eq!((&object["exit_status"], &object["command"]), (&0.into(), &"record".into()));
    assert!(object["wrote"][0].as_str().unwrap().ends_with("log.csv"));
    // The folder holds results now.
    let object: serde_json::Value = serde_json::from_slice(&bench.rig(&arguments).stdout).unwrap();
    assert_eq!(object["exit_status"], 2);
    assert!(object["error"].as_str().unwrap().contains("holds results already"), "{object}");
    assert!(bench.rig(&[&arguments[..], &["--force"]].concat()).status.success());
}

#[test]
fn a_recording_becomes_a_log() {
    let bench = Bench::new();
    let (_parent, out) = folder();
    let output = bench.rig(&["record", "--seconds", "0.3", "--out", out.to_str().unwrap()]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let log = Log::read(&out.join("log.csv")).unwrap();
    assert_eq!(log.len(), 301);
    assert_eq!(log.metadata("rows_missing"), Some("0"));
    // Nothing presses and nothing turns.
    assert!(log.signal(Signal::NormalForce).unwrap().iter().all(|force| force.abs() < 1.0));
}

#[test]
fn an_experiment_is_run_recorded_and_summarised() {
    let bench = Bench::new();
    let (parent, out) = folder();
    let file = parent.path().join("short.toml");
    let text_of = "name = \"short\"\nduration_s = 1.0\n\
        [[m1]]\nstart_s = 0.0\ntorque_fraction = 0.4\n\
        [[m2]]\nstart_s = 0.0\nspeed_rad_s = 0.0\n[[m2]]\nstart_s = 0.4\nspeed_rad_s = 2.0\n";
    std::fs::write(&file, text_of).unwrap();
    let arguments = ["run", "--experiment", file.to_str().unwrap(), "--out", out.to_str().unwrap()];
    let output = bench.rig(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("turn its arm switch off and on"));
    let log = Log::read(&out.join("log.csv")).unwrap();
    assert_eq!(log.time_s().last().copied(), Some(0.999));
    assert!(log.signal(Signal::FrictionTorque).unwrap().iter().any(|torque| *torque > 1.0));
    let summary = std::fs::read_to_string(out.join("summary.json")).unwrap();
    assert!(summary.contains("\"deadline_misses\": 0"), "{summary}");
}

#[test]
fn watching_shows_mode_and_values() {
    let bench = Bench::new();
    let output = bench.rig(&["monitor", "--seconds", "1.2"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("disabled"), "{}", text(&output.stdout));
    assert!(text(&output.stderr).contains("firmware"));
}

#[test]
fn the_screen_shows_the_rig_fits_its_terminal_and_leaves_it_as_it_was() {
    let bench = Bench::new();
    let terminal = crate::fake_rig::terminal::Terminal::new(24, 80);
    let mut command = bench.command(&["monitor", "--port", &bench.port]);
    let mut child = terminal.spawn(&mut command);
    let shown = |screen: &vt100::Screen| {
        let text = screen.contents();
        let words = [
            "DISABLED",
            "normal force",
            "friction",
            "speed",
            "residual",
            "no fault",
            "0 rows lost",
            "q quit",
        ];
        words.iter().all(|words| text.contains(words))
    };
    let text = terminal.wait_for(shown);
    assert!(text.lines().count() <= 24 && text.lines().all(|line| line.chars().count() <= 80), "{text}");
    terminal.resize(40, 120);
    let text = terminal.wait_for(|screen| screen.contents().lines().count() > 30 && shown(screen));
    assert!(text.contains("last 10 s"), "{text}");
    terminal.press(b"-");
    terminal.wait_for(|screen| screen.contents().contains("last 5 s"));
    terminal.press(b"q");
    assert!(child.wait().unwrap().success());
    terminal.wait_for(|screen| !screen.alternate_screen() && !screen.hide_cursor());
    assert_eq!(bench.rig.lock().unwrap().every_ticks, 0, "telemetry is switched off again");
}
