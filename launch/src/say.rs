//! Lines for the user, and words of commands that the user is told to type.

use std::cell::RefCell;
use std::fmt::Arguments;
use std::io::Write as _;

/// A path as the shell takes it for one word.
pub fn quoted(path: &std::path::Path) -> String {
    let text = path.display().to_string();
    // What no shell can take (a NUL) no path can hold.
    shlex::try_quote(&text).map_or_else(|_| text.clone(), std::borrow::Cow::into_owned)
}

/// What was said and complained of, a line each.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Kept {
    /// For standard output.
    pub said: String,
    /// For standard error.
    pub complained: String,
}

thread_local! {
    static KEPT: RefCell<Option<Kept>> = const { RefCell::new(None) };
}

/// Does a work and keeps what this thread says meanwhile: for a program that has a command within it.
pub fn kept<T>(work: impl FnOnce() -> T) -> (T, Kept) {
    let before = KEPT.replace(Some(Kept::default()));
    let done = work();
    (done, KEPT.replace(before).unwrap_or_default())
}

/// A line for standard output, or for standard error if it is `complained`.
pub fn line(complained: bool, text: Arguments<'_>) {
    KEPT.with_borrow_mut(|kept| match (kept, complained) {
        (Some(kept), false) => keep(&mut kept.said, text),
        (Some(kept), true) => keep(&mut kept.complained, text),
        (None, false) => _ = writeln!(std::io::stdout(), "{text}"),
        (None, true) => _ = writeln!(std::io::stderr(), "{text}"),
    });
}

fn keep(into: &mut String, text: Arguments<'_>) {
    use std::fmt::Write as _;
    // Writing to a String cannot fail.
    let _ = writeln!(into, "{text}");
}

/// Prints a line for the user. A closed pipe (`| head`) or a full disk is no reason to panic.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => { $crate::say::line(false, format_args!($($text)*)) };
}

/// The same on standard error.
#[macro_export]
macro_rules! complain {
    ($($text:tt)*) => { $crate::say::line(true, format_args!($($text)*)) };
}

#[cfg(test)]
mod tests {
    use super::{Kept, kept};

    // Guards what one is told to type: a blank in a path would make two words of it.
    #[test]
    fn a_path_is_one_word() {
        for (path, word) in [
            ("runs/a-1", "runs/a-1"),
            ("my runs/a", "'my runs/a'"),
            ("it's", "\"it's\""),
        ] {
            assert_eq!(super::quoted(path.as_ref()), word);
        }
    }

    // Guards who hears a line: a command within another program must not write to its output, nor a kept one into an outer one's.
    #[test]
    fn what_a_work_says_is_kept_for_whoever_began_it() {
        let (inner, outer) = kept(|| {
            say!("outer {}", 1);
            let ((), inner) = kept(|| {
                say!("inner");
                complain!("wrong");
            });
            inner
        });
        assert_eq!(
            inner,
            Kept {
                said: "inner\n".into(),
                complained: "wrong\n".into()
            }
        );
        assert_eq!(outer.said, "outer 1\n");
        assert_eq!(outer.complained, "");
    }
}
