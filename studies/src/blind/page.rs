//! The study as a page with charts that stands alone.

use super::class::{Class, LEVELS};
use super::results::{Bin, Results};
use super::share::Share;
use super::tables::{all, made_of};
use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::page::{Bar, Bars, Block, Page, Section};
use anhyst_report::table::Verdict;

/// The page; `command` is how it was made.
pub fn page(results: &Results, command: &str) -> Page {
    let lead = "How often the diagnosis names what rigs hide that share no code with it, and how often it errs.";
    let mut page = Page::new("Blind study of the diagnosis", lead).command(command);
    for (place, (heading, table)) in all(results).into_iter().enumerate() {
        let mut section = Section::new(heading);
        if place == 0 {
            let (verdict, text) = if results.held() {
                (Verdict::Pass, "every bar held")
            } else {
                (Verdict::Fail, "not every bar held")
            };
            section = section.badge(verdict, text).paragraph(&made_of(results));
        }
        section = match heading {
            "Figures" => section.figure(shares(results), "Share of the gap, found over true, of each effect named."),
            "By nuisance" => section.block(Block::Bars(named(&results.classes))),
            "Detection limits" => section.figure(
                limits(&results.classes),
                "Right by gap over noise, one effect; a curve a nuisance.",
            ),
            "Reliability of the confidence" => section.figure(
                reliability(results),
                "Share of right answers over the confidence stated, with its 95 % interval. On the line, it means what it says.",
            ),
            _ => section,
        };
        page = page.section(section.table(table));
    }
    page
}

fn named(classes: &[Class]) -> Bars {
    let bar = |own: &Class| Bar {
        name: own.nuisance.clone(),
        value: (own.named.of > 0).then(|| 100.0 * own.named.value()),
        role: Role::Amended,
        note: format!("{} of {}", own.named.count, own.named.of),
    };
    Bars {
        caption: "Runs with one effect that are right.".to_owned(),
        unit: "%".to_owned(),
        logarithmic: false,
        bars: classes.iter().map(bar).collect(),
        limit: Some((90.0, "the bar".to_owned())),
    }
}

fn diagonal() -> Curve {
    Curve::new([[0.0, 0.0], [1.0, 1.0]], Role::Truth).dashed()
}

fn reliability(results: &Results) -> Figure {
    let titles = ["Answers that name something", "Answers that name nothing"];
    let chart = |(title, bins): (&str, &Vec<Bin>)| {
        let reached = bins.iter().map(|bin| [bin.stated, bin.reached.value()]);
        let interval = bins.iter().map(|bin| {
            let [low, high] = bin.reached.interval();
            (bin.stated, low, high)
        });
        Chart::new(
            title,
            Axis::new("confidence stated", "").between(0.0, 1.0),
            Axis::new("right", "").between(0.0, 1.0),
        )
        .band(interval.collect(), Role::Amended, Some("95 % interval"))
        .curve(Curve::new(reached, Role::Amended).named("reached"))
        .curve(diagonal().named("stated"))
    };
    Figure::new(
        "Reliability",
        titles.into_iter().zip(&results.reliability).map(chart).collect(),
    )
}

fn shares(results: &Results) -> Figure {
    let found = results.shares.iter().copied();
    let chart = Chart::new("", Axis::new("true share", ""), Axis::new("share found", ""))
        .curve(Curve::new(found, Role::Amended).as_points().named("effects named"))
        .curve(diagonal().named("truth"));
    Figure::new("Shares of the gap", vec![chart])
}

fn limits(classes: &[Class]) -> Figure {
    let rate = |own: &Class| {
        let levels = LEVELS.into_iter().zip(own.levels.iter().copied());
        let levels = levels.filter(|(_, share): &(f64, Share)| share.of > 0);
        Curve::of(&own.nuisance, levels.map(|(gap, share)| [gap, share.value()]))
    };
    let chart = Chart::new(
        "",
        Axis::new("gap over noise", "").logarithmic(),
        Axis::new("right", "").between(0.0, 1.0),
    )
    .series(classes.iter().map(rate))
    .horizontal(0.9, Role::Limit, "nine of ten");
    Figure::new("Detection limits", vec![chart])
}
