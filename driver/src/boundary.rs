//! What crosses the boundary to C: strings, tokens, and never a panic.

use crate::error::{Failure, PANIC, result_code};
use std::ffi::{CStr, c_char, c_void};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs a function's body. A panic becomes a result, because it must not unwind into C.
pub fn guarded(body: impl FnOnce() -> Result<i32, Failure>) -> i32 {
    // After a panic a handle may be half-way through a token: the header says that it can only be closed.
    let caught = catch_unwind(AssertUnwindSafe(body));
    result_code(caught.unwrap_or_else(|_| {
        Err(Failure {
            code: PANIC,
            sentence: "the library has a fault: see the standard error output".into(),
        })
    }))
}

/// A string of C's; none for null.
///
/// # Safety
/// `text` is null or ends with a zero byte and lives as long as the result.
pub unsafe fn text<'a>(text: *const c_char) -> Result<Option<&'a str>, Failure> {
    if text.is_null() {
        return Ok(None);
    }
    // SAFETY: not null; the rest is the caller's promise.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_str()
        .map(Some)
        .map_err(|_| Failure::bad("a string is no UTF-8".into()))
}

fn aligned(token: *const c_void) -> Result<*const u64, Failure> {
    let words = token.cast::<u64>();
    if words.is_null() || !words.is_aligned() {
        return Err(Failure::bad("a token is null or not aligned to 8 bytes".into()));
    }
    Ok(words)
}

/// Copies a token's words to C's struct.
///
/// # Safety
/// `token` is null or a struct of as many words.
pub unsafe fn write_words(token: *mut c_void, words: &[u64]) -> Result<(), Failure> {
    let target = aligned(token)?.cast_mut();
    // SAFETY: not null and aligned (checked), long enough (the caller's promise), and our own words cannot overlap it.
    unsafe { std::ptr::copy_nonoverlapping(words.as_ptr(), target, words.len()) };
    Ok(())
}

/// Copies the words of C's struct.
///
/// # Safety
/// `token` is null or a struct of as many words.
pub unsafe fn read_words(token: *const c_void, words: &mut [u64]) -> Result<(), Failure> {
    let source = aligned(token)?;
    // SAFETY: as in `write_words`; every bit pattern is a valid word.
    unsafe { std::ptr::copy_nonoverlapping(source, words.as_mut_ptr(), words.len()) };
    Ok(())
}
