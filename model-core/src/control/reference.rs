//! Course of a reference within a segment: constant, ramp or sine, as a function of the ticks since its start.
//!
//! Nothing is accumulated, so nothing drifts: the ramp is from + slope·n, and the phase of the sine is the n-fold of
//! an increment in turns, kept in 64 bit fixed point that wraps at one turn (`fixed`). A frequency is met to 2⁻⁶⁴ turns a
//! tick, which is far below the rounding of its own `f32`.
//!
//! The sine itself is `micromath`'s, with an absolute error of at most 1.2e-3 of the amplitude: of 2.4 N·m that is
//! 3 mN·m, less than one step of the DAC (8 N·m/2048). The demanded course is in the record, so the error costs nothing
//! but the purity of the sine (harmonics below −58 dB).

use super::sequencer::Shape;
use core::f32::consts::TAU;
use core::f64;
use fixed::types::U0F64;
use micromath::F32;

/// A shape with coefficients per tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Course {
    Constant(f32),
    Ramp { from: f32, slope_per_tick: f32, ticks: u32, to: f32 },
    Sine { offset: f32, amplitude: f32, increment: U0F64, phase: U0F64 },
}

/// 2⁻³² of a turn in radians.
const RAD_PER_PHASE: f32 = TAU / 4_294_967_296.0;

/// The part of a number of turns beyond whole turns. In `f64`: this is preparation, and `f32` would cost the
/// frequency its last digits.
fn fraction_of_turn(turns: f64) -> U0F64 {
    let fraction = turns - libm::floor(turns);
    U0F64::from_bits((fraction * 18_446_744_073_709_551_616.0) as u64)
}

impl Course {
    pub(crate) fn new(shape: &Shape, tick_s: f32) -> Self {
        match *shape {
            Shape::Constant { value } => Self::Constant(value),
            Shape::Ramp { from, to, ticks } => {
                Self::Ramp { from, slope_per_tick: (to - from) / ticks.max(1) as f32, ticks, to }
            }
            Shape::Sine { offset, amplitude, angular_frequency_rad_s, phase_rad } => Self::Sine {
                offset,
                amplitude,
                increment: fraction_of_turn(
                    f64::from(angular_frequency_rad_s) * round_tick_s(tick_s) / f64::consts::TAU,
                ),
                phase: fraction_of_turn(f64::from(phase_rad) / f64::consts::TAU),
            },
        }
    }

    /// Value `elapsed` ticks after the start of the segment.
    pub(crate) fn at(&self, elapsed: u32) -> f32 {
        match *self {
            Self::Constant(value) => value,
            Self::Ramp { from, slope_per_tick, ticks, to } => {
                if elapsed >= ticks {
                    to
                } else {
                    from + slope_per_tick * elapsed as f32
                }
            }
            Self::Sine { offset, amplitude, increment, phase } => {
                let turn = phase.wrapping_add(increment.wrapping_mul_int(u64::from(elapsed)));
                // The upper 32 bits, read as −1/2 … 1/2 turn.
                let signed = (turn.to_bits() >> 32) as u32 as i32;
                offset + amplitude * F32(signed as f32 * RAD_PER_PHASE).sin().0
            }
        }
    }
}

/// The control period as the decimal number that its `f32` stands for: 1e-4 and not 0.0000999999974.
fn round_tick_s(tick_s: f32) -> f64 {
    libm::round(f64::from(tick_s) * 1e9) * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    fn course(shape: Shape) -> Course {
        Course::new(&shape, 1e-4)
    }

    #[test]
    fn a_constant_is_constant() {
        let c = course(Shape::Constant { value: -2.5 });
        assert_eq!((c.at(0), c.at(u32::MAX)), (-2.5, -2.5));
    }

    #[test]
    fn a_ramp_goes_straight_and_stays_at_its_end() {
        let c = course(Shape::Ramp { from: 1.0, to: -3.0, ticks: 8 });
        for (n, value) in [(0, 1.0), (1, 0.5), (4, -1.0), (8, -3.0), (9, -3.0), (u32::MAX, -3.0)] {
            assert_eq!(c.at(n), value, "{n}");
        }
        assert_eq!(course(Shape::Ramp { from: 1.0, to: 2.0, ticks: 0 }).at(0), 2.0);
    }

    #[test]
    fn a_sine_has_the_error_of_its_approximation_and_no_more() {
        let c =
            course(Shape::Sine { offset: 0.5, amplitude: 2.0, angular_frequency_rad_s: 2.0, phase_rad: 0.3 });
        let mut worst = 0.0_f64;
        for n in 0..40_000_u32 {
            let expected = 0.5 + 2.0 * (2.0 * f64::from(n) * 1e-4 + 0.3).sin();
            worst = worst.max((f64::from(c.at(n)) - expected).abs());
        }
        assert!(worst < 2.0 * 1.2e-3, "{worst}");
        assert!(worst > 2.0 * 5e-4, "the stated error is what micromath really has: {worst}");
    }

    #[test]
    fn the_phase_of_a_sine_does_not_drift_in_a_day() {
        // 8.64e8 ticks; 50 rad/s goes through 687 549 turns.
        let c = course(Shape::Sine {
            offset: 0.0,
            amplitude: 1.0,
            angular_frequency_rad_s: 50.0,
            phase_rad: 0.0,
        });
        for n in [864_000_000_u32, 864_000_100, 863_999_217] {
            let expected = (50.0 * (f64::from(n) * 1e-4)).sin();
            assert!((f64::from(c.at(n)) - expected).abs() < 1.5e-3, "{n}");
        }
    }

    #[test]
    fn a_phase_may_be_negative_or_beyond_a_turn() {
        for phase in [-1.0_f32, 1.0, 7.0, -20.0] {
            let c = course(Shape::Sine {
                offset: 0.0,
                amplitude: 1.0,
                angular_frequency_rad_s: 0.0,
                phase_rad: phase,
            });
            assert!((f64::from(c.at(7)) - f64::from(phase).sin()).abs() < 1.5e-3, "{phase}");
        }
    }
}
