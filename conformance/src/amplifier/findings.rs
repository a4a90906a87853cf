//! What was found: checks with value and limit, and what could not be judged.

use serde::Serialize;

/// Which side of the limit is good.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Bound {
    /// Good up to the limit.
    AtMost,
    /// Good from the limit on.
    AtLeast,
}

/// One check.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Check {
    /// Its name.
    pub name: &'static str,
    /// Whether it holds.
    pub passed: bool,
    /// What was found; null in JSON if it is no number.
    pub value: f64,
    /// What is allowed.
    pub limit: f64,
    /// Which side of it.
    pub bound: Bound,
    /// Unit of both.
    pub unit: &'static str,
    /// What it says.
    pub sentence: String,
}

/// A check that was not made.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct NotJudged {
    /// Its name.
    pub name: &'static str,
    /// Why not.
    pub sentence: String,
}

/// All of them.
#[derive(Debug, Clone, PartialEq, Default, Serialize)]
pub struct Findings {
    /// What was judged.
    pub checks: Vec<Check>,
    /// What was not.
    pub not_judged: Vec<NotJudged>,
}

impl Findings {
    /// Notes a check that holds up to its limit. What is no number never holds.
    pub fn at_most(&mut self, name: &'static str, value: f64, limit: f64, unit: &'static str, sentence: String) {
        self.note(name, value <= limit, (value, limit, Bound::AtMost, unit), sentence);
    }

    /// Notes a check that holds from its limit on.
    pub fn at_least(&mut self, name: &'static str, value: f64, limit: f64, unit: &'static str, sentence: String) {
        self.note(name, value >= limit, (value, limit, Bound::AtLeast, unit), sentence);
    }

    fn note(
        &mut self,
        name: &'static str,
        passed: bool,
        (value, limit, bound, unit): (f64, f64, Bound, &'static str),
        sentence: String,
    ) {
        self.checks.push(Check {
            name,
            passed,
            value,
            limit,
            bound,
            unit,
            sentence,
        });
    }

    /// Notes checks that are not made.
    pub fn skip(&mut self, names: &[&'static str], sentence: &str) {
        self.not_judged.extend(names.iter().copied().map(|name| NotJudged {
            name,
            sentence: sentence.to_owned(),
        }));
    }

    /// True if a check of that name was made and does not hold.
    pub fn fails(&self, name: &str) -> bool {
        self.checks.iter().any(|check| check.name == name && !check.passed)
    }

    /// True if something was judged and all of it holds.
    pub fn passed(&self) -> bool {
        !self.checks.is_empty() && self.checks.iter().all(|check| check.passed)
    }
}
