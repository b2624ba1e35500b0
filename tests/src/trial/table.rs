//! The table of a campaign, from its records.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use crate::trial::Kind;
use crate::trial::record::Record;
use crate::trial::statistics::{Calibration, Share, median};

/// Probabilities below this are left out of the calibration: nearly all of them are zeros for effects that nobody
/// hid, and would make any answer look calibrated.
const SPOKEN_OF: f64 = 0.01;

/// Puts the records of shards together.
///
/// # Errors
/// Where they belong to different campaigns, or a case is missing or there twice.
pub fn collect(mut records: Vec<Record>) -> Result<Vec<Record>, String> {
    let Some(first) = records.first() else { return Err("no case".into()) };
    let (campaign, of) = (first.campaign.clone(), first.of);
    if let Some(other) = records.iter().find(|r| r.campaign != campaign || r.of != of) {
        return Err(format!("cases of two campaigns: \"{campaign}\", \"{}\"", other.campaign));
    }
    records.sort_by_key(|record| record.case);
    if let Some(pair) = records.windows(2).find(|pair| pair[0].case == pair[1].case) {
        return Err(format!("case {} is there twice", pair[0].case));
    }
    let missing: Vec<String> = (1..=of)
        .filter(|case| records.binary_search_by_key(case, |record| record.case).is_err())
        .map(|case| case.to_string())
        .collect();
    if missing.is_empty() {
        Ok(records)
    } else {
        Err(format!("missing of {of} cases: {}", missing.join(", ")))
    }
}

/// The whole table as text. The times aside it depends on the answers alone, not on who ran which case when.
#[must_use]
pub fn table(records: &[Record]) -> String {
    let mut text = String::new();
    if let Some(first) = records.first() {
        let _ = writeln!(text, "{}; {} cases", first.campaign, records.len());
    }
    let _ = writeln!(
        text,
        "\n{:28} {:26} {:26} {:>8} {:26} {:20} {:>15}",
        "hidden",
        "something found",
        "right answer",
        "p(truth)",
        "error ≤ 1.2 noise",
        "parameters found",
        "time s"
    );
    for kind in Kind::ALL {
        let of_kind: Vec<&Record> = records.iter().filter(|record| record.kind == kind).collect();
        if of_kind.is_empty() {
            continue;
        }
        text += &row(kind.heading(), &of_kind);
        for (heading, stick_slip) in [("  rigs that stick and slip", true), ("  rigs that slide", false)] {
            let part: Vec<&Record> =
                of_kind.iter().copied().filter(|r| r.stick_slip == Some(stick_slip)).collect();
            if !part.is_empty() {
                text += &row(heading, &part);
            }
        }
    }
    text += &notes(records);
    text += &calibration(records);
    text += &confusion(records);
    text
}

fn row(heading: &str, records: &[&Record]) -> String {
    let share = |pick: &dyn Fn(&Record) -> bool| Share::of(records.iter().map(|r| pick(r)));
    let right: Vec<&&Record> = records.iter().filter(|record| record.right()).collect();
    let near = Share::of(right.iter().filter_map(|record| record.near_noise()));
    let truths: Vec<f64> = records.iter().filter_map(|record| record.probability_of_truth()).collect();
    let p = match truths.len() {
        0 => "–".to_string(),
        count => format!("{:.2}", truths.iter().sum::<f64>() / count as f64),
    };
    let answers = right.iter().filter_map(|record| record.answer.as_ref());
    let parameters = Share::of(answers.flat_map(|a| a.recovered.iter().map(|parameter| parameter.holds())));
    let found =
        if parameters.of == 0 { "–".into() } else { format!("{} of {}", parameters.hits, parameters.of) };
    let walls: Vec<f64> = records.iter().map(|record| record.wall_s).collect();
    let worst = walls.iter().copied().fold(0.0, f64::max);
    let time = format!("{:.1} / {worst:.1}", median(walls));
    format!(
        "{heading:28} {:26} {:26} {p:>8} {:26} {found:20} {time:>15}\n",
        share(&|record| record.detected()).words(),
        share(&|record| record.right()).words(),
        near.words()
    )
}

fn notes(records: &[Record]) -> String {
    let count = |pick: fn(&Record) -> bool| records.iter().filter(|record| pick(record)).count();
    let groups = count(|record| record.answer.as_ref().is_some_and(|answer| answer.by_group));
    let failures = count(|record| record.answer.is_none());
    format!(
        "\n\
Right: the hidden effects are named and nothing else; `unknown` for what is outside; `none` for nothing. A cause that\n\
is not hidden counts for one that is where the answer states both in a group as indistinguishable: {groups} of the right\n\
answers are such. No answer at all: {failures}.\n\
Brackets: exact 95 % intervals (Clopper and Pearson), in per cent. p(truth): mean probability stated for the hidden\n\
effects, for `unknown`, for `none`. Error on the held-out log and parameters: where the answer is right; parameters that\n\
truth and answer call alike, found within their 95 % interval or 10 %. Rigs that stick and slip: block damping below\n\
F_N |g'| at 10 rpm and 88 N. Time of the diagnosis: median / worst.\n"
    )
}

fn calibration(records: &[Record]) -> String {
    let all: Vec<(f64, bool)> = records.iter().flat_map(Record::statements).collect();
    if all.is_empty() {
        return String::new();
    }
    let spoken: Vec<(f64, bool)> = all.iter().copied().filter(|(p, _)| *p >= SPOKEN_OF).collect();
    let curve = Calibration::of(&spoken);
    let mut text = format!("\ncalibration of the {} marginal probabilities of 1 % or more\n", spoken.len());
    let _ = writeln!(text, "  {:12} {:>10} {:>12}  was true", "stated", "statements", "mean stated");
    for (i, (count, mean, share)) in curve.bins.iter().enumerate() {
        if *count > 0 {
            let range = format!("{:.1}–{:.1}", 0.1 * i as f64, 0.1 * (i + 1) as f64);
            let _ = writeln!(text, "  {range:12} {count:>10} {mean:>12.3}  {}", share.words());
        }
    }
    let _ = writeln!(
        text,
        "expected calibration error {:.3}; of all {} probabilities, those near 0 too, {:.3}",
        curve.expected_error,
        all.len(),
        Calibration::of(&all).expected_error
    );
    text
}

fn confusion(records: &[Record]) -> String {
    let mut text = String::new();
    for kind in Kind::ALL {
        let mut rows: Vec<(String, Vec<&Record>)> = Vec::new();
        for record in records.iter().filter(|record| record.kind == kind) {
            let hides = record.hides();
            match rows.iter_mut().find(|row| row.0 == hides) {
                Some(row) => row.1.push(record),
                None => rows.push((hides, vec![record])),
            }
        }
        if !rows.is_empty() {
            let _ = writeln!(text, "\n{}: right, and what was answered", kind.heading());
        }
        for (hides, list) in rows {
            let right = list.iter().filter(|record| record.right()).count();
            let mut answers: BTreeMap<String, usize> = BTreeMap::new();
            for record in &list {
                *answers.entry(record.words()).or_default() += 1;
            }
            let mut answers: Vec<(String, usize)> = answers.into_iter().collect();
            answers.sort_by(|a, b| b.1.cmp(&a.1).then_with(|| a.0.cmp(&b.0)));
            let answers: Vec<String> = answers.iter().map(|(words, n)| format!("{words} {n}")).collect();
            let _ = writeln!(text, "  {hides:40} {right:>3}/{:<3} {}", list.len(), answers.join(", "));
        }
    }
    text
}
