//! `anhyst explain TOPIC`: the sections and table rows of the documentation that are about it. The documentation is the only copy.

use super::Ending;
use anhyst_measured::nearest;
use clap::Args;

/// `explain`
#[derive(Debug, Args)]
pub struct ExplainArguments {
    /// A heading, a setting, a guard event, an effect, a law, a command: settling_s, eddy_current, exit codes (default: the headings).
    pub topic: Vec<String>,
}

/// Name and text of each page.
pub const PAGES: [(&str, &str); 18] = [
    ("running", include_str!("../../../docs/running.md")),
    ("scenarios", include_str!("../../../docs/scenarios.md")),
    ("safety", include_str!("../../../docs/safety.md")),
    ("control", include_str!("../../../docs/control.md")),
    ("effects", include_str!("../../../docs/effects.md")),
    ("laws", include_str!("../../../docs/laws.md")),
    ("hysteresis", include_str!("../../../docs/hysteresis.md")),
    ("data", include_str!("../../../docs/data.md")),
    ("fit", include_str!("../../../docs/fit.md")),
    ("estimate", include_str!("../../../docs/estimate.md")),
    ("diagnose", include_str!("../../../docs/diagnose.md")),
    ("sweep", include_str!("../../../docs/sweep.md")),
    ("realtime", include_str!("../../../docs/realtime.md")),
    ("drivers", include_str!("../../../docs/drivers.md")),
    ("verify-amplifier", include_str!("../../../docs/verify-amplifier.md")),
    ("fmu", include_str!("../../../docs/fmu.md")),
    ("live", include_str!("../../../docs/live.md")),
    ("bridge", include_str!("../../../docs/bridge.md")),
];

/// Sections that are shown of a topic that only stands somewhere in them.
const MOST_MENTIONS: usize = 5;

/// A heading and what stands below it, up to the next.
struct Section<'a> {
    page: &'static str,
    heading: &'a str,
    text: &'a str,
}

fn sections() -> impl Iterator<Item = Section<'static>> {
    PAGES.iter().flat_map(|(page, text)| {
        let text = text.strip_prefix("# ").unwrap_or(text);
        text.split("\n#").map(move |own| {
            let own = own.trim_start_matches('#').trim_start();
            let (heading, text) = own.split_once('\n').unwrap_or((own, ""));
            Section {
                page,
                heading: heading.trim(),
                text: text.trim(),
            }
        })
    })
}

/// Letters and digits in lower case, the rest as one blank.
fn plain(text: &str) -> String {
    let letters = text.chars().map(|letter| {
        if letter.is_alphanumeric() {
            letter.to_ascii_lowercase()
        } else {
            ' '
        }
    });
    letters
        .collect::<String>()
        .split_whitespace()
        .collect::<Vec<_>>()
        .join(" ")
}

/// The rows of a section's tables whose first cell is about the topic, each with the header above it; of a table whose header is, all rows.
fn rows<'a>(section: &Section<'a>, topic: &str) -> Vec<&'a str> {
    let mut found = Vec::new();
    let lines: Vec<&str> = section.text.lines().collect();
    for table in lines.chunk_by(|one, other| one.starts_with('|') == other.starts_with('|')) {
        let [header, rule, rows @ ..] = table else { continue };
        let cells = |line: &str| {
            let mut cells = line.trim_start_matches('|').split('|').map(plain);
            // The second cell: events have their number in front of their name.
            [cells.next().unwrap_or_default(), cells.next().unwrap_or_default()]
        };
        let whole = header.starts_with('|') && cells(header)[0] == topic;
        let is_it = |line: &&&str| {
            let [first, second] = cells(line);
            whole || format!(" {first} ").contains(&format!(" {topic} ")) || second == topic
        };
        let own: Vec<&str> = rows
            .iter()
            .filter(|line| line.starts_with('|'))
            .filter(is_it)
            .copied()
            .collect();
        if !own.is_empty() {
            found.extend([*header, *rule]);
            found.extend(own);
        }
    }
    found
}

/// What the documentation says of a topic; empty if nothing.
pub fn explained(topic: &str) -> String {
    let topic = plain(topic);
    let mut text = String::new();
    for own in sections() {
        let heading = plain(own.heading);
        if heading == topic || own.page == topic && own.heading == first_heading(own.page) {
            text += &format!("# {} (docs/{}.md)\n\n{}\n\n", own.heading, own.page, own.text);
            continue;
        }
        let rows = rows(&own, &topic);
        if !rows.is_empty() {
            text += &format!("# {} (docs/{}.md)\n\n{}\n\n", own.heading, own.page, rows.join("\n"));
        }
    }
    text
}

/// Paragraphs, list items and table rows in which the topic stands somewhere; no more than `most`.
fn mentions(topic: &str, most: usize) -> String {
    let topic = format!(" {} ", plain(topic));
    let of_section = |own: Section<'static>| {
        let blocks = own.text.split("\n\n").flat_map(|block| {
            let row_or_item = if block.starts_with('|') { "\n" } else { "\n- " };
            block.split(row_or_item)
        });
        let said = blocks.filter(|block| format!(" {} ", plain(block)).contains(&topic));
        let said: Vec<&str> = said.collect();
        (!said.is_empty()).then(|| format!("# {} (docs/{}.md)\n\n{}\n\n", own.heading, own.page, said.join("\n\n")))
    };
    sections().filter_map(of_section).take(most).collect()
}

/// What is written as a name of one word: settings, events, effects, options.
fn names() -> impl Iterator<Item = &'static str> {
    let quoted = PAGES.iter().flat_map(|(_, text)| text.split('`').skip(1).step_by(2));
    quoted.filter(|name| !name.contains(char::is_whitespace))
}

fn first_heading(page: &str) -> &'static str {
    sections().find(|own| own.page == page).map_or("", |own| own.heading)
}

/// What the help of each command that has an option of this name says of it.
fn options(all: &clap::Command, topic: &str) -> String {
    let name = topic.trim_start_matches('-').replace('_', "-");
    let said = all.get_subcommands().flat_map(|own| {
        let named = own
            .get_arguments()
            .filter(|option| option.get_long() == Some(name.as_str()));
        named.filter_map(|option| {
            let help = option.get_long_help().or(option.get_help())?;
            Some(format!("anhyst {} --{name}: {help}\n", own.get_name()))
        })
    });
    said.collect()
}

/// Runs the command; `all` is the whole command line.
///
/// # Errors
/// A topic of which the documentation says nothing.
pub fn run(arguments: &ExplainArguments, all: &clap::Command) -> miette::Result<Ending> {
    let topic = arguments.topic.join(" ");
    if topic.trim().is_empty() {
        for (page, _) in PAGES {
            let headings: Vec<&str> = sections()
                .filter(|own| own.page == page)
                .map(|own| own.heading)
                .collect();
            crate::say!("{page}: {}", headings.join(", "));
        }
        return Ok(Ending::Held);
    }
    let text = explained(&topic);
    let text = if text.is_empty() { options(all, &topic) } else { text };
    let text = if text.is_empty() {
        mentions(&topic, MOST_MENTIONS)
    } else {
        text
    };
    if !text.is_empty() {
        crate::say!("{}", text.trim_end());
        return Ok(Ending::Held);
    }
    let words = plain(&topic);
    let near = |own: &Section| {
        words
            .split(' ')
            .any(|word| word.len() > 2 && plain(own.heading).contains(word))
    };
    let near: Vec<String> = sections()
        .filter(near)
        .map(|own| format!("\"{}\"", own.heading))
        .collect();
    let remedy = match nearest(&topic, names()) {
        _ if !near.is_empty() => format!("there is {}", near.join(", ")),
        Some(name) => format!("is `{name}` meant?"),
        None => "`anhyst explain` lists the headings".to_owned(),
    };
    Err(miette::miette!("nothing is said of \"{topic}\": {remedy}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards the documentation's form: what a user asks for is found in it.
    #[test]
    fn settings_events_effects_laws_and_exit_codes_are_explained() {
        for (topic, answer) in [
            ("settling_s", "judged from here on"),
            ("exit codes", "a process failed"),
            ("eddy_current", "leads the lag"),
            ("MultiParameter", "drift"),
            ("coil_late", "220 ticks"),
            ("bent-plays", "piezo"),
            ("learning", "harmonics"),
            ("sweep", "--vary"),
        ] {
            let text = explained(topic);
            assert!(text.contains(answer), "{topic}: {text}");
        }
        assert_eq!(explained("no such thing"), "");
        for (topic, answer) in [
            ("gain margin", "may be multiplied"),
            ("NRMSE", "measured range"),
            ("phase margin", "turn"),
        ] {
            let text = explained(topic) + &mentions(topic, MOST_MENTIONS);
            assert!(text.contains(answer), "{topic}: {text}");
        }
        assert_eq!(mentions("no such thing", MOST_MENTIONS), "");
        assert_eq!(nearest("settlng_s", names()), Some("settling_s"));
    }
}
