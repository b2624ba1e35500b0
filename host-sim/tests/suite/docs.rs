//! The guide says what the code says.

use std::path::{Path, PathBuf};

use host_sim::files::signal::SIGNALS;
use model_core::control::Fault;

fn docs() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs")
}

fn page(name: &str) -> String {
    std::fs::read_to_string(docs().join(name)).unwrap()
}

#[test]
fn every_fault_has_its_paragraph_and_its_sentence_and_no_other_has() {
    let text = page("troubleshooting.md");
    let wanted: Vec<String> =
        Fault::ALL.iter().map(|fault| format!("## Fault {}: {}", fault.number(), fault.sentence())).collect();
    let found: Vec<&str> = text.lines().filter(|line| line.starts_with("## Fault ")).collect();
    assert_eq!(found, wanted);
}

#[test]
fn every_column_of_a_log_is_explained() {
    let text = page("files.md");
    for signal in SIGNALS {
        assert!(text.contains(&format!("`{}`", signal.column())), "{}", signal.column());
    }
}

#[test]
fn every_link_inside_the_guide_leads_somewhere() {
    for entry in std::fs::read_dir(docs()).unwrap() {
        let path = entry.unwrap().path();
        let text = std::fs::read_to_string(&path).unwrap();
        for target in text.split("](").skip(1).map(|rest| rest.split(')').next().unwrap()) {
            let target = target.split('#').next().unwrap();
            if !target.is_empty() && !target.contains("://") {
                assert!(docs().join(target).exists(), "{}: {target}", path.display());
            }
        }
    }
}
