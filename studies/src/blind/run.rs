//! One run of the study: what was hidden under what, and what was said.

use anhyst_diagnosis::{Diagnosed, Verdict};
use anhyst_witness::Made;
use serde::{Deserialize, Serialize};

use super::case::{Case, Family};
use super::outcome::{Interval, Outcome, Told};
use super::places::{Places, contributions, places};

/// One hidden effect.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Hidden {
    pub effect: String,
    /// Rms of what it adds to the displacement, over the noise.
    pub gap_over_noise: f64,
    /// Of the gap's energy: ⟨c, g⟩/⟨g, g⟩ without the means, c what it adds, g measured minus nominal; none without a diagnosis.
    pub share: Option<f64>,
    /// Share that the diagnosis gave it, where it is named.
    pub share_found: Option<f64>,
}

/// What the diagnosis said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Said {
    pub verdict: Verdict,
    /// Effects, without those of `beside`.
    pub named: Vec<String>,
    /// Effects that are true of the nuisance.
    pub beside: Vec<String>,
    pub ambiguous_with: Vec<String>,
    pub confidence: f64,
    pub explained: f64,
    /// Rms of what is left over the noise that was made.
    pub left_over_noise: f64,
    pub intervals: Vec<Interval>,
    pub places: Vec<Places>,
    /// Of the diagnosis alone, by the wall clock.
    pub seconds: f64,
}

/// One run of the study: what was hidden under what, and what was said.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyRun {
    pub nuisance: String,
    pub family: Family,
    pub index: u64,
    pub seed: u64,
    pub rows: usize,
    /// What drives it, as the rig calls it.
    pub drive: String,
    pub hidden: Vec<Hidden>,
    /// What the nuisance alone makes of the gap, over the noise.
    pub nuisance_over_noise: f64,
    pub outcome: Outcome,
    pub said: Option<Said>,
    /// Why there is no diagnosis.
    pub error: Option<String>,
}

impl StudyRun {
    /// A run that came to nothing.
    pub fn failed(case: &Case, error: String) -> Self {
        let hidden = case.wanted.effects.iter().map(|effect| Hidden {
            effect: effect.name().to_owned(),
            gap_over_noise: case.wanted.gap_over_noise.unwrap_or_default(),
            share: None,
            share_found: None,
        });
        StudyRun {
            nuisance: case.nuisance.name().to_owned(),
            family: case.family,
            index: case.index,
            seed: case.seed,
            rows: case.wanted.rows,
            drive: String::new(),
            hidden: hidden.collect(),
            nuisance_over_noise: 0.0,
            outcome: Outcome::Failed,
            said: None,
            error: Some(error),
        }
    }

    /// A run that was made, and what came of it.
    pub(super) fn made(case: &Case, made: &Made, found: Result<(Diagnosed, f64), String>) -> Self {
        let truth = &made.truth;
        let own = StudyRun {
            drive: truth.drive.name().to_owned(),
            hidden: truth
                .parts
                .iter()
                .map(|part| Hidden {
                    effect: part.effect.name().to_owned(),
                    gap_over_noise: part.gap_m / truth.noise_m,
                    share: None,
                    share_found: None,
                })
                .collect(),
            nuisance_over_noise: truth.gap_of_the_nuisance_m / truth.noise_m,
            ..StudyRun::failed(case, String::new())
        };
        let (diagnosed, seconds) = match found {
            Ok(found) => found,
            Err(error) => {
                return StudyRun {
                    error: Some(error),
                    ..own
                };
            }
        };
        let found = &diagnosed.diagnosis;
        let names = found.effects.iter().map(|effect| effect.name.clone());
        let told = Told::of(case, found.verdict, names.collect(), &found.ambiguous_with);
        let share_found = |name: &str| {
            let own = found.effects.iter().find(|effect| effect.name == name);
            own.map(|effect| effect.share)
        };
        StudyRun {
            hidden: own
                .hidden
                .into_iter()
                .zip(contributions(made, &diagnosed))
                .map(|(part, contribution)| Hidden {
                    share: share(&contribution, &diagnosed),
                    share_found: share_found(&part.effect),
                    ..part
                })
                .collect(),
            outcome: told.outcome,
            error: None,
            said: Some(Said {
                verdict: found.verdict,
                named: told.named,
                beside: told.beside,
                ambiguous_with: found.ambiguous_with.clone(),
                confidence: found.confidence,
                explained: found.explained,
                left_over_noise: found.remainder_rms / truth.noise_m,
                intervals: told.outcome.intervals(case, truth, found),
                places: places(made, &diagnosed),
                seconds,
            }),
            ..own
        }
    }

    /// What was hidden, as one name; "none" for nothing.
    pub fn truth(&self) -> String {
        let names: Vec<&str> = self.hidden.iter().map(|part| part.effect.as_str()).collect();
        if names.is_empty() {
            "none".to_owned()
        } else {
            names.join(" + ")
        }
    }

    /// The smallest gap of what was hidden, over the noise; 0 for nothing.
    pub fn gap_over_noise(&self) -> f64 {
        let gaps = self.hidden.iter().map(|part| part.gap_over_noise);
        let least = gaps.fold(f64::INFINITY, f64::min);
        if least.is_finite() { least } else { 0.0 }
    }

    /// Whether this is what became of a case.
    pub fn is_of(&self, case: &Case) -> bool {
        (self.seed, self.rows, self.index) == (case.seed, case.wanted.rows, case.index)
            && (self.nuisance.as_str(), self.family) == (case.nuisance.name(), case.family)
    }

    /// The answer in a line.
    pub fn answer(&self) -> String {
        let Some(said) = &self.said else {
            return self.error.clone().unwrap_or_default();
        };
        let mut names = vec![said.named.join(" + ")];
        names.extend(said.ambiguous_with.iter().cloned());
        names.retain(|name| !name.is_empty());
        let beside = if said.beside.is_empty() {
            String::new()
        } else {
            format!(" beside {}", said.beside.join(", "))
        };
        format!("{} {}{beside}", said.verdict.name(), names.join(" or "))
    }
}

fn share(contribution: &[f64], found: &Diagnosed) -> Option<f64> {
    let run = found.runs.first()?;
    let (mut along, mut energy) = (0.0, 0.0);
    // Both on the instrument's zero: the difference has no mean.
    for ((measured, nominal), own) in run.measured.iter().zip(&run.before).zip(contribution) {
        let gap = measured - nominal;
        along += own * gap;
        energy += gap * gap;
    }
    Some(along / energy)
}
