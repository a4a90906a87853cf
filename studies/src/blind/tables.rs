//! The study's figures as tables: for the terminal, the documentation and the page.

use super::bars::Bar;
use super::class::{Class, LEVELS};
use super::outcome::Outcome;
use super::results::{ConfusionRow, Results};
use super::run::StudyRun;
use super::share::Share;
use anhyst_report::table::Table;

/// Those that sum up: figures against their bars, and the nuisances.
pub fn summary(results: &Results) -> [(&'static str, Table); 2] {
    [
        ("Figures", figures(&results.bars)),
        ("By nuisance", classes(&results.classes)),
    ]
}

/// Every table with its heading.
pub(super) fn all(results: &Results) -> Vec<(&'static str, Table)> {
    let mut all = Vec::from(summary(results));
    all.extend([
        ("Detection limits", limits(&results.classes)),
        ("Reliability of the confidence", reliability(results)),
        ("Where", places(results)),
        ("Confusion", confusion(&results.confusion)),
        ("Runs that are not right", not_right(&results.not_right)),
    ]);
    all
}

/// Markdown of all of them; `command` is the line that makes it again.
pub fn markdown(results: &Results, command: &str) -> String {
    let mut text = format!("    {command}\n\n{}\n", made_of(results));
    for (heading, table) in all(results) {
        text += &format!("\n### {heading}\n\n{}", table.markdown());
    }
    text
}

/// What was run, in sentences.
pub(super) fn made_of(results: &Results) -> String {
    let plan = &results.plan;
    let sweep = if plan.limits > 0 {
        format!(" Beside them {} at each gap of the detection limits.", plan.limits)
    } else {
        String::new()
    };
    format!(
        "Under each nuisance {} runs with one effect, {} with two, {} with one that the library does not hold, {} with none.{sweep} First \
         seed {}, {} samples at 10 kHz each; nominal model \"{}\". One diagnosis on one thread took {:.1} s in the middle, {:.1} s at most \
         (wall clock of the machine that ran it).",
        plan.singles,
        plan.pairs,
        plan.unlisted,
        plan.none,
        plan.first_seed,
        plan.rows,
        results.model,
        results.median_seconds,
        results.longest_seconds
    )
}

fn percent(share: Share) -> String {
    if share.of == 0 {
        "–".to_owned()
    } else {
        format!("{:.1} %", 100.0 * share.value())
    }
}

fn of(share: Share) -> String {
    if share.of == 0 {
        String::new()
    } else {
        format!("{} of {}", share.count, share.of)
    }
}

fn figures(bars: &[Bar]) -> Table {
    let mut table = Table::new(["figure", "runs", "share", "95 % interval of the share", "bar", "held"]);
    for bar in bars {
        let [low, high] = bar.share.interval();
        let wanted = match (bar.at_least > 0.0, bar.at_most < 1.0) {
            (true, true) => format!("{:.0} to {:.0} %", 100.0 * bar.at_least, 100.0 * bar.at_most),
            (true, false) => format!("at least {:.0} %", 100.0 * bar.at_least),
            _ => format!("at most {:.0} %", 100.0 * bar.at_most),
        };
        table.push([
            bar.name.clone(),
            of(bar.share),
            percent(bar.share),
            bar.held.map_or("–".to_owned(), |_| {
                format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high)
            }),
            wanted,
            match bar.held {
                None => "no runs",
                Some(true) => "yes",
                Some(false) => "no",
            }
            .to_owned(),
        ]);
    }
    table
}

fn classes(classes: &[Class]) -> Table {
    let mut table = Table::new([
        "nuisance",
        "one named",
        "both named",
        "unlisted unknown",
        "wrong, unflagged",
        "unknown or nothing",
        "false alarms",
        "nuisance as effect",
        "share within 5 points",
        "intervals hold",
    ]);
    for own in classes {
        let shares = [
            own.named,
            own.pairs,
            own.unlisted,
            own.wrong,
            own.silent,
            own.false_alarms,
            own.beside,
            own.shares,
            own.intervals,
        ];
        table.push(std::iter::once(own.nuisance.clone()).chain(shares.map(of)));
    }
    table
}

fn limits(classes: &[Class]) -> Table {
    let mut header = vec!["nuisance".to_owned(), "nine of ten from".to_owned()];
    header.extend(LEVELS.map(|gap| format!("{gap}")));
    let mut table = Table::new(header);
    for own in classes {
        let from = own.named_from.map_or("–".to_owned(), |gap| format!("{gap}"));
        let levels = own.levels.iter().copied().map(of);
        table.push([own.nuisance.clone(), from].into_iter().chain(levels));
    }
    table
}

fn reliability(results: &Results) -> Table {
    let mut table = Table::new(["answer", "runs", "confidence stated", "right", "95 % interval"]);
    for (answer, bins) in ["names something", "names nothing"].iter().zip(&results.reliability) {
        for bin in bins {
            let [low, high] = bin.reached.interval();
            table.push([
                (*answer).to_owned(),
                bin.reached.of.to_string(),
                format!("{:.2}", bin.stated),
                format!("{:.2}", bin.reached.value()),
                format!("{low:.2} to {high:.2}"),
            ]);
        }
    }
    table
}

fn places(results: &Results) -> Table {
    let mut table = Table::new(["place", "claimed", "there", "found", "false discoveries", "F₁"]);
    for own in &results.places {
        let share = |count: u64, of: u64| percent(Share { count, of });
        table.push([
            own.axis.heading().to_owned(),
            own.claimed.to_string(),
            own.there.to_string(),
            share(own.right, own.there),
            share(own.claimed - own.right, own.claimed),
            // Harmonic mean of what of the claims is right and what of the truth is found.
            format!(
                "{:.2}",
                2.0 * own.right as f64 / ((own.claimed + own.there) as f64).max(1.0)
            ),
        ]);
    }
    table
}

fn confusion(rows: &[ConfusionRow]) -> Table {
    let mut header = vec!["hidden", "runs"];
    header.extend(Outcome::ALL.map(Outcome::heading));
    header.push("taken for");
    let mut table = Table::new(header);
    for row in rows {
        let counts = row.outcomes.iter().map(|count| match count {
            0 => String::new(),
            count => count.to_string(),
        });
        let taken = row.taken_for.iter().map(|(name, times)| format!("{name} ({times})"));
        let taken = taken.collect::<Vec<_>>().join(", ");
        let cells = [row.truth.clone(), row.runs.to_string()].into_iter().chain(counts);
        table.push(cells.chain([taken]));
    }
    table
}

fn not_right(runs: &[StudyRun]) -> Table {
    let mut table = Table::new(["seed", "nuisance", "hidden", "gap/noise", "drive", "said", "left/noise"]);
    for run in runs {
        let gaps = run.hidden.iter().map(|own| format!("{:.1}", own.gap_over_noise));
        let left = run.said.as_ref().map(|said| format!("{:.2}", said.left_over_noise));
        table.push([
            run.seed.to_string(),
            run.nuisance.clone(),
            run.truth(),
            gaps.collect::<Vec<_>>().join(", "),
            run.drive.clone(),
            run.answer(),
            left.unwrap_or_default(),
        ]);
    }
    table
}
