//! The board's pins as `firmware/PINS.md` lists them, written down a second time: a change there that is
//! forgotten here fails the run, because the bench looks at how the firmware has set each pin up.
//!
//! The emulator does not connect peripherals to pins by their alternate function (a timer sees its input
//! whatever the pin's mode), so [`wrong_modes`] takes that part: it must be empty before anything moves.

use crate::part::Part;
use rigless::device::Level;
use rigless::soc::Layout;
use rigless::soc::stm32h743::generated::gpioa::Register;
use rigless::soc::stm32h743::peripherals::gpio::{Gpio, Pin};
use rigless::time::VirtualNanos;

/// A pin by port letter and number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Place {
    port: char,
    number: u8,
}

impl Place {
    const fn new(port: char, number: u8) -> Self {
        Self { port, number }
    }

    /// Number of the pin's bit in the registers of its port.
    #[must_use]
    pub const fn bit(self) -> u8 {
        self.number
    }

    /// Address of the port's input register, `GPIOx_IDR`.
    #[must_use]
    pub const fn input_register(self) -> u64 {
        rigless::soc::stm32h743::generated::GPIOA.base + 0x400 * self.port_index() as u64 + 0x10
    }

    const fn port_index(self) -> usize {
        self.port as usize - 'A' as usize
    }
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "P{}{}", self.port, self.number)
    }
}

/// Enable of each drive, high enables.
pub const DRIVE_ENABLE: [Place; 2] = [Place::new('D', 14), Place::new('D', 15)];
/// Each drive is healthy while high.
pub const DRIVE_HEALTHY: [Place; 2] = [Place::new('E', 11), Place::new('E', 9)];
/// The emergency stop is released while high.
pub const STOP_RELEASED: Place = Place::new('F', 3);
/// The arm switch is on while high.
pub const ARM_SWITCH: Place = Place::new('G', 12);
/// High while the control tick runs.
pub const TICK_PULSE: Place = Place::new('E', 13);
/// Address of the register that sets and resets [`TICK_PULSE`], `GPIOE_BSRR`.
pub const TICK_PULSE_BSRR: u64 = rigless::soc::stm32h743::generated::GPIOE.base + 0x18;
/// [`TICK_PULSE`] in it.
pub const TICK_PULSE_SET: u64 = 1 << 13;
/// Lamps: green, yellow, red.
pub const LAMPS: [Place; 3] = [Place::new('B', 0), Place::new('E', 1), Place::new('B', 14)];

/// The analogue inputs, in the order of the scan, by ADC1 channel.
pub const ADC_CHANNELS: [u8; 5] = [10, 15, 5, 3, 16];

/// ADC1's channels at the pins of the DAC's outputs.
pub const DAC_CHANNELS: [u8; 2] = [18, 19];

/// What a pin must be set up as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Use {
    Input,
    Output,
    Alternate(u8),
    Analog,
}

const USES: [(Place, Use, &str); 23] = [
    (Place::new('C', 0), Use::Analog, "friction bridge"),
    (Place::new('A', 3), Use::Analog, "normal-force bridge"),
    (Place::new('B', 1), Use::Analog, "M1 torque monitor"),
    (Place::new('A', 6), Use::Analog, "M2 torque monitor"),
    (Place::new('A', 0), Use::Analog, "supply check"),
    (Place::new('A', 4), Use::Analog, "M1 torque reference"),
    (Place::new('A', 5), Use::Analog, "M2 torque reference"),
    (Place::new('D', 12), Use::Alternate(2), "M1 encoder A on TIM4 CH1"),
    (Place::new('D', 13), Use::Alternate(2), "M1 encoder B on TIM4 CH2"),
    (Place::new('A', 15), Use::Alternate(1), "M2 encoder A on TIM2 CH1"),
    (Place::new('B', 3), Use::Alternate(1), "M2 encoder B on TIM2 CH2"),
    (Place::new('D', 8), Use::Alternate(7), "link TX on USART3"),
    (Place::new('D', 9), Use::Alternate(7), "link RX on USART3"),
    (DRIVE_ENABLE[0], Use::Output, "M1 drive enable"),
    (DRIVE_ENABLE[1], Use::Output, "M2 drive enable"),
    (DRIVE_HEALTHY[0], Use::Input, "M1 drive healthy"),
    (DRIVE_HEALTHY[1], Use::Input, "M2 drive healthy"),
    (STOP_RELEASED, Use::Input, "emergency stop"),
    (ARM_SWITCH, Use::Input, "arm switch"),
    (LAMPS[0], Use::Output, "green lamp"),
    (LAMPS[1], Use::Output, "yellow lamp"),
    (LAMPS[2], Use::Output, "red lamp"),
    (TICK_PULSE, Use::Output, "tick pulse"),
];

/// Puts `level` on a pin from outside.
pub fn drive(part: &mut Part, at: VirtualNanos, place: Place, level: bool) {
    if let Some(pin) = Pin::new(place.number) {
        part.soc.drive_port(at, place.port_index(), |port, registers, context| {
            port.drive(pin, Some(Level::from(level)), registers, context);
        });
    }
}

/// The level on a pin, as a wire soldered to it would see it.
pub fn is_high(part: &mut Part, at: VirtualNanos, place: Place) -> bool {
    Pin::new(place.number).is_some_and(|pin| {
        part.soc.drive_port(at, place.port_index(), |port, registers, _| port.level(pin, registers))
            == Level::High
    })
}

/// A sentence for each pin that is not set up as the board needs it.
pub fn wrong_modes(part: &mut Part, at: VirtualNanos) -> Vec<String> {
    let mut wrong = Vec::new();
    for (place, needed, signal) in USES {
        let Some(pin) = Pin::new(place.number) else { continue };
        let found = part.soc.drive_port(at, place.port_index(), |_, registers, _| {
            match registers.get(Register::Moder) >> (2 * place.number) & 0b11 {
                0b00 => Use::Input,
                0b01 => Use::Output,
                0b11 => Use::Analog,
                _ => Use::Alternate(Gpio::function(pin, registers).unwrap_or_default()),
            }
        });
        if found != needed {
            wrong.push(format!("{place} ({signal}) is set up as {found:?}, the board needs {needed:?}"));
        }
    }
    wrong
}

const _: () = assert!(Register::REGISTERS[Register::Bsrr as usize].offset == 0x18);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn out_of_reset_all_but_the_analogue_pins_are_named() {
        let mut part = Part::new().unwrap();
        let wrong = wrong_modes(&mut part, VirtualNanos(0));
        // The seven analogue pins are right out of reset; PA15 and PB3 are the debugger's JTDI and JTDO (AF0).
        assert_eq!(wrong.len(), USES.len() - 7, "{wrong:#?}");
        assert!(wrong.iter().any(|line| {
            line == "PA15 (M2 encoder A on TIM2 CH1) is set up as Alternate(0), the board needs Alternate(1)"
        }));
    }

    #[test]
    fn no_pin_is_used_twice() {
        for (index, (place, ..)) in USES.iter().enumerate() {
            assert!(USES[index + 1..].iter().all(|(other, ..)| other != place), "{place}");
        }
    }

    #[test]
    fn the_pull_down_outside_decides_until_the_firmware_drives_the_enable() {
        let mut part = Part::new().unwrap();
        let at = VirtualNanos(0);
        drive(&mut part, at, DRIVE_ENABLE[0], false);
        assert!(!is_high(&mut part, at, DRIVE_ENABLE[0]));
        drive(&mut part, at, DRIVE_ENABLE[0], true);
        assert!(is_high(&mut part, at, DRIVE_ENABLE[0]));
    }
}
