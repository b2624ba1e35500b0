//! The drive's balance: torque of M2 (or a force), less the friction torque, against inertia and bearing.
//!
//! T2 − T_f = J ω̇ + T_c sgn ω + b ω + lateness of the channels
//!
//! Every term goes through one Gaussian, whose derivatives give ω and ω̇ from the angle; it is as narrow as the angle's
//! noise allows. Rows near standstill are left out: there the bearing's friction is a reaction.

use super::balance::{Alternative, Balance, LogRows};
use super::contact::log::ContactLog;
use super::effects::coordinates::TIME;
use super::filters::{
    self, WIDEST_MEAN, adaptively_smoothed, gaussian, largest_change, local_maximum, rms, steps, white_share,
};
use super::grid::Grid;
use super::noise::{self, White};
use super::term::Parameter;
use crate::files::log::{Log, LogKind, unwrapped};
use crate::input_error::InputError;

/// Widths of the filter that are tried, samples.
const WIDTHS: [f64; 6] = [1.5, 2.0, 3.0, 4.0, 6.0, 9.0];
/// Where the angle's noise asks for more than this width, its noise is borne instead, samples.
const WIDE_ENOUGH: f64 = 4.0;
/// Widths of a filter that blows of a coupling pass, samples: the narrowest behind which the inertial torque's noise is this share
/// of the effort at most, since an observer of the disc averages it further.
const QUICK: [f64; 3] = [1.0, 1.5, 2.0];
const QUICK_NOISE: f64 = 0.05;
/// The drive stands where it is slower than this share of its usual speed, …
const STANDSTILL: f64 = 0.01;
/// … or than so many deviations of the speed's noise.
const STANDSTILL_NOISES: f64 = 5.0;
/// What no model of a drive is more accurate than, relative to its own effort.
const LEAST_NOISE: f64 = 2e-3;
/// Share of the filtered change a sample that is not known, since the channels are not sampled at one instant.
const BETWEEN_SAMPLES: f64 = 0.1;
/// The channels of a log are taken within this share of its step of each other: a converter's scan, and a torque that is computed
/// after it.
const WITHIN_A_STEP: f64 = 0.05;
/// The friction bridge's delay is known within this time by the rig file, s.
const BRIDGE_LATE_S: f64 = 2e-4;
/// Gain of the friction channel is known within 0.5 %.
const GAIN: f64 = 5e-3;
/// Noise of the bridge that is slower than from sample to sample is as large as that: a deviation of both together.
const SLOWER_TOO: f64 = 2.0;
/// A torque rests where it stays within so many deviations of its noise over so many samples about a point.
const RESTS_WITHIN: f64 = 4.0;
const SMOOTHED_OVER: usize = WIDEST_MEAN as usize;
/// Names of the base parameters' places.
pub const INERTIA: usize = 0;
/// Place of the Coulomb torque.
pub const COULOMB: usize = 1;
/// Place of the viscous friction.
const VISCOUS: usize = 2;
/// Where the errors of the channels begin.
const SENSORS: usize = 3;
/// Which of them is the share of the bridge's noise that is left out.
const NOISE_SHARE: &str = "friction_noise_share";

/// Signals of a drive.
#[derive(Debug, Clone)]
pub struct DriveLog {
    /// The log's name.
    pub source: String,
    /// The grid.
    pub grid: Grid,
    /// Torque or force.
    pub effort: Vec<f64>,
    /// Angle or position.
    pub position: Vec<f64>,
    /// Friction torque on the disc, taken ahead by its sensor's delay; `None` where nothing is pressed.
    pub friction: Option<Vec<f64>>,
    /// What of it is the bridge's noise where the torque rests; 0 where it does not. The motor's torque knows nothing of that, and a
    /// coupling that let less of it through would look better for it: the base may leave it out too.
    pub friction_noise: Option<Vec<f64>>,
    /// What the sensor shows beside the torque by ringing, where that was taken off.
    pub ringing: Option<Vec<f64>>,
    /// Normal force.
    pub load_n: Option<Vec<f64>>,
    /// Points that take part.
    pub usable: Vec<bool>,
    /// Filtered: speed, its derivative, the filter's width in samples.
    pub speed: Vec<f64>,
    /// Acceleration.
    pub acceleration: Vec<f64>,
    /// Effort and acceleration as quick as blows of a coupling are.
    pub quick: [Vec<f64>; 2],
    /// Width of the filter of those, samples.
    pub quick_width: f64,
    /// Width of the filter, samples.
    pub width: f64,
    /// White noise of the inertial torque behind the filter.
    pub inertial_noise: Vec<f64>,
    /// What the angle's error makes of it at worst, beside that: it may swing with a speed loop, or be motion.
    pub inertial_swing: f64,
}

impl DriveLog {
    /// From a drive log; the filter is as narrow as the angle's noise allows for this inertia.
    ///
    /// # Errors
    /// Where a column is missing.
    pub fn new(log: &Log, inertia: f64) -> Result<Self, InputError> {
        let signals = log.drive()?;
        let grid = Grid::new(signals.time_s);
        let rotary = log.kind()? == LogKind::RotaryDrive;
        let raw = if rotary { unwrapped(signals.position) } else { signals.position.to_vec() };
        let position = grid.channel(signals.time_s, &raw);
        let effort = grid.channel(signals.time_s, signals.effort);
        let usable = grid.covered.clone();
        Ok(Self::made(log.source.clone(), grid, effort, position, None, None, usable, inertia))
    }

    /// The drive of a contact log; `None` where its torque is not logged.
    pub fn of_contact(log: &ContactLog, inertia: f64) -> Option<Self> {
        let effort = log.m2_torque_nm.clone()?;
        let friction = filters::shifted(&log.friction_nm, log.friction_late);
        let load = Some(log.load_n.clone());
        let (grid, usable) = (log.grid.clone(), log.usable.clone());
        Some(Self::made(
            log.source.clone(),
            grid,
            effort,
            log.angle_rad.clone(),
            Some(friction),
            load,
            usable,
            inertia,
        ))
    }

    #[allow(clippy::too_many_arguments, reason = "one for each signal")]
    pub(super) fn made(
        source: String,
        grid: Grid,
        effort: Vec<f64>,
        position: Vec<f64>,
        friction: Option<Vec<f64>>,
        load_n: Option<Vec<f64>>,
        usable: Vec<bool>,
        inertia: f64,
    ) -> Self {
        let contact = friction.is_some();
        let friction_noise = friction.as_ref().map(|f| noise_at_rest(f, noise::bridge_deviation(f)));
        // Noise of the acceleration falls with the 2.5th power of the width, that of the torque with its root.
        let (angle_noise, effort_noise) = (deviation_of(contact, &position), deviation_of(contact, &effort));
        let jitter_s = noise::jitter(&position) * grid.step_s;
        let of_angle = |noise: f64, passed: f64| inertia * noise * passed / grid.step_s.powi(2);
        let usual_speed = rms(&gaussian(&position, WIDTHS[0], 1)) / grid.step_s;
        let inertial = |width: f64| {
            let of_time = of_angle(jitter_s * usual_speed, white_curvature(width));
            of_angle(angle_noise, curvature_passed(width, contact)).hypot(of_time)
        };
        let fits = |width: &f64| inertial(*width) < 0.5 * effort_noise * white_share(*width);
        let (narrowest, widest) = (if contact { WIDTHS[2] } else { WIDTHS[0] }, WIDTHS[5]);
        let width = if inertia.is_finite() {
            // A wider one would take out what ripples; what the acceleration's noise then makes is a noise of its own.
            WIDTHS.into_iter().find(fits).unwrap_or(WIDE_ENOUGH).max(narrowest)
        } else {
            widest
        };
        let dt = grid.step_s;
        let small = |width: &f64| {
            inertia * angle_noise * curvature_passed(*width, contact) / (dt * dt) < QUICK_NOISE * rms(&effort)
        };
        let quick_width = QUICK.into_iter().find(small).unwrap_or(width).min(width);
        let quick = quick(&effort, &position, quick_width, dt);
        let speed: Vec<f64> = gaussian(&position, width, 1).iter().map(|d| d / dt).collect();
        let (inertial_noise, inertial_swing) = if inertia.is_finite() {
            let white = of_angle(noise::difference_deviation(&position), white_curvature(width));
            let at_worst = of_angle(angle_noise, curvature_passed(width, contact));
            let per_speed = of_angle(jitter_s, white_curvature(width));
            let noise = speed.iter().map(|v| white.hypot(per_speed * v)).collect();
            (noise, (at_worst.powi(2) - white.powi(2)).max(0.0).sqrt())
        } else {
            (vec![0.0; speed.len()], 0.0)
        };
        let acceleration = gaussian(&position, width, 2).iter().map(|d| d / (dt * dt)).collect();
        Self {
            source,
            grid,
            effort,
            position,
            friction,
            ringing: None,
            friction_noise,
            load_n,
            usable,
            speed,
            acceleration,
            quick,
            quick_width,
            width,
            inertial_noise,
            inertial_swing,
        }
    }

    /// With what the contact log shows beside the torque by its sensor's ringing.
    #[must_use]
    pub fn beside_ringing(self, shown: &ContactLog) -> Self {
        let shown = filters::shifted(&shown.friction_nm, shown.friction_late);
        let ringing =
            self.friction.as_ref().map(|friction| shown.iter().zip(friction).map(|(a, b)| a - b).collect());
        Self { ringing, ..self }
    }

    /// The same with as much noise of each sensor again as there is in it.
    #[must_use]
    pub fn noisier(&self, white: &mut White) -> Self {
        let contact = self.friction.is_some();
        let add = |values: &[f64], deviation: f64, white: &mut White| -> Vec<f64> {
            values.iter().map(|x| x + deviation * white.next()).collect()
        };
        let effort = add(&self.effort, deviation_of(contact, &self.effort), white);
        let position = add(&self.position, noise::difference_deviation(&self.position), white);
        let friction = self.friction.as_ref().map(|f| add(f, noise::bridge_deviation(f), white));
        let quick = quick(&effort, &position, self.quick_width, self.grid.step_s);
        Self { effort, position, friction, quick, ..self.clone() }
    }

    /// Points of the grid.
    pub fn len(&self) -> usize {
        self.grid.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.grid.is_empty()
    }

    /// A signal through the balance's filter.
    pub fn filtered(&self, values: &[f64]) -> Vec<f64> {
        gaussian(values, self.width, 0)
    }
}

/// Effort and acceleration behind a filter of this width.
fn quick(effort: &[f64], position: &[f64], width: f64, step_s: f64) -> [Vec<f64>; 2] {
    let acceleration = gaussian(position, width, 2).iter().map(|d| d / (step_s * step_s)).collect();
    [gaussian(effort, width, 0), acceleration]
}

/// What effects in the drive may follow, with units, all logs on end.
pub fn coordinates(logs: &[DriveLog], rotary: bool) -> Vec<(String, Vec<f64>)> {
    let all = |of: &dyn Fn(&DriveLog) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let (place, length) = if rotary { ("angle within a turn", "rad") } else { ("position", "m") };
    let within = |x: &f64| if rotary { x.rem_euclid(std::f64::consts::TAU) } else { *x };
    let mut out = vec![
        (format!("speed, {length}/s"), all(&|log| log.speed.clone())),
        (format!("acceleration, {length}/s²"), all(&|log| log.acceleration.clone())),
        (format!("{place}, {length}"), all(&|log| log.position.iter().map(within).collect())),
        (TIME.into(), all(&|log| log.grid.time_s.clone())),
    ];
    if logs.iter().all(|log| log.load_n.is_some()) {
        out.push(("normal force, N".into(), all(&|log| log.load_n.clone().unwrap_or_default())));
    }
    out
}

/// Share of an angle's noise that is left in its second derivative, per sample squared: white noise; beside a contact the error
/// of a count at worst, all at the frequency that the filter passes best. A speed loop that swings by half a count repeats it.
/// A drive alone is looked at for its ripple, which a filter that is wide enough for that would take out.
fn curvature_passed(width: f64, contact: bool) -> f64 {
    let tonal = 2.0 / (std::f64::consts::E * width * width);
    if contact { white_curvature(width).max(tonal) } else { white_curvature(width) }
}

/// The same of white noise.
fn white_curvature(width: f64) -> f64 {
    (0.375 / (std::f64::consts::PI.sqrt() * width.powi(5))).sqrt()
}

/// Noise of a channel. Beside a contact it is what the channel shows in its quiet stretches; a drive alone may ripple
/// all the time, so that only what changes from sample to sample counts.
fn deviation_of(contact: bool, values: &[f64]) -> f64 {
    if contact { noise::standard_deviation(values) } else { noise::difference_deviation(values) }
}

/// What of a torque is noise where it rests: its difference to itself smoothed, where that changes within a few deviations of the
/// noise as far as it was smoothed over; 0 elsewhere, and near the ends, where a mean over a mirrored torque tells of no noise.
fn noise_at_rest(torque: &[f64], deviation: f64) -> Vec<f64> {
    let smooth = adaptively_smoothed(torque, SLOWER_TOO * deviation);
    let below: Vec<f64> = smooth.iter().map(|x| -x).collect();
    let range = local_maximum(&smooth, SMOOTHED_OVER).into_iter().zip(local_maximum(&below, SMOOTHED_OVER));
    let rests = range.map(|(most, least)| most + least < RESTS_WITHIN * deviation);
    let noise = torque.iter().zip(&smooth).map(|(x, smooth)| x - smooth);
    let within = SMOOTHED_OVER..torque.len().saturating_sub(SMOOTHED_OVER);
    let rests = rests.enumerate().map(|(i, rests)| rests && within.contains(&i));
    noise.zip(rests).map(|(noise, rests)| if rests { noise } else { 0.0 }).collect()
}

/// Usual sizes over the training logs.
#[derive(Debug, Clone, Copy)]
pub struct DriveScales {
    /// Speed.
    pub speed: f64,
    /// Torque or force.
    pub effort: f64,
    /// Of what is left of it when the friction torque is taken off.
    pub own: f64,
    /// Longest log, s.
    pub time_s: f64,
    /// Usual load, N.
    pub load_n: f64,
}

impl DriveScales {
    /// Of the training logs.
    pub fn new(logs: &[DriveLog]) -> Self {
        let usual = |of: &dyn Fn(&DriveLog) -> f64| rms(&logs.iter().map(of).collect::<Vec<_>>()).max(1e-12);
        let own = |log: &DriveLog| rms(&response(log));
        Self {
            speed: usual(&|log| rms(&log.speed)),
            effort: usual(&|log| rms(&log.effort)),
            own: usual(&own),
            time_s: logs.iter().filter_map(|log| log.grid.time_s.last().copied()).fold(1e-9, f64::max),
            load_n: usual(&|log| log.load_n.as_ref().map_or(0.0, |n| rms(n))),
        }
    }
}

/// Effort less friction, filtered.
pub fn response(log: &DriveLog) -> Vec<f64> {
    let y: Vec<f64> = match &log.friction {
        Some(friction) => log.effort.iter().zip(friction).map(|(t, f)| t - f).collect(),
        None => log.effort.clone(),
    };
    log.filtered(&y)
}

/// Speed below which Coulomb's friction is not all there.
fn turning_speed(usual_speed: f64) -> f64 {
    0.5 * STANDSTILL * usual_speed
}

/// Direction of motion, −1 to 1, filtered.
pub fn direction(log: &DriveLog, usual_speed: f64) -> Vec<f64> {
    let sign: Vec<f64> = log.speed.iter().map(|v| (v / turning_speed(usual_speed)).tanh()).collect();
    log.filtered(&sign)
}

/// What bears on a motor beside its inertia and a coupling.
#[derive(Debug, Clone)]
pub struct Bearing {
    /// Its torque, all points of all logs on end, where it turns as the motor does.
    pub torque_nm: Vec<f64>,
    coulomb_nm: f64,
    viscous_nm_s: f64,
    turning_rad_s: f64,
}

impl Bearing {
    /// Of this torque, some of which these values of the base make.
    pub fn new(torque_nm: Vec<f64>, base: &[f64], scales: &DriveScales) -> Self {
        let turning_rad_s = turning_speed(scales.speed);
        let [coulomb_nm, viscous_nm_s] = [base[COULOMB], base[VISCOUS]].map(|p| p.max(0.0));
        Self { torque_nm, coulomb_nm, viscous_nm_s, turning_rad_s }
    }

    /// Of what a balance makes of it beside these forms.
    pub fn beside(balance: &Balance, forms: &[&Alternative], scales: &DriveScales) -> Self {
        let solved = balance.solve_forms(forms);
        Self::new(balance.all_but_inertia(&solved, forms), &solved.p, scales)
    }

    /// Coulomb's and viscous friction at a speed.
    pub fn friction_nm(&self, speed_rad_s: f64) -> f64 {
        self.coulomb_nm * (speed_rad_s / self.turning_rad_s).clamp(-1.0, 1.0)
            + self.viscous_nm_s * speed_rad_s
    }

    /// What that friction does in a step to a body of this inertia.
    pub fn slower(&self, step_s: f64, inertia_kg_m2: f64) -> Slower {
        let coulomb_rad_s = step_s * self.coulomb_nm / inertia_kg_m2;
        let viscous = 1.0 + step_s * self.viscous_nm_s / inertia_kg_m2;
        Slower {
            coulomb_rad_s,
            least_rad_s: coulomb_rad_s + viscous * self.turning_rad_s,
            kept: viscous.recip(),
            kept_at_rest: (viscous + coulomb_rad_s / self.turning_rad_s).recip(),
        }
    }
}

/// What a bearing's friction does to a body's speed in a step: implicit, so that one that stands rests.
pub struct Slower {
    coulomb_rad_s: f64,
    least_rad_s: f64,
    kept: f64,
    kept_at_rest: f64,
}

impl Slower {
    /// Speed after the step of a body that would have this one without that friction.
    #[inline]
    pub fn slowed(&self, free_rad_s: f64) -> f64 {
        if free_rad_s.abs() > self.least_rad_s {
            (free_rad_s - self.coulomb_rad_s.copysign(free_rad_s)) * self.kept
        } else {
            free_rad_s * self.kept_at_rest
        }
    }
}

/// What is known of the drive beforehand: nothing by default.
#[derive(Debug, Clone, Copy, Default)]
pub struct DrivePrior {
    /// Inertia or mass, and whether the rig file says it.
    pub inertia: Option<f64>,
    /// Coulomb torque of the bearing.
    pub coulomb: Option<f64>,
    /// Viscous friction.
    pub viscous: Option<f64>,
    /// Deviation of what the friction bridge shows where nothing pulls.
    pub bridge_zero: Option<f64>,
}

/// The balance of these logs.
pub fn balance(logs: &[DriveLog], prior: &DrivePrior, scales: &DriveScales) -> Balance {
    let contact = logs.iter().any(|log| log.friction.is_some());
    let concat = |of: &dyn Fn(&DriveLog) -> Vec<f64>| logs.iter().flat_map(of).collect::<Vec<f64>>();
    let rate = |log: &DriveLog, values: &[f64]| -> Vec<f64> {
        gaussian(values, log.width, 1).iter().map(|d| d / log.grid.step_s).collect()
    };
    let wide = |name: &str, mean: f64, sd: f64| Parameter {
        amplitude: false,
        mean,
        ..Parameter::amplitude(name, sd)
    };
    let (v, own) = (scales.speed, scales.own);
    let interval_s = logs.iter().map(|log| log.grid.step_s).fold(0.0, f64::max);
    let acceleration = concat(&|log| log.acceleration.clone());
    let usual_acceleration = rms(&acceleration).max(1e-12);
    let mut base = vec![
        // Inertia within 20 % of the rig file, or anything that the effort could move.
        (
            prior.inertia.map_or(wide("inertia", 0.0, 10.0 * scales.effort / usual_acceleration), |j| {
                wide("inertia", j, 0.2 * j)
            }),
            acceleration,
        ),
        (
            wide(
                "coulomb",
                prior.coulomb.unwrap_or(0.3 * own),
                prior.coulomb.map_or(own, |c| c.max(0.3 * own)),
            ),
            concat(&|log| direction(log, v)),
        ),
        // No bearing drives: under a proportional speed loop the torque falls with speed, and would be taken for it.
        (
            Parameter {
                lower: 0.0,
                ..wide(
                    "viscous",
                    prior.viscous.unwrap_or(0.0),
                    prior.viscous.map_or(own / v, |c| (2.0 * c).max(0.2 * own / v)),
                )
            },
            concat(&|log| log.speed.clone()),
        ),
        (
            wide("effort_late_s", 0.0, WITHIN_A_STEP * interval_s),
            concat(&|log| rate(log, &log.effort).iter().map(|d| -d).collect()),
        ),
    ];
    if contact {
        let friction = |log: &DriveLog| log.friction.clone().unwrap_or_else(|| vec![0.0; log.len()]);
        base.push((wide("friction_late_s", 0.0, BRIDGE_LATE_S), concat(&|log| rate(log, &friction(log)))));
        base.push((wide("friction_gain", 0.0, GAIN), concat(&|log| log.filtered(&friction(log)))));
        let noise = |log: &DriveLog| -> Vec<f64> {
            let of_bridge = log.friction_noise.iter().flatten().map(|noise| -noise);
            log.filtered(&of_bridge.collect::<Vec<f64>>())
        };
        base.push((wide(NOISE_SHARE, 0.0, 1.0), concat(&noise)));
    }
    if let Some(deviation) = prior.bridge_zero {
        base.push((wide("friction_zero", 0.0, deviation), concat(&|log| vec![-1.0; log.len()])));
    }
    let rows: Vec<LogRows<'_>> = logs.iter().map(|log| rows(log, contact, scales)).collect();
    let balance = Balance::new(concat(&response), base, &rows, scales.effort)
        .with_sensors(SENSORS, prior.bridge_zero.unwrap_or(0.0))
        .without_noise_of(NOISE_SHARE);
    // A drive alone is looked at for its ripple.
    if contact { balance } else { balance.without_rests() }
}

/// The response of a balance of these logs as the friction channel shows it, with its ringing; `None` where none was taken off.
pub fn shown_response(balance: &Balance, logs: &[DriveLog]) -> Option<Vec<f64>> {
    logs.iter().any(|log| log.ringing.is_some()).then(|| {
        let of_log = |log: &DriveLog| {
            log.ringing.as_ref().map_or_else(|| vec![0.0; log.len()], |ringing| log.filtered(ringing))
        };
        balance.response.iter().zip(logs.iter().flat_map(of_log)).map(|(y, ringing)| y - ringing).collect()
    })
}

/// Rows of a log: noise from named sources; near standstill the bearing's friction is a reaction.
fn rows<'l>(log: &'l DriveLog, contact: bool, scales: &DriveScales) -> LogRows<'l> {
    let effort_change = largest_change(&log.effort, log.width);
    let friction_change =
        log.friction.as_ref().map_or_else(|| vec![0.0; log.len()], |f| largest_change(f, log.width));
    // The same for what swings faster than the filter lets pass: a limit cycle's harmonics beyond half the rate fold back to
    // where it does.
    let swings = steps(&log.effort, log.width);
    let friction_swings = log.friction.as_ref().map_or_else(|| vec![0.0; log.len()], |f| steps(f, log.width));
    let folded = BETWEEN_SAMPLES * white_share(log.width);
    let passed = white_share(log.width);
    let unfiltered = passed.powi(-2);
    let of_effort = deviation_of(contact, &log.effort) * passed;
    let of_bridge = log.friction.as_ref().map_or(0.0, |friction| noise::bridge_deviation(friction) * passed);
    // Where the torque rests the base may leave the bridge's noise out: how much of it is then in a row the residuals tell, between
    // all of it and what its means have.
    let in_means = (white_share(WIDEST_MEAN) / white_share(log.width)).min(1.0).powi(2);
    let rests = log.friction_noise.as_ref().map_or_else(
        || vec![false; log.len()],
        |noise| {
            let moves: Vec<f64> = noise.iter().map(|noise| f64::from(u8::from(*noise == 0.0))).collect();
            let reach = (filters::REACH * log.width).ceil() as usize;
            local_maximum(&moves, reach).into_iter().map(|moves| moves == 0.0).collect()
        },
    );
    let (rest, form) = (rests.clone(), LEAST_NOISE * scales.own);
    let noise =
        move |i: usize| vec![of_effort, if rest[i] { 0.0 } else { of_bridge }, log.inertial_noise[i], form];
    let guessed = move |i: usize| {
        let between = (BETWEEN_SAMPLES * effort_change[i], BETWEEN_SAMPLES * friction_change[i]);
        let folded = folded * swings[i].hypot(friction_swings[i]);
        vec![between.0, between.1, folded, log.inertial_swing, if rests[i] { of_bridge } else { 0.0 }]
    };
    // What the derivative of a Gaussian lets through of white noise.
    let passes = (0.25 / (std::f64::consts::PI.sqrt() * log.width.powi(3))).sqrt();
    let speed_noise = deviation_of(contact, &log.position) * passes / log.grid.step_s;
    let standstill = (STANDSTILL * scales.speed).max(STANDSTILL_NOISES * speed_noise);
    let left_out = log.speed.iter().zip(&log.usable).map(|(v, used)| v.abs() < standstill || !used).collect();
    LogRows {
        width: log.width,
        step_s: log.grid.step_s,
        left_out,
        noise: Box::new(noise),
        guessed: Box::new(guessed),
        least: vec![in_means],
        most: [vec![unfiltered, unfiltered, 1.0, 1.0], vec![unfiltered]],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_error_of_an_angle_that_swings_by_half_a_count_is_in_the_noise() {
        // At 70 Hz in a log of 1 kHz: the encoder shows nothing, and all of the motion is the error.
        let swing: Vec<f64> = (0..4000).map(|i| 0.49 * (0.44 * f64::from(i)).sin()).collect();
        let error: Vec<f64> = swing.iter().map(|x| x.round() - x).collect();
        let width = 4.0;
        let left = rms(&gaussian(&error, width, 2)[100..3900]);
        let noise = |contact| curvature_passed(width, contact) / 12.0f64.sqrt();
        assert!(
            left < 1.5 * noise(true) && left > 3.0 * noise(false),
            "{left} {} {}",
            noise(true),
            noise(false)
        );
    }

    #[test]
    fn an_angle_that_swings_everywhere_is_as_noisy_as_it_is_from_sample_to_sample() {
        const INERTIA_KG_M2: f64 = 0.02;
        // A slow turn to and fro, and 12 Hz upon it: a parabola follows in no window of the angle.
        let (slow, quick) = ((12.0, 0.5), (1e-3, std::f64::consts::TAU * 12.0));
        let time: Vec<f64> = (0..8000).map(|i| 1e-3 * f64::from(i)).collect();
        let count = std::f64::consts::TAU / 120_000.0;
        let of = |t: f64, value: fn(f64, f64, f64) -> f64| {
            [slow, quick].map(|(a, w)| value(a, w, w * t)).iter().sum::<f64>()
        };
        let position =
            time.iter().map(|t| (of(*t, |a, _, x| -a * x.cos()) / count).round() * count).collect();
        let noise = noise::tests::white(time.len(), 3);
        let torque = |t: f64| INERTIA_KG_M2 * of(t, |a, w, x| a * w * w * x.cos());
        let effort = time.iter().zip(noise).map(|(t, n)| torque(*t) + 0.005 * n).collect();
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        let rests = Some(vec![0.0; time.len()]);
        let log =
            DriveLog::made("log".into(), grid, effort, position, rests.clone(), rests, usable, INERTIA_KG_M2);
        let logs = [log];
        let mut balance = balance(&logs, &DrivePrior::default(), &DriveScales::new(&logs));
        let solved = balance.solve(&[], &[]);
        balance.refit_noise(&solved);
        let ratio = balance.rms(&balance.deviation) / balance.rms(&solved.residual);
        assert!((0.7..1.5).contains(&ratio), "{ratio}");
    }

    #[test]
    fn blows_of_a_coupling_pass_the_quick_filter() {
        // Bursts of 60 Hz, 2 mrad, in counts of 120 000 a turn.
        let (omega, count) = (std::f64::consts::TAU * 60.0, std::f64::consts::TAU / 120_000.0);
        let time: Vec<f64> = (0..4000).map(|i| 1e-3 * f64::from(i)).collect();
        let noise = noise::tests::white(4000, 7);
        let burst = |t: f64| if t % 1.0 < 0.5 { (omega * t).sin() } else { 0.0 };
        let angle = |(t, e): (&f64, &f64)| ((-2e-3 * burst(*t) / count) + 0.3 * e).round() * count;
        let position: Vec<f64> = time.iter().zip(&noise).map(angle).collect();
        let effort: Vec<f64> = time.iter().map(|t| 2.0 * burst(*t)).collect();
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        let friction = Some(vec![0.0; time.len()]);
        let log =
            DriveLog::made("log".into(), grid, effort, position, friction.clone(), friction, usable, 0.01);
        let [effort, acceleration] = &log.quick;
        let passed = |values: &[f64], whole: f64| rms(&values[20..480]) * 2f64.sqrt() / whole;
        let (of_effort, of_acceleration) = (passed(effort, 2.0), passed(acceleration, 2e-3 * omega * omega));
        assert!(
            of_effort > 0.7 && (of_effort / of_acceleration - 1.0).abs() < 0.1,
            "{of_effort} {of_acceleration}"
        );
        assert!(passed(&log.acceleration, 2e-3 * omega * omega) < 0.6);
    }

    #[test]
    fn near_the_ends_of_a_log_no_torque_is_known_to_rest() {
        const COUNT: usize = 1000;
        let torque: Vec<f64> = noise::tests::white(COUNT, 5).iter().map(|n| 2.0 + 0.1 * n).collect();
        let found = noise_at_rest(&torque, 0.1);
        let (begin, rest) = found.split_at(SMOOTHED_OVER);
        let (middle, end) = rest.split_at(COUNT - 2 * SMOOTHED_OVER);
        assert!(begin.iter().chain(end).all(|x| *x == 0.0) && (rms(middle) / 0.1 - 1.0).abs() < 0.2);
    }

    #[test]
    fn a_noisy_bridge_is_a_quiet_one_where_its_torque_rests() {
        // The torque rests in the first half and swings in the second.
        const COUNT: usize = 8000;
        const BRIDGE_NM: f64 = 0.1;
        let time: Vec<f64> = (0..COUNT).map(|i| 1e-3 * i as f64).collect();
        let [of_motor, of_bridge] = [3, 4].map(|seed| noise::tests::white(COUNT, seed));
        let torque: Vec<f64> =
            time.iter().map(|t| if *t < 4.0 { 2.0 } else { 2.0 + (9.0 * t).sin() }).collect();
        let effort = torque.iter().zip(&of_motor).map(|(t, n)| t + 0.003 * n).collect();
        let friction: Vec<f64> = torque.iter().zip(&of_bridge).map(|(t, n)| t + BRIDGE_NM * n).collect();
        let position = time.iter().map(|t| -12.0 * (0.5 * t).cos()).collect();
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        let load = Some(vec![80.0; COUNT]);
        let log = DriveLog::made("log".into(), grid, effort, position, Some(friction), load, usable, 0.02);
        let logs = [log];
        let mut balance = balance(&logs, &DrivePrior::default(), &DriveScales::new(&logs));
        let solved = balance.solve(&[], &[]);
        balance.refit_noise(&solved);
        let of = |range: std::ops::Range<usize>| rms(&balance.deviation[range]);
        let [rests, swings] = [of(500..3500), of(4500..6000)];
        let of_bridge = BRIDGE_NM * white_share(logs[0].width);
        // It is as large as what is left there, …
        for range in [500..3500, 4500..6000] {
            let ratio = rms(&balance.deviation[range.clone()]) / rms(&solved.residual[range]);
            assert!((0.7..1.5).contains(&ratio), "{ratio}");
        }
        // … and a share of it is left out where it rests: no more than what a mean over 32 samples' width is without.
        assert!(
            (0.3..0.7).contains(&(rests / of_bridge)) && (0.9..1.5).contains(&(swings / of_bridge)),
            "{rests} {swings} {of_bridge}"
        );
    }

    /// Evidence that a soft shaft gains where there is none, by what it takes off what the bridge shows beside this torque.
    fn gained_by_softening(torque: impl Fn(f64) -> f64, shown_beside: impl Fn(f64, f64) -> f64) -> f64 {
        const COUNT: usize = 8000;
        let time: Vec<f64> = (0..COUNT).map(|i| 1e-3 * i as f64).collect();
        let [of_motor, of_bridge] = [3, 4].map(|seed| noise::tests::white(COUNT, seed));
        let effort = time.iter().zip(&of_motor).map(|(t, n)| torque(*t) + 0.06 * (0.5 * t).cos() + 0.005 * n);
        let friction: Vec<f64> =
            time.iter().zip(&of_bridge).map(|(t, n)| torque(*t) + shown_beside(*t, *n)).collect();
        let position = time.iter().map(|t| -12.0 * (0.5 * t).cos()).collect();
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        let load = Some(vec![80.0; COUNT]);
        let log = DriveLog::made(
            "log".into(),
            grid,
            effort.collect(),
            position,
            Some(friction),
            load,
            usable,
            0.02,
        );
        // What a soft shaft would take off what swings: it does not lag behind what is slow.
        let friction = log.friction.clone().unwrap();
        let softened = gaussian(&friction, 5.0, 0);
        let less: Vec<f64> = friction.iter().zip(softened).map(|(f, soft)| f - soft).collect();
        let logs = [log];
        let balance = balance(&logs, &DrivePrior::default(), &DriveScales::new(&logs));
        let soft = Alternative {
            response: Some(logs[0].filtered(&less)),
            ..Alternative::columns("shaft_torsion", Vec::new(), Vec::new())
        };
        let [none, with] = [&[][..], &[&soft][..]].map(|forms| balance.solve_forms(forms).log_evidence);
        with - none
    }

    #[test]
    fn a_coupling_that_would_let_less_noise_of_the_bridge_through_is_no_better_for_it() {
        let turns = |t: f64| 2.0 * (6.0 * (0.5 * t).sin() / 0.2).tanh();
        let gained = gained_by_softening(turns, |_, noise| 0.05 * noise);
        assert!(gained < 1.0, "{gained}");
    }

    #[test]
    fn a_controller_that_gives_less_torque_the_faster_it_turns_is_no_bearing_that_drives() {
        // Speed wobbles by a third; the torque is what a proportional loop makes of it.
        let time: Vec<f64> = (0..4000).map(|i| 1e-3 * f64::from(i)).collect();
        let position: Vec<f64> = time.iter().map(|t| 6.0 * t - 0.1 * (20.0 * t).cos()).collect();
        let effort: Vec<f64> = time.iter().map(|t| 0.1 * (8.0 - 6.0 - 2.0 * (20.0 * t).sin())).collect();
        let grid = Grid::new(&time);
        let usable = grid.covered.clone();
        let log = DriveLog::made("log".into(), grid, effort, position, None, None, usable, 0.0);
        let scales = DriveScales::new(std::slice::from_ref(&log));
        let p = balance(&[log], &DrivePrior::default(), &scales).solve(&[], &[]).p;
        assert!(p[VISCOUS] >= 0.0, "{p:?}");
    }
}
