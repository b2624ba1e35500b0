//! The same log given twice: as training and as held-out log it makes every model look right.

use std::collections::BTreeMap;
use std::ffi::OsString;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

use crate::notices;

/// Says so where two arguments are logs of the same bytes.
pub(super) fn warn_of(arguments: &[OsString]) {
    twice(arguments).iter().for_each(|sentence| notices::warn(sentence));
}

fn twice(arguments: &[OsString]) -> Vec<String> {
    let mut seen: BTreeMap<(u64, u64), &OsString> = BTreeMap::new();
    let mut sentences = Vec::new();
    for argument in arguments.iter().skip(1) {
        let path = Path::new(argument);
        let is_log = path
            .extension()
            .is_some_and(|e| ["csv", "parquet", "txt", "tsv"].iter().any(|known| e == *known));
        if !is_log {
            continue;
        }
        let Ok(bytes) = std::fs::read(path) else { continue };
        let mut hasher = DefaultHasher::new();
        bytes.hash(&mut hasher);
        match seen.insert((bytes.len() as u64, hasher.finish()), argument) {
            Some(first) if first == argument => {
                sentences.push(format!("{} is given twice{WHY}", path.display()))
            }
            Some(first) => sentences.push(format!(
                "{} and {} hold the same samples{WHY}",
                Path::new(first).display(),
                path.display()
            )),
            None => {}
        }
    }
    sentences
}

const WHY: &str =
    ": a log that counts twice makes intervals too narrow, and one that was fitted cannot test the fit";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_under_two_names_or_given_twice_is_noticed() {
        let folder = tempfile::tempdir().unwrap();
        let put = |name: &str, text: &str| {
            let path = folder.path().join(name);
            std::fs::write(&path, text).unwrap();
            path.into_os_string()
        };
        let (a, b, c) = (put("a.csv", "x"), put("b.csv", "x"), put("c.csv", "y"));
        let rig = OsString::from("rig");
        assert!(twice(&[rig.clone(), a.clone(), c.clone()]).is_empty());
        assert!(twice(&[rig.clone(), a.clone(), c.clone(), b])[0].contains("b.csv hold the same samples"));
        assert!(twice(&[rig, a.clone(), c, a])[0].contains("a.csv is given twice"));
    }
}
