//! The order of a sensor's stages, there and back.
//!
//! | stage | what it is | y of u |
//! |---|---|---|
//! | mode | the part that carries the gauges gives way and swings | ÿ + 2ζω ẏ + ω² y = ω² u |
//! | amplifier | gain, zero, their drift, and what the gauges pick up beside (crosstalk) | y = g(t) u + z(t) |
//! | low-pass | the amplifier's filter, a Butterworth of second order | as the mode, ζ = 1/√2 |
//! | delay | the converter's and the line's | y(t) = u(t − d) |
//! | clip | where the range of amplifier and converter ends | y = min(max(u, low), high) |
//!
//! It is the order in which a signal meets the parts of the rig: a gauge sits on the part that swings, so that crosstalk and
//! drift are neither shaken by the mode nor early by the delay, and nothing that comes after can bring back what was clipped.
//! What two stages do commutes where both are linear and do not change with time; gain and zero that drift, and clipping, do not.
//!
//! A stage that a caller leaves out passes its signal on. One that has its memory in a part of the chain (steps between samples)
//! may run the chain in two parts, each a [`SensorChain`], the stages of the first before those of the second.

/// What a sensor shows of what acts on it.
pub trait SensorChain {
    /// A sample, or a series of them.
    type Signal;

    /// The mode of the part that carries the gauges.
    #[inline(always)]
    fn mode(&mut self, input: Self::Signal) -> Self::Signal {
        input
    }

    /// Gain and zero with their drift, and crosstalk.
    #[inline(always)]
    fn amplifier(&mut self, input: Self::Signal) -> Self::Signal {
        input
    }

    /// The amplifier's low-pass.
    #[inline(always)]
    fn low_pass(&mut self, input: Self::Signal) -> Self::Signal {
        input
    }

    /// A pure delay.
    #[inline(always)]
    fn delay(&mut self, input: Self::Signal) -> Self::Signal {
        input
    }

    /// The ends of the range.
    #[inline(always)]
    fn clip(&mut self, input: Self::Signal) -> Self::Signal {
        input
    }

    /// All stages in their order.
    #[inline(always)]
    fn show(&mut self, input: Self::Signal) -> Self::Signal {
        let strain = self.mode(input);
        let amplified = self.amplifier(strain);
        let passed = self.low_pass(amplified);
        let late = self.delay(passed);
        self.clip(late)
    }
}

/// What acted on a sensor, from what it shows.
///
/// A stage that is left out passes its signal on: right for a signal that stands still, where all but the amplifier have a gain of
/// one, and for what nothing brings back.
pub trait SensorUndo {
    /// A sample, or a series of them.
    type Signal;

    /// What the range ended for.
    #[inline(always)]
    fn before_clip(&mut self, shown: Self::Signal) -> Self::Signal {
        shown
    }

    /// What was delayed.
    #[inline(always)]
    fn before_delay(&mut self, shown: Self::Signal) -> Self::Signal {
        shown
    }

    /// What the low-pass was given.
    #[inline(always)]
    fn before_low_pass(&mut self, shown: Self::Signal) -> Self::Signal {
        shown
    }

    /// Without gain, zero and crosstalk.
    #[inline(always)]
    fn before_amplifier(&mut self, shown: Self::Signal) -> Self::Signal {
        shown
    }

    /// What made the mode swing.
    #[inline(always)]
    fn before_mode(&mut self, shown: Self::Signal) -> Self::Signal {
        shown
    }

    /// All stages, the last first.
    #[inline(always)]
    fn undo(&mut self, shown: Self::Signal) -> Self::Signal {
        let late = self.before_clip(shown);
        let passed = self.before_delay(late);
        let amplified = self.before_low_pass(passed);
        let strain = self.before_amplifier(amplified);
        self.before_mode(strain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Stages of which no two commute: a delay by a sample, a gain that grows, a clip, and modes that double or square.
    struct Odd {
        last: f64,
        time: f64,
    }

    impl SensorChain for Odd {
        type Signal = f64;

        fn mode(&mut self, input: f64) -> f64 {
            input * input
        }
        fn amplifier(&mut self, input: f64) -> f64 {
            input * (1.0 + self.time) + 0.5
        }
        fn low_pass(&mut self, input: f64) -> f64 {
            input.sqrt()
        }
        fn delay(&mut self, input: f64) -> f64 {
            core::mem::replace(&mut self.last, input)
        }
        fn clip(&mut self, input: f64) -> f64 {
            input.min(2.5)
        }
    }

    impl SensorUndo for Odd {
        type Signal = f64;

        fn before_low_pass(&mut self, shown: f64) -> f64 {
            shown * shown
        }
        fn before_amplifier(&mut self, shown: f64) -> f64 {
            (shown - 0.5) / (1.0 + self.time)
        }
        fn before_mode(&mut self, shown: f64) -> f64 {
            shown.sqrt()
        }
    }

    #[test]
    fn the_order_is_mode_amplifier_low_pass_delay_clip() {
        let mut chain = Odd { last: 0.0, time: 0.0 };
        let mut shown = std::vec::Vec::new();
        for time in 0..4 {
            chain.time = f64::from(time);
            shown.push(chain.show(chain.time));
        }
        // √(t² (1 + t) + ½), a sample late, at most 2.5.
        let expected = [0.0, 0.5f64.sqrt(), 2.5f64.sqrt(), 2.5];
        assert!(shown.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15), "{shown:?}");
    }

    #[test]
    fn what_is_shown_is_undone_in_the_opposite_order() {
        let mut chain = Odd { last: 0.0, time: 2.0 };
        chain.show(0.7);
        let late = chain.last;
        assert!((chain.undo(late) - 0.7).abs() < 1e-15);
    }
}
