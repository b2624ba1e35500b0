//! The answer to the paper's request for a model that shows what Figs. 18–21 show, in words, from the tournament.

use super::candidates::Candidate;
use super::separate::Separation;
use super::tournament::{Match, Tournament};
use model_core::friction::ModelKind;

/// Sentences: what explains the figures, what the other experiments leave of that, whether it holds the other way round, and
/// which experiment comes next. Empty where the series element did not play the rubber.
#[must_use]
pub fn answer(
    candidates: &[Candidate],
    figures: &Tournament,
    all: Option<&Tournament>,
    separations: &[Separation],
    noise: f64,
) -> Vec<String> {
    let series = candidates.iter().position(|c| c.typical.kind() == ModelKind::Series);
    let Some(truth) = series.filter(|truth| figures.of(*truth, *truth).is_some()) else { return Vec::new() };
    let has_block = |at: usize| candidates[at].typical.get("k_u_n_per_m").is_some();
    let mut out = vec![explained(figures, truth, noise)];
    if let Some(all) = all {
        out.push(format!(
            "With a speed step, a load step and holds of two lengths as well: {}",
            explained(all, truth, noise)
        ));
    }
    let back: Vec<&Match> =
        figures.matches.iter().filter(|m| m.fitted == truth && m.truth != truth).collect();
    if !back.is_empty() {
        let missed = back.iter().filter(|m| m.held_out() >= noise).count();
        let worst: Vec<String> = back
            .iter()
            .filter(|m| m.held_out() < noise)
            .map(|m| format!("{} ({})", figures.names[m.truth], percent(m.held_out())))
            .collect();
        let fits = if worst.is_empty() { "none".to_string() } else { worst.join(", ") };
        out.push(format!(
            "The other way round, the series element fitted to figures that another model made misses Fig. 19 by more than the noise for \
             {missed} of {} of them; it explains those of: {fits}.",
            back.len()
        ));
    }
    for s in separations.iter().filter(|s| s.truth == truth || s.rival == truth) {
        let other = if s.truth == truth { s.rival } else { s.truth };
        out.push(separated(&figures.names, s, &figures.names[other]));
    }
    let alike: Vec<&Match> = figures
        .matches
        .iter()
        .filter(|m| m.truth == truth && m.fitted != truth && m.held_out() < noise)
        .collect();
    let bare = alike.iter().any(|m| !has_block(m.fitted));
    out.push(if bare {
        "So Figs. 18–21 alone do not decide whether an elastic block lies between root and asperities.".into()
    } else {
        "So Figs. 18–21 ask for an elastic, damped block in series with asperities whose friction falls with their own speed: every \
         model that explains them has one, and no model without one does, the modified LuGre model included. Which rubber the \
         block is made of they do not say. All of this holds for synthetic logs with assumed numbers; the paper's raw data would \
         be the test."
            .into()
    });
    out
}

/// A pair with its experiment.
#[must_use]
pub fn separated(names: &[String], s: &Separation, of: &str) -> String {
    let (truth, rival) = (&names[s.truth], &names[s.rival]);
    if s.is_possible() {
        format!(
            "{of}: told apart by {}: if {truth} is true, {rival} misses by {:.1} times the noise of a sample.",
            s.experiment, s.separation
        )
    } else {
        format!(
            "{of}: no experiment of the rig tells {truth} and {rival} apart with these numbers (best: {}, {:.2} times the noise of a \
             sample).",
            s.experiment, s.separation
        )
    }
}

fn percent(error: f64) -> String {
    format!("{:.2} %", 100.0 * error)
}

fn explained(tournament: &Tournament, truth: usize, noise: f64) -> String {
    let mut others: Vec<&Match> =
        tournament.matches.iter().filter(|m| m.truth == truth && m.fitted != truth).collect();
    others.sort_by(|a, b| a.held_out().total_cmp(&b.held_out()));
    let list = |inside: bool| {
        let some = others.iter().filter(|m| (m.held_out() < noise) == inside);
        let each: Vec<String> =
            some.map(|m| format!("{} {}", tournament.names[m.fitted], percent(m.held_out()))).collect();
        if each.is_empty() { "none".to_string() } else { each.join(", ") }
    };
    format!(
        "logs that the series element made are explained within the noise ({}) by: {}. Not by: {}.",
        percent(noise),
        list(true),
        list(false)
    )
}
