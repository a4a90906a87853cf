//! Bars of a page: shares stacked to a whole, and values side by side, both by name.

use super::escaped::Plain;
use crate::chart::Role;
use crate::number::{self, Si};
use std::fmt::Write as _;

/// Bars cut into shares, one below the other.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Shares {
    pub caption: String,
    /// Name of the bar, and what it is made of.
    pub rows: Vec<(String, Vec<Segment>)>,
}

/// A part of a bar.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    pub name: String,
    /// Of the whole, 0 to 1. More than a whole is drawn as one.
    pub share: f64,
    pub role: Role,
}

/// Values of one unit, each a bar.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Bars {
    pub caption: String,
    pub unit: String,
    /// Bars then show by how much a value is above the smallest.
    pub logarithmic: bool,
    pub bars: Vec<Bar>,
    /// A value to compare with, as the noise.
    pub limit: Option<(f64, String)>,
}

/// One of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Bar {
    pub name: String,
    /// None where there is no value; the note says why.
    pub value: Option<f64>,
    pub role: Role,
    pub note: String,
}

/// Shares from here on are named within the bar.
const MIN_NAMED: f64 = 0.09;

impl Segment {
    pub fn new(name: &str, share: f64, role: Role) -> Self {
        Segment {
            name: name.to_owned(),
            share,
            role,
        }
    }
}

fn percent(share: f64) -> String {
    let decimals = usize::from(share.abs() < 0.1);
    number::percent(share, decimals)
}

fn colours(role: Role) -> String {
    let [light, dark] = role.css();
    format!("--light:{light};--dark:{dark}")
}

pub(super) fn shares(shares: &Shares) -> String {
    let mut html = String::from("<figure class=\"shares\">\n");
    for (name, segments) in &shares.rows {
        let known = |segment: &&Segment| segment.share.is_finite() && segment.share > 0.0;
        let whole = segments.iter().filter(known).map(|own| own.share).sum::<f64>().max(1.0);
        // Writing into a string cannot fail, here and below.
        let _ = write!(
            html,
            "<div class=\"bar-name\">{}</div>\n<div class=\"stack\">",
            Plain(name)
        );
        for own in segments.iter().filter(known) {
            let (share, percent) = (own.share / whole, percent(own.share));
            let text = if share >= MIN_NAMED {
                format!("{} {percent}", own.name)
            } else {
                String::new()
            };
            let _ = write!(
                html,
                "<span class=\"segment\" style=\"width:{:.3}%;color:{};{}\" title=\"{}: {percent}\">{}</span>",
                100.0 * share,
                if own.role.is_dark() { "#ffffff" } else { "#10151a" },
                colours(own.role),
                Plain(&own.name),
                Plain(&text)
            );
        }
        html += "</div>\n<div class=\"keys\">";
        for own in segments {
            let _ = write!(
                html,
                "<span class=\"key\"><i class=\"swatch\" style=\"{}\"></i>{} {}</span>",
                colours(own.role),
                Plain(&own.name),
                percent(own.share)
            );
        }
        html += "</div>\n";
    }
    let _ = write!(html, "<figcaption>{}</figcaption>\n</figure>\n", Plain(&shares.caption));
    html
}

pub(super) fn bars(bars: &Bars) -> String {
    let limit = bars.limit.as_ref().map(|(value, _)| *value);
    let values = || bars.bars.iter().filter_map(|bar| bar.value).chain(limit);
    let usable = |value: &f64| value.is_finite() && *value > 0.0;
    let (low, high) = values()
        .filter(usable)
        .fold((f64::INFINITY, 0.0_f64), |(low, high), value| {
            (low.min(value), high.max(value))
        });
    let share = |value: f64| match bars.logarithmic {
        // The smallest still has a bar.
        true if high > low => 0.06 + 0.94 * (value.max(low) / low).ln() / (high / low).ln(),
        _ if high > 0.0 => value / high,
        _ => 0.0,
    };
    let across = limit.filter(usable).map_or_else(String::new, |value| {
        format!("<i class=\"limit\" style=\"left:{:.2}%\"></i>", 100.0 * share(value))
    });
    let mut html = String::from("<figure class=\"bars\">\n");
    for bar in &bars.bars {
        let fill = bar
            .value
            .filter(|value| value.is_finite())
            .map_or_else(String::new, |value| {
                let width = 100.0 * share(value).clamp(0.0, 1.0);
                format!(
                    "<i class=\"fill\" style=\"width:{width:.2}%;{}\"></i>",
                    colours(bar.role)
                )
            });
        let value = bar
            .value
            .map_or_else(|| "–".to_owned(), |value| Si(value, &bars.unit).to_string());
        let _ = writeln!(
            html,
            "<div class=\"bar-name\">{}</div><div class=\"track\" title=\"{}: {value}\">{fill}{across}</div><div class=\"bar-value\">{value} <small>{}</small></div>",
            Plain(&bar.name),
            Plain(&bar.name),
            Plain(&bar.note)
        );
    }
    let limit = bars.limit.as_ref().map_or_else(String::new, |(value, name)| {
        format!(" Dashed: {name}, {}.", Si(*value, &bars.unit))
    });
    let _ = write!(
        html,
        "<figcaption>{}{}</figcaption>\n</figure>\n",
        Plain(&bars.caption),
        Plain(&limit)
    );
    html
}
