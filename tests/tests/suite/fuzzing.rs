//! The fuzzers' targets on a bounded number of inputs: the seeds of their corpora, whole and damaged in any way.
//! The fuzzers themselves need nightly: see `tests/fuzz/README.md`.
#![allow(dead_code, unreachable_pub)]

#[path = "../../fuzz/src/link.rs"]
mod link;
#[path = "../../fuzz/src/readers.rs"]
mod readers;

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use std::path::{Path, PathBuf};

/// Damaged inputs for each seed.
const DAMAGED: usize = 300;

/// A seed with up to eight changes: bits, bytes, pieces cut out, doubled, or put in.
fn damaged(seed: &[u8], chance: &mut Pcg64) -> Vec<u8> {
    let mut bytes = seed.to_vec();
    for _ in 0..chance.random_range(1..=8) {
        let at = chance.random_range(0..=bytes.len());
        let until = (at + chance.random_range(0..24)).min(bytes.len());
        match chance.random_range(0..5) {
            0 if at < bytes.len() => bytes[at] ^= 1 << chance.random_range(0..8),
            1 if at < bytes.len() => bytes[at] = chance.random(),
            2 => drop(bytes.drain(at..until)),
            3 => {
                let piece = bytes[at..until].to_vec();
                bytes.splice(at..at, piece);
            }
            _ => {
                let mut piece = vec![0; chance.random_range(0..16)];
                chance.fill_bytes(&mut piece);
                bytes.splice(at..at, piece);
            }
        }
    }
    bytes
}

/// Every seed of a target, and damaged ones of each.
fn inputs(target: &str, mut each: impl FnMut(&[u8])) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/corpus").join(target);
    let mut seeds: Vec<PathBuf> =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    seeds.sort();
    assert!(!seeds.is_empty(), "{}", folder.display());
    let mut chance = Pcg64::seed_from_u64(11);
    for path in seeds {
        let seed = std::fs::read(&path).unwrap();
        each(&seed);
        for _ in 0..DAMAGED {
            each(&damaged(&seed, &mut chance));
        }
    }
}

#[test]
fn any_bytes_on_the_line_leave_the_receiver_in_step() {
    inputs("frames", link::frames);
}

#[test]
fn no_sequence_of_requests_enables_a_drive_that_nobody_armed() {
    inputs("commands", link::commands);
}

#[test]
fn any_upload_is_refused_or_runs_within_the_converters_range() {
    inputs("upload", link::upload);
}

#[test]
fn any_toml_is_refused_in_words_or_read() {
    inputs("toml", readers::toml);
}

#[test]
fn any_csv_is_refused_in_words_or_read() {
    inputs("csv", readers::csv);
}

#[test]
fn any_parquet_is_refused_in_words_or_read() {
    let folder = tempfile::tempdir().unwrap();
    inputs("parquet", |bytes| readers::parquet(bytes, &folder.path().join("log.parquet")));
}
