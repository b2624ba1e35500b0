//! eˣ and eˣ − 1 in single precision, from one argument reduction and one polynomial.
//!
//! x = k ln 2 + r, |r| ≤ ln 2/2, eˣ = 2ᵏ (1 + E), E = r + r² P(r). P is the Chebyshev fit of degree 4
//! of (eʳ − 1 − r)/r²; its error is 1e-8 of eʳ, a tenth of what f32 can hold.
//!
//! Both stand in every friction step, and this form is inlined and free of branches: a LuGre step
//! takes half the time that it takes with `libm::expf` and `libm::expm1f` (`cargo bench
//! --bench model_steps`). Only additions, multiplications and integer operations occur, so the chip and the
//! PC compute the same bits. Below −87 the result is that of −87 (1.6e-38), above 88 that of 88.

const INVERSE_LN_2: f32 = core::f32::consts::LOG2_E;
/// ln 2 in two parts; the upper has 15 trailing zero bits, so k·upper is exact.
const LN_2_UPPER: f32 = 6.931_457_5e-1;
const LN_2_LOWER: f32 = 1.428_606_8e-6;
/// 1.5·2²³: adding it leaves the nearest integer in the low bits of the mantissa.
const ROUNDER: f32 = 12_582_912.0;
const P: [f32; 5] = [0.5, 0.166_665_76, 0.041_666_552, 0.008_363_233, 0.001_392_625];

/// (2ᵏ, E) of the reduction above.
#[inline]
fn reduce(x: f32) -> (f32, f32) {
    let x = if x < -87.0 { -87.0 } else { x };
    let x = if x > 88.0 { 88.0 } else { x };
    let shifted = x * INVERSE_LN_2 + ROUNDER;
    let k = shifted - ROUNDER;
    let r = (x - k * LN_2_UPPER) - k * LN_2_LOWER;
    let r2 = r * r;
    let p = (P[0] + r * P[1]) + r2 * ((P[2] + r * P[3]) + r2 * P[4]);
    // The low bits of `shifted` are k; moved into the exponent they make 2ᵏ.
    let power = f32::from_bits(shifted.to_bits().wrapping_add(127) << 23);
    (power, r + r2 * p)
}

/// eˣ, relative error below 1.5e-7 for −87 ≤ x ≤ 88.
#[inline]
pub fn exp(x: f32) -> f32 {
    let (power, e) = reduce(x);
    power + power * e
}

/// eˣ − 1, relative error below 3e-7 for −87 ≤ x ≤ 88, down to the smallest x.
#[inline]
pub fn exp_m1(x: f32) -> f32 {
    let (power, e) = reduce(x);
    power * e + (power - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn worst(f: fn(f32) -> f32, exact: fn(f64) -> f64) -> f64 {
        let mut worst = 0.0f64;
        // Every 101st float of both signs from 1e-30 to 87.
        for sign in [0u32, 1 << 31] {
            let mut bits = 1e-30f32.to_bits();
            while bits < 87.0f32.to_bits() {
                let x = f32::from_bits(bits | sign);
                worst = worst.max((f64::from(f(x)) / exact(f64::from(x)) - 1.0).abs());
                bits += 101;
            }
        }
        worst
    }

    #[test]
    fn the_exponential_is_within_two_roundings() {
        let error = worst(exp, libm::exp);
        assert!(error < 1.5e-7, "{error:e}");
    }

    #[test]
    fn the_exponential_less_one_keeps_its_digits_down_to_the_smallest_argument() {
        let error = worst(exp_m1, libm::expm1);
        assert!(error < 3e-7, "{error:e}");
        assert_eq!(exp_m1(0.0), 0.0);
        assert_eq!(exp_m1(-1e-30), -1e-30);
    }

    #[test]
    fn beyond_its_range_the_exponential_stays_finite() {
        for x in [-1e30, -200.0, 200.0, 1e30] {
            assert!(exp(x).is_finite() && exp_m1(x).is_finite(), "{x}");
        }
        assert!(exp(-1e30) < 2e-38);
        assert_eq!(exp_m1(-1e30), -1.0);
    }
}
