//! What the person at the bench types: one key, one deed; in a pipe one character.

use crate::part::Motor;
use rustix::termios::{LocalModes, OptionalActions, Termios, tcgetattr, tcsetattr};
use std::io::{IsTerminal, Read, stdin};
use std::sync::mpsc::{Receiver, channel};

/// What the keys do, as shown to the person.
pub const HELP: &str = "keys: a arm switch off/on   e or space emergency stop press/release   \
x drive fault of M1 on/off   d drive fault of M2 on/off   1 friction bridge unplugged/plugged in   \
2 normal force bridge unplugged/plugged in   t turn the disc by hand, one turn forward   \
m press M1 by hand/let go   f next weight on the torque ring   n next weight on the frame   \
u link unplugged/plugged in   r reset   p power off/on   ? help   q quit";

/// A deed at the bench.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Key {
    /// Turn the arm switch.
    ArmSwitch,
    /// Press the emergency stop, or release it.
    EmergencyStop,
    /// A drive reports a fault, or none.
    DriveFault(Motor),
    /// A bridge's plug is pulled, or put in: friction (0), normal force (1).
    BridgePlug(usize),
    /// Turn the disc one turn forward by hand.
    TurnDisc,
    /// Press on M1's shaft, or let go.
    PressM1,
    /// Hang the next weight on the torque ring, after the last one none.
    FrictionWeight,
    /// Hang the next weight on the frame, after the last one none.
    NormalWeight,
    /// Pull the link's plug, or put it in.
    Link,
    /// Pull the reset pin.
    Reset,
    /// Cut the power, or give it back.
    Power,
    /// Show what the keys do.
    Help,
    /// End the bench.
    Quit,
}

impl Key {
    /// What a character stands for.
    #[must_use]
    pub fn of(character: u8) -> Option<Self> {
        Some(match character.to_ascii_lowercase() {
            b'a' => Self::ArmSwitch,
            b'e' | b' ' => Self::EmergencyStop,
            b'x' => Self::DriveFault(Motor::M1),
            b'd' => Self::DriveFault(Motor::M2),
            b'1' => Self::BridgePlug(0),
            b'2' => Self::BridgePlug(1),
            b't' => Self::TurnDisc,
            b'm' => Self::PressM1,
            b'f' => Self::FrictionWeight,
            b'n' => Self::NormalWeight,
            b'u' => Self::Link,
            b'r' => Self::Reset,
            b'p' => Self::Power,
            b'?' | b'h' => Self::Help,
            b'q' => Self::Quit,
            _ => return None,
        })
    }
}

/// The keyboard; a terminal gives keys at once and without echo as long as this lives.
#[derive(Debug)]
pub struct Keyboard {
    keys: Receiver<Key>,
    before: Option<Termios>,
}

impl Keyboard {
    /// Begins to listen.
    #[must_use]
    pub fn listen() -> Self {
        let before = if stdin().is_terminal() { tcgetattr(stdin()).ok() } else { None };
        if let Some(settings) = &before {
            let mut at_once = settings.clone();
            at_once.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
            // Where it cannot be set, keys come with the next Enter.
            let _ = tcsetattr(stdin(), OptionalActions::Now, &at_once);
        }
        let (to, keys) = channel();
        // Reading blocks; the thread ends with the process, or where standard input does.
        std::thread::spawn(move || {
            let mut character = [0];
            while stdin().read_exact(&mut character).is_ok() {
                if let Some(key) = Key::of(character[0])
                    && to.send(key).is_err()
                {
                    break;
                }
            }
        });
        Self { keys, before }
    }

    /// The next key, if one was pressed.
    pub fn pressed(&self) -> Option<Key> {
        self.keys.try_recv().ok()
    }
}

impl Drop for Keyboard {
    fn drop(&mut self) {
        if let Some(before) = &self.before {
            let _ = tcsetattr(stdin(), OptionalActions::Now, before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_key_in_the_help_does_something_and_line_ends_do_nothing() {
        let named: Vec<u8> =
            HELP.split("   ").map(|part| part.trim_start_matches("keys: ").as_bytes()[0]).collect();
        assert_eq!(named.len(), 15);
        let mut deeds: Vec<Key> = named.iter().map(|key| Key::of(*key).unwrap()).collect();
        deeds.dedup();
        assert_eq!(deeds.len(), 15);
        assert_eq!((Key::of(b'\n'), Key::of(b' ')), (None, Some(Key::EmergencyStop)));
    }
}
