//! TIM6 as the source of the converter's trigger: the wire `tim6_trgo` of RM0433, ADC external triggers.
//!
//! The emulator's timer counts the pulses of its trigger output, which `MMS` selects (RM0433 chapter 42, `TIMx_CR2`);
//! each new one is passed on to ADC1. Left out: the listeners other than ADC1.
//!
//! The core's writes are posted: a store to this timer is done for the core long before it lands, as it crosses from the
//! core's AXI through the bridge to domain D2 and down to APB1 (RM0433 figure 1). A write of `SR` lands [`POSTED_NS`]
//! later here, and until then the interrupt's line stands as it did; an exception return that comes first takes the
//! interrupt again (ARMv7-M B3.4.1). A read of the timer waits for the write before it, as accesses to one Device
//! region stay in order (ARMv7-M A3.7.3). Other registers' writes land at once: nothing can tell.

use super::adc_trigger::{TIM6_TRGO, trigger_word};
use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::generated::ADC1;
use rigless::soc::stm32h743::peripherals::tim::{BASIC_TIMERS, Basic, Tim};
use rigless::soc::{RegisterSpec, Width};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

type Register = <Tim<Basic> as Device>::Register;

/// How long a posted write is on its way: some ten cycles of AHB (240 MHz) and four of APB1 (120 MHz). Assumed; no
/// document gives it, and a handler must not depend on it.
const POSTED_NS: u64 = 75;

/// A write of `SR` on its way.
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Posted {
    /// Flags it clears.
    clears: u64,
    lands: EventId,
}

/// TIM6 with its trigger output wired to ADC1.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(deserialize = "'de: 'static"))]
pub struct TriggerTimer {
    timer: Tim<Basic>,
    passed_on: u64,
    last_at: Option<VirtualNanos>,
    /// `SR` as it stood after the last call: the register file holds a written value before the model hears of it.
    flags: u64,
    posted: Option<Posted>,
}

impl TriggerTimer {
    pub(super) fn new() -> Self {
        Self { timer: Tim::new(BASIC_TIMERS[0]), passed_on: 0, last_at: None, flags: 0, posted: None }
    }

    /// The instant of the last trigger.
    #[must_use]
    pub fn last_trigger(&self) -> Option<VirtualNanos> {
        self.last_at
    }

    /// `SR` is written: it lands later.
    fn post(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let clears = self.flags & !registers.get(Register::Sr);
        registers.set(Register::Sr, self.flags);
        self.land(registers, context);
        let lands = context.schedule(VirtualNanos(context.now().0 + POSTED_NS));
        self.posted = Some(Posted { clears, lands });
    }

    /// What is on its way arrives.
    fn land(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if let Some(Posted { clears, .. }) = self.posted.take() {
            let left = registers.get(Register::Sr) & !clears;
            registers.set(Register::Sr, left);
            self.timer.write(Register::Sr, left, registers, context);
        }
    }

    fn pass_on(&mut self, registers: &RegisterFile, context: &mut DeviceContext<'_>) {
        self.flags = registers.get(Register::Sr);
        let (_, pulses) = self.timer.trigger_output();
        if pulses != self.passed_on {
            self.passed_on = pulses;
            self.last_at = Some(context.now());
            // ISR is the converter's first register.
            context.write_to(ADC1.base, Width::W32, trigger_word(TIM6_TRGO), 0);
        }
    }
}

impl Device for TriggerTimer {
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
        self.land(registers, context);
        let value = self.timer.read(register, registers, context);
        self.pass_on(registers, context);
        value
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
        match register {
            Register::Sr => self.post(registers, context),
            _ => self.timer.write(register, value, registers, context),
        }
        self.pass_on(registers, context);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if self.posted.is_some_and(|posted| posted.lands == event) {
            self.land(registers, context);
        }
        self.timer.on_event(event, registers, context);
        self.pass_on(registers, context);
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.timer.on_request(change, registers, context);
        self.pass_on(registers, context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.on_clock(hz, registers, context);
        self.pass_on(registers, context);
    }

    fn reset(&mut self) {
        self.timer.reset();
        self.passed_on = self.timer.trigger_output().1;
        self.last_at = None;
        (self.flags, self.posted) = (0, None);
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.reset_line(registers, context);
        self.passed_on = self.timer.trigger_output().1;
        self.last_at = None;
        (self.flags, self.posted) = (0, None);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Bench;
    use super::POSTED_NS;
    use rigless::soc::stm32h743::generated::TIM6;

    const SR: u64 = TIM6.base + 0x10;
    const PERIOD: u64 = 100_000;

    /// 64 MHz, ARR 6399, update interrupt, counter on; the first update has come.
    fn updated() -> Bench {
        let mut bench = Bench::new();
        bench.write(TIM6.base + 0x2C, 6399);
        bench.write(TIM6.base + 0x0C, 1);
        bench.write(TIM6.base, 1);
        bench.advance(PERIOD + 10);
        assert!(bench.line_is_high("TIM6"));
        bench
    }

    #[test]
    fn the_interrupt_stands_until_the_write_that_clears_its_flag_has_landed() {
        let mut bench = updated();
        bench.write(SR, 0);
        bench.advance(POSTED_NS - 1);
        assert!(bench.line_is_high("TIM6"));
        bench.advance(1);
        assert!(!bench.line_is_high("TIM6"));
        assert_eq!(bench.read(SR) & 1, 0);
    }

    #[test]
    fn a_read_waits_for_the_write() {
        let mut bench = updated();
        bench.write(SR, 0);
        assert_eq!(bench.read(SR) & 1, 0);
        assert!(!bench.line_is_high("TIM6"));
    }

    #[test]
    fn the_next_update_is_not_lost_in_a_write_that_landed_before_it() {
        let mut bench = updated();
        bench.write(SR, 0);
        bench.advance(PERIOD);
        assert_eq!(bench.read(SR) & 1, 1);
        assert!(bench.line_is_high("TIM6"));
    }
}
