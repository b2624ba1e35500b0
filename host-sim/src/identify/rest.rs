//! What is left after the best hypothesis: how large, how far beyond noise, what it follows.

use super::balance::Balance;
use super::contact::channel::before_ringing;
use super::contact::noise::MODEL_FORM;
use super::contact::problem::{Fit, Problem};
use super::contact::search;
use super::filters::rms;
use super::judge::{ContactPart, DiscCause};

/// Blocks over which residuals are averaged, s: what is left is structured where it lasts, or where it swings as mains do.
const BLOCKS_S: [f64; 2] = [0.05, 0.005];
/// Deviations from named sources are known within this factor before anything is fitted to the residuals.
const NAMED_WITHIN: f64 = 1.5;
/// A rest is beyond the form of a model where it is this many times [`MODEL_FORM`] of the signal: what a wrong law leaves.
const BEYOND_FORM: f64 = 3.0;
/// The rest is most of what is unexplained where it is this share of what the smallest named cause changes.
const MOST: f64 = 0.5;
/// It is a trace where it is less than this share of the baseline's mean square: a fifth of its amplitude.
const LEAST_SHARE: f64 = 0.05;
/// Steepness of the steps over ln(ratio): a factor of 1.5 turns even odds into 25 to 1.
const STEEPNESS: f64 = 8.0;

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
    /// Mean square of the structured rest over that of the noise.
    pub times_noise: f64,
    /// What it goes along with: quantity and share of its variance.
    pub follows: Vec<(String, f64)>,
}

impl Rest {
    /// Probability that it is something that the library does not have: larger than the form of a model is wrong, as large
    /// as what a cause explains, not a trace of what the baseline leaves, and more than noise leaves.
    pub fn unknown(&self) -> f64 {
        let step = |ratio: f64| 1.0 / (1.0 + (-STEEPNESS * ratio.max(1e-9).ln()).exp());
        step(self.size / (BEYOND_FORM * MODEL_FORM))
            * step(self.size / (MOST * self.explained).max(1e-12))
            * step(self.share / LEAST_SHARE)
            * step(self.times_noise)
    }
}

/// Mean squares of means over blocks, less what noise leaves of them.
fn structured(residual: &[f64], noise: &[f64], rows: &[usize], block: usize) -> (f64, f64) {
    let (mut sum, mut left, mut count) = (0.0, 0.0, 0.0f64);
    for chunk in rows.chunks(block) {
        if chunk.len() * 2 < block {
            continue;
        }
        let n = chunk.len() as f64;
        let mean = chunk.iter().map(|i| residual[*i]).sum::<f64>() / n;
        sum += mean * mean;
        left += chunk.iter().map(|i| noise[*i].powi(2)).sum::<f64>() / (n * n);
        count += 1.0;
    }
    let count = count.max(1.0);
    ((sum / count - left / count).max(0.0), left / count)
}

/// Samples in the blocks, the longest first.
fn blocks(step_s: f64) -> [usize; 2] {
    BLOCKS_S.map(|s| (s / step_s).round().max(1.0) as usize)
}

/// What the rests of the contact's balance are measured with.
pub struct Ground {
    /// Deviations of the noise model, N m.
    deviation: Vec<f64>,
    /// White noise of the sensor alone, N m: what is left of it in a block is known.
    white: Vec<f64>,
    /// The most that makes a single sample uncertain, N m; empty where points of the grid are no samples.
    named: Vec<f64>,
    /// Samples that are well known.
    rows: Vec<usize>,
    /// Samples in the blocks.
    blocks: [usize; 2],
    /// RMS of the channel, N m.
    signal: f64,
}

impl Ground {
    /// Of a searched contact.
    pub fn new(contact: &ContactPart) -> Self {
        let problem = contact.problem();
        let limit = problem.well_known_nm();
        let deviation = problem.noise.deviation.clone();
        let used = &contact.ranked[0].fit.r;
        let dense = contact.logs.iter().all(|log| log.grid.is_dense());
        let step_s = contact.logs.first().map_or(1e-3, |log| log.grid.step_s);
        Self {
            rows: (0..deviation.len())
                .filter(|i| deviation[*i].max(problem.noise.named(*i)) < limit && used[*i] != 0.0)
                .collect(),
            // Points between samples share the samples' noise.
            white: contact
                .logs
                .iter()
                .flat_map(|log| vec![log.friction_noise_nm / log.grid.density.sqrt(); log.len()])
                .collect(),
            named: if dense {
                (0..deviation.len()).map(|i| NAMED_WITHIN * problem.noise.named(i)).collect()
            } else {
                Vec::new()
            },
            signal: rms(&problem.measured().collect::<Vec<_>>()).max(1e-12),
            blocks: blocks(step_s),
            deviation,
        }
    }

    fn in_units(&self, r: &[f64]) -> Vec<f64> {
        r.iter().zip(&self.deviation).map(|(r, s)| r * s).collect()
    }

    /// What is structured over long blocks, short ones or from sample to sample, whichever is most, with what noise leaves
    /// there.
    fn structured(&self, residual: &[f64]) -> (f64, f64) {
        let [long, short] = self.blocks.map(|block| structured(residual, &self.white, &self.rows, block));
        let each = (!self.named.is_empty()).then(|| structured(residual, &self.named, &self.rows, 1));
        [short].into_iter().chain(each).fold(long, |most, other| if other.0 > most.0 { other } else { most })
    }

    /// RMS of what a fit leaves beyond noise, over that of the signal.
    pub fn size(&self, problem: &Problem<'_>, fit: &Fit) -> f64 {
        self.structured(&self.left(problem, fit)).0.sqrt() / self.signal
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
    Ground::new(contact).rows.is_empty()
}

/// Of the contact's balance; `disc_cause` where the hypothesis has it.
pub fn of_contact(contact: &ContactPart, place: usize, disc_cause: Option<&DiscCause>) -> Rest {
    let problem = contact.problem();
    let none = contact.ranked.iter().find(|r| r.fit.terms.is_empty()).map(|r| &r.fit.r);
    let fit = contact.fit(place);
    let as_logged = disc_cause.map(|cause| {
        let over = cause.residual_nm.iter().zip(&problem.noise.deviation).zip(&fit.r);
        over.map(|((r, s), used)| if *used == 0.0 { 0.0 } else { r / s }).collect::<Vec<f64>>()
    });
    let mut explained = contact.sizes[place].clone();
    if let (Some(as_logged), Some(none)) = (&as_logged, none) {
        explained.push(search::difference(&problem, none, as_logged));
    }
    let ground = Ground::new(contact);
    let residual = ground.left(&problem, fit);
    if ground.rows.is_empty() {
        // What cannot be looked at is not explained.
        return Rest { size: 1.0, share: 1.0, ..Rest::default() };
    }
    let (rest, left) = ground.structured(&residual);
    let before = as_logged.as_ref().or(none).map_or(rest, |none| ground.structured(&ground.in_units(none)).0);
    Rest {
        size: rest.sqrt() / ground.signal,
        share: if before > 0.0 { (rest / before).min(1.0) } else { 0.0 },
        explained: explained.into_iter().reduce(f64::min).unwrap_or(0.0),
        times_noise: rest / left.max(1e-300),
        follows: follows(&residual, &ground.rows, ground.blocks[0], &contact_quantities(contact)),
    }
}

fn contact_quantities(contact: &ContactPart) -> Vec<(String, Vec<f64>)> {
    let gather = |of: &dyn Fn(&super::contact::log::ContactLog, usize) -> f64| -> Vec<f64> {
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
            out.push((name.clone(), share));
        }
    }
    out.sort_by(|a, b| b.1.total_cmp(&a.1));
    out.truncate(3);
    out
}

/// Of a linear balance. Its columns do not imitate each other as laws of friction do: what the whole set explains counts.
pub fn of_balance(balance: &Balance, residual: &[f64], none: Option<&[f64]>) -> Rest {
    let [block, _] = blocks(balance.row_step_s);
    let explained = none.map_or(0.0, |none| balance.difference(none, residual));
    let (rest, left) = structured(residual, &balance.first_deviation, &balance.used, block);
    let before = none.map_or(rest, |none| structured(none, &balance.first_deviation, &balance.used, block).0);
    let time: Vec<f64> = (0..residual.len()).map(|i| i as f64).collect();
    Rest {
        size: rest.sqrt() / balance.scale.max(1e-12),
        share: if before > 0.0 { (rest / before).min(1.0) } else { 0.0 },
        explained: explained / balance.scale.max(1e-12),
        times_noise: rest / left.max(1e-300),
        follows: follows(residual, &balance.used, block, &[("time".into(), time)]),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_noise_may_have_left_is_nothing_unknown() {
        let rest = |times_noise| Rest { size: 0.05, share: 0.3, times_noise, ..Rest::default() };
        assert!(rest(0.5).unknown() < 0.05, "{}", rest(0.5).unknown());
        assert!(rest(5.0).unknown() > 0.9, "{}", rest(5.0).unknown());
    }
}
