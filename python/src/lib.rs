//! `anhyst._native`: the command line and the parts of the loop for Python. What is convenient there is written in Python, in
//! `anhyst/`; here is what has to be fast, and what calls commands.
//!
//! Arrays are one-dimensional float64 unless said otherwise. What is given is read in place where it is contiguous; what is returned
//! is owned by the array that is returned. While this crate works, other threads of Python run.

mod actuator;
mod arrays;
mod bank;
mod command;
mod curve;
mod estimation;
mod fit;
mod interrupt;
mod law;
mod material;
mod refusal;
mod rod;
mod scenario;
mod stepped;
mod tokens;

use pyo3::prelude::*;

#[pymodule]
mod _native {
    #[pymodule_export]
    use super::actuator::Actuator;
    #[pymodule_export]
    use super::bank::Bank;
    #[pymodule_export]
    use super::command::{command, main, new_folder, tell_command};
    #[pymodule_export]
    use super::curve::Anhysteretic;
    #[pymodule_export]
    use super::estimation::Estimator;
    #[pymodule_export]
    use super::fit::{fit_law, law_names, predict_law};
    #[pymodule_export]
    use super::law::{Law, LawState};
    #[pymodule_export]
    use super::material::Material;
    #[pymodule_export]
    use super::refusal::{BadInput, ProcessFailed};
    #[pymodule_export]
    use super::rod::Rod;
    #[pymodule_export]
    use super::scenario::Scenario;
    #[pymodule_export]
    use super::stepped::{Controller, Loop, Plant};
    #[pymodule_export]
    use super::tokens::{fields, read_tokens};

    use super::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))
    }
}
