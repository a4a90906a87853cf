use anhyst_ipc::Invalid;
use anhyst_model::ModelError;

/// Why an estimator could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum EstimatorError {
    /// A setting cannot be used.
    #[error(transparent)]
    Setting(#[from] Invalid),
    /// The material, the rod or the amplifier cannot be used.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A modal system without modes.
    #[error("a modal system needs at least 1 mode, but 0 were given")]
    NoModes,
    /// A mode has a number in it that is none.
    #[error("mode {index} has an eigenvalue or an input that is not finite; both must be finite numbers")]
    ModeNotFinite { index: usize },
    /// A mode does not decay.
    #[error(
        "mode {index} has the eigenvalue {real_per_s} 1/s + {imaginary_per_s} i/s, but its real part must be below \
         0 1/s: \
         a mode that does not decay carries every error for ever"
    )]
    UnstableMode {
        index: usize,
        real_per_s: f64,
        imaginary_per_s: f64,
    },
    /// Two modes share their eigenvalue.
    #[error(
        "modes {first} and {second} share the eigenvalue {real_per_s} 1/s + {imaginary_per_s} i/s, but eigenvalues \
         must be \
         distinct: add the inputs of equal modes; a matrix that is not diagonalisable has no modes"
    )]
    EqualModes {
        first: usize,
        second: usize,
        real_per_s: f64,
        imaginary_per_s: f64,
    },
    /// A complex mode stands alone.
    #[error(
        "mode {index} with the eigenvalue {real_per_s} 1/s + {imaginary_per_s} i/s has no conjugate partner with a \
         conjugate \
         input, but a real system has its complex modes in conjugate pairs and real inputs to its real modes"
    )]
    UnpairedMode {
        index: usize,
        real_per_s: f64,
        imaginary_per_s: f64,
    },
    /// b = Σ B is zero.
    #[error(
        "the modes' inputs add up to {sum:e}, which is nothing beside the sum of their magnitudes {magnitudes:e}: the \
         input must act on the output's rate, as in an output y' + mu y of a rod; on the displacement of a two-pole \
         rod it does not, and nothing would adapt"
    )]
    InputsCancel { sum: f64, magnitudes: f64 },
    /// The sampled output is not positive real.
    #[error(
        "at {frequency_hz:.1} Hz the transfer function from the input to the output has the real part {real_part:e} \
         (it is {at_rest:e} at 0 Hz), but it must be above 0 at every frequency (strictly positive real): only then \
         can the output's error say which way to correct"
    )]
    NotPositiveReal {
        frequency_hz: f64,
        real_part: f64,
        at_rest: f64,
    },
}
