//! Logs as other tools export them, each imported with the one command of `docs/own-logs.md`; and units that people mix
//! up, as a user meets them.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};

use host_sim::files::log::Log;

const RAD_S_PER_RPM: f64 = std::f64::consts::TAU / 60.0;

/// A second of sliding at 1 kHz: speed in rad/s, normal force in N, friction torque in N·m.
fn samples() -> Vec<[f64; 4]> {
    (0..1000)
        .map(|k| {
            let t = f64::from(k) * 1e-3;
            let force = 80.0 + 5.0 * (6.0 * t).sin();
            [t, 2.0 + 0.5 * (3.0 * t).sin(), force, 0.05 * force]
        })
        .collect()
}

fn rig(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rig")).args(arguments).current_dir(folder).output().unwrap()
}

fn utf16(text: &str) -> Vec<u8> {
    let marked = format!("\u{feff}{text}");
    marked.encode_utf16().flat_map(u16::to_le_bytes).collect()
}

fn comma(value: f64) -> String {
    format!("{value:.9}").replace('.', ",")
}

/// The six files.
fn write_layouts(folder: &Path) {
    let put = |name: &str, bytes: &[u8]| std::fs::write(folder.join(name), bytes).unwrap();
    let rows =
        |line: &dyn Fn(&[f64; 4]) -> String| samples().iter().map(|s| line(s) + "\r\n").collect::<String>();
    let a = rows(&|[t, w, f, m]| {
        format!("{};{};{};{};ok", comma(1e3 * t), comma(w / RAD_S_PER_RPM), comma(1e-3 * f), comma(*m))
    });
    let a = format!(
        "Messung Gummi\r\nPr\u{fc}fer;M.\r\n\r\nZeit;Drehzahl;Kraft;Moment;Status\r\nms;1/min;kN;Nm;\r\n{a}"
    );
    put("a.csv", &a.chars().map(|c| u8::try_from(u32::from(c)).unwrap()).collect::<Vec<u8>>());
    let b = rows(&|[t, w, f, m]| format!("{t}\t{}\t{f}\t{}", w.to_degrees(), 1e3 * m));
    put("b.txt", &utf16(&format!("Time [s]\tSpeed [deg/s]\tFz [N]\tMz [mNm]\r\n{b}")));
    let c = rows(&|[t, w, f, m]| format!("{t:.6}\t{w:.9}\t{f:.9}\t{m:.9}"));
    let head = "Writer_Version\t2\r\nSeparator\tTab\r\nDate\t2026/02/03\r\n***End_of_Header***\r\n\r\nChannels\t3\r\n\
        Samples\t1000\t1000\t1000\r\n***End_of_Header***\r\nX_Value\tomega\tFN\tMR\tComment\r\n";
    put("c.lvm", format!("{head}{c}").as_bytes());
    let d = rows(&|[t, w, f, m]| format!("{:.6},{w},{f},{m}", 1_770_000_000.0 + t));
    put("d.csv", format!("__time,/disc/speed,/load/force,/ring/torque\r\n{d}").as_bytes());
    let e = rows(&|[t, w, f, m]| {
        format!("2026-02-03 23:59:{:09.6},{},{f},{m}", 59.0 + 0.9 * t, w / RAD_S_PER_RPM)
    });
    put("e.csv", format!("timestamp,w,F,T\r\n{e}").as_bytes());
    let mut log = Log::default();
    let column = |k: usize| samples().iter().map(|s| s[k]).collect::<Vec<f64>>();
    let mut count = 0.0;
    let counts = column(1).into_iter().map(|w| {
        count += w * 1e-3 * 480_000.0 / std::f64::consts::TAU;
        count.round()
    });
    log.set_numbers("count", counts.collect());
    log.set_numbers("t_ns", column(0).iter().map(|t| (t * 1e9).round()).collect());
    log.set_numbers("fz", column(2));
    log.set_numbers("mz", column(3));
    put("f.parquet", &log.to_parquet().unwrap());
}

/// The commands of the guide's table.
fn commands() -> Vec<String> {
    let guide = Path::new(env!("CARGO_MANIFEST_DIR")).join("docs/own-logs.md");
    let text = std::fs::read_to_string(guide).unwrap();
    let six: Vec<String> = text
        .lines()
        .filter(|line| line.starts_with('|'))
        .filter_map(|line| line.split("`rig ").nth(1)?.split('`').next().map(str::to_owned))
        .collect();
    assert_eq!(six.len(), 6);
    six
}

#[test]
fn six_layouts_of_other_tools_come_in_with_one_command_each() {
    let folder = tempfile::tempdir().unwrap();
    write_layouts(folder.path());
    for command in commands() {
        let arguments: Vec<&str> = command.split_whitespace().collect();
        let output = rig(folder.path(), &arguments);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{command}: {said}");
        assert!(!said.contains("looks like"), "{command}: {said}");
        let log = Log::read(&folder.path().join(arguments.last().unwrap()).join("log.csv")).unwrap();
        let scale = if command.contains("e.csv") { 0.9 } else { 1.0 };
        let contact = log.contact().unwrap();
        assert_eq!(contact.time_s.len(), 1000, "{command}");
        for (k, [t, w, f, m]) in samples().into_iter().enumerate().skip(2).step_by(97) {
            let near =
                |a: f64, b: f64, tolerance: f64| assert!((a - b).abs() < tolerance, "{command}: {a} {b}");
            near(contact.time_s[k], scale * t, 2e-6);
            near(contact.m2_speed_rad_s[k], w, if command.contains("count") { 0.02 } else { 1e-5 });
            near(contact.normal_force_n[k], f, 1e-4);
            near(contact.friction_torque_nm[k], m, 1e-5);
        }
    }
}

/// The log in the tool's own form, with each column multiplied.
fn own(factors: [f64; 4]) -> String {
    let mut text = "time_s,m2_speed_rad_s,m2_angle_rad,normal_force_n,friction_torque_nm\n".to_owned();
    let mut angle = 0.0;
    for [t, w, f, m] in samples() {
        angle += w * 1e-3;
        let [ft, fw, ff, fm] = factors;
        writeln!(text, "{},{},{angle},{},{}", t * ft, w * fw, f * ff, m * fm).unwrap();
    }
    text
}

#[test]
fn a_wrong_unit_is_doubted_or_refused_by_every_command_and_a_right_one_is_not() {
    let folder = tempfile::tempdir().unwrap();
    let convert = |text: &str, more: &[&str]| {
        std::fs::write(folder.path().join("l.csv"), text).unwrap();
        rig(folder.path(), &[&["convert", "l.csv", "--force", "--out", "o"], more].concat())
    };
    let said = |output: &Output| String::from_utf8_lossy(&output.stderr).into_owned();
    let clean = convert(&own([1.0; 4]), &[]);
    assert_eq!(said(&clean).lines().count(), 1, "only what was written: {}", said(&clean));
    for (factors, status, words) in [
        ([1.0, 1.0 / RAD_S_PER_RPM, 1.0, 1.0], 0, "the speed looks like rpm"),
        ([1.0, 1.0, 1e-3, 1.0], 0, "the force looks like kN"),
        ([1.0, 1.0, -1.0, 1.0], 2, "is negative while the elements rub"),
        ([1e3, 1.0, 1.0, 1.0], 2, "if time is in ms"),
        ([20.0, 1.0, 1.0, 1.0], 0, "a rate of 50 Hz"),
        ([0.01, 1.0, 1.0, 1.0], 0, "a rate of 100000 Hz"),
    ] {
        let output = convert(&own(factors), &[]);
        assert_eq!(output.status.code(), Some(status), "{words}: {}", said(&output));
        assert!(said(&output).contains(words), "{words}: {}", said(&output));
    }
    let spike = own([1.0; 4]).replacen("\n0.1,", "\n0.1,1e308,0,80,4\n0.1000001,", 1);
    let output = convert(&spike, &[]);
    assert!(output.status.code() == Some(2) && said(&output).contains("1e308"), "{}", said(&output));
    // What the doubt proposes mends it.
    let output = convert(&own([1.0, 1.0, 1e-3, 1.0]), &["--unit", "normal_force_n=kN"]);
    assert!(output.status.success() && !said(&output).contains("looks like"), "{}", said(&output));
}
