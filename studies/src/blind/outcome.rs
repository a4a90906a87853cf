//! A diagnosis against the truth, fair to ties: a flagged tie that holds the truth is right.
//!
//! What is true of the nuisance may stand beside it: another value of a constant where constants are off, a drift where the zero
//! drifts, a disturbance of one frequency where a line is that is no mains.

use anhyst_diagnosis::{Diagnosis, Verdict};
use anhyst_witness::{Nuisance, Truth};
use serde::{Deserialize, Serialize};

use super::case::{Case, Family};

/// Of a normal number, 95 % lie within this many deviations.
const TWO_SIDED_95: f64 = 1.959_963_985;

/// How a verdict compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The true names alone; no name where nothing was hidden; "unknown" where the library lacks what was.
    Right,
    /// A flagged tie that holds the truth.
    TieWithTruth,
    /// One of two.
    InPart,
    /// A flagged tie that does not hold the truth.
    TieWithoutTruth,
    /// A wrong name, unflagged.
    WrongName,
    /// Something hidden was not seen.
    NotSeen,
    /// "Unknown", and it was in the library or nothing.
    Unknown,
    /// No diagnosis.
    Failed,
}

impl Outcome {
    pub const ALL: [Outcome; 8] = [
        Outcome::Right,
        Outcome::TieWithTruth,
        Outcome::InPart,
        Outcome::TieWithoutTruth,
        Outcome::WrongName,
        Outcome::NotSeen,
        Outcome::Unknown,
        Outcome::Failed,
    ];

    /// As a column's heading.
    pub fn heading(self) -> &'static str {
        match self {
            Outcome::Right => "right",
            Outcome::TieWithTruth => "tie with truth",
            Outcome::InPart => "one of two",
            Outcome::TieWithoutTruth => "tie without truth",
            Outcome::WrongName => "wrong, unflagged",
            Outcome::NotSeen => "none",
            Outcome::Unknown => "unknown",
            Outcome::Failed => "failed",
        }
    }

    pub fn is_right(self) -> bool {
        matches!(self, Outcome::Right | Outcome::TieWithTruth)
    }

    /// Every fitted value with a deviation whose truth is known; none unless this is right, or where the effect obeys another law.
    pub(super) fn intervals(self, case: &Case, truth: &Truth, found: &Diagnosis) -> Vec<Interval> {
        if !self.is_right() || case.nuisance == Nuisance::OtherLaw {
            return Vec::new();
        }
        let mut intervals = Vec::new();
        for part in &truth.parts {
            let effect = found.effects.iter().find(|effect| effect.name == part.effect.name());
            for fitted in effect.iter().flat_map(|effect| &effect.values) {
                let known = part.values.iter().find(|known| known.name == fitted.name);
                if let (Some(known), Some(standard_deviation)) = (known, fitted.standard_deviation) {
                    intervals.push(Interval {
                        effect: part.effect.name().to_owned(),
                        name: fitted.name.clone(),
                        truth: known.value,
                        value: fitted.value,
                        standard_deviation,
                    });
                }
            }
        }
        intervals
    }
}

/// A fitted value beside the true one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Interval {
    pub effect: String,
    pub name: String,
    pub truth: f64,
    pub value: f64,
    pub standard_deviation: f64,
}

impl Interval {
    /// Whether the 95 % interval holds the truth.
    pub fn covers(&self) -> bool {
        (self.value - self.truth).abs() <= TWO_SIDED_95 * self.standard_deviation
    }
}

/// What is named, judged.
pub(super) struct Told {
    pub named: Vec<String>,
    pub beside: Vec<String>,
    pub outcome: Outcome,
}

impl Told {
    /// Of an answer: its word, the effects it names, and the explanations tied with them.
    pub fn of(case: &Case, verdict: Verdict, names: Vec<String>, ties: &[String]) -> Self {
        let mut truth: Vec<&str> = case.wanted.effects.iter().map(|effect| effect.name()).collect();
        truth.sort_unstable();
        let may_stand = |name: &str| is_of(case.nuisance, name) && !truth.contains(&name);
        // What shrinks the gap and is not believed names nothing.
        let names = names.into_iter().filter(|_| verdict != Verdict::Unknown);
        let (beside, named): (Vec<String>, Vec<String>) = names.partition(|name| may_stand(name));
        let is_truth = |names: &mut dyn Iterator<Item = &str>| {
            let mut names: Vec<&str> = names.filter(|name| !may_stand(name)).collect();
            names.sort_unstable();
            names == truth
        };
        let named_truth = is_truth(&mut named.iter().map(String::as_str));
        let tied_truth = ties.iter().any(|tie| is_truth(&mut tie.split(" + ")));
        let flagged = !ties.is_empty();
        let outcome = if named.is_empty() {
            match (verdict, case.family) {
                (Verdict::Unknown, Family::Unlisted) => Outcome::Right,
                (Verdict::Unknown, _) => Outcome::Unknown,
                (_, Family::None) => Outcome::Right,
                _ => Outcome::NotSeen,
            }
        } else if named_truth && !flagged {
            Outcome::Right
        } else if named_truth || tied_truth {
            Outcome::TieWithTruth
        } else if named.iter().all(|name| truth.contains(&name.as_str())) {
            Outcome::InPart
        } else if flagged {
            Outcome::TieWithoutTruth
        } else {
            Outcome::WrongName
        };
        Told { named, beside, outcome }
    }
}

/// Whether an effect by that name is what the nuisance is.
fn is_of(nuisance: Nuisance, name: &str) -> bool {
    let all = nuisance == Nuisance::All;
    match name {
        "sensor_drift" => all || nuisance == Nuisance::Drift,
        "periodic_disturbance" => all || nuisance == Nuisance::Line,
        _ => name.starts_with("parameter_") && (all || nuisance == Nuisance::OffNominal),
    }
}

#[cfg(test)]
mod tests {
    use super::super::case::Plan;
    use super::super::subject::Subject;
    use super::*;
    use anhyst_model::ActuatorModel;
    use anhyst_witness::Effect::{self, EddyCurrent, Friction, XDrag};

    fn outcome(nuisance: Nuisance, hidden: &[Effect], verdict: Verdict, names: &[&str], ties: &[&str]) -> Outcome {
        let plan = Plan {
            none: 1,
            singles: 1,
            pairs: 1,
            unlisted: 1,
            limits: 0,
            first_seed: 0,
            rows: 1000,
        };
        let family = match hidden {
            [] => Family::None,
            [XDrag] => Family::Unlisted,
            [_] => Family::Single,
            _ => Family::Pair,
        };
        let mut cases = plan
            .cases(&Subject::of(ActuatorModel::terfenol_d()).unwrap())
            .into_iter();
        let mut case = cases
            .find(|case| case.family == family && case.nuisance == nuisance)
            .unwrap();
        case.wanted.effects = hidden.to_vec();
        let owned = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
        Told::of(&case, verdict, owned(names), &owned(ties)).outcome
    }

    /// Guards every figure of the study: which answer counts as what.
    #[test]
    fn answers_are_judged_as_documented() {
        use Nuisance::{Clean, OffNominal};
        use Verdict::{Ambiguous, Named, None, Unknown};
        let one = |verdict, names: &[&str], ties: &[&str]| outcome(Clean, &[EddyCurrent], verdict, names, ties);
        assert_eq!(one(Named, &["eddy_current"], &[]), Outcome::Right);
        assert_eq!(one(Ambiguous, &["friction"], &["eddy_current"]), Outcome::TieWithTruth);
        assert_eq!(one(Ambiguous, &["friction"], &["backlash"]), Outcome::TieWithoutTruth);
        assert_eq!(one(Named, &["eddy_current", "friction"], &[]), Outcome::WrongName);
        assert_eq!(one(Named, &["eddy_current", "parameter_k"], &[]), Outcome::WrongName);
        assert_eq!(one(None, &[], &[]), Outcome::NotSeen);
        assert_eq!(one(Unknown, &[], &[]), Outcome::Unknown);
        assert_eq!(one(Unknown, &["eddy_current"], &["friction"]), Outcome::Unknown);
        let calibrated = outcome(OffNominal, &[EddyCurrent], Named, &["parameter_k", "eddy_current"], &[]);
        assert_eq!(calibrated, Outcome::Right);
        let pair = |names: &[&str]| outcome(Clean, &[EddyCurrent, Friction], Named, names, &[]);
        assert_eq!(pair(&["friction", "eddy_current"]), Outcome::Right);
        assert_eq!(pair(&["friction"]), Outcome::InPart);
        assert_eq!(pair(&["friction", "backlash"]), Outcome::WrongName);
        assert_eq!(outcome(Clean, &[XDrag], Unknown, &[], &[]), Outcome::Right);
        assert_eq!(outcome(Clean, &[XDrag], Unknown, &["friction"], &[]), Outcome::Right);
        assert_eq!(outcome(Clean, &[XDrag], Named, &["friction"], &[]), Outcome::WrongName);
        assert_eq!(outcome(Clean, &[], None, &[], &[]), Outcome::Right);
        assert_eq!(outcome(Clean, &[], Unknown, &[], &[]), Outcome::Unknown);
        assert_eq!(outcome(Clean, &[], Named, &["parameter_k"], &[]), Outcome::WrongName);
        assert_eq!(outcome(OffNominal, &[], Named, &["parameter_k"], &[]), Outcome::Right);
    }
}
