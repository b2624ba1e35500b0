//! Drift of a bridge: zero or gain of the friction or the normal channel moves with time.
//!
//! T_measured = T (1 + g h(t)) + z h(t),   h(t) = (1 − e^{−κt})/κ
//!
//! and likewise for the normal force. h is t for κ = 0, settles for κ > 0 (warming up) and grows for κ < 0.
//! Time counts from the start of the record. Left out: drift that wanders up and down.

use crate::error::{ParameterError, require};
use crate::real::Real;
use crate::sensor::LEAST_GAIN;

/// Drift, prepared.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BridgeDrift<T> {
    zero_rate: T,
    gain_rate: T,
    normal_zero_rate: T,
    normal_gain_rate: T,
    settling_rate: T,
}

impl<T: Real> BridgeDrift<T> {
    /// Names of the parameters: rates of zero and gain of the friction bridge, of the normal bridge; κ.
    pub const NAMES: &'static [&'static str] = &[
        "friction_zero_nm_per_s",
        "friction_gain_per_s",
        "normal_zero_n_per_s",
        "normal_gain_per_s",
        "settling_per_s",
    ];

    /// Prepares the effect from values in the order of [`Self::NAMES`].
    pub fn new(values: &[T; 5]) -> Result<Self, ParameterError> {
        let within = |at: usize, most: f64, allowed| {
            require(Self::NAMES[at], values[at], values[at].abs() <= T::from_f64(most), allowed)
        };
        Ok(Self {
            zero_rate: within(0, 1e3, "-1e3 to 1e3 N m/s")?,
            gain_rate: within(1, 10.0, "-10 to 10 1/s")?,
            normal_zero_rate: within(2, 1e4, "-1e4 to 1e4 N/s")?,
            normal_gain_rate: within(3, 10.0, "-10 to 10 1/s")?,
            settling_rate: within(4, 100.0, "-100 to 100 1/s")?,
        })
    }

    /// h(t), s
    #[inline]
    fn shape(&self, time_s: T) -> T {
        let x = self.settling_rate * time_s;
        if x.abs() < T::from_f64(1e-4) {
            time_s * (T::ONE - T::HALF * x)
        } else {
            -(-x).exp_m1() / self.settling_rate
        }
    }

    /// What the friction channel shows of a torque, N·m.
    #[inline]
    pub fn shown_torque_nm(&self, torque_nm: T, time_s: T) -> T {
        let h = self.shape(time_s);
        torque_nm * (T::ONE + self.gain_rate * h) + self.zero_rate * h
    }

    /// The torque behind a shown one, N·m. The gain is kept above [`LEAST_GAIN`].
    #[inline]
    pub fn true_torque_nm(&self, shown_nm: T, time_s: T) -> T {
        let h = self.shape(time_s);
        (shown_nm - self.zero_rate * h) / (T::ONE + self.gain_rate * h).at_least(T::from_f64(LEAST_GAIN))
    }

    /// The normal force behind a measured one, N. The gain is kept above [`LEAST_GAIN`].
    #[inline]
    pub fn true_normal_force_n(&self, measured_n: T, time_s: T) -> T {
        let h = self.shape(time_s);
        let gain = (T::ONE + self.normal_gain_rate * h).at_least(T::from_f64(LEAST_GAIN));
        (measured_n - self.normal_zero_rate * h) / gain
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn zero_and_gain_move_linearly_or_settle() {
        let linear = BridgeDrift::new(&[0.1f64, 0.01, 0.5, 0.02, 0.0]).unwrap();
        assert!((linear.shown_torque_nm(4.0, 10.0) - (4.4 + 1.0)).abs() < 1e-12);
        assert!((linear.true_normal_force_n(125.0, 10.0) - 100.0).abs() < 1e-12);
        let settling = BridgeDrift::new(&[0.1f64, 0.0, 0.0, 0.0, 0.5]).unwrap();
        assert!((settling.shown_torque_nm(0.0, 2.0) - 0.2 * (1.0 - (-1.0f64).exp())).abs() < 1e-12);
    }
}
