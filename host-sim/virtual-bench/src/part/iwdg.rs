//! The independent watchdog, RM0433 rev 9, chapter 45, which the emulator carries as a register file only.
//!
//! | rule | section |
//! |---|---|
//! | `0xCCCC` in `KR` starts it and forces the LSI on; nothing but a reset stops it; the count starts at `0xFFF` | 45.3.1, 45.3.3 |
//! | `0xAAAA` reloads the counter from the reload value in force | 45.3.1 |
//! | `0x5555` opens `PR`, `RLR` and `WINR`; any other key, the reload among them, closes them; a write to a closed register is lost | 45.3.5 |
//! | A new value takes up to five LSI cycles to reach the watchdog's own supply domain (here: five); `PVU`, `RVU`, `WVU` stand meanwhile, and for ever while the LSI is off | 45.4.2 to 45.4.5 |
//! | Those registers read what is in force, so an old value while the flag stands; a second write while the flag stands does not count | 45.4.2 to 45.4.5 |
//! | The counter loses one each 4·2^PR LSI cycles (256 at most); past its last count it resets the part: (RL + 1) · 4·2^PR / f_LSI from a reload | 45.3.1 |
//! | A reload while the counter is above the window resets the part; a write of `WINR` with all flags clear reloads the counter | 45.3.2 |
//!
//! Left out: the hardware start by option byte, the freeze in debug and in the low-power modes, and the
//! phase between bus clock and LSI (up to one LSI cycle of uncertainty on silicon).

use rigless::device::{Device, DeviceContext, Level, RegisterFile};
use rigless::soc::stm32h743::generated::iwdg::{Register, sr};
use rigless::time::{EventId, VirtualNanos};
use serde::{Deserialize, Serialize};

const KEY_START: u64 = 0xCCCC;
const KEY_RELOAD: u64 = 0xAAAA;
const KEY_OPEN: u64 = 0x5555;
const COUNT_MASK: u64 = 0xFFF;
/// LSI cycles a new value takes to come into force.
const UPDATE_CYCLES: u64 = 5;
/// The request line on which the clock controller hears that the LSI must run.
const STARTED_REQUEST: usize = 0;
const LOST_WRITE: &str =
    "a value was written while the one before it was still on its way, so it does not count";

/// The three values that cross into the watchdog's supply domain.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
enum Value {
    Prescaler,
    Reload,
    Window,
}

impl Value {
    const ALL: [Self; 3] = [Self::Prescaler, Self::Reload, Self::Window];

    const fn mask(self) -> u64 {
        match self {
            Self::Prescaler => 0b111,
            Self::Reload | Self::Window => COUNT_MASK,
        }
    }

    const fn register(self) -> Register {
        match self {
            Self::Prescaler => Register::Pr,
            Self::Reload => Register::Rlr,
            Self::Window => Register::Winr,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Prescaler => "PR",
            Self::Reload => "RLR",
            Self::Window => "WINR",
        }
    }

    const fn flag(self) -> &'static rigless::soc::FieldSpec {
        match self {
            Self::Prescaler => sr::PVU,
            Self::Reload => sr::RVU,
            Self::Window => sr::WVU,
        }
    }
}

/// A value on its way, and the event at which it comes into force (none while the LSI is off).
#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
struct Update {
    value: u64,
    event: Option<EventId>,
}

/// The watchdog.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Iwdg {
    running: bool,
    open: bool,
    /// In force, by [`Value`].
    force: [u64; 3],
    updates: [Option<Update>; 3],
    lsi_hz: u64,
    /// The counter as it stood at `counted_from`.
    count: u64,
    counted_from: VirtualNanos,
    expiry: Option<EventId>,
    reloads: u64,
}

impl Default for Iwdg {
    fn default() -> Self {
        Self {
            running: false,
            open: false,
            force: [0, COUNT_MASK, COUNT_MASK],
            updates: [None; 3],
            lsi_hz: 0,
            count: COUNT_MASK,
            counted_from: VirtualNanos(0),
            expiry: None,
            reloads: 0,
        }
    }
}

impl Iwdg {
    /// Whether it was started since the last reset.
    #[must_use]
    pub fn running(&self) -> bool {
        self.running
    }

    /// How often the firmware reloaded it since the last reset.
    #[must_use]
    pub fn reloads(&self) -> u64 {
        self.reloads
    }

    fn in_force(&self, value: Value) -> u64 {
        self.force[value as usize]
    }

    fn lsi_cycles_a_count(&self) -> u64 {
        4 << self.in_force(Value::Prescaler).min(6)
    }

    /// Whole LSI cycles since the counter stood at `count`.
    fn cycles_since(&self, now: VirtualNanos) -> u64 {
        let nanos = u128::from(now.0.saturating_sub(self.counted_from.0));
        u64::try_from(nanos * u128::from(self.lsi_hz) / 1_000_000_000).unwrap_or(u64::MAX)
    }

    fn after_cycles(&self, from: VirtualNanos, cycles: u64) -> VirtualNanos {
        let nanos = (u128::from(cycles) * 1_000_000_000).div_ceil(u128::from(self.lsi_hz.max(1)));
        VirtualNanos(from.0.saturating_add(u64::try_from(nanos).unwrap_or(u64::MAX)))
    }

    fn counter(&self, now: VirtualNanos) -> u64 {
        self.count.saturating_sub(self.cycles_since(now) / self.lsi_cycles_a_count())
    }

    /// Keeps what was counted so far and counts on from here with the values now in force.
    fn rebase(&mut self, count: u64, context: &mut DeviceContext<'_>) {
        self.count = count;
        self.counted_from = context.now();
        self.expiry = None;
        if self.running && self.lsi_hz > 0 {
            let end = self.after_cycles(context.now(), (count + 1) * self.lsi_cycles_a_count());
            self.expiry = Some(context.schedule(end));
        }
    }

    fn reload(&mut self, context: &mut DeviceContext<'_>) {
        if self.running && self.counter(context.now()) > self.in_force(Value::Window) {
            context.request_reset();
            return;
        }
        let value = self.in_force(Value::Reload);
        self.rebase(value, context);
    }

    fn key(&mut self, key: u64, context: &mut DeviceContext<'_>) {
        self.open = key == KEY_OPEN;
        match key {
            KEY_START if !self.running => {
                self.running = true;
                self.rebase(COUNT_MASK, context);
                context.request(STARTED_REQUEST, Level::High);
            }
            KEY_RELOAD => {
                self.reloads += 1;
                self.reload(context);
            }
            _ => {}
        }
    }

    fn write_value(&mut self, value: Value, written: u64, context: &mut DeviceContext<'_>) {
        if !self.open {
            return;
        }
        if self.updates[value as usize].is_some() {
            context.tell(value.name(), LOST_WRITE);
            return;
        }
        let quiet = self.updates.iter().all(Option::is_none);
        self.updates[value as usize] = Some(Update { value: written & value.mask(), event: None });
        self.schedule_updates(context);
        if value == Value::Window && quiet && self.running {
            let reload = self.in_force(Value::Reload);
            self.rebase(reload, context);
        }
    }

    fn schedule_updates(&mut self, context: &mut DeviceContext<'_>) {
        if self.lsi_hz == 0 {
            return;
        }
        let at = self.after_cycles(context.now(), UPDATE_CYCLES);
        for update in self.updates.iter_mut().flatten().filter(|update| update.event.is_none()) {
            update.event = Some(context.schedule(at));
        }
    }

    /// What the registers read: the values in force and the flags of those on their way.
    fn show(&self, registers: &mut RegisterFile) {
        let mut status = 0;
        for value in Value::ALL {
            registers.set(value.register(), self.in_force(value));
            status = value.flag().set(status, u64::from(self.updates[value as usize].is_some()));
        }
        registers.set(Register::Sr, status);
    }
}

impl Device for Iwdg {
    type Register = Register;

    fn write(
        &mut self,
        register: Register,
        value: u64,
        registers: &mut RegisterFile,
        context: &mut DeviceContext<'_>,
    ) {
        match register {
            Register::Kr => self.key(value & 0xFFFF, context),
            Register::Pr => self.write_value(Value::Prescaler, value, context),
            Register::Rlr => self.write_value(Value::Reload, value, context),
            Register::Winr => self.write_value(Value::Window, value, context),
            Register::Sr => {}
        }
        self.show(registers);
    }

    fn on_event(&mut self, event: EventId, registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        let expired = self.expiry == Some(event);
        let mut updated = false;
        for value in Value::ALL {
            if let Some(update) = self.updates[value as usize].filter(|update| update.event == Some(event)) {
                if !updated {
                    // What was counted so far was counted with the old prescaler.
                    self.count = self.counter(context.now());
                    self.counted_from = context.now();
                    updated = true;
                }
                self.force[value as usize] = update.value;
                self.updates[value as usize] = None;
            }
        }
        if updated {
            let count = self.count;
            self.rebase(count, context);
            self.show(registers);
        }
        if expired {
            self.expiry = None;
            context.request_reset();
        }
    }

    fn on_clock(&mut self, hz: u64, _registers: &mut RegisterFile, context: &mut DeviceContext<'_>) {
        if hz == self.lsi_hz {
            return;
        }
        let count = if self.lsi_hz > 0 { self.counter(context.now()) } else { self.count };
        self.lsi_hz = hz;
        for update in self.updates.iter_mut().flatten() {
            update.event = None;
        }
        self.rebase(count, context);
        self.schedule_updates(context);
    }

    fn reset(&mut self) {
        *self = Self::default();
    }
}

#[cfg(test)]
mod tests {
    use super::super::testing::Bench;
    use super::*;
    use rigless::device::ResetCause;
    use rigless::soc::stm32h743::generated::{IWDG, RCC};

    const KR: u64 = 0x00;
    const PR: u64 = 0x04;
    const RLR: u64 = 0x08;
    const SR: u64 = 0x0C;
    const WINR: u64 = 0x10;
    /// One cycle of the 32 kHz LSI.
    const LSI_NANOS: u64 = 31_250;

    fn write(bench: &mut Bench, offset: u64, value: u64) {
        bench.write(IWDG.base + offset, value);
    }

    fn read(bench: &mut Bench, offset: u64) -> u64 {
        bench.read(IWDG.base + offset)
    }

    /// Moves on until the part resets, and says after how long.
    fn time_to_reset(bench: &mut Bench, at_most: u64) -> Option<u64> {
        let start = bench.now();
        while bench.now() - start < at_most {
            bench.advance(LSI_NANOS / 2);
            if bench.take_reset() == Some(ResetCause::Model("IWDG")) {
                return Some(bench.now() - start);
            }
        }
        None
    }

    /// Started, and past the start-up of the LSI, which the emulator's clock controller takes from the data sheet.
    fn started() -> Bench {
        let mut bench = Bench::new();
        write(&mut bench, KR, KEY_START);
        while bench.part.iwdg.lsi_hz == 0 {
            assert!(bench.now() < 1_000_000, "the LSI does not start");
            bench.advance(1000);
        }
        bench
    }

    fn configured(prescaler: u64, reload: u64) -> Bench {
        let mut bench = started();
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, PR, prescaler);
        write(&mut bench, RLR, reload);
        bench.advance(UPDATE_CYCLES * LSI_NANOS + 1);
        assert_eq!(read(&mut bench, SR), 0);
        write(&mut bench, KR, KEY_RELOAD);
        bench
    }

    #[test]
    fn it_does_nothing_until_it_is_started() {
        let mut bench = Bench::new();
        assert_eq!(time_to_reset(&mut bench, 600_000_000), None);
        assert!(!bench.part.iwdg.running());
    }

    #[test]
    fn started_alone_it_counts_from_its_reset_value() {
        let mut bench = started();
        let nanos = time_to_reset(&mut bench, 1_000_000_000).unwrap();
        // 4096 counts of 4 LSI cycles; one cycle of tolerance for the step of this test.
        assert!(nanos.abs_diff(4096 * 4 * LSI_NANOS) <= LSI_NANOS, "{nanos} ns");
    }

    #[test]
    fn the_time_to_reset_is_reload_plus_one_times_the_prescaler() {
        // Table of the minimum and maximum timeouts in the manual: 4 · 2^PR cycles a count, 256 at most.
        for (prescaler, cycles) in [(0, 4), (1, 8), (3, 32), (6, 256), (7, 256)] {
            let mut bench = configured(prescaler, 9);
            let nanos = time_to_reset(&mut bench, 1_000_000_000).unwrap();
            assert!(nanos.abs_diff(10 * cycles * LSI_NANOS) <= LSI_NANOS, "PR {prescaler}: {nanos} ns");
        }
    }

    #[test]
    fn reloading_in_time_keeps_the_part_running() {
        let mut bench = configured(0, 99);
        for _ in 0..20 {
            assert_eq!(time_to_reset(&mut bench, 99 * 4 * LSI_NANOS), None);
            write(&mut bench, KR, KEY_RELOAD);
        }
        assert_eq!(bench.part.iwdg.reloads(), 21);
        assert!(time_to_reset(&mut bench, 101 * 4 * LSI_NANOS).is_some());
    }

    #[test]
    fn its_registers_are_closed_without_the_key_and_any_other_key_closes_them() {
        let mut bench = started();
        let settle = UPDATE_CYCLES * LSI_NANOS + 1;
        for key in [None, Some(KEY_RELOAD), Some(0x1234), Some(KEY_START)] {
            write(&mut bench, KR, KEY_OPEN);
            match key {
                Some(key) => write(&mut bench, KR, key),
                None => write(&mut bench, KR, 0),
            }
            write(&mut bench, PR, 5);
            write(&mut bench, RLR, 5);
            write(&mut bench, WINR, 5);
            bench.advance(settle);
            assert_eq!([PR, RLR, WINR, SR].map(|r| read(&mut bench, r)), [0, 0xFFF, 0xFFF, 0], "{key:x?}");
        }
    }

    #[test]
    fn a_new_value_takes_five_lsi_cycles_and_its_flag_stands_meanwhile() {
        let mut bench = started();
        for (register, value, old, flag) in [(PR, 3, 0, 1), (RLR, 77, 0xFFF, 2), (WINR, 0xFF0, 0xFFF, 4)] {
            write(&mut bench, KR, KEY_OPEN);
            write(&mut bench, register, value);
            assert_eq!((read(&mut bench, register), read(&mut bench, SR)), (old, flag));
            bench.advance(UPDATE_CYCLES * LSI_NANOS - 1);
            assert_eq!((read(&mut bench, register), read(&mut bench, SR)), (old, flag));
            bench.advance(2);
            assert_eq!((read(&mut bench, register), read(&mut bench, SR)), (value, 0));
        }
    }

    #[test]
    fn before_the_start_there_is_no_lsi_and_the_flags_stand() {
        let mut bench = Bench::new();
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, RLR, 9);
        bench.advance(1_000_000_000);
        assert_eq!((read(&mut bench, RLR), read(&mut bench, SR)), (0xFFF, 2));
        write(&mut bench, KR, KEY_START);
        // 150 µs for the LSI to start, the data sheet's typical 130 µs among it.
        bench.advance(150_000 + UPDATE_CYCLES * LSI_NANOS);
        assert_eq!((read(&mut bench, RLR), read(&mut bench, SR)), (9, 0));
    }

    #[test]
    fn a_reload_before_the_new_value_is_in_force_takes_the_old_one() {
        let mut bench = started();
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, RLR, 9);
        write(&mut bench, KR, KEY_RELOAD);
        assert_eq!(time_to_reset(&mut bench, 400_000_000), None, "still counting from 0xFFF");
        write(&mut bench, KR, KEY_RELOAD);
        assert!(time_to_reset(&mut bench, 11 * 4 * LSI_NANOS).is_some());
    }

    #[test]
    fn a_second_value_on_top_of_one_under_way_is_lost_and_told() {
        let mut bench = started();
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, RLR, 100);
        write(&mut bench, RLR, 200);
        assert_eq!(bench.told(), [LOST_WRITE]);
        bench.advance(UPDATE_CYCLES * LSI_NANOS + 1);
        assert_eq!(read(&mut bench, RLR), 100);
    }

    #[test]
    fn a_reload_above_the_window_resets_and_one_inside_it_does_not() {
        let mut bench = configured(0, 99);
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, WINR, 50);
        bench.advance(UPDATE_CYCLES * LSI_NANOS + 1);
        bench.advance(60 * 4 * LSI_NANOS);
        write(&mut bench, KR, KEY_RELOAD);
        assert_eq!(bench.take_reset(), None);
        bench.advance(10 * 4 * LSI_NANOS);
        write(&mut bench, KR, KEY_RELOAD);
        assert_eq!(bench.take_reset(), Some(ResetCause::Model("IWDG")));
    }

    #[test]
    fn writing_the_window_with_all_flags_clear_reloads_the_counter() {
        let mut bench = configured(0, 99);
        bench.advance(90 * 4 * LSI_NANOS);
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, WINR, 0xFFF);
        assert_eq!(time_to_reset(&mut bench, 98 * 4 * LSI_NANOS), None);
    }

    #[test]
    fn after_a_reset_it_is_off_the_cause_is_flagged_and_it_can_be_started_again() {
        let mut bench = Bench::new();
        for _ in 0..2 {
            write(&mut bench, KR, KEY_START);
            assert!(time_to_reset(&mut bench, 600_000_000).is_some());
            assert!(!bench.part.iwdg.running());
            // RCC_RSR.IWDG1RSTF, section 8.7.39.
            assert_eq!(bench.read(RCC.base + 0xD0) >> 26 & 1, 1);
            assert_eq!([PR, RLR, WINR, SR].map(|r| read(&mut bench, r)), [0, 0xFFF, 0xFFF, 0]);
        }
    }

    #[test]
    fn nothing_stops_it_once_started() {
        let mut bench = Bench::new();
        write(&mut bench, KR, KEY_START);
        write(&mut bench, KR, 0);
        write(&mut bench, KR, KEY_OPEN);
        write(&mut bench, KR, KEY_START);
        assert!(time_to_reset(&mut bench, 600_000_000).is_some());
    }
}
