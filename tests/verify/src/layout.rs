//! `cargo verify layout`: the floors of the project as one picture, `host-sim/figures/layout.svg`, made from the source.
//!
//! Who uses whom is read from the `crate::` paths of host-sim's modules and from the crates' manifests, tests left out.
//! A floor may use those below it; what goes up is drawn in another colour and listed below the picture.

use std::collections::BTreeSet;
use std::fmt::Write;
use std::path::Path;

/// A floor: what it is called, what it is for, and the folders that make it, from the root.
struct Floor {
    name: &'static str,
    purpose: &'static str,
    folders: &'static [&'static str],
}

const fn floor(name: &'static str, purpose: &'static str, folders: &'static [&'static str]) -> Floor {
    Floor { name, purpose, folders }
}

/// From the ground up.
const FLOORS: [Floor; 10] = [
    floor(
        "models",
        "friction models and effects, no_std",
        &["model-core/src/friction", "model-core/src/extension", "model-core/src/sensor"],
    ),
    floor("control core", "loops, supervisor, observer; one step a tick", &["model-core/src/control"]),
    floor("wire", "messages, telemetry, settings", &["model-core/link/src"]),
    floor("firmware", "pins, tick, flash on the STM32H743", &["firmware/src"]),
    floor(
        "files",
        "logs, rigs, models, experiments, errors",
        &[
            "host-sim/src/files",
            "host-sim/src/input_error",
            "host-sim/src/notices",
            "host-sim/src/provenance",
        ],
    ),
    floor(
        "rig on the PC",
        "the plant in f64, in lockstep with the core",
        &["host-sim/src/plant", "host-sim/src/lockstep"],
    ),
    floor("link", "the host's end of the serial line", &["host-sim/src/link"]),
    floor(
        "identification",
        "fit, predict, diagnose, design, rival models",
        &[
            "host-sim/src/fit",
            "host-sim/src/predict",
            "host-sim/src/identify",
            "host-sim/src/design",
            "host-sim/src/summary",
            "host-sim/src/studies",
        ],
    ),
    floor(
        "what users see",
        "reports, commissioning, demo, commands",
        &["host-sim/src/report", "host-sim/src/commission", "host-sim/src/demo", "host-sim/src/cli"],
    ),
    floor(
        "checks",
        "the ELF on an emulated chip; trials by an independent simulator",
        &["host-sim/virtual-bench/src", "tests/src"],
    ),
];

/// Uses across crates, by their manifests: (user, used).
const CRATES: [(&str, &str); 4] = [
    ("model-core/src/control", "model-core/src/friction"),
    ("model-core/link/src", "model-core/src/control"),
    ("firmware/src", "model-core/link/src"),
    ("host-sim/virtual-bench/src", "host-sim/src/link"),
];

const WIDTH: usize = 860;
const HEIGHT: usize = 56;

/// A folder of a floor that uses another floor.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
struct Use {
    from: usize,
    to: usize,
    words: String,
}

fn floor_of(folder: &str) -> Option<usize> {
    FLOORS.iter().position(|floor| floor.folders.contains(&folder))
}

/// Rust files in a folder, or the file of that name.
fn sources(path: &Path) -> Vec<std::path::PathBuf> {
    let file = path.with_extension("rs");
    let mut all = if file.is_file() { vec![file] } else { Vec::new() };
    let mut folders = vec![path.to_path_buf()];
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(folder).into_iter().flatten().flatten() {
            let path = entry.path();
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|end| end == "rs") {
                all.push(path);
            }
        }
    }
    all
}

/// Modules of host-sim that a source names.
fn named(source: &str) -> BTreeSet<String> {
    let code = source.split("#[cfg(test)]").next().unwrap_or(source);
    let lines = code.lines().filter(|line| !line.trim_start().starts_with("//"));
    let words = lines.flat_map(|line| line.split("crate::").skip(1));
    words.map(|rest| rest.chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()).collect()
}

fn uses(root: &Path) -> BTreeSet<Use> {
    let mut all = BTreeSet::new();
    for (from, to) in CRATES {
        if let (Some(a), Some(b)) = (floor_of(from), floor_of(to)) {
            all.insert(Use { from: a, to: b, words: format!("{from} → {to}") });
        }
    }
    for (from, floor) in FLOORS.iter().enumerate() {
        for folder in floor.folders.iter().filter(|folder| folder.starts_with("host-sim/src")) {
            for path in sources(&root.join(folder)) {
                let source = std::fs::read_to_string(path).unwrap_or_default();
                for module in named(&source) {
                    let used = format!("host-sim/src/{module}");
                    if let Some(to) = floor_of(&used).filter(|to| *to != from) {
                        let short = |folder: &str| folder.trim_start_matches("host-sim/src/").to_owned();
                        all.insert(Use {
                            from, to, words: format!("{} → {}", short(folder), short(&used))
                        });
                    }
                }
            }
        }
    }
    all
}

/// The picture.
pub(crate) fn svg(root: &Path) -> String {
    let uses = uses(root);
    let up: Vec<&Use> = uses.iter().filter(|one| one.to > one.from).collect();
    let height = HEIGHT * FLOORS.len() + 40 + 18 * up.len();
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" font-family=\"sans-serif\" \
         font-size=\"13\" fill=\"#1b1f24\">\n<rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    );
    let top = |floor: usize| HEIGHT * (FLOORS.len() - 1 - floor) + 10;
    for (number, floor) in FLOORS.iter().enumerate() {
        let y = top(number);
        // Writing to a string does not fail.
        let _ = writeln!(
            svg,
            "<rect x=\"10\" y=\"{y}\" width=\"560\" height=\"{}\" fill=\"#eef2f6\" stroke=\"#8c959f\"/>\n\
             <text x=\"20\" y=\"{}\" font-weight=\"bold\">{}</text><text x=\"150\" y=\"{}\">{}</text>\n\
             <text x=\"20\" y=\"{}\" font-size=\"10\" fill=\"#4a5568\">{}</text>",
            HEIGHT - 8,
            y + 18,
            floor.name,
            y + 18,
            floor.purpose,
            y + 36,
            floor.folders.join("  ")
        );
    }
    let pairs: BTreeSet<(usize, usize)> = uses.iter().map(|one| (one.from, one.to)).collect();
    for (from, to) in pairs {
        let (a, b) = (top(from) + HEIGHT / 2 - 4, top(to) + HEIGHT / 2 - 4);
        let reach = 590 + 30 * from.abs_diff(to);
        let colour = if to > from { "#b3261e" } else { "#0b57c2" };
        let _ = writeln!(
            svg,
            "<path d=\"M570 {a} C{reach} {a} {reach} {b} 574 {b}\" fill=\"none\" stroke=\"{colour}\" opacity=\"0.7\"/>\
             <circle cx=\"574\" cy=\"{b}\" r=\"3\" fill=\"{colour}\"/>"
        );
    }
    let mut y = HEIGHT * FLOORS.len() + 26;
    let _ = writeln!(
        svg,
        "<text x=\"10\" y=\"{y}\">A floor uses those below it (blue). What goes up (red):</text>"
    );
    for one in up {
        y += 18;
        let _ = writeln!(svg, "<text x=\"30\" y=\"{y}\">{}</text>", one.words);
    }
    svg.push_str("</svg>\n");
    svg
}

/// Writes the picture and says where.
pub(crate) fn write(root: &Path) -> Result<String, String> {
    let place = "host-sim/figures/layout.svg";
    std::fs::write(root.join(place), svg(root)).map_err(|error| format!("{place}: {error}"))?;
    Ok(format!("wrote {place}"))
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]
    use super::*;

    fn root() -> std::path::PathBuf {
        Path::new(env!("CARGO_MANIFEST_DIR")).ancestors().nth(2).unwrap().to_path_buf()
    }

    #[test]
    fn the_picture_in_the_guide_is_that_of_the_source() {
        let drawn = std::fs::read_to_string(root().join("host-sim/figures/layout.svg")).unwrap();
        assert_eq!(drawn, svg(&root()), "cargo verify layout remakes it");
    }

    #[test]
    fn every_module_of_the_host_tool_has_its_floor() {
        let lib = std::fs::read_to_string(root().join("host-sim/src/lib.rs")).unwrap();
        let modules = lib.lines().filter_map(|line| line.strip_prefix("pub mod ")?.strip_suffix(';'));
        for module in modules {
            assert!(floor_of(&format!("host-sim/src/{module}")).is_some(), "{module}");
        }
    }

    #[test]
    fn comments_and_tests_are_no_uses() {
        let source = "use crate::files::log;\n// crate::plant\nfn f() { crate::fit::g() }\n#[cfg(test)]\nuse crate::cli;";
        assert_eq!(named(source), ["files".to_owned(), "fit".to_owned()].into());
    }
}
