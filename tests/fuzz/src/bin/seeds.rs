//! Writes the seeds of the fuzzers' corpora anew: requests as they are sent, scripts of commands, files as they are shipped.

use host_sim::files::log::Log;
use rig_link::capture::CaptureTrigger;
use rig_link::frame::{MAX_FRAME, encode};
use rig_link::message::{Command, Request};
use rig_link::model::ModelRecord;
use rig_link::program::{ProgramHeader, ProgramMode, ProgramSegment, ProgramShape};
use std::fs;
use std::path::{Path, PathBuf};

fn frame(command: Command) -> Vec<u8> {
    let mut out = [0; MAX_FRAME];
    let length = encode(&Request { id: 300, command }, &mut out).expect("a request fits");
    out[..length].to_vec()
}

fn body(command: Command) -> Vec<u8> {
    let mut out = [0; 512];
    postcard::to_slice(&Request { id: 1, command }, &mut out).expect("a request fits").to_vec()
}

/// A request in a script of commands.
fn sent(command: Command) -> Vec<u8> {
    let body = body(command);
    let mut script = vec![7, u8::try_from(body.len()).expect("it is short")];
    script.extend(body);
    script
}

fn program() -> (ProgramHeader, Vec<ProgramSegment>) {
    let segment = |start_tick, mode, shape| ProgramSegment { start_tick, mode, shape };
    let header = ProgramHeader { duration_ticks: 2_000, m1_segments: 2, m2_segments: 3 };
    let segments = vec![
        segment(0, ProgramMode::M1Torque, ProgramShape::Constant { value: 0.5 }),
        segment(500, ProgramMode::M1Torque, ProgramShape::Ramp { from: 0.5, to: 2.0, ticks: 100 }),
        segment(0, ProgramMode::M2Speed, ProgramShape::Constant { value: 0.0 }),
        segment(
            300,
            ProgramMode::M2Speed,
            ProgramShape::Sine { offset: 1.0, amplitude: 2.0, angular_frequency_rad_s: 6.0, phase_rad: 0.0 },
        ),
        segment(900, ProgramMode::M2Torque, ProgramShape::Constant { value: 1.0 }),
    ];
    (header, segments)
}

fn main() -> std::io::Result<()> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let put = |target: &str, name: &str, bytes: &[u8]| {
        let folder = here.join("corpus").join(target);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(name), bytes)
    };
    let (header, segments) = program();
    let commands = [
        ("hello", Command::Hello),
        ("arm", Command::Arm),
        ("start", Command::Start),
        ("begin", Command::ProgramBegin(header)),
        ("segment", Command::ProgramSegment(segments[3])),
        ("set", Command::SettingSet { key: 143, value: 24.0 }),
        ("model", Command::ModelSet(ModelRecord::default())),
        ("capture", Command::CaptureArm(CaptureTrigger::FrictionAbove { code: 40_000 })),
        ("read", Command::CaptureRead { offset: 480 }),
        ("self_check", Command::SelfCheck { case: 1, steps: 2_000 }),
    ];
    for (name, command) in commands {
        put("frames", name, &frame(command))?;
    }
    // From power-on: off until the self-check is over and the switch was seen off; on; armed; a program; started; ticks with
    // the host heard.
    let mut script = vec![0, 0, 255, 0, 255, 0, 255, 0, 255, 0, 255, 2, 1, 1];
    script.extend(sent(Command::ProgramBegin(header)));
    for segment in &segments {
        script.extend(sent(Command::ProgramSegment(*segment)));
    }
    script.extend(sent(Command::ProgramCommit));
    script.extend([6, 0, 0, 10, 6, 1, 6, 2, 0, 30, 6, 2, 0, 200]);
    put("commands", "run", &script)?;
    // After the self-check.
    let mut armed = vec![1, 2, 1, 1, 6, 0, 0, 5];
    put("commands", "armed", &armed)?;
    armed.extend([2, 7, 0, 3, 2, 0, 1, 6, 3, 2, 1, 1, 6, 0, 0, 9]);
    put("commands", "stopped_and_cleared", &armed)?;
    let mut setting = vec![1];
    setting.extend(sent(Command::SettingSet { key: 143, value: 20.0 }));
    put("commands", "settings", &setting)?;

    let mut out = [0; 2048];
    let mut bytes = postcard::to_slice(&ModelRecord::default(), &mut out).expect("it fits").to_vec();
    bytes.extend(postcard::to_slice(&header, &mut out).expect("it fits").to_vec());
    for segment in &segments {
        bytes.extend(postcard::to_slice(segment, &mut out).expect("it fits").to_vec());
    }
    put("upload", "program", &bytes)?;
    put("upload", "model", postcard::to_slice(&ModelRecord::default(), &mut out).expect("it fits"))?;

    let host = here.join("../../host-sim");
    let shipped: [(&str, PathBuf); 4] = [
        ("rig", host.join("rigs/assumed.toml")),
        ("model", host.join("models/assumed.toml")),
        ("fig20", host.join("src/experiments/fig20.toml")),
        ("fig23", host.join("src/experiments/fig23.toml")),
    ];
    for (name, path) in shipped {
        put("toml", name, &fs::read(path)?)?;
    }
    let csv = log();
    put("csv", "contact", csv.as_bytes())?;
    put("csv", "gaps", b"time_s,friction_torque_nm\n0.0,1.0\n0.001,\n0.002,nan\n")?;
    let log = Log::parse_csv("seed.csv", csv.as_bytes()).expect("it is a log");
    put("parquet", "contact", &log.to_parquet().expect("it can be written"))?;
    Ok(())
}

/// A few rows as the host tool writes them.
fn log() -> String {
    let mut text = "time_s,normal_force_n,m2_speed_rad_s,friction_torque_nm\n".to_owned();
    for row in 0..8 {
        let t = f64::from(row) * 1e-3;
        text += &format!("{t},{},{},{}\n", 88.0 + t, 3.14, 2.5 - t);
    }
    text
}
