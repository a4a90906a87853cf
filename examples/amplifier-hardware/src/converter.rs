//! What a driver needs of a board: one voltage out, one in.

use std::path::PathBuf;

/// A DAC to the amplifier's command input and an ADC from its current monitor.
pub trait Converter {
    /// Puts out a voltage, as near as the converter can.
    ///
    /// # Errors
    /// If the board refuses. The output must then be thought of as unknown.
    fn write_volts(&mut self, volts: f64) -> Result<(), ConverterError>;

    /// Reads a voltage.
    ///
    /// # Errors
    /// If the board refuses.
    fn read_volts(&mut self) -> Result<f64, ConverterError>;
}

impl Converter for Box<dyn Converter> {
    fn write_volts(&mut self, volts: f64) -> Result<(), ConverterError> {
        (**self).write_volts(volts)
    }

    fn read_volts(&mut self) -> Result<f64, ConverterError> {
        (**self).read_volts()
    }
}

/// Why a converter did not do what it should.
#[derive(Debug, thiserror::Error)]
pub enum ConverterError {
    /// A file of the device cannot be read or written.
    #[error("{path} cannot be used: {cause}", path = path.display())]
    File {
        /// Which.
        path: PathBuf,
        /// What the system says.
        cause: std::io::Error,
    },
    /// A file of the device holds no number.
    #[error("{path} holds no number", path = path.display())]
    NotANumber {
        /// Which.
        path: PathBuf,
    },
    /// A scale of zero, or one that is not finite.
    #[error("{path} holds a scale of {scale} mV, which is no scale", path = path.display())]
    Scale {
        /// Which.
        path: PathBuf,
        /// What it holds.
        scale: f64,
    },
    /// A description of samples that is none.
    #[error("{path} says samples are \"{text}\"; one like le:s12/16>>4 is needed", path = path.display())]
    Format {
        /// Which.
        path: PathBuf,
        /// What it holds.
        text: String,
    },
    /// A buffer gives no samples.
    #[error("{path} has given no sample for {ticks} ticks: is its trigger running?", path = path.display())]
    Stale {
        /// Which.
        path: PathBuf,
        /// For so long.
        ticks: u32,
    },
    /// A line of terminals that does not answer as it should.
    #[cfg(feature = "ethercat")]
    #[error("{line} {sentence}")]
    Line {
        /// Which.
        line: String,
        /// What it does.
        sentence: String,
    },
    /// A buffer gives parts of samples.
    #[error("{path} has given {bytes} bytes, which are no whole samples of {width}", path = path.display())]
    Torn {
        /// Which.
        path: PathBuf,
        /// So many.
        bytes: usize,
        /// Of one.
        width: usize,
    },
}
