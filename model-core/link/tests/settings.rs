//! The list of settings is sound, and an uploaded experiment is the one that was sent.
#![allow(clippy::unwrap_used)]
use model_core::control::{
    ControlSettings, Experiment, M1Mode, M2Mode, ModelParameters, ObserverModel, Segment, Shape,
};
use rig_link::capture::CaptureRow;
use rig_link::model::ModelRecord;
use rig_link::program::{Incomplete, Upload, header, segments};
use rig_link::settings::{ALL, NotWhole, by_key, by_name};

#[test]
fn keys_rise_and_names_are_found_by_both() {
    assert!(ALL.windows(2).all(|pair| pair[0].key < pair[1].key));
    for setting in ALL {
        assert_eq!(by_key(setting.key).map(|found| found.name), Some(setting.name));
        assert_eq!(by_name(setting.name).map(|found| found.key), Some(setting.key));
    }
}

#[test]
fn every_setting_reads_back_what_was_written_and_changes_nothing_else() {
    let defaults = ControlSettings::default();
    for setting in ALL {
        let old = setting.get(&defaults);
        let new = if setting.unit == "0 or 1" { 1.0 - old } else { old + 1.0 };
        let mut settings = defaults;
        setting.set(&mut settings, new).unwrap();
        assert_eq!(setting.get(&settings).to_bits(), new.to_bits(), "{}", setting.name);
        assert_ne!(settings, defaults, "{}", setting.name);
        setting.set(&mut settings, old).unwrap();
        assert_eq!(settings, defaults, "{}", setting.name);
    }
}

#[test]
fn a_whole_number_is_not_rounded_into_place() {
    let mut settings = ControlSettings::default();
    let counts = by_name("m1_encoder.counts_per_rev").unwrap();
    for bad in [0.5, -1.0, f32::NAN, f32::INFINITY, 16_777_216.0] {
        assert_eq!(counts.set(&mut settings, bad), Err(NotWhole), "{bad}");
    }
    let code = by_name("friction_bridge.open_code").unwrap();
    assert_eq!(code.set(&mut settings, 65536.0), Err(NotWhole));
    let reversed = by_name("m1.reversed").unwrap();
    assert_eq!(reversed.set(&mut settings, 2.0), Err(NotWhole));
    assert_eq!(settings, ControlSettings::default());
}

fn experiment() -> Experiment {
    let mut experiment = Experiment { duration_ticks: 50_000, ..Experiment::default() };
    for (start_tick, value) in [(0, 0.44), (40_000, 3.2)] {
        let segment = Segment { start_tick, mode: M1Mode::Torque, shape: Shape::Constant { value } };
        experiment.m1.push(segment).unwrap();
    }
    let ramp = Shape::Ramp { from: 0.0, to: 3.0, ticks: 100 };
    let sine = Shape::Sine { offset: 0.1, amplitude: 2.4, angular_frequency_rad_s: 2.0, phase_rad: 0.2 };
    experiment.m2.push(Segment { start_tick: 0, mode: M2Mode::Speed, shape: ramp }).unwrap();
    experiment.m2.push(Segment { start_tick: 500, mode: M2Mode::Torque, shape: sine }).unwrap();
    experiment
}

#[test]
fn an_experiment_sent_in_pieces_arrives_whole() {
    let sent = experiment();
    let mut upload = Upload::default();
    upload.begin(header(&sent));
    for segment in segments(&sent) {
        assert_eq!(upload.complete(), Err(Incomplete));
        upload.push(&segment).unwrap();
    }
    assert_eq!(upload.complete(), Ok(&sent));
    // A second upload starts from nothing.
    upload.begin(header(&sent));
    assert_eq!(upload.complete(), Err(Incomplete));
}

#[test]
fn an_upload_with_a_missing_or_an_extra_segment_is_refused() {
    let sent = experiment();
    let all: Vec<_> = segments(&sent).collect();
    let mut upload = Upload::default();
    assert_eq!(upload.push(&all[0]), Err(Incomplete));
    for missing in 0..all.len() {
        upload.begin(header(&sent));
        let refused =
            all.iter().enumerate().filter(|(i, _)| *i != missing).any(|(_, s)| upload.push(s).is_err());
        assert!(refused || upload.complete().is_err(), "without {missing}");
    }
    upload.begin(header(&sent));
    assert!(all.iter().all(|segment| upload.push(segment).is_ok()));
    assert_eq!(upload.push(&all[3]), Err(Incomplete));
    assert_eq!(upload.complete(), Err(Incomplete));
}

#[test]
fn a_capture_row_reads_back_from_its_bytes() {
    let row = CaptureRow {
        friction_bridge: 1,
        normal_bridge: 2,
        m1_torque: 3,
        m2_torque: 4,
        supply: 5,
        m1_count: 6,
        m2_count: 0xFFFF,
        m1_dac: 4095,
        m2_dac: 2048,
        predicted_mnm: -32768,
        m2_speed_ref_crad_s: -1,
        state: 0x0293,
    };
    let mut bytes = [0; CaptureRow::BYTES];
    for (chunk, word) in bytes.chunks_exact_mut(4).zip(row.to_words()) {
        chunk.copy_from_slice(&word.to_le_bytes());
    }
    assert_eq!(CaptureRow::from_bytes(&bytes), row);
    assert_eq!((row.mode(), row.fault()), (3, 41));
}

#[test]
fn a_model_goes_to_the_observer_and_back_unchanged() {
    let ModelRecord::Series { bristles, .. } = ModelRecord::default() else { panic!("a series element") };
    for record in [
        ModelRecord::default(),
        ModelRecord::Brush { c_n_per_m: 3e4, mu_s: 1.2, mu_c: 0.8 },
        ModelRecord::Lugre(bristles),
        ModelRecord::ModifiedLugre(bristles),
    ] {
        let parameters = ModelParameters::from(&record);
        assert_eq!(ModelRecord::from(&parameters), record);
        assert!(ObserverModel::new(&parameters, 1e-4).is_ok());
    }
    let broken = ModelRecord::Brush { c_n_per_m: 3e4, mu_s: 0.5, mu_c: 0.8 };
    let refused = ObserverModel::new(&(&broken).into(), 1e-4);
    assert_eq!(refused.map_err(|error| error.name), Err("mu_s"));
}
