//! Which cases a campaign has, and where their seeds come from.

use std::path::Path;
use std::process::Command;

use crate::effect::Effect;
use crate::scenario::{Form, Scenario};

/// What to try.
#[derive(Debug, Clone)]
pub struct Wanted {
    /// Rounds of the whole list.
    pub rounds: u64,
    /// First round's number.
    pub first_round: u64,
    /// Effects hidden together, each list a case of every round.
    pub hidden: Vec<Vec<Effect>>,
    /// Random pairs in every round.
    pub pairs: u64,
    /// Clean cases in every round.
    pub clean: u64,
    /// Take this seed for everything, to see one case again.
    pub exact_seed: Option<u64>,
    /// Everything else about the cases.
    pub scenario: Scenario,
}

/// Kinds of case in a round have seeds this far apart, rounds so far.
const SEEDS_PER_KIND: u64 = 1000;
const SEEDS_PER_ROUND: u64 = 10_000;

impl Wanted {
    /// The cases, each with a seed (and so a rig, a plan and noise) of its own.
    #[must_use]
    pub fn cases(&self) -> Vec<Scenario> {
        let case = |effects: &[Effect], seed: u64| Scenario {
            effects: effects.to_vec(),
            seed: self.exact_seed.unwrap_or(seed),
            ..self.scenario.clone()
        };
        let fits = |effect: &Effect| self.scenario.form == Form::Contact || effect.works_without_contact();
        let mut cases = Vec::new();
        for round in self.first_round..self.first_round + self.rounds {
            let first = round.wrapping_mul(SEEDS_PER_ROUND);
            for effects in &self.hidden {
                // By the effects, not by the place in the list, so that a part of the list has the same seeds.
                let place = |e: &Effect| Effect::ALL.iter().position(|other| other == e).unwrap_or(0) as u64;
                let number = effects.iter().fold(0, |sum, effect| 41 * sum + 1 + place(effect));
                cases.push(case(effects, first.wrapping_add(number)));
            }
            for i in 0..self.pairs {
                let seed = first.wrapping_add(3 * SEEDS_PER_KIND + i);
                let pair = Effect::random_pair(seed);
                if pair.iter().all(fits) {
                    cases.push(case(&pair, seed));
                }
            }
            for i in 0..self.clean {
                cases.push(case(&[], first.wrapping_add(6 * SEEDS_PER_KIND + i)));
            }
        }
        cases
    }
}

/// The commit that is measured.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Commit {
    /// Its hash.
    pub hash: String,
    /// Whether the sources are another state than that commit.
    pub dirty: bool,
}

impl Commit {
    /// Of the sources in `folder`; `name` is a commit, as git understands it.
    ///
    /// # Errors
    /// Where git does not know it, or the sources are not that commit and `allow_dirty` is false.
    pub fn of(folder: &Path, name: &str, allow_dirty: bool) -> Result<Self, String> {
        let hash = git(folder, &["rev-parse", "--verify", &format!("{name}^{{commit}}")])?;
        let head = git(folder, &["rev-parse", "HEAD"])?;
        let changed = git(folder, &["status", "--porcelain"])?;
        let dirty = hash != head || !changed.is_empty();
        if dirty && !allow_dirty {
            let why = if hash == head {
                format!("{} files differ from commit {}", changed.lines().count(), &hash[..12])
            } else {
                format!("{} is checked out", &head[..12])
            };
            return Err(format!(
                "--seeds-from-commit {name}: {why}; allowed: a clean tree of that commit, or --allow-dirty"
            ));
        }
        Ok(Self { hash, dirty })
    }

    /// First round of the trials of this commit: 40 bits of its hash.
    #[must_use]
    pub fn first_round(&self) -> u64 {
        self.hash.get(..10).and_then(|digits| u64::from_str_radix(digits, 16).ok()).unwrap_or(0)
    }

    /// In words.
    #[must_use]
    pub fn words(&self) -> String {
        let state = if self.dirty { " with changes that are not in it" } else { "" };
        format!("commit {}{state}", self.hash)
    }
}

fn git(folder: &Path, arguments: &[&str]) -> Result<String, String> {
    let run = Command::new("git").arg("-C").arg(folder).args(arguments).output();
    let run = run.map_err(|e| format!("git: {e}"))?;
    if !run.status.success() {
        return Err(format!("git {}: {}", arguments.join(" "), String::from_utf8_lossy(&run.stderr).trim()));
    }
    Ok(String::from_utf8_lossy(&run.stdout).trim().to_string())
}

/// A shard: the i-th of n, from 1.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Which.
    pub index: usize,
    /// Of how many.
    pub count: usize,
}

impl std::str::FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let parts = text.split_once('/').and_then(|(i, n)| Some((i.parse().ok()?, n.parse().ok()?)));
        match parts {
            Some((index, count)) if 1 <= index && index <= count => Ok(Self { index, count }),
            _ => Err(format!("{text}: not i/n with 1 ≤ i ≤ n, as 3/20")),
        }
    }
}

impl Shard {
    /// Whether the case at this place (from 0) is in it. Neighbours go to different shards, so that each has
    /// of every kind.
    #[must_use]
    pub fn has(self, place: usize) -> bool {
        place % self.count == self.index - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn wanted() -> Wanted {
        Wanted {
            rounds: 3,
            first_round: 0xff_ffff_ffff,
            hidden: Effect::ALL.iter().map(|effect| vec![*effect]).collect(),
            pairs: 50,
            clean: 20,
            exact_seed: None,
            scenario: Scenario::new(&[], 0),
        }
    }

    #[test]
    fn every_case_has_a_seed_of_its_own() {
        let cases = wanted().cases();
        let seeds: BTreeSet<u64> = cases.iter().map(|case| case.seed).collect();
        assert_eq!((cases.len(), seeds.len()), (3 * (Effect::ALL.len() + 70), cases.len()));
    }

    #[test]
    fn a_part_of_the_list_has_the_seeds_it_has_in_the_whole() {
        let part = Wanted { hidden: vec![vec![Effect::DriveDelay]], pairs: 0, clean: 0, ..wanted() };
        let whole = wanted().cases();
        assert!(part.cases().iter().all(|case| whole.contains(case)));
    }

    #[test]
    fn shards_are_disjoint_and_complete() {
        let shards: Vec<Shard> = (1..=7).map(|i| format!("{i}/7").parse().unwrap()).collect();
        for place in 0..50 {
            assert_eq!(shards.iter().filter(|shard| shard.has(place)).count(), 1);
        }
        for wrong in ["0/3", "4/3", "1", "a/b", "1/0"] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn seeds_come_from_a_clean_commit_only_or_are_said_not_to() {
        let folder = tempfile::tempdir().unwrap();
        let here = folder.path();
        let commit = |text: &str| {
            std::fs::write(here.join("file"), text).unwrap();
            git(here, &["add", "file"]).unwrap();
            let who = ["-c", "user.name=test", "-c", "user.email=test@example.org"];
            git(here, &[&who[..], &["commit", "--quiet", "--no-gpg-sign", "-m", text]].concat()).unwrap();
            git(here, &["rev-parse", "HEAD"]).unwrap()
        };
        git(here, &["init", "--quiet"]).unwrap();
        let (first, second) = (commit("one"), commit("two"));
        let head = Commit::of(here, "HEAD", false).unwrap();
        assert_eq!((head.hash.as_str(), head.dirty), (second.as_str(), false));
        assert!(Commit::of(here, &first, false).unwrap_err().contains(&second[..12]));
        std::fs::write(here.join("file"), "three").unwrap();
        assert!(Commit::of(here, "HEAD", false).unwrap_err().contains("1 files differ"));
        let dirty = Commit::of(here, "HEAD", true).unwrap();
        assert!(dirty.dirty && dirty.words().contains("changes"));
        assert_eq!(dirty.first_round(), head.first_round());
    }

    #[test]
    fn another_commit_has_other_seeds() {
        let of = |hash: &str| Commit { hash: hash.into(), dirty: false }.first_round();
        assert_eq!(of("00000000ff0123"), 0xff);
        assert_ne!(of("a1b2c3d4e5f6"), of("a1b2c3d4e6f6"));
    }
}
