//! TIM16 with its input switched to the low-speed crystal, RM0433, `TIM16_TISEL`: `TI1SEL` 2 is the LSE.
//!
//! The capture is the emulator's; here are the crystal's edges, one event each, as long as the crystal runs and the timer
//! counts. Whether it runs the part says at the begin of each control period, so the first edge comes up to a period late.
//! Left out: the other sources of the input.

use rigless::device::{Device, DeviceContext, Level, RegisterFile, RequestChange};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32h743::peripherals::tim::{Channel, TIMER_16, Tim, Tim16};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

type Register = <Tim<Tim16> as Device>::Register;

/// `CEN` of `CR1`.
const COUNTS: u64 = 1;
/// `TI1SEL` of the crystal.
const LSE: u8 = 2;

/// The crystal's edges so far: the next is number `edges` after `since`.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Edges {
    hz: u64,
    since: VirtualNanos,
    edges: u64,
    next: EventId,
}

/// TIM16.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(deserialize = "'de: 'static"))]
pub struct CaptureTimer {
    timer: Tim<Tim16>,
    counts: bool,
    crystal: Option<Edges>,
}

impl CaptureTimer {
    pub(super) fn new() -> Self {
        Self { timer: Tim::new(TIMER_16), counts: false, crystal: None }
    }

    /// Whether it counts: only then the crystal matters.
    pub(super) fn counts(&self) -> bool {
        self.counts
    }

    /// The crystal's frequency from now on; 0 while it does not run.
    pub(super) fn crystal(&mut self, hz: u64, context: &mut DeviceContext<'_>) {
        if self.crystal.map_or(0, |edges| edges.hz) == hz {
            return;
        }
        self.crystal = (hz != 0).then(|| {
            let since = context.now();
            Edges { hz, since, edges: 1, next: context.schedule(edge(since, hz, 1)) }
        });
    }

    fn stop(&mut self) {
        self.counts = false;
        self.crystal = None;
    }

    fn follow(&mut self, registers: &RegisterFile) {
        self.counts = registers.get(Register::Cr1) & COUNTS != 0;
        if !self.counts {
            self.crystal = None;
        }
    }
}

/// When the edge with this number comes, rising and falling ones counted.
fn edge(since: VirtualNanos, hz: u64, number: u64) -> VirtualNanos {
    VirtualNanos(since.0 + number * 1_000_000_000 / (2 * hz))
}

impl Device for CaptureTimer {
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
        self.timer.write(register, value, registers, context);
        self.follow(registers);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let Some(Edges { hz, since, edges, .. }) = self.crystal.filter(|edges| edges.next == event) else {
            return self.timer.on_event(event, registers, context);
        };
        let level = Level::from(edges % 2 == 1);
        if let Some(channel) = Channel::new(1) {
            self.timer.drive_input_source(channel, LSE, level, registers, context);
        }
        let edges = edges + 1;
        self.crystal = Some(Edges { hz, since, edges, next: context.schedule(edge(since, hz, edges)) });
    }

    /// Nothing here asks for a transfer, and every request of the part would come by.
    fn on_request(
        &mut self,
        _change: RequestChange,
        _registers: &mut RegisterFile,
        _context: &mut DeviceContext<'_>,
    ) {
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.on_clock(hz, registers, context);
    }

    fn reset(&mut self) {
        self.stop();
        self.timer.reset();
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.stop();
        self.timer.reset_line(registers, context);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Bench;
    use rigless::soc::stm32h743::generated::{RCC, TIM16};

    const CC1IF: u64 = 1 << 1;

    /// Distance of two captures of every eighth edge, in periods of the timer's 64 MHz out of reset.
    fn captured(hz: u64, input: u64) -> Option<u64> {
        let mut bench = Bench::new();
        // TIM16EN (RM0433, `RCC_APB2ENR`).
        bench.write(RCC.base + 0xF0, 1 << 17);
        bench.write(TIM16.base + 0x68, input);
        bench.write(TIM16.base + 0x18, 0b01 | 0b11 << 2);
        bench.write(TIM16.base + 0x20, 1);
        bench.write(TIM16.base + 0x2C, 0xFFFF);
        bench.write(TIM16.base, 1);
        bench.crystal(hz);
        let mut capture = || {
            for _ in 0..1000 {
                bench.advance(1_000);
                if bench.read(TIM16.base + 0x10) & CC1IF != 0 {
                    return Some(bench.read(TIM16.base + 0x34));
                }
            }
            None
        };
        let (first, second) = (capture()?, capture()?);
        Some((second + 0x1_0000 - first) & 0xFFFF)
    }

    #[test]
    fn every_eighth_edge_of_the_crystal_is_captured() {
        // 8 / 32768 s of 64 MHz are 15625, and 1 % fewer of a crystal that is 1 % fast.
        assert_eq!(captured(32_768, 2), Some(15_625));
        assert_eq!(captured(33_096, 2).map(|periods| periods.abs_diff(15_470) <= 1), Some(true));
    }

    #[test]
    fn no_edge_comes_from_another_input_or_a_crystal_that_does_not_run() {
        assert_eq!((captured(32_768, 0), captured(0, 2)), (None, None));
    }
}
