//! A rig behind a pseudo-terminal, and the tool as a user runs it on that port.

use std::os::fd::AsRawFd;
use std::process::{Command, Output};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::Duration;

use serial2::SerialPort;

use super::{Rig, setup};

/// A rig behind a port of its own, as long as this lives.
pub struct Bench {
    pub port: String,
    /// Keeps the terminal there between two commands.
    _end: SerialPort,
    pub rig: Arc<Mutex<Rig>>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

impl Bench {
    pub fn new() -> Self {
        let (_, setup) = setup("fig20");
        let mut rig = Rig::new(&setup);
        rig.willing = true;
        let rig = Arc::new(Mutex::new(rig));
        let (mut rig_end, tool_end) = SerialPort::pair().unwrap();
        let link = format!("/proc/self/fd/{}", tool_end.as_raw_fd());
        let port = std::fs::read_link(link).unwrap().display().to_string();
        rig_end.set_read_timeout(Duration::from_millis(1)).unwrap();
        rig_end.set_write_timeout(Duration::from_millis(1)).unwrap();
        let stop = Arc::new(AtomicBool::new(false));
        let (shared, ends) = (Arc::clone(&rig), Arc::clone(&stop));
        let thread = std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            let mut waiting = Vec::new();
            while !ends.load(Ordering::Relaxed) {
                let count = rig_end.read(&mut buffer).unwrap_or(0);
                waiting.extend(shared.lock().unwrap().millisecond(&buffer[..count]));
                if waiting.len() > 1 << 16 {
                    // Nobody has read for a second: a board's bytes are lost then.
                    waiting.clear();
                }
                let sent = rig_end.write(&waiting).unwrap_or(0);
                waiting.drain(..sent);
            }
        });
        Self { port, _end: tool_end, rig, stop, thread: Some(thread) }
    }

    /// The tool with these arguments.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_rig"));
        command.args(arguments);
        command
    }

    /// Runs the tool on this port to its end.
    pub fn rig(&self, arguments: &[&str]) -> Output {
        self.command(&[arguments, &["--port", &self.port]].concat()).output().unwrap()
    }

    /// The cable is pulled: the port is there no more.
    pub fn unplug(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
        if let Some(thread) = self.thread.take() {
            thread.join().unwrap();
        }
    }
}

impl Drop for Bench {
    fn drop(&mut self) {
        self.unplug();
    }
}
