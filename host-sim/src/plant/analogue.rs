//! From physical quantities to pin voltages and converter codes.
//!
//! 16 bit over 0 … 3.3 V: code = ⌊V/3.3 · 65536 + ½⌋, held to 0 … 65535. Amplifiers clip before the converter's
//! range ends (assumed 1 % at either end); see the thresholds in the core's settings. Noise is added in front of
//! the clipping.

use super::noise::Noise;
use super::parameters::{AnalogueParameters, NoiseParameters};
use model_core::control::AdcScan;
use model_core::sensor::SensorChain;

/// Voltages of the five analogue inputs, in the order of the converter's scan.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PinVoltages {
    /// Amplifier of the friction bridge.
    pub friction_bridge_v: f64,
    /// Amplifier of the normal force bridge.
    pub normal_bridge_v: f64,
    /// Torque monitor of M1.
    pub m1_torque_v: f64,
    /// Torque monitor of M2.
    pub m2_torque_v: f64,
    /// Supply after its divider.
    pub supply_v: f64,
}

/// What the inputs are made of.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct Quantities {
    pub(crate) friction_nm: f64,
    pub(crate) normal_n: f64,
    pub(crate) m1_torque_nm: f64,
    pub(crate) m2_torque_nm: f64,
}

/// Gains from quantity to pin voltage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Analogue {
    middle_v: f64,
    friction_v_per_nm: f64,
    normal_zero_v: f64,
    normal_v_per_n: f64,
    monitor_v_per_nm: f64,
    supply_pin_v: f64,
    clip_low_v: f64,
    clip_high_v: f64,
    codes_per_v: f64,
    noise: [f64; 5],
}

impl Analogue {
    pub(crate) fn new(p: &AnalogueParameters, noise: &NoiseParameters) -> Self {
        let range = p.reference_v;
        let normal_v_per_n = range / (p.normal_high_n - p.normal_low_n);
        let friction_v_per_nm = 0.5 * range / p.friction_full_scale_nm;
        let monitor_v_per_nm = 0.5 * range / p.monitor_full_scale_nm;
        Self {
            middle_v: 0.5 * range,
            friction_v_per_nm,
            normal_zero_v: -p.normal_low_n * normal_v_per_n,
            normal_v_per_n,
            monitor_v_per_nm,
            supply_pin_v: p.supply_v / p.supply_divider,
            clip_low_v: p.clip_share * range,
            clip_high_v: (1.0 - p.clip_share) * range,
            codes_per_v: 65536.0 / range,
            noise: [
                noise.friction_nm * friction_v_per_nm,
                noise.normal_n * normal_v_per_n,
                noise.torque_nm * monitor_v_per_nm,
                noise.torque_nm * monitor_v_per_nm,
                noise.supply_v / p.supply_divider,
            ],
        }
    }

    #[inline]
    pub(crate) fn pins(&self, q: &Quantities, noise: &mut Noise) -> PinVoltages {
        let ends_v = (self.clip_low_v, self.clip_high_v);
        let n = noise.draw(&self.noise);
        let pin = |zero_v, gain, noise_v| Pin { zero_v, gain, noise_v, ends_v };
        PinVoltages {
            friction_bridge_v: pin(self.middle_v, self.friction_v_per_nm, n[0]).show(q.friction_nm),
            normal_bridge_v: pin(self.normal_zero_v, self.normal_v_per_n, n[1]).show(q.normal_n),
            m1_torque_v: pin(self.middle_v, self.monitor_v_per_nm, n[2]).show(q.m1_torque_nm),
            m2_torque_v: pin(self.middle_v, self.monitor_v_per_nm, n[3]).show(q.m2_torque_nm),
            supply_v: pin(self.supply_pin_v, 0.0, n[4]).show(0.0),
        }
    }

    #[inline]
    pub(crate) fn codes(&self, pins: &PinVoltages) -> AdcScan {
        // The cast saturates at both ends.
        #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
        let code = |v: f64| (v * self.codes_per_v + 0.5) as u16;
        AdcScan {
            friction_bridge: code(pins.friction_bridge_v),
            normal_bridge: code(pins.normal_bridge_v),
            m1_torque: code(pins.m1_torque_v),
            m2_torque: code(pins.m2_torque_v),
            supply: code(pins.supply_v),
        }
    }
}

/// The part of a sensor that acts on a sample, V: behind a [`super::bridge`] its amplifier, in front of the converter.
struct Pin {
    zero_v: f64,
    /// V per unit of the quantity.
    gain: f64,
    noise_v: f64,
    ends_v: (f64, f64),
}

impl SensorChain for Pin {
    type Signal = f64;

    #[inline]
    fn amplifier(&mut self, quantity: f64) -> f64 {
        self.zero_v + self.gain * quantity + self.noise_v
    }

    #[inline]
    fn clip(&mut self, volts: f64) -> f64 {
        volts.clamp(self.ends_v.0, self.ends_v.1)
    }
}

#[cfg(test)]
mod tests {
    use super::super::parameters::PlantParameters;
    use super::*;

    fn quiet() -> Analogue {
        Analogue::new(&PlantParameters::default().analogue, &NoiseParameters::none())
    }

    #[test]
    fn zero_is_where_the_settings_of_the_core_expect_it_and_signs_are_kept() {
        let analogue = quiet();
        let mut noise = Noise::new(1);
        let scan = |q: Quantities, noise: &mut Noise| analogue.codes(&analogue.pins(&q, noise));
        let zero = scan(Quantities::default(), &mut noise);
        assert_eq!((zero.friction_bridge, zero.m1_torque, zero.m2_torque), (32768, 32768, 32768));
        // 20/240 of the range; 24 V through 1:11.
        assert_eq!((zero.normal_bridge, zero.supply), (5461, 43330));
        let q = Quantities { friction_nm: 6.0, normal_n: 100.0, m1_torque_nm: -5.0, m2_torque_nm: 5.0 };
        let some = scan(q, &mut noise);
        assert_eq!(
            (some.friction_bridge, some.normal_bridge, some.m1_torque, some.m2_torque),
            (49152, 32768, 16384, 49152)
        );
    }

    #[test]
    fn amplifiers_clip_inside_the_range_of_the_converter() {
        let analogue = quiet();
        let mut noise = Noise::new(1);
        let q = Quantities { friction_nm: 50.0, normal_n: -300.0, m1_torque_nm: 0.0, m2_torque_nm: 0.0 };
        let scan = analogue.codes(&analogue.pins(&q, &mut noise));
        assert_eq!((scan.friction_bridge, scan.normal_bridge), (64881, 655));
    }
}
