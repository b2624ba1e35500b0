//! The list of settings is sound, and an uploaded experiment is the one that was sent.
#![allow(clippy::unwrap_used)]
use heapless::String;
use model_core::control::{ControlSettings, Experiment, M1Mode, M2Mode, Segment, Shape};
use model_core::extension::{Extension, MOST_VALUES};
use model_core::friction::{FrictionParameters, MOST_PARAMETERS, ModelKind};
use rig_link::capture::CaptureRow;
use rig_link::frame::{MAX_FRAME, encode};
use rig_link::message::{Command, Request};
use rig_link::model::{EffectRecord, FrictionRecord, MOST_EFFECTS, ModelRecord};
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
fn a_friction_model_goes_to_the_observer_and_back_unchanged() {
    let settings = ControlSettings::default();
    let elements =
        ModelKind::ALL.iter().map(|kind| FrictionRecord::from(&FrictionParameters::typical(*kind)));
    let patch = ModelRecord::default().friction.patch_like(0.01, 88.0).unwrap();
    for friction in elements.chain([patch]) {
        assert_eq!(FrictionRecord::from(&friction.parameters().unwrap()), friction);
        let record = ModelRecord { friction, ..ModelRecord::default() };
        assert!(record.prepare(&settings).is_ok());
    }
    let refused = |friction| {
        ModelRecord { friction, ..ModelRecord::default() }.prepare(&settings).map_err(|error| error.name)
    };
    let brush = FrictionParameters::typical(ModelKind::Brush);
    assert_eq!(refused((&brush.with("mu_s", 0.5)).into()), Err("mu_s"));
    let unknown = FrictionRecord { kind: String::try_from("glue").unwrap(), ..(&brush).into() };
    assert_eq!(refused(unknown), Err("kind"));
    let short = FrictionRecord { values: heapless::Vec::new(), ..(&brush).into() };
    assert_eq!(refused(short), Err("brush"));
}

#[test]
fn an_extended_model_is_prepared_with_its_effects_or_says_what_is_wrong_with_them() {
    let settings = ControlSettings::default();
    let effect = |id: &str, values: &[f32]| EffectRecord {
        id: String::try_from(id).unwrap(),
        values: heapless::Vec::from_slice(values).unwrap(),
    };
    let with = |record: EffectRecord| {
        let effects = heapless::Vec::from_slice(&[record]).unwrap();
        ModelRecord { effects, ..ModelRecord::default() }.prepare(&settings)
    };
    let count = Extension::ViscousFilm.names().len();
    let extended = with(effect("viscous_film", &vec![2.0; count])).unwrap();
    assert_ne!(extended, ModelRecord::default().prepare(&settings).unwrap());
    assert_eq!(with(effect("viscous_film", &[])).map_err(|error| error.name), Err("viscous_film"));
    assert_eq!(with(effect("witchcraft", &[1.0])).map_err(|error| error.name), Err("extension.id"));
}

#[test]
fn the_longest_model_fits_a_frame() {
    let effect = EffectRecord {
        id: String::try_from("encoder_eccentricity").unwrap(),
        values: heapless::Vec::from_slice(&[1.0; MOST_VALUES]).unwrap(),
    };
    let effects = heapless::Vec::from_slice(&vec![effect; MOST_EFFECTS]).unwrap();
    let kind = String::try_from("a".repeat(20).as_str()).unwrap();
    let friction =
        FrictionRecord { kind, values: heapless::Vec::from_slice(&[1.0; MOST_PARAMETERS]).unwrap() };
    let model = ModelRecord { friction, effects };
    assert!(ModelKind::ALL.iter().all(|kind| kind.name().len() <= 20));
    let request = Request { id: 1, command: Command::ModelSet(model) };
    assert!(encode(&request, &mut [0; MAX_FRAME]).is_ok());
}

#[test]
fn a_stored_model_of_another_firmware_is_left_out_with_the_reason() {
    let settings = ControlSettings::default();
    let mut buffer = [0; 512];
    let mut stored = |record: &ModelRecord| postcard::to_slice(record, &mut buffer).unwrap().to_vec();
    let good = ModelRecord::default();
    assert_eq!(ModelRecord::from_stored(&stored(&good), &settings), Ok(good.clone()));
    // Cut short; a kind of a later version; a parameter more than this one has.
    let bytes = stored(&good);
    assert_eq!(ModelRecord::from_stored(&bytes[..bytes.len() / 2], &settings).unwrap_err().name, "model");
    let mut later = good.clone();
    later.friction.kind = String::try_from("tachyonic").unwrap();
    assert_eq!(ModelRecord::from_stored(&stored(&later), &settings).unwrap_err().name, "kind");
    let mut longer = good;
    longer.friction.values.push(1.0).unwrap();
    assert!(ModelRecord::from_stored(&stored(&longer), &settings).is_err());
}
