//! The campaign as a table: a line for each fault in each state.

use super::Run;
use super::states::State;
use std::collections::BTreeMap;

/// The table's width of the fault's name.
const NAME: usize = 44;

/// All runs, by fault and state in the order in which they first came.
fn groups(runs: &[Run]) -> Vec<((&str, State), Vec<&Run>)> {
    let mut order: Vec<(&str, State)> = Vec::new();
    let mut groups: BTreeMap<(&str, State), Vec<&Run>> = BTreeMap::new();
    for run in runs {
        let key = (run.fault.as_str(), run.state);
        groups
            .entry(key)
            .or_insert_with(|| {
                order.push(key);
                Vec::new()
            })
            .push(run);
    }
    let mut faults: Vec<&str> = Vec::new();
    for (fault, _) in &order {
        if !faults.contains(fault) {
            faults.push(fault);
        }
    }
    order.sort_by_key(|(fault, state)| (faults.iter().position(|other| other == fault), *state));
    order.into_iter().filter_map(|key| groups.remove(&key).map(|runs| (key, runs))).collect()
}

/// Runs whose fault acted.
#[must_use]
pub fn counted(runs: &[Run]) -> usize {
    runs.iter().filter(|run| run.row.seen.is_some()).count()
}

/// Faults that acted in none of their runs: nothing is known of them.
#[must_use]
pub fn never_acted(runs: &[Run]) -> Vec<&str> {
    let mut names: Vec<&str> = runs.iter().map(|run| run.fault.as_str()).collect();
    names.sort_unstable();
    names.dedup();
    names.retain(|name| !runs.iter().any(|run| run.fault == *name && run.row.seen.is_some()));
    names
}

/// Whether the run counts and something in it was not as it must be.
#[must_use]
pub fn has_failed(run: &Run) -> bool {
    run.row.seen.is_some() && !run.row.problems.is_empty()
}

/// Runs that count and in which something was not as it must be.
#[must_use]
pub fn failed(runs: &[Run]) -> Vec<&Run> {
    runs.iter().filter(|run| has_failed(run)).collect()
}

/// How often each text came, the most frequent first.
fn tally<'a>(texts: impl Iterator<Item = &'a str>) -> String {
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    for text in texts.filter(|text| !text.is_empty()) {
        *counts.entry(text).or_default() += 1;
    }
    let mut counts: Vec<_> = counts.into_iter().collect();
    counts.sort_by_key(|(_, count)| std::cmp::Reverse(*count));
    match counts.as_slice() {
        [(only, _)] => (*only).to_owned(),
        _ => counts.iter().map(|(text, count)| format!("{text} ×{count}")).collect::<Vec<_>>().join(", "),
    }
}

/// The table. Times count from the access that saw the fault; torque and travel until the outputs are safe.
#[must_use]
pub fn table(runs: &[Run]) -> String {
    let mut text = format!(
        "{:<NAME$} {:<9} {:>7} {:>9} {:>11} {:>10}  {} | {}\n",
        "fault", "state", "runs", "safe ms", "torque N·m", "travel rad", "detected as", "came back"
    );
    for ((fault, state), runs) in groups(runs) {
        let acted: Vec<&Run> = runs.iter().copied().filter(|run| run.row.seen.is_some()).collect();
        let most = |value: &dyn Fn(&Run) -> f64| acted.iter().map(|run| value(run)).fold(0.0, f64::max);
        let safe = acted.iter().filter_map(|run| run.row.safe_ns).max();
        let safe = safe.map_or_else(|| "–".to_owned(), |ns| format!("{:.2}", ns as f64 * 1e-6));
        let torque = most(&|run| run.row.torque_nm[0].max(run.row.torque_nm[1]));
        text += &format!(
            "{fault:<NAME$} {:<9} {:>3}/{:<3} {safe:>9} {torque:>11.2} {:>10.4}  {} | {}\n",
            state.name(),
            acted.len(),
            runs.len(),
            most(&|run| run.row.travel_rad),
            tally(acted.iter().map(|run| run.row.said.as_str())),
            tally(acted.iter().map(|run| run.row.back.as_str())),
        );
        let failed: Vec<_> = acted.iter().filter(|run| !run.row.problems.is_empty()).collect();
        if let Some(first) = failed.first() {
            text += &format!(
                "    FAILED {} times, first at {} ns: {}\n",
                failed.len(),
                first.at_ns,
                first.row.problems.join("; ")
            );
        }
    }
    text += &format!(
        "{} runs, in {} the fault acted; {} failed\n",
        runs.len(),
        counted(runs),
        failed(runs).len()
    );
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::case::Row;

    #[test]
    fn a_fault_that_acted_in_none_of_its_states_is_named() {
        let run = |fault: &str, state, seen: Option<u64>| Run {
            fault: fault.to_owned(),
            state,
            at_ns: 0,
            row: Row { seen: seen.map(|at| (at, String::new())), ..Row::default() },
        };
        let runs = [
            run("open", State::Idle, None),
            run("short", State::Idle, None),
            run("short", State::Armed, Some(1)),
            run("open", State::Armed, None),
        ];
        assert_eq!(never_acted(&runs), ["open"]);
    }
}
