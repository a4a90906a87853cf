//! What a reader mends of a clock, in words.

/// What had to be done to a run's time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ClockRepair {
    /// Samples that were filled in.
    pub filled: Vec<usize>,
    pub gaps: usize,
    /// Farthest that a stamp stood off the uniform clock, s; 0: none was off by more than its digits.
    pub jitter_s: f64,
    /// The series are smooth as they stand, so the stamps jitter and not the sampling: the values were left as they are.
    pub restamped: bool,
}

impl std::fmt::Display for ClockRepair {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.gaps > 0 {
            let (rows, gaps) = (self.filled.len(), self.gaps);
            let (s, such) = (if rows == 1 { "" } else { "s" }, if gaps == 1 { "" } else { "s" });
            write!(
                formatter,
                "{rows} missing row{s} in {gaps} gap{such} were filled by interpolation"
            )?;
        }
        if self.jitter_s > 0.0 {
            let and = if self.gaps > 0 { "; " } else { "" };
            let what = if self.restamped {
                "the series are smooth on a uniform clock, so its stamps were replaced"
            } else {
                "the series were interpolated to a uniform clock"
            };
            write!(formatter, "{and}time jitters by up to {:.2e} s: {what}", self.jitter_s)?;
        }
        Ok(())
    }
}
