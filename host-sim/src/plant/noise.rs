//! Seeded noise: one normal deviate a channel and sample, from xoshiro256++, in the order of the scan.
//!
//! A channel with standard deviation zero draws all the same, so that turning one channel's noise off does not
//! change the others'.

use rand_distr::{Distribution, StandardNormal};
use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::SeedableRng;

/// The generator of one plant.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Noise(Xoshiro256PlusPlus);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    #[inline]
    pub(crate) fn draw<const N: usize>(&mut self, deviation: &[f64; N]) -> [f64; N] {
        let mut noise = [0.0; N];
        // A loop in place of `map`: that checks at each entry whether the array is full, half a million times an experiment.
        for (noise, deviation) in noise.iter_mut().zip(deviation) {
            let n: f64 = StandardNormal.sample(&mut self.0);
            *noise = deviation * n;
        }
        noise
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_has_its_deviation_no_mean_and_depends_on_the_seed_alone() {
        let count = 40_000;
        let run = |seed| {
            let mut noise = Noise::new(seed);
            (0..count).map(|_| noise.draw(&[0.5, 0.0])).collect::<Vec<_>>()
        };
        let a = run(7);
        assert_eq!(a, run(7));
        assert_ne!(a, run(8));
        let mean = a.iter().map(|x| x[0]).sum::<f64>() / f64::from(count);
        let square = a.iter().map(|x| x[0] * x[0]).sum::<f64>() / f64::from(count);
        // Four standard errors: 4·0.5/√40000 and 4·0.5/√80000.
        assert!(mean.abs() < 0.01, "mean {mean}");
        assert!((square.sqrt() - 0.5).abs() < 0.0071, "deviation {}", square.sqrt());
        assert!(a.iter().all(|x| x[1] == 0.0));
    }
}
