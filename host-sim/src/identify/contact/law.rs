//! What the contact does for one set of numbers: the friction curve as a table over the slip speed, whose cells are those of
//! its floating-point number, and the compliance in series with it.

/// Slowest speed of the table, 2⁻²⁰ m/s; below it the curve is taken as a straight line to standstill.
const SLOWEST_M_S: f64 = 1.0 / 1_048_576.0;
/// Octaves from the slowest speed to the fastest, 32 m/s.
const OCTAVES: usize = 25;
/// Leading bits of the fraction that are a cell's number in its octave: a cell is at most 3 % of its speed wide, and a straight
/// line over it errs by 4e-5 of a coefficient.
const CELL_BITS: u32 = 5;
/// What stands behind them.
const REST_BITS: u32 = f64::MANTISSA_DIGITS - 1 - CELL_BITS;
/// The first cell, by the leading bits of its speeds.
const FIRST_CELL: u64 = SLOWEST_M_S.to_bits() >> REST_BITS;
/// Entries: standstill, then the edges of the cells.
const ENTRIES: usize = (OCTAVES << CELL_BITS) + 2;

/// A friction curve g(w) ≥ 0 over the slip speed w ≥ 0.
#[derive(Debug, Clone)]
pub struct Curve {
    values: Vec<f64>,
    /// Slope of each cell, 1/(m/s).
    slopes: Vec<f64>,
}

/// Slip speed at which a cell begins, m/s.
fn edge(cell: u64) -> f64 {
    f64::from_bits((FIRST_CELL + cell) << REST_BITS)
}

/// Slip speeds of the table's entries, m/s.
pub fn speeds() -> impl Iterator<Item = f64> {
    std::iter::once(0.0).chain((0..ENTRIES as u64 - 1).map(edge))
}

impl Curve {
    /// The table of a curve.
    pub fn new(curve: impl Fn(f64) -> f64) -> Self {
        Self::of(speeds().map(curve).collect())
    }

    fn of(values: Vec<f64>) -> Self {
        let rises = values[1..].windows(2).map(|g| g[1] - g[0]);
        let slopes = rises.zip(0..).map(|(rise, cell)| rise / (edge(cell + 1) - edge(cell))).collect();
        Self { values, slopes }
    }

    /// Multiplied with e^m(w), m given at [`speeds`].
    pub fn scale(&mut self, log_factor: &[f64]) {
        *self = Self::of(self.values.iter().zip(log_factor).map(|(g, m)| g * m.exp()).collect());
    }

    /// g(w)
    #[inline]
    pub fn at(&self, slip_m_s: f64) -> f64 {
        if slip_m_s <= SLOWEST_M_S {
            return self.values[0] + (self.values[1] - self.values[0]) * slip_m_s / SLOWEST_M_S;
        }
        let bits = slip_m_s.to_bits();
        let cell = ((bits >> REST_BITS) - FIRST_CELL) as usize;
        if cell + 2 >= ENTRIES {
            return self.at_speed();
        }
        let part = (bits & ((1 << REST_BITS) - 1)) as f64 / (1u64 << REST_BITS) as f64;
        self.values[cell + 1] + part * (self.values[cell + 2] - self.values[cell + 1])
    }

    /// Coefficient of the fastest slip.
    pub fn at_speed(&self) -> f64 {
        self.values[ENTRIES - 1]
    }

    /// g(w), and g′(w) within a cell of the table, 1/(m/s).
    #[inline]
    pub fn at_with_derivative(&self, slip_m_s: f64) -> (f64, f64) {
        let bits = slip_m_s.max(SLOWEST_M_S).to_bits() >> REST_BITS;
        let cell = bits - FIRST_CELL;
        let Some(&derivative) = self.slopes.get(cell as usize) else { return (self.at_speed(), 0.0) };
        if slip_m_s <= SLOWEST_M_S {
            return (self.at(slip_m_s), derivative);
        }
        (self.values[cell as usize + 1] + derivative * (slip_m_s - edge(cell)), derivative)
    }

    /// |g′(w)|, 1/(m/s).
    pub fn slope(&self, slip_m_s: f64) -> f64 {
        let (low, high) = (slip_m_s * 0.95, slip_m_s * 1.05);
        ((self.at(high) - self.at(low)) / (high - low)).abs()
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
        1.0 + self.growth * (1.0 + age_s / self.onset_s).ln()
    }

    /// Age after a step of slip at this speed.
    pub fn renewed(&self, age_s: f64, slip_m_s: f64, step_s: f64) -> f64 {
        let share = slip_m_s * step_s / self.renewal_m;
        if share > 1e-6 {
            let lost = 1.0 - (-share).exp();
            age_s * (1.0 - lost) + step_s * lost / share
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
    /// Whether what slips does so until the motion reverses or stops, however slow it is (brush with reset).
    pub slips_on: bool,
    /// Maxwell branches beside it: stiffness, N/m, and relaxation time, s.
    pub branches: [(f64, f64); 3],
    /// Friction per slip speed: per load, s/m, and whatever the load, N s/m.
    pub viscous: (f64, f64),
    /// Ageing, where it acts.
    pub ageing: Option<Ageing>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_table_is_the_curve() {
        let law = |w: f64| 0.6 + 0.6 * (-(w / 0.3).sqrt()).exp();
        let curve = Curve::new(law);
        assert_eq!(speeds().count(), ENTRIES);
        for n in 0..2000 {
            let w = 3e-7 * 1.01f64.powi(n);
            // Nothing slides faster than the table's end, and below its begin the root has an endless slope.
            let allowed = if w < SLOWEST_M_S { 1e-3 } else { 4e-5 };
            assert!((curve.at(w) - law(w.min(32.0))).abs() < allowed, "{w}: {} for {}", curve.at(w), law(w));
            assert!((curve.at_with_derivative(w).0 - curve.at(w)).abs() < 1e-12);
        }
        assert!(
            (curve.slope(0.1) - 0.6 * 0.5 / (0.1f64 * 0.3).sqrt() * (-(0.1f64 / 0.3).sqrt()).exp()).abs()
                < 2e-3
        );
        let slope = curve.at_with_derivative(0.1).1;
        assert!((slope / -curve.slope(0.1) - 1.0).abs() < 0.02, "{slope}");
        assert_eq!(curve.at_with_derivative(40.0), (curve.at_speed(), 0.0));
        assert_eq!(curve.at(0.0), curve.values[0]);
    }
}
