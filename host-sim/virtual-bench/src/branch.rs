//! Branches of a run: the emulator with everything it holds, its translated code included, in a process of its own.
//!
//! A run goes on from one instant in many ways. A saved state restored into a fresh emulator does that too, but has to
//! translate the firmware anew each time, which costs more than what a short branch runs. A process that is forked
//! shares all memory with the one it came from until it writes to it, so a branch begins within a millisecond.
//!
//! The trunk's operator asks for one result after the other, and works on it while no branch begins: all it can hold at a
//! fork are the locks of its channel, as it goes into its wait, and a branch never touches that channel, not even to close it.
//! The thread that forks is the emulator's own. In the branch it is the only thread: the operator of before is not there, and
//! a new one begins. The branch never returns to the code around the run; it ends when its operator is done.

use crate::endpoint::{BenchEnd, Endpoint, endpoint_at};
use crate::error::BenchError;
use rustix::event::{PollFd, PollFlags, poll};
use rustix::io::Errno;
use std::collections::VecDeque;
use std::io::{self, PipeReader, PipeWriter, Read, Write};
use std::ops::ControlFlow;

/// What an operator does in a branch; what it returns is carried to the trunk.
pub type Job = Box<dyn FnOnce(&mut Endpoint) -> Vec<u8> + Send>;

/// Takes the number of a job and what its branch gave; says whether further ones may begin.
pub type Each<'a> = dyn FnMut(usize, &[u8]) -> Result<ControlFlow<()>, BenchError> + 'a;

/// Where this process goes on.
pub(crate) enum Side {
    /// In the run that was there before, with the number of a job and what its branch gave; none when all are done.
    Trunk(Option<(usize, Vec<u8>)>),
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
    nth: usize,
    process: libc::pid_t,
    reader: PipeReader,
}

impl Running {
    /// Waits for its end.
    fn result(mut self) -> io::Result<(usize, Vec<u8>)> {
        let mut result = Vec::new();
        self.reader.read_to_end(&mut result)?;
        let mut status = 0;
        // SAFETY: `status` is a place for the answer, and the process is a child of this one that nobody else waits for.
        let ended = unsafe { libc::waitpid(self.process, &raw mut status, 0) };
        if ended == self.process && status == 0 {
            Ok((self.nth, result))
        } else {
            Err(io::Error::other(format!("a branch of the run ended with status {status}")))
        }
    }
}

/// Jobs that wait for their branch, and branches under way.
#[derive(Default)]
pub(crate) struct Branches {
    waiting: VecDeque<(usize, Job)>,
    running: Vec<Running>,
    at_once: usize,
}

impl Branches {
    /// None of these jobs has begun yet; at most `at_once` of them will be under way.
    pub(crate) fn new(jobs: Vec<Job>, at_once: usize) -> Self {
        Self { waiting: jobs.into_iter().enumerate().collect(), running: Vec::new(), at_once: at_once.max(1) }
    }

    /// Those that have not begun never will.
    pub(crate) fn begin_no_more(&mut self) {
        self.waiting.clear();
    }

    /// Begins as many as may be under way, and waits for the first of them that ends: a short one must not wait for a
    /// long one that began before it.
    pub(crate) fn next(&mut self) -> io::Result<Side> {
        while self.running.len() < self.at_once
            && let Some((nth, job)) = self.waiting.pop_front()
        {
            let (reader, out) = io::pipe()?;
            // SAFETY: the branch goes on in the code of this thread alone. The operator's thread holds no lock that it takes: it
            // waits in its channel, or is about to, and the branch leaves that channel alone (`driver.rs`). The allocator puts
            // its own locks in order over a fork.
            match unsafe { libc::fork() } {
                -1 => return Err(io::Error::last_os_error()),
                0 => return Ok(Side::Branch(Begin { job, out })),
                process => self.running.push(Running { nth, process, reader }),
            }
        }
        if self.running.is_empty() {
            return Ok(Side::Trunk(None));
        }
        let mut readers: Vec<PollFd<'_>> =
            self.running.iter().map(|running| PollFd::new(&running.reader, PollFlags::IN)).collect();
        // A signal that is counted elsewhere wakes too.
        while let Err(error) = poll(&mut readers, None) {
            if error != Errno::INTR {
                return Err(error.into());
            }
        }
        let ended = readers.iter().position(|reader| !reader.revents().is_empty()).unwrap_or_default();
        self.running.swap_remove(ended).result().map(|result| Side::Trunk(Some(result)))
    }
}
