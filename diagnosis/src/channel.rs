//! What is compared with a model: one measured series of one run, and its place among the stacked spectra.

use std::ops::Range;

use crate::spectrum::Spectrum;

/// One series of one run that is compared with the model.
#[derive(Clone)]
pub(crate) struct Channel {
    pub run: usize,
    pub kind: ChannelKind,
    /// Rows of the run that are compared: those after the settling.
    pub rows: Range<usize>,
    /// Their place among the stacked spectra; its first number is the mean.
    pub places: Range<usize>,
    pub spectrum: Spectrum,
    /// What the measurement itself says of its noise, in the channel's unit.
    pub noise_rms: f64,
    /// Step of its digits; 0: none.
    pub resolution: f64,
}

/// What a channel holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum ChannelKind {
    /// Coil field: separates the amplifier from the rest.
    Field,
    /// Displacement, strain, or magnetization where nothing else was measured.
    Output,
    /// Magnetization beside another output.
    Magnetization,
}
