//! The digital-to-analog converter, RM0433 chapter 26, which the emulator carries as a register file only.
//!
//! | rule | section |
//! |---|---|
//! | Data goes to the pin only through a holding register; right- and left-aligned 12 bit and 8 bit writes, single and dual, land in the same two internal holding registers | 26.4.4 |
//! | With `TENx` clear the holding register goes to `DORx` by itself, one bus clock after the write (here: at the write) | 26.4.4 |
//! | With `TENx` set it waits for the trigger `TSELx` names; the software trigger clears itself | 26.4.4, 26.7.2 |
//! | `ENx` switches the analog half only: `DORx` follows the holding register with `ENx` clear too | 26.4.2 |
//! | `DORx` is read-only; `SWTRGR` is write-only | 26.7 |
//! | `MODEx` is written only while `ENx` and `CENx` are clear, else the write is ignored; modes 011 and 111 leave the pin alone | `DAC_MCR` |
//! | `CENx` is written only while `ENx` is clear | 26.7.1 |
//!
//! Left out, and told to the run when the firmware asks for it: hardware triggers, the wave generators, DMA
//! requests, the sample-and-hold modes and the calibration. Left out silently: start-up and settling times
//! (7.5 µs and 2 µs), and the buffer's offset.
//!
//! With its output buffer on (`MODEx` 000 or 001) a channel reaches no nearer to either rail than 0.2 V; with the buffer
//! off it reaches both (DS12110 rev 11, DAC characteristics, `V_DAC_OUT`). [`Dac::pin`] gives what is at the pin.

use rigless::device::{Device, DeviceContext, RegisterFile};
use rigless::soc::stm32h743::generated::dac::Register;
use serde::{Deserialize, Serialize};

/// Output channels of the converter.
pub const CHANNELS: usize = 2;
/// Bits between the fields of channel 1 and those of channel 2, in `CR`, `MCR` and the dual registers.
const STRIDE: usize = 16;
const CODE_MASK: u64 = 0xFFF;

const EN: u64 = 1 << 0;
const TEN: u64 = 1 << 1;
const TSEL: u64 = 0xF << 2;
const WAVE: u64 = 0b11 << 6;
const DMAEN: u64 = 1 << 12;
const CEN: u64 = 1 << 14;
const MODE: u64 = 0b111;
const MODE_ON_CHIP_ONLY: u64 = 0b011;
const MODE_UNBUFFERED: u64 = 0b010;
/// Codes nearest to the rails that a buffered output reaches: 0.2 V of 3.3 V on either side.
const BUFFERED: std::ops::RangeInclusive<u16> = 249..=3847;
const MODE_SAMPLE_AND_HOLD: u64 = 0b100;

const NO_TRIGGER: &str = "the hardware triggers of the DAC are not modelled";
const NO_WAVE: &str = "the wave generators of the DAC are not modelled";
const NO_DMA: &str = "the DMA requests of the DAC are not modelled";
const NO_CALIBRATION: &str = "the calibration of the DAC is not modelled";
const NO_SAMPLE_AND_HOLD: &str = "the sample-and-hold modes of the DAC are not modelled";

/// Both channels: what stands in the holding registers, and what drives the pins.
#[derive(Debug, Default, Clone, Serialize, Deserialize)]
pub struct Dac {
    holding: [u16; CHANNELS],
    pins: [Option<u16>; CHANNELS],
    control: u64,
    mode: u64,
}

impl Dac {
    /// The voltage at the pin of channel 1 or 2 (index 0 or 1) as a 12 bit code; `None` while the converter leaves it
    /// floating.
    #[must_use]
    pub fn pin(&self, channel: usize) -> Option<u16> {
        let code = self.pins.get(channel).copied().flatten()?;
        let buffered = Self::field(self.mode, channel) & MODE_UNBUFFERED == 0;
        Some(if buffered { code.clamp(*BUFFERED.start(), *BUFFERED.end()) } else { code })
    }

    fn field(word: u64, channel: usize) -> u64 {
        word >> (STRIDE * channel)
    }

    fn hold(&mut self, channel: usize, code: u64, registers: &mut RegisterFile) {
        self.holding[channel] = u16::try_from(code & CODE_MASK).unwrap_or_default();
        if Self::field(self.control, channel) & TEN == 0 {
            self.convert(channel, registers);
        }
    }

    fn convert(&mut self, channel: usize, registers: &mut RegisterFile) {
        let register = [Register::Dor1, Register::Dor2][channel];
        registers.set(register, u64::from(self.holding[channel]));
        self.drive_pins(registers);
    }

    fn drive_pins(&mut self, registers: &RegisterFile) {
        for (channel, register) in [Register::Dor1, Register::Dor2].into_iter().enumerate() {
            let enabled = Self::field(self.control, channel) & EN != 0;
            let connected = Self::field(self.mode, channel) & MODE_ON_CHIP_ONLY != MODE_ON_CHIP_ONLY;
            let code = u16::try_from(registers.get(register) & CODE_MASK).ok();
            self.pins[channel] = code.filter(|_| enabled && connected);
        }
    }

    /// `CR`: a change of `CENx` is ignored while `ENx` stands.
    fn write_control(&mut self, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut accepted = value;
        for channel in 0..CHANNELS {
            if Self::field(self.control, channel) & EN != 0 {
                let kept = CEN << (STRIDE * channel);
                accepted = (accepted & !kept) | (self.control & kept);
            }
            let asked = Self::field(accepted, channel);
            let told = [
                (asked & TEN != 0 && asked & TSEL != 0, NO_TRIGGER),
                (asked & WAVE != 0, NO_WAVE),
                (asked & DMAEN != 0, NO_DMA),
                (asked & CEN != 0, NO_CALIBRATION),
            ];
            for (_, reason) in told.into_iter().filter(|(asked, _)| *asked) {
                context.tell("CR", reason);
            }
        }
        self.control = accepted;
        registers.set(Register::Cr, accepted);
        self.drive_pins(registers);
    }

    /// `MCR`: the mode of a channel that is enabled or in calibration stays as it is.
    fn write_mode(&mut self, value: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut accepted = value;
        for channel in 0..CHANNELS {
            let shift = STRIDE * channel;
            if Self::field(self.control, channel) & (EN | CEN) != 0 {
                accepted = (accepted & !(MODE << shift)) | (self.mode & (MODE << shift));
            }
            if Self::field(accepted, channel) & MODE_SAMPLE_AND_HOLD != 0 {
                context.tell("MCR", NO_SAMPLE_AND_HOLD);
            }
        }
        self.mode = accepted;
        registers.set(Register::Mcr, accepted);
        self.drive_pins(registers);
    }

    fn software_trigger(&mut self, value: u64, registers: &mut RegisterFile) {
        for channel in 0..CHANNELS {
            let control = Self::field(self.control, channel);
            if value >> channel & 1 != 0 && control & TEN != 0 && control & TSEL == 0 {
                self.convert(channel, registers);
            }
        }
    }
}

impl Device for Dac {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            Register::Cr => self.write_control(value, registers, context),
            Register::Mcr => self.write_mode(value, registers, context),
            Register::Swtrgr => self.software_trigger(value, registers),
            Register::Dhr12r1 => self.hold(0, value, registers),
            Register::Dhr12r2 => self.hold(1, value, registers),
            Register::Dhr12l1 => self.hold(0, value >> 4, registers),
            Register::Dhr12l2 => self.hold(1, value >> 4, registers),
            Register::Dhr8r1 => self.hold(0, (value & 0xFF) << 4, registers),
            Register::Dhr8r2 => self.hold(1, (value & 0xFF) << 4, registers),
            Register::Dhr12rd => {
                self.hold(0, value, registers);
                self.hold(1, value >> STRIDE, registers);
            }
            Register::Dhr12ld => {
                self.hold(0, value >> 4, registers);
                self.hold(1, value >> (STRIDE + 4), registers);
            }
            Register::Dhr8rd => {
                self.hold(0, (value & 0xFF) << 4, registers);
                self.hold(1, (value >> 8 & 0xFF) << 4, registers);
            }
            // Flags nothing here raises, and values of parts that are left out.
            Register::Sr
            | Register::Ccr
            | Register::Shsr1
            | Register::Shsr2
            | Register::Shhr
            | Register::Shrr => {}
            // Read-only: the register file dropped the write.
            Register::Dor1 | Register::Dor2 => {}
        }
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Bench;
    use super::*;
    use rigless::soc::stm32h743::generated::DAC;

    const CR: u64 = 0x00;
    const SWTRGR: u64 = 0x04;
    const DHR12R1: u64 = 0x08;
    const DHR12R2: u64 = 0x14;
    const DHR12RD: u64 = 0x20;
    const DHR12LD: u64 = 0x24;
    const DHR8RD: u64 = 0x28;
    const DOR1: u64 = 0x2C;
    const DOR2: u64 = 0x30;
    const MCR: u64 = 0x3C;

    fn write(bench: &mut Bench, offset: u64, value: u64) {
        bench.write(DAC.base + offset, value);
    }

    fn outputs(bench: &mut Bench) -> [u64; 2] {
        [bench.read(DAC.base + DOR1), bench.read(DAC.base + DOR2)]
    }

    #[test]
    fn a_pin_floats_until_its_channel_is_enabled_and_again_after_a_reset() {
        let mut bench = Bench::new();
        assert_eq!((bench.part.dac.pin(0), bench.part.dac.pin(1)), (None, None));
        write(&mut bench, DHR12R1, 2048);
        assert_eq!(bench.part.dac.pin(0), None);
        // 26.4.2: the digital half works with ENx clear, so the code is there when the pin comes alive.
        assert_eq!(outputs(&mut bench), [2048, 0]);
        write(&mut bench, CR, EN);
        assert_eq!((bench.part.dac.pin(0), bench.part.dac.pin(1)), (Some(2048), None));
        write(&mut bench, CR, 0);
        assert_eq!(bench.part.dac.pin(0), None);
        write(&mut bench, CR, EN);
        bench.reset(rigless::device::ResetCause::Pin);
        assert_eq!(bench.part.dac.pin(0), None);
    }

    #[test]
    fn every_alignment_lands_in_the_same_holding_registers() {
        // 26.4.4, figures of the data registers: where the twelve bits sit in each of the nine registers.
        let single = [(0x08, 0xABC, 0xABC), (0x0C, 0xABC0, 0xABC), (0x10, 0xAB, 0xAB0)];
        for channel in 0..2 {
            for (offset, written, code) in single {
                let mut bench = Bench::new();
                write(&mut bench, offset + 12 * channel, written);
                let mut expected = [0; 2];
                expected[channel as usize] = code;
                assert_eq!(outputs(&mut bench), expected, "register {offset:#x} of channel {channel}");
            }
        }
        let dual = [
            (DHR12RD, 0x0DEF_0ABC, [0xABC, 0xDEF]),
            (DHR12LD, 0xDEF0_ABC0, [0xABC, 0xDEF]),
            (DHR8RD, 0xDEAB, [0xAB0, 0xDE0]),
        ];
        for (offset, written, codes) in dual {
            let mut bench = Bench::new();
            write(&mut bench, offset, written);
            assert_eq!(outputs(&mut bench), codes, "register {offset:#x}");
        }
    }

    #[test]
    fn bits_beyond_the_code_are_dropped() {
        let mut bench = Bench::new();
        write(&mut bench, DHR12R1, 0xFFFF_F123);
        assert_eq!(outputs(&mut bench), [0x123, 0]);
    }

    #[test]
    fn with_ten_set_the_code_waits_for_the_software_trigger() {
        let mut bench = Bench::new();
        write(&mut bench, CR, EN | TEN | (EN | TEN) << STRIDE);
        write(&mut bench, DHR12R1, 1000);
        write(&mut bench, DHR12R2, 2000);
        assert_eq!(outputs(&mut bench), [0, 0]);
        write(&mut bench, SWTRGR, 0b01);
        assert_eq!(outputs(&mut bench), [1000, 0]);
        write(&mut bench, SWTRGR, 0b10);
        assert_eq!(outputs(&mut bench), [1000, 2000]);
        assert_eq!((bench.part.dac.pin(0), bench.part.dac.pin(1)), (Some(1000), Some(2000)));
        assert_eq!(bench.read(DAC.base + SWTRGR), 0, "the trigger bits are write-only and clear themselves");
        assert!(bench.told().is_empty());
    }

    #[test]
    fn the_output_registers_cannot_be_written() {
        let mut bench = Bench::new();
        write(&mut bench, DOR1, 77);
        assert_eq!(outputs(&mut bench), [0, 0]);
    }

    #[test]
    fn the_mode_is_locked_while_the_channel_is_enabled() {
        let mut bench = Bench::new();
        write(&mut bench, CR, EN);
        write(&mut bench, MCR, 0b010 | 0b010 << STRIDE);
        assert_eq!(bench.read(DAC.base + MCR), 0b010 << STRIDE, "channel 1 is enabled, channel 2 is not");
        write(&mut bench, CR, 0);
        write(&mut bench, MCR, 0b010 | 0b010 << STRIDE);
        assert_eq!(bench.read(DAC.base + MCR), 0b010 | 0b010 << STRIDE);
    }

    #[test]
    fn a_channel_for_the_chip_alone_leaves_its_pin_floating() {
        let mut bench = Bench::new();
        write(&mut bench, MCR, MODE_ON_CHIP_ONLY);
        write(&mut bench, CR, EN);
        write(&mut bench, DHR12R1, 5);
        assert_eq!(bench.part.dac.pin(0), None);
        assert_eq!(outputs(&mut bench), [5, 0]);
    }

    #[test]
    fn a_buffered_output_stops_a_fifth_of_a_volt_from_the_rails_and_a_plain_one_does_not() {
        for (mode, ends) in [(0b000, [249, 3847]), (0b001, [249, 3847]), (0b010, [0, 4095])] {
            let mut bench = Bench::new();
            write(&mut bench, MCR, mode);
            write(&mut bench, CR, EN);
            for (code, at_the_pin) in [0, 4095].into_iter().zip(ends) {
                write(&mut bench, DHR12R1, code);
                assert_eq!(bench.part.dac.pin(0), Some(at_the_pin), "mode {mode:03b}");
                assert_eq!(outputs(&mut bench)[0], code, "the code itself is not touched");
            }
        }
    }

    #[test]
    fn calibration_cannot_be_asked_for_while_the_channel_is_enabled() {
        let mut bench = Bench::new();
        write(&mut bench, CR, EN);
        write(&mut bench, CR, EN | CEN);
        assert_eq!(bench.read(DAC.base + CR), EN);
        assert!(bench.told().is_empty());
    }

    #[test]
    fn what_is_left_out_is_told() {
        for (control, reason) in
            [(TEN | 5 << 2, NO_TRIGGER), (1 << 6, NO_WAVE), (DMAEN, NO_DMA), (CEN, NO_CALIBRATION)]
        {
            for channel in 0..CHANNELS {
                let mut bench = Bench::new();
                write(&mut bench, CR, control << (STRIDE * channel));
                assert_eq!(bench.told(), [reason]);
            }
        }
        let mut bench = Bench::new();
        write(&mut bench, MCR, 0b100 << STRIDE);
        assert_eq!(bench.told(), [NO_SAMPLE_AND_HOLD]);
    }
}
