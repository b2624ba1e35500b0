//! The drive's side of the diagnosis on the measured record of EMPS (Janot, Gautier and Brunot, 2019): fitted
//! on one half of the time, judged on the other. Skipped where the record is not on the machine.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};

use host_sim::diagnose::analysis::{Analysis, Fit, Role};
use host_sim::diagnose::drive::DriveAnalysis;
use host_sim::files::log::{Cells, Log};

fn measured() -> Option<Log> {
    let shared = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/emps_train.csv");
    let path = std::env::var_os("EMPS_TRAIN_CSV").map_or(shared, PathBuf::from);
    if !path.is_file() {
        eprintln!("skipped: {} is not here; EMPS_TRAIN_CSV may name it", path.display());
        return None;
    }
    Some(Log::read(&path).unwrap())
}

fn part(log: &Log, from: usize, to: usize) -> Log {
    let mut part = log.clone();
    for column in &mut part.columns {
        if let Cells::Numbers(values) = &mut column.cells {
            *values = values[from..to].to_vec();
        }
    }
    part
}

/// Held-out error on the samples that count, and on all of them, standstill and reversals too.
fn errors(fit: &Fit) -> (f64, f64) {
    let (mut error, mut signal) = (0.0, 0.0);
    for log in fit.logs.iter().filter(|log| log.role == Role::Holdout) {
        error += log.measured.iter().zip(&log.predicted).map(|(y, x)| (y - x).powi(2)).sum::<f64>();
        signal += log.measured.iter().map(|y| y * y).sum::<f64>();
    }
    (fit.nrmse(Role::Holdout).unwrap(), (error / signal).sqrt())
}

#[test]
fn half_of_the_record_explains_the_other_by_asymmetry_the_screws_turn_and_presliding() {
    let Some(log) = measured() else { return };
    let (middle, end) = (log.len() / 2, log.len());
    let halves = [part(&log, 0, middle), part(&log, middle, end)];
    for (fitted, judged) in [(0, 1), (1, 0)] {
        let logs = [(&halves[fitted], Role::Train), (&halves[judged], Role::Holdout)];
        let analysis = DriveAnalysis::new(&logs).unwrap();
        let mut fit = analysis.fit(&[], None).unwrap();
        let baseline = errors(&fit);
        let effects = ["bearing_asymmetry", "m2_ripple", "presliding"];
        let mut last = baseline.0;
        println!("baseline: {:.2} %, at all samples {:.2} %", 100.0 * baseline.0, 100.0 * baseline.1);
        for count in 1..=effects.len() {
            fit = analysis.fit(&effects[..count], Some(&fit)).unwrap();
            let (moving, all) = errors(&fit);
            println!(
                "with {}: {:.2} %, at all samples {:.2} %",
                effects[count - 1],
                100.0 * moving,
                100.0 * all
            );
            // Each of them must help on the half that it was not fitted to.
            assert!(moving < 0.97 * last, "{}: {moving} after {last}", effects[count - 1]);
            last = moving;
        }
        // Published, on the record that it was fitted to and at all samples: 3.11 % with the asymmetry alone.
        assert!(last < 0.021, "{last}");
        // The ball screw's pitch is 2.5 mm; the spectrum's lines over 0.2 m are 0.5 % apart.
        let pitch_m = fit.get(Some("m2_ripple"), "wavelength_1_m").unwrap().value;
        assert!((pitch_m / 2.5e-3 - 1.0).abs() < 5e-3, "{pitch_m}");
        // Mass: published 95.1 kg.
        assert!((fit.get(None, "mass_kg").unwrap().value / 95.1 - 1.0).abs() < 0.01);
    }
}
