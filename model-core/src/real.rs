//! The scalar of the models: `f32` on the chip, `f64` for reference.
//!
//! All transcendental functions come from `libm` (the exponential in f32 from [`crate::exponential`]),
//! on the chip as on the PC, so that both compute the same bits. There is no fused multiply-add
//! anywhere in the core for the same reason.

use crate::exponential;
use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, Neg, Sub, SubAssign};

/// A real number with the few functions the friction models need.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + Send
    + Sync
    + 'static
{
    /// 0
    const ZERO: Self;
    /// 1
    const ONE: Self;
    /// 1/2
    const HALF: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;

    /// The nearest number of this type.
    fn from_f64(value: f64) -> Self;
    /// The same number as `f64`, exactly.
    fn to_f64(self) -> f64;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
    /// |x|
    #[must_use]
    fn abs(self) -> Self;
    /// √x
    #[must_use]
    fn sqrt(self) -> Self;
    /// eˣ
    #[must_use]
    fn exp(self) -> Self;
    /// eˣ − 1, accurate near zero.
    #[must_use]
    fn exp_m1(self) -> Self;
    /// ln x
    #[must_use]
    fn ln(self) -> Self;
    /// ln(1 + x), accurate near zero.
    #[must_use]
    fn ln_1p(self) -> Self;
    /// xʸ
    #[must_use]
    fn powf(self, exponent: Self) -> Self;
    /// sin x
    #[must_use]
    fn sin(self) -> Self;
    /// cos x
    #[must_use]
    fn cos(self) -> Self;
    /// |self| with the sign of `sign`.
    #[must_use]
    fn copysign(self, sign: Self) -> Self;

    /// The larger of two numbers; a NaN in `self` gives `other`.
    #[must_use]
    fn at_least(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    /// The smaller of two numbers; a NaN in `self` gives `other`.
    #[must_use]
    fn at_most(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    /// `self` limited to [−limit, limit].
    #[must_use]
    fn within(self, limit: Self) -> Self {
        self.at_most(limit).at_least(-limit)
    }
    /// −1, 0 or 1.
    #[must_use]
    fn sign(self) -> Self {
        if self > Self::ZERO {
            Self::ONE
        } else if self < Self::ZERO {
            -Self::ONE
        } else {
            Self::ZERO
        }
    }
}

macro_rules! real {
    ($t:ty, $exp:path, $exp_m1:path, $abs:ident, $sqrt:ident, $ln:ident, $log1p:ident, $pow:path,
     $sin:ident, $cos:ident, $copysign:ident) => {
        impl Real for $t {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const HALF: Self = 0.5;
            const EPSILON: Self = <$t>::EPSILON;

            #[inline]
            #[allow(clippy::cast_possible_truncation)]
            fn from_f64(value: f64) -> Self {
                value as $t
            }
            #[inline]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline]
            fn is_finite(self) -> bool {
                <$t>::is_finite(self)
            }
            #[inline]
            fn abs(self) -> Self {
                libm::$abs(self)
            }
            #[inline]
            fn sqrt(self) -> Self {
                libm::$sqrt(self)
            }
            #[inline]
            fn exp(self) -> Self {
                $exp(self)
            }
            #[inline]
            fn exp_m1(self) -> Self {
                $exp_m1(self)
            }
            #[inline]
            fn ln(self) -> Self {
                libm::$ln(self)
            }
            #[inline]
            fn ln_1p(self) -> Self {
                libm::$log1p(self)
            }
            #[inline]
            fn powf(self, exponent: Self) -> Self {
                $pow(self, exponent)
            }
            #[inline]
            fn sin(self) -> Self {
                libm::$sin(self)
            }
            #[inline]
            fn cos(self) -> Self {
                libm::$cos(self)
            }
            #[inline]
            fn copysign(self, sign: Self) -> Self {
                libm::$copysign(self, sign)
            }
        }
    };
}

/// xʸ in f64, which only the PC computes. `libm::pow` is right to the last bit and takes most of the time of a fit with a
/// free Stribeck exponent; this is right to |y ln x| of these bits.
fn power(x: f64, y: f64) -> f64 {
    if x > 0.0 && x.is_finite() { libm::exp(y * libm::log(x)) } else { libm::pow(x, y) }
}

real!(
    f32,
    exponential::exp,
    exponential::exp_m1,
    fabsf,
    sqrtf,
    logf,
    log1pf,
    libm::powf,
    sinf,
    cosf,
    copysignf
);
real!(f64, libm::exp, libm::expm1, fabs, sqrt, log, log1p, power, sin, cos, copysign);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fast_power_is_the_slow_one_to_its_rounding() {
        for x in [0.0, 1e-12, 3e-3, 0.7, 1.0, 40.0, 1e9] {
            for y in [0.2, 0.5, 0.6218, 1.0, 2.5, 5.0] {
                let (fast, slow) = (Real::powf(x, y), libm::pow(x, y));
                // |y ln x| is at most 140 here.
                assert!((fast - slow).abs() <= 140.0 * f64::EPSILON * slow, "{x} {y}");
            }
        }
    }
}
