//! How far one published law of friction is from another that was fitted to it.
//!
//! A cause is known by its law, and the law of the library is not the rubber's. What is left of it looks like a second,
//! smaller cause.

/// Share of a cause's size that its law may be wrong by: the RMS over laws of growth and of decay from the literature, each
/// fitted by each other in amplitude and scale (the test computes it: 0.05 and 0.16).
pub(super) const LAW_FORM: f64 = 0.1;
/// The same where the shape is found, as a sum of so many columns: what they leave of the laws of growth.
pub(super) const SHAPE_FORM: f64 = 0.01;
/// Columns that make a shape: fewer are a law.
pub(super) const COLUMNS: usize = 3;

#[cfg(test)]
mod tests {
    use nalgebra::{DMatrix, DVector};

    use super::*;
    use crate::identify::linear;

    type Law = fn(f64) -> f64;

    /// Of heat, distance or time, from nothing on: a relaxation, a hyperbola, contact ageing (Dieterich 1979), diffusion, and
    /// two relaxations.
    const GROWTH: [Law; 5] = [
        |x| 1.0 - (-x).exp(),
        |x| x / (1.0 + x),
        |x| x.ln_1p(),
        |x| x.sqrt(),
        |x| 1.0 - 0.5 * (-x).exp() - 0.5 * (-x / 5.0).exp(),
    ];
    /// Of sliding speed: Bo and Pavelescu 1982 with both exponents, Hess and Soom 1990, and a hyperbola.
    const DECAY: [Law; 4] =
        [|x| (-x).exp(), |x| (-x * x).exp(), |x| 1.0 / (1.0 + x * x), |x| 1.0 / (1.0 + x)];
    const SAMPLES: u32 = 300;

    /// What `by` leaves of `law` over 0 … `range`, relative to `law`.
    fn left(law: Law, by: Law, range: f64) -> f64 {
        let xs = || (0..=SAMPLES).map(|n| range * f64::from(n) / f64::from(SAMPLES));
        let of = |scale: f64| -> f64 {
            let (mut yy, mut yf, mut ff) = (0.0, 0.0, 0.0);
            for x in xs() {
                let (y, f) = (law(x), by(x / scale));
                yy += y * y;
                yf += y * f;
                ff += f * f;
            }
            (1.0 - yf * yf / (yy * ff)).max(0.0).sqrt()
        };
        (-300..=300).map(|n| of(10.0f64.powf(f64::from(n) / 100.0))).fold(f64::INFINITY, f64::min)
    }

    /// RMS over all pairs of different laws.
    fn rms(laws: &[Law], ranges: &[f64]) -> f64 {
        let mut squares = Vec::new();
        for range in ranges {
            for (a, law) in laws.iter().enumerate() {
                for (_, by) in laws.iter().enumerate().filter(|(b, _)| *b != a) {
                    squares.push(left(*law, *by, *range).powi(2));
                }
            }
        }
        (squares.iter().sum::<f64>() / squares.len() as f64).sqrt()
    }

    #[test]
    fn it_is_what_published_laws_leave_of_each_other() {
        // Over one and over three times the scale of the law: what an experiment heats, wears and slides.
        let growth = rms(&GROWTH, &[1.0, 3.0]);
        let decay = rms(&DECAY, &[3.0]);
        assert!((growth - 0.05).abs() < 0.005 && (decay - 0.16).abs() < 0.005, "{growth} {decay}");
        let both = (0.5 * (growth * growth + decay * decay)).sqrt();
        // To one digit: it is a prior of what the next rubber's law is.
        assert!(((both * 10.0).round() / 10.0 - LAW_FORM).abs() < 1e-12, "{both}");
    }

    #[test]
    fn it_is_what_columns_leave_of_published_laws() {
        const BENDS: [f64; COLUMNS] = [0.05, 0.2, 1.0];
        let xs: Vec<f64> = (0..=SAMPLES).map(|n| f64::from(n) / f64::from(SAMPLES)).collect();
        let columns = DMatrix::from_fn(xs.len(), BENDS.len(), |i, j| 1.0 - (-xs[i] / BENDS[j]).exp());
        let mut squares = Vec::new();
        for range in [1.0, 3.0] {
            for law in GROWTH {
                let y = DVector::from_fn(xs.len(), |i, _| law(range * xs[i]));
                let p = linear::non_negative(&(columns.transpose() * &columns), &(columns.transpose() * &y));
                squares.push((&y - &columns * p).norm_squared() / y.norm_squared());
            }
        }
        let rms = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        assert!(((rms * 100.0).round() / 100.0 - SHAPE_FORM).abs() < 1e-12, "{rms}");
    }
}
