//! PI controller with feed-forward, output limits and a slew limit.
//!
//! u = feed-forward + Kp·e + I, limited to [low, high] and to a change of `slew` per tick;  I ← I + Ki·Δt·e.
//!
//! Anti-windup is conditional integration: I stands still while the output is held back and the error would push
//! it further out. It was chosen over back-calculation because it has no time constant to tune, recovers in the tick
//! in which the error turns, and does not let noise of the error pull I away from its value at the edge of the limits
//! (which back-calculation does, through Kp). A change of feed-forward never changes I.
//!
//! Left out: derivative action (the plants here are of first order after their drive's lag) and weighting of the
//! set point (references are slew limited and fed forward instead).

/// Gains and slew limit per tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Pi {
    /// Proportional gain, output per error.
    pub(crate) kp: f32,
    /// Integral gain times the control period.
    pub(crate) ki_per_tick: f32,
    /// Largest change of the output in one tick.
    pub(crate) slew_per_tick: f32,
}

/// What the controller remembers.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(crate) struct PiState {
    integral: f32,
    output: f32,
}

/// Limits of the output in this tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Span {
    pub(crate) low: f32,
    pub(crate) high: f32,
}

/// Output of one tick and what held it back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PiOutput {
    pub(crate) value: f32,
    pub(crate) saturated: bool,
    pub(crate) slewing: bool,
}

impl Span {
    pub(crate) const fn symmetric(limit: f32) -> Self {
        Self { low: -limit, high: limit }
    }

    /// The nearest value inside. Not a number stays what it is: the tick finds it and makes safe, where a limit
    /// would turn it into full torque.
    pub(crate) fn hold(self, value: f32) -> f32 {
        if value > self.high {
            self.high
        } else if value < self.low {
            self.low
        } else {
            value
        }
    }
}

/// `value`, but no further from `last` than `most`.
pub(crate) fn slew(last: f32, value: f32, most: f32) -> f32 {
    Span { low: last - most, high: last + most }.hold(value)
}

impl Pi {
    /// One tick.
    pub(crate) fn step(&self, state: &mut PiState, error: f32, feed_forward: f32, span: Span) -> PiOutput {
        let wanted = feed_forward + self.kp * error + state.integral;
        let held = span.hold(wanted);
        let value = slew(state.output, held, self.slew_per_tick);
        let excess = wanted - value;
        if excess * error <= 0.0 {
            state.integral += self.ki_per_tick * error;
        }
        state.output = value;
        PiOutput { value, saturated: held != wanted, slewing: value != held }
    }
}

impl PiState {
    /// The state that goes on from `output` without a bump, where `feed_forward` is already part of it and there
    /// is no error.
    pub(crate) fn taking_over(output: f32, feed_forward: f32) -> Self {
        Self { integral: output - feed_forward, output }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TICK_S: f64 = 1e-4;
    const WIDE: Span = Span::symmetric(1e6);

    /// y' = (u − y)/T, exact over a tick with u held.
    struct Lag {
        y: f64,
        keep: f64,
    }

    impl Lag {
        fn new(time_s: f64) -> Self {
            Self { y: 0.0, keep: (-TICK_S / time_s).exp() }
        }
        fn step(&mut self, u: f32) {
            self.y = self.keep * self.y + (1.0 - self.keep) * f64::from(u);
        }
    }

    fn pi(kp: f64, ki: f64) -> Pi {
        Pi { kp: kp as f32, ki_per_tick: (ki * TICK_S) as f32, slew_per_tick: f32::MAX }
    }

    #[test]
    fn a_first_order_plant_answers_a_step_as_the_closed_form_says() {
        // Kp = T·ω, Ki = ω cancel the plant's pole: the loop is ω/s and the answer 1 − e^{−ωt}.
        let (time_s, omega) = (0.01, 100.0);
        let controller = pi(time_s * omega, omega);
        let (mut state, mut plant) = (PiState::default(), Lag::new(time_s));
        let mut worst = 0.0_f64;
        for k in 0..1000 {
            worst = worst.max((plant.y - (1.0 - (-omega * k as f64 * TICK_S).exp())).abs());
            let u = controller.step(&mut state, (1.0 - plant.y) as f32, 0.0, WIDE);
            plant.step(u.value);
        }
        // Sampling delays the loop by half a tick: ω·Δt/2 = 0.005, times the largest of x·e^{−x} = 0.37.
        assert!(worst < 0.003, "{worst}");
        assert!((plant.y - 1.0).abs() < 1e-4, "the error left is e^-10 = 4.5e-5: {}", plant.y);
    }

    #[test]
    fn a_second_order_loop_overshoots_as_its_damping_ratio_says() {
        // Integrating plant y' = u with Kp = 2ζω, Ki = ω²: closed loop (2ζω s + ω²)/(s² + 2ζω s + ω²).
        // For ζ = 1 its step answer is 1 + (ωt − 1)e^{−ωt}, with the peak 1 + e^{−2} at ωt = 2.
        let omega = 50.0;
        let controller = pi(2.0 * omega, omega * omega);
        let (mut state, mut y, mut worst, mut peak) = (PiState::default(), 0.0, 0.0_f64, 0.0_f64);
        for k in 0..4000 {
            let x = omega * k as f64 * TICK_S;
            worst = worst.max((y - (1.0 + (x - 1.0) * (-x).exp())).abs());
            peak = peak.max(y);
            y += TICK_S * f64::from(controller.step(&mut state, (1.0 - y) as f32, 0.0, WIDE).value);
        }
        // ω·Δt = 0.005 and the crossover is near 2ω: the half tick of delay shifts the answer by ≤ 2 · 0.005.
        assert!(worst < 0.01, "{worst}");
        assert!((peak - 1.0 - (-2.0_f64).exp()).abs() < 0.005, "{peak}");
    }

    #[test]
    fn saturation_does_not_wind_up_the_integral() {
        let controller = pi(1.0, 100.0);
        let (mut state, mut plant) = (PiState::default(), Lag::new(0.01));
        let span = Span::symmetric(0.5);
        for _ in 0..10_000 {
            let u = controller.step(&mut state, (1.0 - plant.y) as f32, 0.0, span);
            assert!(u.value <= 0.5);
            plant.step(u.value);
        }
        // One second out of reach. When the set point comes back the output leaves its limit in the same tick.
        let u = controller.step(&mut state, (0.2 - plant.y) as f32, 0.0, span);
        assert!(u.value < 0.5 && !u.saturated, "{u:?}");
    }

    #[test]
    fn the_integral_of_a_saturated_output_still_follows_an_error_that_leads_back() {
        let controller = pi(0.0, 100.0);
        let mut state = PiState::default();
        let span = Span::symmetric(0.5);
        for _ in 0..200 {
            controller.step(&mut state, 1.0, 0.0, span);
        }
        // Ki·Δt = 0.01 an error of one: 51 ticks to the limit, no more, so one tick leads back.
        assert!(state.integral < 0.52, "{state:?}");
        for _ in 0..3 {
            controller.step(&mut state, -1.0, 0.0, span);
        }
        assert!(controller.step(&mut state, -1.0, 0.0, span).value < 0.5);
    }

    #[test]
    fn the_output_changes_no_faster_than_the_slew_limit() {
        let controller = Pi { slew_per_tick: 0.1, ..pi(1.0, 0.0) };
        let mut state = PiState::default();
        for k in 1..=10 {
            let u = controller.step(&mut state, 1.0, 0.0, WIDE);
            assert!((u.value - 0.1 * k as f32).abs() < 1e-6, "{u:?}");
            assert_eq!(u.slewing, k < 10, "{k}");
        }
    }

    #[test]
    fn taking_over_makes_no_bump() {
        let controller = pi(2.0, 10.0);
        let mut state = PiState::taking_over(3.25, 1.0);
        let u = controller.step(&mut state, 0.0, 1.0, WIDE);
        assert!((u.value - 3.25).abs() < 1e-6, "{u:?}");
    }

    #[test]
    fn the_feed_forward_passes_through_at_once() {
        let controller = pi(2.0, 10.0);
        let mut state = PiState::default();
        assert_eq!(controller.step(&mut state, 0.0, 1.5, WIDE).value, 1.5);
        assert_eq!(state.integral, 0.0);
    }

    #[test]
    fn not_a_number_is_not_hidden_by_a_limit() {
        assert!(Span::symmetric(2.0).hold(f32::NAN).is_nan());
        assert!(slew(1.0, f32::NAN, 0.1).is_nan());
    }
}
