//! The evidence of a hypothesis, ln ∫ likelihood^share · prior dp, by Laplace's method.
//!
//! It is expanded where the likelihood counts whole, which is where a hypothesis is fitted. With its share alone the priors
//! pull further, so that the optimum is another one: with b the slope and A the curvature of the shared posterior in
//! deviations of the prior, it is ½ bᵀA⁻¹b higher.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

use super::linear;
use super::term::Parameter;

/// The likelihood of the contact counts with this share: laws of friction are wrong in form, not only in noise, so that it is
/// too sure. Priors count whole.
pub const CONTACT_SHARE: f64 = 0.1;
/// That of the drive and of the normal-load actuator: half an order more, since Newton's law has a form.
pub const BALANCE_SHARE: f64 = 0.3;
/// Scales of the amplitudes' priors: effects of 3 to 100 % are equally expected.
pub const SCALES: [f64; 4] = [0.03, 0.1, 0.3, 1.0];
/// The scale that the search itself uses.
pub const TYPICAL_SCALE: f64 = 0.3;

/// The likelihood about a point.
pub struct Expansion<'e> {
    /// The point.
    pub p: &'e [f64],
    /// Parameters with their priors.
    pub parameters: &'e [&'e Parameter],
    /// −ln likelihood there.
    pub misfit: f64,
    /// Slope of ln likelihood.
    pub slope: &'e DVector<f64>,
    /// Curvature of −ln likelihood.
    pub curvature: &'e DMatrix<f64>,
}

impl Parameter {
    /// Deviation of the prior at a scale of the amplitudes.
    pub fn width(&self, scale: f64) -> f64 {
        if self.amplitude { self.sd * scale } else { self.sd }
    }
}

impl Expansion<'_> {
    /// ln evidence with a share of the likelihood, averaged over the scale of the amplitudes; `more` is what a scale adds.
    pub fn log_evidence(&self, share: f64, more: impl Fn(f64) -> f64) -> f64 {
        log_mean_exp(SCALES.iter().map(|scale| more(*scale) + self.at_scale(share, *scale)))
    }

    fn at_scale(&self, share: f64, scale: f64) -> f64 {
        let sd = |i: usize| self.parameters[i].width(scale);
        let off = |i: usize| (self.p[i] - self.parameters[i].mean) / sd(i);
        let free: Vec<usize> = (0..self.p.len()).filter(|i| self.p[*i] > self.parameters[*i].lower).collect();
        let curvature = DMatrix::from_fn(free.len(), free.len(), |a, b| self.curvature[(free[a], free[b])]);
        let factor = posterior(&curvature, share, &free.iter().map(|i| sd(*i)).collect::<Vec<_>>());
        let slope = DVector::from_fn(free.len(), |a, _| {
            let i = free[a];
            share * self.slope[i] * sd(i) - off(i)
        });
        let prior: f64 = (0..self.p.len()).map(|i| off(i).powi(2)).sum();
        0.5 * slope.dot(&factor.solve(&slope))
            - share * self.misfit
            - 0.5 * prior
            - 0.5 * linear::log_determinant(&factor)
    }
}

/// Occam's factor of parameters with normal priors of these deviations, as a logarithm; `curvature` is that of −ln likelihood,
/// which counts with a share.
pub fn log_occam(curvature: &DMatrix<f64>, share: f64, sd: &[f64]) -> f64 {
    -0.5 * linear::log_determinant(&posterior(curvature, share, sd))
}

/// Covariance of parameters with normal priors of these deviations; `curvature` is that of −ln likelihood, which counts with a
/// share.
pub fn covariance(curvature: &DMatrix<f64>, share: f64, sd: &[f64]) -> DMatrix<f64> {
    let inverse = posterior(curvature, share, sd).inverse();
    DMatrix::from_fn(sd.len(), sd.len(), |a, b| inverse[(a, b)] * sd[a] * sd[b])
}

/// Factor of the posterior's curvature in deviations of the prior.
fn posterior(curvature: &DMatrix<f64>, share: f64, sd: &[f64]) -> Cholesky<f64, Dyn> {
    linear::factor(&DMatrix::from_fn(sd.len(), sd.len(), |a, b| {
        share * curvature[(a, b)] * sd[a] * sd[b] + f64::from(u8::from(a == b))
    }))
}

/// ln of the mean of exponentials.
pub fn log_mean_exp(values: impl Iterator<Item = f64>) -> f64 {
    let values: Vec<f64> = values.collect();
    let largest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    largest + (values.iter().map(|x| (x - largest).exp()).sum::<f64>() / values.len() as f64).ln()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One parameter p ~ N(0, 1), misfit ½ h (p − y)²: with a share s the integral is known.
    #[test]
    fn it_is_the_integral_wherever_it_is_expanded() {
        let known = Parameter { amplitude: false, ..Parameter::amplitude("p", 1.0) };
        let (h, y, share) = (400.0, 5.0, CONTACT_SHARE);
        let truth = -0.5 * y * y / (1.0 + 1.0 / (share * h)) - 0.5 * (1.0 + share * h).ln();
        for p in [y * h / (1.0 + h), 0.9 * y, 0.0] {
            let at = Expansion {
                p: &[p],
                parameters: &[&known],
                misfit: 0.5 * h * (p - y).powi(2),
                slope: &DVector::from_element(1, h * (y - p)),
                curvature: &DMatrix::from_element(1, 1, h),
            };
            let found = at.log_evidence(share, |_| 0.0);
            assert!((found - truth).abs() < 1e-9, "{p}: {found} for {truth}");
        }
    }
}
