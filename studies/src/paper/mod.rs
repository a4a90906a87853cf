//! The paper's examples, computed: what each figure shows, what the paper says of it, what comes out, and what the printed
//! errata cost.
//!
//! Every figure is a function without arguments that gives the same bits each time.

mod figure;
mod figure_2;
mod figure_4;
mod figure_5;
mod figure_6;
mod figure_7;

mod printed;
mod publish;

pub use figure::{Figure, Finding, table};
pub use publish::publish;

use anhyst_identify::parallel;
use anhyst_launch::error::RunError;

/// All figures, in the paper's order; `progress` is told each one that is done.
///
/// # Errors
/// None that the fixed constants can cause; they pass through the same checks as a user's.
pub fn figures(progress: impl Fn() + Sync) -> Result<Vec<Figure>, RunError> {
    type Make = fn() -> Result<Figure, RunError>;
    let makes: [Make; 5] = [
        figure_2::figure,
        figure_4::figure,
        figure_5::figure,
        figure_6::figure,
        figure_7::figure,
    ];
    let made = parallel::map(parallel::available(), &makes, |make| {
        let figure = make();
        progress();
        figure
    });
    made.into_iter().collect()
}
