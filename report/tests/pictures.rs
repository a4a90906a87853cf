//! Guards pictures and pages: well-formed, self-contained, escaped, and of a size that a browser opens.

use anhyst_report::page::{Badge, Block, Cell, Page, Section, Table, Verdict};
use anhyst_report::plot::{Axis, Figure, Legend, Line, Panel, Role};

fn wave(samples: usize) -> Vec<(f64, f64)> {
    (0..samples)
        .map(|i| (i as f64 * 1e-4, 4e-5 * (i as f64 * 0.031).sin()))
        .collect()
}

fn figure(samples: usize) -> Figure {
    let time = || Axis::new("time", "s");
    Figure::new("before & after, <shown>")
        .columns(2)
        .panel(
            Panel::new("displacement", time(), Axis::new("displacement", "m"))
                .line(Line::new(wave(samples), Role::Measured).named("measured \"y\""))
                .line(Line::new(wave(samples), Role::Model).named("model").dashed())
                .horizontal(2e-5, Role::Limit, "limit 20 µm"),
        )
        .panel(
            Panel::new(
                "gap",
                Axis::new("frequency", "Hz").logarithmic(),
                Axis::new("power", "m²").logarithmic(),
            )
            .line(Line::new(
                vec![(1.0, 1e-12), (0.0, 1.0), (100.0, f64::NAN), (10.0, 1e-15)],
                Role::Residual,
            ))
            .band(
                vec![(1.0, 1e-13, 1e-12), (10.0, 1e-16, 1e-15)],
                Role::Amended,
                Some("±1σ"),
            )
            .legend(Legend::UpperRight),
        )
        .panel(Panel::new("nothing", time(), Axis::new("y", "")).legend(Legend::Hidden))
}

#[test]
fn a_figure_is_well_formed_and_says_what_was_given() {
    let svg = figure(2000).svg(900, 600).unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap_or_else(|error| panic!("{error}"));
    let root = document.root_element();
    assert_eq!(
        (root.attribute("width"), root.attribute("viewBox")),
        (Some("900"), Some("0 0 3600 2400"))
    );
    let words: Vec<String> = document
        .descendants()
        .filter_map(|node| node.text())
        .map(|t| t.trim().to_owned())
        .collect();
    let expected = [
        "before & after, <shown>",
        "measured \"y\"",
        "displacement, µm",
        "limit 20 µm",
        "10⁻¹²",
        "±1σ",
        "time, s",
    ];
    for word in expected {
        assert!(
            words.iter().any(|found| found == word),
            "{word} is missing in {words:?}"
        );
    }
    assert_eq!(
        svg,
        figure(2000).svg(900, 600).unwrap(),
        "equal data must give equal bytes"
    );
}

#[test]
fn a_long_series_makes_no_long_picture() {
    let (short, long) = (
        figure(20_000).svg(900, 600).unwrap().len(),
        figure(1_000_000).svg(900, 600).unwrap().len(),
    );
    assert!(short < 120_000 && long < 120_000, "{short} and {long} bytes");
}

/// The line must pass where the data are: the crest of the wave stands at the same height as a marker put there.
#[test]
fn values_stand_where_the_axis_says() {
    let panel = Panel::new(
        "",
        Axis::new("x", "").between(0.0, 10.0),
        Axis::new("y", "").between(0.0, 10.0),
    );
    let panel = panel.line(Line::new(vec![(0.0, 0.0), (5.0, 5.0), (10.0, 5.0)], Role::Truth));
    let svg = Figure::new("")
        .panel(panel.clone().horizontal(5.0, Role::Limit, ""))
        .svg(400, 300)
        .unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap();
    let paths = |colour: &str| -> Vec<Vec<(f64, f64)>> {
        let of = document
            .descendants()
            .filter(|node| node.attribute("stroke") == Some(colour));
        let pair = |text: &str| {
            text.split_once(',')
                .map(|(x, y)| (x.parse().unwrap(), y.parse().unwrap()))
        };
        let points = |text: &str| text.split_whitespace().filter_map(pair).collect::<Vec<(f64, f64)>>();
        of.map(|node| points(node.attribute("points").unwrap_or_default()))
            .collect()
    };
    let (line, dashes) = (&paths("#009E73")[0], paths("#787878"));
    assert_eq!(line.len(), 3);
    assert!((line[1].1 - dashes[0][0].1).abs() <= 1.0, "{line:?} {:?}", dashes[0]);
    assert!((line[1].0 - 0.5 * (line[0].0 + line[2].0)).abs() <= 1.0, "{line:?}");
    // Beyond the axis nothing is drawn.
    let beyond = Panel {
        lines: vec![Line::new(vec![(0.0, 20.0), (10.0, 20.0)], Role::Truth)],
        ..panel
    };
    assert!(!Figure::new("").panel(beyond).svg(400, 300).unwrap().contains("#009E73"));
}

#[test]
fn a_bitmap_has_two_dots_per_pixel_and_is_not_blank() {
    let bytes = figure(500).png(400, 300).unwrap();
    let mut reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let mut dots = vec![0; reader.output_buffer_size().unwrap()];
    let info = reader.next_frame(&mut dots).unwrap();
    assert_eq!((info.width, info.height), (800, 600));
    let dark = dots
        .chunks(3)
        .filter(|dot| dot.iter().all(|channel| *channel < 100))
        .count();
    let light = dots
        .chunks(3)
        .filter(|dot| dot.iter().all(|channel| *channel > 250))
        .count();
    assert!(dark > 500 && light > 300_000, "{dark} dark and {light} light dots");
}

fn page() -> Page {
    let table = Table::new(&["law", "a, A/m", "held"])
        .caption("after 1 s")
        .row([
            Cell::from("folded <i>"),
            Cell::from(7012.3),
            Badge::of(true, "within 1 A/m").into(),
        ])
        .row([
            Cell::from("gradient"),
            Cell::from("−3.5e1"),
            Badge::of(false, "no").into(),
        ]);
    let both = Section::new("What is left?")
        .badge(Verdict::Pass, "all held")
        .paragraph("Run `anhyst paper --out <DIR>` & look; a lone ` stays.")
        .figure(&figure(3000), (900, 600), "Loops before & after \"the fix\"")
        .unwrap()
        .beside(
            ("the paper says", "bias of 4 A/m"),
            ("we get", "4.2 A/m"),
            Some(Badge::of(true, "agrees")),
        );
    Page::new("Report <1>", "What `x` & \"y\" do.")
        .section(both)
        .section(Section::new("What is left?").table(table))
        .section(
            Section::new("±")
                .block(Block::List(vec!["one".to_owned(), "<two>".to_owned()]))
                .block(Block::Code("if a < b && c { }\n".to_owned()))
                .block(Block::Badges(vec![Badge::new(Verdict::Note, "not excited")])),
        )
        .command("anhyst paper --out \"my <dir>\"")
        .fact("data", "run.csv, XXH3 0123456789abcdef")
}

#[test]
fn a_page_is_well_formed_and_needs_no_network() {
    let html = page().html();
    let options = roxmltree::ParsingOptions {
        allow_dtd: true,
        ..Default::default()
    };
    let document = roxmltree::Document::parse_with_options(&html, options).unwrap_or_else(|error| panic!("{error}"));
    for forbidden in ["http", "<script", "src=", "url(", "@import", "<link"] {
        assert!(!html.contains(forbidden), "{forbidden} in the page");
    }
    let ids: Vec<&str> = document.descendants().filter_map(|node| node.attribute("id")).collect();
    assert_eq!(ids, ["what-is-left", "what-is-left-2", "section"]);
    let links = document.descendants().filter_map(|node| node.attribute("href"));
    assert_eq!(links.map(|link| link.trim_start_matches('#')).collect::<Vec<_>>(), ids);
    let codes: Vec<&str> = document
        .descendants()
        .filter(|node| node.has_tag_name("code"))
        .filter_map(|n| n.text())
        .collect();
    let said = [
        "x",
        "anhyst paper --out <DIR>",
        "if a < b && c { }\n",
        "anhyst paper --out \"my <dir>\"",
    ];
    assert_eq!(codes, said);
    assert!(html.contains("a lone ` stays."));
    let picture = document.descendants().find(|node| node.has_tag_name("svg")).unwrap();
    assert_eq!(
        picture.attribute("aria-label"),
        Some("Loops before & after \"the fix\"")
    );
}

#[test]
fn numbers_stand_right_and_verdicts_are_not_told_by_colour_alone() {
    let html = page().html();
    assert!(html.contains(
        "<th scope=\"col\">law</th><th scope=\"col\" class=\"number\">a, A/m</th><th scope=\"col\">held</th>"
    ));
    assert!(html.contains("<td>folded &lt;i&gt;</td><td class=\"number\">7012.3</td>"));
    assert!(html.contains("<td class=\"number\">−3.5e1</td>"));
    assert!(html.contains("<span class=\"badge pass\">✓ within 1 A/m</span>"));
    assert!(html.contains("<span class=\"badge fail\">✗ no</span>"));
    for (value, text) in [
        (7012.0, "7012.0"),
        (-0.0421, "−0.042100"),
        (2.136e-10, "2.1360e−10"),
        (0.0, "0"),
    ] {
        assert_eq!(Cell::from(value), Cell::Number(text.to_owned()));
    }
    for (text, number) in [
        ("20.1 nm", true),
        ("≤ 0.5 %", true),
        ("−3", true),
        ("case01", false),
        ("a 3", false),
    ] {
        assert_eq!(matches!(Cell::from(text), Cell::Number(_)), number, "{text}");
    }
}
