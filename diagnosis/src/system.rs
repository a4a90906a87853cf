//! What the engine needs of a simulator: outputs of all channels under a set of terms, and the signals that ran inside.

use crate::term::Term;

/// A term with its fitted values.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Setting {
    pub term: Term,
    pub values: Vec<f64>,
}

/// One series of one run that is compared with the model.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Channel {
    pub run: usize,
    pub kind: ChannelKind,
    /// In the stacked vector.
    pub rows: std::ops::Range<usize>,
    /// Noise, in the channel's unit.
    pub noise_rms: f64,
    /// Correlation of the noise of neighbouring samples.
    pub autoregression: f64,
    /// The instrument's zero is its own: fitted.
    pub free_zero: bool,
    /// First rows that are simulated and not compared.
    pub settling_rows: usize,
}

/// What a channel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChannelKind {
    /// Coil field: separates the amplifier from the rest.
    Field,
    /// Displacement or strain, for which the model exists.
    Output,
    /// Magnetization where it was measured.
    Magnetization,
}

/// What went on inside a run, by sample.
#[derive(Clone, Debug, Default)]
pub(crate) struct Signals {
    /// What drives the model, A/m.
    pub drive: Vec<f64>,
    pub field: Vec<f64>,
    pub magnetization: Vec<f64>,
    pub output: Vec<f64>,
    /// None for a sweep without time.
    pub tick_s: Option<f64>,
    pub temperature: Option<Vec<f64>>,
}

/// Anything that can be simulated freely under any set of terms.
pub(crate) trait System: Sync {
    /// All channels one behind the other; None where the model refuses the values.
    fn outputs(&self, settings: &[Setting]) -> Option<Vec<f64>>;

    /// By run.
    fn signals(&self, settings: &[Setting]) -> Option<Vec<Signals>>;
}
