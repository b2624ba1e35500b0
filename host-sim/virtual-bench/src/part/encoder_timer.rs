//! A general-purpose timer in encoder mode whose two inputs are fed from a queue of edges.
//!
//! The counting is the emulator's (RM0433 chapter 39, "Encoder interface mode"); here is only what comes down the
//! wires. The plant knows the edges of the coming control period; they are applied, in order, before the firmware's
//! next access to the timer, and before each of the timer's own events. Between two accesses nothing can tell an edge
//! from its instant, as no capture, trigger or interrupt hangs on these inputs.
//!
//! A line can be stuck: its level stays, and the encoder behind it turns on. Both lines can be swapped. A disturbance can
//! be coupled into both: pulses that are not the encoder's.
//!
//! The input filter (`ICxF`, RM0433 chapter 39, `TIMx_CCMR1`) is modelled here and kept from the emulator's timer,
//! which would see all edges since the last access at one instant: a level counts once it has stood for N samples, so
//! pulses shorter than that never arrive, and all edges come that much later.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32h743::peripherals::tim::{Channel, General, Tim, Timer};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

type Register = <Tim<General> as Device>::Register;

/// Bits of DIER that ask for transfers: UDE, CC1DE to CC4DE, TDE (RM0433 rev 9, TIM2 to TIM5).
const DMA_REQUESTS: u64 = 0x5F00;

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

/// Pulses that are coupled into both lines: A goes to the other level, then B, then A goes back, then B, each a
/// [`Disturbance::width_ns`] after the one before. In quadrature that is one line period: four counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Disturbance {
    /// When A goes.
    pub at: VirtualNanos,
    /// Time between two edges.
    pub width_ns: u64,
}

/// Lines that a disturbance turns over from an instant on.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Turned {
    at: VirtualNanos,
    lines: [bool; 2],
}

/// One input with its filter.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Input {
    /// The level at the pin, and since when.
    level: bool,
    since: VirtualNanos,
    /// The level behind the filter.
    filtered: bool,
}

impl Input {
    const LOW: Self = Self { level: false, since: VirtualNanos(0), filtered: false };

    /// When the level at the pin gets through, if it has not.
    fn due(&self, filter_ns: u64) -> Option<VirtualNanos> {
        (self.level != self.filtered).then(|| VirtualNanos(self.since.0 + filter_ns))
    }
}

/// `IC1F` and `IC2F` in `CCMR1` of an input.
const FILTERS: u64 = 0xF << 4 | 0xF << 12;
/// Clock of the filter, `fDTS` with `CKD` 00: that of the timers.
const FILTER_HZ: u64 = 240_000_000;

/// Time a level must stand with `ICxF`, in ns rounded up: (divider of `fDTS`, samples), RM0433 chapter 39, `TIMx_CCMR1`.
const fn filter_ns(field: u64) -> u64 {
    const SETTINGS: [(u64, u64); 16] = [
        (1, 0),
        (1, 2),
        (1, 4),
        (1, 8),
        (2, 6),
        (2, 8),
        (4, 6),
        (4, 8),
        (8, 6),
        (8, 8),
        (16, 5),
        (16, 6),
        (16, 8),
        (32, 5),
        (32, 6),
        (32, 8),
    ];
    let (divider, samples) = SETTINGS[(field & 0xF) as usize];
    (divider * samples * 1_000_000_000).div_ceil(FILTER_HZ)
}

/// The timer of one encoder.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(deserialize = "'de: 'static"))]
pub struct EncoderTimer {
    timer: Tim<General>,
    edges: VecDeque<Edge>,
    last_count: i64,
    turned: VecDeque<Turned>,
    /// Levels the encoder drives.
    lines: [bool; 2],
    /// What a disturbance turns over now.
    disturbed: [bool; 2],
    swapped: bool,
    inputs: [Input; 2],
    /// The filter bits the firmware wrote, which the timer inside does not see.
    filters: u64,
    /// Levels the timer's inputs were last given.
    driven: [Option<bool>; 2],
    stuck: [Option<bool>; 2],
    /// Some line at the pins was not what the encoder drives.
    deviated: bool,
}

impl EncoderTimer {
    pub(super) fn new(timer: Timer) -> Self {
        Self {
            timer: Tim::new(timer),
            edges: VecDeque::new(),
            last_count: 0,
            turned: VecDeque::new(),
            lines: [false; 2],
            disturbed: [false; 2],
            swapped: false,
            inputs: [Input::LOW; 2],
            filters: 0,
            driven: [None; 2],
            stuck: [None; 2],
            deviated: false,
        }
    }

    /// Where the encoder is by the last edge given.
    #[must_use]
    pub fn last_count(&self) -> i64 {
        self.last_count
    }

    /// Adds an edge; edges are given in the order of time.
    pub fn push(&mut self, edge: Edge) {
        self.last_count = edge.count;
        self.edges.push_back(edge);
    }

    /// Holds `line` at `level` whatever the encoder does, or lets it go with `None`.
    pub fn stick(&mut self, line: Line, level: Option<bool>) {
        self.stuck[line as usize] = level;
    }

    /// Whether a line at the pins was ever not what the encoder drives.
    #[must_use]
    pub fn deviated(&self) -> bool {
        self.deviated
    }

    /// Swaps A and B, or puts them right.
    pub fn swap(&mut self, swapped: bool) {
        self.swapped = swapped;
    }

    /// Couples pulses into both lines.
    pub fn disturb(&mut self, Disturbance { at, width_ns }: Disturbance) {
        for (nth, lines) in [[true, false], [true, true], [false, true], [false; 2]].into_iter().enumerate() {
            self.turned.push_back(Turned { at: VirtualNanos(at.0 + nth as u64 * width_ns), lines });
        }
    }

    /// The level of `line` at the pin.
    #[must_use]
    pub fn level(&self, line: Line) -> bool {
        let index = line as usize;
        let encoder = self.lines[if self.swapped { 1 - index } else { index }];
        self.stuck[index].unwrap_or(encoder ^ self.disturbed[index])
    }

    fn filter_ns(&self, line: usize) -> u64 {
        filter_ns(self.filters >> [4, 12][line])
    }

    /// Everything that happened on the wires up to now, in its order.
    fn catch_up(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let now = context.now();
        self.feel(now);
        loop {
            let next = [self.edges.front().map(|edge| edge.at), self.turned.front().map(|turned| turned.at)];
            let Some(at) = next.into_iter().flatten().min().filter(|at| *at <= now) else { break };
            self.pass_filters(at, registers, context);
            if next[0] == Some(at)
                && let Some(edge) = self.edges.pop_front()
            {
                self.lines = quadrature(edge.count);
            } else if let Some(turned) = self.turned.pop_front() {
                self.disturbed = turned.lines;
            }
            self.feel(at);
        }
        self.pass_filters(now, registers, context);
    }

    /// The levels at the pins are those of the wires from `at` on.
    fn feel(&mut self, at: VirtualNanos) {
        for line in [Line::A, Line::B] {
            let level = self.level(line);
            self.deviated |= level != self.lines[line as usize];
            let input = &mut self.inputs[line as usize];
            if input.level != level {
                (input.level, input.since) = (level, at);
            }
        }
    }

    /// What has stood long enough by `until` gets through, the earlier first.
    fn pass_filters(
        &mut self,
        until: VirtualNanos,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let mut due: Vec<(VirtualNanos, usize)> = (0..2)
            .filter_map(|line| Some((self.inputs[line].due(self.filter_ns(line))?, line)))
            .filter(|(at, _)| *at <= until)
            .collect();
        due.sort_unstable();
        for (_, line) in due {
            self.inputs[line].filtered = self.inputs[line].level;
            self.drive(line, registers, context);
        }
        // The first call tells the timer the levels it woke up with.
        for line in 0..2 {
            self.drive(line, registers, context);
        }
    }

    fn drive(&mut self, line: usize, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let level = self.inputs[line].filtered;
        if self.driven[line] == Some(level) {
            return;
        }
        self.driven[line] = Some(level);
        if let Some(channel) = Channel::new(line as u8 + 1) {
            self.timer.drive_input(channel, Level::from(level), registers, context);
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
        let value = self.timer.read(register, registers, context);
        match register {
            Register::Ccmr1Input | Register::Ccmr1Output => {
                Some(value.unwrap_or_else(|| registers.get(register)) | self.filters)
            }
            _ => value,
        }
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
        if matches!(register, Register::Ccmr1Input | Register::Ccmr1Output) {
            let landed = registers.get(register);
            self.filters = landed & FILTERS;
            registers.set(register, landed & !FILTERS);
            self.timer.write(register, landed & !FILTERS, registers, context);
        } else {
            self.timer.write(register, value, registers, context);
        }
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
        // What it would hear is that a transfer it asked for was made.
        if registers.get(Register::Dier) & DMA_REQUESTS != 0 {
            self.timer.on_request(change, registers, context);
        }
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.on_clock(hz, registers, context);
    }

    /// The encoder is outside the part: its edges stay, and the timer keeps the levels at its inputs.
    fn reset(&mut self) {
        self.filters = 0;
        self.timer.reset();
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.filters = 0;
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

    /// Counts after a disturbance of this width at rest, with this `ICxF` on both inputs.
    fn disturbed(width_ns: u64, filter: u64) -> u64 {
        let mut bench = counting();
        bench.write(TIM2.base + 0x18, 0b01 | 0b01 << 8 | filter << 4 | filter << 12);
        let at = VirtualNanos(bench.now() + 1000);
        bench.part.encoders[Motor::M2 as usize].disturb(Disturbance { at, width_ns });
        bench.advance(100_000);
        counts(&mut bench)[1]
    }

    #[test]
    fn a_disturbance_of_both_lines_counts_four_and_the_filter_takes_it_away() {
        assert_eq!(disturbed(20, 0), 4);
        // Each line is turned for two widths: 40 ns. Eight samples at 120 MHz are 67 ns.
        assert_eq!((disturbed(20, 0b0101), disturbed(40, 0b0101)), (0, 4));
        assert_eq!((filter_ns(0b0101), filter_ns(0b0011), filter_ns(0b1111)), (67, 34, 1067));
    }

    #[test]
    fn behind_the_filter_all_edges_count_later_and_none_is_lost() {
        let mut bench = counting();
        bench.write(TIM2.base + 0x18, 0b01 | 0b01 << 8 | 0b0101 << 4 | 0b0101 << 12);
        let now = bench.now();
        for count in 1..=1000_i64 {
            let at = VirtualNanos(now + 200 * u64::try_from(count).unwrap());
            bench.part.encoders[Motor::M2 as usize].push(Edge { at, count });
        }
        bench.advance(1000 * 200 + 66);
        assert_eq!(counts(&mut bench)[1], 999);
        bench.advance(1);
        assert_eq!(counts(&mut bench)[1], 1000);
        assert_eq!(bench.read(TIM2.base + 0x18) & FILTERS, 0b0101 << 4 | 0b0101 << 12, "it reads back");
    }

    #[test]
    fn swapped_lines_count_the_other_way() {
        let mut bench = counting();
        bench.part.encoders[Motor::M2 as usize].swap(true);
        turn(&mut bench, Motor::M2, 1..=100);
        assert_eq!(counts(&mut bench)[1], u64::from(0_u32.wrapping_sub(100)));
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
