//! Which effects a balance asks for: forms that each effect proposes, and sets of them.

use std::borrow::Cow;

use rayon::prelude::*;

use super::solve::{Weighed, White};
use super::{Alternative, Balance, Solved};
use crate::identify::contact::search::WORTH;

/// Shapes of a combination of effects that are solved, of those that a glance ranks.
const SHAPES: usize = 2;
/// Combinations from which a larger one is looked for.
const PARENTS: usize = 3;

/// What proposes forms: of the effects that are wanted, for what these forms leave.
pub type Propose<'p> =
    &'p (dyn Fn(&Balance, Company<'_>, &(dyn Fn(&str) -> bool + Sync)) -> Vec<Alternative> + Sync);

/// Forms that stand in a balance already, and what they leave of it.
#[derive(Debug, Clone, Copy)]
pub struct Company<'a> {
    /// The forms.
    pub forms: &'a [&'a Alternative],
    /// The residual.
    pub residual: &'a [f64],
}

impl<'a> Company<'a> {
    /// The forms, and this one beside them.
    pub fn with<'f>(&self, form: &'f Alternative) -> Vec<&'f Alternative>
    where
        'a: 'f,
    {
        self.forms.iter().copied().chain([form]).collect()
    }
}

/// The forms that were looked for, and sets of them with their evidence, best first; the empty set is among them.
///
/// Orders and shapes are looked for where nothing else stands, and once more beside what was found: a mode that was fitted
/// to another cause's torque is not the coupling's.
pub fn search(balance: &mut Balance, propose: Propose<'_>, most: usize) -> (Vec<Alternative>, Vec<Solved>) {
    let alone = balance.solve(&[], &[]);
    // What no cause explains yet is no slow noise.
    balance.refit_level(&alone, 0.0);
    let mut alternatives = propose(balance, Company { forms: &[], residual: &alone.residual }, &|_| true);
    balance.forget_residuals();
    let mut noise_of = None;
    let found = search_sets(balance, &alternatives, most, &mut noise_of);
    // What is too small to matter hides nothing.
    if balance.difference(&found[0].residual, &alone.residual) < WORTH * balance.scale {
        return (alternatives, found);
    }
    let best = &found[0].set;
    let effect = |place: &usize| alternatives[*place].effect;
    let mut more: Vec<Alternative> = Vec::new();
    for again in best.iter().map(Some).chain([None]) {
        let beside: Vec<usize> = best.iter().copied().filter(|place| Some(place) != again).collect();
        if beside.is_empty() {
            continue;
        }
        let forms: Vec<&Alternative> = beside.iter().map(|place| &alternatives[*place]).collect();
        let residual = balance.solve(&alternatives, &beside).residual;
        let wanted =
            |id: &str| again.map_or(!best.iter().any(|b| effect(b) == id), |again| effect(again) == id);
        more.extend(propose(balance, Company { forms: &forms, residual: &residual }, &wanted));
    }
    let same = |a: &Alternative, b: &Alternative| {
        a.effect == b.effect && a.constants == b.constants && a.parameters.len() == b.parameters.len()
    };
    more.retain(|new| !alternatives.iter().any(|old| same(old, new)));
    if more.is_empty() {
        return (alternatives, found);
    }
    alternatives.extend(more);
    let found = search_sets(balance, &alternatives, most, &mut noise_of);
    (alternatives, found)
}

/// Sets with their evidence, best first, where the noise is that of a best set. It is taken from the best of those found, unless
/// that is the one that it is of already.
fn search_sets(
    balance: &mut Balance,
    alternatives: &[Alternative],
    most: usize,
    noise_of: &mut Option<Vec<usize>>,
) -> Vec<Solved> {
    let found = sets(balance, alternatives, most);
    if noise_of.as_ref() == Some(&found[0].set) {
        return found;
    }
    balance.refit_noise(&found[0]);
    *noise_of = Some(found[0].set.clone());
    sets(balance, alternatives, most)
}

/// The same with the balance's noise as it is.
fn sets(balance: &Balance, alternatives: &[Alternative], most: usize) -> Vec<Solved> {
    let white: Vec<White> = alternatives.par_iter().map(|form| balance.white(form)).collect();
    let chosen = |set: &[usize]| -> Vec<(&Alternative, Cow<'_, White>)> {
        set.iter().map(|a| (&alternatives[*a], Cow::Borrowed(&white[*a]))).collect()
    };
    let glance = |(set, parent): (Vec<usize>, &Solved)| {
        let weighed = balance.weighed(&chosen(&set), Some(&parent.innovations), 1);
        (set, weighed)
    };
    let refit =
        |(set, near): &(Vec<usize>, Weighed)| balance.solve_white(set, &chosen(set), Some(&near.innovations));
    let solved = |sets: Vec<(Vec<usize>, &Solved)>, shapes: usize| -> Vec<Solved> {
        let glances: Vec<(Vec<usize>, Weighed)> = sets.into_par_iter().map(glance).collect();
        let best = best_shapes(alternatives, glances, |(set, seen)| (set, seen.log_evidence), shapes);
        best.par_iter().map(refit).collect()
    };
    let of_each = |sets: Vec<Solved>| best_shapes(alternatives, sets, |s| (&s.set, s.log_evidence), 1);
    let best = |sets: &[Solved]| sets.iter().map(|s| s.log_evidence).fold(f64::NEG_INFINITY, f64::max);
    let mut found = vec![balance.solve(alternatives, &[])];
    let mut parents: Vec<Solved> = found.clone();
    for _ in 0..most {
        // The best shape of each combination of effects leads on.
        let mut larger = of_each(solved(with_one_more(alternatives, &parents), SHAPES));
        let leading = &larger[..larger.len().min(PARENTS)];
        larger.extend(solved(with_another_form(alternatives, leading), 1));
        let larger = of_each(larger);
        parents = larger.iter().take(PARENTS).cloned().collect();
        let worth = best(&larger) > best(&found);
        found.extend(larger);
        // A larger set is looked for where this one was worth it.
        if !worth {
            break;
        }
    }
    found.sort_by(|a, b| b.log_evidence.total_cmp(&a.log_evidence));
    found
}

/// Each of these sets with one more form, of an effect that it does not have, once.
fn with_one_more<'p>(alternatives: &[Alternative], parents: &'p [Solved]) -> Vec<(Vec<usize>, &'p Solved)> {
    let mut sets: Vec<(Vec<usize>, &Solved)> = Vec::new();
    for parent in parents {
        for (place, form) in alternatives.iter().enumerate() {
            let excluded = |other: &usize| {
                let other = &alternatives[*other];
                form.effect == other.effect || (form.is_coupling() && other.is_coupling())
            };
            if parent.set.iter().any(excluded) {
                continue;
            }
            let mut set = [parent.set.as_slice(), &[place]].concat();
            set.sort_unstable();
            if sets.iter().all(|(known, _)| *known != set) {
                sets.push((set, parent));
            }
        }
    }
    sets
}

/// Each of these sets with one of its forms exchanged for another of the same effect that has no more numbers: a shape that was best
/// alone may have taken a part of another cause with numbers that it does not need beside that.
fn with_another_form<'p>(alternatives: &[Alternative], sets: &'p [Solved]) -> Vec<(Vec<usize>, &'p Solved)> {
    let mut out = Vec::new();
    for solved in sets.iter().filter(|solved| solved.set.len() > 1) {
        for own in &solved.set {
            let rest = || solved.set.iter().copied().filter(|other| other != own);
            let coupled = rest().any(|other| alternatives[other].is_coupling());
            for (place, form) in alternatives.iter().enumerate() {
                let given = &alternatives[*own];
                let like = form.effect == given.effect && form.parameters.len() <= given.parameters.len();
                if place != *own && like && !(coupled && form.is_coupling()) {
                    let mut set: Vec<usize> = rest().chain([place]).collect();
                    set.sort_unstable();
                    out.push((set, solved));
                }
            }
        }
    }
    out
}

/// The best of these, each a set with its evidence, at most so many of each combination of effects, the best first.
fn best_shapes<T>(
    alternatives: &[Alternative],
    mut all: Vec<T>,
    of: impl Fn(&T) -> (&Vec<usize>, f64),
    most: usize,
) -> Vec<T> {
    all.sort_by(|a, b| of(b).1.total_cmp(&of(a).1));
    let mut seen: Vec<Vec<&str>> = Vec::new();
    all.retain(|one| {
        let mut names: Vec<&str> = of(one).0.iter().map(|a| alternatives[*a].effect).collect();
        names.sort_unstable();
        let kept = seen.iter().filter(|known| **known == names).count() < most;
        seen.push(names);
        kept
    });
    all
}

#[cfg(test)]
mod tests {
    use super::super::DiscMotion;
    use super::super::tests::{ROWS, balance};
    use super::*;
    use crate::identify::noise::tests::white;
    use crate::identify::term::Parameter;

    #[test]
    fn a_form_is_looked_for_again_beside_what_was_found() {
        let wave = |k: f64| -> Vec<f64> { (0..ROWS).map(|i| (k * i as f64).sin()).collect() };
        let noise = white(ROWS, 2);
        let of = |((a, b), n): ((f64, f64), &f64)| 20.0 * a + 3.0 * b + n;
        let response: Vec<f64> = wave(0.2).into_iter().zip(wave(0.5)).zip(&noise).map(of).collect();
        let mut balance = balance(response);
        let form = |effect, k: f64| Alternative {
            constants: vec![("wave_number".into(), k)],
            ..Alternative::columns(effect, vec![Parameter::amplitude("size", 30.0)], vec![wave(k)])
        };
        // The second cause's shape is seen only where the first one is taken off.
        let propose = |_: &Balance, company: Company<'_>, wanted: &(dyn Fn(&str) -> bool + Sync)| {
            let second = if company.forms.is_empty() { 0.7 } else { 0.5 };
            [form("large", 0.2), form("small", second)].into_iter().filter(|f| wanted(f.effect)).collect()
        };
        let (alternatives, found) = search(&mut balance, &propose, 2);
        let best: Vec<&str> = found[0].set.iter().map(|a| alternatives[*a].effect).collect();
        assert_eq!(best.len(), 2, "{best:?}");
        assert!((found[0].p[2] - 3.0).abs() < 0.2, "{:?}", found[0].p);
    }

    #[test]
    fn a_form_that_was_best_alone_gives_way_to_the_one_that_is_best_beside_another() {
        let half = |i: usize| if i < ROWS / 2 { 1.0 } else { -1.0 };
        let wave = |i: usize| (0.2 * i as f64).sin();
        let column = |of: &dyn Fn(usize) -> f64| (0..ROWS).map(of).collect::<Vec<f64>>();
        // A part of the second cause is a wave with another sign in each half, which a wave for each half takes.
        let second = |i: usize| half(i) * (wave(i) + (0.5 * i as f64).cos());
        let noise = white(ROWS, 2);
        let mut balance = balance(column(&|i| 9.0 * wave(i) + 3.0 * second(i) + noise[i]));
        let form = |effect, columns: Vec<Vec<f64>>| {
            let size = |i: usize| Parameter::amplitude(format!("size_{i}"), 30.0);
            Alternative::columns(effect, (0..columns.len()).map(size).collect(), columns)
        };
        let of_half = |sign: f64| column(&|i| if half(i) == sign { wave(i) } else { 0.0 });
        let forms = [
            form("first", vec![of_half(1.0), of_half(-1.0)]),
            form("first", vec![column(&wave)]),
            form("second", vec![column(&second)]),
            // Alone each is more like what is seen than the second cause.
            form("like_the_first", vec![column(&|i| wave(i) + 0.1 * (0.31 * i as f64).sin())]),
            form("as_like_it", vec![column(&|i| wave(i) + 0.1 * (0.43 * i as f64).sin())]),
        ];
        let found = search_sets(&mut balance, &forms, 2, &mut None);
        let alone =
            found.iter().find(|solved| solved.set.len() == 1 && forms[solved.set[0]].effect == "first");
        assert_eq!(alone.unwrap().set, [0]);
        assert_eq!(found[0].set, [1, 2]);
        // The plainer one does not buy numbers.
        let others = |set: &[usize]| -> Vec<Vec<usize>> {
            let solved = [balance.solve(&forms, set)];
            with_another_form(&forms, &solved).into_iter().map(|(set, _)| set).collect()
        };
        assert_eq!((others(&[0, 2]), others(&[1, 2])), (vec![vec![1, 2]], vec![]));
    }

    #[test]
    fn motor_and_disc_have_one_coupling() {
        let wave = |k: f64| -> Vec<f64> { (0..ROWS).map(|i| (k * i as f64).sin()).collect() };
        let noise = white(ROWS, 2);
        let of = |((a, b), n): ((f64, f64), &f64)| 9.0 * (a + b) + n;
        let response: Vec<f64> = wave(0.2).into_iter().zip(wave(0.5)).zip(&noise).map(of).collect();
        let form = |effect, k: f64, couples: bool| {
            let columns =
                Alternative::columns(effect, vec![Parameter::amplitude("size", 30.0)], vec![wave(k)]);
            let disc = DiscMotion { angle_rad: Vec::new(), angle_per_unit: Vec::new() };
            let response = couples.then(|| vec![0.0; ROWS]);
            Alternative { response, disc: Some(disc), ..columns }
        };
        let mut balance = balance(response);
        let best = |balance: &mut Balance, couples| {
            let forms = [form("spring", 0.2, couples), form("play", 0.5, couples)];
            search_sets(balance, &forms, 2, &mut None)[0].set.len()
        };
        assert_eq!([best(&mut balance, false), best(&mut balance, true)], [2, 1]);
    }
}
