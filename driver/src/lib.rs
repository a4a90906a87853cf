//! A C library for programs that take a node's place in the loop: open, receive with a time-out, send, close. A C author sees
//! no iceoryx2. The header is `driver/include/anhyst.h`, made by `anhyst interface --c-header`.
//!
//! This is the only crate with a boundary to another language. Every function catches panics: none may cross it.

mod boundary;
mod error;
mod options;

use anhyst_ipc::{Channel, ExternalNode, MAX_WORDS, RawToken, Received};
use boundary::{guarded, read_words, text, write_words};
use error::Failure;
use std::ffi::{c_char, c_void};
use std::time::Duration;

const OK: i32 = 0;
const SILENCE: i32 = 1;
const END: i32 = 2;

/// A process's place in the loop.
pub struct AnhystHandle {
    external: ExternalNode,
}

fn channel(number: u32) -> Result<Channel, Failure> {
    Channel::ALL.get(number as usize).copied().ok_or_else(|| {
        Failure::bad(format!(
            "channel {number} does not exist; there are 0 to {}",
            Channel::ALL.len() - 1
        ))
    })
}

/// Opens a process's channels and meets the others. Null on error.
///
/// # Safety
/// Each string is null or ends with a zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn anhyst_open_checked(
    process: *const c_char,
    prefix: *const c_char,
    root: *const c_char,
    processes: *const c_char,
    reads: u32,
    start_limit_s: f64,
    layouts: u64,
) -> *mut AnhystHandle {
    let mut handle = std::ptr::null_mut();
    guarded(|| {
        // SAFETY: the caller's promise, passed on.
        let [process, prefix, root, processes] =
            unsafe { [text(process)?, text(prefix)?, text(root)?, text(processes)?] };
        if layouts != anhyst_ipc::layouts() {
            return Err(Failure::bad(
                "the program was compiled against another anhyst.h than this library: compile it again".into(),
            ));
        }
        let settings = options::settings(process, prefix, root, processes, reads, start_limit_s)?;
        let external = ExternalNode::open(settings, options::clock()?)?;
        handle = Box::into_raw(Box::new(AnhystHandle { external }));
        Ok(OK)
    });
    handle
}

/// Waits for a channel's next token.
///
/// # Safety
/// `handle` comes from `anhyst_open` and was not closed; `token` is the struct of that channel.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn anhyst_receive(
    handle: *mut AnhystHandle,
    channel_number: u32,
    token: *mut c_void,
    timeout_us: u64,
) -> i32 {
    guarded(|| {
        // SAFETY: by the caller's promise a live handle of this thread, or null.
        let handle = unsafe { handle.as_mut() }.ok_or_else(Failure::no_handle)?;
        let channel = channel(channel_number)?;
        let mut words = [0; MAX_WORDS];
        let limit = Duration::from_micros(timeout_us);
        let received = handle.external.receive(channel, limit, &mut words);
        if matches!(
            received,
            Ok(Received::Token(_)) | Err(anhyst_ipc::LinkError::Gap { .. })
        ) {
            // SAFETY: by the caller's promise `token` is the channel's struct, which has so many words.
            unsafe { write_words(token, &words[..RawToken::words_of(channel)])? };
        }
        Ok(match received? {
            Received::Token(_) => OK,
            Received::Silence => SILENCE,
            Received::End => END,
        })
    })
}

/// Sends a token.
///
/// # Safety
/// As for [`anhyst_receive`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn anhyst_send(handle: *mut AnhystHandle, channel_number: u32, token: *const c_void) -> i32 {
    guarded(|| {
        // SAFETY: by the caller's promise a live handle of this thread, or null.
        let handle = unsafe { handle.as_mut() }.ok_or_else(Failure::no_handle)?;
        let channel = channel(channel_number)?;
        let mut words = [0; MAX_WORDS];
        // SAFETY: by the caller's promise `token` is the channel's struct, which has so many words.
        unsafe { read_words(token, &mut words[..RawToken::words_of(channel)])? };
        handle.external.send(channel, &words)?;
        Ok(OK)
    })
}

/// In real time sleeps until a tick begins.
///
/// # Safety
/// As for [`anhyst_receive`], without `token`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn anhyst_wait_for_tick(handle: *mut AnhystHandle, tick: u64) -> i32 {
    guarded(|| {
        // SAFETY: by the caller's promise a live handle of this thread, or null.
        let handle = unsafe { handle.as_mut() }.ok_or_else(Failure::no_handle)?;
        handle.external.wait_for_tick(tick)?;
        Ok(OK)
    })
}

/// Leaves the loop and frees the handle.
///
/// # Safety
/// `handle` is null or comes from `anhyst_open`; it must not be used again.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn anhyst_close(handle: *mut AnhystHandle) -> i32 {
    guarded(|| {
        if handle.is_null() {
            return Ok(OK);
        }
        // SAFETY: not null, made by `Box::into_raw` in `anhyst_open_checked`, and by the caller's promise closed only once.
        let handle = unsafe { Box::from_raw(handle) };
        handle.external.close()?;
        Ok(OK)
    })
}

/// The last error of this thread; empty if there was none.
#[unsafe(no_mangle)]
pub extern "C" fn anhyst_last_error() -> *const c_char {
    error::last()
}
