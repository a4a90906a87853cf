//! A reader of somebody else's that panics on a broken file refuses it, and says nothing on its own.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::sync::Once;

use super::Reason;

thread_local! {
    /// This thread reads a file under guard.
    static READING: Cell<bool> = const { Cell::new(false) };
}

static HOOK: Once = Once::new();

/// What `read` says; where it panics, that the file is broken.
pub(super) fn guarded<T>(read: impl FnOnce() -> Result<T, Reason>) -> Result<T, Reason> {
    HOOK.call_once(|| {
        let before = take_hook();
        set_hook(Box::new(move |panic| {
            if !READING.get() {
                before(panic);
            }
        }));
    });
    READING.set(true);
    // Nothing outlives the call: the bytes are only read, and what was being made is dropped.
    let ended = catch_unwind(AssertUnwindSafe(read));
    READING.set(false);
    ended.unwrap_or_else(|_| Err("it contradicts itself, so it is torn or was not written to the end".into()))
}

#[cfg(test)]
mod tests {
    /// Guards that a panic becomes a refusal and the next call still works.
    #[test]
    fn a_panic_is_a_refusal() {
        let broken: Result<(), _> = super::guarded(|| panic!("by a reader"));
        assert!(broken.unwrap_err().contains("torn"));
        assert_eq!(super::guarded(|| Ok(3)), Ok(3));
    }
}
