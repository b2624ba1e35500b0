//! What a person should know although the command goes on: doubts about logs, assumptions, things left out.
//!
//! A notice is printed on stderr when it comes, and kept for those who want all of them (`--json`).

use std::sync::Mutex;

static KEPT: Mutex<Vec<String>> = Mutex::new(Vec::new());

/// Says something doubtful, once.
pub fn warn(text: &str) {
    let Ok(mut kept) = KEPT.lock() else { return };
    if !kept.iter().any(|known| known == text) {
        eprintln!("rig: {text}");
        kept.push(text.to_owned());
    }
}

/// What was said since the last call.
pub fn take() -> Vec<String> {
    KEPT.lock().map_or_else(|_| Vec::new(), |mut kept| std::mem::take(&mut *kept))
}
