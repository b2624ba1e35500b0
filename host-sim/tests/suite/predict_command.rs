//! The files that `rig predict` writes.

use std::fs;
use std::path::Path;
use std::process::Command;

use host_sim::files::log::Log;

/// Constant sliding: friction is that of the curve, so the prediction is known without a simulator.
fn constant_sliding() -> String {
    let g = 0.5 + 0.7 * (-(0.06_f64 / 0.5).sqrt()).exp();
    let torque = 80.0 * g * 0.06;
    let mut text =
        "time_s,m2_speed_rad_s,normal_force_n,friction_torque_nm,m1_torque_nm,m2_torque_nm\n".to_string();
    for i in 0..500 {
        let m1 = (80.0 + 8.0) / 30.0;
        text += &format!("{},1,80,{torque},{m1},{}\n", f64::from(i) * 1e-3, torque + 0.15 + 0.005);
    }
    text
}

fn predict(folder: &Path, out: &str) -> String {
    fs::write(folder.join("log.csv"), constant_sliding()).unwrap();
    let model = "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1e6\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n";
    fs::write(folder.join("model.toml"), model).unwrap();
    let arguments = ["predict", "--model", "model.toml", "--log", "log.csv", "--out", out];
    let output =
        Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}

#[test]
fn the_prediction_holds_measured_predicted_and_residual_of_every_signal() {
    let folder = tempfile::tempdir().unwrap();
    let said = predict(folder.path(), "out");
    assert!(said.contains("friction"), "{said}");
    let table = Log::read(&folder.path().join("out/prediction.csv")).unwrap();
    let column = |name: &str| table.numbers(name).unwrap_or_else(|| panic!("{name}")).to_vec();
    for (measured, predicted, residual) in [
        ("measured", "predicted", "residual"),
        ("normal_force_measured_n", "normal_force_predicted_n", "normal_force_residual_n"),
        ("m2_torque_measured_nm", "m2_torque_predicted_nm", "m2_torque_residual_nm"),
    ] {
        let (measured, predicted, residual) = (column(measured), column(predicted), column(residual));
        assert_eq!(measured.len(), 500);
        for i in 0..500 {
            assert_eq!(residual[i], measured[i] - predicted[i]);
            // Steady state to rounding.
            assert!(residual[i].abs() <= 1e-9 * measured[i].abs(), "{i}: {} {}", measured[i], predicted[i]);
        }
    }
    let summary: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.path().join("out/summary.json")).unwrap()).unwrap();
    for subsystem in ["friction", "pressure", "drive"] {
        assert!(summary["nrmse"][subsystem].as_f64().is_some_and(|x| x < 1e-9), "{summary}");
    }
    // Steady sliding: the observed slip is the root's speed, but for the curve's table (4e-5 of a coefficient).
    assert!(summary["nrmse_by_observed_slip"].as_f64().is_some_and(|x| x < 1e-3), "{summary}");
    assert_eq!(column("predicted_by_observed_slip").len(), 500);
}

/// A linear stage whose force is known: M q̈ + Fv q̇ + Fc sign q̇ + offset, seen 2 ms before the motion that it makes.
fn stage() -> String {
    let mut text = "time_s,force_n,position_m\n".to_string();
    for i in 0..6000 {
        let t = 1e-3 * f64::from(i);
        let position = 0.05 * (4.0 * t).sin();
        let ahead = 4.0 * (t + 2e-3);
        let (speed, acceleration) = (0.2 * ahead.cos(), -0.8 * ahead.sin());
        let force = 95.0 * acceleration + 200.0 * speed + 20.0 * speed.signum() - 3.0;
        text += &format!("{t},{force},{position}\n");
    }
    text
}

#[test]
fn every_model_that_fit_writes_for_a_drive_is_predicted_with_the_error_that_fit_found() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let rig = |arguments: &[&str]| {
        Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).current_dir(folder.path()).output().unwrap()
    };
    let nrmse = |out: &str, key: &str| {
        let text = fs::read_to_string(path(out).join("summary.json")).unwrap();
        serde_json::from_str::<serde_json::Value>(&text).unwrap()[key].clone()
    };
    let done = |output: std::process::Output| {
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    fs::write(path("stage.csv"), stage()).unwrap();
    done(rig(&["fit", "--train", "stage.csv", "--out", "fit"]));
    done(rig(&["predict", "--model", "fit/model.toml", "--log", "stage.csv", "--out", "plain"]));
    let fitted = nrmse("fit", "symmetric")["nrmse"].as_f64().unwrap();
    let directed = nrmse("fit", "per_direction")["nrmse"].as_f64().unwrap();
    let predicted = nrmse("plain", "nrmse");
    // The file's numbers read back as they were written.
    assert!((predicted["drive"].as_f64().unwrap() / fitted - 1.0).abs() < 1e-9, "{predicted} {fitted}");
    assert!((predicted["drive_per_direction"].as_f64().unwrap() / directed - 1.0).abs() < 1e-9);
    let table = Log::read(&path("plain/prediction.csv")).unwrap();
    for name in ["measured", "predicted", "residual", "predicted_per_direction"] {
        assert!(table.numbers(name).unwrap().len() > 500, "{name}");
    }

    let known = "kind = \"drive\"\n[parameters]\nmass_kg = 95.0\nviscous_n_s_per_m = 200.0\ncoulomb_n = 20.0\n\
                 [[extension]]\nid = \"drive_delay\"\ndelay_s = 0.002\n\
                 [[extension]]\nid = \"torque_offset\"\noffset_n = -3.0\n\
                 [[extension]]\nid = \"shaft_torsion\"\nmode_hz = 50.0\n";
    fs::write(path("known.toml"), known).unwrap();
    done(rig(&["predict", "--model", "known.toml", "--log", "stage.csv", "--out", "known"]));
    let error = nrmse("known", "nrmse")["drive"].as_f64().unwrap();
    // What is left is the force's jump at reversals, which the position's filter rounds off.
    assert!(error < 0.02 && error < 0.5 * fitted, "{error} {fitted}");
    assert_eq!(nrmse("known", "effects_not_applied")[0], "shaft_torsion");

    let output = rig(&["predict", "--model", "known.toml", "--log", "fit/prediction.csv", "--out", "no"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(!path("no").exists());
}

#[test]
fn two_runs_write_the_same_bytes() {
    let folder = tempfile::tempdir().unwrap();
    for out in ["a", "b"] {
        predict(folder.path(), out);
    }
    for name in ["prediction.csv", "summary.json"] {
        let read = |out: &str| fs::read(folder.path().join(out).join(name)).unwrap();
        assert!(read("a") == read("b"), "{name}");
    }
}

#[test]
fn every_subcommand_teaches_by_an_example_and_units() {
    let help = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).output().unwrap();
        assert!(output.status.success());
        String::from_utf8(output.stdout).unwrap()
    };
    assert!(help(&["--help"]).contains("SI units"));
    let text = help(&["predict", "--help"]);
    assert!(text.contains("Example:\n  rig predict --rig rig.toml") && text.contains("N m"), "{text}");
}

/// The steps of speed and load of figures 18 and 21: of 16 s some ten milliseconds show the block's damping, and the
/// torque ring rings in them between the samples. Sensors, encoders and bridges are those of the assumed rig.
#[test]
fn the_papers_steps_show_stiffness_and_damping_of_the_block() {
    let root = tempfile::tempdir().unwrap();
    let rig = |arguments: &[&str]| {
        let output = Command::new(env!("CARGO_BIN_EXE_rig"))
            .args(arguments)
            .current_dir(root.path())
            .output()
            .unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    for figure in ["fig18", "fig21"] {
        rig(&["simulate", "--experiment", figure, "--out", figure]);
    }
    rig(&["fit", "--train", "fig18/log.csv", "fig21/log.csv", "--out", "fit"]);
    let text = fs::read_to_string(root.path().join("fit/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&text).unwrap();
    assert_eq!(summary["fitted_by_simulation"], true, "{text}");
    for (name, truth, most) in [("k_u_n_per_m", 3e4, 0.01), ("c_u_n_s_per_m", 160.0, 0.05)] {
        let interval = &summary["parameters"][name];
        let number = |key: &str| interval[key].as_f64().unwrap();
        assert!(number("low_95") < truth && truth < number("high_95"), "{name}: {interval}");
        assert!((number("value") / truth - 1.0).abs() < most, "{name}: {interval}");
    }
}
