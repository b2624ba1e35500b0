//! Received bytes: a ring that DMA1 stream 1 fills by itself and that never stops, whatever the line does.
//!
//! The driver's own ring stops the stream at each error of the line and starts it again. The stream then goes on at
//! the ring's begin while its counter goes on where it stopped, so that old bytes are read as new ones: frames of
//! minutes ago, intact and with a valid checksum, are carried out once more. Here an error is counted and nothing
//! else; the bytes around it are in the ring, and the checksum throws away what was damaged.
//!
//! The task looks twice a millisecond. The ring holds 20 ms at full rate; who is busy longer than that (erasing
//! flash takes a second) loses the oldest bytes, and the checksum sorts out the frames that were cut.

use super::LINE_ERRORS;
use crate::memory::{RECEIVED, RECEIVED_BYTES};
use crate::watchdog::{self, Thread};
use core::sync::atomic::Ordering::{Acquire, Relaxed};
use core::sync::atomic::fence;
use embassy_stm32::mode::Async;
use embassy_stm32::pac::dma::vals::{Dir, Pl, Size};
use embassy_stm32::pac::{DMA1, DMAMUX1, USART3};
use embassy_stm32::usart::UartRx;
use embassy_time::{Duration, Timer};

/// DMA1 stream, and channel of DMAMUX1.
const STREAM: usize = 1;
/// DMAMUX1 request of USART3's receiver (RM0433 rev 9, table 124).
const USART3_RX_REQUEST: u8 = 45;
/// Time between two looks.
const LOOK: Duration = Duration::from_micros(500);

/// The receiving end of the ring.
pub struct Ring {
    /// Next byte to read.
    at: usize,
    /// Keeps the pin, the port and its clock.
    _port: UartRx<'static, Async>,
}

impl Ring {
    /// Starts the stream on a port that is set up, with its error and idle interrupts off.
    #[must_use]
    pub fn start(port: UartRx<'static, Async>) -> Self {
        RECEIVED.iter().for_each(|byte| byte.store(0, Relaxed));
        let stream = DMA1.st(STREAM);
        DMAMUX1.ccr(STREAM).write(|w| w.set_dmareq_id(USART3_RX_REQUEST));
        stream.par().write_value(USART3.rdr().as_ptr() as u32);
        stream.m0ar().write_value(RECEIVED.as_ptr() as u32);
        stream.ndtr().write(|w| w.set_ndt(RECEIVED_BYTES as u16));
        stream.cr().write(|w| {
            w.set_dir(Dir::PERIPHERAL_TO_MEMORY);
            w.set_minc(true);
            w.set_circ(true);
            w.set_psize(Size::BITS8);
            w.set_msize(Size::BITS8);
            w.set_pl(Pl::HIGH);
            // Without it a stream that serves a USART can lock up for good when another stream of the controller
            // transfers at the same time (ES0392 rev 15, 2.20.4). The driver sets it on the sender's stream.
            w.set_trbuff(true);
            w.set_en(true);
        });
        USART3.cr3().modify(|w| w.set_dmar(true));
        Self { at: 0, _port: port }
    }

    /// Waits for bytes; gives how many of `bytes` were filled.
    pub async fn read(&mut self, bytes: &mut [u8]) -> usize {
        loop {
            watchdog::alive(Thread::Receiver);
            count_errors();
            let written = RECEIVED_BYTES - usize::from(DMA1.st(STREAM).ndtr().read().ndt());
            // The bytes are read after the counter that says they are there.
            fence(Acquire);
            let mut count = 0;
            for byte in bytes.iter_mut() {
                if self.at == written % RECEIVED_BYTES {
                    break;
                }
                *byte = RECEIVED.get(self.at).map_or(0, |byte| byte.load(Relaxed));
                self.at = (self.at + 1) % RECEIVED_BYTES;
                count += 1;
            }
            if count > 0 {
                return count;
            }
            Timer::after(LOOK).await;
        }
    }
}

/// Counts and clears what the receiver complains of.
fn count_errors() {
    let status = USART3.isr().read();
    if status.fe() || status.ne() || status.ore() {
        USART3.icr().write(|w| {
            w.set_fe(true);
            w.set_ne(true);
            w.set_ore(true);
        });
        LINE_ERRORS.store(LINE_ERRORS.load(Relaxed).saturating_add(1), Relaxed);
    }
}
