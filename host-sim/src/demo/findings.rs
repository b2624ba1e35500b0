//! What the runs show, in words: every number and every "yes" here is computed.

use super::comparison::Comparison;
use super::runs::{ClosedLoop, Runs};
use crate::report::{Block, Role, Table};
use model_core::friction::Contact;
use model_core::friction::lugre::LugreParameters;
use model_core::friction::modified_lugre::{ModifiedLugre, ModifiedLugreState, Scheme};
use model_core::friction::stribeck::StribeckParameters;

/// What counts as an overshoot.
const OVERSHOOT: f64 = 0.05;
/// What counts as none: a part in ten thousand.
const NONE: f64 = 1e-4;

fn percent(value: f64) -> String {
    if value.abs() < NONE { "none".into() } else { format!("{:.1}\u{a0}%", 100.0 * value) }
}

fn load_steps(runs: &Runs) -> impl Iterator<Item = &ClosedLoop> {
    runs.closed_loop
        .iter()
        .filter(|r| r.summary.friction_overshoot.is_some() && r.summary.damping_ratio.is_none())
}

/// Whether friction peaks after the normal force has come within 5 % of its settled value.
fn peaks_after(run: &ClosedLoop) -> bool {
    let s = &run.summary;
    s.friction_peak_time_s.zip(s.normal_settled_time_s).is_some_and(|(peak, settled)| peak > settled)
}

/// The sentence that stands first on the page.
pub(super) fn lead(runs: &Runs) -> String {
    let all = load_steps(runs).all(|r| r.summary.friction_overshoot.unwrap_or(0.0) > OVERSHOOT);
    let at_constant = |role: Role| {
        runs.comparisons.iter().filter_map(|c| c.of(role)).map(|k| k.constant_overshoot).fold(0.0, f64::max)
    };
    let bristles = [Role::Lugre, Role::LugrePatch, Role::ModifiedLugre].into_iter().map(at_constant);
    let silent = bristles.fold(0.0, f64::max) < NONE;
    let series = at_constant(Role::Series) > OVERSHOOT;
    match (all, silent && series) {
        (true, true) => "Friction overshoots the value it settles to in each of Figs. 18–21, as the paper measured; of five \
                         models the rubber block in series with its asperities explains it, and LuGre, its patch \
                         and the paper's own modified LuGre cannot show it at constant speed and load."
            .into(),
        (true, false) => "Friction overshoots the value it settles to in each of Figs. 18–21, but with these numbers the \
                          models are not told apart as expected: see the table of the models."
            .into(),
        _ => "With these numbers friction does not overshoot in each of Figs. 18–21: see the table of the \
              experiments."
            .into(),
    }
}

/// One sentence before the table of experiments.
pub(super) fn experiments_sentence(runs: &Runs) -> String {
    let slowest = runs.closed_loop.iter().map(|r| r.summary.run.wall_s).fold(0.0, f64::max);
    format!(
        "Each experiment ran in closed loop: the firmware's control core, tick by tick at 10 kHz, with the plant behind \
         it. All figures are taken from the measured signals at 10 kHz. 10 s of experiment took at most {slowest:.2} s."
    )
}

/// The words for one experiment on the terminal: what must be seen, and what was.
pub(super) fn verdict(run: &ClosedLoop) -> (&'static str, String) {
    let s = &run.summary;
    if let Some(fault) = run.recording.fault {
        return ("runs to its end", format!("stopped: {fault}"));
    }
    if let Some(energy) = s.loop_energy_j {
        return ("torque over angle is a loop", format!("{:.2} mJ lost in a period", 1e3 * energy));
    }
    if let Some(damping) = s.damping_ratio {
        return ("strongly damped response to a torque step", format!("damping ratio {damping:.2}"));
    }
    let overshoot = percent(s.friction_overshoot.unwrap_or(0.0));
    if peaks_after(run) {
        let late = s.friction_peak_time_s.zip(s.normal_settled_time_s).map_or(0.0, |(p, n)| 1e3 * (p - n));
        let found = format!("{overshoot}, {late:.1} ms after the normal force settled");
        ("friction overshoots, after the normal force settled", found)
    } else {
        let ratio = s.friction_coefficient_ratio.unwrap_or(1.0);
        let found = format!("{overshoot}; the coefficient falls to {ratio:.2} of that at the peak");
        ("friction overshoots more than the normal force does", found)
    }
}

/// Fig. 26 in a line.
pub(super) fn crossing_sentence(runs: &Runs) -> String {
    let who = |passes: bool| {
        let names: Vec<&str> = runs
            .crossing
            .profiles
            .iter()
            .filter(|p| (p.overshoot() > 1e-3) == passes)
            .map(|p| p.name.split(',').next().unwrap_or(p.name))
            .collect();
        names.join(", ")
    };
    format!("{}; not {}", who(true), who(false))
}

/// Fig. 27 in a line.
pub(super) fn sweep_sentence(runs: &Runs) -> String {
    let sweep = &runs.sweep;
    let top = |y: &[f64]| {
        let k = (0..y.len()).max_by(|a, b| y[*a].total_cmp(&y[*b])).unwrap_or(0);
        (k, sweep.speed_m_s.get(k).copied().unwrap_or(0.0))
    };
    let (bell, lugre) = (top(&sweep.bell), top(&sweep.lugre));
    let lugre_text =
        if lugre.0 == 0 { "falls from standstill on".into() } else { format!("peaks at {:.3} m/s", lugre.1) };
    format!("the bell peaks at {:.2} m/s; LuGre {lugre_text}", bell.1)
}

/// The models at constant speed and load, in a line.
pub(super) fn constant_sentence(runs: &Runs) -> String {
    let Some(c) = runs.comparisons.iter().find(|c| (c.rpm - 30.0).abs() < 0.5) else {
        return "not run".into();
    };
    let each = c.candidates.iter().map(|k| {
        let name = k.model.name.split(',').next().unwrap_or(k.model.name);
        format!("{name} {}", percent(k.constant_overshoot))
    });
    each.collect::<Vec<_>>().join(", ")
}

/// Text and table that compare the models.
pub(super) fn models(runs: &Runs) -> Vec<Block> {
    let intro = "All five stand for the same rubber: the same static curve g(v), the same stiffness of the wind-up. The \
                 first table is the overshoot from rest at constant sliding speed and normal force; the second that of \
                 Figs. 18–21, with the model on the disc in closed loop, and with the model driven by one true motion and \
                 load, that of the rig with the series element.";
    let candidates = || runs.comparisons.first().map_or(&[][..], |c| &c.candidates).iter().enumerate();
    let speeds = |what: &str| {
        runs.comparisons.iter().map(move |c| format!("{:.0} rpm{what}", c.rpm)).collect::<Vec<_>>()
    };
    let constant = Table {
        head: [vec!["model".into()], speeds(""), vec!["at constant speed and load".into()]].concat(),
        rows: candidates()
            .map(|(k, m)| {
                let each =
                    runs.comparisons.iter().map(|c| percent(c.candidates[k].constant_overshoot)).collect();
                [vec![m.model.name.into()], each, vec![m.model.why.into()]].concat()
            })
            .collect(),
    };
    let moving = Table {
        head: [vec!["model".into()], speeds(": closed loop / driven")].concat(),
        rows: candidates()
            .map(|(k, m)| {
                let pair = |c: &Comparison| {
                    let m = &c.candidates[k];
                    format!("{} / {}", percent(m.closed_overshoot), percent(m.open_overshoot))
                };
                [vec![m.model.name.into()], runs.comparisons.iter().map(pair).collect()].concat()
            })
            .collect(),
    };
    let normal =
        runs.closed_loop.first().and_then(|r| ratio(r.summary.normal_peak_n, r.summary.normal_settled_n));
    let remark = format!(
        "On the rig the load steps while the disc turns, and the normal force itself overshoots by {}. Brush and patch \
         slide already at that moment, so their force is the normal force times a constant: they show its overshoot and \
         nothing more, at once and at every speed. LuGre and modified LuGre wind up and come close to their steady value \
         from below. Only the series element rises along a straight line, holds on beyond the steady value and lets go.",
        normal.map_or("–".into(), |n| percent(n - 1.0))
    );
    vec![Block::Text(intro.into()), Block::Table(constant), Block::Table(moving), Block::Text(remark)]
}

fn ratio(a: Option<f64>, b: Option<f64>) -> Option<f64> {
    a.zip(b).map(|(a, b)| a / b)
}

/// Overshoot of the modified model with the notes' numbers, by one treatment of its implicit equation.
fn modified(scheme: Scheme, step_s: f64) -> Option<f64> {
    let p = LugreParameters {
        sigma0_n_per_m: 181.54,
        sigma1_n_s_per_m: 0.0,
        a2_s_per_m: 0.0,
        stribeck: StribeckParameters { a0: 0.2, a1: 1.0, v0_m_s: 0.05, delta: 0.5, theta: 1.0 },
    };
    let model = ModifiedLugre::new(&p, step_s).ok()?.with_scheme(scheme);
    let mut state = ModifiedLugreState::default();
    let (mut peak, mut last) = (0.0f64, 0.0);
    for _ in 0..(1.0 / step_s) as u32 {
        last = model.step(&mut state, &Contact::new(0.5, 1.0)).force_n;
        peak = peak.max(last);
    }
    Some(peak / last - 1.0)
}

/// The paper's statements, one a row: statement, whether it was reproduced, what was found.
pub(super) fn statements(runs: &Runs) -> Table {
    let mut rows: Vec<Vec<String>> = Vec::new();
    let mut add_word = |statement: &str, reproduced: &str, found: String| {
        rows.push(vec![statement.into(), reproduced.into(), found]);
    };
    let mut add = |statement: &str, reproduced: bool, found: String| {
        add_word(statement, if reproduced { "yes" } else { "no" }, found);
    };
    let list = |f: &dyn Fn(&ClosedLoop) -> String| load_steps(runs).map(f).collect::<Vec<_>>().join(", ");
    let overshoots =
        list(&|r| format!("{} {}", r.label(), percent(r.summary.friction_overshoot.unwrap_or(0.0))));
    add(
        "Friction overshoots the value it settles to (Figs. 18–21).",
        load_steps(runs).all(|r| r.summary.friction_overshoot.unwrap_or(0.0) > OVERSHOOT),
        format!("{overshoots}."),
    );
    let slow: Vec<&ClosedLoop> = load_steps(runs).filter(|r| r.name != "fig21").collect();
    let late = slow.iter().map(|r| {
        let s = &r.summary;
        let ms = s.friction_peak_time_s.zip(s.normal_settled_time_s).map_or(0.0, |(p, n)| 1e3 * (p - n));
        format!("{} {ms:.1} ms", r.label())
    });
    add(
        "At 10–30 rpm it does so after the normal force has settled.",
        slow.iter().all(|r| peaks_after(r)),
        format!(
            "The peak follows the moment at which the normal force is within 5 % by: {}. How late it is follows from the \
             way on which the block winds up.",
            late.collect::<Vec<_>>().join(", ")
        ),
    );
    let mut fast_row = None;
    if let Some(fast) = runs.named("fig21") {
        let s = &fast.summary;
        let ratio = s.friction_coefficient_ratio.unwrap_or(1.0);
        let later = s.friction_ratio_at_same_normal.map_or_else(
            || {
                "The normal force has the value of that moment never again in this run (it overshoots there)."
                    .to_string()
            },
            |r| format!("When the normal force has that value again, friction is {r:.2} of the peak."),
        );
        let lower = !peaks_after(fast) && ratio < 0.95;
        let word = match s.friction_ratio_at_same_normal {
            Some(later) if lower && later < 0.95 => "yes",
            None if lower => "in part",
            _ => "no",
        };
        fast_row = Some((
            "At 120 rpm it peaks with the normal force, and is markedly lower at the same normal force later (Fig. 21).",
            word,
            format!(
                "The settled coefficient is {ratio:.2} of that at the peak, so the peak is not the normal force's alone. {later}"
            ),
        ));
    }
    if let Some((statement, word, found)) = fast_row {
        add_word(statement, word, found);
    }
    let mut add = |statement: &str, reproduced: bool, found: String| {
        add_word(statement, if reproduced { "yes" } else { "no" }, found);
    };
    if let Some(run) = runs.named("fig22") {
        let energy = run.summary.loop_energy_j.unwrap_or(0.0);
        let far = run.recording.frames.iter().map(|f| f.truth.disc_angle_rad.abs()).fold(0.0, f64::max);
        let yield_rad = run.summary.friction_peak_nm.unwrap_or(0.0) / (runs.rubber.k_u_n_per_m * 0.06 * 0.06);
        add(
            "Torque over angle is a hysteresis loop, without gross sliding (Fig. 22).",
            energy > 0.0 && far < 2.0 * yield_rad,
            format!(
                "{:.2} mJ are lost in a period; the disc moves by {:.1} mrad, and the blocks alone yield by {:.1} mrad.",
                1e3 * energy,
                1e3 * far,
                1e3 * yield_rad
            ),
        );
    }
    if let Some(run) = runs.named("fig23") {
        let zeta = run.summary.damping_ratio.unwrap_or(0.0);
        let next = (-std::f64::consts::TAU * zeta / (1.0 - zeta * zeta).max(1e-9).sqrt()).exp();
        add(
            "A torque step is answered with strong damping (Fig. 23).",
            zeta > 0.15,
            format!("Damping ratio {zeta:.2}: each swing has {:.0} % of the one before.", 100.0 * next),
        );
    }
    let worst = |role: Role| {
        runs.comparisons
            .iter()
            .filter_map(|c| c.of(role))
            .map(|k| k.constant_overshoot.abs())
            .fold(0.0, f64::max)
    };
    let lagged = modified(Scheme::Lagged, 1e-3);
    let fine = modified(Scheme::Lagged, 1e-4);
    let implicit = modified(Scheme::Implicit, 1e-3);
    let show = |v: Option<f64>| v.map_or("not to be had".into(), percent);
    add(
        "The modified LuGre model, eqs. 17–19, overshoots (Figs. 24, 26).",
        worst(Role::ModifiedLugre) > NONE,
        format!(
            "Solved as printed its deflection overshoots by: {}. Its implicit equation has one root. With the rate of the step before put \
             into g instead, the overshoot is {} at a step of 1 ms and {} at 0.1 ms. That holds for a0 > a1 δ e^{{−(1 + 1/δ)}} and for \
             the deflection; with bristle damping the force may overshoot. `cargo rig rivals` has every other reading.",
            show(implicit),
            show(lagged),
            show(fine)
        ),
    );
    let closed = |role: Role| {
        let each = runs.comparisons.iter().filter_map(|c| c.of(role).map(|k| (c.rpm, k.closed_overshoot)));
        each.map(|(rpm, o)| format!("{rpm:.0} rpm {}", percent(o))).collect::<Vec<_>>().join(", ")
    };
    add(
        "LuGre cannot explain the overshoot.",
        worst(Role::Lugre) < NONE,
        format!(
            "At constant speed and load: none. On the disc, where load and speed vary: {}. What it shows there is the normal \
             force's overshoot, and speeds below the settled one.",
            closed(Role::Lugre)
        ),
    );
    let crossing =
        |role: Role| runs.crossing.profiles.iter().find(|p| p.role == role).map_or(0.0, |p| p.overshoot());
    add(
        "An elastic element on asperities passes a maximum on its way through the patch (Fig. 26).",
        crossing(Role::Series) > 1e-3,
        format!(
            "Series element {}, brush {}, LuGre {}, modified LuGre {}.",
            percent(crossing(Role::Series)),
            percent(crossing(Role::Brush)),
            percent(crossing(Role::LugrePatch)),
            percent(crossing(Role::ModifiedLugre))
        ),
    );
    let bell_above_zero = runs.sweep.bell.windows(2).next().is_some_and(|w| w[1] > w[0]);
    add(
        "Measured friction over speed is a bell; LuGre falls from standstill on (Fig. 27).",
        bell_above_zero && runs.sweep.lugre.windows(2).all(|w| w[1] < w[0]),
        format!(
            "{}. None of the five models has a maximum at a speed above zero{}.",
            sweep_sentence(runs),
            runs.sweep
                .stick_slip_below_m_s()
                .map_or(String::new(), |v| format!("; below {v:.3} m/s the series element sticks and slips"))
        ),
    );
    add(
        "The patch equations 15 and 19 hold as printed.",
        false,
        format!(
            "They drop F_N, so their σ0 is per unit load (1/m) and stiffness grows with the load. The force then follows \
             every change of the normal force at once: at 120 rpm the patch overshoots by {} in the closed loop.",
            runs.comparisons
                .last()
                .and_then(|c| c.of(Role::LugrePatch))
                .map_or("–".into(), |k| percent(k.closed_overshoot))
        ),
    );
    let head = ["the paper's statement", "reproduced", "found"];
    Table { head: head.map(Into::into).to_vec(), rows }
}

/// What is assumed, and what is not modelled.
pub(super) fn assumptions() -> Vec<Block> {
    let items = [
        "The paper prints no parameter values and no raw data. All numbers of the rig and of the rubber are assumed; only \
         the encoders (120 000 pulses a revolution), the three elements of 1 × 1 cm at 120° and the courses of M1 and \
         M2 are the paper's. So figures are compared in kind, not in size.",
        "M1's torque rises with at most 800 N·m/s. Faster, its step excites the 120 Hz mode of the normal force so much that \
         at 30 rpm friction peaks before the normal force is within 5 %.",
        "The bearing's Coulomb friction changes its sign over 0.01 rad/s; the amplifiers clip within 1 % of the converter's \
         range; sensor noise is white: 4 mN·m, 0.05 N, 5 mN·m.",
        "Left out: mass of the rubber blocks, heat, wear, the roughness of a real disc over its angle, play and friction in \
         the lever.",
    ];
    vec![Block::List(items.map(Into::into).to_vec())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_printed_overshoot_appears_with_the_lagged_step_only() {
        assert!((modified(Scheme::Lagged, 1e-3).unwrap() - 0.14).abs() < 0.01);
        assert!(modified(Scheme::Lagged, 1e-4).unwrap().abs() < NONE);
        assert!(modified(Scheme::Implicit, 1e-3).unwrap().abs() < NONE);
    }
}
