//! The files that `rig predict` writes.
#![allow(clippy::unwrap_used)]

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
