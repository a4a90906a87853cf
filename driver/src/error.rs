//! Errors as C sees them: a negative number, and a sentence for the thread that met it.

use anhyst_ipc::LinkError;
use std::cell::RefCell;
use std::ffi::{CString, c_char};

const GAP: i32 = -1;
const UNDELIVERED: i32 = -2;
const ABSENT: i32 = -3;
const BAD_ARGUMENT: i32 = -4;
const TRANSPORT: i32 = -5;
/// A panic was caught.
pub const PANIC: i32 = -6;

/// A refused call.
pub struct Failure {
    /// What the function returns.
    pub code: i32,
    /// What `anhyst_last_error` says.
    pub sentence: String,
}

impl Failure {
    /// A call that cannot be meant.
    pub fn bad(sentence: String) -> Self {
        Self {
            code: BAD_ARGUMENT,
            sentence,
        }
    }

    /// A null handle.
    pub fn no_handle() -> Self {
        Self::bad("the handle is null".into())
    }
}

impl From<LinkError> for Failure {
    fn from(error: LinkError) -> Self {
        let code = match error {
            LinkError::Gap { .. } => GAP,
            LinkError::Undelivered { .. } => UNDELIVERED,
            LinkError::Absent { .. } => ABSENT,
            LinkError::UnknownProcess { .. } | LinkError::UnknownClock { .. } | LinkError::NotOpened { .. } => {
                BAD_ARGUMENT
            }
            _ => TRANSPORT,
        };
        Self {
            code,
            sentence: error.to_string(),
        }
    }
}

thread_local! {
    static LAST: RefCell<CString> = RefCell::default();
}

/// Keeps a sentence for [`last`].
fn remember(sentence: &str) {
    // A zero byte inside would end the sentence early; there is none in ours.
    let sentence = CString::new(sentence.replace('\0', " ")).unwrap_or_default();
    LAST.with_borrow_mut(|last| *last = sentence);
}

/// Drops the kept sentence. Costs nothing where there is none: it is called in every tick.
fn forget() {
    LAST.with_borrow_mut(|last| {
        if !last.is_empty() {
            *last = CString::default();
        }
    });
}

/// The kept sentence; it lives until the thread's next call.
pub fn last() -> *const c_char {
    LAST.with_borrow(|last| last.as_ptr())
}

/// Takes the result of a call over the boundary: a number, and the sentence kept for `anhyst_last_error`.
pub fn result_code(result: Result<i32, Failure>) -> i32 {
    match result {
        Ok(code) => {
            forget();
            code
        }
        Err(failure) => {
            remember(&failure.sentence);
            failure.code
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the numbers: the header is written by hand, so each must stand in it.
    #[test]
    fn the_header_has_the_same_numbers() {
        let header = include_str!("functions.h");
        for (name, code) in [
            ("OK", crate::OK),
            ("SILENCE", crate::SILENCE),
            ("END", crate::END),
            ("GAP", GAP),
            ("UNDELIVERED", UNDELIVERED),
            ("ABSENT", ABSENT),
            ("BAD_ARGUMENT", BAD_ARGUMENT),
            ("TRANSPORT", TRANSPORT),
            ("PANIC", PANIC),
        ] {
            let value = if code < 0 {
                format!("({code})")
            } else {
                code.to_string()
            };
            let line = header
                .lines()
                .find(|line| line.starts_with(&format!("#define ANHYST_{name} ")))
                .unwrap();
            assert_eq!(line.split_whitespace().nth(2), Some(value.as_str()), "{name}");
        }
    }
}
