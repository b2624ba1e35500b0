//! The friction channel as a sensor, with the effects of a model that act on it.

use super::friction_delay::Past;
use super::set::Extensions;
use crate::real::Real;
use crate::sensor::{SecondOrderState, SensorChain, SensorUndo};

/// What the channel remembers.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub(super) struct ChannelState<T> {
    ring: SecondOrderState<T>,
    past: Past<T>,
}

impl<T: Real> ChannelState<T> {
    /// Of a channel that has always shown `shown_nm` of this torque.
    pub(super) fn holding(torque_nm: T, shown_nm: T) -> Self {
        Self { ring: SecondOrderState::holding(torque_nm), past: Past::holding(shown_nm) }
    }
}

/// The channel at one instant, while it moves; its low-pass is the rig's or none.
pub(super) struct Moving<'a, T, L> {
    pub(super) effects: &'a Extensions<T>,
    pub(super) state: &'a mut ChannelState<T>,
    pub(super) time_s: T,
    pub(super) normal_force_n: T,
    pub(super) low_pass: L,
}

impl<T: Real, L: FnMut(T) -> T> SensorChain for Moving<'_, T, L> {
    type Signal = T;

    #[inline(always)]
    fn mode(&mut self, torque_nm: T) -> T {
        match &self.effects.ring_resonance {
            Some(ring) => ring.advance(&mut self.state.ring, torque_nm),
            None => torque_nm,
        }
    }

    #[inline(always)]
    fn amplifier(&mut self, torque_nm: T) -> T {
        let mut shown = torque_nm;
        if let Some(drift) = &self.effects.bridge_drift {
            shown = drift.shown_torque_nm(shown, self.time_s);
        }
        if let Some(crosstalk) = &self.effects.bridge_crosstalk {
            shown += crosstalk.torque_nm(self.normal_force_n);
        }
        shown
    }

    #[inline(always)]
    fn low_pass(&mut self, torque_nm: T) -> T {
        (self.low_pass)(torque_nm)
    }

    #[inline(always)]
    fn delay(&mut self, torque_nm: T) -> T {
        match &self.effects.friction_delay {
            Some(delay) => delay.advance(&mut self.state.past, torque_nm),
            None => torque_nm,
        }
    }

    #[inline(always)]
    fn clip(&mut self, torque_nm: T) -> T {
        match &self.effects.adc_saturation {
            Some(saturation) => saturation.shown_nm(torque_nm),
            None => torque_nm,
        }
    }
}

/// The channel at rest: ring, low-pass and delay show what they are given, and what was clipped is not known.
pub(super) struct AtRest<'a, T> {
    pub(super) effects: &'a Extensions<T>,
    pub(super) time_s: T,
    pub(super) normal_force_n: T,
}

impl<T: Real> SensorUndo for AtRest<'_, T> {
    type Signal = T;

    #[inline]
    fn before_amplifier(&mut self, shown_nm: T) -> T {
        let mut torque_nm = shown_nm;
        if let Some(crosstalk) = &self.effects.bridge_crosstalk {
            torque_nm -= crosstalk.torque_nm(self.normal_force_n);
        }
        if let Some(drift) = &self.effects.bridge_drift {
            torque_nm = drift.true_torque_nm(torque_nm, self.time_s);
        }
        torque_nm
    }
}

#[cfg(test)]
mod tests {
    use super::super::set::Extension;
    use super::*;
    use std::vec::Vec;

    const STEP_S: f64 = 1e-3;

    /// What a channel with these effects shows of a torque and a load, sample by sample; `low_pass` too.
    fn shown(
        effects: &[(Extension, &[f64])],
        acting: impl Fn(f64) -> (f64, f64),
        mut low_pass: impl FnMut(f64) -> f64,
    ) -> Vec<f64> {
        let mut set = Extensions::none(STEP_S);
        for (effect, values) in effects {
            set.set(*effect, values).unwrap();
        }
        let mut state = ChannelState::holding(0.0, 0.0);
        let sample = |k: u32| {
            let time_s = f64::from(k) * STEP_S;
            let (torque_nm, normal_force_n) = acting(time_s);
            let (effects, state) = (&set, &mut state);
            Moving { effects, state, time_s, normal_force_n, low_pass: &mut low_pass }.show(torque_nm)
        };
        (0..1000).map(sample).collect()
    }

    const DRIFT: (Extension, &[f64]) = (Extension::BridgeDrift, &[0.5, 0.1, 0.0, 0.0, 0.0]);
    const CROSSTALK: (Extension, &[f64]) = (Extension::BridgeCrosstalk, &[0.02, 0.0]);
    const DELAY: (Extension, &[f64]) = (Extension::FrictionDelay, &[0.1]);

    #[test]
    fn drift_and_crosstalk_are_delayed_with_the_torque_that_they_are_added_to() {
        let acting = |t: f64| (3.0 * t, 80.0 + 40.0 * t);
        for (k, shown) in shown(&[DRIFT, CROSSTALK, DELAY], acting, |x| x).iter().enumerate().skip(150) {
            let t = k as f64 * STEP_S - 0.1;
            let (torque_nm, load_n) = acting(t);
            let expected = torque_nm * (1.0 + 0.1 * t) + 0.5 * t + 0.02 * load_n;
            assert!((shown - expected).abs() < 1e-12, "{k}: {shown} {expected}");
        }
    }

    #[test]
    fn crosstalk_does_not_shake_the_ring_and_passes_the_low_pass() {
        let ring: (Extension, &[f64]) = (Extension::RingResonance, &[30.0, 0.05]);
        // The load jumps, the torque does not.
        let acting = |t: f64| (1.0, if t < 0.5 { 0.0 } else { 50.0 });
        let mut last = 0.0;
        let lag = |x: f64| {
            last += 0.1 * (x - last);
            last
        };
        let shown = shown(&[ring, CROSSTALK], acting, lag);
        let jump = shown[500] - shown[499];
        assert!((jump - 0.1).abs() < 1e-3, "a tenth of 1 N m in the first sample: {jump}");
        assert!(shown[500..].windows(2).all(|w| w[1] > w[0] - 1e-3), "no swing");
    }

    #[test]
    fn nothing_brings_back_what_was_clipped_and_the_low_pass_has_seen_it() {
        let clip: (Extension, &[f64]) = (Extension::AdcSaturation, &[-1.0, 1.0]);
        let mut seen = 0.0f64;
        let notice = |x: f64| {
            seen = seen.max(x);
            x
        };
        let shown = shown(&[DRIFT, DELAY, clip], |t| (5.0 * t, 0.0), notice);
        assert!(shown.iter().all(|x| *x <= 1.0) && shown[999] == 1.0);
        assert!(seen > 5.0, "{seen}");
    }

    #[test]
    fn at_rest_the_amplifier_is_all_that_is_undone() {
        let mut effects = Extensions::none(STEP_S);
        for (effect, values) in [DRIFT, CROSSTALK, DELAY] {
            effects.set(effect, values).unwrap();
        }
        let shown_nm = 2.0 * 1.3 + 1.5 + 0.02 * 80.0;
        let torque_nm = AtRest { effects: &effects, time_s: 3.0, normal_force_n: 80.0 }.undo(shown_nm);
        assert!((torque_nm - 2.0).abs() < 1e-12);
    }
}
