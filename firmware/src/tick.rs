//! The control tick: 10 000 times a second, in the interrupt at the end of the scan.
//!
//! TIM6 starts the scan; 5 µs later the scan's DMA interrupt runs the tick. TIM6's own interrupt, at the
//! same priority, only looks whether the period before it had its tick: if the scan did not come, it runs
//! the tick with the old codes, so that the supervisor notices and acts. Nothing in here waits, locks,
//! logs, allocates or formats. What goes out goes into queues with one reader and one writer, and
//! what finds no room is counted.
//!
//! **One tick a period, whatever is masked.** Of the two interrupts the DMA's has the lower number and goes first where
//! both wait. It then takes the period's begin too, so that TIM6's finds nothing left. The number of the period comes
//! from the DMA that latches the encoders (`encoders.rs`), and the distance of two ticks from the cycle counter: a tick
//! at another distance than a period is counted, and too many of them are a fault.
//!
//! PE13 is high from the tick's entry to its exit: the time on an oscilloscope, the instructions on an emulator.

use crate::capture::Recorder;
use crate::memory::M2_LATCHES;
use crate::watchdog::Feeder;
use crate::{adc_scan, board, clocks, encoders, inputs, outputs};
use core::cell::UnsafeCell;
use core::hint::black_box;
use core::mem::MaybeUninit;
use core::sync::atomic::Ordering::{Relaxed, Release};
use core::sync::atomic::{AtomicBool, AtomicU32};
use cortex_m::peripheral::{DWT, NVIC};
use embassy_stm32::interrupt;
use embassy_stm32::interrupt::{InterruptExt, Priority};
use embassy_stm32::pac::Interrupt;
use heapless::spsc::{Consumer, Producer, Queue};
use model_core::control::{
    Command, ControlConfig, ControlState, DAC_ZERO, Event, Fault, Leds, Outputs, Refused, Samples,
    SequencerState, apply, step,
};
use rig_link::capture::CaptureTrigger;
use rig_link::inputs::Inputs;
use rig_link::telemetry::{CycleHistogram, Health, StartHistogram, TelemetryRow};
use static_cell::StaticCell;

/// Cycles of a control period.
const PERIOD_CYCLES: u32 = clocks::CORE_HZ / board::TICK_HZ;
/// Shortest and longest distance of two ticks that is still a period: a quarter less or more. A tick comes late by what
/// masks or outranks it, microseconds; what is a quarter of a period off is not the next period's tick.
const SHORTEST: u32 = PERIOD_CYCLES / 4 * 3;
const LONGEST: u32 = PERIOD_CYCLES / 4 * 5;

/// What a thread asks of the tick. One order is taken a tick, and answered.
pub enum Order {
    /// A command to the control core.
    Core(Command<'static>),
    /// A row every so many ticks; 0 stops.
    Telemetry(u16),
    /// Begin a capture.
    CaptureArm(CaptureTrigger),
    /// Trigger the capture.
    CaptureTrigger,
    /// The raw readings of this tick, into their queue.
    Inputs,
}

/// What came of an order.
pub type Carried = Result<(), Refused>;

const ROWS: usize = 64;
const EVENTS: usize = 32;
/// Ticks between two health records.
const HEALTH_TICKS: u16 = 1000;

/// The threads' ends of the queues.
pub struct Ends {
    /// Orders to the tick.
    pub orders: Producer<'static, Order>,
    /// Answers to them, in order.
    pub answers: Consumer<'static, Carried>,
    /// Raw readings that were ordered.
    pub inputs: Consumer<'static, Inputs>,
    /// Telemetry.
    pub rows: Consumer<'static, TelemetryRow>,
    /// Health.
    pub health: Consumer<'static, Health>,
    /// Events of the control core.
    pub events: Consumer<'static, Event>,
}

struct Tick {
    config: ControlConfig,
    state: ControlState,
    orders: Consumer<'static, Order>,
    answers: Producer<'static, Carried>,
    inputs: Producer<'static, Inputs>,
    rows: Producer<'static, TelemetryRow>,
    health_out: Producer<'static, Health>,
    events: Producer<'static, Event>,
    recorder: Recorder,
    feeder: Feeder,
    /// The tick of this period has run.
    ran: bool,
    late: bool,
    /// Period in which the encoders of the last tick were latched.
    period: u32,
    /// Codes put out in the last tick.
    dac: [u16; 2],
    /// Cycle counter at the begin of the last tick that a scan started; none after one that no scan started.
    started: Option<u32>,
    every_ticks: u16,
    until_row: u16,
    until_health: u16,
    sequence: u32,
    rows_lost: u32,
    missed_scans: u32,
    cycles: u32,
    cycles_max: u32,
    start_min: u16,
    start_max: u16,
    cycles_histogram: CycleHistogram,
    start_histogram: StartHistogram,
}

struct TickCell(UnsafeCell<MaybeUninit<Tick>>);

// SAFETY: the cell is shared by `start` in a thread and by the handlers of two interrupts. `start` passes once only
// (its `StaticCell`s panic the second time) and writes the cell while both interrupts are still disabled in the NVIC.
// From then on only the two handlers use it (`the_tick`), and as they have the same priority neither can begin while the
// other runs. `Tick` itself is `Send`: it is made in a thread and used in the handlers.
unsafe impl Sync for TickCell where Tick: Send {}

static TICK: TickCell = TickCell(UnsafeCell::new(MaybeUninit::uninit()));
static NOW: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];
static LINK_HEARD: AtomicBool = AtomicBool::new(false);
static MODE: AtomicU32 = AtomicU32::new(0);

/// The control tick now.
#[must_use]
pub fn now() -> u64 {
    u64::from(NOW[0].load(Relaxed)) | u64::from(NOW[1].load(Relaxed)) << 32
}

/// Number of the supervisor's mode.
#[must_use]
pub fn mode() -> u8 {
    MODE.load(Relaxed) as u8
}

/// A valid frame came from the host.
pub fn link_heard() {
    LINK_HEARD.store(true, Release);
}

/// Hands the control core to the interrupt and starts the control period. To be called once.
pub fn start(config: ControlConfig, state: ControlState) -> Ends {
    static ORDERS: StaticCell<Queue<Order, 4>> = StaticCell::new();
    static ANSWERS: StaticCell<Queue<Carried, 4>> = StaticCell::new();
    static INPUTS: StaticCell<Queue<Inputs, 2>> = StaticCell::new();
    static ROWS_QUEUE: StaticCell<Queue<TelemetryRow, ROWS>> = StaticCell::new();
    static HEALTH: StaticCell<Queue<Health, 4>> = StaticCell::new();
    static EVENTS_QUEUE: StaticCell<Queue<Event, EVENTS>> = StaticCell::new();
    let (order_end, orders) = ORDERS.init(Queue::new()).split();
    let (answers, answer_end) = ANSWERS.init(Queue::new()).split();
    let (inputs, input_end) = INPUTS.init(Queue::new()).split();
    let (rows, row_end) = ROWS_QUEUE.init(Queue::new()).split();
    let (health_out, health_end) = HEALTH.init(Queue::new()).split();
    let (events, event_end) = EVENTS_QUEUE.init(Queue::new()).split();
    let tick = Tick {
        config,
        state,
        orders,
        answers,
        inputs,
        rows,
        health_out,
        events,
        recorder: Recorder::default(),
        feeder: Feeder::default(),
        ran: true,
        late: false,
        period: 0,
        dac: [DAC_ZERO; 2],
        started: None,
        every_ticks: 0,
        until_row: 0,
        until_health: HEALTH_TICKS,
        sequence: 0,
        rows_lost: 0,
        missed_scans: 0,
        cycles: 0,
        cycles_max: 0,
        start_min: u16::MAX,
        start_max: 0,
        cycles_histogram: CycleHistogram::default(),
        start_histogram: StartHistogram::default(),
    };
    // SAFETY: the interrupts that use the cell are not enabled yet, and the `StaticCell`s above let this
    // function pass once only.
    unsafe { (*TICK.0.get()).write(tick) };
    for line in [interrupt::DMA1_STREAM7, interrupt::TIM6_DAC] {
        line.unpend();
        line.set_priority(Priority::P1);
        // SAFETY: the handlers of both lines are below, and what they use is in place.
        unsafe { line.enable() };
    }
    adc_scan::start_timer();
    Ends {
        orders: order_end,
        answers: answer_end,
        inputs: input_end,
        rows: row_end,
        health: health_end,
        events: event_end,
    }
}

/// The tick's state, for the two interrupts.
///
/// # Safety
/// To be called from the handlers of the two interrupts that [`start`] enables, and nowhere else.
#[inline(always)]
unsafe fn the_tick() -> &'static mut Tick {
    // SAFETY: `start` wrote the value before it enabled the interrupts; only one of them runs at a time.
    unsafe { (*TICK.0.get()).assume_init_mut() }
}

#[interrupt]
fn DMA1_STREAM7() {
    board::TICK_PULSE.drive(true);
    // SAFETY: this is one of the two interrupts.
    let tick = unsafe { the_tick() };
    if adc_scan::take_period() {
        // Interrupts were masked when the period began: its own interrupt still waits, behind this one.
        NVIC::unpend(Interrupt::TIM6_DAC);
    }
    tick.ran = true;
    tick.run(Some(adc_scan::take()));
    board::TICK_PULSE.drive(false);
}

#[interrupt]
fn TIM6_DAC() {
    if !adc_scan::take_period() {
        return;
    }
    // SAFETY: this is the other of the two interrupts.
    let tick = unsafe { the_tick() };
    if !core::mem::take(&mut tick.ran) {
        board::TICK_PULSE.drive(true);
        adc_scan::missed();
        tick.missed_scans = tick.missed_scans.saturating_add(1);
        tick.run(None);
        board::TICK_PULSE.drive(false);
    }
}

impl Tick {
    #[inline(always)]
    fn run(&mut self, scan: Option<adc_scan::Scan>) {
        let started = DWT::cycle_count();
        let since = self.started.replace(started).map(|before| started.wrapping_sub(before));
        if scan.is_none() {
            self.started = None;
        }
        let latched = encoders::latched();
        let periods = latched.period.wrapping_sub(self.period) % M2_LATCHES as u32;
        self.period = latched.period;
        let mut samples = Samples {
            m1_count: latched.m1_count,
            m2_count: latched.m2_count,
            counts_irregular: periods != 1,
            tick_irregular: since.is_some_and(|cycles| cycles.wrapping_sub(SHORTEST) > LONGEST - SHORTEST),
            adc_fresh: scan.is_some_and(|scan| !scan.overrun),
            adc_overrun: scan.is_some_and(|scan| scan.overrun),
            adc: scan.map_or_else(adc_scan::codes, |scan| scan.codes),
            deadline_missed: self.late,
            link_heard: heard(),
            ..Samples::default()
        };
        inputs::read_into(&mut samples);
        if scan.is_some() {
            let since = adc_scan::since_trigger();
            self.start_min = self.start_min.min(since);
            self.start_max = self.start_max.max(since);
            self.start_histogram.add(to_ns(since.saturating_sub(adc_scan::PERIODS)));
        }
        if self.orders.ready() {
            self.carry_out(&samples);
        }
        // Each by an address of its own. As the compiler knows where the tick lies it would reach all from there, and what is more
        // than 4095 bytes on costs an instruction more each time, some 150 a tick.
        let (config, state) = (black_box(&self.config), black_box(&mut self.state));
        let outputs = step(config, state, &samples);
        outputs::write_references(outputs.dac);
        self.dac = outputs.dac;
        outputs::write_enables(outputs.drive_enable);
        lamps(&outputs.leds);
        self.recorder.record(&samples, &outputs);
        self.report(&outputs);
        self.feeder.feed();
        self.late = adc_scan::period_over();
        self.cycles = DWT::cycle_count().wrapping_sub(started);
        self.cycles_max = self.cycles_max.max(self.cycles);
        self.cycles_histogram.add(self.cycles);
    }

    #[cold]
    fn carry_out(&mut self, samples: &Samples) {
        let Some(order) = self.orders.dequeue() else { return };
        let carried = match order {
            Order::Core(command) => {
                let starts = matches!(command, Command::Start);
                let carried = apply(&mut self.config, &mut self.state, command);
                if starts && carried.is_ok() && self.every_ticks != 0 {
                    // Rows count from the experiment's first tick, so that its log begins at 0.
                    self.until_row = 1;
                }
                carried
            }
            Order::Telemetry(every_ticks) => {
                self.every_ticks = every_ticks;
                self.until_row = every_ticks;
                self.sequence = 0;
                Ok(())
            }
            Order::CaptureArm(trigger) => {
                self.recorder.arm(trigger);
                Ok(())
            }
            Order::CaptureTrigger => {
                self.recorder.trigger(now());
                Ok(())
            }
            Order::Inputs => {
                // Whoever ordered it empties the queue first, so there is room.
                let _ = self.inputs.enqueue(self.raw(samples));
                Ok(())
            }
        };
        // The threads send one order at a time, so there is room.
        let _ = self.answers.enqueue(carried);
    }

    fn raw(&self, samples: &Samples) -> Inputs {
        let adc = &samples.adc;
        Inputs {
            tick: now(),
            codes: [adc.friction_bridge, adc.normal_bridge, adc.m1_torque, adc.m2_torque, adc.supply],
            counts: [samples.m1_count as u16, samples.m2_count as u16],
            dac: self.dac,
            emergency_stop: samples.emergency_stop,
            arm_switch: samples.arm_switch,
            drive_fault: [samples.m1_drive_fault, samples.m2_drive_fault],
            enabled: self.state.mode().is_live(),
        }
    }

    #[inline(always)]
    fn report(&mut self, outputs: &Outputs) {
        let record = &outputs.record;
        NOW[0].store(record.tick as u32, Relaxed);
        NOW[1].store((record.tick >> 32) as u32, Relaxed);
        MODE.store(u32::from(record.mode.number()), Relaxed);
        if self.every_ticks != 0 {
            // The first tick of an experiment has a row, so that rows of two runs lie at the same times.
            let first = record.sequencer == SequencerState::Running && record.experiment_tick == 1;
            self.until_row = if first { 0 } else { self.until_row - 1 };
            if self.until_row == 0 {
                self.until_row = self.every_ticks;
                let row = TelemetryRow::new(record, self.sequence, self.cycles);
                self.sequence = self.sequence.wrapping_add(1);
                if self.rows.enqueue(row).is_err() {
                    self.rows_lost = self.rows_lost.saturating_add(1);
                }
            }
        }
        self.until_health -= 1;
        if self.until_health == 0 {
            self.until_health = HEALTH_TICKS;
            self.report_health(outputs);
        }
        while self.events.ready()
            && let Some(event) = self.state.pop_event()
        {
            // There is room: `ready` said so, and this is the only writer.
            let _ = self.events.enqueue(event);
        }
    }

    #[cold]
    fn report_health(&mut self, outputs: &Outputs) {
        let record = &outputs.record;
        let health = Health {
            tick: record.tick,
            mode: record.mode.number(),
            fault: record.fault.map_or(0, Fault::number),
            faults: record.faults.0,
            causes: record.causes.0,
            deadline_misses: record.deadline_misses,
            missed_scans: self.missed_scans,
            cycles_last: self.cycles,
            cycles_max: self.cycles_max,
            start_min_ns: to_ns(self.start_min),
            start_max_ns: to_ns(self.start_max),
            telemetry_lost: self.rows_lost,
            events_lost: self.state.events_lost(),
            // The link's own counters and the stack's mark are added where the record is sent.
            frames_rejected: 0,
            line_errors: 0,
            stack: (0, 0),
            cycles: self.cycles_histogram,
            starts: self.start_histogram,
        };
        // Without a reader the next record says the same and more.
        let _ = self.health_out.enqueue(health);
    }
}

/// Periods of the tick timer (240 MHz) in ns.
const fn to_ns(periods: u16) -> u32 {
    periods as u32 * 25 / 6
}

#[inline(always)]
fn heard() -> bool {
    // Load before store: a store that is not needed would cost a frame that comes in between.
    LINK_HEARD.load(Relaxed) && LINK_HEARD.swap(false, Relaxed)
}

#[inline(always)]
fn lamps(leds: &Leds) {
    let change = board::LAMP_GREEN.change(leds.ready) | board::LAMP_RED.change(leds.fault);
    board::LAMP_GREEN.port.bsrr().write(|w| w.0 = change);
    board::LAMP_YELLOW.drive(leds.live);
}
