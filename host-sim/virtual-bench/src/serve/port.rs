//! The bench's end of a pseudo-terminal, and the link of a fixed name to the other end.
//!
//! Bytes for a host that is not there are thrown away, as a board's are, and what a host left unread when it went
//! is not there for the next one. The system's own buffer holds 12 KB, an eighth of a second of telemetry; more waits
//! here, so that a busy computer loses nothing.

use crate::error::BenchError;
use host_sim::input_error::InputError;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags, fcntl_getfl, fcntl_setfl};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, QueueSelector, tcflush, tcgetattr, tcsetattr};
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};

/// Most bytes that wait for a host: a second and more at the line's full rate.
const MOST_WAITING: usize = 1 << 18;

/// The pseudo-terminal.
#[derive(Debug)]
pub struct Pty {
    end: OwnedFd,
    path: PathBuf,
    link: Option<PathBuf>,
    host_there: bool,
    waiting: Vec<u8>,
    lost_bytes: u64,
}

fn failed(what: &str, error: impl std::fmt::Display) -> BenchError {
    BenchError::Port(format!("{what}: {error}"))
}

impl Pty {
    /// Opens one.
    ///
    /// # Errors
    /// The system has none to give.
    pub fn open() -> Result<Self, BenchError> {
        let failed = |error: rustix::io::Errno| failed("no pseudo-terminal", error);
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).map_err(failed)?;
        grantpt(&end).map_err(failed)?;
        unlockpt(&end).map_err(failed)?;
        let path = ptsname(&end, Vec::new()).map_err(failed)?;
        let path = PathBuf::from(path.to_string_lossy().into_owned());
        let flags = fcntl_getfl(&end).map_err(failed)?;
        fcntl_setfl(&end, flags | OFlags::NONBLOCK).map_err(failed)?;
        let pty = Self { end, path, link: None, host_there: false, waiting: Vec::new(), lost_bytes: 0 };
        pty.tidy().map_err(failed)?;
        Ok(pty)
    }

    /// Points a link of a fixed name to its other end.
    ///
    /// # Errors
    /// Something that is no link to a pseudo-terminal has the name, or the link cannot be made.
    pub fn link_to(&mut self, link: &Path) -> Result<(), BenchError> {
        make_link(&self.path, link)?;
        self.link = Some(link.to_owned());
        Ok(())
    }

    /// What a host opens.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.path)
    }

    /// Bytes that a host did not read in time.
    #[must_use]
    pub fn lost_bytes(&self) -> u64 {
        self.lost_bytes
    }

    /// Whether a host is there that has not read what was sent: the system's buffer is full.
    #[must_use]
    pub fn is_behind(&self) -> bool {
        self.host_there && !self.waiting.is_empty()
    }

    /// Opens the other end for a moment: no echo, no line editing, nothing left unread. Afterwards the system tells
    /// whether a host is there.
    fn tidy(&self) -> rustix::io::Result<()> {
        let other =
            rustix::fs::open(&self.path, OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC, Mode::empty())?;
        let mut settings = tcgetattr(&other)?;
        settings.make_raw();
        tcsetattr(&other, OptionalActions::Now, &settings)?;
        tcflush(&other, QueueSelector::IOFlush)
    }

    /// Looks whether a host has the port open; says what changed.
    pub fn look(&mut self) -> Option<bool> {
        let mut watched = [PollFd::new(&self.end, PollFlags::empty())];
        let now = Timespec { tv_sec: 0, tv_nsec: 0 };
        let there = match poll(&mut watched, Some(&now)) {
            Ok(_) => !watched[0].revents().contains(PollFlags::HUP),
            // Interrupted: nothing new.
            Err(_) => self.host_there,
        };
        if there == self.host_there {
            return None;
        }
        self.host_there = there;
        self.waiting.clear();
        if !there {
            // What cannot be tidied is for the next host to sort out: it begins with a frame's end.
            let _ = self.tidy();
        }
        Some(there)
    }

    /// What the host sent.
    pub fn receive(&mut self) -> Vec<u8> {
        let mut buffer = [0; 4096];
        let mut bytes = Vec::new();
        // Nothing there, or nobody: both are no bytes.
        while let Ok(count @ 1..) = rustix::io::read(&self.end, &mut buffer) {
            bytes.extend_from_slice(&buffer[..count]);
        }
        bytes
    }

    /// Sends to the host, now or when it has room.
    pub fn send(&mut self, bytes: &[u8]) {
        if !self.host_there {
            return;
        }
        let room = MOST_WAITING.saturating_sub(self.waiting.len());
        let (taken, lost) = bytes.split_at(room.min(bytes.len()));
        self.waiting.extend_from_slice(taken);
        self.lost_bytes += lost.len() as u64;
        let mut sent = 0;
        while let Some(rest @ [_, ..]) = self.waiting.get(sent..) {
            match rustix::io::write(&self.end, rest) {
                Ok(count) => sent += count,
                Err(rustix::io::Errno::INTR) => {}
                Err(_) => break,
            }
        }
        self.waiting.drain(..sent);
    }
}

/// A link where none is, or where one is that leads to a pseudo-terminal: of a bench that was killed.
fn make_link(path: &Path, link: &Path) -> Result<(), BenchError> {
    match std::fs::read_link(link) {
        Ok(old) if old.starts_with("/dev/pts") => {
            std::fs::remove_file(link).map_err(|e| InputError::io(link, "replace this link", &e))?;
        }
        _ if link.symlink_metadata().is_ok() => {
            return Err(InputError::new("is there already and is no link to a pseudo-terminal")
                .file("--link")
                .value(link.display())
                .allowed("a new name")
                .into());
        }
        _ => {}
    }
    std::os::unix::fs::symlink(path, link).map_err(|e| InputError::io(link, "make this link", &e).into())
}

impl Drop for Pty {
    fn drop(&mut self) {
        if let Some(link) = &self.link
            && std::fs::read_link(link).is_ok_and(|target| target == self.path)
        {
            // Nobody is left to tell; the next bench replaces it.
            let _ = std::fs::remove_file(link);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    fn wait_for(mut what: impl FnMut() -> bool) -> bool {
        (0..500).any(|_| {
            std::thread::sleep(std::time::Duration::from_millis(2));
            what()
        })
    }

    #[test]
    fn a_host_that_comes_and_goes_finds_nothing_of_the_one_before() {
        let folder = std::env::temp_dir().join(format!("rig-pty-test-{}", std::process::id()));
        let mut pty = Pty::open().unwrap();
        pty.link_to(&folder).unwrap();
        assert_eq!(pty.path(), folder);
        pty.send(b"for nobody");
        let open = || std::fs::File::options().read(true).write(true).open(&folder).unwrap();
        let mut first = open();
        assert_eq!(pty.look(), Some(true));
        first.write_all(b"hi\r\0\n").unwrap();
        let mut heard = Vec::new();
        assert!(wait_for(|| {
            heard.extend(pty.receive());
            heard == b"hi\r\0\n"
        }));
        pty.send(b"left unread");
        drop(first);
        assert!(wait_for(|| pty.look() == Some(false)));
        let mut second = open();
        assert_eq!(pty.look(), Some(true));
        pty.send(b"new");
        let mut bytes = [0; 3];
        second.read_exact(&mut bytes).unwrap();
        assert_eq!(&bytes, b"new");
        drop(pty);
        assert!(folder.symlink_metadata().is_err(), "the link goes with the port");
    }

    #[test]
    fn a_file_in_the_links_place_stays_and_a_dead_link_does_not() {
        let place = std::env::temp_dir().join(format!("rig-pty-place-{}", std::process::id()));
        std::fs::write(&place, "mine").unwrap();
        let mut pty = Pty::open().unwrap();
        assert!(pty.link_to(&place).unwrap_err().to_string().contains("--link"));
        assert_eq!(std::fs::read_to_string(&place).unwrap(), "mine");
        std::fs::remove_file(&place).unwrap();
        std::os::unix::fs::symlink("/dev/pts/99999", &place).unwrap();
        pty.link_to(&place).unwrap();
        assert!(std::fs::read_link(&place).unwrap() == pty.path);
    }

    #[test]
    fn what_a_host_does_not_read_is_lost_and_counted() {
        let mut pty = Pty::open().unwrap();
        let _silent = std::fs::File::options().read(true).write(true).open(pty.path()).unwrap();
        pty.look();
        assert!(!pty.is_behind());
        let chunk = [0x55; 4096];
        (0..1000).for_each(|_| pty.send(&chunk));
        assert!(pty.lost_bytes() > 3_000_000, "{}", pty.lost_bytes());
        assert!(pty.is_behind());
    }
}
