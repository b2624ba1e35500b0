//! The co-simulation endpoint: where code outside the emulator works, in step with virtual time.
//!
//! The operator is ordinary blocking code on a thread of its own. It and the emulator never run at once: at
//! the start of each control period the emulator hands over whatever came down the serial line, and goes on
//! only when the operator waits for more, or for an instant. So the operator's wall-clock speed does not
//! matter, and two runs are the same run.

use crate::branch::{Each, Job};
use crate::error::BenchError;
use crate::meter::Ticks;
use crate::outside::{Action, DriveInputs, Motion};
use crate::record::Record;
use crate::sighting::{Seen, Sighting};
use std::sync::mpsc::{Receiver, Sender, channel};

/// From the operator to the emulator's side.
pub(crate) enum ToBench {
    Send(Vec<u8>),
    Act(Action),
    Ask(Question),
    /// Wake me when bytes come, or at this instant.
    Wait(u64),
    /// Go on from here as often as there are jobs, each in a process of its own, when results are asked for.
    Branch {
        jobs: Vec<Job>,
        at_once: usize,
    },
    /// Wait for the next branch that ends; with `begin_more` those that still wait may begin meanwhile.
    NextBranch {
        begin_more: bool,
    },
}

/// What the operator may ask.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Question {
    BeginMeasuring,
    EndMeasuring,
    Outputs,
    WrongPins,
    Memory { address: u64, length: u64 },
    Register(u64),
    Snapshot,
    LookOut(Sighting),
    Seen,
    Record,
    Motion,
    TakeLog,
}

/// Answers and wake-ups.
#[derive(Debug)]
pub(crate) enum ToEndpoint {
    Woken { now: u64, bytes: Vec<u8> },
    Measured(Box<Ticks>),
    Outputs(DriveInputs),
    WrongPins(Vec<String>),
    Memory(Vec<u8>),
    Log(Vec<Vec<u8>>),
    Register(u64),
    Seen(Option<Seen>),
    Record(Box<Record>),
    Motion(Motion),
    Branched(Result<Option<(usize, Vec<u8>)>, String>),
    Done(Result<(), String>),
}

/// The emulator's end.
#[derive(Debug)]
pub(crate) struct BenchEnd {
    pub(crate) from_endpoint: Receiver<ToBench>,
    pub(crate) to_endpoint: Sender<ToEndpoint>,
}

/// The endpoint.
#[derive(Debug)]
pub struct Endpoint {
    to_bench: Sender<ToBench>,
    from_bench: Receiver<ToEndpoint>,
    now: u64,
    received: Vec<u8>,
}

/// An endpoint and the emulator's end of it.
pub(crate) fn endpoint() -> (Endpoint, BenchEnd) {
    endpoint_at(0)
}

/// The same at an instant, ns.
pub(crate) fn endpoint_at(now: u64) -> (Endpoint, BenchEnd) {
    let (to_bench, from_endpoint) = channel();
    let (to_endpoint, from_bench) = channel();
    (Endpoint { to_bench, from_bench, now, received: Vec::new() }, BenchEnd { from_endpoint, to_endpoint })
}

fn over() -> BenchError {
    BenchError::Emulator("the run ended while the operator was still at work".to_owned())
}

impl Endpoint {
    /// Waits for the run to begin.
    ///
    /// # Errors
    /// The run ended.
    pub(crate) fn connect(&mut self) -> Result<(), BenchError> {
        self.wait(0)
    }

    /// Virtual time in ns: the start of the current control period.
    #[must_use]
    pub fn now_ns(&self) -> u64 {
        self.now
    }

    /// Sends bytes down the serial line.
    ///
    /// # Errors
    /// The run ended.
    pub fn send(&mut self, bytes: &[u8]) -> Result<(), BenchError> {
        self.to_bench.send(ToBench::Send(bytes.to_vec())).map_err(|_| over())
    }

    /// Bytes from the serial line: those that came already, or the first that come before the instant
    /// `until_ns`; none when it has passed.
    ///
    /// # Errors
    /// The run ended.
    pub fn receive(&mut self, until_ns: u64) -> Result<Vec<u8>, BenchError> {
        if self.received.is_empty() && self.now < until_ns {
            self.wait(until_ns)?;
        }
        Ok(std::mem::take(&mut self.received))
    }

    /// Waits for an instant; bytes that come meanwhile are kept.
    ///
    /// # Errors
    /// The run ended.
    pub fn wait_until(&mut self, until_ns: u64) -> Result<(), BenchError> {
        while self.now < until_ns {
            self.wait(until_ns)?;
        }
        Ok(())
    }

    /// Does something to the rig, now.
    ///
    /// # Errors
    /// The run ended.
    pub fn act(&mut self, action: Action) -> Result<(), BenchError> {
        self.to_bench.send(ToBench::Act(action)).map_err(|_| over())
    }

    /// Begins to measure the control ticks.
    ///
    /// # Errors
    /// The run ended.
    pub fn begin_measuring(&mut self) -> Result<(), BenchError> {
        self.ask(Question::BeginMeasuring).map(|_| ())
    }

    /// Ends it, and gives what was measured.
    ///
    /// # Errors
    /// The run ended.
    pub fn end_measuring(&mut self) -> Result<Ticks, BenchError> {
        match self.ask(Question::EndMeasuring)? {
            ToEndpoint::Measured(ticks) => Ok(*ticks),
            _ => Err(over()),
        }
    }

    /// What the chip's pins tell the drives now.
    ///
    /// # Errors
    /// The run ended.
    pub fn outputs(&mut self) -> Result<DriveInputs, BenchError> {
        match self.ask(Question::Outputs)? {
            ToEndpoint::Outputs(outputs) => Ok(outputs),
            _ => Err(over()),
        }
    }

    /// A sentence for each pin the firmware has not set up as the board needs it.
    ///
    /// # Errors
    /// The run ended.
    pub fn wrong_pins(&mut self) -> Result<Vec<String>, BenchError> {
        match self.ask(Question::WrongPins)? {
            ToEndpoint::WrongPins(wrong) => Ok(wrong),
            _ => Err(over()),
        }
    }

    /// Bytes of the chip's memory, as a debugger reads them; `length` is a multiple of eight.
    ///
    /// # Errors
    /// The run ended.
    pub fn memory(&mut self, address: u64, length: u64) -> Result<Vec<u8>, BenchError> {
        match self.ask(Question::Memory { address, length })? {
            ToEndpoint::Memory(bytes) => Ok(bytes),
            _ => Err(over()),
        }
    }

    /// The log's bytes since the last call, one entry for each start of the firmware: the first goes on where the last
    /// call ended. The record forgets them, and the changes of the outputs too: a run may last for days.
    ///
    /// # Errors
    /// The run ended.
    pub fn take_log(&mut self) -> Result<Vec<Vec<u8>>, BenchError> {
        match self.ask(Question::TakeLog)? {
            ToEndpoint::Log(starts) => Ok(starts),
            _ => Err(over()),
        }
    }

    /// A peripheral's register, as a debugger reads it.
    ///
    /// # Errors
    /// The run ended.
    pub fn register(&mut self, address: u64) -> Result<u64, BenchError> {
        match self.ask(Question::Register(address))? {
            ToEndpoint::Register(value) => Ok(value),
            _ => Err(over()),
        }
    }

    /// Begins to look for the first access that sees a fault, and to write down how the plant moves.
    ///
    /// # Errors
    /// The run ended.
    pub fn look_out(&mut self, wanted: Sighting) -> Result<(), BenchError> {
        self.ask(Question::LookOut(wanted)).map(|_| ())
    }

    /// The record so far, which then begins anew.
    ///
    /// # Errors
    /// The run ended.
    pub fn record(&mut self) -> Result<Record, BenchError> {
        match self.ask(Question::Record)? {
            ToEndpoint::Record(record) => Ok(*record),
            _ => Err(over()),
        }
    }

    /// Goes on from here once for each job, `at_once` of them at a time. `each` gets the number of a job and what it
    /// returned as soon as that is known, and says whether further ones may begin. A job works at an endpoint of its own, in a
    /// process of its own, so that it costs what it runs and no start; this run does not notice.
    ///
    /// # Errors
    /// The run ended, the system has no more processes to give, or `each` failed.
    pub fn branch(&mut self, jobs: Vec<Job>, at_once: usize, each: &mut Each<'_>) -> Result<(), BenchError> {
        self.to_bench.send(ToBench::Branch { jobs, at_once }).map_err(|_| over())?;
        let mut begin_more = true;
        loop {
            self.to_bench.send(ToBench::NextBranch { begin_more }).map_err(|_| over())?;
            match self.from_bench.recv().map_err(|_| over())? {
                ToEndpoint::Branched(Ok(Some((nth, result)))) => {
                    begin_more &= each(nth, &result)?.is_continue();
                }
                ToEndpoint::Branched(Ok(None)) => return Ok(()),
                ToEndpoint::Branched(Err(error)) => return Err(BenchError::Emulator(error)),
                _ => return Err(over()),
            }
        }
    }

    /// How the plant truly moves now.
    ///
    /// # Errors
    /// The run ended.
    pub fn motion(&mut self) -> Result<Motion, BenchError> {
        match self.ask(Question::Motion)? {
            ToEndpoint::Motion(motion) => Ok(motion),
            _ => Err(over()),
        }
    }

    /// Whether it was seen.
    ///
    /// # Errors
    /// The run ended.
    pub fn seen(&mut self) -> Result<Option<Seen>, BenchError> {
        match self.ask(Question::Seen)? {
            ToEndpoint::Seen(seen) => Ok(seen),
            _ => Err(over()),
        }
    }

    /// Keeps the state of the whole bench as it is now, for runs that start from it.
    ///
    /// # Errors
    /// The run ended, or the emulator cannot save its state.
    pub fn snapshot(&mut self) -> Result<(), BenchError> {
        match self.ask(Question::Snapshot)? {
            ToEndpoint::Done(done) => done.map_err(BenchError::Emulator),
            _ => Err(over()),
        }
    }

    fn ask(&mut self, question: Question) -> Result<ToEndpoint, BenchError> {
        self.to_bench.send(ToBench::Ask(question)).map_err(|_| over())?;
        self.from_bench.recv().map_err(|_| over())
    }

    fn wait(&mut self, until_ns: u64) -> Result<(), BenchError> {
        self.to_bench.send(ToBench::Wait(until_ns)).map_err(|_| over())?;
        match self.from_bench.recv().map_err(|_| over())? {
            ToEndpoint::Woken { now, bytes } => {
                self.now = now;
                self.received.extend(bytes);
                Ok(())
            }
            _ => Err(over()),
        }
    }
}
