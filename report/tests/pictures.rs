//! Guards pictures and pages: well-formed, self-contained, escaped, and of a size that a browser opens.

use anhyst_report::chart::{Axis, Chart, Curve, Figure, Role};
use anhyst_report::page::{Bar, Bars, Block, Page, Section, Segment, Shares};
use anhyst_report::table::{Badge, Cell, Table, Verdict};

fn wave(samples: usize) -> Vec<(f64, f64)> {
    (0..samples)
        .map(|i| (i as f64 * 1e-4, 4e-5 * (i as f64 * 0.031).sin()))
        .collect()
}

fn figure(samples: usize) -> Figure {
    let time = || Axis::new("time", "s");
    let charts = vec![
        Chart::new("displacement", time(), Axis::new("displacement", "m"))
            .curve(Curve::new(wave(samples), Role::Measured).named("measured \"y\""))
            .curve(Curve::new(wave(samples), Role::Nominal).named("model").dashed())
            .horizontal(2e-5, Role::Limit, "limit 20 µm"),
        Chart::new(
            "gap",
            Axis::new("frequency", "Hz").logarithmic(),
            Axis::new("power", "m²").logarithmic(),
        )
        .curve(Curve::new(
            [(1.0, 1e-12), (0.0, 1.0), (100.0, f64::NAN), (10.0, 1e-15)],
            Role::Remainder,
        ))
        .band(
            vec![(1.0, 1e-13, 1e-12), (10.0, 1e-16, 1e-15)],
            Role::Amended,
            Some("±1σ"),
        ),
        Chart::new("nothing", time(), Axis::new("y", "")),
    ];
    Figure::new("before & after, <shown>", charts)
}

#[test]
fn a_figure_is_well_formed_and_says_what_was_given() {
    let svg = figure(2000).svg().unwrap();
    let document = roxmltree::Document::parse(&svg).unwrap_or_else(|error| panic!("{error}"));
    let root = document.root_element();
    assert_eq!(
        (root.attribute("width"), root.attribute("viewBox")),
        (Some("1280"), Some("0 0 5120 3496"))
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
    assert_eq!(svg, figure(2000).svg().unwrap(), "equal data must give equal bytes");
}

#[test]
fn a_long_series_makes_no_long_picture() {
    let (short, long) = (
        figure(20_000).svg().unwrap().len(),
        figure(1_000_000).svg().unwrap().len(),
    );
    assert!(short < 120_000 && long < 120_000, "{short} and {long} bytes");
}

/// The line must pass where the data are: the crest of the wave stands at the same height as a marker put there.
#[test]
fn values_stand_where_the_axis_says() {
    let chart = Chart::new(
        "",
        Axis::new("x", "").between(0.0, 10.0),
        Axis::new("y", "").between(0.0, 10.0),
    );
    let chart = chart.curve(Curve::new([(0.0, 0.0), (5.0, 5.0), (10.0, 5.0)], Role::Truth));
    let svg = Figure::new("", vec![chart.clone().horizontal(5.0, Role::Limit, "")])
        .svg()
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
    let beyond = Chart {
        curves: vec![Curve::new([(0.0, 20.0), (10.0, 20.0)], Role::Truth)],
        ..chart
    };
    assert!(!Figure::new("", vec![beyond]).svg().unwrap().contains("#009E73"));
}

fn page() -> Page {
    let table = Table::new(["law", "a, A/m", "held"])
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
        .figure(figure(3000), "Loops before & after \"the fix\"")
        .block(Block::Shares(Shares {
            caption: "of the energy".to_owned(),
            rows: vec![(
                "gap <1>".to_owned(),
                vec![
                    Segment::new("creep & co", 0.7, Role::Effect(0)),
                    Segment::new("remainder", 0.3, Role::Remainder),
                ],
            )],
        }))
        .block(Block::Bars(Bars {
            unit: "m".to_owned(),
            logarithmic: true,
            bars: [Some(3.1e-6), Some(31e-9), None]
                .map(|value| Bar {
                    name: "a \"model\"".to_owned(),
                    value,
                    role: Role::Nominal,
                    note: String::new(),
                })
                .to_vec(),
            limit: Some((20e-9, "noise".to_owned())),
            ..Bars::default()
        }))
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
    // The library names its home in a comment.
    let own = html.replace("/*! https://github.com/leeoniya/uPlot (v1.6.32) */", "");
    for forbidden in [
        "http",
        "src=",
        "url(",
        "@import",
        "<link",
        "fetch(",
        "XMLHttpRequest",
        "import(",
    ] {
        assert!(!own.contains(forbidden), "{forbidden} in the page");
    }
    assert!(
        html.contains("Copyright (c) 2022 Leon Sorokin"),
        "the library's licence goes with it"
    );
    let empty = Page::new("no charts", "").html();
    assert!(!empty.contains("<script"), "a page without charts needs no script");
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
    assert!(html.contains("Loops before &amp; after &quot;the fix&quot;"));
    // 0.06 of a bar is the smallest value, 1 the largest.
    assert!(html.contains("gap &lt;1&gt;") && html.contains("width:70.000%") && html.contains("3.100 µm"));
}

/// The data of a page's charts, as its script reads them.
fn chart_data(html: &str) -> Vec<serde_json::Value> {
    let parts = html.split("<script type=\"application/json\">").skip(1);
    parts
        .map(|part| serde_json::from_str(part.split("</script>").next().unwrap()).unwrap())
        .collect()
}

fn points(curve: &serde_json::Value) -> Vec<(f32, f32)> {
    use base64::Engine as _;
    let bytes = base64::engine::general_purpose::STANDARD
        .decode(curve["data"].as_str().unwrap())
        .unwrap();
    let values: Vec<f32> = bytes
        .chunks(4)
        .map(|four| f32::from_le_bytes(four.try_into().unwrap()))
        .collect();
    let (x, y) = values.split_at(values.len() / 2);
    x.iter().copied().zip(y.iter().copied()).collect()
}

/// Guards what the script is given: the values in the axis' unit, what colour they have, and that no word ends the script.
#[test]
fn a_charts_data_are_those_given_in_the_axis_unit() {
    let chart = Chart::new("</script> & <b>", "field, A/m", "displacement, m")
        .curve(Curve::new([(0.0, 0.0), (2e3, 1e-6), (1e3, 3e-6)], Role::Measured).named("up"))
        .curve(Curve::new([(0.0, 0.0), (2e3, 1e-6)], Role::Remainder));
    let page = Page::new("", "").section(Section::new("s").figure(Figure::new("", vec![chart]), ""));
    let [chart] = &chart_data(&page.html())[..] else {
        panic!("one chart")
    };
    assert_eq!(
        (&chart["x"]["label"], &chart["y"]["label"]),
        (&"field, kA/m".into(), &"displacement, µm".into())
    );
    assert_eq!(chart["title"], "</script> & <b>");
    let [up, left] = chart["curves"].as_array().unwrap().as_slice() else {
        panic!("two curves")
    };
    assert_eq!(points(up), [(0.0, 0.0), (2.0, 1.0), (1.0, 3.0)]);
    assert_eq!((&up["rising"], &left["rising"]), (&false.into(), &true.into()));
    assert_ne!(up["colour"], left["colour"]);
}

/// Guards the size of a page, and that thinning loses no extreme: 40 000 rows of five noisy curves.
#[test]
fn long_noisy_curves_make_no_long_page() {
    let mut state = 7_u64;
    let mut noise = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        (state >> 40) as f64
    };
    let curves = (0..5).map(|number| {
        let points: Vec<[f64; 2]> = (0..40_000)
            .map(|row| [f64::from(row) * 5e-5, if row == 31_415 { -9e8 } else { noise() }])
            .collect();
        Curve::of(&format!("{number}"), points)
    });
    let chart = Chart::new("", "time, s", "y").series(curves);
    let html = Page::new("", "")
        .section(Section::new("s").figure(Figure::new("", vec![chart]), ""))
        .html();
    assert!(html.len() < 800_000, "{} bytes", html.len());
    for curve in chart_data(&html)[0]["curves"].as_array().unwrap() {
        let points = points(curve);
        let lowest = points
            .iter()
            .copied()
            .filter(|point| !point.1.is_nan())
            .reduce(|one, other| if other.1 < one.1 { other } else { one });
        let (time, value) = lowest.unwrap();
        assert!(
            (time - 1.57075).abs() < 1e-6 && (value / -900.0 - 1.0).abs() < 1e-6,
            "{time} {value}"
        );
    }
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
}
