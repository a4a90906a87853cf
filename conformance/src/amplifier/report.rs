//! amplifier.json and report.html.

use super::expectation::Expectation;
use super::findings::{Bound, Check, Findings, NotJudged};
use super::pictures::Picture;
use anhyst_report::number::{Digits, Si};
use anhyst_report::page::{Page, Section};
use anhyst_report::table::{Badge, Cell, Table};
use serde::Serialize;

/// How it came out.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Every check holds.
    Passed,
    /// A check does not hold.
    Failed,
    /// The process did not come, or went away before it should.
    NotThere,
}

/// What `amplifier.json` holds.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// True if the process came, stayed, and every check holds.
    pub passed: bool,
    /// The same with the process's absence apart.
    pub outcome: Outcome,
    /// In a sentence.
    pub sentence: String,
    /// The checks.
    pub checks: Vec<Check>,
    /// What was not judged, and why.
    pub not_judged: Vec<NotJudged>,
    /// What would not hold if it were judged.
    pub warnings: Vec<Check>,
    /// What was expected.
    pub expected: Expectation,
    /// Ticks that were commanded.
    pub ticks: usize,
    /// How the process was started; none if somebody else did.
    pub command: Option<String>,
}

impl Report {
    /// The report of a run; `gone` says that the process did not come or went away, and how.
    pub fn new(
        findings: Findings,
        gone: Option<String>,
        expected: &Expectation,
        ticks: usize,
        command: Option<&str>,
    ) -> Self {
        let failed = findings.failed();
        let outcome = match (&gone, findings.passed()) {
            (Some(_), _) => Outcome::NotThere,
            (None, true) => Outcome::Passed,
            (None, false) => Outcome::Failed,
        };
        let sentence = match gone {
            Some(words) => words,
            None if failed.is_empty() => format!("all {} checks hold", findings.checks.len()),
            None => format!(
                "{} of {} checks do not hold: {}",
                failed.len(),
                findings.checks.len(),
                failed.join(", ")
            ),
        };
        Report {
            passed: outcome == Outcome::Passed,
            outcome,
            sentence,
            checks: findings.checks,
            not_judged: findings.not_judged,
            warnings: findings.warnings,
            expected: expected.clone(),
            ticks,
            command: command.map(str::to_owned),
        }
    }

    /// The checks.
    pub fn table(&self) -> Table {
        checks_table(&self.checks)
    }

    /// The page, self-contained.
    pub fn html(&self, pictures: Vec<Picture>, command_line: &str) -> String {
        let mut table = self.table();
        table.header.push("what it says".to_owned());
        for (row, check) in table.rows.iter_mut().zip(&self.checks) {
            row.push(Cell::Words(check.sentence.clone()));
        }
        let mut checks = Section::new("Checks").table(table);
        if !self.not_judged.is_empty() {
            let mut table = Table::new(["not judged", "why"]);
            for check in &self.not_judged {
                table = table.row([Cell::Words(check.name.into()), Cell::Words(check.sentence.clone())]);
            }
            checks = checks.table(table);
        }
        for check in &self.warnings {
            checks = checks.paragraph(&check.warning());
        }
        let mut page = Page::new("An amplifier, verified", &self.sentence).section(checks);
        page.sections[0].badge = Some(Badge::of(
            self.passed,
            if self.passed { "passed" } else { "not passed" },
        ));
        for picture in pictures {
            page = page.section(Section::new(picture.title).figure(picture.figure, picture.caption));
        }
        page = page
            .command(command_line)
            .fact("ticks", &self.ticks.to_string())
            .fact("tick", &Si(self.expected.tick_s, "s").to_string());
        if let Some(command) = &self.command {
            page = page.fact("process started with", command);
        }
        page.html()
    }
}

/// Checks with value and limit.
pub fn checks_table(checks: &[Check]) -> Table {
    let mut table = Table::new(["check", "", "value", "limit"]);
    for check in checks {
        let sign = match check.bound {
            Bound::AtMost => "≤",
            Bound::AtLeast => "≥",
        };
        let unit = if check.unit == "1" { "" } else { check.unit };
        table.push([
            Cell::Words(check.name.into()),
            Cell::Badge(Badge::of(check.passed, if check.passed { "pass" } else { "FAIL" })),
            Cell::Number(format!("{:#}", Si(check.value, unit))),
            Cell::Number(format!("{sign} {:#}", Si(check.limit, unit))),
        ]);
    }
    table
}

impl Check {
    /// What is said of it where it is not judged.
    pub fn warning(&self) -> String {
        format!(
            "Warning, {}: {}; {:#} {} would be the limit with --paced.",
            self.name,
            self.sentence,
            Digits(self.limit, 5),
            self.unit
        )
    }
}
