//! A general-purpose timer in encoder mode whose two inputs are fed from a queue of edges.
//!
//! The counting is the emulator's (RM0433 section 39.3.18); here is only what comes down the wires. The plant
//! knows the edges of the coming control period; they are applied, in order, before the firmware's next
//! access to the timer, and before each of the timer's own events. Between two accesses nothing can tell
//! an edge from its instant, as no capture, trigger or interrupt hangs on these inputs.
//!
//! A line can be stuck: its level stays, and the encoder behind it turns on.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32h743::peripherals::tim::{Channel, General, Tim, Timer};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

type Register = <Tim<General> as Device>::Register;

/// One of the two lines of an encoder.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Line {
    /// Leads for positive rotation.
    A,
    /// Lags for positive rotation.
    B,
}

/// The levels of A and B after `count` counts: A leads, so it rises first.
#[must_use]
pub const fn quadrature(count: i64) -> [bool; 2] {
    let quarter = count & 0b11;
    [quarter == 1 || quarter == 2, quarter >= 2]
}

/// The encoder has gone to `count` at `at`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Edge {
    /// When.
    pub at: VirtualNanos,
    /// Where it is then, in counts.
    pub count: i64,
}

/// The timer of one encoder.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(deserialize = "'de: 'static"))]
pub struct EncoderTimer {
    timer: Tim<General>,
    edges: VecDeque<Edge>,
    /// Levels the encoder drives.
    lines: [bool; 2],
    /// Levels the timer's inputs were last given.
    driven: [Option<bool>; 2],
    stuck: [Option<bool>; 2],
}

impl EncoderTimer {
    pub(super) fn new(timer: Timer) -> Self {
        Self {
            timer: Tim::new(timer),
            edges: VecDeque::new(),
            lines: [false; 2],
            driven: [None; 2],
            stuck: [None; 2],
        }
    }

    /// Adds an edge; edges are given in the order of time.
    pub fn push(&mut self, edge: Edge) {
        self.edges.push_back(edge);
    }

    /// Holds `line` at `level` whatever the encoder does, or lets it go with `None`.
    pub fn stick(&mut self, line: Line, level: Option<bool>) {
        self.stuck[line as usize] = level;
    }

    /// The level of `line` as the timer sees it.
    #[must_use]
    pub fn level(&self, line: Line) -> bool {
        self.stuck[line as usize].unwrap_or(self.lines[line as usize])
    }

    fn catch_up(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.drive(registers, context);
        while let Some(&edge) = self.edges.front() {
            if edge.at > context.now() {
                break;
            }
            self.edges.pop_front();
            self.lines = quadrature(edge.count);
            self.drive(registers, context);
        }
    }

    fn drive(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        for (line, number) in [(Line::A, 1), (Line::B, 2)] {
            let level = self.level(line);
            if self.driven[line as usize] == Some(level) {
                continue;
            }
            self.driven[line as usize] = Some(level);
            if let Some(channel) = Channel::new(number) {
                self.timer.drive_input(channel, Level::from(level), registers, context);
            }
        }
    }
}

impl Device for EncoderTimer {
    type Register = Register;

    fn layout(&self) -> &'static [RegisterSpec] {
        self.timer.layout()
    }

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        self.catch_up(registers, context);
        self.timer.read(register, registers, context)
    }

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        self.timer.peek(register, registers, now)
    }

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.catch_up(registers, context);
        self.timer.write(register, value, registers, context);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.catch_up(registers, context);
        self.timer.on_event(event, registers, context);
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.timer.on_request(change, registers, context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.on_clock(hz, registers, context);
    }

    /// The encoder is outside the part: its edges stay, and the timer keeps the levels at its inputs.
    fn reset(&mut self) {
        self.timer.reset();
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.reset_line(registers, context);
    }
}

#[cfg(test)]
mod tests {
    use super::super::Motor;
    use super::super::testing::Bench;
    use super::*;
    use rigless::soc::stm32h743::generated::{TIM2, TIM4};

    /// Encoder mode 3 (both edges of both inputs), full range, counter on.
    fn counting() -> Bench {
        let mut bench = Bench::new();
        for (base, top) in [(TIM2.base, 0xFFFF_FFFF), (TIM4.base, 0xFFFF)] {
            bench.write(base + 0x18, 0b01 | 0b01 << 8);
            bench.write(base + 0x08, 0b011);
            bench.write(base + 0x2C, top);
            bench.write(base, 1);
        }
        bench
    }

    fn turn(bench: &mut Bench, motor: Motor, counts: impl IntoIterator<Item = i64>) {
        let at = VirtualNanos(bench.now());
        for count in counts {
            bench.part.encoders[motor as usize].push(Edge { at, count });
        }
    }

    fn counts(bench: &mut Bench) -> [u64; 2] {
        [bench.read(TIM4.base + 0x24), bench.read(TIM2.base + 0x24)]
    }

    #[test]
    fn four_counts_a_line_period_up_and_down() {
        let mut bench = counting();
        turn(&mut bench, Motor::M2, 1..=1000);
        assert_eq!(counts(&mut bench), [0, 1000]);
        turn(&mut bench, Motor::M2, (0..1000).rev());
        assert_eq!(counts(&mut bench), [0, 0]);
        turn(&mut bench, Motor::M2, [-1, -2, -3]);
        assert_eq!(counts(&mut bench), [0, 0xFFFF_FFFD], "32 bit");
        turn(&mut bench, Motor::M1, [-1, -2]);
        assert_eq!(counts(&mut bench), [0xFFFE, 0xFFFF_FFFD], "16 bit");
    }

    #[test]
    fn an_edge_counts_from_its_instant_on() {
        let mut bench = counting();
        let now = bench.now();
        for count in 1..=10 {
            let at = VirtualNanos(now + 10_000 * u64::try_from(count).unwrap());
            bench.part.encoders[Motor::M2 as usize].push(Edge { at, count });
        }
        assert_eq!(counts(&mut bench)[1], 0);
        bench.advance(34_999);
        assert_eq!(counts(&mut bench)[1], 3);
        bench.advance(100_000);
        assert_eq!(counts(&mut bench)[1], 10);
    }

    #[test]
    fn with_a_line_stuck_the_count_goes_back_and_forth() {
        for line in [Line::A, Line::B] {
            for level in [false, true] {
                let mut bench = counting();
                turn(&mut bench, Motor::M2, 1..=100);
                let before = counts(&mut bench)[1];
                bench.part.encoders[Motor::M2 as usize].stick(line, Some(level));
                turn(&mut bench, Motor::M2, 101..=1100);
                let after = counts(&mut bench)[1];
                assert!(after.abs_diff(before) <= 1, "{line:?} at {level}: {before} to {after}");
            }
        }
    }

    #[test]
    fn a_reset_clears_the_counter_and_keeps_the_levels_of_the_lines() {
        let mut bench = counting();
        turn(&mut bench, Motor::M2, 1..=2);
        assert_eq!(counts(&mut bench)[1], 2);
        let levels = [Line::A, Line::B].map(|line| bench.part.encoders[1].level(line));
        bench.reset(rigless::device::ResetCause::PowerOn);
        assert_eq!([Line::A, Line::B].map(|line| bench.part.encoders[1].level(line)), levels);
        assert_eq!(levels, [true, true]);
    }
}
