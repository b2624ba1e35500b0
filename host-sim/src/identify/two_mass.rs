//! Motor and disc apart: the disc behind a coupling (`coupling.rs`), turned by the measured motion of the motor; in a linear stage
//! the load, pushed by it.
//!
//! J_d ω̇_d = T_s(θ_m − θ_d, ω_m − ω_d) − T_f − s bearing,   T2 = J_m ω̇_m + (1 − s) bearing + T_s
//!
//! with s = 1 where the bearing carries the disc, and then follows the disc's speed, and 0 where it carries the motor.
//!
//! θ_m and T_f are measured, so only the disc is integrated; a weak pull towards the torque that the motor's own balance
//! says is in the shaft keeps it from drifting through the gap, whose crossings are too sensitive to be predicted for long.

use rayon::prelude::*;

use super::balance::{Alternative, Balance, DiscMotion, Weighed};
use super::contact::problem::{KEPT_PROMISE, MENDED_PROMISE, UNDECIDED, student_weight};
use super::coupling::{Coupling, Law, Machine};
use super::drive::{Bearing, DriveLog, INERTIA};
use super::effects::DriveView;
use super::evidence::BALANCE_SHARE;
use super::linear::{self, Slope};
use super::noise::White;
use super::term::Parameter;

/// A mode turns by less than this in a step within a sample, rad: its frequency is then right to φ²/24, 6e-4.
const TURN_IN_A_STEP: f64 = 0.12;
/// Pull towards the observed shaft torque, per sample, with which shapes are compared: far from the truth only a disc that is
/// held near the motor has a motion that resembles its own.
const PULL: f64 = 0.1;
/// Pulls with which a spring's numbers are then fitted: what pulls also hides. Play is left at the first one, since the
/// instants at which it closes cannot be told for long.
const WEAKER: [f64; 3] = [0.05, 0.015, 0.005];
/// Pulls with which the disc's motion is reckoned: the friction balance says which of them is best.
const RECKONED: [f64; 4] = [0.3, 0.1, 0.03, 0.005];
/// Pull on the disc's speed beside that on its angle, per sample: what the angle is off by was gathered over some sixteen.
const SPEED_PULL: f64 = 0.06;
/// No pull is quicker than this share of the mode, which turns by so much in a sample: else the pull would make the torque in
/// the spring's place, whatever that is of.
const SLOWER_THAN_MODE: f64 = 0.5;
/// The torque says where the disc is where the coupling has more than this share of its stiffness.
const STIFF: f64 = 0.3;
/// So often noise is added to the sensors to see what of it a coupling lets through.
const DRAWS: u64 = 4;
/// Points of the grid from which a fit starts, its iterations, and step and longest move of the logarithms.
const STARTS: usize = 3;
const ITERATIONS: usize = 20;
const STEP: f64 = 0.01;
/// The same where there is play: the instants at which it closes make the likelihood rough over less.
const STEP_OVER_PLAY: f64 = 0.05;
const REACH: f64 = 0.4;

/// Pull with which a coupling is weighed against other causes: it moves the disc no further in a sample than the spring itself
/// does for the same error, (ω dt)² of it. A stronger one repeats the measurement in the spring's place.
fn judged(numbers: &Coupling, log: &DriveLog) -> f64 {
    PULL.min((std::f64::consts::TAU * numbers.mode_hz * log.grid.step_s).powi(2))
}

/// Logs, each with where it begins among the points of all.
fn with_starts(logs: &[DriveLog]) -> impl Iterator<Item = (&DriveLog, usize)> {
    logs.iter().scan(0, |from, log| Some((log, std::mem::replace(from, *from + log.len()))))
}

/// Shaft torque and angle of the disc for a log, which begins at this point of all, and where the torque does not tell where the
/// disc lies in a gap with it at this share of the way from the middle to the motor's end.
fn shaft_torque(
    (log, from): (&DriveLog, usize),
    first_place: f64,
    law: &Law,
    bearing: &Bearing,
    pull: f64,
) -> (Vec<f64>, Vec<f64>) {
    let n = log.len();
    let dt = log.grid.step_s;
    let (disc, omega, k) = (law.disc_inertia, law.omega_rad_s, law.stiffness);
    let substeps = (omega * dt / TURN_IN_A_STEP).ceil().max(1.0) as usize;
    let h = dt / substeps as f64;
    let (per_step, per_substep, per_stiffness) = (dt.recip(), (substeps as f64).recip(), k.recip());
    let (per_torque, slower) = (h / disc, bearing.slower(h, disc));
    let pull = pull.min(SLOWER_THAN_MODE * omega * dt);
    let free = vec![0.0; n];
    let friction = log.friction.as_ref().unwrap_or(&free);
    let [effort, acceleration] = &log.quick;
    let on_disc = law.bearing_on_disc;
    let bearing_nm = &bearing.torque_nm[from..from + n];
    let observed: Vec<f64> = effort
        .iter()
        .zip(acceleration)
        .zip(bearing_nm)
        .map(|((t, a), b)| t - law.motor_inertia * a - (1.0 - on_disc) * b)
        .collect();
    // No smaller than what noise makes: inside the gap the torque is nothing.
    let sure = 0.1 * super::filters::rms(&observed);
    let x = &log.position;
    let place = if observed[0].abs() > sure { observed[0].signum() } else { first_place };
    // A soft stage says at any torque where the disc is.
    let play = if law.is_play() { law.half_gap } else { 0.0 };
    let (mut q, mut w) = (x[0] - observed[0] / k - place * play, 0.0);
    let mut out = vec![0.0; n];
    let mut disc_position = vec![q; n];
    for i in 1..n {
        let before = (x[i] - x[i - 1]) * per_step;
        let now = if i + 1 < n { (x[i + 1] - x[i]) * per_step } else { before };
        let earlier = if i > 1 { (x[i - 1] - x[i - 2]) * per_step } else { before };
        let (va, vb) = (0.5 * (earlier + before), 0.5 * (before + now));
        // What the bearing makes beside the friction that follows the disc's speed.
        let borne = on_disc * (bearing_nm[i] - bearing.friction_nm(log.speed[i]));
        for s in 0..substeps {
            // Drift, kick, drift: motor and disc are seen at the same instant, in the middle of the step.
            let part = (s as f64 + 0.5) * per_substep;
            let (motor, rate) = between([x[i - 1], x[i]], [dt * va, dt * vb], part);
            q += 0.5 * h * w;
            let shaft = law.torque(motor - q, rate * per_step - w);
            let rubbed = friction[i - 1] + (friction[i] - friction[i - 1]) * part;
            w += per_torque * (shaft - rubbed - borne);
            if on_disc > 0.0 {
                w = slower.slowed(w);
            }
            q += 0.5 * h * w;
        }
        let twist = x[i] - q;
        out[i] = law.torque(twist, vb - w);
        // In the gap the torque does not say where the disc is, but that it is at the other end where the motor says so.
        let off = if law.slope(twist) > STIFF {
            (out[i] - observed[i]) * per_stiffness
        } else if law.is_play() && observed[i].abs() > sure {
            twist - observed[i] * per_stiffness - observed[i].signum() * law.half_gap
        } else {
            0.0
        };
        q += pull * off;
        w += SPEED_PULL * pull * off * per_step;
        if !q.is_finite() || !w.is_finite() || q.abs() > 1e9 {
            return (vec![f64::NAN; n], disc_position);
        }
        disc_position[i] = q;
    }
    (out, disc_position)
}

/// Hermite's cubic between two samples, with the slopes there, and its slope.
fn between([x0, x1]: [f64; 2], [m0, m1]: [f64; 2], part: f64) -> (f64, f64) {
    let bow = m0 + m1 - 2.0 * (x1 - x0);
    let turn = 3.0 * (x1 - x0) - 2.0 * m0 - m1;
    (x0 + part * (m0 + part * (turn + part * bow)), m0 + part * (2.0 * turn + 3.0 * part * bow))
}

/// What a coupling of this drive is part of.
pub fn machine(view: &DriveView<'_>) -> Machine {
    Machine { inertia: view.inertia, effort: view.scales.effort, rotary: view.rotary }
}

fn alternative(
    effect: &'static str,
    view: &DriveView<'_>,
    numbers: &Coupling,
    bearing: &Bearing,
    pull: f64,
) -> Option<Alternative> {
    let n = numbers;
    let machine = machine(view);
    if !n.is_allowed(&machine) {
        return None;
    }
    let law = n.law(&machine);
    let mut added = Vec::with_capacity(view.balance.response.len());
    for (log, from) in with_starts(view.logs) {
        let (torque, _) = shaft_torque((log, from), 0.0, &law, bearing, pull);
        let bearing_nm = &bearing.torque_nm[from..from + log.len()];
        let most = 10.0 * view.scales.effort;
        let friction = log.friction.as_ref();
        let change: Vec<f64> = torque
            .iter()
            .enumerate()
            .map(|(i, t)| {
                // Of what the disc bears the friction stands in the response, and the bearing beside it.
                friction.map_or(0.0, |f| f[i]) + law.bearing_on_disc * bearing_nm[i] - t.clamp(-most, most)
            })
            .collect();
        if change.iter().any(|x| !x.is_finite()) {
            return None;
        }
        added.extend(log.filtered(&change));
    }
    Some(Alternative {
        form: n.words(&machine),
        response: Some(added),
        disc: Some(DiscMotion { angle_rad: Vec::new(), angle_per_unit: Vec::new() }),
        base_shift: vec![(INERTIA, -law.disc_inertia)],
        constants: n.constants(&machine),
        ..Alternative::columns(effect, Vec::<Parameter>::new(), Vec::new())
    })
}

/// The best shapes of a coupling: the plain one, one that bends (a spring that hardens, play with rounded ends), a spring of two
/// stages. A coarse grid, then a fit from its best points.
pub fn alternatives_of_grid(
    effect: &'static str,
    view: &DriveView<'_>,
    grid: Vec<Coupling>,
) -> Vec<Alternative> {
    // There is one coupling.
    let coupled = view.company.forms.iter().any(|form| form.is_coupling());
    if view.inertia <= 0.0 || coupled {
        return Vec::new();
    }
    match view.fixed {
        Some(fixed) => of_constants(effect, view, fixed).into_iter().collect(),
        None => searched(effect, view, grid),
    }
}

/// The coupling with the numbers that were found on other logs.
fn of_constants(effect: &'static str, view: &DriveView<'_>, fixed: &[(String, f64)]) -> Option<Alternative> {
    let numbers = Coupling::of_constants(fixed, &machine(view));
    stated(effect, view, &numbers, view.bearing?)
}

/// A coupling as it is weighed against other causes, with the disc's motion.
fn stated(
    effect: &'static str,
    view: &DriveView<'_>,
    numbers: &Coupling,
    bearing: &Bearing,
) -> Option<Alternative> {
    let pull = judged(numbers, &view.logs[0]);
    let form = alternative(effect, view, numbers, bearing, pull)?;
    let law = numbers.law(&machine(view));
    let noise_variance = noise_variance(view, &law, bearing, pull);
    Some(reckoned(view, &law, bearing, Alternative { noise_variance, ..form }))
}

/// The best plain coupling of a grid, and where one is asked for the best of each other shape.
fn searched(effect: &'static str, view: &DriveView<'_>, grid: Vec<Coupling>) -> Vec<Alternative> {
    let borne = |forms: &[&Alternative]| Bearing::beside(view.balance, forms, view.scales);
    let trial_near =
        |numbers: &Coupling, bearing: &Bearing, pull: f64, near: Option<&[f64]>| -> Option<Trial> {
            let alternative = alternative(effect, view, numbers, bearing, pull)?;
            let seen = view.balance.weigh(&view.company.with(&alternative), near);
            Some(Trial { numbers: *numbers, alternative, seen })
        };
    let trial = |numbers: &Coupling, bearing: &Bearing, pull: f64| trial_near(numbers, bearing, pull, None);
    let refined_by = |start: Trial, bearing: &Bearing, pull: f64| {
        let trial = |numbers: &Coupling, near: &[f64]| trial_near(numbers, bearing, pull, Some(near));
        let glance = |numbers: &Coupling, near: &[f64]| {
            let alternative = alternative(effect, view, numbers, bearing, pull)?;
            Some(view.balance.glance(&view.company.with(&alternative), near).innovations)
        };
        refined((view.balance, &machine(view)), start, trial, glance)
    };
    let better = |a: (Trial, f64), b: (Trial, f64)| {
        if a.0.seen.log_evidence + a.1 < b.0.seen.log_evidence + b.1 { b } else { a }
    };
    let best_of = |starts: Vec<Trial>, bearing: &Bearing| -> Option<(Trial, f64)> {
        starts.into_par_iter().filter_map(|start| refined_by(start, bearing, PULL)).reduce_with(better)
    };
    let made = |(best, log_prior): (Trial, f64), bearing: &Bearing| -> Option<Alternative> {
        Some(Alternative { log_prior, ..stated(effect, view, &best.numbers, bearing)? })
    };
    let sharpened = |mut best: (Trial, f64)| -> Option<Alternative> {
        let bearing = borne(&view.company.with(&best.0.alternative));
        let weaker = if best.0.numbers.is_play() { &[][..] } else { &WEAKER };
        for pull in weaker {
            let start = trial(&best.0.numbers, &bearing, *pull);
            let Some(better) = start.and_then(|start| refined_by(start, &bearing, *pull)) else { break };
            best = better;
        }
        made(best, &bearing)
    };
    let bearing = borne(view.company.forms);
    let tried = |of: Vec<Coupling>| -> Vec<Trial> {
        let of_numbers = |numbers: Coupling| trial(&numbers, &bearing, PULL);
        let mut tried: Vec<Trial> = of.into_par_iter().filter_map(of_numbers).collect();
        tried.sort_by(|a, b| b.seen.log_evidence.total_cmp(&a.seen.log_evidence));
        tried
    };
    let borne_either_way = |of: &[Coupling]| -> Vec<Trial> {
        let mut tried = tried(of.iter().flat_map(Coupling::borne_either_way).collect());
        tried.truncate(STARTS);
        tried
    };
    let mut of_grid = tried(grid);
    // Of each width the best, so that the fits do not all start in one valley.
    let mut widths: Vec<f64> = Vec::new();
    of_grid.retain(|t| {
        let new = t.numbers.gap == 0.0 || !widths.contains(&t.numbers.gap);
        widths.push(t.numbers.gap);
        new
    });
    let of_grid: Vec<Coupling> = of_grid.iter().map(|t| t.numbers).take(2 * STARTS).collect();
    // Which side bears is told where the coupling is about right.
    let starts = borne_either_way(&of_grid[..of_grid.len().min(STARTS)]);
    let Some(plain) = best_of(starts, &bearing) else { return Vec::new() };
    let nothing = view.balance.solve_forms(view.company.forms).log_evidence;
    if plain.0.seen.log_evidence + plain.1 < nothing {
        // Where nothing asks for a coupling, its numbers are of no account.
        return made(plain, &bearing).into_iter().collect();
    }
    let staged = if plain.0.numbers.is_play() {
        None
    } else {
        let stages = plain.0.numbers.in_stages(&machine(view));
        best_of(tried(stages), &bearing)
    };
    // What bends a little is near what does not.
    let bent: Vec<Coupling> = of_grid.iter().map(Coupling::bent).collect();
    let bent = best_of(borne_either_way(&bent), &bearing);
    // Over the edge of a dead zone the likelihood is rough, and over a rounded one it is not: what was found there is a start too.
    let unbent = bent.as_ref().and_then(|(bent, _)| {
        let start = trial(&Coupling { bend: 0.0, ..bent.numbers }, &bearing, PULL)?;
        best_of(vec![start], &bearing)
    });
    let plain = unbent.into_iter().fold(plain, better);
    [Some(plain), bent, staged].into_iter().flatten().filter_map(sharpened).collect()
}

/// Variance at each point that the sensors' noise leaves behind a coupling, beyond what the bridge's leaves in the balance without
/// one. A disc on a spring that is hardly pulled to the measurement swings with the bridge's noise, blows of a coupling come at
/// other instants, and where the disc lies in a gap when a log begins nothing tells before it is first struck.
fn noise_variance(view: &DriveView<'_>, law: &Law, bearing: &Bearing, pull: f64) -> Vec<f64> {
    let mut out = Vec::with_capacity(view.balance.response.len());
    for (at, (log, from)) in with_starts(view.logs).enumerate() {
        let reckoned =
            |log: &DriveLog, first_place: f64| shaft_torque((log, from), first_place, law, bearing, pull).0;
        let filtered_change = |there: &[f64], here: &[f64]| {
            log.filtered(&there.iter().zip(here).map(|(a, b)| a - b).collect::<Vec<f64>>())
        };
        let here = reckoned(log, 0.0);
        let mut variance = vec![0.0; log.len()];
        for draw in 0..DRAWS {
            let noisier = log.noisier(&mut White::new(DRAWS * at as u64 + draw + 1));
            let first_place = (2 * draw + 1) as f64 / DRAWS as f64 - 1.0;
            let of_shaft = filtered_change(&reckoned(&noisier, first_place), &here);
            let of_bridge = match (&noisier.friction, &log.friction) {
                (Some(there), Some(here)) => filtered_change(there, here),
                _ => vec![0.0; log.len()],
            };
            for ((sum, shaft), bridge) in variance.iter_mut().zip(of_shaft).zip(of_bridge) {
                *sum += (shaft * shaft - bridge * bridge) / DRAWS as f64;
            }
        }
        out.extend(log.filtered(&variance).into_iter().map(|v| if v.is_finite() { v.max(0.0) } else { 0.0 }));
    }
    out
}

/// With the disc's motion in each way.
fn reckoned(view: &DriveView<'_>, law: &Law, bearing: &Bearing, mut form: Alternative) -> Alternative {
    let angles = |pull: f64| -> Vec<Vec<f64>> {
        with_starts(view.logs).map(|log| shaft_torque(log, 0.0, law, bearing, pull).1).collect()
    };
    if let Some(disc) = &mut form.disc {
        disc.angle_rad = RECKONED.map(angles).to_vec();
    }
    form
}

/// A coupling with what the balance makes of it.
struct Trial {
    numbers: Coupling,
    alternative: Alternative,
    seen: Weighed,
}

/// Gauss–Newton with damping on the logarithms; the base parameters are solved for each trial (variable projection). With
/// what the priors make of the numbers; `None` where no derivative exists. `glance` is what a coupling leaves near a trial.
fn refined(
    (balance, machine): (&Balance, &Machine),
    start: Trial,
    trial: impl Fn(&Coupling, &[f64]) -> Option<Trial>,
    glance: impl Fn(&Coupling, &[f64]) -> Option<Vec<f64>> + Sync,
) -> Option<(Trial, f64)> {
    let step = if start.numbers.gap > 0.0 { STEP_OVER_PLAY } else { STEP };
    let mut best = start;
    let mut log_prior = None;
    let mut damping = 1e-2;
    let mut slopes: Option<Vec<Slope>> = None;
    for _ in 0..ITERATIONS {
        let p = best.numbers.fitted();
        let r = &best.seen.innovations;
        let fresh = slopes.is_none();
        let slope = |i: usize| {
            let moved = |step: f64| {
                let mut q = p.clone();
                q[i] += step;
                let there = glance(&best.numbers.with(&q), r)?;
                Some(there.iter().zip(r).map(|(a, b)| (b - a) / step).collect())
            };
            // At the end of what is allowed the other way.
            moved(step).or_else(|| moved(-step))
        };
        let taken = slopes.take().or_else(|| (0..p.len()).into_par_iter().map(slope).collect());
        let Some(mut columns) = taken else { break };
        let weights: Vec<f64> = r.iter().map(|r| student_weight(*r) / balance.temper).collect();
        let (h, g) = linear::normal_equations(&columns, &weights, r);
        log_prior = Some(best.numbers.log_prior(&h, machine));
        let mut better = None;
        for _ in 0..if fresh { 4 } else { 1 } {
            let mut damped = h.clone();
            for i in 0..p.len() {
                damped[(i, i)] += damping * h[(i, i)] + f64::MIN_POSITIVE;
            }
            let d = linear::factor(&damped).solve(&g);
            let d = &d * (REACH / d.amax().max(REACH));
            let q: Vec<f64> = p.iter().zip(d.iter()).map(|(p, d)| p + d).collect();
            let there = trial(&best.numbers.with(&q), r);
            let gain = there.map(|t| (t.seen.log_evidence - best.seen.log_evidence, t));
            let promised = BALANCE_SHARE * (g.dot(&d) - 0.5 * d.dot(&(&h * &d)));
            better = gain.filter(|(gained, _)| *gained > 0.0).map(|(gained, t)| (gained, promised, d, t));
            if better.is_some() {
                break;
            }
            damping *= 10.0;
        }
        let Some((gained, promised, step, there)) = better else {
            if fresh {
                break;
            }
            continue;
        };
        // Over play the likelihood is rough: what one step makes of it is no slope.
        let mends = !there.numbers.is_play();
        if gained > if mends { MENDED_PROMISE } else { KEPT_PROMISE } * promised {
            if mends {
                let ratios = vec![1.0; step.len()];
                linear::mend_slopes(&mut columns, [r, &there.seen.innovations], step.as_slice(), &ratios);
            }
            slopes = Some(columns);
        }
        best = there;
        damping = (0.3 * damping).max(1e-4);
        if gained < UNDECIDED * BALANCE_SHARE && (fresh || slopes.is_some()) {
            break;
        }
    }
    Some((best, log_prior?))
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::identify::balance::Company;
    use crate::identify::drive::{self, DrivePrior, DriveScales};
    use crate::identify::filters;
    use crate::identify::grid::Grid;
    use crate::identify::noise::{self, tests::white};

    const INERTIA_KG_M2: f64 = 0.018;
    const DISC_KG_M2: f64 = 0.011;
    const STEPS_PER_SAMPLE: usize = 40;

    /// A disc that is rubbed and swings behind a coupling under a torque of three sines, with rests, without which nothing tells the
    /// noise of the angle; that in counts of 120 000 a turn.
    pub(in crate::identify) fn swinging_disc(torque: impl Fn(f64, f64) -> f64) -> DriveLog {
        borne(torque, [0.02, 0.0], 0.0)
    }

    /// The same with this viscous friction of a bearing of motor and disc, and with this Coulomb friction of the disc's.
    fn borne(torque: impl Fn(f64, f64) -> f64, [of_motor, of_disc]: [f64; 2], coulomb: f64) -> DriveLog {
        let h = 1e-3 / STEPS_PER_SAMPLE as f64;
        let (mut motor, mut disc) = ([0.0f64; 2], [0.0f64; 2]);
        let noise = white(8000, 3);
        let (mut time, mut effort, mut position, mut friction) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let count = std::f64::consts::TAU / 120_000.0;
        for i in 0..8000 * STEPS_PER_SAMPLE {
            let t = h * i as f64;
            let swing = 2.0 * (4.0 * t).sin() + 1.5 * (11.0 * t).sin() + (23.0 * t).sin();
            let driven = if t % 2.0 < 1.3 { swing } else { 0.0 };
            if i % STEPS_PER_SAMPLE == 0 {
                time.push(t);
                effort.push(driven + 0.01 * noise[i / STEPS_PER_SAMPLE]);
                position.push((motor[0] / count).round() * count);
                friction.push((disc[1] / 0.3).tanh() + 0.01 * noise[7999 - i / STEPS_PER_SAMPLE]);
            }
            let shaft = torque(motor[0] - disc[0], motor[1] - disc[1]);
            motor[1] += h * (driven - of_motor * motor[1] - shaft) / (INERTIA_KG_M2 - DISC_KG_M2);
            let rubbed = (disc[1] / 0.3).tanh();
            disc[1] += h * (shaft - rubbed - of_disc * disc[1]) / DISC_KG_M2;
            disc[1] -= disc[1].signum() * (h * coulomb / DISC_KG_M2).min(disc[1].abs());
            motor[0] += h * motor[1];
            disc[0] += h * disc[1];
        }
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        let load = vec![30.0; time.len()];
        DriveLog::made(
            "log".into(),
            grid,
            effort,
            position,
            Some(friction),
            Some(load),
            usable,
            INERTIA_KG_M2,
        )
    }

    fn of_effort(effort: f64) -> Machine {
        Machine { inertia: INERTIA_KG_M2, effort, rotary: true }
    }

    /// What a form is looked for in: logs of a rotary drive, with nothing found yet.
    fn view<'a>(
        logs: &'a [DriveLog],
        scales: &'a DriveScales,
        balance: &'a Balance,
        residual: &'a [f64],
    ) -> DriveView<'a> {
        DriveView {
            logs,
            scales,
            balance,
            company: Company { forms: &[], residual },
            rotary: true,
            inertia: INERTIA_KG_M2,
            fixed: None,
            bearing: None,
        }
    }

    /// Numbers of the best form.
    fn found(effect: &'static str, log: DriveLog, grid: &[Coupling]) -> Vec<(String, f64)> {
        found_in((true, INERTIA_KG_M2), effect, log, grid)
    }

    /// The same in a drive that turns or goes to and fro, of this inertia or mass.
    fn found_in(
        (rotary, inertia): (bool, f64),
        effect: &'static str,
        log: DriveLog,
        grid: &[Coupling],
    ) -> Vec<(String, f64)> {
        let logs = [log];
        let scales = DriveScales::new(&logs);
        let balance = drive::balance(&logs, &DrivePrior::default(), &scales);
        let residual = balance.solve(&[], &[]).residual;
        let view = DriveView { rotary, inertia, ..view(&logs, &scales, &balance, &residual) };
        let forms = searched(effect, &view, grid.to_vec()).into_iter();
        let best = forms.max_by(|a, b| {
            let evidence = |form: &Alternative| balance.solve_forms(&[form]).log_evidence;
            evidence(a).total_cmp(&evidence(b))
        });
        best.expect("a form").constants
    }

    fn assert_near(constants: &[(String, f64)], name: &str, truth: f64, within: f64) {
        let value = constants.iter().find(|(key, _)| key == name).map_or(0.0, |(_, value)| *value);
        assert!((value / truth - 1.0).abs() < within, "{name}: {value} for {truth}; {constants:?}");
    }

    #[test]
    fn a_spring_that_hardens_is_found_with_its_hardening() {
        let (k, beta, d) = (200.0, 1200.0, 0.1);
        let log = swinging_disc(|twist, rate| k * twist * (1.0 + beta * twist * twist) + d * rate);
        let grid = [Coupling::spring(17.0, 0.03, 0.65), Coupling::spring(34.0, 0.03, 0.65)];
        let found = found("shaft_torsion", log, &grid);
        assert_near(&found, "stiffness_nm_per_rad", k, 0.03);
        assert_near(&found, "hardening_per_rad2", beta, 0.15);
    }

    #[test]
    fn the_bearing_is_found_on_the_side_that_it_carries() {
        for (viscous, on_disc) in [([0.04, 0.0], 0.0), ([0.0, 0.04], 1.0)] {
            let (k, d) = (200.0, 0.1);
            let log = borne(|twist, rate| k * twist + d * rate, viscous, 0.0);
            let found = found("shaft_torsion", log, &[Coupling::spring(20.0, 0.03, 0.65)]);
            let share = found.iter().find(|(name, _)| name == "bearing_on_disc_share").map_or(0.0, |c| c.1);
            assert_eq!(share, on_disc, "{found:?}");
            assert_near(&found, "stiffness_nm_per_rad", k, 0.02);
        }
    }

    #[test]
    fn a_bearing_of_the_disc_reverses_when_the_disc_does() {
        // A spring so soft that motor and disc turn either way for a tenth of the time.
        let (k, d, coulomb) = (40.0, 0.05, 0.4);
        let logs = [borne(|twist, rate| k * twist + d * rate, [0.0, 0.0], coulomb)];
        let scales = DriveScales::new(&logs);
        let balance = drive::balance(&logs, &DrivePrior::default(), &scales);
        let spring = Coupling { bearing_on_disc: true, ..Coupling::spring(9.6, 0.04, 0.61) };
        let law = spring.law(&of_effort(scales.effort));
        let left = |coulomb_nm: f64| {
            // The torque is the same; how much of it follows the disc's speed is not.
            let torque_nm = drive::direction(&logs[0], scales.speed).iter().map(|s| coulomb * s).collect();
            let bearing = Bearing::new(torque_nm, &[0.0, coulomb_nm, 0.0], &scales);
            let (shaft, _) = shaft_torque((&logs[0], 0), 0.0, &law, &bearing, 0.01);
            let [effort, acceleration] = &logs[0].quick;
            let rest: Vec<f64> = (0..shaft.len())
                .map(|i| effort[i] - law.motor_inertia * acceleration[i] - shaft[i])
                .collect();
            balance.rms(&rest)
        };
        assert!(left(coulomb) < 0.3 * left(0.0), "{} {}", left(coulomb), left(0.0));
    }

    #[test]
    fn a_spring_of_two_stages_is_found_with_its_soft_one() {
        let (k, soft, half, d) = (260.0, 0.45, 0.012, 0.1);
        let log = swinging_disc(|twist: f64, rate| {
            let beyond = (twist.abs() - half).max(0.0) * twist.signum();
            k * (soft * twist + (1.0 - soft) * beyond) + d * rate
        });
        let grid = [Coupling::spring(17.0, 0.03, 0.65), Coupling::spring(34.0, 0.03, 0.65)];
        let found = found("shaft_torsion", log, &grid);
        assert_near(&found, "stiffness_nm_per_rad", k, 0.05);
        assert_near(&found, "soft_stage_share", soft, 0.1);
        assert_near(&found, "soft_stage_rad", 2.0 * half, 0.1);
    }

    /// A log whose disc has this play.
    fn with_play(gap: f64) -> DriveLog {
        let (k, d) = (1100.0, 0.5);
        swinging_disc(|twist: f64, rate| {
            let overlap = (twist.abs() - 0.5 * gap).max(0.0) * twist.signum();
            let carried = k * overlap + d * rate;
            if overlap * carried > 0.0 { carried } else { 0.0 }
        })
    }

    fn plays(widths: [f64; 4]) -> [Coupling; 4] {
        widths.map(|gap| Coupling { gap, ..Coupling::spring(48.0, 0.05, 0.55) })
    }

    #[test]
    fn play_is_found_with_its_width() {
        let gap = 0.02;
        let found = found("backlash", with_play(gap), &plays([0.006, 0.012, 0.025, 0.05]));
        // Stiffness and damping of blows that last some samples are not.
        assert_near(&found, "gap_rad", gap, 0.05);
    }

    #[test]
    fn a_stage_that_a_turn_of_some_lead_moves_has_the_same_play() {
        const LEAD_M: f64 = 2.5e-3 / std::f64::consts::TAU;
        const GAP_RAD: f64 = 0.02;
        let turned = with_play(GAP_RAD);
        let times = |values: &[f64], by: f64| values.iter().map(|x| x * by).collect::<Vec<f64>>();
        let mass = INERTIA_KG_M2 / (LEAD_M * LEAD_M);
        let moved = DriveLog::made(
            "log".into(),
            turned.grid.clone(),
            times(&turned.effort, LEAD_M.recip()),
            times(&turned.position, LEAD_M),
            turned.friction.map(|friction| times(&friction, LEAD_M.recip())),
            turned.load_n,
            turned.usable,
            mass,
        );
        let grid = plays([0.006, 0.012, 0.025, 0.05].map(|gap| gap * LEAD_M));
        let found = found_in((false, mass), "backlash", moved, &grid);
        assert_near(&found, "gap_m", GAP_RAD * LEAD_M, 0.05);
    }

    /// Deviation that the sensors' noise leaves behind a coupling at each point of its log, beyond the bridge's in the balance.
    fn noise_behind(log: DriveLog, numbers: &Coupling, pull: f64) -> Vec<f64> {
        let logs = [log];
        let scales = DriveScales::new(&logs);
        let balance = drive::balance(&logs, &DrivePrior::default(), &scales);
        let bearing = Bearing::new(vec![0.0; balance.response.len()], &[0.0; 3], &scales);
        let view = view(&logs, &scales, &balance, &[]);
        let law = numbers.law(&of_effort(scales.effort));
        noise_variance(&view, &law, &bearing, pull).iter().map(|v| v.sqrt()).collect()
    }

    /// A coupling of this stiffness and damping.
    fn coupling(k: f64, d: f64) -> Coupling {
        let omega = f64::sqrt(k / DISC_KG_M2);
        Coupling::spring(omega / std::f64::consts::TAU, 0.5 * d * omega / k, DISC_KG_M2 / INERTIA_KG_M2)
    }

    #[test]
    fn a_disc_on_a_soft_spring_swings_with_the_noise_of_the_bridge() {
        let (k, d) = (40.0, 0.04);
        let log = swinging_disc(|twist, rate| k * twist + d * rate);
        let (sigma, width) = (noise::bridge_deviation(log.friction.as_ref().unwrap()), log.width);
        let noise = filters::rms(&noise_behind(log, &coupling(k, d), 0.0));
        // White noise through k / (k + i d ω − J ω²) and the balance's Gaussian, over what that leaves of the noise itself.
        let step = 1e-5;
        let passed = |i: usize| {
            let omega = step * (i as f64 + 0.5);
            let (real, imaginary) = (k - DISC_KG_M2 * (1e3 * omega).powi(2), d * 1e3 * omega);
            let gain = (k * k + imaginary * imaginary) / (real * real + imaginary * imaginary);
            (gain - 1.0) * (-(omega * width).powi(2)).exp()
        };
        let points = (std::f64::consts::PI / step) as usize;
        let variance = (0..points).map(passed).sum::<f64>() * step / std::f64::consts::PI;
        let there = sigma * variance.sqrt();
        assert!((0.8..1.25).contains(&(noise / there)), "{noise} {there}");
    }

    #[test]
    fn where_the_disc_lies_in_its_play_is_not_known_before_the_first_blow() {
        let (k, gap, d) = (1100.0, 0.02, 0.5);
        let noise = noise_behind(with_play(gap), &Coupling { gap, ..coupling(k, d) }, PULL);
        let usual = filters::rms(&noise);
        let first_blow = noise[..noise.len() / 16].iter().copied().fold(0.0, f64::max);
        assert!(first_blow > 5.0 * usual, "{first_blow} {usual}");
    }

    #[test]
    fn what_bears_on_the_motor_is_told_with_the_coupling_and_not_without() {
        let left = |(k, bearing_on_disc): (f64, bool)| -> [f64; 2] {
            let (omega, damping_ratio) = ((k / DISC_KG_M2).sqrt(), 0.01);
            let d = 2.0 * damping_ratio * k / omega;
            let viscous = if bearing_on_disc { [0.0, 0.02] } else { [0.02, 0.0] };
            let logs = [borne(|twist, rate| k * twist + d * rate, viscous, 0.0)];
            let scales = DriveScales::new(&logs);
            let balance = drive::balance(&logs, &DrivePrior::default(), &scales);
            let disc_share = DISC_KG_M2 / INERTIA_KG_M2;
            let spring = Coupling::spring(omega / std::f64::consts::TAU, damping_ratio, disc_share);
            let numbers = Coupling { bearing_on_disc, ..spring };
            let constants = numbers.constants(&of_effort(scales.effort));
            let viscous: Vec<f64> = logs[0].speed.iter().map(|w| 0.02 * w).collect();
            let residual = balance.solve(&[], &[]).residual;
            let told = Bearing::new(viscous.clone(), &[0.0, 0.0, 0.02], &scales);
            [told, Bearing::beside(&balance, &[], &scales)].map(|bearing| {
                let view = DriveView {
                    fixed: Some(&constants),
                    bearing: Some(&bearing),
                    ..view(&logs, &scales, &balance, &residual)
                };
                let form = alternatives_of_grid("shaft_torsion", &view, Vec::new()).remove(0);
                let added = form.response.expect("a coupling adds to the response");
                // T2 − T_f + (T_f − T_s) − J_m ω̇ − the bearing, wherever that is: nothing that is fitted.
                let motor = INERTIA_KG_M2 - DISC_KG_M2;
                let rest =
                    |i: usize| balance.response[i] + added[i] - motor * logs[0].acceleration[i] - viscous[i];
                balance.rms(&(0..added.len()).map(rest).collect::<Vec<_>>())
            })
        };
        // From a mode near the quickest of the torque's sines, 3.7 Hz, which without the coupling is taken for the bearing, to one
        // that follows.
        let found = [8.0, 20.0, 50.0, 200.0].map(|k| left((k, false)));
        assert!(found.iter().all(|[told, without]| told < without), "{found:?}");
        assert!(found[0][0] < 0.5 * found[0][1], "{found:?}");
        let on_disc = [50.0, 200.0].map(|k| left((k, true)));
        assert!(on_disc.iter().all(|[told, _]| *told < 0.05), "{on_disc:?}");
    }
}
