//! The far end of the link's serial line: two byte queues between the emulated USART and the host.
//!
//! The USART's model times each byte at the baud rate the firmware set; here nothing takes time.

use rigless::chip::Timeline;
use rigless::chip::uart::{Peer, Rate};
use rigless::store;
use rigless::time::VirtualNanos;
use serde::{Deserialize, Serialize};
use std::collections::VecDeque;

use crate::part::Part;

/// Bytes on their way.
#[derive(Debug, Default, Serialize, Deserialize)]
struct FarEnd {
    from_chip: Vec<u8>,
    to_chip: VecDeque<u8>,
}
store!(FarEnd);

impl Peer for FarEnd {
    fn receive(&mut self, word: u16, _context: &mut Timeline<'_, '_>) {
        self.from_chip.push(word.to_le_bytes()[0]);
    }

    fn transmit(&mut self, _now: VirtualNanos) -> Option<u16> {
        self.to_chip.pop_front().map(u16::from)
    }
}

/// Plugs the line in.
pub fn connect(part: &mut Part) {
    part.soc.usart[Part::USART3].attach(FarEnd::default());
}

fn far_end(part: &mut Part) -> Option<&mut FarEnd> {
    part.soc.usart[Part::USART3].chip_mut::<FarEnd>()
}

/// Takes what the chip sent since the last call.
pub fn take_received(part: &mut Part) -> Vec<u8> {
    far_end(part).map(|end| std::mem::take(&mut end.from_chip)).unwrap_or_default()
}

/// Sends bytes to the chip; they go out at the line's rate.
pub fn send(part: &mut Part, bytes: &[u8]) {
    if let Some(end) = far_end(part) {
        end.to_chip.extend(bytes);
    }
}

/// Bytes for the chip that are not on the line yet.
pub fn waiting(part: &mut Part) -> usize {
    far_end(part).map_or(0, |end| end.to_chip.len())
}

/// The line goes quiet in both directions, or comes back.
pub fn silence(part: &mut Part, silent: bool) {
    // Something hangs there: `connect` put it.
    let _ = part.soc.usart[Part::USART3].silence(silent);
}

/// `per_million` of the words to the chip arrive with a framing error and flipped bits, by `seed`.
pub fn garble(part: &mut Part, per_million: u32, seed: u64) {
    let errors = part.soc.usart[Part::USART3].errors_mut();
    errors.seed = seed;
    errors.framing = Rate { name: "link.framing", per_million };
}
