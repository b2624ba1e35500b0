//! The whole part: which model answers for which instance, and what a reset leaves.
//!
//! A power-on reset rebuilds the emulator's part, which panics when asked for one. What is outside the chip
//! stays through it: crystals, rails, the far ends of the serial ports, levels at pins, voltages at the
//! converter's inputs, edges under way. So do the option bytes, which are flash.

use super::adc_trigger::{REFERENCE_MICROVOLT, TriggeredAdc};
use super::capture_timer::CaptureTimer;
use super::dac::Dac;
use super::encoder_timer::EncoderTimer;
use super::iwdg::Iwdg;
use super::trigger_timer::TriggerTimer;
use crate::interference;
use rigless::device::{Device, ErasedDevice, ResetCause};
use rigless::mcu::Mcu;
use rigless::soc::stm32h743::Stm32h743;
use rigless::soc::stm32h743::generated::RCC;
use rigless::soc::stm32h743::peripherals::adc::Converter;
use rigless::soc::stm32h743::peripherals::tim::{TIMERS, Timer};
use rigless::soc::{Bus, Error};
use rigless::store;
use rigless::time::VirtualNanos;

/// Rails of the NUCLEO board, and its clock sources: 8 MHz from the ST-LINK, and the 32 kHz crystal.
const RAIL_MILLIVOLT: u32 = REFERENCE_MICROVOLT / 1000;
const HSE_HZ: u64 = 8_000_000;
const LSE_HZ: u64 = 32_768;

/// The motors, in the order in which everything here keeps two of a kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motor {
    /// M1: the pressing mechanism.
    M1,
    /// M2: the disc.
    M2,
}

impl Motor {
    /// Both.
    pub const ALL: [Self; 2] = [Self::M1, Self::M2];

    /// The timer that counts its encoder: TIM4 (16 bit) for M1, TIM2 (32 bit) for M2.
    const fn encoder_timer(self) -> Timer {
        match self {
            Self::M1 => TIMERS[2],
            Self::M2 => TIMERS[0],
        }
    }
}

/// Instances that hear every request of every other one and that the firmware leaves alone. Their models would take a
/// fifth of the emulator's time to find that nothing concerns them. Without a model, an access to one is a gap
/// (`gaps.rs`), and the run fails.
const LEFT_ALONE: [&str; 17] = [
    "TIM1", "TIM5", "TIM8", "TIM12", "TIM13", "TIM14", "TIM15", "TIM17", "SPI1", "SPI2", "SPI3", "SPI4",
    "SPI5", "SPI6", "DMA2", "BDMA", "DMAMUX2",
];

/// Slots of the instances that have a model of ours, and of the serial port.
#[derive(Debug, Clone)]
struct Slots {
    /// By slot: [`LEFT_ALONE`].
    left_alone: Vec<bool>,
    dac: usize,
    iwdg: usize,
    adc1: usize,
    tim6: usize,
    tim16: usize,
    encoders: [usize; 2],
    usart3: usize,
    rcc: usize,
}

/// The part.
#[derive(Debug)]
pub struct Part {
    /// The emulator's part, for everything that has no model of ours.
    pub soc: Stm32h743,
    /// DAC1.
    pub dac: Dac,
    /// The independent watchdog.
    pub iwdg: Iwdg,
    /// ADC1.
    pub adc1: TriggeredAdc,
    /// TIM6.
    pub tim6: TriggerTimer,
    /// TIM16.
    pub tim16: CaptureTimer,
    /// The encoders' timers, by [`Motor`].
    pub encoders: [EncoderTimer; 2],
    slots: Slots,
}

store!(Part { values: [dac, iwdg, adc1, tim6, tim16, encoders], parts: [soc], built: [slots] });

impl Part {
    /// Index of USART3 among the emulator's serial ports.
    pub const USART3: usize = 2;

    /// The part out of a power-on reset, with nothing at its pins.
    ///
    /// # Errors
    /// The emulator's description of the part lacks an instance.
    pub fn new() -> Result<Self, Error> {
        let mut soc = Stm32h743::new()?;
        soc.rcc.attach_crystals(HSE_HZ, LSE_HZ);
        soc.set_supply(RAIL_MILLIVOLT);
        soc.set_analog_supply(RAIL_MILLIVOLT);
        let bus = Mcu::bus(&soc);
        let mut left_alone = vec![false; bus.slots().len()];
        for instance in LEFT_ALONE {
            left_alone[bus.slot(instance)?] = true;
        }
        let slots = Slots {
            left_alone,
            dac: bus.slot("DAC")?,
            iwdg: bus.slot("IWDG")?,
            adc1: bus.slot("ADC1")?,
            tim6: bus.slot("TIM6")?,
            tim16: bus.slot("TIM16")?,
            encoders: [
                bus.slot(Motor::M1.encoder_timer().instance)?,
                bus.slot(Motor::M2.encoder_timer().instance)?,
            ],
            usart3: bus.slot("USART3")?,
            rcc: bus.slot("RCC")?,
        };
        Ok(Self {
            soc,
            dac: Dac::default(),
            iwdg: Iwdg::default(),
            adc1: TriggeredAdc::new(),
            tim6: TriggerTimer::new(),
            tim16: CaptureTimer::new(),
            encoders: Motor::ALL.map(|motor| EncoderTimer::new(motor.encoder_timer())),
            slots,
        })
    }

    /// The analogue rail from now on, which is VREF+ of every converter.
    pub fn set_analog_supply(&mut self, millivolt: u32) {
        self.soc.set_analog_supply(millivolt);
        self.soc.adc[Converter::Adc3 as usize].set_reference(millivolt);
        self.adc1.set_reference(1000 * millivolt);
    }

    /// The 8 MHz stop, and the clock security system notices; its interrupt the emulator leaves out.
    pub fn fail_crystal(&mut self, at: VirtualNanos) {
        // The model and its registers are lent apart from each other only while the model is taken out.
        let Ok(mut aside) = Stm32h743::new() else { return };
        std::mem::swap(&mut aside.rcc, &mut self.soc.rcc);
        let (registers, mut context) = self.soc.bus_mut().drive(at, self.slots.rcc);
        aside.rcc.fail_hse(registers, &mut context);
        std::mem::swap(&mut aside.rcc, &mut self.soc.rcc);
    }

    /// The 32 kHz crystal on the board from now on; 0: it does not start, however long the chip asks it to.
    pub fn fit_low_speed_crystal(&mut self, hz: u64) {
        let (hse, _) = self.soc.rcc.crystals();
        self.soc.rcc.attach_crystals(hse, hz);
    }

    /// Hands the crystal's edges to TIM16 while they come. To be called now and then, some times in its start-up.
    pub fn run_low_speed_crystal(&mut self, at: VirtualNanos) {
        /// `RCC_BDCR`, `LSEON` and `LSERDY` (RM0433, `RCC_BDCR`).
        const BDCR: u64 = RCC.base + 0x70;
        const ON: u64 = 1 << 0;
        const READY: u64 = 1 << 1;
        let (_, hz) = self.soc.rcc.crystals();
        if hz == 0 {
            // The emulator's becomes ready all the same, after its start-up: so that begins anew.
            let control = interference::read(self, at, BDCR);
            if control & ON != 0 {
                interference::write(self, at, BDCR, control & !ON);
                interference::write(self, at, BDCR, control);
            }
        } else if self.tim16.counts() {
            let ready = interference::read(self, at, BDCR) & READY != 0;
            let (_, mut context) = self.soc.bus_mut().drive(at, self.slots.tim16);
            self.tim16.crystal(if ready { hz } else { 0 }, &mut context);
        }
    }

    /// Asks for the part's supply to be cut or given back.
    pub fn power(&mut self, at: VirtualNanos, on: bool) {
        let (_, mut context) = self.soc.bus_mut().drive(at, self.slots.iwdg);
        context.request_power(on);
    }

    /// The emulator's part anew, with what is outside the chip still there.
    fn powered_on(&mut self) {
        // It assembled once, from the same constant tables.
        let Ok(mut fresh) = Stm32h743::new() else { return };
        let (hse, lse) = self.soc.rcc.crystals();
        fresh.rcc.attach_crystals(hse, lse);
        fresh.set_supply(self.soc.pwr.supply());
        let analog = self.soc.pwr.analog_supply();
        fresh.set_analog_supply(analog);
        fresh.adc[Converter::Adc3 as usize].set_reference(analog);
        let options = self.soc.flash.committed_options();
        let (flash, registers) = fresh.program();
        flash.keep_options(options, registers);
        for (port, old) in fresh.usart.iter_mut().zip(&mut self.soc.usart) {
            port.inherit(old);
        }
        for (port, old) in fresh.gpio.iter_mut().zip(&mut self.soc.gpio) {
            *port = std::mem::take(old);
            Device::reset(port);
        }
        self.soc = fresh;
    }
}

impl Mcu for Part {
    fn bus(&self) -> &Bus {
        self.soc.bus()
    }

    fn bus_mut(&mut self) -> &mut Bus {
        self.soc.bus_mut()
    }

    fn reset(&mut self, at: VirtualNanos, cause: ResetCause) {
        match cause {
            ResetCause::PowerOn => self.powered_on(),
            _ => self.soc.reset(at, cause),
        }
        Device::reset(&mut self.dac);
        Device::reset(&mut self.iwdg);
        Device::reset(&mut self.adc1);
        Device::reset(&mut self.tim6);
        Device::reset(&mut self.tim16);
        for encoder in &mut self.encoders {
            Device::reset(encoder);
        }
    }

    /// Only the serial port has something outside that the models do not hear of by themselves.
    fn poll(&mut self, now: VirtualNanos) {
        let slot = self.slots.usart3;
        let (bus, model) = self.soc.split(slot);
        let (registers, mut context) = bus.drive(now, slot);
        if let Some(model) = model {
            model.poll(registers, &mut context);
        }
    }

    fn split(&mut self, slot: usize) -> (&mut Bus, Option<&mut dyn ErasedDevice>) {
        let Self { soc, dac, iwdg, adc1, tim6, tim16, encoders: [m1, m2], slots } = self;
        let own: &mut dyn ErasedDevice = match slot {
            _ if slot == slots.dac => dac,
            _ if slot == slots.iwdg => iwdg,
            _ if slot == slots.adc1 => adc1,
            _ if slot == slots.tim6 => tim6,
            _ if slot == slots.tim16 => tim16,
            _ if slot == slots.encoders[0] => m1,
            _ if slot == slots.encoders[1] => m2,
            _ if slots.left_alone.get(slot) == Some(&true) => return (soc.bus_mut(), None),
            _ => return soc.split(slot),
        };
        (soc.bus_mut(), Some(own))
    }
}
