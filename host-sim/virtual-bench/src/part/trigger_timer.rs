//! TIM6 as the source of the converter's trigger: the wire `tim6_trgo` of RM0433 table 211.
//!
//! The emulator's timer counts the pulses of its trigger output, which `MMS` selects (RM0433 section 42.4.2);
//! each new one is passed on to ADC1. Left out: the listeners other than ADC1.

use super::adc_trigger::{TIM6_TRGO, trigger_word};
use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::stm32h743::generated::ADC1;
use rigless::soc::stm32h743::peripherals::tim::{BASIC_TIMERS, Basic, Tim};
use rigless::soc::{RegisterSpec, Width};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

type Register = <Tim<Basic> as Device>::Register;

/// TIM6 with its trigger output wired to ADC1.
#[derive(Debug, Serialize, Deserialize)]
#[serde(bound(deserialize = "'de: 'static"))]
pub struct TriggerTimer {
    timer: Tim<Basic>,
    passed_on: u64,
    last_at: Option<VirtualNanos>,
}

impl TriggerTimer {
    pub(super) fn new() -> Self {
        Self { timer: Tim::new(BASIC_TIMERS[0]), passed_on: 0, last_at: None }
    }

    /// The instant of the last trigger.
    #[must_use]
    pub fn last_trigger(&self) -> Option<VirtualNanos> {
        self.last_at
    }

    fn pass_on(&mut self, context: &mut DeviceContext<'_>) {
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
        let value = self.timer.read(register, registers, context);
        self.pass_on(context);
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
        self.timer.write(register, value, registers, context);
        self.pass_on(context);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.on_event(event, registers, context);
        self.pass_on(context);
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.timer.on_request(change, registers, context);
        self.pass_on(context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.on_clock(hz, registers, context);
        self.pass_on(context);
    }

    fn reset(&mut self) {
        self.timer.reset();
        self.passed_on = self.timer.trigger_output().1;
        self.last_at = None;
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.timer.reset_line(registers, context);
        self.passed_on = self.timer.trigger_output().1;
        self.last_at = None;
    }
}
