//! What the reference manual, the errata sheet and the wires ask of the firmware, one test each.

use super::firmware;
use host_sim::files::experiment_file::ExperimentFile;
use model_core::control::{Fault, Mode};
use object::{Object, ObjectSymbol};
use rig_link::message::{Answer, Command, Rejection};
use rig_link::model::ModelRecord;
use rig_link::telemetry::{BINS, Health, StartHistogram};
use std::sync::OnceLock;
use virtual_bench::bench::{self, Outcome};
use virtual_bench::campaign::listening_host::ListeningHost;
use virtual_bench::campaign::states::State;
use virtual_bench::defmt_log;
use virtual_bench::elf::Firmware;
use virtual_bench::endpoint::Endpoint;
use virtual_bench::error::BenchError;
use virtual_bench::experiment::{self, Request};
use virtual_bench::firmware_build;
use virtual_bench::outside::{Action, ReferenceWire};
use virtual_bench::part::Motor;
use virtual_bench::record::Saved;
use virtual_bench::stack;

/// The rig kept in this state, made once.
fn kept(state: State) -> &'static Saved {
    static KEPT: [OnceLock<Saved>; 5] = [const { OnceLock::new() }; 5];
    KEPT[state as usize].get_or_init(|| state.kept(firmware()).unwrap())
}

/// Goes on from a state.
fn from<T: Send>(
    state: State,
    operator: impl FnOnce(&mut Endpoint, &mut ListeningHost) -> Result<T, BenchError> + Send,
) -> Outcome<T> {
    bench::run_on(firmware(), kept(state), &std::env::temp_dir(), |endpoint| {
        let mut listener = ListeningHost::new();
        operator(endpoint, &mut listener)
    })
    .unwrap()
}

/// Waits two health records long, and gives the last.
fn health(endpoint: &mut Endpoint, listener: &mut ListeningHost) -> Result<Health, BenchError> {
    listener.health = None;
    listener.listen(endpoint, endpoint.now_ns() + 210_000_000)?;
    listener.health.ok_or_else(|| BenchError::Rig("it does not tell its health".to_owned()))
}

/// The time driver's static, as its symbol is mangled.
const DRIVER: &str = "11time_driver6driver6DRIVER";
/// `TIM3_CNT`, and the half turns that the driver counts.
const TIM3_COUNT: u64 = 0x4000_0424;
const HALF_TURN_NS: u64 = 32_768_000;

/// It takes a count whose lowest bit is not the counter's highest for one that is behind by one: a count that is ahead
/// gives a time that is 65.5 ms early just after each half turn, and now and then a task that sleeps as much too long.
#[test]
fn the_executors_count_of_half_turns_is_in_step_with_its_counter() {
    let object = object::File::parse(firmware().bytes.as_slice()).unwrap();
    let driver =
        object.symbols().find(|symbol| symbol.name().is_ok_and(|name| name.contains(DRIVER))).unwrap();
    let (address, length) = (driver.address(), driver.size());
    let (counts, half) = from(State::Idle, |endpoint, _| {
        // Well within a half turn, so that its interrupt was served.
        let mut count = endpoint.register(TIM3_COUNT)?;
        while !(0x2000..0x6000).contains(&(count & 0x7FFF)) {
            endpoint.wait_until(endpoint.now_ns() + HALF_TURN_NS / 4)?;
            count = endpoint.register(TIM3_COUNT)?;
        }
        let words = |bytes: Vec<u8>| -> Vec<u32> {
            bytes.chunks_exact(4).map(|word| u32::from_le_bytes(word.try_into().unwrap())).collect()
        };
        let before = words(endpoint.memory(address, length)?);
        endpoint.wait_until(endpoint.now_ns() + 3 * HALF_TURN_NS)?;
        let after = words(endpoint.memory(address, length)?);
        // Of its words the one that grows by one with each half turn.
        let counts: Vec<u32> =
            before.iter().zip(&after).filter(|(a, b)| b.wrapping_sub(**a) == 3).map(|(a, _)| *a).collect();
        Ok((counts, count >> 15))
    })
    .operator;
    assert_eq!(counts.len(), 1, "{counts:?}");
    assert_eq!(u64::from(counts[0] & 1), half & 1, "count {}", counts[0]);
}

#[test]
fn ticks_come_once_a_period_though_the_write_that_acknowledges_it_is_posted() {
    let ticks = from(State::Armed, |endpoint, _| {
        endpoint.begin_measuring()?;
        endpoint.wait_until(endpoint.now_ns() + 100_000_000)?;
        endpoint.end_measuring()
    })
    .operator;
    assert_eq!((ticks.instructions.count, ticks.late), (1000, 0), "control ticks in a tenth of a second");
}

#[test]
fn the_histograms_hold_every_tick_and_the_stack_its_mark() {
    let (health, mark) = from(State::Sliding, |endpoint, listener| {
        // In one tick in twenty the start is 4.5 µs late.
        endpoint.act(Action::MaskInterrupts { times: 20, from_ns: 3_500, for_ns: 6_000 })?;
        let health = health(endpoint, listener)?;
        Ok((health, stack::mark(endpoint)?))
    })
    .operator;
    let ticks = |counts: [u32; BINS]| counts.iter().map(|count| u64::from(*count)).sum::<u64>();
    assert_eq!(ticks(health.cycles.counts), health.tick, "{health:?}");
    assert_eq!(ticks(health.starts.counts) + u64::from(health.missed_scans), health.tick + 1, "{health:?}");
    let late: u32 = (0..BINS)
        .filter(|bin| StartHistogram::begin(*bin) >= 3_000)
        .map(|bin| health.starts.counts[bin])
        .sum();
    assert!(late >= 10, "starts that were made late are not in the histogram: {health:?}");
    let (used, size) = health.stack;
    assert_eq!(u64::from(size), stack::STACK.end - stack::STACK.start);
    // The mark may have moved since the record.
    assert!(used > 1_000 && mark - u64::from(used) < 2_000, "{used} of {size}, found {mark}");
}

#[test]
fn interrupts_masked_over_the_end_of_a_period_make_no_tick_more_or_less() {
    let (before, ticks, after) = from(State::Sliding, |endpoint, listener| {
        let before = health(endpoint, listener)?;
        // From 2 µs before the end of the period to 8 µs into the next, when its scan is in memory.
        endpoint.act(Action::MaskInterrupts { times: 20, from_ns: 98_000, for_ns: 10_000 })?;
        endpoint.begin_measuring()?;
        listener.listen(endpoint, endpoint.now_ns() + 100_000_000)?;
        let ticks = endpoint.end_measuring()?;
        Ok((before, ticks, health(endpoint, listener)?))
    })
    .operator;
    assert!(ticks.start_after_trigger_ns.max > 7_000, "interrupts were not masked: {ticks:?}");
    assert_eq!(ticks.instructions.count, 1000);
    assert_eq!(after.missed_scans, before.missed_scans);
    assert_eq!((after.mode, after.fault), (Mode::Running.number(), 0));
}

#[test]
fn a_torque_reference_that_does_not_arrive_is_a_fault() {
    for (state, motor, wire, fault) in [
        (State::Armed, Motor::M1, ReferenceWire::Open, Fault::M1TorqueMismatch),
        (State::Armed, Motor::M2, ReferenceWire::Open, Fault::M2TorqueMismatch),
        (State::Sliding, Motor::M1, ReferenceWire::Open, Fault::M1TorqueMismatch),
        (State::Sliding, Motor::M2, ReferenceWire::Open, Fault::M2TorqueMismatch),
        (State::Torque, Motor::M2, ReferenceWire::Reversed, Fault::M2TorqueMismatch),
        (State::Torque, Motor::M2, ReferenceWire::Scaled(0.5), Fault::M2TorqueMismatch),
        (State::Torque, Motor::M1, ReferenceWire::Held(2048), Fault::M1TorqueMismatch),
    ] {
        let outcome = from(state, |endpoint, listener| {
            listener.listen(endpoint, endpoint.now_ns() + 5_000_000)?;
            let at = endpoint.now_ns();
            endpoint.act(Action::Reference(motor, wire))?;
            let health = health(endpoint, listener)?;
            Ok((at, health))
        });
        let (at, health) = outcome.operator;
        assert_eq!(Fault::from_number(health.fault), Some(fault), "{state:?} {motor:?} {wire:?}");
        let safe = outcome.record.safe_for_good_from(at).unwrap() - at;
        assert!(safe < 6_000_000, "{state:?} {motor:?} {wire:?}: safe after {safe} ns");
    }
}

/// The scan comes back in step after one that the tick of the next period stops.
#[test]
fn a_scan_cut_short_is_started_anew_and_forgiven() {
    let (before, after, restarts) = {
        let outcome = from(State::Sliding, |endpoint, listener| {
            let before = health(endpoint, listener)?;
            endpoint.act(Action::AdcScanCut)?;
            listener.listen(endpoint, endpoint.now_ns() + 20_000_000)?;
            Ok((before, health(endpoint, listener)?))
        });
        (outcome.operator.0, outcome.operator.1, outcome.record.restarts)
    };
    assert!(restarts.is_empty(), "{restarts:?}");
    assert_eq!((after.mode, after.fault), (Mode::Running.number(), 0), "{after:?}");
    assert!(after.missed_scans > before.missed_scans, "no scan was cut");
}

/// A scan whose end is looked at while the next is under way is out of step, and its own handler stops the stream. That
/// raises the end-of-transfer flag: with its interrupt on the handler is entered again at its return, finds no scan, and stops
/// the stream again, until a scan happens to end between two of them. Red on `adc_scan::stop_stream` without `set_tcie(false)`
/// and `unpend`: 1008 ticks in the tenth of a second, ten of them in one period.
#[test]
fn a_stream_that_its_own_handler_stops_does_not_enter_it_again() {
    let outcome = from(State::Sliding, |endpoint, listener| {
        let before = health(endpoint, listener)?;
        // From before the end of the scan to 2.5 to 3.5 µs into the next, which takes 5.
        endpoint.act(Action::MaskInterrupts { times: 1, from_ns: 3_500, for_ns: 99_000 })?;
        endpoint.begin_measuring()?;
        listener.listen(endpoint, endpoint.now_ns() + 100_000_000)?;
        let ticks = endpoint.end_measuring()?;
        Ok((before, ticks, health(endpoint, listener)?))
    });
    let (before, ticks, after) = outcome.operator;
    assert!(outcome.record.restarts.is_empty(), "{:?}", outcome.record.restarts);
    // The scan under way was stopped: its own tick did not come, and nothing else is missed.
    assert_eq!((outcome.record.arrivals.len(), ticks.instructions.count), (1, 999), "{ticks:?}");
    let earliest = ticks.start_after_trigger_ns.min;
    assert!((2_000..5_000).contains(&earliest), "it was not looked at in the midst of a scan: {earliest} ns");
    assert_eq!(after.missed_scans, before.missed_scans);
    assert_eq!((after.mode, after.fault), (Mode::Running.number(), 0), "{after:?}");
}

#[test]
fn the_serial_streams_do_not_lock_up() {
    let after = from(State::Armed, |endpoint, listener| {
        endpoint.act(Action::SerialStreamsLockUp)?;
        listener.listen(endpoint, endpoint.now_ns() + 1_000_000_000)?;
        listener.ask(endpoint, &Command::Hello)?;
        health(endpoint, listener)
    })
    .operator;
    assert_eq!((after.mode, after.fault), (Mode::Armed.number(), 0));
}

#[test]
fn a_host_that_falls_silent_disarms_the_rig() {
    let outcome = from(State::Armed, |endpoint, listener| {
        listener.lively = false;
        let at = endpoint.now_ns();
        listener.listen(endpoint, at + 600_000_000)?;
        listener.lively = true;
        Ok((at, health(endpoint, listener)?))
    });
    let (at, health) = outcome.operator;
    assert_eq!(Fault::from_number(health.fault), Some(Fault::LinkLost));
    let safe = outcome.record.safe_for_good_from(at).unwrap() - at;
    assert!(safe < 600_000_000, "{safe} ns");
}

#[test]
fn a_model_is_stored_only_while_the_drives_are_off() {
    for state in [State::Armed, State::Sliding] {
        let (answers, after) = from(state, |endpoint, listener| {
            let answers = [
                listener.ask(endpoint, &Command::ModelSet(ModelRecord::default()))?,
                listener.ask(endpoint, &Command::ModelForget)?,
            ];
            Ok((answers, health(endpoint, listener)?))
        })
        .operator;
        let rejected = || Answer::Rejected(Rejection::NotDisabled);
        assert_eq!(answers, [rejected(), rejected()], "{state:?}");
        assert_eq!(after.fault, 0, "{state:?}");
    }
    let (set, read, forgotten) = from(State::Idle, |endpoint, listener| {
        Ok((
            listener.ask(endpoint, &Command::ModelSet(ModelRecord::default()))?,
            listener.ask(endpoint, &Command::ModelGet)?,
            listener.ask(endpoint, &Command::ModelForget)?,
        ))
    })
    .operator;
    let stored = || Answer::Model(Some(ModelRecord::default()));
    assert_eq!((set, read, forgotten), (stored(), stored(), Answer::Model(None)));
}

#[test]
fn a_restart_is_done_only_while_the_drives_are_off() {
    let answer = from(State::Armed, |endpoint, listener| listener.ask(endpoint, &Command::Restart)).operator;
    assert_eq!(answer, Answer::Rejected(Rejection::NotDisabled));
}

/// Lightly pressed, at the highest speed of the experiments.
const AT_300_RPM: &str = "[[m2]]\nstart_s = 0.0\nspeed_rpm = 0.0\n[[m2]]\nstart_s = 0.1\nspeed_rpm = 300.0\n";

/// At 300 rpm 3 µs are seven counts, and a jump is more than six. Red with `encoders::latched` that reads both counters in the
/// tick in place of what the DMA latched: M2EncoderJump.
#[test]
fn a_tick_that_is_late_by_microseconds_is_no_jump_of_the_encoder() {
    let saved = State::kept_during(firmware(), AT_300_RPM).unwrap();
    let outcome = bench::run_on(firmware(), &saved, &std::env::temp_dir(), |endpoint| {
        let mut listener = ListeningHost::new();
        // The tick is due 5 µs into the period: it comes 3 µs later.
        endpoint.act(Action::MaskInterrupts { times: 200, from_ns: 3_500, for_ns: 4_500 })?;
        endpoint.begin_measuring()?;
        listener.listen(endpoint, endpoint.now_ns() + 200_000_000)?;
        let ticks = endpoint.end_measuring()?;
        let speed = endpoint.motion()?.disc_speed_rad_s;
        Ok((ticks, speed, health(endpoint, &mut listener)?))
    })
    .unwrap();
    let (ticks, speed, health) = outcome.operator;
    assert!(ticks.start_after_trigger_ns.max > 7_500, "the tick was not late: {ticks:?}");
    assert_eq!((health.mode, Fault::from_number(health.fault)), (Mode::Running.number(), None));
    assert!(speed > 31.0, "{speed} rad/s");
}

/// The supervisor's budget of ticks at another distance than a period, which is that of late ticks.
const FORGIVEN: usize = 5;

/// Red with `tick_irregular: false` in the tick: it goes on.
#[test]
fn ticks_that_are_not_a_period_apart_are_a_fault_once_there_are_too_many() {
    const PERIOD_NS: u64 = 100_000;
    for state in [State::Armed, State::Sliding] {
        let outcome = from(state, |endpoint, listener| {
            listener.listen(endpoint, endpoint.now_ns() + 5_000_000)?;
            // The tick comes at 44 µs in place of 5: 139 µs after the one before, and 61 before the next.
            endpoint.act(Action::MaskInterrupts { times: 6, from_ns: 3_500, for_ns: 40_000 })?;
            health(endpoint, listener)
        });
        let arrivals = &outcome.record.arrivals;
        let periods: Vec<u64> =
            arrivals.iter().map(|at| (at - arrivals[0] + PERIOD_NS / 2) / PERIOD_NS).collect();
        let late = |period: &u64| periods.contains(period);
        // Those whose distance to the one before is none of a period: late after in time, or in time after late.
        let irregular: Vec<u64> =
            (0..10_000).filter(|period| late(period) != (*period > 0 && late(&(period - 1)))).collect();
        // The tick that finds it begins 5 µs into its period, at the latest 44.
        let known = arrivals[0] + irregular[FORGIVEN] * PERIOD_NS;
        assert_eq!(Fault::from_number(outcome.operator.fault), Some(Fault::TickIrregular), "{state:?}");
        let safe = outcome.record.safe_for_good_from(arrivals[0]).unwrap();
        println!(
            "{state:?}: masked in periods {periods:?}, safe {} ns after it was known",
            safe as i64 - known as i64
        );
        assert!(
            safe >= known && safe < known + 2 * PERIOD_NS,
            "{state:?}: safe at {safe}, known at {known}, {periods:?}"
        );
    }
}

#[test]
fn pulses_coupled_into_the_encoders_lines_do_not_count() {
    for state in [State::Armed, State::Sliding] {
        let after = from(state, |endpoint, listener| {
            for _ in 0..50 {
                endpoint.act(Action::EncoderDisturbed(Motor::M2, 20))?;
                listener.listen(endpoint, endpoint.now_ns() + 1_000_000)?;
            }
            health(endpoint, listener)
        })
        .operator;
        assert_eq!(after.fault, 0, "{state:?}");
    }
    // At rest every count is the disturbance's.
    let (before, after) = from(State::Armed, |endpoint, listener| {
        listener.ask(endpoint, &Command::Telemetry { every_ticks: 10 })?;
        listener.listen(endpoint, endpoint.now_ns() + 10_000_000)?;
        let before = listener.row;
        for _ in 0..50 {
            endpoint.act(Action::EncoderDisturbed(Motor::M2, 20))?;
            listener.listen(endpoint, endpoint.now_ns() + 1_000_000)?;
        }
        Ok((before, listener.row))
    })
    .operator;
    let (before, after) = (before.unwrap(), after.unwrap());
    assert!(after.tick > before.tick + 400);
    assert_eq!(before.m2_count, after.m2_count);
}

/// M2 is asked for all it has, for 20 ms.
const RATED: &str = "name = \"rated\"\ntitle = \"Rated torque\"\nduration_s = 0.1\nseed = 1\nlog_rate_hz = 1000\n\
    [[m1]]\nstart_s = 0.0\ntorque_fraction = 0.0\n[[m2]]\nstart_s = 0.0\ntorque_fraction = 0.0\n\
    [[m2]]\nstart_s = 0.02\ntorque_fraction = 1.0\n[[m2]]\nstart_s = 0.04\ntorque_fraction = 0.0\n";

#[test]
fn the_rated_torque_reaches_the_pin() {
    let mut request = Request::assumed("fig20").unwrap();
    request.experiment = ExperimentFile::parse("rated.toml", RATED).unwrap();
    request.capture = false;
    let done = experiment::run(firmware(), &request, |_, _| ()).unwrap();
    let codes = done.record.outputs.iter().filter_map(|(_, outputs)| outputs.dac[1]);
    assert_eq!(codes.max(), Some(4095));
}

#[test]
fn the_watchdog_counts_on_while_a_debugger_holds_the_core() {
    // DBGMCU_APB4FZ1 and its bit of the independent watchdog in RM0433.
    const FREEZE: u64 = 0x5C00_1054;
    let frozen = from(State::Armed, |endpoint, _| endpoint.register(FREEZE)).operator;
    assert_eq!(frozen >> 18 & 1, 0);
}

#[test]
fn a_supply_that_falls_makes_safe() {
    /// PWR_CR1, and EXTI_RTSR1 and EXTI_CPUIMR1 with the detector's line (RM0433 6.8.1, 20.6).
    const CR1: u64 = 0x5802_4800;
    const RTSR1: u64 = 0x5800_0000;
    const CPUIMR1: u64 = 0x5800_0080;
    let outcome = from(State::Sliding, |endpoint, listener| {
        let registers =
            (endpoint.register(CR1)?, endpoint.register(RTSR1)? >> 16, endpoint.register(CPUIMR1)? >> 16);
        let at = endpoint.now_ns();
        endpoint.act(Action::SupplyFalls)?;
        listener.listen(endpoint, at + 200_000_000)?;
        Ok((at, registers, listener.ask(endpoint, &Command::CrashRecord)?))
    });
    let (at, (control, rising, unmasked), record) = outcome.operator;
    // PVDE, and PLS at its highest level.
    assert_eq!((control >> 4 & 0b1111, rising & 1, unmasked & 1), (0b1101, 1, 1));
    // The next tick is 5 µs into the period.
    let safe = outcome.record.safe_for_good_from(at).unwrap() - at;
    assert!(safe < 10_000, "safe after {safe} ns");
    assert!(
        matches!(&record, Answer::CrashRecord(Some(record)) if record.text.contains("supply fell")),
        "{record:?}"
    );
}

#[test]
fn the_chip_tells_what_its_3_3_v_are_worth() {
    let told = |millivolt| {
        let hello = from(State::Idle, |endpoint, listener| {
            endpoint.act(Action::AnalogSupply(millivolt))?;
            endpoint.act(Action::ResetPin)?;
            listener.listen(endpoint, endpoint.now_ns() + 500_000_000)?;
            listener.ask(endpoint, &Command::Hello)
        })
        .operator;
        let Answer::Hello(hello) = hello else { panic!("{hello:?}") };
        hello.reference_mv
    };
    // A code of its reference is 0.15 mV of the supply.
    for millivolt in [3_300, 3_150, 3_420] {
        assert!(told(millivolt).abs_diff(millivolt as u16) <= 2, "{} of {millivolt}", told(millivolt));
    }
}

/// Runs the board's self-test until the log has a line with `last`: the log, whether the outputs are safe then, and how
/// often it restarted.
fn self_test(last: &str, crystal_hz: u64) -> (Vec<String>, bool, usize) {
    let elf = firmware_build::release_elf_of(firmware_build::SELF_TEST).unwrap();
    let program = Firmware::read(&elf).unwrap();
    let plant = Request::assumed("fig20").unwrap().plant().unwrap();
    let mut lines = Vec::new();
    let outcome = bench::run(&program, Box::new(plant), |endpoint| {
        endpoint.act(Action::LowSpeedCrystal(crystal_hz))?;
        let mut bytes = Vec::new();
        while !lines.iter().any(|line: &String| line.contains(last)) && endpoint.now_ns() < 15_000_000_000 {
            endpoint.wait_until(endpoint.now_ns() + 100_000_000)?;
            bytes.extend(endpoint.take_log()?.concat());
            lines = defmt_log::decode(&program.bytes, &[bytes.clone()])?.lines;
        }
        Ok(endpoint.outputs()?.is_safe())
    })
    .unwrap();
    (lines, outcome.operator, outcome.record.restarts.len())
}

/// The bench's clock is exact, so a crystal that is off is a clock that is off the other way.
#[test]
fn the_self_test_tells_a_clock_that_is_wrong_and_a_crystal_that_does_not_run() {
    for (crystal_hz, says) in [
        (
            33_200,
            "self-test: clock: FAILED: Failed { what: \"ppm that the clock is fast, 10 000 at most\", expected: 0, found: -130",
        ),
        (
            32_400,
            "self-test: clock: FAILED: Failed { what: \"ppm that the clock is fast, 10 000 at most\", expected: 0, found: 113",
        ),
        (32_500, "self-test: clock: ok"),
        (0, "self-test: clock: FAILED: Failed { what: \"the 32.768 kHz crystal does not start\""),
    ] {
        let (lines, ..) = self_test("self-test: clock", crystal_hz);
        assert!(lines.iter().any(|line| line.contains(says)), "{crystal_hz} Hz: {lines:#?}");
    }
}

/// Red on the self-test with the `adc_scan::convert_once` of 95e288c, which writes the converter's registers under ADSTART: the
/// bench refuses that.
#[test]
fn the_self_test_of_the_board_passes_with_the_shipped_start() {
    let (lines, safe, restarts) = self_test("self-test: done", 32_768);
    let said = |name: &str| lines.iter().find(|line| line.contains(&format!("self-test: {name}")));
    assert!(
        lines.iter().any(|line| line.contains("by the 32.768 kHz crystal the clock is 0 ppm fast")),
        "{lines:#?}"
    );
    for name in ["8 MHz", "clock", "models", "making safe", "loop-back", "ticks"] {
        let line = said(name).unwrap_or_else(|| panic!("{name} was not reached: {lines:#?}"));
        assert!(line.ends_with("ok"), "{line}");
    }
    // The bench has wires where the board must have none, and no pull resistors that move a timer's input.
    for (name, why) in [("inputs", "reads as"), ("encoders", "counts of M1")] {
        assert!(said(name).unwrap().contains(why), "{:?}", said(name));
    }
    assert!(said("done, 2 failed").is_some(), "{lines:#?}");
    assert_eq!((safe, restarts), (true, 0));
}
