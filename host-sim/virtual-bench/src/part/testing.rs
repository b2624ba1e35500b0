//! A part on its own, without a core: registers are written and read over its bus, time is moved by hand.

use super::Part;
use rigless::device::{Level, ResetCause};
use rigless::emulator::{Error, Memory};
use rigless::mcu::{Mcu, Operate};
use rigless::soc::Width;
use rigless::soc::stm32h743::generated::RCC;
use rigless::time::VirtualNanos;

struct NoMemory;

impl Memory for NoMemory {
    fn read(&mut self, address: u64, width: Width) -> Result<u64, Error> {
        Err(Error::Memory { address, width })
    }
    fn write(&mut self, address: u64, width: Width, _value: u64) -> Result<(), Error> {
        Err(Error::Memory { address, width })
    }
}

/// The part and its clock.
pub(crate) struct Bench {
    pub(crate) part: Part,
    now: VirtualNanos,
    /// Instances whose interrupt line stands.
    lines: std::collections::BTreeSet<&'static str>,
}

impl Bench {
    pub(crate) fn new() -> Self {
        let mut bench = Self { part: Part::new().unwrap(), now: VirtualNanos(0), lines: Default::default() };
        // DAC12EN, TIM6EN, TIM4EN, TIM2EN; ADC12EN (RM0433, `RCC_APB1LENR` and `RCC_AHB1ENR`).
        bench.write(RCC.base + 0xE8, 1 << 29 | 1 << 4 | 1 << 2 | 1 << 0);
        bench.write(RCC.base + 0xD8, 1 << 5);
        bench
    }

    pub(crate) fn now(&self) -> u64 {
        self.now.0
    }

    pub(crate) fn write(&mut self, address: u64, value: u64) {
        self.part.write(self.now, address, Width::W32, value).unwrap();
        self.settle();
    }

    pub(crate) fn read(&mut self, address: u64) -> u64 {
        let value = self.part.read(self.now, address, Width::W32).unwrap();
        self.settle();
        value
    }

    fn settle(&mut self) {
        let refused = self.part.settle(&mut NoMemory).unwrap();
        assert!(refused.is_empty(), "refused: {refused:?}");
        for change in self.part.drain_interrupts() {
            match change.level {
                Level::High => self.lines.insert(change.instance),
                Level::Low => self.lines.remove(change.instance),
            };
        }
    }

    /// Moves time on, event by event, as a session does.
    pub(crate) fn advance(&mut self, nanos: u64) {
        let end = VirtualNanos(self.now.0 + nanos);
        while let Some(at) = self.part.next_event().filter(|at| *at <= end) {
            self.now = at;
            self.part.advance_to(at);
            self.settle();
        }
        self.now = end;
    }

    /// Whether an interrupt line of this instance stands.
    pub(crate) fn line_is_high(&self, instance: &str) -> bool {
        self.lines.contains(instance)
    }

    /// What was told since the last call.
    pub(crate) fn told(&mut self) -> Vec<&'static str> {
        self.part.drain_told().into_iter().map(|told| told.reason).collect()
    }

    /// Whether a model asked for a reset since the last call; the part then takes it.
    pub(crate) fn take_reset(&mut self) -> Option<ResetCause> {
        let cause = self.part.take_reset_request()?;
        self.part.reset(self.now, cause);
        Some(cause)
    }

    /// The low-speed crystal runs at this frequency from now on.
    pub(crate) fn crystal(&mut self, hz: u64) {
        let running = self.part.soc.bus().slot("TIM16").unwrap();
        let (_, mut context) = self.part.soc.bus_mut().drive(self.now, running);
        self.part.tim16.crystal(hz, &mut context);
    }

    /// A reset for `cause`.
    pub(crate) fn reset(&mut self, cause: ResetCause) {
        self.part.reset(self.now, cause);
    }
}
