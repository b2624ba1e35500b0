//! Motor and disc apart: the disc behind a spring with a dead zone, turned by the measured motion of the motor.
//!
//! T_s = k (θ_m − θ_d ∓ gap/2) + d (ω_m − ω_d),   J_d ω̇_d = T_s − T_f,   T2 = J_m ω̇_m + bearing + T_s
//!
//! θ_m and T_f are measured, so only the disc is integrated; a weak pull towards the torque that the motor's own balance
//! says is in the shaft keeps it from drifting through the gap, whose crossings are too sensitive to be predicted for long.

use nalgebra::DMatrix;
use rayon::prelude::*;

use super::balance::{Alternative, DiscMotion, Solved};
use super::contact::problem::FREEDOM;
use super::drive::{DriveLog, INERTIA};
use super::effects::DriveView;
use super::evidence::{BALANCE_SHARE, log_occam};
use super::filters::gaussian;
use super::linear;
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
/// No pull is quicker than this share of the mode, which turns by so much in a sample: else the pull would make the torque in
/// the spring's place, whatever that is of.
const SLOWER_THAN_MODE: f64 = 0.5;
/// Points of the grid from which a fit starts, its iterations, and step and longest move of the logarithms.
const STARTS: usize = 3;
const ITERATIONS: usize = 20;
const STEP: f64 = 0.01;
/// The same where there is play: the instants at which it closes make the likelihood rough over less.
const STEP_OVER_PLAY: f64 = 0.05;
const REACH: f64 = 0.4;
/// Modes that the balance's filter lets through, Hz.
const HERTZ: [f64; 2] = [4.0, 150.0];
/// From a steel shaft's to one beyond which nothing swings.
const DAMPING_RATIO: [f64; 2] = [0.003, 1.5];
/// Neither motor nor disc is all of the inertia.
const DISC_SHARE: [f64; 2] = [0.1, 0.9];
/// From the width of some counts of an encoder to a loose key's.
const GAP_RAD: [f64; 2] = [1e-4, 0.3];

/// Pull with which a coupling is weighed against other causes: it moves the disc no further in a sample than the spring itself
/// does for the same error, (ω dt)² of it. A stronger one repeats the measurement in the spring's place.
fn judged(numbers: &TwoMass, log: &DriveLog) -> f64 {
    PULL.min((std::f64::consts::TAU * numbers.mode_hz * log.grid.step_s).powi(2))
}

/// Numbers of a coupling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TwoMass {
    /// Frequency of the disc on the spring, the motor held.
    pub mode_hz: f64,
    /// Damping ratio of that mode.
    pub damping_ratio: f64,
    /// The disc's share of the inertia.
    pub disc_share: f64,
    /// Width of the dead zone.
    pub gap_rad: f64,
}

/// Shaft torque and angle of the disc for a log.
fn shaft_torque(
    log: &DriveLog,
    numbers: &TwoMass,
    inertia: f64,
    bearing: &[f64],
    pull: f64,
) -> (Vec<f64>, Vec<f64>) {
    let n = log.len();
    let dt = log.grid.step_s;
    let disc = numbers.disc_share * inertia;
    let omega = std::f64::consts::TAU * numbers.mode_hz;
    let substeps = (omega * dt / TURN_IN_A_STEP).ceil().max(1.0) as usize;
    let h = dt / substeps as f64;
    let pull = pull.min(SLOWER_THAN_MODE * omega * dt);
    let (k, d) = (disc * omega * omega, 2.0 * numbers.damping_ratio * disc * omega);
    let half = 0.5 * numbers.gap_rad;
    let free = vec![0.0; n];
    let friction = log.friction.as_ref().unwrap_or(&free);
    let observed: Vec<f64> = gaussian(&log.effort, 1.0, 0)
        .iter()
        .zip(&log.acceleration)
        .zip(bearing)
        .map(|((t, a), b)| t - (inertia - disc) * a - b)
        .collect();
    // No smaller than what noise makes: inside the gap the torque is nothing.
    let sure = 0.1 * super::filters::rms(&observed);
    let x = &log.position;
    let (mut q, mut w) = (x[0] - observed[0] / k, 0.0);
    let mut out = vec![0.0; n];
    let mut disc_position = vec![q; n];
    for i in 1..n {
        let (before, now) =
            ((x[i] - x[i - 1]) / dt, if i + 1 < n { (x[i + 1] - x[i]) / dt } else { (x[i] - x[i - 1]) / dt });
        let earlier = if i > 1 { (x[i - 1] - x[i - 2]) / dt } else { before };
        let (va, vb) = (0.5 * (earlier + before), 0.5 * (before + now));
        let torque = |twist: f64, rate: f64| {
            if twist > half {
                (k * (twist - half) + d * rate).max(if half > 0.0 { 0.0 } else { f64::NEG_INFINITY })
            } else if twist < -half {
                (k * (twist + half) + d * rate).min(if half > 0.0 { 0.0 } else { f64::INFINITY })
            } else if half > 0.0 {
                0.0
            } else {
                k * twist + d * rate
            }
        };
        for s in 0..substeps {
            // Drift, kick, drift: motor and disc are seen at the same instant, in the middle of the step.
            let part = (s as f64 + 0.5) / substeps as f64;
            let motor = x[i - 1] + dt * part * (va + 0.5 * (vb - va) * part);
            q += 0.5 * h * w;
            let shaft = torque(motor - q, va + (vb - va) * part - w);
            w += h * (shaft - (friction[i - 1] + (friction[i] - friction[i - 1]) * part)) / disc;
            q += 0.5 * h * w;
        }
        out[i] = torque(x[i] - q, vb - w);
        // In the gap the torque does not say where the disc is, but that it is at the other end where the motor says so.
        let off = if out[i] != 0.0 {
            (out[i] - observed[i]) / k
        } else if observed[i].abs() > sure {
            x[i] - observed[i] / k - observed[i].signum() * half - q
        } else {
            0.0
        };
        q += pull * off;
        w += 0.06 * pull * off / dt;
        if !q.is_finite() || !w.is_finite() || q.abs() > 1e9 {
            return (vec![f64::NAN; n], disc_position);
        }
        disc_position[i] = q;
    }
    (out, disc_position)
}

fn alternative(
    effect: &'static str,
    view: &DriveView<'_>,
    numbers: &TwoMass,
    bearing: &[f64],
    pull: f64,
) -> Option<Alternative> {
    let n = numbers;
    let within = |[low, high]: [f64; 2], value: f64| (low..high).contains(&value);
    let allowed = within(HERTZ, n.mode_hz)
        && within(DAMPING_RATIO, n.damping_ratio)
        && within(DISC_SHARE, n.disc_share)
        && (n.gap_rad == 0.0 || within(GAP_RAD, n.gap_rad));
    if !allowed {
        return None;
    }
    let mut added = Vec::with_capacity(view.balance.response.len());
    let mut from = 0;
    for log in view.logs {
        let (torque, _) = shaft_torque(log, numbers, view.inertia, &bearing[from..from + log.len()], pull);
        from += log.len();
        let most = 10.0 * view.scales.effort;
        let friction = log.friction.as_ref();
        let change: Vec<f64> = torque
            .iter()
            .enumerate()
            .map(|(i, t)| friction.map_or(0.0, |f| f[i]) - t.clamp(-most, most))
            .collect();
        if change.iter().any(|x| !x.is_finite()) {
            return None;
        }
        added.extend(log.filtered(&change));
    }
    let disc = numbers.disc_share * view.inertia;
    let omega = std::f64::consts::TAU * numbers.mode_hz;
    let mut constants = vec![
        ("stiffness_nm_per_rad".to_string(), disc * omega * omega),
        ("damping_nm_s_per_rad".to_string(), 2.0 * numbers.damping_ratio * disc * omega),
        ("disc_inertia_kg_m2".to_string(), disc),
        ("mode_hz".to_string(), numbers.mode_hz),
    ];
    if numbers.gap_rad > 0.0 {
        constants.push(("gap_rad".to_string(), numbers.gap_rad));
    }
    Some(Alternative {
        form: format!("{:.0} Hz, gap {:.2e} rad", numbers.mode_hz, numbers.gap_rad),
        response: Some(added),
        disc: Some(DiscMotion { angle_rad: Vec::new(), angle_per_unit: Vec::new() }),
        base_shift: vec![(INERTIA, -disc)],
        constants,
        ..Alternative::columns(effect, Vec::<Parameter>::new(), Vec::new())
    })
}

/// The best shape of a coupling: a coarse grid, then a fit from its best points.
pub fn alternative_of_grid(
    effect: &'static str,
    view: &DriveView<'_>,
    grid: Vec<TwoMass>,
) -> Option<Alternative> {
    if !view.rotary || view.inertia <= 0.0 {
        return None;
    }
    if let Some(fixed) = view.fixed {
        let get = |name: &str| fixed.iter().find(|(key, _)| key == name).map_or(0.0, |(_, value)| *value);
        let (disc, k, mode_hz) = (get("disc_inertia_kg_m2"), get("stiffness_nm_per_rad"), get("mode_hz"));
        let damping_ratio = get("damping_nm_s_per_rad") * std::f64::consts::PI * mode_hz / k.max(1e-12);
        let numbers =
            TwoMass { mode_hz, damping_ratio, disc_share: disc / view.inertia, gap_rad: get("gap_rad") };
        let bearing = view.balance.bearing(&[]);
        return alternative(effect, view, &numbers, &bearing, judged(&numbers, &view.logs[0]))
            .map(|form| reckoned(view, &numbers, &bearing, form));
    }
    let trial = |numbers: &TwoMass, bearing: &[f64], pull: f64| -> Option<Trial> {
        let alternative = alternative(effect, view, numbers, bearing, pull)?;
        let solved = view.balance.solve_forms(&joined(view, &alternative));
        Some(Trial { numbers: *numbers, alternative, solved })
    };
    let bearing = view.balance.bearing(view.company.forms);
    let mut tried: Vec<Trial> =
        grid.par_iter().filter_map(|numbers| trial(numbers, &bearing, PULL)).collect();
    tried.sort_by(|a, b| b.solved.log_evidence.total_cmp(&a.solved.log_evidence));
    // Of each width the best, so that the fits do not all start in one valley.
    let mut widths: Vec<f64> = Vec::new();
    tried.retain(|t| {
        let new = t.numbers.gap_rad == 0.0 || !widths.contains(&t.numbers.gap_rad);
        widths.push(t.numbers.gap_rad);
        new
    });
    tried.truncate(STARTS);
    let refined_by = |start: Trial, bearing: &[f64], pull: f64| {
        refined(view, start, &|numbers: &TwoMass| trial(numbers, bearing, pull))
    };
    let of_starts = tried.into_iter().filter_map(|start| refined_by(start, &bearing, PULL));
    let best = of_starts.max_by(|(a, of_a), (b, of_b)| {
        (a.solved.log_evidence + of_a).total_cmp(&(b.solved.log_evidence + of_b))
    });
    let (best, mut log_prior) = best?;
    let bearing = view.balance.bearing(&joined(view, &best.alternative));
    let mut numbers = best.numbers;
    if numbers.gap_rad == 0.0 {
        for pull in WEAKER {
            let Some((better, occam)) =
                trial(&numbers, &bearing, pull).and_then(|t| refined_by(t, &bearing, pull))
            else {
                break;
            };
            (numbers, log_prior) = (better.numbers, occam);
        }
    }
    let found = alternative(effect, view, &numbers, &bearing, judged(&numbers, &view.logs[0]))?;
    Some(Alternative { log_prior, ..reckoned(view, &numbers, &bearing, found) })
}

/// With the disc's motion in each way.
fn reckoned(view: &DriveView<'_>, numbers: &TwoMass, bearing: &[f64], mut form: Alternative) -> Alternative {
    let starts = view.logs.iter().scan(0, |from, log| Some(std::mem::replace(from, *from + log.len())));
    let logs: Vec<(&DriveLog, usize)> = view.logs.iter().zip(starts).collect();
    let angles = |pull: f64| -> Vec<Vec<f64>> {
        let of = |(log, from): &(&DriveLog, usize)| {
            shaft_torque(log, numbers, view.inertia, &bearing[*from..*from + log.len()], pull).1
        };
        logs.iter().map(of).collect()
    };
    if let Some(disc) = &mut form.disc {
        disc.angle_rad = RECKONED.map(angles).to_vec();
    }
    form
}

/// A form beside those that stand in the balance.
fn joined<'a>(view: &'a DriveView<'_>, form: &'a Alternative) -> Vec<&'a Alternative> {
    view.company.forms.iter().copied().chain([form]).collect()
}

/// A coupling with what the balance makes of it.
struct Trial {
    numbers: TwoMass,
    alternative: Alternative,
    solved: Solved,
}

impl TwoMass {
    /// What is fitted: logarithms, so that a step is a ratio.
    fn logarithms(&self) -> Vec<f64> {
        let n = [self.mode_hz, self.damping_ratio, self.disc_share, self.gap_rad];
        n.iter().take(if self.gap_rad > 0.0 { 4 } else { 3 }).map(|n| n.ln()).collect()
    }

    fn of_logarithms(p: &[f64]) -> Self {
        Self {
            mode_hz: p[0].exp(),
            damping_ratio: p[1].exp(),
            disc_share: p[2].exp(),
            gap_rad: p.get(3).map_or(0.0, |gap| gap.exp()),
        }
    }
}

/// Occam's factor of the numbers, as a logarithm: their logarithms are equally likely between the ends, which is told by a
/// normal prior of the same deviation.
fn occam(curvature: &DMatrix<f64>) -> f64 {
    let sd = [HERTZ, DAMPING_RATIO, DISC_SHARE, GAP_RAD].map(|[low, high]| (high / low).ln() / 12f64.sqrt());
    log_occam(curvature, BALANCE_SHARE, &sd[..curvature.nrows()])
}

/// Gauss–Newton with damping on the logarithms; the base parameters are solved for each trial (variable projection). With
/// Occam's factor of the numbers; `None` where no derivative exists.
fn refined(
    view: &DriveView<'_>,
    start: Trial,
    trial: &(dyn Fn(&TwoMass) -> Option<Trial> + Sync),
) -> Option<(Trial, f64)> {
    let balance = view.balance;
    let scaled = |solved: &Solved| -> Vec<f64> {
        balance.used.iter().map(|&i| solved.residual[i] / balance.deviation[i]).collect()
    };
    let step = if start.numbers.gap_rad > 0.0 { STEP_OVER_PLAY } else { STEP };
    let mut best = start;
    let mut log_occam = None;
    let mut damping = 1e-2;
    for _ in 0..ITERATIONS {
        let p = best.numbers.logarithms();
        let r = scaled(&best.solved);
        let columns: Option<Vec<Vec<f64>>> = (0..p.len())
            .into_par_iter()
            .map(|i| {
                let moved = |step: f64| {
                    let mut q = p.clone();
                    q[i] += step;
                    let there = trial(&TwoMass::of_logarithms(&q))?;
                    Some(scaled(&there.solved).iter().zip(&r).map(|(a, b)| (b - a) / step).collect())
                };
                // At the end of what is allowed the other way.
                moved(step).or_else(|| moved(-step))
            })
            .collect();
        let Some(columns) = columns else { break };
        let weights: Vec<f64> =
            r.iter().map(|r| (FREEDOM + 1.0) / (FREEDOM + r * r) / balance.temper).collect();
        let (h, g) = linear::normal_equations(&columns, &weights, &r);
        log_occam = Some(occam(&h));
        let mut better = None;
        for _ in 0..4 {
            let mut damped = h.clone();
            for i in 0..p.len() {
                damped[(i, i)] += damping * h[(i, i)] + f64::MIN_POSITIVE;
            }
            let d = linear::factor(&damped).solve(&g);
            let excess = d.amax().max(REACH) / REACH;
            let q: Vec<f64> = p.iter().zip(d.iter()).map(|(p, d)| p + d / excess).collect();
            let there = trial(&TwoMass::of_logarithms(&q));
            better = there.filter(|t| t.solved.log_evidence > best.solved.log_evidence);
            if better.is_some() {
                break;
            }
            damping *= 10.0;
        }
        let Some(better) = better else { break };
        let gained = better.solved.log_evidence - best.solved.log_evidence;
        best = better;
        damping = (0.3 * damping).max(1e-4);
        // Half a unit of the likelihood itself changes no decision.
        if gained < 0.5 * BALANCE_SHARE {
            break;
        }
    }
    Some((best, log_occam?))
}
