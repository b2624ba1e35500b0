//! Ctrl-C and the signals that end a process: counted, so that a command can end its work in order.

use std::sync::Once;
use std::sync::atomic::{AtomicUsize, Ordering};

static COUNT: AtomicUsize = AtomicUsize::new(0);
static INSTALL: Once = Once::new();

/// Why a command was ended by a signal.
pub(super) const BY_USER: &str = "stopped by the user (Ctrl-C, or the process was told to end)";

/// From now on signals are counted instead of ending the process.
pub fn count_signals() {
    INSTALL.call_once(|| {
        let counted = ctrlc::set_handler(|| {
            COUNT.fetch_add(1, Ordering::Relaxed);
        });
        if let Err(error) = counted {
            eprintln!("Ctrl-C will end the program at once: {error}");
        }
    });
}

/// How many have come.
pub fn count() -> usize {
    COUNT.load(Ordering::Relaxed)
}
