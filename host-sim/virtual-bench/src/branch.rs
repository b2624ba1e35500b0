//! Branches of a run: the emulator with everything it holds, its translated code included, in a process of its own.
//!
//! A run goes on from one instant in many ways. A saved state restored into a fresh emulator does that too, but has to
//! translate the firmware anew each time, which costs more than what a short branch runs. A process that is forked
//! shares all memory with the one it came from until it writes to it, so a branch begins within a millisecond.
//!
//! The thread that forks is the emulator's own. In the branch it is the only thread: the operator of before is not there,
//! and a new one begins. The branch never returns to the code around the run; it ends when its operator is done.

use crate::endpoint::{BenchEnd, Endpoint, endpoint_at};
use std::collections::VecDeque;
use std::io::{self, PipeReader, PipeWriter, Read, Write};

/// What an operator does in a branch; what it returns is carried to the trunk.
pub type Job = Box<dyn FnOnce(&mut Endpoint) -> Vec<u8> + Send>;

/// Where this process goes on.
pub(crate) enum Side {
    /// In the run that was there before, with what the branches gave, in the order of the jobs.
    Trunk(Vec<Vec<u8>>),
    /// In a branch.
    Branch(Begin),
}

/// A branch that is to begin.
pub(crate) struct Begin {
    job: Job,
    out: PipeWriter,
}

impl Begin {
    /// Lets the branch's operator begin, at the instant `now`; the emulator goes on with this end of its endpoint.
    pub(crate) fn begin(self, now: u64) -> BenchEnd {
        let Self { job, mut out } = self;
        let (mut endpoint, end) = endpoint_at(now);
        std::thread::spawn(move || {
            let result = job(&mut endpoint);
            let written = out.write_all(&result).and_then(|()| out.flush());
            // SAFETY: it ends the process without running anything of it any more: what the trunk has open is its own.
            unsafe { libc::_exit(i32::from(written.is_err())) }
        });
        end
    }
}

/// A branch under way.
struct Running {
    process: libc::pid_t,
    reader: PipeReader,
}

impl Running {
    /// Waits for its end.
    fn result(mut self) -> io::Result<Vec<u8>> {
        let mut result = Vec::new();
        self.reader.read_to_end(&mut result)?;
        let mut status = 0;
        // SAFETY: `status` is a place for the answer, and the process is a child of this one that nobody else waits for.
        let ended = unsafe { libc::waitpid(self.process, &raw mut status, 0) };
        if ended == self.process && status == 0 {
            Ok(result)
        } else {
            Err(io::Error::other(format!("a branch of the run ended with status {status}")))
        }
    }
}

/// Forks once for each job, with at most `at_once` of them under way.
pub(crate) fn split(jobs: Vec<Job>, at_once: usize) -> io::Result<Side> {
    let mut running: VecDeque<Running> = VecDeque::new();
    let mut results = Vec::new();
    for job in jobs {
        if running.len() >= at_once.max(1)
            && let Some(first) = running.pop_front()
        {
            results.push(first.result()?);
        }
        let (reader, out) = io::pipe()?;
        // SAFETY: the branch goes on in the code of this thread alone, whose other threads wait in channels and hold no lock
        // it takes: the allocator and the standard streams put their own in order over a fork.
        match unsafe { libc::fork() } {
            -1 => return Err(io::Error::last_os_error()),
            0 => return Ok(Side::Branch(Begin { job, out })),
            process => running.push_back(Running { process, reader }),
        }
    }
    for rest in running {
        results.push(rest.result()?);
    }
    Ok(Side::Trunk(results))
}
