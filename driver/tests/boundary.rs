//! Guards the boundary to C: what a C author gets wrong comes back as a number and a sentence, never as a crash.

use anhyst_driver::{
    anhyst_close, anhyst_last_error, anhyst_open_checked, anhyst_receive, anhyst_send, anhyst_wait_for_tick,
};
use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};

const BAD_ARGUMENT: i32 = -4;

fn last_error() -> String {
    // SAFETY: the library's own string, read before the next call.
    unsafe { CStr::from_ptr(anhyst_last_error()) }
        .to_string_lossy()
        .into_owned()
}

/// Opens, expects a refusal, and returns its sentence.
fn refusal(process: &str, processes: &str, reads: u32, start_limit_s: f64, layouts: u64) -> String {
    let text = |text: &str| CString::new(text).unwrap();
    let (process, processes) = (text(process), text(processes));
    let (prefix, root) = (text("anhysttest_boundary_"), text("/tmp/anhysttest-boundary"));
    // SAFETY: strings that end with a zero byte.
    let handle = unsafe {
        anhyst_open_checked(
            process.as_ptr(),
            prefix.as_ptr(),
            root.as_ptr(),
            processes.as_ptr(),
            reads,
            start_limit_s,
            layouts,
        )
    };
    assert!(handle.is_null());
    last_error()
}

#[test]
fn what_cannot_be_meant_is_refused_in_words() {
    let layouts = anhyst_ipc::layouts();
    let both = "guard,amplifier";
    for (sentence, words) in [
        (refusal("amplifier", both, 1, 1.0, layouts ^ 1), "compile it again"),
        (
            refusal("amplifyer", both, 1, 1.0, layouts),
            "\"amplifyer\" is no process of this run",
        ),
        (
            refusal("amplifier", "gard,amplifier", 1, 1.0, layouts),
            "\"gard\" is no process",
        ),
        (
            refusal("amplifier", both, 1 << 7, 1.0, layouts),
            "channels that do not exist",
        ),
        (refusal("amplifier", both, 1, f64::NAN, layouts), "start limit of NaN s"),
    ] {
        assert!(sentence.contains(words), "{sentence}");
    }
}

#[test]
fn null_is_survived() {
    let mut token = [0_u64; 8];
    // SAFETY: null handles are allowed, and looked at before the token.
    let results = unsafe {
        [
            anhyst_receive(null_mut(), 5, token.as_mut_ptr().cast(), 0),
            anhyst_send(null_mut(), 6, null()),
            anhyst_wait_for_tick(null_mut(), 0),
        ]
    };
    assert_eq!(results, [BAD_ARGUMENT; 3]);
    assert_eq!(last_error(), "the handle is null");
    // SAFETY: null may be closed.
    assert_eq!(unsafe { anhyst_close(null_mut()) }, 0);
    assert_eq!(last_error(), "");
}
