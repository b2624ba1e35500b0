//! Whether a fault did act: the first access of the firmware that saw it.
//!
//! A fault that nothing looked at proves nothing about the firmware: a line stuck at the level it has, a wire swapped while
//! its voltage is zero. So each fault names what the firmware must be seen to do before its run counts.

use crate::part::Motor;
use rigless::emulator::{Access, AccessKind};
use rigless::soc::stm32h743::generated::{ADC1, DMA1, TIM6};

/// What to look for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Sighting {
    /// A read of this register finds this bit at this level.
    Bit {
        /// Address of the register.
        register: u64,
        /// Number of the bit.
        bit: u8,
        /// Its level.
        level: bool,
    },
    /// The scan is taken in a period in which some input's voltage was not what the whole rig would give.
    Analogue,
    /// The latched counters are taken after lines at an encoder's pins were not what the encoder drives.
    Encoder(Motor),
    /// The tick's timer is looked at after a scan was cut short or did not come.
    Scan,
    /// The core arrives at the code put in its way.
    Code,
    /// The receiver's counter is read after it stood for so long, ns.
    Silence(u64),
    /// The receiver's counter is read after so many bytes came.
    Bytes(u32),
    /// The chip restarts.
    Restart,
}

/// An access that saw a fault.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seen {
    /// When, ns.
    pub at_ns: u64,
    /// What it was.
    pub what: String,
}

/// What happened around the chip that an access can show; kept by the driver.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Deviations {
    /// Voltages at the inputs in this period are not the whole rig's.
    pub(crate) analogue: bool,
    /// Lines of the encoders were not what the encoders drive.
    pub(crate) encoders: [bool; 2],
    /// A scan was cut short or did not come.
    pub(crate) scan: bool,
}

/// Looks for one thing until it is seen.
#[derive(Debug, Default)]
pub(crate) struct Lookout {
    wanted: Option<Sighting>,
    /// The receiver's counter, since when it stands, and bytes since the beginning.
    received: Option<(u64, u64, u32)>,
    pub(crate) seen: Option<Seen>,
}

/// `SxNDTR` of stream 0, and the distance of two streams; the streams of the receiver and of M2's counter.
const FIRST_COUNTER: u64 = 0x14;
const STREAM_STRIDE: u64 = 0x18;
const RECEIVER: u64 = DMA1.base + FIRST_COUNTER + STREAM_STRIDE;
const LATCH: u64 = DMA1.base + FIRST_COUNTER + 6 * STREAM_STRIDE;
/// Bytes of the receiver's ring (firmware/src/memory.rs).
const RING: u64 = 4096;
/// `ADC_ISR`, and `TIM6_SR`.
const SCAN_TAKEN: u64 = ADC1.base;
const PERIOD_TAKEN: u64 = TIM6.base + 0x10;

impl Lookout {
    pub(crate) fn begin(&mut self, wanted: Sighting) {
        *self = Self { wanted: Some(wanted), ..Self::default() };
    }

    /// Whether the operator looks out.
    pub(crate) fn is_on(&self) -> bool {
        self.wanted.is_some()
    }

    /// Whether it was not seen yet.
    pub(crate) fn is_looking(&self) -> bool {
        self.wanted.is_some() && self.seen.is_none()
    }

    /// An access of the core, with the value read or written.
    pub(crate) fn access(&mut self, access: &Access, value: u64, deviations: &Deviations) {
        if self.seen.is_some() || access.kind != AccessKind::Read {
            return;
        }
        let Some(wanted) = self.wanted else { return };
        let (address, at_ns) = (access.address, access.virtual_time.0);
        let saw = match wanted {
            Sighting::Bit { register, bit, level } => address == register && (value >> bit & 1 != 0) == level,
            Sighting::Analogue => address == SCAN_TAKEN && deviations.analogue,
            Sighting::Encoder(motor) => address == LATCH && deviations.encoders[motor as usize],
            Sighting::Scan => (address == PERIOD_TAKEN || address == SCAN_TAKEN) && deviations.scan,
            Sighting::Silence(_) | Sighting::Bytes(_) if address != RECEIVER => false,
            Sighting::Silence(most_ns) => at_ns - self.follow(value, at_ns).0 >= most_ns,
            Sighting::Bytes(least) => self.follow(value, at_ns).1 >= least,
            Sighting::Code | Sighting::Restart => false,
        };
        if saw {
            self.seen = Some(Seen { at_ns, what: format!("read of {address:#010x} gives {value:#x}") });
        }
    }

    /// Since when the receiver's counter stands, and how far it came.
    fn follow(&mut self, counter: u64, at_ns: u64) -> (u64, u32) {
        let (last, since, bytes) = self.received.unwrap_or((counter, at_ns, 0));
        // It counts down and begins again.
        let new = (last + RING - counter) % RING;
        let since = if new == 0 { since } else { at_ns };
        let bytes = bytes + u32::try_from(new).unwrap_or_default();
        self.received = Some((counter, since, bytes));
        (since, bytes)
    }

    /// The core arrived at the code put in its way.
    pub(crate) fn arrived(&mut self, address: u64, at_ns: u64) {
        if self.wanted == Some(Sighting::Code) && self.seen.is_none() {
            self.seen = Some(Seen { at_ns, what: format!("the core is at {address:#010x}") });
        }
    }

    /// The chip restarted.
    pub(crate) fn restarted(&mut self, at_ns: u64) {
        if self.wanted == Some(Sighting::Restart) && self.seen.is_none() {
            self.seen = Some(Seen { at_ns, what: "the chip restarts".to_owned() });
        }
    }
}
