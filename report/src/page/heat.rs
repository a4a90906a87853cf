//! A map of values over two others: a coloured cell a pair, with its value to hover over.

use super::escaped::Plain;
use crate::number::Si;
use std::fmt::Write as _;

/// Values of one unit over two lists of names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct HeatMap {
    pub caption: String,
    /// What stands along the bottom: its name, and the columns from the left.
    pub across: (String, Vec<String>),
    /// What stands along the side: its name, and the rows from the bottom.
    pub up: (String, Vec<String>),
    /// SI unit, or any other, or nothing.
    pub unit: String,
    /// Colours then go by the logarithm.
    pub logarithmic: bool,
    /// A row after the other from the bottom, from the left; none where there is no value.
    pub values: Vec<Option<f64>>,
}

/// Cells that a page can hold.
pub const MOST_CELLS: usize = 40_000;
/// Pixels.
const WIDTH: f64 = 640.0;
const MOST_HEIGHT: f64 = 560.0;
const MOST_CELL_HEIGHT: f64 = 44.0;
const LEFT: f64 = 110.0;
const BELOW: f64 = 56.0;
/// Room that a name takes.
const NAME_WIDTH: f64 = 64.0;
const NAME_HEIGHT: f64 = 18.0;
/// Dark to light with even steps to the eye, also in grey and for readers who do not tell red from green (viridis, Nathaniel Smith
/// and Stéfan van der Walt, CC0).
const COLOURS: [[u8; 3]; 9] = [
    [68, 1, 84],
    [71, 44, 122],
    [59, 81, 139],
    [44, 113, 142],
    [33, 144, 141],
    [39, 173, 129],
    [92, 200, 99],
    [170, 220, 50],
    [253, 231, 37],
];

fn colour(share: f64) -> String {
    let at = share.clamp(0.0, 1.0) * (COLOURS.len() - 1) as f64;
    let below = (at as usize).min(COLOURS.len() - 2);
    let [low, high] = [COLOURS[below], COLOURS[below + 1]];
    let part = at - below as f64;
    let mixed = low.into_iter().zip(high).map(|(low, high)| {
        let (low, high) = (f64::from(low), f64::from(high));
        (low + part * (high - low)).round() as u8
    });
    mixed.fold(String::from("#"), |text, part| text + &format!("{part:02x}"))
}

/// Colours from the least to the largest value.
struct Scale {
    low: f64,
    high: f64,
    logarithmic: bool,
}

impl Scale {
    fn of(map: &HeatMap) -> Option<Self> {
        let usable = |value: &f64| value.is_finite() && (!map.logarithmic || *value > 0.0);
        let ends = map.values.iter().flatten().copied().filter(usable);
        let (low, high) = ends.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        (low <= high).then_some(Self {
            low,
            high,
            logarithmic: map.logarithmic,
        })
    }

    fn share(&self, value: f64) -> f64 {
        let position = |value: f64| if self.logarithmic { value.ln() } else { value };
        let (low, high) = (position(self.low), position(self.high));
        if high > low {
            (position(value) - low) / (high - low)
        } else {
            0.5
        }
    }
}

/// Which of so many names are written where there is room for a few: all, or every n-th.
fn step(count: usize, room: f64, each: f64) -> usize {
    let fit = (room / each).max(1.0);
    (count as f64 / fit).ceil().max(1.0) as usize
}

pub(super) fn heat_map(map: &HeatMap) -> String {
    let (columns, rows) = (map.across.1.len().max(1), map.up.1.len().max(1));
    let (width, height) = (
        (WIDTH - LEFT) / columns as f64,
        (MOST_HEIGHT / rows as f64).min(MOST_CELL_HEIGHT),
    );
    let deep = height * rows as f64;
    let scale = Scale::of(map);
    // Writing into a string cannot fail, here and below.
    let mut html = format!(
        "<figure class=\"heat\">\n<svg viewBox=\"0 0 {WIDTH} {:.1}\" role=\"img\" aria-label=\"{}\">\n",
        deep + BELOW,
        Plain(&map.caption)
    );
    let cells = (0..columns * rows).zip(map.values.iter().chain(std::iter::repeat(&None)));
    for (place, value) in cells {
        let (row, column) = (place / columns, place % columns);
        let name =
            |of: &(String, Vec<String>), at: usize| format!("{} {}", of.0, of.1.get(at).map_or("", String::as_str));
        let (fill, told) = match (value, &scale) {
            (Some(value), Some(scale)) if value.is_finite() => {
                (colour(scale.share(*value)), Si(*value, &map.unit).to_string())
            }
            (Some(value), _) => ("none".to_owned(), value.to_string()),
            _ => ("none".to_owned(), "–".to_owned()),
        };
        let _ = writeln!(
            html,
            "<rect x=\"{:.2}\" y=\"{:.2}\" width=\"{width:.2}\" height=\"{height:.2}\" fill=\"{fill}\"><title>{}, {}: {}</title></rect>",
            LEFT + width * column as f64,
            deep - height * (row + 1) as f64,
            Plain(&name(&map.across, column)),
            Plain(&name(&map.up, row)),
            Plain(&told)
        );
    }
    for column in (0..map.across.1.len()).step_by(step(columns, WIDTH - LEFT, NAME_WIDTH)) {
        let x = LEFT + width * (column as f64 + 0.5);
        let name = Plain(&map.across.1[column]);
        let y = deep + 18.0;
        let _ = writeln!(
            html,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"middle\">{name}</text>"
        );
    }
    for row in (0..map.up.1.len()).step_by(step(rows, deep, NAME_HEIGHT)) {
        let y = deep - height * (row as f64 + 0.5) + 4.0;
        let (name, x) = (Plain(&map.up.1[row]), LEFT - 8.0);
        let _ = writeln!(
            html,
            "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"end\">{name}</text>"
        );
    }
    let (middle, bottom) = (0.5 * (LEFT + WIDTH), deep + 42.0);
    let _ = writeln!(
        html,
        "<text x=\"{middle:.1}\" y=\"{bottom:.1}\" text-anchor=\"middle\">{} →</text>\n</svg>",
        Plain(&map.across.0)
    );
    let _ = writeln!(
        html,
        "<p class=\"keys\"><span class=\"key\">↑ {}</span>{}</p>",
        Plain(&map.up.0),
        key(map, scale)
    );
    let _ = write!(html, "<figcaption>{}</figcaption>\n</figure>\n", Plain(&map.caption));
    html
}

/// Which colour is which value.
fn key(map: &HeatMap, scale: Option<Scale>) -> String {
    let Some(scale) = scale else { return String::new() };
    let stops: Vec<String> = (0..COLOURS.len())
        .map(|place| colour(place as f64 / (COLOURS.len() - 1) as f64))
        .collect();
    let by = if map.logarithmic { ", by the logarithm" } else { "" };
    format!(
        "<span class=\"key\">{} <i class=\"ramp\" style=\"background:linear-gradient(90deg,{})\"></i> {}{by}</span>",
        Plain(&Si(scale.low, &map.unit).to_string()),
        stops.join(","),
        Plain(&Si(scale.high, &map.unit).to_string())
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what is read off: the first value is the lower left cell, and the ends of the scale have the ends of the colours.
    #[test]
    fn cells_stand_where_their_values_do() {
        let names = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<_>>();
        let map = HeatMap {
            caption: "errors <i>".into(),
            across: ("kp".into(), names(&["1", "2", "3"])),
            up: ("noise & hum".into(), names(&["low", "high"])),
            unit: "m".into(),
            logarithmic: true,
            values: vec![Some(1e-9), Some(1e-8), None, Some(1e-7), Some(f64::NAN), Some(1e-8)],
        };
        let html = heat_map(&map);
        let cells: Vec<&str> = html.lines().filter(|line| line.starts_with("<rect")).collect();
        assert_eq!(cells.len(), 6);
        let place = |line: &str, name: &str| -> f64 {
            let rest = line.split_once(&format!(" {name}=\"")).unwrap().1;
            rest.split_once('"').unwrap().0.parse().unwrap()
        };
        assert!(place(cells[0], "y") > place(cells[3], "y"));
        assert!(place(cells[0], "x") < place(cells[1], "x"));
        for (cell, words) in [
            (0, ["#440154", "kp 1, noise &amp; hum low: 1.000 nm"]),
            (3, ["#fde725", "kp 1, noise &amp; hum high: 100.0 nm"]),
            (1, ["#21908d", "10.00 nm"]),
            (2, ["fill=\"none\"", ": –"]),
            (4, ["fill=\"none\"", "NaN"]),
        ] {
            for word in words {
                assert!(cells[cell].contains(word), "{word}: {}", cells[cell]);
            }
        }
        assert!(html.contains("errors &lt;i&gt;"));
        assert!(heat_map(&HeatMap::default()).contains("</svg>"));
    }
}
