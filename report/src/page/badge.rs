//! Verdicts.

/// A verdict in a word or a few.
#[derive(Clone, Debug, PartialEq)]
pub struct Badge {
    pub verdict: Verdict,
    pub text: String,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    Pass,
    Fail,
    /// Neither: something to know.
    Note,
}

impl Badge {
    pub fn new(verdict: Verdict, text: &str) -> Self {
        Badge {
            verdict,
            text: text.to_owned(),
        }
    }

    /// Pass or fail by a condition.
    pub fn of(held: bool, text: &str) -> Self {
        Badge::new(if held { Verdict::Pass } else { Verdict::Fail }, text)
    }
}
