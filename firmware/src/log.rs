//! The log: one line for each change of state, with its reason, written by a task outside the tick.
//!
//! Lines go over RTT without ever waiting: a line that does not fit is dropped whole. Every line of an event
//! carries a running number, so that a dropped one shows. The control tick never logs; it queues events,
//! which the core counts when they find no room.
//!
//! | level | what |
//! |---|---|
//! | error | faults, and what is wrong with the firmware itself |
//! | warn | refusals, limits, errors of the link, losses |
//! | info | changes of mode, commands that took effect |

use crate::link::OUTGOING;
use crate::watchdog::{self, Thread};
use crate::{board, tick};
use embassy_time::{Duration, Ticker};
use heapless::spsc::Consumer;
use model_core::control::{Event, EventKind};
use rig_link::message::Message;

// Lines carry the time of the control tick in which they were written, so that they compare with telemetry.
defmt::timestamp!("{=u64:us}", tick::now() * (1_000_000 / board::TICK_HZ as u64));

/// Time between two looks at the queue.
const LOOK: Duration = Duration::from_millis(5);

/// Logs for ever.
#[embassy_executor::task]
pub async fn log(mut events: Consumer<'static, Event>) {
    let mut ticker = Ticker::every(LOOK);
    let mut number = 0u32;
    let mut unsent = 0u32;
    loop {
        watchdog::alive(Thread::Log);
        while let Some(event) = events.dequeue() {
            number = number.wrapping_add(1);
            write(number, &event);
            if OUTGOING.try_send(Message::Event(event.into())).is_err() {
                unsent = unsent.saturating_add(1);
                defmt::warn!("link: {=u32} events not sent so far", unsent);
            }
        }
        ticker.next().await;
    }
}

fn write(number: u32, event: &Event) {
    let tick = event.tick;
    match event.kind {
        EventKind::ModeChanged { from, to, reason } => {
            defmt::info!("#{=u32} tick {=u64}: {} -> {}: {=str}", number, tick, from, to, reason.sentence());
        }
        EventKind::FaultLatched(fault) => {
            defmt::error!(
                "#{=u32} tick {=u64}: fault {=u8}: {=str}",
                number,
                tick,
                fault.number(),
                fault.sentence()
            );
        }
        EventKind::FaultCleared(fault) => {
            defmt::info!(
                "#{=u32} tick {=u64}: cleared fault {=u8}: {=str}",
                number,
                tick,
                fault.number(),
                fault.sentence()
            );
        }
        EventKind::LimitReached(limit) => {
            defmt::warn!(
                "#{=u32} tick {=u64}: limit {=u8}: {=str}",
                number,
                tick,
                limit.number(),
                limit.sentence()
            );
        }
        EventKind::CommandRefused(refused) => {
            let reason = refused.reason;
            match refused.fault {
                Some(fault) => defmt::warn!(
                    "#{=u32} tick {=u64}: refused {=u8}: {=str} ({=str})",
                    number,
                    tick,
                    reason.number(),
                    reason.sentence(),
                    fault.sentence()
                ),
                None => defmt::warn!(
                    "#{=u32} tick {=u64}: refused {=u8}: {=str}",
                    number,
                    tick,
                    reason.number(),
                    reason.sentence()
                ),
            }
        }
        other => defmt::info!("#{=u32} tick {=u64}: {}", number, tick, other),
    }
}
