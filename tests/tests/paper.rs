//! Guards `anhyst paper` and `anhyst laws`: the page stands alone, and the paper's claims hold in the figures printed on it.

use anhyst_tests::{Finished, LIMIT};

#[test]
fn the_page_stands_alone_and_the_estimates_arrive() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().to_string_lossy();
    let finished = Finished::run(&["study", "paper", "--out", &out, "--json"], LIMIT).expect(0);
    let page = std::fs::read_to_string(folder.path().join("index.html")).unwrap();
    assert!(
        !page.contains("http://") || !page.contains("src=\"http"),
        "the page fetches something"
    );
    for figure in [2, 4, 5, 6, 7] {
        assert!(page.contains(&format!("Fig. {figure}:")), "figure {figure} is missing");
        assert!(folder.path().join(format!("figure-{figure}.svg")).is_file());
    }
    let found: serde_json::Value = serde_json::from_str(&finished.out).unwrap();
    let of = |figure: u64, what: &str| -> String {
        let figures = found.as_array().unwrap().iter().filter(|entry| entry[0] == figure);
        let mut findings = figures.flat_map(|entry| entry[1].as_array().unwrap());
        let finding = findings.find(|finding| finding["what"].as_str().unwrap().starts_with(what));
        finding.unwrap_or_else(|| panic!("no {what}"))["found"]
            .as_str()
            .unwrap()
            .to_owned()
    };
    for (figure, start, within) in [
        (6, "6800, Langevin", 1.0),
        (6, "6800, Ising", 1.0),
        (6, "6400, Langevin", 1.0),
    ] {
        let off: f64 = of(figure, &format!("â after the ramp from {start}")).parse().unwrap();
        assert!(off.abs() < within, "figure {figure} from {start}: {off} A/m");
    }
    for start in ["6800, Langevin", "6800, Ising", "6400, Ising"] {
        let off: f64 = of(7, &format!("â from {start}")).parse().unwrap();
        assert!(off.abs() < 2.0, "figure 7 from {start}: {off} A/m");
    }
    assert_eq!(of(5, "Ising: convex up to"), "17.4, 19.0");
}

#[test]
fn laws_are_compared() {
    let arguments = [
        "study",
        "laws",
        "--law",
        "folded,gauss-newton",
        "--excitation",
        "milling",
        "--noise-nm",
        "10",
        "--json",
    ];
    let finished = Finished::run(&arguments, LIMIT).expect(0);
    let entries: serde_json::Value = serde_json::from_str(&finished.out).unwrap();
    assert_eq!(entries.as_array().unwrap().len(), 4);
    for entry in entries.as_array().unwrap() {
        // Drifting by 200 A/m per second the lag stays below 5 A/m.
        assert!(entry["error_rms_a_per_m"].as_f64().unwrap() < 5.0, "{entry}");
    }
    let refused = Finished::run(&["study", "laws", "--law", "magic"], LIMIT).expect(2);
    assert!(
        refused.err.contains("possible values: folded, gauss-newton"),
        "{}",
        refused.err
    );
}
