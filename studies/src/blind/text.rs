//! The study's figures as a section for the documentation.

use std::fmt::Write as _;

use super::bars::{Bar, Share};
use super::case::{Family, LIMIT_GAPS, Plan};
use super::limits::{Level, Limit};
use super::outcome::Outcome;
use super::results::{ConfusionRow, Results};
use super::run::StudyRun;

/// Markdown with tables of bars, confusion and limits; `command` is the line that makes it again.
pub fn markdown(results: &Results, command: &str) -> String {
    let mut text = format!("    {command}\n\n{}\n", made_of(results));
    text += &bars(&results.bars);
    text += &confusion(&results.confusion);
    text += &not_right(&results.not_right);
    text += &limits(&results.limits, results.plan.rows);
    text
}

fn line(text: &mut String, cells: &[String]) {
    // Writing into a string cannot fail.
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

fn table(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut text = String::new();
    line(
        &mut text,
        &header.iter().map(|own| (*own).to_owned()).collect::<Vec<_>>(),
    );
    line(&mut text, &vec!["---".to_owned(); header.len()]);
    rows.for_each(|row| line(&mut text, &row));
    text.push('\n');
    text
}

fn made_of(results: &Results) -> String {
    let Plan {
        singles,
        none,
        unlisted,
        pairs,
        limits,
        first_seed,
        rows,
    } = results.plan;
    let sweep = if limits > 0 {
        format!(" Beside them {limits} for each effect and gap of the detection limits.")
    } else {
        String::new()
    };
    format!(
        "{singles} runs with one effect, {none} with none, {unlisted} with an effect that the library does not hold, {pairs} with two.{sweep} \
         First seed {first_seed}, {rows} samples at 10 kHz each; nominal model \"{}\". One diagnosis on one thread took {:.1} s \
         in the middle, {:.1} s at most (wall clock of the machine that ran it).\n",
        results.model, results.median_seconds, results.longest_seconds
    )
}

fn percent(value: f64) -> String {
    if value.is_nan() {
        "–".to_owned()
    } else {
        format!("{:.1} %", 100.0 * value)
    }
}

fn bars(bars: &[Bar]) -> String {
    let row = |bar: &Bar| {
        let [low, high] = bar.share.interval();
        let wanted = match (bar.at_least > 0.0, bar.at_most < 1.0) {
            (true, true) => format!("{:.0} to {:.0} %", 100.0 * bar.at_least, 100.0 * bar.at_most),
            (true, false) => format!("at least {:.0} %", 100.0 * bar.at_least),
            _ => format!("at most {:.0} %", 100.0 * bar.at_most),
        };
        vec![
            bar.name.clone(),
            format!("{} of {}", bar.share.count, bar.share.of),
            percent(bar.share.value()),
            match bar.held {
                None => "–".to_owned(),
                Some(_) => format!("{:.1} to {:.1} %", 100.0 * low, 100.0 * high),
            },
            wanted,
            verdict(bar).to_owned(),
        ]
    };
    let header = ["figure", "runs", "share", "95 % interval of the share", "bar", "held"];
    format!("### Figures\n\n{}", table(&header, bars.iter().map(row)))
}

fn verdict(bar: &Bar) -> &'static str {
    match bar.held {
        None => "no runs",
        Some(true) => "yes",
        Some(false) => "**no**",
    }
}

fn count(number: u64) -> String {
    if number == 0 { String::new() } else { number.to_string() }
}

fn confusion(rows: &[ConfusionRow]) -> String {
    let mut header = vec!["hidden", "runs"];
    header.extend(Outcome::ALL.map(Outcome::heading));
    header.push("taken for");
    let row = |row: &ConfusionRow| {
        let taken: Vec<String> = row
            .taken_for
            .iter()
            .map(|(name, times)| format!("{name} ({times})"))
            .collect();
        let mut cells = vec![row.truth.clone(), row.runs.to_string()];
        cells.extend(row.outcomes.iter().copied().map(count));
        cells.push(taken.join(", "));
        cells
    };
    format!("### Confusion\n\n{}", table(&header, rows.iter().map(row)))
}

fn not_right(runs: &[StudyRun]) -> String {
    let row = |run: &StudyRun| {
        let gaps = run.truth.iter().flat_map(|truth| &truth.gaps_over_noise);
        let gaps: Vec<String> = gaps.map(|gap| format!("{gap:.2}")).collect();
        let said = run.verdict.map_or("-", anhyst_diagnosis::Verdict::name);
        let mut names = vec![run.named.join(" + ")];
        names.extend(run.ambiguous_with.iter().cloned());
        names.retain(|name| !name.is_empty());
        vec![
            run.seed.to_string(),
            run.truth_name(),
            gaps.join(", "),
            run.truth
                .as_ref()
                .map_or(String::new(), |truth| format!("{:?}", truth.excitation).to_lowercase()),
            format!("{said} {}", names.join(" or ")).trim_end().to_owned(),
            format!("{:.2}", run.gap_after),
        ]
    };
    let counted = runs.iter().filter(|run| run.family != Family::Limit);
    let header = ["seed", "hidden", "gap/noise", "drive", "said", "left, noises"];
    format!("### Runs that are not right\n\n{}", table(&header, counted.map(row)))
}

fn cell(level: &Level) -> String {
    let Share { count, of } = level.right;
    if of == 0 {
        String::new()
    } else {
        format!("{count}/{of} ({:.2})", level.ideal_named)
    }
}

fn number(value: f64) -> String {
    if value.is_finite() {
        format!("{value:.3}")
    } else {
        "-".to_owned()
    }
}

fn limits(limits: &[Limit], rows: usize) -> String {
    let mut header = vec!["hidden".to_owned()];
    header.extend(LIMIT_GAPS.map(|gap| format!("{gap}")));
    let last = header.len() - 1;
    header[last] += " and more";
    header.extend(["right from", "ideal sees from", "ideal names from", "its nearest rival"].map(str::to_owned));
    let row = |limit: &Limit| {
        let mut cells = vec![limit.effect.clone()];
        cells.extend(limit.levels.iter().map(cell));
        cells.push(limit.right_from.map_or("-".to_owned(), |gap| format!("{gap:.2}")));
        cells.push(number(limit.ideal_seen_from));
        cells.push(number(limit.ideal_named_from));
        cells.push(limit.nearest_rival.clone());
        cells
    };
    let header: Vec<&str> = header.iter().map(String::as_str).collect();
    format!(
        "### Detection limits\n\n\
         Rate of right naming (ties that hold the truth count) by gap over noise, and in brackets the mean chance of the ideal. Both are \
         rms per sample: over {rows} samples a gap of one noise stands out by {:.0} standard deviations, which is why the ideal's \
         limits lie far below 1. *Ideal sees*: likelihood ratio of the effect at its known size against none, false alarm 1 %, power \
         Φ(d − 2.33) = 95 %. *Ideal names*: the effect against its nearest rival, both known: Φ(d_r/2) = 95 %; d and d_r: length of what \
         the effect adds to displacement and field, over their noises, and of the part of it that the rival cannot imitate. No method without \
         that knowledge reaches either. *Right from*: the smallest gap from which on every run was right.\n\n{}",
        (rows as f64).sqrt(),
        table(&header, limits.iter().map(row))
    )
}
