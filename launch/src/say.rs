//! Lines for the user, and words of commands that the user is told to type.

/// A path as the shell takes it for one word.
pub fn quoted(path: &std::path::Path) -> String {
    let text = path.display().to_string();
    // What no shell can take (a NUL) no path can hold.
    shlex::try_quote(&text).map_or_else(|_| text.clone(), std::borrow::Cow::into_owned)
}

/// Prints a line for the user. A closed pipe (`| head`) or a full disk is no reason to panic.
#[macro_export]
macro_rules! say {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stdout(), $($text)*);
    }};
}

/// The same on standard error.
#[macro_export]
macro_rules! complain {
    ($($text:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($text)*);
    }};
}

#[cfg(test)]
mod tests {
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
}
