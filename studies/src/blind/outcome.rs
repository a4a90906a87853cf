//! A diagnosis against the truth, fair to ties: a flagged tie that holds the truth is right.

use serde::{Deserialize, Serialize};

use super::case::{Case, Family};
use super::make::{TrueValue, Truth};
use anhyst_diagnosis::{Diagnosis, Verdict};

/// Of a normal number, 95 % lie within this many deviations.
const TWO_SIDED_95: f64 = 1.959_963_985;

/// How a verdict compares with the truth.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The true names alone; "none" where nothing was hidden; "unknown" where the library lacks what was.
    Right,
    /// A flagged tie that holds the truth.
    TieWithTruth,
    /// A flagged tie that does not.
    TieWithoutTruth,
    /// Another name, unflagged.
    WrongName,
    /// Something hidden was not seen.
    NotSeen,
    /// "Unknown", and it was in the library or nothing.
    Unknown,
    /// No diagnosis.
    Failed,
}

impl Outcome {
    pub const ALL: [Outcome; 7] = [
        Outcome::Right,
        Outcome::TieWithTruth,
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

/// Names of one explanation, in an order of their own.
fn sorted<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut names: Vec<&str> = names.collect();
    names.sort_unstable();
    names
}

pub(super) fn named(found: &Diagnosis) -> Vec<String> {
    found.effects.iter().map(|effect| effect.name.clone()).collect()
}

pub(super) fn outcome(case: &Case, found: &Diagnosis) -> Outcome {
    let seen_nothing = matches!(found.verdict, Verdict::None | Verdict::NotExcited);
    let names = named(found);
    let truth = case.truth();
    let truth = sorted(truth.iter().map(String::as_str));
    let of_tie = |tie: &String| sorted(tie.split(" + ")) == truth;
    let named_true = sorted(names.iter().map(String::as_str)) == truth;
    let flagged = !found.ambiguous_with.is_empty() || found.verdict == Verdict::Ambiguous;
    match case.family {
        Family::None if seen_nothing => Outcome::Right,
        _ if seen_nothing => Outcome::NotSeen,
        // A model that was not fitted has names only beside another verdict.
        Family::Unlisted if found.verdict == Verdict::Unknown => Outcome::Right,
        _ if found.verdict == Verdict::Unknown => Outcome::Unknown,
        _ if named_true && !flagged => Outcome::Right,
        _ if named_true || found.ambiguous_with.iter().any(of_tie) => Outcome::TieWithTruth,
        _ if flagged => Outcome::TieWithoutTruth,
        _ => Outcome::WrongName,
    }
}

/// Every fitted value with a deviation whose truth is known; none unless the diagnosis's own choice is the truth.
pub(super) fn intervals(truth: &Truth, found: &Diagnosis) -> Vec<Interval> {
    let names = named(found);
    if sorted(names.iter().map(String::as_str)) != sorted(truth.names.iter().map(String::as_str)) {
        return Vec::new();
    }
    let mut intervals = Vec::new();
    for effect in &found.effects {
        let same =
            |own: &&TrueValue, name: &str| own.effect == effect.name && (own.name == name || own.name == own.effect);
        for fitted in &effect.values {
            let known = truth.values.iter().find(|own| same(own, &fitted.name));
            if let (Some(known), Some(standard_deviation)) = (known, fitted.standard_deviation) {
                intervals.push(Interval {
                    effect: effect.name.clone(),
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
