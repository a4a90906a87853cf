//! What a sweep came to, on a page: how many held, the errors over what varies, and what did not hold.

use crate::manifest::Manifest;
use crate::picture::{bars, curves, maps};
use crate::plan::Plan;
use crate::points::{Point, Points, Spread};
use crate::row::Row;
use crate::shard::Shard;
use crate::variation::{Kind, Variation};
use anhyst_report::number::Si;
use anhyst_report::page::{Block, MOST_CELLS, Page, Section};
use anhyst_report::table::{Table, Verdict};

/// Failures that are told by their sentence.
const TOLD: usize = 10;

/// What the rows say together; its size does not depend on how many there are.
#[derive(Debug)]
pub struct Findings {
    /// Of all runs.
    pub whole: Point,
    /// Runs that did not come to their end.
    pub failed: u64,
    /// By what varies: two together, or each alone.
    pub points: Vec<Points>,
    /// The first of those that did not hold: run and sentence.
    pub failures: Vec<(u64, String)>,
}

impl Findings {
    /// Of no run.
    pub fn new(plan: &Plan) -> Self {
        let all: Vec<usize> = (0..plan.variations().len()).collect();
        let size = |over: &[usize]| -> usize {
            let counts = over.iter().map(|own| plan.variations()[*own].values.len());
            counts.fold(1, usize::saturating_mul)
        };
        let together = all.len() == 2 && size(&all) <= MOST_CELLS;
        let groups: Vec<Vec<usize>> = match together {
            true => vec![all],
            false => all.into_iter().map(|own| vec![own]).collect(),
        };
        let groups = groups.into_iter().filter(|over| size(over) <= MOST_CELLS);
        Self {
            whole: Points::new(plan, Vec::new()).all.remove(0),
            failed: 0,
            points: groups.map(|over| Points::new(plan, over)).collect(),
            failures: Vec::new(),
        }
    }

    /// Counts a run in.
    pub fn push(&mut self, plan: &Plan, row: &Row) {
        self.whole.push(row);
        self.failed += u64::from(!row.ran());
        for points in &mut self.points {
            points.push(plan, row);
        }
        if !row.first_failure.is_empty() && self.failures.len() < TOLD {
            self.failures.push((row.index, row.first_failure.clone()));
        }
    }

    /// Errors and verdicts by what varies, if that is not more than `most` rows.
    pub fn table(&self, plan: &Plan, most: usize) -> Option<Table> {
        match &self.points[..] {
            [points] if points.all.len() <= most => Some(by_point(plan, points)),
            [] => Some(by_point(plan, &Points::whole(&self.whole))),
            _ => None,
        }
    }
}

fn by_point(plan: &Plan, points: &Points) -> Table {
    let varied = points.over.iter().map(|own| plan.variations()[*own].path.as_str());
    let mut table = Table::new(varied.chain([
        "runs",
        "held",
        "error rms, mean",
        "least",
        "largest",
        "error max, mean",
        "largest",
    ]));
    for point in &points.all {
        let values = points.over.iter().zip(&point.places);
        let values = values.map(|(own, place)| plan.variations()[*own].values[*place].clone());
        let counts = [point.runs, point.held].map(|count| count.to_string());
        let told = |spread: &Spread, which: &[usize]| -> Vec<String> {
            let told = spread.told();
            let text = |place: &usize| told.map_or_else(|| "–".into(), |told| Si(told[*place], "m").to_string());
            which.iter().map(text).collect()
        };
        let errors = [told(&point.error_rms_m, &[1, 0, 2]), told(&point.error_max_m, &[1, 2])];
        table.push(values.chain(counts).chain(errors.concat()));
    }
    table
}

/// The page.
pub fn page(manifest: &Manifest, plan: &Plan, findings: &Findings) -> Page {
    let (runs, held) = (findings.whole.runs, findings.whole.held);
    let lead = format!(
        "{runs} runs of `{}`, each in one process, in lockstep, unrecorded.",
        manifest.name()
    );
    let mut verdict = Section::new("Verdict").table(varied(manifest, plan));
    verdict = match held {
        all if all == runs => verdict.badge(Verdict::Pass, "all held"),
        0 => verdict.badge(Verdict::Note, "none held"),
        some => verdict.badge(Verdict::Note, &format!("{some} of {runs} held")),
    };
    if findings.failed > 0 {
        verdict = verdict.paragraph(&format!("{} runs did not come to their end.", findings.failed));
    }
    let mut page = Page::new(&format!("Sweep of {}", manifest.name()), &lead).section(verdict);
    let tolerance_m = manifest.scenario["expect"]["tolerance_m"].as_f64();
    let tolerance_m = tolerance_m.filter(|_| !plan.variations().iter().any(|own| own.path == "expect.tolerance_m"));
    for points in &findings.points {
        page = page.section(picture(plan, points, tolerance_m));
    }
    if let Some(table) = findings.table(plan, 200) {
        page = page.section(Section::new("In figures").table(table));
    }
    if !findings.failures.is_empty() {
        let mut table = Table::new(["run", "what did not hold"]);
        for (index, sentence) in &findings.failures {
            table.push([index.to_string(), sentence.clone()]);
        }
        page = page.section(Section::new("First failures").table(table));
    }
    page.command(&command(manifest, plan))
        .fact("version", &manifest.version)
        .fact("rows", "`sweep.csv`, `sweep.parquet`: a row a run")
}

fn picture(plan: &Plan, points: &Points, tolerance_m: Option<f64>) -> Section {
    let variations: Vec<&Variation> = points.over.iter().map(|own| &plan.variations()[*own]).collect();
    let spread = match plan.variations().len() - variations.len() {
        0 => format!("Spread over {} seeds.", plan.seeds()),
        _ => "Spread over seeds and over all else that varies.".to_owned(),
    };
    let names: Vec<&str> = variations.iter().map(|own| own.path.as_str()).collect();
    let section = Section::new(&names.join(" and "));
    match variations[..] {
        [one] => match one.numbers() {
            Some(numbers) => section.figure(
                curves(one, &numbers, points, tolerance_m),
                &format!("Mean; the band is from the least to the largest. {spread}"),
            ),
            None => section.block(Block::Bars(bars(one, points, tolerance_m, &spread))),
        },
        [one, other] => {
            let all = maps([one, other], points, plan.seeds());
            all.into_iter()
                .fold(section, |section, map| section.block(Block::Heat(map)))
        }
        _ => section,
    }
}

fn varied(manifest: &Manifest, plan: &Plan) -> Table {
    let mut table = Table::new(["what varies", "values", "from", "to"]);
    for own in plan.variations() {
        let count = own.values.len().to_string();
        let [first, last] = [own.values.first(), own.values.last()].map(|value| value.cloned().unwrap_or_default());
        table.push([own.path.clone(), count, first, last]);
    }
    let (first, seeds) = (manifest.first_seed, plan.seeds());
    table.push([
        "seed".to_owned(),
        seeds.to_string(),
        first.to_string(),
        (first + seeds - 1).to_string(),
    ]);
    table
}

/// The line that makes the sweep again, wherever the scenario is.
fn command(manifest: &Manifest, plan: &Plan) -> String {
    let mut line = format!("anhyst sweep {}.ron", manifest.name());
    for own in plan.variations() {
        // Values of a range are in it; a few of any kind, too.
        let values = match (&own.values[..], own.kind()) {
            ([first, .., last], Kind::Integer | Kind::Number) if own.values.len() > 6 => {
                let by = if own.logarithmic { ":log" } else { "" };
                format!("{first}..{last}:{}{by}", own.values.len())
            }
            (all, _) => format!("[{}]", all.join(", ")),
        };
        line += &format!(" --vary '{}={values}'", own.path);
    }
    line += &format!(" --seeds {}", plan.seeds());
    if manifest.shard != Shard::WHOLE {
        line += &format!(" --shard {}", manifest.shard);
    }
    line
}
