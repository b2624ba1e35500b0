//! What the contact does for one set of numbers: the friction curve as a table over the logarithm of the slip speed,
//! and the compliance in series with it.

/// Slowest speed of the table, m/s; below it the curve is taken as a straight line to standstill.
const SLOWEST_M_S: f64 = 1e-6;
/// Fastest speed of the table, m/s.
const FASTEST_M_S: f64 = 20.0;
/// Entries; a step is 4 % of speed, and a straight line over it errs by 4e-5 of a coefficient.
const ENTRIES: usize = 420;

/// A friction curve g(w) ≥ 0 over the slip speed w ≥ 0.
#[derive(Debug, Clone)]
pub struct Curve {
    values: Vec<f64>,
}

fn step() -> f64 {
    (FASTEST_M_S / SLOWEST_M_S).ln() / (ENTRIES - 2) as f64
}

/// Slip speeds of the table's entries, m/s.
pub fn speeds() -> impl Iterator<Item = f64> {
    let step = step();
    std::iter::once(0.0).chain((0..ENTRIES - 1).map(move |i| SLOWEST_M_S * (step * i as f64).exp()))
}

impl Curve {
    /// The table of a curve.
    pub fn new(curve: impl Fn(f64) -> f64) -> Self {
        Self { values: speeds().map(curve).collect() }
    }

    /// Multiplied with e^m(w), m given at [`speeds`].
    pub fn scale(&mut self, log_factor: &[f64]) {
        self.values.iter_mut().zip(log_factor).for_each(|(g, m)| *g *= m.exp());
    }

    /// g(w)
    #[inline]
    pub fn at(&self, slip_m_s: f64, per_log: f64, log_slowest: f64) -> f64 {
        if slip_m_s <= SLOWEST_M_S {
            return self.values[0] + (self.values[1] - self.values[0]) * slip_m_s / SLOWEST_M_S;
        }
        let place = (slip_m_s.ln() - log_slowest) * per_log;
        let i = (place as usize).min(ENTRIES - 3);
        let part = (place - i as f64).min(1.0);
        self.values[i + 1] + part * (self.values[i + 2] - self.values[i + 1])
    }

    /// ln of the slowest speed and entries per unit of ln: what [`Self::at`] is called with.
    pub fn scale_of_table() -> (f64, f64) {
        (1.0 / step(), SLOWEST_M_S.ln())
    }

    /// Coefficient of the fastest slip.
    pub fn at_speed(&self) -> f64 {
        self.values[ENTRIES - 1]
    }

    /// |g′(w)|, 1/(m/s).
    pub fn slope(&self, slip_m_s: f64) -> f64 {
        let (per_log, log_slowest) = Self::scale_of_table();
        let (low, high) = (slip_m_s * 0.95, slip_m_s * 1.05);
        ((self.at(high, per_log, log_slowest) - self.at(low, per_log, log_slowest)) / (high - low)).abs()
    }
}

/// Friction that grows with the age of the contact: 1 + growth·ln(1 + age/onset), the age renewed over a distance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Ageing {
    /// Growth for an e-fold of age.
    pub growth: f64,
    /// Age at which it sets in, s.
    pub onset_s: f64,
    /// Distance over which sliding renews the contact, m.
    pub renewal_m: f64,
    /// Age when the log begins, s.
    pub first_age_s: f64,
}

impl Ageing {
    /// Friction over that of a fresh contact.
    pub fn factor(&self, age_s: f64) -> f64 {
        1.0 + self.growth * (age_s / self.onset_s).ln_1p()
    }

    /// Age after a step of slip at this speed.
    pub fn renewed(&self, age_s: f64, slip_m_s: f64, step_s: f64) -> f64 {
        let share = slip_m_s * step_s / self.renewal_m;
        if share > 1e-6 {
            age_s * (-share).exp() - step_s * (-share).exp_m1() / share
        } else {
            age_s + step_s
        }
    }
}

/// The contact of a log for one set of numbers.
#[derive(Debug, Clone)]
pub struct Contact {
    /// Friction coefficient over slip speed.
    pub curve: Curve,
    /// Stiffness in series with the slip, N/m.
    pub stiffness_n_per_m: f64,
    /// Its damping, N s/m.
    pub damping_n_s_per_m: f64,
    /// Stiffness of bristles in series with it, N/m; infinite where they are the stiffness itself.
    pub bristles_n_per_m: f64,
    /// Whether the stiffness is that of bristles which follow the root (LuGre), and not of a block that slips as a whole.
    pub bristles_alone: bool,
    /// Maxwell branches beside it: stiffness, N/m, and relaxation time, s.
    pub branches: [(f64, f64); 3],
    /// Friction per slip speed: per load, s/m, and whatever the load, N s/m.
    pub viscous: (f64, f64),
    /// Ageing, where it acts.
    pub ageing: Option<Ageing>,
}
