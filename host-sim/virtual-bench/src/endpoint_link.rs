//! The host tool's link code at the endpoint: the same procedures as on a serial port, in virtual time.

use crate::endpoint::Endpoint;
use crate::error::BenchError;
use host_sim::link::client::Client;
use host_sim::link::procedure::Procedure;

/// Longest time between two looks of a procedure at its clock.
const LOOK_NS: u64 = 1_000_000;

/// Does `procedure` at the endpoint, to its end. `watch` sees it after each of its steps,
/// and may send requests of its own, whose answers go unread.
///
/// # Errors
/// The run ended, the procedure cannot go on, or `watch` refused.
pub fn perform<P: Procedure>(
    endpoint: &mut Endpoint,
    client: &mut Client,
    procedure: &mut P,
    mut watch: impl FnMut(&mut Endpoint, &mut Client, &mut P) -> Result<(), BenchError>,
) -> Result<P::Outcome, BenchError> {
    loop {
        procedure.step(endpoint.now_ns() as f64 * 1e-9, client)?;
        watch(endpoint, client, procedure)?;
        let outgoing = client.take_outgoing();
        if !outgoing.is_empty() {
            endpoint.send(&outgoing)?;
        }
        if let Some(outcome) = procedure.outcome() {
            return Ok(outcome);
        }
        client.receive(&endpoint.receive(endpoint.now_ns() + LOOK_NS)?);
    }
}
