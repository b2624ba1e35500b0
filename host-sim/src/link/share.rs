//! What comes from a rig, for whoever looks on while another command holds the port.
//!
//! The command that holds a port passes every byte it receives on to the readers of a local socket. The socket has a
//! name in the kernel's own space (Linux's abstract names), derived from the port's, so that nothing is left when the
//! holder is killed: its readers see the end of the stream, and the port is free. A reader cannot send anything to the
//! rig. One that does not read loses what it did not take. Where there are no such names, nobody can look on.

#[cfg(target_os = "linux")]
mod linux {
    use std::io::{ErrorKind, Read, Write};
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
    use std::time::Duration;

    use super::super::procedure::Transport;

    const WAIT: Duration = Duration::from_millis(5);

    fn address(port: &str) -> std::io::Result<SocketAddr> {
        // The same port may go by several names.
        let real = std::fs::canonicalize(port).unwrap_or_else(|_| port.into());
        SocketAddr::from_abstract_name(format!("rubber-rig:{}", real.display()))
    }

    /// The holder's end.
    #[derive(Debug, Default)]
    pub struct Broadcast {
        listener: Option<UnixListener>,
        readers: Vec<UnixStream>,
    }

    impl Broadcast {
        /// Offers what comes from a port; where that is not possible, offers nothing.
        #[must_use]
        pub fn of(port: &str) -> Self {
            let listener = address(port).and_then(|address| UnixListener::bind_addr(&address)).ok();
            let listener = listener.filter(|listener| listener.set_nonblocking(true).is_ok());
            Self { listener, readers: Vec::new() }
        }

        /// Passes bytes on.
        pub fn pass(&mut self, bytes: &[u8]) {
            while let Some(Ok((reader, _))) = self.listener.as_ref().map(UnixListener::accept) {
                if reader.set_nonblocking(true).is_ok() {
                    self.readers.push(reader);
                }
            }
            // A frame that was cut short is thrown away at the other end by its checksum.
            self.readers.retain_mut(|reader| match reader.write(bytes) {
                Ok(_) => true,
                Err(error) => error.kind() == ErrorKind::WouldBlock,
            });
        }
    }

    /// A reader's end.
    #[derive(Debug)]
    pub struct Listener {
        name: String,
        stream: UnixStream,
    }

    impl Listener {
        /// Listens to the holder of a port; none where nobody offers it.
        #[must_use]
        pub fn to(port: &str) -> Option<Self> {
            let stream = UnixStream::connect_addr(&address(port).ok()?).ok()?;
            stream.set_read_timeout(Some(WAIT)).ok()?;
            Some(Self { name: port.to_owned(), stream })
        }
    }

    impl Transport for Listener {
        fn name(&self) -> String {
            self.name.clone()
        }

        fn receive(&mut self, bytes: &mut Vec<u8>) -> std::io::Result<()> {
            let mut buffer = [0; 4096];
            match self.stream.read(&mut buffer) {
                Ok(0) => Err(ErrorKind::UnexpectedEof.into()),
                Ok(count) => {
                    bytes.extend_from_slice(buffer.get(..count).unwrap_or_default());
                    Ok(())
                }
                Err(error)
                    if matches!(
                        error.kind(),
                        ErrorKind::TimedOut | ErrorKind::WouldBlock | ErrorKind::Interrupted
                    ) =>
                {
                    Ok(())
                }
                Err(error) => Err(error),
            }
        }

        fn send(&mut self, _bytes: &[u8]) -> std::io::Result<()> {
            // Whoever only looks on has nothing to say.
            Ok(())
        }
    }

    #[cfg(test)]
    mod tests {
        use super::*;

        #[test]
        fn whoever_looks_on_hears_the_rig_until_the_holder_goes() {
            let port = format!("share-test-{}", std::process::id());
            assert!(Listener::to(&port).is_none());
            let mut holder = Broadcast::of(&port);
            let mut reader = Listener::to(&port).unwrap();
            holder.pass(b"one");
            let mut heard = Vec::new();
            while heard.len() < 3 {
                reader.receive(&mut heard).unwrap();
            }
            reader.send(b"nobody hears this").unwrap();
            assert_eq!(heard, b"one");
            drop(holder);
            assert!(reader.receive(&mut heard).is_err() && Listener::to(&port).is_none());
        }

        #[test]
        fn a_reader_that_sleeps_stops_nobody() {
            let port = format!("share-sleeper-{}", std::process::id());
            let mut holder = Broadcast::of(&port);
            let _sleeper = Listener::to(&port).unwrap();
            (0..10_000).for_each(|_| holder.pass(&[0x55; 100]));
        }
    }
}

#[cfg(target_os = "linux")]
pub use linux::{Broadcast, Listener};

#[cfg(not(target_os = "linux"))]
mod elsewhere {
    use super::super::procedure::Transport;

    /// Offers nothing.
    #[derive(Debug, Default)]
    pub struct Broadcast;

    impl Broadcast {
        /// Offers nothing.
        #[must_use]
        pub fn of(_port: &str) -> Self {
            Self
        }

        /// Nobody listens.
        pub fn pass(&mut self, _bytes: &[u8]) {}
    }

    /// There is none.
    #[derive(Debug)]
    pub enum Listener {}

    impl Listener {
        /// Nobody offers anything.
        #[must_use]
        pub fn to(_port: &str) -> Option<Self> {
            None
        }
    }

    impl Transport for Listener {
        fn name(&self) -> String {
            match *self {}
        }

        fn receive(&mut self, _bytes: &mut Vec<u8>) -> std::io::Result<()> {
            match *self {}
        }

        fn send(&mut self, _bytes: &[u8]) -> std::io::Result<()> {
            match *self {}
        }
    }
}

#[cfg(not(target_os = "linux"))]
pub use elsewhere::{Broadcast, Listener};
