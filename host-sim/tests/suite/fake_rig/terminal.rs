//! A terminal of a given size that a program draws on, and what can be read there.

use std::fs::File;
use std::io::{Read, Write};
use std::num::NonZero;
use std::os::fd::OwnedFd;
use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

pub struct Terminal {
    end: OwnedFd,
    other: OwnedFd,
    parser: Arc<Mutex<vt100::Parser>>,
}

impl Terminal {
    pub fn new(rows: u16, columns: u16) -> Self {
        let end = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY | OpenptFlags::CLOEXEC).unwrap();
        grantpt(&end).unwrap();
        unlockpt(&end).unwrap();
        let path = ptsname(&end, Vec::new()).unwrap();
        let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
        let other = rustix::fs::open(path.as_c_str(), flags, Mode::empty()).unwrap();
        let parser = Arc::new(Mutex::new(vt100::Parser::new(
            NonZero::new(rows).unwrap(),
            NonZero::new(columns).unwrap(),
            0,
        )));
        let mut reader = File::from(end.try_clone().unwrap());
        let shared = Arc::clone(&parser);
        std::thread::spawn(move || {
            let mut buffer = [0; 4096];
            while let Ok(count @ 1..) = reader.read(&mut buffer) {
                shared.lock().unwrap().process(&buffer[..count]);
            }
        });
        let terminal = Self { end, other, parser };
        terminal.size(rows, columns);
        terminal
    }

    fn size(&self, rows: u16, columns: u16) {
        tcsetwinsize(&self.end, Winsize { ws_row: rows, ws_col: columns, ws_xpixel: 0, ws_ypixel: 0 })
            .unwrap();
    }

    /// Another size. Without a controlling terminal nobody is told; the program looks by itself when it draws.
    pub fn resize(&self, rows: u16, columns: u16) {
        self.parser
            .lock()
            .unwrap()
            .screen_mut()
            .set_size(NonZero::new(rows).unwrap(), NonZero::new(columns).unwrap());
        self.size(rows, columns);
    }

    pub fn spawn(&self, command: &mut Command) -> Child {
        let end = || Stdio::from(self.other.try_clone().unwrap());
        command.stdin(end()).stdout(end()).stderr(end()).env("TERM", "xterm-256color").spawn().unwrap()
    }

    pub fn press(&self, keys: &[u8]) {
        File::from(self.end.try_clone().unwrap()).write_all(keys).unwrap();
    }

    /// Waits until the screen is as wanted, and gives its text.
    #[track_caller]
    pub fn wait_for(&self, wanted: impl Fn(&vt100::Screen) -> bool) -> String {
        for _ in 0..1000 {
            {
                let parser = self.parser.lock().unwrap();
                if wanted(parser.screen()) {
                    return parser.screen().contents();
                }
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        panic!("the screen stays so:\n{}", self.parser.lock().unwrap().screen().contents());
    }
}
