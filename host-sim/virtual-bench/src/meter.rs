//! Measures the control tick: instructions, start, end.
//!
//! A tick opens at the first instruction of the interrupt handler that runs it and closes with the write that
//! takes the tick pulse down. So the handler's prologue counts, its epilogue (some ten instructions) and
//! the core's own stacking do not; whatever interrupts the tick in between counts. TIM6's interrupt, which
//! only looks after the period, raises no pulse and is no tick.
//!
//! Instructions are exact. The instants are those of the emulator's constant rate: good for order and for
//! deadlines at that rate, not for microseconds on the chip.

use serde::Serialize;

/// A series of values: how many, their mean, least and largest, and a hash over all of them in order.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Series {
    /// How many.
    pub count: u64,
    sum: u64,
    /// The least.
    pub min: u64,
    /// The largest.
    pub max: u64,
    /// FNV-1a over the values.
    pub hash: u64,
}

impl Default for Series {
    fn default() -> Self {
        Self { count: 0, sum: 0, min: u64::MAX, max: 0, hash: 0xCBF2_9CE4_8422_2325 }
    }
}

impl Series {
    /// Takes one value.
    pub fn add(&mut self, value: u64) {
        self.count += 1;
        self.sum += value;
        self.min = self.min.min(value);
        self.max = self.max.max(value);
        for byte in value.to_le_bytes() {
            self.hash = (self.hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01B3);
        }
    }

    /// The mean; 0 of nothing.
    #[must_use]
    pub fn mean(&self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum as f64 / self.count as f64 }
    }
}

/// An instruction count and an instant.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Moment {
    /// Instructions retired so far.
    pub instructions: u64,
    /// Virtual time, ns.
    pub nanos: u64,
}

/// What was measured so far.
#[derive(Debug, Clone, Default, PartialEq, Eq, Serialize)]
pub struct Ticks {
    /// Instructions a tick.
    pub instructions: Series,
    /// From the scan's trigger to the tick's first instruction, ns.
    pub start_after_trigger_ns: Series,
    /// From the scan's trigger to the tick's end, ns.
    pub end_after_trigger_ns: Series,
    /// Ticks that ended after the next trigger.
    pub late: u64,
}

/// Follows the ticks.
#[derive(Debug, Clone, Default)]
pub struct Meter {
    ticks: Ticks,
    entered: Option<Moment>,
    /// The handler raised the pulse: it is a tick.
    pulsed: bool,
    measuring: bool,
}

impl Meter {
    /// Begins to measure, from nothing, with the next tick.
    pub fn begin(&mut self) {
        *self = Self { measuring: true, ..Self::default() };
    }

    /// Stops measuring, and gives what was measured.
    pub fn end(&mut self) -> Ticks {
        self.measuring = false;
        std::mem::take(&mut self.ticks)
    }

    /// The core is at the first instruction of a tick handler.
    pub fn handler_entered(&mut self, at: Moment) {
        self.entered = Some(at);
        self.pulsed = false;
    }

    /// The tick pulse went up.
    pub fn pulse_up(&mut self) {
        self.pulsed = true;
    }

    /// The tick pulse went down; the scan's last trigger was at `trigger`, its period is `period` ns.
    /// Says whether a tick ended.
    pub fn pulse_down(&mut self, at: Moment, trigger: Option<u64>, period: u64) -> bool {
        let Some(entered) = self.entered.take().filter(|_| self.pulsed) else { return false };
        if !self.measuring {
            return true;
        }
        self.ticks.instructions.add(at.instructions - entered.instructions);
        if let Some(trigger) = trigger {
            // The tick's own trigger is the last one before it began.
            let own = if trigger > entered.nanos { trigger - period } else { trigger };
            self.ticks.start_after_trigger_ns.add(entered.nanos - own);
            self.ticks.end_after_trigger_ns.add(at.nanos - own);
            self.ticks.late += u64::from(at.nanos - own >= period);
        }
        true
    }

    /// The part was reset: a tick that was open ended nowhere.
    pub fn restarted(&mut self) {
        self.entered = None;
        self.pulsed = false;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moment(instructions: u64, nanos: u64) -> Moment {
        Moment { instructions, nanos }
    }

    #[test]
    fn a_tick_counts_from_its_handlers_first_instruction_to_the_end_of_the_pulse() {
        let mut meter = Meter::default();
        meter.begin();
        for n in 0..3_u64 {
            meter.handler_entered(moment(1000 * n, 100_000 * n + 4_000));
            meter.pulse_up();
            assert!(meter.pulse_down(
                moment(1000 * n + 500 + n, 100_000 * n + 20_000),
                Some(100_000 * n),
                100_000
            ));
        }
        let ticks = meter.end();
        assert_eq!(
            (ticks.instructions.min, ticks.instructions.max, ticks.instructions.mean()),
            (500, 502, 501.0)
        );
        assert_eq!((ticks.start_after_trigger_ns.min, ticks.start_after_trigger_ns.max), (4_000, 4_000));
        assert_eq!((ticks.end_after_trigger_ns.max, ticks.late), (20_000, 0));
    }

    #[test]
    fn a_handler_that_raises_no_pulse_is_no_tick() {
        let mut meter = Meter::default();
        meter.begin();
        meter.handler_entered(moment(0, 0));
        meter.handler_entered(moment(100, 100));
        meter.pulse_up();
        assert!(meter.pulse_down(moment(150, 200), None, 100_000));
        assert!(!meter.pulse_down(moment(160, 300), None, 100_000));
        assert_eq!(meter.end().instructions.max, 50);
    }

    #[test]
    fn a_tick_that_ends_after_the_next_trigger_is_late() {
        let mut meter = Meter::default();
        meter.begin();
        meter.handler_entered(moment(0, 4_000));
        meter.pulse_up();
        meter.pulse_down(moment(30_000, 129_000), Some(100_000), 100_000);
        let ticks = meter.end();
        assert_eq!(
            (ticks.late, ticks.end_after_trigger_ns.max, ticks.start_after_trigger_ns.max),
            (1, 129_000, 4_000)
        );
    }

    #[test]
    fn the_hash_depends_on_every_value_and_on_their_order() {
        let hash = |values: &[u64]| {
            let mut series = Series::default();
            values.iter().for_each(|value| series.add(*value));
            series.hash
        };
        assert_ne!(hash(&[1, 2, 3]), hash(&[1, 3, 2]));
        assert_ne!(hash(&[1, 2, 3]), hash(&[1, 2, 4]));
        assert_eq!(hash(&[1, 2, 3]), hash(&[1, 2, 3]));
    }
}
