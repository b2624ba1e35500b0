//! The external trigger of the analogue-to-digital converter, RM0433 section 25.4.19, which the emulator's
//! converter leaves out.
//!
//! | rule | section |
//! |---|---|
//! | `EXTEN` 00: `ADSTART` starts the sequence at once; else it only arms, and an edge of the source `EXTSEL` names starts it | 25.4.18, 25.4.19 |
//! | Armed, `ADSTART` stays set from sequence to sequence until `ADSTP` | 25.4.16, 25.4.18 |
//! | An edge while a sequence runs is ignored | 25.4.19 |
//! | `CFGR`, `SMPRx`, `PCSEL` and `SQRx` are written only while `ADSTART` is clear; other writes are ignored here, and told | 25.6.4, 25.6.6 to 25.6.13 |
//! | `ADDIS` acts only while `ADSTART` is clear | 25.4.9 |
//!
//! A trigger arrives as a write of `ISR` with the reserved bit 31 set and the source's number in bits 28:24:
//! the models of the emulator reach each other over the bus only. All sources modelled here are pulses, so a
//! rising, a falling and either edge are the same instant. Left out: the injected sequence's triggers.

use rigless::device::{Device, DeviceContext, RegisterFile, RequestChange};
use rigless::soc::RegisterSpec;
use rigless::soc::stm32h743::peripherals::adc::{Adc, Channel, Converter};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

type Register = <Adc as Device>::Register;

const ADEN: u64 = 1 << 0;
const ADSTART: u64 = 1 << 2;
const ADSTP: u64 = 1 << 4;
const ADDIS: u64 = 1 << 1;
const EXTSEL_SHIFT: u32 = 5;
const EXTSEL: u64 = 0x1F << EXTSEL_SHIFT;
const EXTEN: u64 = 0b11 << 10;
const EXTERNAL: u64 = EXTSEL | EXTEN;

const TRIGGER: u64 = 1 << 31;
const SOURCE_SHIFT: u32 = 24;
const SOURCE: u64 = 0x1F << SOURCE_SHIFT;

const CHANGED_WHILE_ARMED: &str =
    "configuration was written while ADSTART stands (RM0433 25.6), so it stays as it is";
const DISABLED_WHILE_ARMED: &str = "ADDIS was written while ADSTART stands, so it does nothing";

/// Full scale of the inputs in the unit of [`TriggeredAdc::set_input`], with the rail as it should be.
pub const REFERENCE_MICROVOLT: u32 = 3_300_000;

/// `TIM6_TRGO` as `EXTSEL` numbers it, RM0433, ADC external triggers.
pub const TIM6_TRGO: u64 = 13;

/// The word to write to `ISR` for an edge of trigger `source`.
pub(super) const fn trigger_word(source: u64) -> u64 {
    TRIGGER | source << SOURCE_SHIFT
}

/// Registers that change only while `ADSTART` is clear.
const CONFIGURATION: [(Register, &str); 8] = [
    (Register::Cfgr, "CFGR"),
    (Register::Smpr1, "SMPR1"),
    (Register::Smpr2, "SMPR2"),
    (Register::Pcsel, "PCSEL"),
    (Register::Sqr1, "SQR1"),
    (Register::Sqr2, "SQR2"),
    (Register::Sqr3, "SQR3"),
    (Register::Sqr4, "SQR4"),
];

/// Conversions of a scan that is cut short.
const CUT_AFTER: u32 = 3;

/// ADC1 with its external trigger.
#[derive(Debug, Serialize, Deserialize)]
pub struct TriggeredAdc {
    adc: Adc,
    external: u64,
    armed: bool,
    /// The converter inside has a sequence under way.
    converting: bool,
    /// A fault of the bench: conversions no longer start.
    stalled: bool,
    /// Configuration in force, in the order of [`CONFIGURATION`].
    configured: [u64; CONFIGURATION.len()],
    /// A fault of the bench: the next scan ends after some of its conversions.
    cut: bool,
    /// Conversions of the scan under way.
    converted: u32,
    started: u64,
    ignored: u64,
    /// Scans that a fault kept from starting or cut short.
    spoilt: u64,
}

impl TriggeredAdc {
    pub(super) fn new() -> Self {
        let mut adc = Adc::new(Converter::Adc1, 0);
        adc.set_reference(REFERENCE_MICROVOLT);
        Self {
            adc,
            external: 0,
            armed: false,
            converting: false,
            stalled: false,
            configured: [0; CONFIGURATION.len()],
            cut: false,
            converted: 0,
            started: 0,
            ignored: 0,
            spoilt: 0,
        }
    }

    /// The voltage at input `channel` from now on. The emulator's converter takes the ratio of input and
    /// reference only, so both are given in microvolts: a millivolt would be twenty codes.
    pub fn set_input(&mut self, channel: u8, microvolt: u32) {
        if let Some(channel) = Channel::new(channel) {
            self.adc.set_input(channel, microvolt);
        }
    }

    /// VREF+ from now on, µV.
    pub(super) fn set_reference(&mut self, microvolt: u32) {
        self.adc.set_reference(microvolt);
    }

    /// The fault "the converter no longer starts", or its end.
    pub fn stall(&mut self, stalled: bool) {
        self.stalled = stalled;
    }

    /// The fault "a scan is cut short": the next one ends after [`CUT_AFTER`] conversions, without its end of sequence.
    pub fn cut_next_scan(&mut self) {
        self.cut = true;
    }

    /// Sequences started by a trigger, and triggers ignored because a sequence ran.
    #[must_use]
    pub fn triggers(&self) -> (u64, u64) {
        (self.started, self.ignored)
    }

    /// Scans that a fault kept from starting or cut short.
    #[must_use]
    pub fn spoilt(&self) -> u64 {
        self.spoilt
    }

    fn disarm(&mut self) {
        self.external = 0;
        self.configured = [0; CONFIGURATION.len()];
        self.cut = false;
        self.armed = false;
        self.converting = false;
    }

    /// What the emulator's converter did to `ADSTART` in the call just made.
    fn follow(&mut self, registers: &RegisterFile) {
        self.converting = registers.get(Register::Cr) & ADSTART != 0;
    }

    fn trigger(&mut self, source: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let listening = self.armed && self.external & EXTSEL == source << EXTSEL_SHIFT;
        if !listening {
            return;
        }
        if self.stalled {
            self.spoilt += 1;
            return;
        }
        if self.converting {
            self.ignored += 1;
            return;
        }
        self.started += 1;
        self.converted = 0;
        let control = registers.get(Register::Cr) | ADSTART;
        registers.set(Register::Cr, control);
        self.adc.write(Register::Cr, control, registers, context);
    }

    /// `CR`: with a trigger selected `ADSTART` arms and goes no further; `ADSTP` disarms.
    fn write_control(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let mut landed = registers.get(Register::Cr);
        if self.external & EXTEN != 0 && landed & ADSTART != 0 && landed & ADEN != 0 {
            self.armed = true;
        }
        if self.armed {
            if landed & ADSTP != 0 {
                self.armed = false;
                if !self.converting {
                    landed &= !ADSTP;
                }
            } else if landed & ADDIS != 0 {
                context.tell("CR", DISABLED_WHILE_ARMED);
                landed &= !ADDIS;
            }
            if !self.converting {
                landed &= !ADSTART;
            }
        }
        registers.set(Register::Cr, landed);
        self.adc.write(Register::Cr, landed, registers, context);
    }

    /// Configuration: kept as it is while `ADSTART` stands. Of `CFGR` the trigger fields are kept here, and the converter
    /// inside sees a software start.
    fn write_configuration(
        &mut self,
        nth: usize,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        let (register, name) = CONFIGURATION[nth];
        let landed = registers.get(register);
        if !self.armed {
            self.configured[nth] = landed;
        } else if landed != self.configured[nth] {
            context.tell(name, CHANGED_WHILE_ARMED);
        }
        let mut kept = self.configured[nth];
        if register == Register::Cfgr {
            self.external = kept & EXTERNAL;
            kept &= !EXTERNAL;
        }
        registers.set(register, kept);
        self.adc.write(register, kept, registers, context);
    }

    /// Ends the scan under way after some of its conversions, if that is asked for.
    fn cut_scan(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if !(self.cut && self.armed && self.converting) {
            return;
        }
        self.converted += 1;
        if self.converted >= CUT_AFTER {
            self.cut = false;
            self.spoilt += 1;
            let control = registers.get(Register::Cr) | ADSTP;
            registers.set(Register::Cr, control);
            self.adc.write(Register::Cr, control, registers, context);
        }
    }

    /// What a read adds to the value of the converter inside.
    fn shown(&self, register: Register) -> u64 {
        match register {
            Register::Cfgr => self.external,
            Register::Cr if self.armed => ADSTART,
            _ => 0,
        }
    }
}

impl Device for TriggeredAdc {
    type Register = Register;

    fn layout(&self) -> &'static [RegisterSpec] {
        self.adc.layout()
    }

    fn read(
        &mut self,
        register: Register,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) -> Option<u64> {
        let value = self.adc.read(register, registers, context);
        match self.shown(register) {
            0 => value,
            added => Some(value.unwrap_or_else(|| registers.get(register)) | added),
        }
    }

    fn peek(&self, register: Register, registers: &RegisterFile, now: VirtualNanos) -> Option<u64> {
        let value = self.adc.peek(register, registers, now);
        match self.shown(register) {
            0 => value,
            added => Some(value.unwrap_or_else(|| registers.get(register)) | added),
        }
    }

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            Register::Cr => self.write_control(registers, context),
            Register::Isr if value & TRIGGER != 0 => {
                self.trigger((value & SOURCE) >> SOURCE_SHIFT, registers, context);
            }
            _ => match CONFIGURATION.iter().position(|(other, _)| *other == register) {
                Some(nth) => self.write_configuration(nth, registers, context),
                None => self.adc.write(register, value, registers, context),
            },
        }
        self.follow(registers);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.adc.on_event(event, registers, context);
        self.cut_scan(registers, context);
        self.follow(registers);
    }

    fn on_request(
        &mut self,
        change: RequestChange,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        self.adc.on_request(change, registers, context);
    }

    fn on_clock(&mut self, hz: u64, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.adc.on_clock(hz, registers, context);
    }

    fn reset(&mut self) {
        self.disarm();
        self.adc.reset();
    }

    fn reset_line(&mut self, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        self.disarm();
        self.adc.reset_line(registers, context);
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Bench;
    use super::*;
    use rigless::soc::stm32h743::generated::{ADC1, RCC, TIM6};

    const ISR: u64 = 0x00;
    const CR: u64 = 0x08;
    const CFGR: u64 = 0x0C;
    const SMPR2: u64 = 0x18;
    const PCSEL: u64 = 0x1C;
    const SQR1: u64 = 0x30;
    const DR: u64 = 0x40;
    const EOC: u64 = 1 << 2;
    const EOS: u64 = 1 << 3;
    const ADVREGEN: u64 = 1 << 28;
    const RISING: u64 = 1 << 10;
    const TIM6_RISING: u64 = RISING | TIM6_TRGO << EXTSEL_SHIFT;
    const PERIOD: u64 = 100_000;
    /// The tests convert one or two channels: a few microseconds at 32 MHz.
    const SCAN: u64 = 20_000;

    fn write(bench: &mut Bench, offset: u64, value: u64) {
        bench.write(ADC1.base + offset, value);
    }

    fn read(bench: &mut Bench, offset: u64) -> u64 {
        bench.read(ADC1.base + offset)
    }

    /// ADC1 enabled, converting input 10 with `cfgr`, and TIM6 sending its update every 100 µs.
    fn enabled(cfgr: u64) -> Bench {
        let mut bench = Bench::new();
        // The kernel clock of the converter: ADCSEL = per_ck, from the 64 MHz HSI (sections 8.7.21, 8.7.22).
        bench.write(RCC.base + 0x58, 2 << 16);
        write(&mut bench, CR, ADVREGEN);
        bench.advance(20_000);
        write(&mut bench, CR, ADVREGEN | ADEN);
        bench.advance(20_000);
        assert_eq!(read(&mut bench, ISR) & 1, 1, "ADRDY");
        write(&mut bench, PCSEL, 1 << 10);
        write(&mut bench, SMPR2, 0b010);
        write(&mut bench, SQR1, 10 << 6);
        write(&mut bench, CFGR, cfgr);
        bench.part.adc1.set_input(10, REFERENCE_MICROVOLT / 2);
        // 64 MHz, PSC 0, ARR 6399, update as TRGO, counter on.
        bench.write(TIM6.base + 0x2C, 6399);
        bench.write(TIM6.base + 0x04, 0b010 << 4);
        bench.write(TIM6.base, 1);
        // From half-way between two updates on, a period always holds one update and its scan.
        bench.advance(PERIOD / 2);
        bench
    }

    fn conversions(bench: &mut Bench) -> bool {
        let flags = read(bench, ISR);
        write(bench, ISR, EOC | EOS);
        if flags & EOC != 0 {
            let _ = read(bench, DR);
        }
        flags & EOS != 0
    }

    #[test]
    fn armed_it_converts_once_for_each_update_of_the_timer() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        assert!(!conversions(&mut bench), "arming alone converts nothing");
        for _ in 0..5 {
            bench.advance(PERIOD / 2 - 1);
            assert!(!conversions(&mut bench), "the update is one nanosecond away");
            bench.advance(SCAN);
            assert!(conversions(&mut bench));
            bench.advance(PERIOD / 2 + 1 - SCAN);
            assert!(!conversions(&mut bench));
        }
        assert_eq!(bench.part.adc1.triggers(), (5, 0));
        assert!(bench.told().is_empty());
    }

    #[test]
    fn adstart_and_the_trigger_fields_read_back_while_it_waits() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        assert_eq!(read(&mut bench, CR) & ADSTART, ADSTART);
        assert_eq!(read(&mut bench, CFGR) & EXTERNAL, TIM6_RISING);
        bench.advance(3 * PERIOD);
        assert_eq!(read(&mut bench, CR) & ADSTART, ADSTART, "25.4.18: it stays set from scan to scan");
    }

    #[test]
    fn an_update_does_nothing_before_adstart_or_after_adstp() {
        let mut bench = enabled(TIM6_RISING);
        bench.advance(3 * PERIOD);
        assert!(!conversions(&mut bench));
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.advance(PERIOD);
        assert!(conversions(&mut bench));
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTP);
        assert_eq!(read(&mut bench, CR) & (ADSTART | ADSTP), 0);
        bench.advance(3 * PERIOD);
        assert!(!conversions(&mut bench));
        assert!(bench.told().is_empty(), "stopping an idle armed converter is lawful");
    }

    #[test]
    fn stopping_during_a_scan_drops_it() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.advance(PERIOD / 2);
        assert_eq!(bench.part.adc1.triggers(), (1, 0), "the scan has just begun");
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTP);
        bench.advance(3 * PERIOD);
        assert!(!conversions(&mut bench));
        assert_eq!(read(&mut bench, CR) & (ADSTART | ADSTP), 0);
    }

    #[test]
    fn without_exten_adstart_converts_at_once_and_clears() {
        let mut bench = enabled(0);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.advance(SCAN);
        assert!(conversions(&mut bench));
        assert_eq!(read(&mut bench, CR) & ADSTART, 0);
        bench.advance(3 * PERIOD);
        assert!(!conversions(&mut bench));
    }

    #[test]
    fn another_source_is_not_listened_to() {
        let mut bench = enabled(RISING | 9 << EXTSEL_SHIFT);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.advance(5 * PERIOD);
        assert!(!conversions(&mut bench));
        assert_eq!(bench.part.adc1.triggers(), (0, 0));
    }

    #[test]
    fn configuration_stays_as_it_is_while_adstart_stands_and_the_write_is_told() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        for (offset, other) in [(CFGR, 0), (SMPR2, 0b111), (PCSEL, 1 << 3), (SQR1, 3 << 6)] {
            let before = read(&mut bench, offset);
            write(&mut bench, offset, other);
            assert_eq!(read(&mut bench, offset), before, "{offset:#x}");
            assert_eq!(bench.told(), [CHANGED_WHILE_ARMED], "{offset:#x}");
        }
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTP);
        write(&mut bench, SMPR2, 0b111);
        assert_eq!((read(&mut bench, SMPR2), bench.told().len()), (0b111, 0));
    }

    #[test]
    fn a_scan_that_is_cut_short_has_no_end_and_the_next_one_is_whole() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, SQR1, 10 << 6 | 10 << 12 | 10 << 18 | 10 << 24 | 3);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.part.adc1.cut_next_scan();
        bench.advance(PERIOD);
        assert!(!conversions(&mut bench));
        bench.advance(PERIOD);
        assert!(conversions(&mut bench));
        assert_eq!(bench.part.adc1.triggers(), (2, 0));
    }

    #[test]
    fn every_edge_setting_takes_the_pulse_once() {
        for exten in 1..=3_u64 {
            let mut bench = enabled(exten << 10 | TIM6_TRGO << EXTSEL_SHIFT);
            write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
            bench.advance(PERIOD);
            assert_eq!(bench.part.adc1.triggers(), (1, 0), "EXTEN {exten}");
        }
    }

    #[test]
    fn an_update_during_a_scan_is_ignored() {
        let mut bench = enabled(TIM6_RISING);
        // Sixteen conversions of 25.6 µs: the scan takes four periods.
        write(&mut bench, SMPR2, 0b111);
        write(&mut bench, SQR1, 10 << 6 | 15);
        for offset in [0x34, 0x38, 0x3C] {
            write(&mut bench, offset, 10 | 10 << 6 | 10 << 12 | 10 << 18 | 10 << 24);
        }
        write(&mut bench, SQR1, 10 << 6 | 10 << 12 | 10 << 18 | 10 << 24 | 15);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.advance(5 * PERIOD);
        let (started, ignored) = bench.part.adc1.triggers();
        // Updates at 0.5, 1.5 … 4.5 periods from here; the scan from the first lasts to 4.6.
        assert_eq!((started, ignored), (1, 4));
    }

    #[test]
    fn the_trigger_is_locked_while_armed() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        write(&mut bench, CFGR, 0);
        assert_eq!(read(&mut bench, CFGR) & EXTERNAL, TIM6_RISING);
        assert_eq!(bench.told(), [CHANGED_WHILE_ARMED]);
        write(&mut bench, CR, ADVREGEN | ADEN | ADDIS);
        assert_eq!(bench.told(), [DISABLED_WHILE_ARMED]);
        bench.advance(PERIOD);
        assert!(conversions(&mut bench), "it is still armed");
    }

    #[test]
    fn the_code_is_the_inputs_share_of_the_reference_to_the_last_bit() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        // 100 µV is two codes: with the millivolts the emulator names it would vanish.
        for microvolt in [0, 100, 1_650_000, 1_650_100, REFERENCE_MICROVOLT, REFERENCE_MICROVOLT + 1000] {
            bench.part.adc1.set_input(10, microvolt);
            bench.advance(PERIOD);
            let expected = (u64::from(microvolt) * 65_535 / u64::from(REFERENCE_MICROVOLT)).min(65_535);
            assert_eq!(read(&mut bench, DR), expected);
        }
    }

    #[test]
    fn stalled_it_starts_no_more_scans() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        bench.advance(PERIOD);
        assert!(conversions(&mut bench));
        bench.part.adc1.stall(true);
        bench.advance(3 * PERIOD);
        assert!(!conversions(&mut bench));
        bench.part.adc1.stall(false);
        bench.advance(PERIOD);
        assert!(conversions(&mut bench));
    }

    #[test]
    fn a_reset_disarms_it_and_keeps_the_voltages_at_its_inputs() {
        let mut bench = enabled(TIM6_RISING);
        write(&mut bench, CR, ADVREGEN | ADEN | ADSTART);
        Device::reset(&mut bench.part.adc1);
        assert_eq!(bench.part.adc1.shown(Register::Cr), 0);
        assert_eq!(bench.part.adc1.shown(Register::Cfgr), 0);
    }
}
