//! What is left after the best hypothesis: how large, how far beyond noise, what it follows.

use super::balance::Balance;
use super::bridge_noise::{self, Left};
use super::contact::change::Bridge;
use super::contact::channel::before_ringing;
use super::contact::log::ContactLog;
use super::contact::noise::MODEL_FORM;
use super::contact::problem::{Fit, PredictionErrors, Problem, Role};
use super::contact::search;
use super::contact_part::{ContactPart, DiscCause};
use super::effects;
use super::filters::rms;
use super::table::LOG_PRIOR;

/// Blocks over which residuals are averaged, s: what is left is structured where it lasts, or where it swings as mains do.
const BLOCKS_S: [f64; 2] = [0.05, 0.005];
/// Share of the blocks that is noise's tail, however large: the likelihood's has four degrees of freedom, and a transition that comes
/// a sample early or the blow of a tooth leaves a hundred deviations in a few samples. What is structured lasts.
const RARE: f64 = 0.01;
/// Deviations from named sources are known within this factor before anything is fitted to the residuals.
pub const NAMED_WITHIN: f64 = 1.5;
/// What a form is known to, [`MODEL_FORM`] of the signal or a share of a cause, so many times is beyond it, whatever its shape.
pub(super) const BEYOND_FORM: f64 = 3.0;
/// The rest is most of what is unexplained where it is this share of what the smallest named cause changes.
const MOST: f64 = 0.5;
/// In a linear balance a cause that changes the prediction by less than this share of what is left may be a part of that.
const LEFT_SHARE: f64 = 0.5;
/// It is a trace where it is less than this share of the baseline's mean square: a fifth of its amplitude.
const LEAST_SHARE: f64 = 0.05;
/// What is left follows it where a bridge picks it up.
pub(super) const MAINS: &str = "mains";
/// Steepness of the steps over ln(ratio): a factor of 1.5 turns even odds into 25 to 1.
const STEEPNESS: f64 = 8.0;

/// How many times the noise of named sources is what is left in these rows, as far as they are known within that.
pub fn over_named(named: &[f64], left: &[f64], rows: &[usize]) -> f64 {
    let squares = |of: &[f64]| rows.iter().map(|&i| of[i] * of[i]).sum::<f64>();
    (squares(left) / squares(named).max(f64::MIN_POSITIVE)).sqrt().clamp(NAMED_WITHIN.recip(), NAMED_WITHIN)
}

/// What is left of a balance.
#[derive(Debug, Clone, Default)]
pub struct Rest {
    /// RMS of the structured rest over that of the signal.
    pub size: f64,
    /// Mean square of the structured rest over the baseline's.
    pub share: f64,
    /// Change of the prediction by what is named here, RMS over that of the signal; 0 where nothing acts. In the contact
    /// that of the smallest cause.
    pub explained: f64,
    /// The same of what is named in another balance, where nothing acts here.
    pub elsewhere: f64,
    /// Mean square of the structured rest over that of the noise.
    pub times_noise: f64,
    /// Causes beyond the first in a set that is weighed as a whole, in a linear balance.
    pub further_causes: usize,
    /// What it goes along with: quantity and share of its variance.
    pub follows: Vec<(String, f64)>,
}

impl Rest {
    /// Probability that it is something that the library does not have: larger than the form of a model is wrong, as large
    /// as what a cause explains, not a trace of what the baseline leaves, and more than noise leaves. One thing unknown stands
    /// against causes each of which is improbable: several that together fit in part only are the less likely.
    pub fn unknown(&self) -> f64 {
        let step = |ratio: f64| 1.0 / (1.0 + (-STEEPNESS * ratio.max(1e-9).ln()).exp());
        let alone = step(self.size / (BEYOND_FORM * MODEL_FORM))
            * step(self.size / (MOST * self.explained.max(self.elsewhere)).max(1e-12))
            * step(self.share / LEAST_SHARE)
            * step(self.times_noise);
        let odds = alone * (-LOG_PRIOR * self.further_causes as f64).exp();
        odds / (1.0 - alone + odds)
    }
}

/// What a cause of a set does in a balance.
#[derive(Debug, Clone, Copy)]
pub struct Contribution {
    /// Change of the prediction when it is taken out and the others are fitted again, relative to the signal.
    pub size: f64,
    /// How clearly it stands out of what the whole set leaves: from 1 on it does. In the contact the amplitude of the structured
    /// rest that it explains over that which is left, in a linear balance its change of the prediction over half of that.
    pub over_rest: f64,
    /// What sizes like it are known to, relative to the signal: the form of a model, or the class of a bridge.
    pub known: f64,
}

impl Contribution {
    /// In the contact, from the size and the structured rests with and without it.
    fn new(size: f64, with: f64, without: f64, known: f64) -> Self {
        // Where nothing is structured without it either, its size alone is what is known of it.
        let over_rest = if without > 0.0 {
            (without * without - with * with).max(0.0).sqrt() / with
        } else {
            f64::INFINITY
        };
        Self { size, over_rest, known }
    }

    /// Whether it is larger than what sizes like it are known to.
    pub fn is_told(&self) -> bool {
        self.size > self.known
    }

    /// Its size over what could be the form of the model or the class of a bridge, or the form of a larger cause beside it that is
    /// wrong by `beside`. One that leaves more than it explains has the wrong shape, and is so much more likely a form; up to where
    /// nothing is. One that explains all that the larger cause leaves has a shape of its own, and is so much less likely that
    /// cause's form.
    pub fn over_form(&self, beside: f64) -> f64 {
        let leaves = self.over_rest.recip();
        let of_model = self.known * leaves.clamp(1.0, BEYOND_FORM);
        let of_other = beside * leaves.clamp(BEYOND_FORM.recip(), BEYOND_FORM);
        self.size / of_model.max(of_other)
    }
}

/// What a size is known to that a bridge makes too, whose zero has this deviation relative to what it usually shows.
fn beyond_class(class: f64) -> f64 {
    class.max(MODEL_FORM)
}

/// Noise of samples.
#[derive(Debug, Clone, Default)]
struct Noise {
    /// Deviation of what is new in each sample.
    white: Vec<f64>,
    /// Variance of what repeats itself in the next samples; empty where nothing does.
    repeated: Vec<f64>,
}

impl Noise {
    fn white(deviation: Vec<f64>) -> Self {
        Self { white: deviation, repeated: Vec::new() }
    }

    /// Variance of the mean of a block.
    fn of_mean(&self, block: &[usize]) -> f64 {
        let n = block.len() as f64;
        let white = block.iter().map(|i| self.white[*i].powi(2)).sum::<f64>() / n;
        let repeated = block.iter().filter_map(|i| self.repeated.get(*i)).sum::<f64>();
        (white + repeated) / n
    }
}

/// Mean squares of means over blocks, less what noise leaves of them, which has so much of the bridge's slow noise. What stands in
/// [`RARE`] of them alone does not count.
fn structured(residual: &[f64], noise: &Noise, rows: &[usize], block: usize, of_bridge: f64) -> (f64, f64) {
    beyond_noise(residual, noise, rows, block, of_bridge, RARE)
}

/// The same where what stands in this share of the blocks alone does not count.
fn beyond_noise(
    residual: &[f64],
    noise: &Noise,
    rows: &[usize],
    block: usize,
    of_bridge: f64,
    rare: f64,
) -> (f64, f64) {
    let (mut squares, mut left) = (Vec::with_capacity(rows.len() / block.max(1) + 1), 0.0);
    for chunk in rows.chunks(block) {
        if chunk.len() * 2 < block {
            continue;
        }
        let n = chunk.len() as f64;
        let mean = chunk.iter().map(|i| residual[*i]).sum::<f64>() / n;
        squares.push(mean * mean);
        left += noise.of_mean(chunk);
    }
    let left = left / (squares.len() as f64).max(1.0) + of_bridge;
    let lasting = squares.len() - (rare * squares.len() as f64) as usize;
    if lasting < squares.len() {
        squares.select_nth_unstable_by(lasting, f64::total_cmp);
        squares.truncate(lasting);
    }
    let usual = squares.iter().sum::<f64>() / (squares.len() as f64).max(1.0);
    ((usual - left).max(0.0), left)
}

/// The larger of two rests, each with what noise leaves where it is measured.
fn more(a: (f64, f64), b: (f64, f64)) -> (f64, f64) {
    if b.0 > a.0 { b } else { a }
}

/// Samples in the blocks, the longest first.
fn blocks(step_s: f64) -> [usize; 2] {
    BLOCKS_S.map(|s| (s / step_s).round().max(1.0) as usize)
}

/// What the rests of the contact's balance are measured with.
pub struct Ground {
    /// Deviations of the noise model, N m.
    deviation: Vec<f64>,
    /// White noise of the sensor, N m, and what else is named: what makes a sample uncertain near a transition does so for all of
    /// a block.
    noise: Noise,
    /// The most that makes a single sample uncertain, N m.
    of_sample: Noise,
    /// Samples that are well known.
    rows: Vec<usize>,
    /// Samples in the blocks.
    blocks: [usize; 2],
    /// Variance of a block's mean that slow noise of the friction bridge leaves, as far as the drive shows it too.
    of_bridge: [f64; 2],
    /// RMS of the channel, N m.
    signal: f64,
    /// Deviations of the zeros of friction bridge and normal bridge, relative to what they usually show.
    classes: [f64; 2],
}

impl Ground {
    /// Of a contact in which `best` is the best fit.
    pub fn new(problem: &Problem<'_>, best: &Fit) -> Self {
        let limit = problem.well_known_nm();
        let deviation = problem.noise.deviation.clone();
        let step_s = problem.logs.first().map_or(1e-3, |log| log.grid.step_s);
        let named = || (0..deviation.len()).map(|i| problem.noise.named(i));
        let of_log = |log: &ContactLog| vec![log.friction_noise_nm; log.len()];
        let white: Vec<f64> = problem.logs.iter().flat_map(of_log).collect();
        let signal = rms(&problem.measured().collect::<Vec<_>>()).max(1e-12);
        let loads = problem.logs.iter().flat_map(|log| log.load_n.iter().copied());
        let load_n = rms(&loads.collect::<Vec<_>>()).max(1e-12);
        let repeated = named().zip(&white).map(|(named, white)| (named * named - white * white).max(0.0));
        Self {
            rows: (0..deviation.len())
                .filter(|i| deviation[*i].max(problem.noise.named(*i)) < limit && best.r[*i] != 0.0)
                .collect(),
            of_sample: Noise::white(named().map(|named| NAMED_WITHIN * named).collect()),
            noise: Noise { repeated: repeated.collect(), white },
            signal,
            blocks: blocks(step_s),
            of_bridge: [0.0; 2],
            classes: [
                problem.baseline.deviation_of(Role::FrictionZero) / signal,
                problem.baseline.deviation_of(Role::NormalZero) / load_n,
            ],
            deviation,
        }
    }

    /// What another motion of the disc does to the baseline, fitted with that and as logged. A play tells in the moments after a
    /// reversal, of which few samples are well known: what it explains counts wherever it does.
    pub fn of_motion(&self, problem: &Problem<'_>, with: &Fit, as_logged: &Fit) -> Contribution {
        let [with_nm, as_logged_nm] = [with, as_logged].map(|fit| rms(&self.in_units(&fit.r)));
        let explained = (as_logged_nm.powi(2) - with_nm.powi(2)).max(0.0).sqrt() / self.signal;
        let size = search::difference(problem, &with.r, &as_logged.r).max(explained);
        Contribution::new(size, with_nm, as_logged_nm, MODEL_FORM)
    }

    fn in_units(&self, r: &[f64]) -> Vec<f64> {
        r.iter().zip(&self.deviation).map(|(r, s)| r * s).collect()
    }

    /// What is structured over long blocks, short ones or from sample to sample, whichever is most, with what noise leaves
    /// there.
    fn structured(&self, residual: &[f64]) -> (f64, f64) {
        self.beyond(&self.noise, residual)
    }

    /// What a prediction leaves beyond noise in single samples, however rare they are. What is rare is the tail of a cause's law, as
    /// the blows of a tooth are. Where nothing acts there is no law whose tail it could be.
    fn rare(&self, predicted: &PredictionErrors) -> (f64, f64) {
        let noise = Noise::white(predicted.named_nm.iter().map(|named| NAMED_WITHIN * named).collect());
        beyond_noise(&predicted.left_nm, &noise, &predicted.compared, 1, self.of_bridge[1], 0.0)
    }

    /// The same beyond this noise of blocks.
    fn beyond(&self, noise: &Noise, residual: &[f64]) -> (f64, f64) {
        let of = |noise: &Noise, block: usize, of_bridge| {
            structured(residual, noise, &self.rows, block, of_bridge)
        };
        let [long, short] = [0, 1].map(|at| of(noise, self.blocks[at], self.of_bridge[at]));
        let each = of(&self.of_sample, 1, self.of_bridge[1]);
        [short, each].into_iter().fold(long, more)
    }

    /// What each cause of a fit does, from the fits without it. What is named of a block stays in both rests: where a transition
    /// is uncertain a wrong shape shows all the same.
    pub fn contributions(&self, problem: &Problem<'_>, fit: &Fit, without: &[Fit]) -> Vec<Contribution> {
        let known = fit.terms.iter().map(|term| match problem.terms[*term].error_of {
            None => MODEL_FORM,
            Some(Bridge::Friction) => beyond_class(self.classes[0]),
            Some(Bridge::Normal) => beyond_class(self.classes[1]),
        });
        let white = Noise::white(self.noise.white.clone());
        let rest = |fit: &Fit| self.beyond(&white, &self.left(problem, fit)).0.sqrt();
        let with = rest(fit);
        let own = |(left, known): (&Fit, f64)| {
            Contribution::new(search::difference(problem, &fit.r, &left.r), with, rest(left), known)
        };
        without.iter().zip(known).map(own).collect()
    }

    /// What a fit leaves, N m; before the sensor's mode, where it rings: what strikes it between two samples is not known
    /// better than to a part of a period, and what then rings is no more than the same error once again.
    fn left(&self, problem: &Problem<'_>, fit: &Fit) -> Vec<f64> {
        let Some(mode) = problem.change(&fit.terms, &fit.p).mode else { return self.in_units(&fit.r) };
        let shown = problem.predict(&fit.terms, &fit.p).shown_nm;
        let mut from = 0;
        let each = problem.logs.iter().flat_map(|log| {
            let own = from..from + log.len();
            from = own.end;
            let residual: Vec<f64> = log.friction_nm.iter().zip(&shown[own]).map(|(y, x)| y - x).collect();
            before_ringing(&residual, mode, log.grid.step_s).unwrap_or(residual)
        });
        each.collect()
    }
}

/// Whether no sample of the channel is well known.
pub fn nothing_is_known(contact: &ContactPart) -> bool {
    Ground::new(&contact.problem(), &contact.ranked[0].fit).rows.is_empty()
}

/// What a set of the contact leaves.
pub struct LeftByContact<'c> {
    contact: &'c ContactPart,
    place: usize,
    ground: Ground,
    residual_nm: Vec<f64>,
}

impl<'c> LeftByContact<'c> {
    /// The set at this place.
    pub fn new(contact: &'c ContactPart, place: usize) -> Self {
        let problem = contact.problem();
        let ground = Ground::new(&problem, &contact.ranked[0].fit);
        let residual_nm = ground.left(&problem, contact.fit(place));
        Self { contact, place, ground, residual_nm }
    }

    /// Takes as noise what the drive leaves alike of the friction bridge's error, and returns the variance of a block's mean that
    /// it leaves in the drive.
    pub fn shared_with(&mut self, drive: &Balance, residual: &[f64]) -> f64 {
        let slides = self.contact.problem().slides(self.contact.fit(self.place));
        let white = rms(&self.ground.noise.white).powi(2);
        let left = [
            Left { residual: &self.residual_nm, rows: &self.ground.rows },
            Left { residual, rows: &drive.used },
        ];
        let shared = |block: usize, counts: &dyn Fn(usize) -> bool| {
            bridge_noise::variance_of_mean(left, &drive.starts, block, white, counts)
        };
        let blocks = self.ground.blocks;
        // Where the tip sticks its slip is observed from the force, the bridge's error and all.
        let of_drive = shared(blocks[0], &|i| slides[i]);
        self.ground.of_bridge = blocks.map(|block| shared(block, &|_| true));
        of_drive
    }

    /// How large it is where a cause that moves the disc is among these effects; without it the baseline has the motion as logged.
    pub fn rest(&self, effects: &[&'static str]) -> Rest {
        let Self { contact, place, ground, residual_nm } = self;
        let has = |cause: &&DiscCause| effects.contains(&cause.effect);
        let disc_cause = contact.disc_cause.as_ref().filter(has);
        let fit = contact.fit(*place);
        let without = contact.disc_cause.as_ref().filter(|cause| fit.terms.is_empty() && !has(cause));
        let residual_nm = without.map_or(residual_nm, |cause| &cause.residual_nm);
        let problem = contact.problem();
        let none = contact.ranked.iter().find(|r| r.fit.terms.is_empty()).map(|r| &r.fit.r);
        let as_logged = disc_cause.map(|cause| {
            let over = cause.residual_nm.iter().zip(&problem.noise.deviation).zip(&fit.r);
            over.map(|((r, s), used)| if *used == 0.0 { 0.0 } else { r / s }).collect::<Vec<f64>>()
        });
        let mut explained: Vec<f64> = contact.contributions[*place].iter().map(|own| own.size).collect();
        if let (Some(as_logged), Some(none)) = (&as_logged, none) {
            explained.push(search::difference(&problem, none, as_logged));
        }
        if ground.rows.is_empty() {
            // What cannot be looked at is not explained.
            return Rest { size: 1.0, share: 1.0, ..Rest::default() };
        }
        // What a fit leaves out, since held bristles tell little of a law, the model leaves all the same.
        let rare = effects.is_empty().then(|| match without {
            Some(cause) => ground.rare(&cause.errors_as_logged),
            None => ground.rare(&PredictionErrors::new(&problem, fit)),
        });
        let of = |residual_nm: &[f64]| rare.into_iter().fold(ground.structured(residual_nm), more);
        let (rest, left) = of(residual_nm);
        let before = as_logged.as_ref().or(none).map_or(rest, |none| of(&ground.in_units(none)).0);
        let mut follows = if rest > 0.0 {
            follows(residual_nm, &ground.rows, ground.blocks[0], &contact_quantities(contact))
        } else {
            // Of what noise leaves nothing can be said to follow.
            Vec::new()
        };
        // What the bridges pick up was taken off before anything was looked at.
        let picked_up = picked_up(&contact.logs) * ground.signal.powi(2);
        let [rest, before] = [rest, before].map(|square| square + picked_up);
        if picked_up > 0.0 {
            follows.insert(0, (MAINS.to_string(), picked_up / rest));
        }
        Rest {
            size: rest.sqrt() / ground.signal,
            share: if before > 0.0 { (rest / before).min(1.0) } else { 0.0 },
            explained: explained.into_iter().reduce(f64::min).unwrap_or(0.0),
            elsewhere: 0.0,
            times_noise: rest / left.max(1e-300),
            further_causes: 0,
            follows,
        }
    }
}

/// Mean square of what a bridge picks up from the mains over that of what it shows, of the bridge where that is larger; less than what
/// a model's form is known to is nothing.
fn picked_up(logs: &[ContactLog]) -> f64 {
    let of_bridge = |of: fn(&ContactLog) -> [&[f64]; 2]| {
        let (mut line, mut shown) = (0.0, 0.0);
        for [logged, clean] in logs.iter().map(of) {
            line += logged.iter().zip(clean).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
            shown += logged.iter().map(|x| x * x).sum::<f64>();
        }
        line / shown.max(f64::MIN_POSITIVE)
    };
    let friction = of_bridge(|log| [&log.logged_nm, &log.friction_nm]);
    let normal = of_bridge(|log| [&log.logged_n, &log.normal_n]);
    Some(friction.max(normal)).filter(|square| *square > MODEL_FORM * MODEL_FORM).unwrap_or(0.0)
}

fn contact_quantities(contact: &ContactPart) -> Vec<(String, Vec<f64>)> {
    let gather = |of: &dyn Fn(&ContactLog, usize) -> f64| -> Vec<f64> {
        contact
            .logs
            .iter()
            .flat_map(|log| (0..log.len()).map(move |i| (log, i)))
            .map(|(log, i)| of(log, i))
            .collect()
    };
    vec![
        ("time".into(), gather(&|log, i| log.grid.time_s[i])),
        ("normal force".into(), gather(&|log, i| log.load_n[i])),
        ("sliding speed".into(), gather(&|log, i| log.root_speed_m_s[i].abs().max(1e-6).ln())),
        ("direction".into(), gather(&|log, i| log.root_speed_m_s[i].signum())),
        ("disc angle".into(), gather(&|log, i| log.angle_rad[i].rem_euclid(std::f64::consts::TAU))),
        ("friction torque".into(), gather(&|log, i| log.smooth_nm[i])),
    ]
}

/// Share of the blocks' variance that lies between bins of a quantity, for those that hold most, less what chance gives.
fn follows(
    residual: &[f64],
    rows: &[usize],
    block: usize,
    quantities: &[(String, Vec<f64>)],
) -> Vec<(String, f64)> {
    const BINS: usize = 24;
    let mut out = Vec::new();
    for (name, values) in quantities {
        let mut points: Vec<(f64, f64)> = rows
            .chunks(block)
            .filter(|chunk| chunk.len() * 2 >= block)
            .map(|chunk| {
                let n = chunk.len() as f64;
                (values[chunk[chunk.len() / 2]], chunk.iter().map(|i| residual[*i]).sum::<f64>() / n)
            })
            .collect();
        if points.len() < 4 * BINS {
            continue;
        }
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mean = points.iter().map(|p| p.1).sum::<f64>() / points.len() as f64;
        let all: f64 = points.iter().map(|p| (p.1 - mean).powi(2)).sum();
        let between: f64 = points
            .chunks(points.len().div_ceil(BINS))
            .map(|bin| {
                let n = bin.len() as f64;
                n * (bin.iter().map(|p| p.1).sum::<f64>() / n - mean).powi(2)
            })
            .sum();
        let chance = BINS as f64 / points.len() as f64;
        let share = if all > 0.0 { (between / all - chance).max(0.0) } else { 0.0 };
        if share > 0.1 {
            // Without its unit.
            out.push((name.split(", ").next().unwrap_or(name).to_string(), share));
        }
    }
    out.sort_by(|a, b| b.1.total_cmp(&a.1));
    out.truncate(3);
    out
}

/// What an alternative does in a linear balance: its size, relative to the efforts that it balances, from the residuals with
/// and without it. Its columns do not take each other's shape as laws of friction do; that it is no small part of what is
/// left is enough.
pub fn contribution(balance: &Balance, effect: &str, residual: &[f64], without: &[f64]) -> Contribution {
    let [block, _] = blocks(balance.row_step_s);
    let noise = Noise::white(balance.first_deviation.clone());
    let left = structured(residual, &noise, &balance.used, block, 0.0).0.sqrt();
    let change = balance.difference(residual, without);
    let scale = balance.scale.max(1e-12);
    let of_bridge = effects::with_id(effect).is_some_and(|effect| effect.is_like_a_bridges_error());
    Contribution {
        size: change / scale,
        over_rest: change / (LEFT_SHARE * left),
        known: if of_bridge { beyond_class(balance.bridge_zero / scale) } else { MODEL_FORM },
    }
}

/// Of a linear balance with so many causes, of whose block means slow noise of the friction bridge makes this variance. Its columns
/// do not imitate each other as laws of friction do: what the whole set explains counts.
pub fn of_balance(
    balance: &Balance,
    residual: &[f64],
    none: Option<&[f64]>,
    causes: usize,
    of_bridge: f64,
    coordinates: &[(String, Vec<f64>)],
) -> Rest {
    let [block, _] = blocks(balance.row_step_s);
    let explained = none.map_or(0.0, |none| balance.difference(none, residual));
    let noise = Noise::white(balance.first_deviation.clone());
    let of_row =
        Noise::white(balance.first_deviation.iter().map(|deviation| NAMED_WITHIN * deviation).collect());
    // A row is a filter wide: what swings faster than a block lasts is structured from row to row.
    let of = |residual: &[f64]| {
        let lasting = structured(residual, &noise, &balance.used, block, of_bridge);
        // What is rare is the tail of a cause's law; where nothing acts there is none.
        let rare = if causes > 0 { RARE } else { 0.0 };
        let each = beyond_noise(residual, &of_row, &balance.used, 1, of_bridge, rare);
        more(lasting, each)
    };
    let (rest, left) = of(residual);
    let before = none.map_or(rest, |none| of(none).0);
    Rest {
        size: rest.sqrt() / balance.scale.max(1e-12),
        share: if before > 0.0 { (rest / before).min(1.0) } else { 0.0 },
        explained: explained / balance.scale.max(1e-12),
        elsewhere: 0.0,
        times_noise: rest / left.max(1e-300),
        further_causes: causes.saturating_sub(1),
        follows: follows(residual, &balance.used, block, coordinates),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::log::Log;
    use crate::files::rig_file::RigFile;
    use crate::files::signal::Signal;
    use crate::identify::balance::tests::white_log;

    const ROWS: usize = 2000;

    /// A balance without a base whose response is everywhere the same, of efforts of this size.
    fn balance(response: f64, scale: f64) -> Balance {
        Balance::new(vec![response; ROWS], Vec::new(), &[white_log(ROWS, 0.01)], scale)
    }

    #[test]
    fn what_repeats_itself_stays_in_a_mean_and_what_is_new_does_not() {
        let rows: Vec<usize> = (0..100).collect();
        let mut noise = Noise { white: vec![0.3; 100], repeated: vec![0.04; 100] };
        let residual = vec![0.5; 100];
        let (rest, left) = structured(&residual, &noise, &rows, 50, 0.0);
        assert!((left - (0.09 / 50.0 + 0.04)).abs() < 1e-12 && (rest - (0.25 - left)).abs() < 1e-12);
        noise.repeated.clear();
        let (rest, left) = structured(&residual, &noise, &rows, 50, 0.1);
        assert!((left - (0.09 / 50.0 + 0.1)).abs() < 1e-12 && (rest - (0.25 - left)).abs() < 1e-12);
    }

    #[test]
    fn a_few_blows_are_a_rest_of_the_contact_where_nothing_acts() {
        const LONG: usize = 10 * ROWS;
        let ground = Ground {
            deviation: vec![0.1; LONG],
            noise: Noise::white(vec![0.1; LONG]),
            of_sample: Noise::white(vec![0.1 * NAMED_WITHIN; LONG]),
            // The fit leaves out where they are: it takes that for noise, or bristles are held there and tell no law.
            rows: (200..LONG).collect(),
            blocks: blocks(1e-3),
            of_bridge: [0.0; 2],
            signal: 1.0,
            classes: [0.01; 2],
        };
        // Twenty within a tenth of a second.
        let residual = |size: f64| -> Vec<f64> {
            let blow = |i: usize| if i < 100 && i.is_multiple_of(5) { size } else { 0.1 };
            (0..LONG).map(|i| blow(i) * if i % 2 == 0 { 1.0 } else { -1.0 }).collect()
        };
        let of = |residual: &[f64]| {
            let (named_nm, compared) = (vec![0.1; LONG], (0..LONG).collect());
            let errors = PredictionErrors { left_nm: residual.to_vec(), named_nm, compared };
            [ground.structured(residual).0, ground.rare(&errors).0]
        };
        let [lasting, rare] = of(&residual(30.0));
        assert!(lasting < 1e-9 && rare > 0.5, "{lasting} {rare}");
        // What is a few times as large as noise, and as rare, is its tail.
        assert_eq!(of(&residual(0.5)), [0.0; 2]);
    }

    #[test]
    fn a_few_blows_are_not_structured_and_what_lasts_is() {
        let rows: Vec<usize> = (0..ROWS).collect();
        let noise = Noise::white(vec![0.1; ROWS]);
        let residual = |blows: usize| -> Vec<f64> {
            let blow = |i: usize| if i.is_multiple_of(ROWS / blows) { 30.0 } else { 0.1 };
            (0..ROWS).map(|i| blow(i) * if i % 2 == 0 { 1.0 } else { -1.0 }).collect()
        };
        let rest = |blows: usize| structured(&residual(blows), &noise, &rows, 1, 0.0).0;
        assert!(rest(10) < 1e-9, "{}", rest(10));
        // A fiftieth of the time lasts.
        assert!(rest(40) > 5.0, "{}", rest(40));
    }

    #[test]
    fn what_a_bridge_picks_up_is_left_where_it_is_more_than_a_form() {
        let of = |hum_nm: f64| {
            let series = |of: &dyn Fn(f64) -> f64| (0..8000).map(|i| of(1e-3 * f64::from(i))).collect();
            let mut log = Log::default();
            log.set_signal(Signal::Time, series(&|t| t));
            log.set_signal(Signal::M2Speed, series(&|_| 5.0));
            log.set_signal(Signal::NormalForce, series(&|_| 60.0));
            let hum = |t: f64| 2.0 + hum_nm * (std::f64::consts::TAU * 50.0 * t).sin();
            log.set_signal(Signal::FrictionTorque, series(&hum));
            picked_up(&[ContactLog::new(&log, &RigFile::assumed_rig(&[]).unwrap()).unwrap()])
        };
        assert_eq!(of(0.01), 0.0);
        // A tenth of the torque, whose effective value is 1/√2 of that.
        assert!((of(0.2).sqrt() - 0.1 / 2f64.sqrt()).abs() < 0.002, "{}", of(0.2));
    }

    #[test]
    fn a_few_blows_are_the_tail_of_a_law_where_there_is_one() {
        // Three of four hundred blocks have a row of four hundred times the noise.
        const LONG: usize = 10 * ROWS;
        let balance = Balance::new(vec![0.0; LONG], Vec::new(), &[white_log(LONG, 0.01)], 1.0);
        let blows: Vec<f64> = (0..LONG).map(|i| if i % 6000 == 5000 { 4.0 } else { 0.0 }).collect();
        let rest = |causes: usize| {
            let none = (causes > 0).then(|| vec![0.3; LONG]);
            of_balance(&balance, &blows, none.as_deref(), causes, 0.0, &[])
        };
        assert_eq!(rest(1).size, 0.0);
        // 4 √(3/20 000), less the noise as far as it is known.
        assert!((rest(0).size - 0.049).abs() < 0.005, "{}", rest(0).size);
        assert!(rest(0).unknown() > 0.99 && rest(1).unknown() < 0.01);
    }

    #[test]
    fn a_swing_that_a_block_averages_is_a_rest_of_a_linear_balance() {
        // 20 Hz, whose period is a block's 50 ms; a cause explains a part of something slower.
        const SWING: f64 = 0.05;
        let balance = balance(0.0, 1.0);
        let step_s = balance.row_step_s;
        let swing: Vec<f64> =
            (0..ROWS).map(|i| SWING * (std::f64::consts::TAU * 20.0 * step_s * i as f64).sin()).collect();
        let without: Vec<f64> = swing.iter().map(|r| r + 0.02).collect();
        let rest = of_balance(&balance, &swing, Some(&without), 1, 0.0, &[]);
        assert!((rest.size - SWING / 2f64.sqrt()).abs() < 0.005, "{}", rest.size);
        assert!(rest.unknown() > 0.9, "{}", rest.unknown());
    }

    #[test]
    fn what_a_cause_explains_is_weighed_against_what_it_leaves() {
        let over = |with, without| Contribution::new(0.02, with, without, MODEL_FORM).over_rest;
        assert!((over(3.0, 5.0) - 4.0 / 3.0).abs() < 1e-12);
        // It leaves more than was left without it.
        assert_eq!(over(5.0, 3.0), 0.0);
        // Nothing is left; nothing was left without it.
        assert_eq!([over(0.0, 5.0), over(0.0, 0.0)], [f64::INFINITY; 2]);
    }

    #[test]
    fn a_cause_is_as_large_as_it_is_to_the_torques_of_whose_difference_it_is_a_part() {
        // The difference of two torques of 4 N m, which is nothing but an offset of 0.01 N m.
        let balance = balance(0.01, 4.0);
        let size = contribution(&balance, "", &[0.0; ROWS], &[0.01; ROWS]).size;
        assert!((size - 0.0025).abs() < 1e-12 && size < MODEL_FORM, "{size}");
    }

    #[test]
    fn an_error_of_a_bridge_is_told_where_it_is_beyond_its_class() {
        // Torques of 2 N m beside a bridge of 8 N m whose zero is known to 0.016.
        let balance = balance(0.0, 2.0).with_sensors(0, 0.016);
        let told = |effect: &str, size_nm: f64| {
            contribution(&balance, effect, &[0.0; ROWS], &[size_nm; ROWS]).is_told()
        };
        assert_eq!([0.012, 0.020].map(|size_nm| told("bridge_drift", size_nm)), [false, true]);
        // What has another shape is known as well as a model is.
        assert_eq!([0.006, 0.012].map(|size_nm| told("m2_ripple", size_nm)), [false, true]);
    }

    #[test]
    fn what_is_left_where_nothing_acts_is_weighed_against_what_is_explained_elsewhere() {
        let rest =
            |elsewhere| Rest { size: 0.03, share: 1.0, times_noise: 9.0, elsewhere, ..Rest::default() };
        assert!(rest(0.0).unknown() > 0.99 && rest(0.02).unknown() > 0.99);
        assert!(rest(0.15).unknown() < 0.01, "{}", rest(0.15).unknown());
    }

    #[test]
    fn what_noise_may_have_left_is_nothing_unknown() {
        let rest = |times_noise| Rest { size: 0.05, share: 0.3, times_noise, ..Rest::default() };
        assert!(rest(0.5).unknown() < 0.05, "{}", rest(0.5).unknown());
        assert!(rest(5.0).unknown() > 0.9, "{}", rest(5.0).unknown());
    }

    #[test]
    fn causes_that_explain_together_what_one_would_are_the_less_likely() {
        let rest = |further_causes| Rest {
            size: 0.02,
            share: 0.12,
            explained: 0.055,
            times_noise: 3000.0,
            further_causes,
            ..Rest::default()
        };
        assert!(rest(0).unknown() < 0.1, "{}", rest(0).unknown());
        assert!(rest(2).unknown() > 0.9, "{}", rest(2).unknown());
        assert!(Rest { size: 0.004, share: 0.005, ..rest(2) }.unknown() < 0.01);
        // Each costs its prior.
        let odds = |further| rest(further).unknown() / (1.0 - rest(further).unknown());
        assert!((odds(1) / odds(0) * LOG_PRIOR.exp() - 1.0).abs() < 1e-9);
    }
}
