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

/// What a check's failure follows from: where one of these has failed, it says nothing of its own.
const FOLLOWS_FROM: [(&str, &[&str]); 19] = [
    ("latency_median", &["rate"]),
    ("latency_p99", &["rate"]),
    ("latency_longest", &["rate"]),
    ("stuck", &["finite"]),
    ("sign", &["finite"]),
    ("unit", &["finite"]),
    ("gain", &["finite"]),
    ("offset", &["finite", "unit"]),
    ("noise", &["finite", "unit"]),
    ("delay", &["finite", "rate"]),
    ("overshoot", &["finite", "rate"]),
    ("bandwidth", &["finite", "rate"]),
    ("bandwidth_not_above", &["finite", "rate"]),
    ("limit", &["finite", "unit"]),
    ("limit_reported", &["finite", "unit", "limit"]),
    ("slew", &["finite", "unit"]),
    ("slew_reported", &["finite", "unit", "slew"]),
    ("nonsense_bounded", &["unit", "limit"]),
    ("recovery", &["finite"]),
];

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
    /// What would not hold if it were judged: of this machine rather than of the amplifier.
    pub warnings: Vec<Check>,
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

    /// Makes a warning of a check that does not hold.
    pub fn only_warn(&mut self, name: &str) {
        let failed = self.checks.extract_if(.., |check| check.name == name && !check.passed);
        self.warnings.extend(failed);
    }

    fn note(
        &mut self,
        name: &'static str,
        passed: bool,
        (value, limit, bound, unit): (f64, f64, Bound, &'static str),
        sentence: String,
    ) {
        let causes = FOLLOWS_FROM.iter().find(|(follower, _)| *follower == name);
        let cause = causes.and_then(|(_, causes)| causes.iter().find(|cause| self.fails(cause)));
        if let Some(cause) = cause.filter(|_| !passed) {
            self.skip(&[name], &format!("follows from `{cause}`: {sentence}"));
            return;
        }
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

    /// What did not hold, by name.
    pub fn failed(&self) -> Vec<&'static str> {
        let failed = self.checks.iter().filter(|check| !check.passed);
        failed.map(|check| check.name).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::Findings;

    /// Guards what one is told to mend: the cause, not what comes of it; and what holds in spite of a cause is still a check.
    #[test]
    fn a_failure_that_follows_from_another_is_not_a_second_one() {
        let mut findings = Findings::default();
        findings.at_most("limit", 2.0, 1.0, "A/m", "too much".into());
        findings.at_least("limit_reported", 0.0, 0.9, "1", "not said".into());
        findings.at_most("nonsense_bounded", 0.5, 1.0, "A/m", "bounded".into());
        assert_eq!(findings.failed(), ["limit"]);
        assert_eq!(findings.not_judged[0].name, "limit_reported");
        assert_eq!(findings.not_judged[0].sentence, "follows from `limit`: not said");
        assert_eq!(findings.checks.len(), 2);
        findings.only_warn("nonsense_bounded");
        findings.only_warn("limit");
        assert_eq!((findings.checks.len(), findings.warnings[0].name), (1, "limit"));
    }
}
