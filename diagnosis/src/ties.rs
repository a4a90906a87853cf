//! Which other explanations do these data allow?
//!
//! A rival ties with the winner if its BIC is at most 6 higher, or if both predict the same: Σ (z_winner − z_rival)² of at most 6 over
//! the training rows, which is what chance moves χ² by. Where the winner leaves something that is immaterial but seen, that
//! much is added to both limits: it could as well be the rival's.

use anhyst_identify::engine::dot;

use crate::select::Tested;
use crate::workbench::{Fitted, Workbench};

/// ΔBIC within which evidence does not decide.
pub(crate) const UNDECIDED: f64 = 6.0;
/// Most explanations that are still an answer.
pub(crate) const MOST_NAMED: usize = 3;

/// Fits that tie with the winner, best first, without it.
pub(crate) fn ties<'a>(bench: &Workbench, winner: &Tested, rivals: &'a [Fitted]) -> Vec<&'a Fitted> {
    let training = &bench.observation.training;
    let strongest = winner.test.groups.first().filter(|_| winner.test.alarmed());
    let slack = strongest.map_or(0.0, |group| (group.statistic - group.degrees as f64).max(0.0));
    let own = &winner.fit;
    let tied = |rival: &&Fitted| {
        if rival.terms() == own.terms() {
            return false;
        }
        let difference: Vec<f64> = own
            .solution
            .residual
            .iter()
            .zip(&rival.solution.residual)
            .map(|(one, other)| one - other)
            .collect();
        rival.bic - own.bic <= UNDECIDED + slack || dot(training, &difference, &difference) <= UNDECIDED
    };
    let mut found: Vec<&Fitted> = rivals.iter().filter(tied).collect();
    found.sort_by(|one, other| one.bic.total_cmp(&other.bic));
    found
}
