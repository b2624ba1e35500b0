//! Large values lent from a thread to the control tick without a copy on the way.
//!
//! The thread puts a whole prepared value into a static cell and sends a reference to it with a command.
//! The tick answers when it is done with it; only then the thread takes the cell back.

use core::cell::UnsafeCell;
use core::mem::MaybeUninit;
use core::sync::atomic::{AtomicBool, Ordering};

/// A cell that holds one value, which is either free or lent.
pub struct Handover<T> {
    lent: AtomicBool,
    value: UnsafeCell<MaybeUninit<T>>,
}

// SAFETY: `lend` gives out shared references only after it alone claimed the cell, and writes only then.
unsafe impl<T: Send + Sync> Sync for Handover<T> {}

impl<T: 'static> Handover<T> {
    /// A free cell.
    #[must_use]
    #[allow(clippy::new_without_default)] // for statics
    pub const fn new() -> Self {
        Self { lent: AtomicBool::new(false), value: UnsafeCell::new(MaybeUninit::uninit()) }
    }

    /// Stores a value and lends it, unless the cell is lent already.
    pub fn lend(&'static self, value: T) -> Option<&'static T> {
        if self.lent.swap(true, Ordering::Acquire) {
            return None;
        }
        // SAFETY: the swap above claimed the cell: no reference to the old value is alive (`reclaim`), and
        // nobody else writes. The value is initialised before the reference is made.
        unsafe { Some((*self.value.get()).write(value)) }
    }

    /// Takes the cell back.
    ///
    /// # Safety
    /// Nobody holds the reference `lend` gave out any more: the tick has answered the command.
    pub unsafe fn reclaim(&self) {
        self.lent.store(false, Ordering::Release);
    }
}
