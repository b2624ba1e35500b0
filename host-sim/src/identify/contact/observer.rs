//! The slip, observed from the measured force, and the force that the law makes of it.
//!
//! The friction force F is measured, so what is in series with the slip need not be simulated:
//!
//! u̇ = (F − k u − Σ k_b e_b)/c,  ė_b = u̇ − e_b/τ_b,  w = V − u̇
//!
//! solved exactly for a force that goes in straight lines between samples. Where the tip slips the law is evaluated at
//! the observed slip, F = sgn(w) (F_N g(|w|) e^m + F_N a2 |w| + film); where it sticks F = k u + c V + branches, u integrated from
//! the motion with a weak pull to the measurement, held below breakaway: as much as the way moved is uncertain, the disc is
//! reckoned and not seen, and the bridge wanders. The two are blended smoothly, since a switch makes the likelihood rough: s is a
//! product of sigmoids in the slip speed, in its ratio to the root's speed and in the force's size and sign. Bristles without a
//! block need none of this (`bristles.rs`); a brush slips on where this sees none (`reset.rs`).
//!
//! Nothing is integrated in open loop, so nothing loses phase through stick-slip.
//!
//! The measured force stands on both sides. Its noise n moves the slip by −n∗h/c and the law by γ n∗h, γ = −F_N g′/c, so that a
//! right law leaves n − γ n∗h: the less, the nearer γ is to one, whatever the force really does. The residual is therefore
//! taken over the deviation of that ([`Observed::own_noise`]), or damping would be drawn towards F_N |g′|.
//! Left out: what the force did between samples; slip that begins and ends within one.

use super::law::Contact;
use super::problem::DRIFT;
use super::reset::Loose;
use super::smoothing::{OBSERVED_OVER, widths};
use crate::identify::filters::{gaussian, shifted, smoothed_flat};
use nalgebra::{DMatrix, SMatrix, SVector};

/// Slip is faster than so many deviations of its noise.
pub const SLIP_NOISES: f64 = 4.0;
/// Width of the sigmoids, relative to their threshold.
pub(super) const WIDTH: f64 = 0.05;
/// Slip is more than this share of the root's speed: below it the block follows the root.
pub(super) const LEAST_SHARE: f64 = 0.5;
/// In slip the force is more than this share of F_N g(∞).
const LEAST_FORCE: f64 = 0.3;
/// Softness of the limit at breakaway, relative.
const LIMIT_WIDTH: f64 = 1e-3;
/// A share of the blend that is less is none: a millionth of the force is a thousandth of any noise.
const NEGLIGIBLE: f64 = 1e-6;
/// What a second adds to the variance of what is held, in that of the force's noise: 1/f noise half as large as the white noise has
/// a twentieth of its variance in each of five decades, and renews those of them that are shorter.
const WANDER: f64 = 0.1;
/// A contact carries nothing below this share of the log's largest load.
const LEAST_LOAD: f64 = 2e-3;

/// What the pass is driven with, for one log.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// Step, s.
    pub step_s: f64,
    /// Way of the root, m.
    pub root_m: &'a [f64],
    /// Normal force, N.
    pub load_n: &'a [f64],
    /// Measured friction force with the sensor taken off, N.
    pub force_n: &'a [f64],
    /// Where the channel is at an end of its range: the force is at least (1) or at most (−1) what is measured; else 0.
    pub ends: Option<&'a [i8]>,
    /// Factor of the friction coefficient, where something changes it.
    pub factor: Option<&'a [f64]>,
    /// Slip speed that counts as slip, m/s.
    pub slip_threshold_m_s: f64,
    /// How late the channel is that the force was seen by, samples: its noise is interpolated on the way there and back.
    pub late: f64,
    /// How widely the force is smoothed at each sample: places in [`widths`]; nothing where it is the least everywhere.
    pub smoothed: &'a [u8],
    /// Noise of the root's speed, m/s, and of the force, N: what is held when a slip ends, and a slow slip, are known to that.
    pub noise: (f64, f64),
    /// What the root's speed is uncertain by beyond the encoder's noise, m/s.
    pub unsure_m_s: f64,
}

impl Drive<'_> {
    /// Whether the channel is at an end of its range.
    #[inline]
    pub(super) fn at_end(&self, i: usize) -> bool {
        self.ends.is_some_and(|ends| ends[i] != 0)
    }

    /// How widely the force is smoothed at a sample.
    #[inline]
    fn smoothed_at(&self, i: usize) -> usize {
        self.smoothed.get(i).map_or(0, |place| usize::from(*place))
    }

    /// What the measurement says that the law does not, N: nothing of a force beyond the end that the channel is at.
    #[inline]
    pub(super) fn innovation_n(&self, i: usize, by_law_n: f64) -> f64 {
        let more = self.force_n[i] - by_law_n;
        let beyond = self.ends.is_some_and(|ends| f64::from(ends[i]) * more < 0.0);
        if beyond { 0.0 } else { more }
    }
}

/// What came out, sample by sample.
#[derive(Debug, Clone, Default)]
pub struct Observed {
    /// Friction force by the law, N.
    pub force_n: Vec<f64>,
    /// Slip speed, m/s.
    pub slip_m_s: Vec<f64>,
    /// Share of slip in the blend, 0 to 1.
    pub sliding: Vec<f64>,
    /// Deviation of the channel's noise over that of what the prediction leaves, 0 to 1: where bristles are held, the noise
    /// of the root's way comes through their stiffness, and what that leaves nothing to see of has no weight there. 1 with a
    /// block, which is some hundred times softer. The likelihood takes it by the numbers that its noise model is of.
    pub certainty: Vec<f64>,
    /// Share of the variance of the channel's noise that a right law leaves, since it stands in the prediction too.
    pub own_noise: Vec<f64>,
}

impl Observed {
    /// Nothing yet, for so many samples.
    pub fn new(samples: usize) -> Self {
        let zeros = vec![0.0; samples];
        Self {
            force_n: zeros.clone(),
            slip_m_s: zeros.clone(),
            sliding: zeros,
            certainty: vec![1.0; samples],
            own_noise: vec![1.0; samples],
        }
    }
}

/// Below this load a contact carries nothing, N.
pub(super) fn least_load_n(drive: &Drive<'_>) -> f64 {
    LEAST_LOAD * drive.load_n.iter().copied().fold(0.0, f64::max)
}

/// Beyond this a sigmoid is 0 or 1: to 3e-7, less than [`NEGLIGIBLE`].
const SATURATED: f64 = 15.0;

#[inline]
pub(super) fn sigmoid(x: f64) -> f64 {
    if x > SATURATED {
        1.0
    } else if x < -SATURATED {
        0.0
    } else {
        1.0 / (1.0 + (-x).exp())
    }
}

/// The block as an exact recursion over a step, the force between samples the cubic through its neighbours (Catmull and
/// Rom 1974): a straight line is wrong by (ωh)²/8, 7 % of what rings at 120 Hz between samples of a millisecond.
/// States (u, e_b).
struct Block {
    /// Next = transition·state + Σ by_force[j]·F[i − 2 + j]; without branches only the first entries are used.
    transition: SMatrix<f64, 4, 4>,
    by_force: [SVector<f64, 4>; 4],
    branched: bool,
}

/// States of the block at each sample.
struct Ways {
    /// u, m.
    block_m: Vec<f64>,
    /// e_b, m; nothing without branches.
    branches_m: Vec<[f64; 3]>,
}

impl Ways {
    #[inline]
    fn branches_m(&self, i: usize) -> [f64; 3] {
        if self.branches_m.is_empty() { [0.0; 3] } else { self.branches_m[i] }
    }
}

/// Derivatives of the cubic at the step's begin, in steps: rows for orders 0 to 3 over the forces i − 2 to i + 1.
const CUBIC: [[f64; 4]; 4] =
    [[0.0, 1.0, 0.0, 0.0], [-0.5, 0.0, 0.5, 0.0], [2.0, -5.0, 4.0, -1.0], [-3.0, 9.0, -9.0, 3.0]];

impl Block {
    fn new(contact: &Contact, step_s: f64) -> Self {
        let k = contact.stiffness_n_per_m;
        // A spring without damping follows the force at once; a time constant of 1e-3 of a step says the same.
        let c = contact.damping_n_s_per_m.max(1e-3 * step_s * k);
        let kb = contact.branches.map(|b| b.0);
        let branched = kb.iter().any(|k| *k > 0.0);
        // Van Loan: the exponential of the system over a step, beside the force and its derivatives.
        let count = if branched { 4 } else { 1 };
        let mut a = DMatrix::<f64>::zeros(count + 4, count + 4);
        for row in 0..count {
            a[(row, 0)] = -k / c * step_s;
            for b in 1..count {
                a[(row, b)] = -kb[b - 1] / c * step_s;
            }
            a[(row, count)] = step_s / c;
        }
        for b in 1..count {
            a[(b, b)] -= step_s / contact.branches[b - 1].1.max(1e-6);
        }
        for order in 0..3 {
            a[(count + order, count + order + 1)] = 1.0;
        }
        let e = a.exp();
        let within =
            |row: usize, column: usize| if row < count && column < count { e[(row, column)] } else { 0.0 };
        Self {
            transition: SMatrix::from_fn(within),
            by_force: std::array::from_fn(|j| {
                SVector::from_fn(|row, _| {
                    let of_order = |order: usize| e[(row, count + order)] * CUBIC[order][j];
                    if row < count { (0..4).map(of_order).sum() } else { 0.0 }
                })
            }),
            branched,
        }
    }

    /// From a way of the block under this force; the branches begin relaxed.
    fn ways(&self, from_m: f64, force_n: &[f64]) -> Ways {
        let n = force_n.len();
        // Over the step that ends at sample i.
        let forces =
            |i: usize| [force_n[i.max(2) - 2], force_n[i - 1], force_n[i], force_n[(i + 1).min(n - 1)]];
        let mut ways = Ways { block_m: Vec::with_capacity(n), branches_m: Vec::new() };
        ways.block_m.push(from_m);
        if self.branched {
            let mut state = SVector::<f64, 4>::new(from_m, 0.0, 0.0, 0.0);
            ways.branches_m.push([0.0; 3]);
            for i in 1..n {
                let mut next = self.transition * state;
                for (by, force) in self.by_force.iter().zip(forces(i)) {
                    next += by * force;
                }
                state = next;
                ways.block_m.push(state[0]);
                ways.branches_m.push([state[1], state[2], state[3]]);
            }
        } else {
            let (kept, by) = (self.transition[(0, 0)], self.by_force.map(|by| by[0]));
            let mut block_m = from_m;
            for i in 1..n {
                let [f0, f1, f2, f3] = forces(i);
                block_m = kept * block_m + ((by[0] * f0 + by[1] * f1) + (by[2] * f2 + by[3] * f3));
                ways.block_m.push(block_m);
            }
        }
        ways
    }
}

/// What the channel's noise does to the slip: the block's rate times its damping, behind the smoothing, for a unit of noise in
/// one sample.
struct OwnNoise {
    /// The response to the sample's own noise.
    own: f64,
    /// Sum of its squares over all samples.
    squares: f64,
}

impl OwnNoise {
    /// Of a force that is smoothed further over so many samples.
    fn new(block: &Block, contact: &Contact, step_s: f64, late: f64, further: f64) -> Self {
        // A block that follows within 50 samples has come to rest behind the impulse, and what smooths it.
        const SAMPLES: usize = 512;
        const AT: usize = SAMPLES / 4;
        let mut impulse = vec![0.0; SAMPLES];
        impulse[AT] = 1.0;
        let smooth = gaussian(&smoothed_flat(&impulse, OBSERVED_OVER), further, 0);
        let force = shifted(&smooth, late);
        let block_m = block.ways(0.0, &force).block_m;
        let rate = |i: usize| contact.damping_n_s_per_m * (block_m[i + 1] - block_m[i - 1]) / (2.0 * step_s);
        let rates: Vec<f64> = (1..SAMPLES - 1).map(rate).collect();
        let shown = shifted(&rates, -late);
        Self { own: shown[AT - 1], squares: shown.iter().map(|x| x * x).sum() }
    }

    /// Variance of n − γ n∗h over that of n.
    fn left(&self, gamma: f64) -> f64 {
        1.0 - 2.0 * gamma * self.own + gamma * gamma * self.squares
    }
}

/// Kalman gain of a random walk to which each step adds so much variance, in that of what it is seen with; it is also the
/// variance that is left.
fn steady_gain(added: f64) -> f64 {
    if added > 1e6 { 1.0 } else { 0.5 * ((added * (added + 4.0)).sqrt() - added) }
}

/// The force's noise passes to the slip through a block's stiffness and damping: n/c, or n/(k h) where there is no damper.
pub fn slip_noise_m_s(noise_n: f64, (stiffness, damping): (f64, f64), step_s: f64) -> f64 {
    noise_n / damping.max(stiffness * step_s)
}

/// Runs over a log.
pub fn observe(contact: &Contact, drive: &Drive<'_>) -> Observed {
    let n = drive.root_m.len();
    let dt = drive.step_s;
    let mut out = Observed::new(n);
    if n < 3 {
        return out;
    }
    if contact.bristles_alone {
        return super::bristles::follow(contact, drive);
    }
    let block = Block::new(contact, dt);
    let (k, c) = (contact.stiffness_n_per_m, contact.damping_n_s_per_m);
    // While the tip sticks the bristles take their share of the root's way.
    let share = 1.0 / (1.0 + k / contact.bristles_n_per_m);
    let force = drive.force_n;
    let ways = block.ways(force[0] / k, force);

    let coulomb = contact.curve.at_speed();
    let least_load = least_load_n(drive);
    let slip_noise = slip_noise_m_s(drive.noise.1, (k, c), dt);
    let thresholds: Vec<f64> =
        widths().map(|(_, kept)| drive.slip_threshold_m_s.max(SLIP_NOISES * kept * slip_noise)).collect();
    let creep_noises: Vec<f64> = widths().map(|(_, kept)| drive.noise.0.hypot(kept * slip_noise)).collect();
    // Variances of k times the block's way over that of the force's noise: what a step adds, what is left at rest.
    let force_noise_n = drive.noise.1.max(1e-12);
    let added = (k * drive.noise.0 * dt / force_noise_n).powi(2);
    let at_rest = steady_gain(added);
    let per_way = (k * DRIFT / force_noise_n).powi(2);
    let wanders = WANDER * dt;
    let unsure = (k * drive.unsure_m_s * dt / force_noise_n).powi(2) + wanders;
    let added_by = |way: f64| per_way * way * way + unsure;
    // Of a force beyond the end of the range it is known that it is friction, until the block has forgotten it.
    let forgets = block.transition[(0, 0)].powi(2);
    let mut lost = f64::from(u8::from(drive.at_end(0)));
    let noises_of_load = coulomb / force_noise_n;
    let seen_by = |lost: f64, load: f64| at_rest + lost * (load * noises_of_load).powi(2);
    let mut variance = seen_by(lost, drive.load_n[0]);
    let branch = contact.branches.map(|(_, time_s)| 1.0 / (1.0 + dt / time_s.max(1e-6)));
    let (mut held_m, mut held_branches_m) = (ways.block_m[0], ways.branches_m(0));
    let mut age = contact.ageing.map_or(0.0, |a| a.first_age_s);
    let (per_load, film) = contact.viscous;
    let per_damping = c.recip();
    let most = drive.smoothed.iter().copied().max().map_or(0, usize::from);
    let own_noise: Option<Vec<OwnNoise>> = (c > 0.0).then(|| {
        let of_width = |(further, _)| OwnNoise::new(&block, contact, dt, drive.late, further);
        widths().take(most + 1).map(of_width).collect()
    });
    let motion = Motion { root_m: drive.root_m, block_m: &ways.block_m, rate: 1.0 / dt };
    motion.slip_speeds(&mut out.slip_m_s);
    slides(&motion, drive, coulomb, &thresholds, &mut out);
    out.force_n[0] = force[0];
    let mut loose = contact.slips_on.then(|| Loose::new(drive, slip_noise));
    for i in 1..n {
        let w = out.slip_m_s[i];
        let speed = w.abs();
        let load = drive.load_n[i];
        if load <= least_load {
            (held_m, held_branches_m) = (ways.block_m[i], ways.branches_m(i));
            out.sliding[i] = 1.0;
            loose.iter_mut().for_each(|loose| loose.share = 0.0);
            continue;
        }
        let mut loaded = drive.factor.map_or(load, |factor| load * factor[i]);
        if let Some(ageing) = contact.ageing {
            loaded *= ageing.factor(age);
        }
        let slips = out.sliding[i];
        let place = drive.smoothed_at(i);
        if drive.ends.is_some() {
            lost = if drive.at_end(i) { 1.0 } else { lost * forgets };
        }
        let observed_variance = seen_by(lost, load);
        let sliding = if slips > NEGLIGIBLE {
            let (coefficient, derivative) = contact.curve.at_with_derivative(speed);
            let viscous = per_load * load + film;
            if let Some(own) = &own_noise {
                out.own_noise[i] +=
                    slips * (own[place].left(-(loaded * derivative + viscous) * per_damping) - 1.0);
            }
            1f64.copysign(w) * (loaded * coefficient + viscous * speed)
        } else {
            0.0
        };
        if slips < 1.0 - NEGLIGIBLE {
            let (way, v) = (motion.way_m(i), motion.root_m_s(i));
            let moved = share * way;
            let mut sticking = k * (held_m + moved) + c * share * v;
            for b in 0..3 {
                sticking += contact.branches[b].0 * (held_branches_m[b] + moved) * branch[b];
            }
            let (towards, coefficient) = if let Some(loose) = &mut loose {
                (loose.towards(&motion, i, sticking), contact.curve.at(0.0))
            } else {
                // Slower than what counts as slip it is friction at the slip's speed, its noise taken off.
                let creep = (speed * speed - creep_noises[place].powi(2)).max(0.0).sqrt();
                let slow_m_s = 0.1 * thresholds[place];
                (sigmoid((sticking.signum() * v / slow_m_s - 1.0) / WIDTH), contact.curve.at(creep))
            };
            let limit = loaded * coefficient;
            let over = (sticking.abs() - limit) / (LIMIT_WIDTH * limit);
            let mut breaks = 0.0;
            if over > -SATURATED {
                // At rest bristles hold more than F_N g(0) until the motion goes in the force's direction: winding down is no slip.
                let (share, beyond) = if over > SATURATED {
                    (1.0, sticking.abs() - limit)
                } else {
                    let small = (-over.abs()).exp();
                    let share = if over > 0.0 { 1.0 } else { small } / (1.0 + small);
                    (share, LIMIT_WIDTH * limit * (over.max(0.0) + (1.0 + small).ln()))
                };
                breaks = share * towards;
                sticking -= sticking.signum() * beyond * towards;
            }
            if let Some(loose) = &loose {
                breaks += (1.0 - breaks) * loose.share;
                let slipping = loaded * contact.curve.at(loose.slow_m_s);
                sticking += breaks * (slipping.copysign(sticking) - sticking);
            }
            let before = variance + added_by(way);
            let gain = before / (1.0 + before);
            let pulled = gain * drive.innovation_n(i, sticking) / k;
            // A bound makes nothing more certain, nor does what stands in for what is beyond it.
            let stuck = if drive.at_end(i) { before } else { gain };
            let follows = slips + (1.0 - slips) * breaks;
            variance = follows * observed_variance + (1.0 - follows) * stuck;
            if let Some(loose) = &mut loose {
                (loose.share, out.sliding[i]) = (follows, follows);
            }
            held_m = follows * ways.block_m[i] + (1.0 - follows) * (held_m + moved + pulled);
            let observed_m = ways.branches_m(i);
            for b in 0..3 {
                held_branches_m[b] =
                    follows * observed_m[b] + (1.0 - follows) * (held_branches_m[b] + moved) * branch[b];
            }
            out.force_n[i] = slips * sliding + (1.0 - slips) * sticking;
        } else {
            (held_m, held_branches_m) = (ways.block_m[i], ways.branches_m(i));
            variance = observed_variance;
            loose.iter_mut().for_each(|loose| loose.share = 1.0);
            out.force_n[i] = sliding;
        }
        if let Some(ageing) = contact.ageing {
            let slid = out.sliding[i];
            let aged = if slid > NEGLIGIBLE { slid * ageing.renewed(age, speed, dt) } else { 0.0 };
            age = aged + (1.0 - slid) * (age + dt);
        }
    }
    out
}

/// The root and the block that it pulls.
pub(super) struct Motion<'m> {
    root_m: &'m [f64],
    block_m: &'m [f64],
    /// Samples a second.
    rate: f64,
}

impl Motion<'_> {
    /// Way of the root over the step that ends at a sample, m.
    #[inline]
    fn way_m(&self, i: usize) -> f64 {
        self.root_m[i] - self.root_m[i - 1]
    }

    /// Speed of the root, even about a sample, m/s.
    #[inline]
    pub(super) fn root_m_s(&self, i: usize) -> f64 {
        let last = self.root_m.len() - 1;
        0.5 * self.rate * (self.way_m(i) + self.root_m[(i + 1).min(last)] - self.root_m[i.min(last - 1)])
    }

    /// Speeds of the root and of the block over this many samples about one, m/s.
    pub(super) fn over(&self, i: usize, samples: usize) -> (f64, f64) {
        let (from, to) = (i.saturating_sub(samples / 2), (i + samples / 2).min(self.root_m.len() - 1));
        let rate = self.rate / (to - from) as f64;
        (rate * (self.root_m[to] - self.root_m[from]), rate * (self.block_m[to] - self.block_m[from]))
    }

    /// Speed of the slip, even about each sample: means before and after it, or the law is late by half a step.
    fn slip_speeds(&self, slip_m_s: &mut [f64]) {
        let last = self.root_m.len() - 1;
        let way = |i: usize| self.root_m[i] - self.block_m[i];
        for (i, slip) in slip_m_s.iter_mut().enumerate().take(last).skip(1) {
            *slip = 0.5 * self.rate * (way(i + 1) - way(i - 1));
        }
        slip_m_s[last] = self.rate * (way(last) - way(last - 1));
    }
}

/// Share of slip in the blend at each sample but the first.
fn slides(motion: &Motion<'_>, drive: &Drive<'_>, coulomb: f64, thresholds: &[f64], out: &mut Observed) {
    let steep = 1.0 / WIDTH;
    let by_speed: Vec<f64> = thresholds.iter().map(|threshold| steep / threshold).collect();
    let by_share = steep / LEAST_SHARE;
    let by_force = steep / (LEAST_FORCE * coulomb);
    let saturated = steep + SATURATED;
    for i in 1..motion.root_m.len() {
        let w = out.slip_m_s[i];
        let speed = w.abs();
        let place = drive.smoothed_at(i);
        let fast = by_speed[place] * speed - steep;
        out.sliding[i] = if fast < -SATURATED {
            0.0
        } else {
            let (slip, root) = (by_share * speed, motion.root_m_s(i).abs() + 1e-3 * thresholds[place]);
            let (force, load) = (by_force * drive.force_n[i] * 1f64.copysign(w), drive.load_n[i]);
            // The most frequent answer without a division.
            if fast > SATURATED && slip > saturated * root && force > saturated * load && load > 0.0 {
                1.0
            } else {
                sigmoid(fast) * sigmoid(slip / root - steep) * sigmoid(force / load - steep)
            }
        };
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::identify::contact::law::Curve;
    use crate::identify::noise::White;

    /// A block that slips as a whole.
    pub(in crate::identify::contact) fn block(
        stiffness_n_per_m: f64,
        damping_n_s_per_m: f64,
        curve: Curve,
    ) -> Contact {
        Contact {
            curve,
            stiffness_n_per_m,
            damping_n_s_per_m,
            bristles_n_per_m: f64::INFINITY,
            bristles_alone: false,
            slips_on: false,
            branches: [(0.0, 1.0); 3],
            viscous: (0.0, 0.0),
            ageing: None,
        }
    }

    /// Steady sliding on a falling curve, the force measured with white noise: what a right law leaves, over its stated
    /// deviation, is as large as the noise for every damping that the law may have, so that noise does not choose one.
    #[test]
    fn noise_that_stands_on_both_sides_does_not_choose_the_damping() {
        const STEP_S: f64 = 1e-3;
        const NOISE_N: f64 = 0.2;
        let n = 20_000;
        let (load, speed) = (80.0, 0.06);
        let mut noise = White::new(3);
        let root_m: Vec<f64> = (0..n).map(|i| speed * STEP_S * i as f64).collect();
        let (loads, slope) = (vec![load; n], 1.2);
        let force_n: Vec<f64> = (0..n).map(|_| load * 0.6 + NOISE_N * noise.next()).collect();
        let least = smoothed_flat(&force_n, OBSERVED_OVER);
        // As with a sample missing now and then: the points are hardly closer than the samples.
        let left = |damping: f64, late: f64, place: u8, stated: bool| {
            let (further, _) = widths().nth(usize::from(place)).unwrap();
            let seen_n = shifted(&gaussian(&least, further, 0), late);
            let smoothed = vec![place; n];
            let contact = block(25_000.0, damping, Curve::new(|w| (0.6 - slope * (w - speed)).max(0.1)));
            let drive = Drive {
                step_s: STEP_S,
                root_m: &root_m,
                load_n: &loads,
                force_n: &seen_n,
                ends: None,
                factor: None,
                slip_threshold_m_s: 1e-3,
                late,
                smoothed: &smoothed,
                noise: (1e-6, NOISE_N),
                unsure_m_s: 0.0,
            };
            let seen = observe(&contact, &drive);
            let shown = shifted(&seen.force_n, -late);
            let of = |i: usize| {
                let variance = if stated { seen.own_noise[i] } else { 1.0 };
                (force_n[i] - shown[i]).powi(2) / variance
            };
            ((500..n - 500).map(of).sum::<f64>() / (n - 1000) as f64).sqrt() / NOISE_N
        };
        // F_N |g′| is 96 N s/m. Between samples a channel that is late is interpolated, which smooths its noise.
        let least = [(96.0, 0.0, 0), (150.0, 0.0, 0), (300.0, 0.0, 0), (96.0, 0.5, 0), (150.0, 0.5, 0)];
        for (damping, late, place) in least.into_iter().chain([(96.0, 0.0, 2), (150.0, 0.5, 4)]) {
            let left = left(damping, late, place, true);
            assert!((left - 1.0).abs() < 0.03, "{damping} {late} {place}: {left}");
        }
        // As it is, the one at which the slope's force cancels the damper's would leave least.
        let (near, far) = (left(96.0, 0.0, 0, false), left(300.0, 0.0, 0, false));
        assert!(near < far - 0.05, "{near} {far}");
    }

    /// A block at rest, wound up beyond the end of the channel's range and down again.
    #[test]
    fn a_force_beyond_the_end_of_the_range_is_not_pulled_to_the_end() {
        const STEP_S: f64 = 1e-3;
        const STIFFNESS_N_PER_M: f64 = 25_000.0;
        const END_N: f64 = 15.0;
        let n = 1000;
        let turn = std::f64::consts::TAU / n as f64;
        let acts_n: Vec<f64> = (0..n).map(|i| 12.5 * (1.0 - (turn * i as f64).cos())).collect();
        let contact = block(STIFFNESS_N_PER_M, 1.0, Curve::new(|_| 0.6));
        // Largest error, but for a log's first samples and those just behind the end; beyond it this stands for the force.
        let off_n = |acts_n: &[f64], known: bool, stands_in: fn(f64) -> f64| {
            let at_end: Vec<i8> = acts_n.iter().map(|f| i8::from(*f > END_N)).collect();
            let drive = Drive {
                step_s: STEP_S,
                root_m: &acts_n.iter().map(|f| f / STIFFNESS_N_PER_M).collect::<Vec<_>>(),
                load_n: &vec![50.0; acts_n.len()],
                force_n: &acts_n
                    .iter()
                    .map(|f| if *f > END_N { stands_in(*f) } else { *f })
                    .collect::<Vec<_>>(),
                ends: known.then_some(at_end.as_slice()),
                factor: None,
                // Nothing slips here, nor where what stands in ends in a jump.
                slip_threshold_m_s: 0.5,
                late: 0.0,
                smoothed: &[],
                noise: (1e-3, 0.15),
                unsure_m_s: 0.0,
            };
            let seen = observe(&contact, &drive).force_n;
            let judged = (3..acts_n.len()).filter(|i| acts_n[0] < END_N || at_end[i - 3] == 0);
            judged.map(|i| (seen[i] - acts_n[i]).abs()).fold(0.0, f64::max)
        };
        let end: fn(f64) -> f64 = |_| END_N;
        let wrong: fn(f64) -> f64 = |f| f + 4.0;
        assert!(off_n(&acts_n, true, end) < 0.1, "{}", off_n(&acts_n, true, end));
        assert!(off_n(&acts_n, false, end) > 5.0, "{}", off_n(&acts_n, false, end));
        // A log that begins beyond it, long or shortly before the channel shows the force again, says nothing of the winding,
        // whatever stands in: the end, or a law that is wrong.
        let last = acts_n.iter().rposition(|f| *f > END_N).unwrap();
        for (from, stands_in) in [n / 2, last - 3].into_iter().flat_map(|from| [(from, end), (from, wrong)]) {
            let late = off_n(&acts_n[from..], true, stands_in);
            assert!(late < 0.3, "{from}: {late}");
        }
    }

    /// A block at rest that relaxes: what is held follows only what the bridge may wander by, and a disc that is not seen.
    #[test]
    fn a_force_that_creeps_at_rest_is_no_motion() {
        const STEP_S: f64 = 1e-3;
        const CREEPS_N_PER_S: f64 = 1.0;
        let contact = block(2e4, 100.0, Curve::new(|_| 0.6));
        let force_n: Vec<f64> = (0..2000).map(|i| 15.0 - CREEPS_N_PER_S * STEP_S * f64::from(i)).collect();
        let left_n = |unsure_m_s: f64| {
            let drive = Drive {
                step_s: STEP_S,
                root_m: &[0.0; 2000],
                load_n: &[50.0; 2000],
                force_n: &force_n,
                ends: None,
                factor: None,
                slip_threshold_m_s: 1e-3,
                late: 0.0,
                smoothed: &[],
                noise: (3e-4, 0.15),
                unsure_m_s,
            };
            observe(&contact, &drive).force_n[1999] - force_n[1999]
        };
        // A gain of a hundredth: a tenth of a second behind.
        let (seen, reckoned) = (left_n(0.0), left_n(3e-3));
        assert!((seen / (0.1 * CREEPS_N_PER_S) - 1.0).abs() < 0.1, "{seen}");
        assert!(reckoned < 0.1 * seen, "{reckoned}");
    }

    /// A spring that slides at 10 mm/s under 10 N, its force logged with a noise of 0.15 N.
    #[test]
    fn slip_is_seen_from_samples_that_are_far_apart() {
        let contact = block(2e4, 0.0, Curve::new(|_| 0.5));
        let mut noise = White::new(1);
        let force_n: Vec<f64> = (0..1000).map(|_| 5.0 + 0.15 * noise.next()).collect();
        let sliding = |step_s: f64| {
            let root_m: Vec<f64> = (0..1000).map(|i| 0.01 * step_s * f64::from(i)).collect();
            let drive = Drive {
                step_s,
                root_m: &root_m,
                load_n: &[10.0; 1000],
                force_n: &force_n,
                ends: None,
                factor: None,
                slip_threshold_m_s: 1e-4,
                late: 0.0,
                smoothed: &[],
                noise: (1e-5, 0.15),
                unsure_m_s: 0.0,
            };
            let seen = observe(&contact, &drive).sliding;
            seen.iter().sum::<f64>() / seen.len() as f64
        };
        assert!(sliding(0.01) > 0.95, "{}", sliding(0.01));
        // From samples of a millisecond noise hides the slip.
        assert!(sliding(1e-3) < 0.05, "{}", sliding(1e-3));
    }
}
