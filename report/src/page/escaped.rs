//! What a caller says, as it may stand on a page.

use std::fmt::{Display, Formatter};

/// Text that means itself.
pub(super) struct Plain<'a>(pub &'a str);

impl Display for Plain<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        for letter in self.0.chars() {
            match letter {
                '<' => formatter.write_str("&lt;")?,
                '>' => formatter.write_str("&gt;")?,
                '&' => formatter.write_str("&amp;")?,
                '"' => formatter.write_str("&quot;")?,
                // What no document may hold.
                control if control.is_control() && !matches!(control, '\n' | '\t') => formatter.write_str(" ")?,
                other => write!(formatter, "{other}")?,
            }
        }
        Ok(())
    }
}

/// Text in which words between backticks are code; a backtick without its fellow means itself.
pub(super) struct Prose<'a>(pub &'a str);

impl Display for Prose<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let parts: Vec<&str> = self.0.split('`').collect();
        let paired = parts.len() - usize::from(parts.len().is_multiple_of(2));
        for (index, part) in parts.iter().enumerate() {
            match (index % 2 == 1, index < paired) {
                (true, true) => write!(formatter, "<code>{}</code>", Plain(part))?,
                (_, true) => write!(formatter, "{}", Plain(part))?,
                (_, false) => write!(formatter, "`{}", Plain(part))?,
            }
        }
        Ok(())
    }
}
