//! The triggered capture, the tick's side and the link's side.
//!
//! A ring of rows in AXI SRAM, one row a tick. When the trigger comes, half of the ring is kept from before
//! it, and recording stops when the other half is full: 1.024 s on either side. The tick owns the ring until
//! it publishes `Frozen`; from then on the link reads it, until it arms the capture again.

use crate::memory::{CAPTURE_ROWS, CAPTURE_WORDS, ROW_WORDS};
use core::sync::atomic::Ordering::{Acquire, Relaxed, Release};
use core::sync::atomic::{AtomicU8, AtomicU32};
use model_core::control::{Fault, Mode, Outputs, Samples};
use rig_link::capture::{CaptureInfo, CaptureRow, CaptureState, CaptureTrigger};

/// Rows kept from before the trigger.
const BEFORE: u32 = CAPTURE_ROWS as u32 / 2;
const ROWS: u32 = CAPTURE_ROWS as u32;

static STATE: AtomicU8 = AtomicU8::new(0);
static RECORDED: AtomicU32 = AtomicU32::new(0);
static OLDEST: AtomicU32 = AtomicU32::new(0);
static TRIGGER_TICK: [AtomicU32; 2] = [const { AtomicU32::new(0) }; 2];

/// The tick's side.
pub struct Recorder {
    state: CaptureState,
    trigger: CaptureTrigger,
    /// Row to be written next.
    next: u32,
    recorded: u32,
    remaining: u32,
    /// The condition held in the last tick, so only its beginning triggers.
    held: bool,
}

impl Default for Recorder {
    fn default() -> Self {
        Self {
            state: CaptureState::Idle,
            trigger: CaptureTrigger::Command,
            next: 0,
            recorded: 0,
            remaining: 0,
            held: true,
        }
    }
}

impl Recorder {
    /// Begins a capture, whatever was recorded before.
    pub fn arm(&mut self, trigger: CaptureTrigger) {
        *self = Self { state: CaptureState::Filling, trigger, ..Self::default() };
        self.publish();
    }

    /// Triggers by command, if a capture waits or fills.
    pub fn trigger(&mut self, tick: u64) {
        if matches!(self.state, CaptureState::Filling | CaptureState::Waiting) {
            self.finish(tick);
        }
    }

    fn finish(&mut self, tick: u64) {
        TRIGGER_TICK[0].store(tick as u32, Relaxed);
        TRIGGER_TICK[1].store((tick >> 32) as u32, Relaxed);
        self.state = CaptureState::Finishing;
        self.remaining = ROWS - BEFORE;
        self.publish();
    }

    fn publish(&self) {
        RECORDED.store(self.recorded, Relaxed);
        OLDEST.store(if self.recorded < ROWS { 0 } else { self.next }, Relaxed);
        STATE.store(self.state as u8, Release);
    }

    /// Records a tick.
    #[inline(always)]
    pub fn record(&mut self, samples: &Samples, outputs: &Outputs) {
        if !matches!(self.state, CaptureState::Idle | CaptureState::Frozen) {
            self.store(samples, outputs);
        }
    }

    #[inline]
    fn store(&mut self, samples: &Samples, outputs: &Outputs) {
        let first = self.next as usize * ROW_WORDS;
        if let Some(place) = CAPTURE_WORDS.get(first..first + ROW_WORDS) {
            for (word, value) in place.iter().zip(row(samples, outputs).to_words()) {
                word.store(value, Relaxed);
            }
        }
        self.next = if self.next + 1 == ROWS { 0 } else { self.next + 1 };
        self.recorded = (self.recorded + 1).min(ROWS);
        let holds = self.condition(samples, outputs);
        match self.state {
            CaptureState::Filling if self.recorded >= BEFORE => {
                self.state = CaptureState::Waiting;
                self.publish();
            }
            CaptureState::Waiting if holds && !self.held => self.finish(outputs.record.tick),
            CaptureState::Finishing => {
                self.remaining -= 1;
                if self.remaining == 0 {
                    self.state = CaptureState::Frozen;
                    self.publish();
                }
            }
            _ => {}
        }
        self.held = holds;
    }

    #[inline]
    fn condition(&self, samples: &Samples, outputs: &Outputs) -> bool {
        match self.trigger {
            CaptureTrigger::Command => false,
            CaptureTrigger::Start => outputs.record.mode == Mode::Running,
            CaptureTrigger::Fault => outputs.record.fault.is_some(),
            CaptureTrigger::FrictionAbove { code } => samples.adc.friction_bridge > code,
            CaptureTrigger::NormalAbove { code } => samples.adc.normal_bridge > code,
        }
    }
}

#[inline]
fn row(samples: &Samples, outputs: &Outputs) -> CaptureRow {
    let record = &outputs.record;
    CaptureRow {
        friction_bridge: samples.adc.friction_bridge,
        normal_bridge: samples.adc.normal_bridge,
        m1_torque: samples.adc.m1_torque,
        m2_torque: samples.adc.m2_torque,
        supply: samples.adc.supply,
        m1_count: samples.m1_count as u16,
        m2_count: samples.m2_count as u16,
        m1_dac: outputs.dac[0],
        m2_dac: outputs.dac[1],
        // A float cast to an integer saturates, and makes 0 of what is no number.
        predicted_mnm: (record.predicted_friction_torque_nm * 1000.0) as i16,
        m2_speed_ref_crad_s: (record.m2_speed_ref_rad_s * 100.0) as i16,
        state: u16::from(record.mode.number()) | u16::from(record.fault.map_or(0, Fault::number)) << 4,
    }
}

/// State of the capture, for the link.
#[must_use]
pub fn info() -> CaptureInfo {
    let state = match STATE.load(Acquire) {
        1 => CaptureState::Filling,
        2 => CaptureState::Waiting,
        3 => CaptureState::Finishing,
        4 => CaptureState::Frozen,
        _ => CaptureState::Idle,
    };
    let rows = RECORDED.load(Relaxed);
    let trigger_tick =
        u64::from(TRIGGER_TICK[0].load(Relaxed)) | u64::from(TRIGGER_TICK[1].load(Relaxed)) << 32;
    CaptureInfo { state, rows, rows_before: rows.saturating_sub(ROWS - BEFORE), trigger_tick, capacity: ROWS }
}

/// Copies bytes of the frozen capture from `offset` on, oldest row first, and returns how many; none if the
/// capture is not frozen or `offset` is not at a word of it.
pub fn read(offset: u32, out: &mut [u8]) -> Option<usize> {
    let info = info();
    let words = info.rows as usize * ROW_WORDS;
    let first = offset as usize / 4;
    if info.state != CaptureState::Frozen || !offset.is_multiple_of(4) || first >= words {
        return None;
    }
    let start = OLDEST.load(Relaxed) as usize * ROW_WORDS;
    let mut written = 0;
    for (four, index) in out.chunks_exact_mut(4).zip(first..words) {
        let word = CAPTURE_WORDS.get((start + index) % CAPTURE_WORDS.len())?;
        four.copy_from_slice(&word.load(Relaxed).to_le_bytes());
        written += 4;
    }
    Some(written)
}
