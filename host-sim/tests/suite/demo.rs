//! The demo's runs, its page and the figure of the README; `rig simulate` from the outside.

use std::path::Path;
use std::process::{Command, Output};
use std::sync::LazyLock;

use host_sim::demo::{Demo, demo, figure};
use host_sim::files::log::Log;
use host_sim::report::Role;

fn rig(arguments: &[&str], folder: &Path) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).current_dir(folder).output().unwrap()
}

/// A step of the progress: done, of so many, what is next.
type Told = (usize, usize, String);

/// The demo, made once for all who look at it, and the progress that it told.
fn made() -> &'static (Demo, Vec<Told>) {
    static MADE: LazyLock<(Demo, Vec<Told>)> = LazyLock::new(|| {
        let mut progress = Vec::new();
        let made = demo(|done, total, what| progress.push((done, total, what.to_string()))).unwrap();
        (made, progress)
    });
    &MADE
}

#[test]
fn simulate_writes_log_summary_and_page_and_a_second_run_the_same_log() {
    let root = tempfile::tempdir().unwrap();
    let experiment = [
        "simulate",
        "--experiment",
        "fig20",
        "--set",
        "experiment.m1.1.start_s=1.0",
        "experiment.m2.1.start_s=0.5",
        "experiment.duration_s=2.5",
        "--out",
    ];
    for out in ["a", "b"] {
        let output = rig(&[&experiment[..], &[out]].concat(), root.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    }
    let read = |name: &str| std::fs::read_to_string(root.path().join(name)).unwrap();
    assert!(read("a/log.csv") == read("b/log.csv"));
    // The pages differ in the command line and the day that they end with, and are small enough to be mailed.
    let page = |name: &str| read(name).split("<footer>").next().map(str::to_owned);
    assert!(page("a/report.html") == page("b/report.html"));
    let html = read("a/report.html");
    assert!(html.len() < 2_000_000, "{} bytes", html.len());
    assert!(
        html.contains("<footer>") && html.contains("--experiment fig20") && html.contains("<noscript><svg")
    );
    let log = Log::read(&root.path().join("a/log.csv")).unwrap();
    assert_eq!(log.len(), 2500);
    assert_eq!(log.metadata("experiment"), Some("fig20"));
    let contact = log.contact().unwrap();
    assert!(contact.friction_torque_nm[2400] > 4.0 && contact.m2_speed_rad_s[2400] > 3.0);
    let summary: serde_json::Value = serde_json::from_str(&read("a/summary.json")).unwrap();
    assert!(summary["friction_overshoot"].as_f64().unwrap() > 0.05);
    assert_eq!(summary["simulated_s"], 2.5);
    assert!(summary["control_ticks"].as_u64().unwrap() > 25_000);
}

#[test]
fn studies_write_their_curves_and_need_a_series_element() {
    let root = tempfile::tempdir().unwrap();
    for (name, rows) in [("fig26", 200), ("fig27", 60)] {
        let output = rig(&["simulate", "--experiment", name, "--out", name], root.path());
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        let curves = std::fs::read_to_string(root.path().join(name).join("curves.csv")).unwrap();
        assert_eq!(curves.lines().count(), rows + 1);
        assert!(root.path().join(name).join("report.html").exists());
    }
    std::fs::write(
        root.path().join("lugre.toml"),
        "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 1e6\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n",
    )
    .unwrap();
    let output =
        rig(&["simulate", "--experiment", "fig26", "--model", "lugre.toml", "--out", "x"], root.path());
    assert_eq!(output.status.code(), Some(2));
    let said = String::from_utf8(output.stderr).unwrap();
    assert_eq!(said.lines().count(), 1, "{said}");
    assert!(said.contains("lugre.toml: kind = lugre") && said.contains("allowed: series"), "{said}");
    assert!(!root.path().join("x").exists());
}

#[test]
fn simulate_with_another_model_on_the_disc_does_not_overshoot_like_the_series_element() {
    let root = tempfile::tempdir().unwrap();
    std::fs::write(
        root.path().join("lugre.toml"),
        "kind = \"lugre\"\n[parameters]\nsigma0_n_per_m = 3e4\na0 = 0.5\na1 = 0.7\nv0_m_s = 0.5\n",
    )
    .unwrap();
    let output =
        rig(&["simulate", "--experiment", "fig18", "--model", "lugre.toml", "--out", "l"], root.path());
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let summary = std::fs::read_to_string(root.path().join("l/summary.json")).unwrap();
    let summary: serde_json::Value = serde_json::from_str(&summary).unwrap();
    // What noise of 4 mN·m adds to the peak of 5.2 N·m over half a minute's worth of samples.
    assert!(summary["friction_overshoot"].as_f64().unwrap() < 0.01, "{summary}");
}

#[test]
fn what_the_controller_cannot_do_is_refused_with_one_line() {
    let root = tempfile::tempdir().unwrap();
    let refused = |arguments: &[&str], expected: &str| {
        let output = rig(arguments, root.path());
        assert_eq!(output.status.code(), Some(2));
        let said = String::from_utf8(output.stderr).unwrap();
        assert!(said.lines().count() == 1 && said.contains(expected), "{said}");
        assert!(!root.path().join("out").exists());
    };
    let fig18 = ["simulate", "--experiment", "fig18", "--out", "out", "--set"];
    refused(&[&fig18[..], &["experiment.m2.1.speed_rpm=3000"]].concat(), "speed");
    refused(&[&fig18[..], &["rig.geometry.friction_radius_m=-1"]].concat(), "friction_radius_m");
    refused(&[&fig18[..], &["model.parameters.k_u_n_per_m=-3"]].concat(), "k_u_n_per_m");
}

/// Those that take long: `cargo verify` runs them, and `cargo test long:: -- --ignored`.
mod long {
    use super::*;

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn the_case_study_names_the_block_that_lugre_lacks() {
        let (made, _) = made();
        assert_eq!(made.case_study.diagnosis.verdict, "named", "{}", made.case_study.diagnosis.sentence);
        let causes: Vec<&str> =
            made.case_study.diagnosis.causes.iter().map(|cause| cause.id.as_str()).collect();
        assert_eq!(causes, ["element_compliance"]);
        assert!(made.case_study.diagnosis.extended.gain.unwrap() > 0.4, "{}", made.case_study.found());
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn the_readme_shows_what_the_demo_prints() {
        let readme = Path::new(env!("CARGO_MANIFEST_DIR")).join("../README.md");
        let readme = std::fs::read_to_string(readme).unwrap();
        let printed = readme.split("figure   what must").nth(1).unwrap().split("\n\nreport:").next().unwrap();
        let (made, _) = made();
        assert_eq!(made.table.trim_end(), format!("figure   what must{printed}"));
    }

    #[test]
    #[ignore = "long: cargo verify runs it"]
    fn the_demo_tells_the_models_apart_and_remakes_the_figure_of_the_readme_byte_by_byte() {
        let (made, progress) = made();
        assert!(
            progress.windows(2).all(|w| w[1].0 > w[0].0) && progress.last().unwrap().0 == progress[0].1,
            "{progress:?}"
        );

        let figure = figure::overshoot_svg(&made.runs).unwrap();
        let committed = include_str!("../../figures/overshoot.svg");
        assert!(
            figure == committed,
            "remake it: cargo demo, then copy target/demo/overshoot.svg to host-sim/figures/"
        );

        for c in &made.runs.comparisons {
            for candidate in &c.candidates {
                let (name, o) = (candidate.model.name, candidate);
                match candidate.model.role {
                    Role::Series => assert!(o.constant_overshoot > 0.1 && o.closed_overshoot > 0.1, "{name}"),
                    Role::Brush => assert!(o.constant_overshoot > 0.1, "{name}"),
                    _ => assert!(o.constant_overshoot.abs() < 1e-4, "{name}: {}", o.constant_overshoot),
                }
                // Driven by the rig's own motion the series element must give the rig's own friction.
                if candidate.model.role == Role::Series {
                    let error: f64 = o.open_nm.iter().zip(&o.closed_nm).map(|(a, b)| (a - b) * (a - b)).sum();
                    let power: f64 = o.closed_nm.iter().map(|b| b * b).sum();
                    let nrmse = (error / power).sqrt();
                    assert!(nrmse < 2e-3, "{} rpm: {nrmse}", c.rpm);
                }
            }
        }

        let html = made.page.to_html();
        assert!(html.contains("What a model without the block gets wrong"));
        for name in
            ["Fig. 18", "Fig. 21", "Fig. 22", "Fig. 23", "Fig. 26", "Fig. 27", "Five models at 120 rpm"]
        {
            assert!(html.contains(name), "{name}");
        }
        // It loads fast enough only while it stays small.
        assert!(html.len() < 12_000_000, "{} bytes", html.len());
        assert_eq!(made.table.lines().count(), 12);
    }
}
