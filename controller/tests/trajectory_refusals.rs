//! Guards that numbers which make no trajectory are refused where they stand.

mod common;

use anhyst_controller::TrajectorySettings;
use common::TICK_S;
use ron::extensions::Extensions;

#[test]
fn what_cannot_be_run_is_refused_where_it_stands() {
    let options = ron::Options::default().with_default_extension(Extensions::UNWRAP_VARIANT_NEWTYPES);
    let check = |text: &str| {
        let settings: TrajectorySettings = options.from_str(text).unwrap_or_else(|error| panic!("{text}: {error}"));
        settings.validate(TICK_S).map_err(|refusal| refusal.path)
    };
    let steps = |levels: &str, over_s: f64| format!("Steps(levels_m: [{levels}], dwell_s: 0.01, over_s: {over_s})");
    let triangle = |turn: f64| format!("Triangle(amplitude_m: 1e-6, frequency_hz: 100.0, turn: {turn})");
    let sawtooth =
        |back: f64, turn: f64| format!("Sawtooth(amplitude_m: 1e-6, frequency_hz: 10.0, back: {back}, turn: {turn})");
    let raster = |turn_s: f64, more: &str| format!("Raster(length_m: 1e-6, line_s: 0.01, turn_s: {turn_s}{more})");
    let sweep = |to_hz: f64, more: &str| {
        format!("Sweep(amplitude_m: 1e-6, from_hz: 10.0, to_hz: {to_hz}, over_s: 2.0, spacing: Linear{more})")
    };
    let multisine = |lines: &str| format!("Multisine(amplitude_m: 1e-6, lines: {lines})");
    for good in [
        steps("0.0, 1e-6", 0.01),
        triangle(0.1),
        sawtooth(0.2, 0.1),
        raster(0.002, ""),
        sweep(400.0, ""),
        multisine("List([10.0, 20.0])"),
    ] {
        assert_eq!(check(&good), Ok(()), "{good}");
    }
    let cases = [
        (steps("0.0", 0.01), "levels_m"),
        (steps("0.0, 1e-6, 1e-6", 0.01), "levels_m.2"),
        (steps("0.0, NaN", 0.01), "levels_m.1"),
        // No limit and no time: a jump.
        (steps("0.0, 1e-6", 0.0), "levels_m.1"),
        (triangle(0.6), "turn"),
        // Three ticks.
        (triangle(0.015), "turn"),
        (sawtooth(0.2, 0.3), "turn"),
        (sawtooth(0.6, 0.1), "back"),
        (raster(1e-4, ""), "turn_s"),
        (raster(0.002, ", back_s: Some(0.02)"), "back_s"),
        (sweep(6000.0, ""), "to_hz"),
        (sweep(10.0, ""), "to_hz"),
        (sweep(400.0, ", taper_s: Some(1.1)"), "taper_s"),
        (multisine("List([10.0, 20.0, 10.0])"), "lines.2"),
        (multisine("List([])"), "lines"),
        (
            multisine("Grid(from_hz: 10.0, to_hz: 5.0, step_hz: 1.0)"),
            "lines.from_hz",
        ),
        (multisine("Grid(from_hz: 1.0, to_hz: 5000.0, step_hz: 1e-3)"), "lines"),
    ];
    for (text, path) in cases {
        assert_eq!(check(&text), Err(path.to_owned()), "{text}");
    }
}
