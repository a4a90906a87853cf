//! From commands and answers to findings. What follows from an earlier fault is not judged a second time: an answer that
//! does not move has no gain, and a gain in the wrong unit is not also called inexact.

mod constant;
mod dynamics;
mod evidence;
mod faults;
mod limits;
mod timing;

pub use dynamics::{Response, StepResponse};
pub use evidence::Evidence;

use super::findings::Findings;

/// What the pictures need beside the evidence.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Curves {
    /// Mean of the small steps.
    pub step: Option<StepResponse>,
    /// Frequency response of the process and of the model.
    pub response: Vec<Response>,
}

/// Judges what a rig can be asked for.
pub fn judge_gentle(evidence: &Evidence) -> (Findings, Curves) {
    let mut findings = Findings::default();
    let mut curves = Curves::default();
    faults::finite(evidence, &mut findings);
    constant::follows(evidence, &mut findings);
    let levels = constant::judge(evidence, &mut findings);
    constant::reach(evidence, levels, &mut findings);
    curves.step = dynamics::step(evidence, levels, &mut findings);
    curves.response = dynamics::bandwidth(evidence, &mut findings);
    (findings, curves)
}

/// Judges everything that can be judged.
pub fn judge(evidence: &Evidence) -> (Findings, Curves) {
    let mut findings = Findings::default();
    let mut curves = Curves::default();
    timing::judge(evidence, &mut findings);
    faults::finite(evidence, &mut findings);
    faults::stuck(evidence, &mut findings);
    let levels = constant::judge(evidence, &mut findings);
    curves.step = dynamics::step(evidence, levels, &mut findings);
    curves.response = dynamics::bandwidth(evidence, &mut findings);
    limits::judge(evidence, levels, &mut findings);
    faults::recovery(evidence, levels, &mut findings);
    faults::dead_controller(evidence, &mut findings);
    (findings, curves)
}
