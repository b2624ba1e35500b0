//! The link to the host on USART3, 2 Mbaud: one task receives and carries out, one sends.
//!
//! Received bytes come through a ring the DMA fills by itself (`ring.rs`). What goes out is gathered
//! into one DMA transfer: answers and events first, then telemetry. Telemetry that finds no room is counted
//! where the tick offers it.

mod operator;
mod receive;
mod ring;
mod send;

pub use operator::{Identity, Operator};
pub use receive::receive;
pub use ring::Ring;
pub use send::send;

use crate::board::LinkPort;
use core::sync::atomic::AtomicU32;
use embassy_stm32::mode::Async;
use embassy_stm32::usart::{Config, ConfigError, InterruptHandler, Uart, UartTx};
use embassy_stm32::{bind_interrupts, dma, peripherals};
use embassy_sync::blocking_mutex::raw::ThreadModeRawMutex;
use embassy_sync::channel::Channel;
use rig_link::message::Message;

bind_interrupts!(struct Irqs {
    USART3 => InterruptHandler<peripherals::USART3>;
    DMA1_STREAM0 => dma::InterruptHandler<peripherals::DMA1_CH0>;
    DMA1_STREAM1 => dma::InterruptHandler<peripherals::DMA1_CH1>;
});

/// Answers and events on their way out.
pub static OUTGOING: Channel<ThreadModeRawMutex, Message, 8> = Channel::new();

/// Frames from the host that were thrown away.
pub static FRAMES_REJECTED: AtomicU32 = AtomicU32::new(0);
/// Errors of the serial line: noise, framing, overrun.
pub static LINE_ERRORS: AtomicU32 = AtomicU32::new(0);

/// Opens the serial port.
///
/// # Errors
/// The rate cannot be made from the port's clock.
pub fn open(port: LinkPort) -> Result<(UartTx<'static, Async>, Ring), ConfigError> {
    let mut config = Config::default();
    config.baudrate = rig_link::BAUD;
    let uart = Uart::new(port.usart, port.rx, port.tx, port.tx_dma, port.rx_dma, Irqs, config)?;
    let (tx, rx) = uart.split();
    Ok((tx, Ring::start(rx)))
}
