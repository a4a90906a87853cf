//! A page from made-up data: `cargo run -p anhyst-report --example decomposition > page.html`.

use anhyst_report::decomposition::{Candidate, Decomposition, Kind, Part, Run, Value};
use anhyst_report::page::Page;

const TICK_S: f64 = 5e-5;

fn main() {
    let rows = 40_000;
    let at = |row: usize| row as f64 * TICK_S;
    let made = |of: &dyn Fn(f64) -> f64| (0..rows).map(|row| of(at(row))).collect::<Vec<f64>>();
    let turn = std::f64::consts::TAU;
    let field = made(&|t| 8e3 * (turn * 50.0 * t).sin() * (0.6 + 0.4 * (turn * 0.7 * t).cos()));
    let nominal: Vec<f64> = (0..rows)
        .map(|row| 40e-6 * (field[row] / 5e3).tanh() + 4e-6 * (turn * 50.0 * at(row)).cos())
        .collect();
    let creep = made(&|t| 2.4e-6 * (1.0 - (-t / 0.4).exp()));
    let eddy = made(&|t| 1.1e-6 * (turn * 50.0 * t - 0.4).cos());
    let hum = made(&|t| 15e-9 * (turn * 50.31 * t).sin());
    let zero = made(&|t| 0.2e-6 * t);
    let mut state = 1_u64;
    let noise: Vec<f64> = (0..rows)
        .map(|_| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            20e-9 * ((state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0)
        })
        .collect();
    let sum = |of: &[&[f64]]| -> Vec<f64> { (0..rows).map(|row| of.iter().map(|own| own[row]).sum()).collect() };
    let (amended, nuisance) = (sum(&[&nominal, &creep, &eddy]), sum(&[&hum, &zero]));
    let measured = sum(&[&amended, &nuisance, &noise]);
    let value = |name, unit, value, deviation: f64, nominal| Value {
        name,
        unit,
        value,
        standard_deviation: Some(deviation),
        nominal,
    };
    let part = |name, kind, share, values| Part {
        name,
        kind,
        share,
        share_alone: Some(0.9 * share),
        over_field: name == "eddy currents",
        values,
    };
    let gap = Decomposition {
        unit: "m",
        gap_rms: 2.12e-6,
        remainder_rms: 11.6e-9,
        noise_rms: 11e-9,
        parts: vec![
            part(
                "creep",
                Kind::Effect,
                0.78,
                vec![
                    value("time", "s", 0.4003, 0.002, Some(1.0)),
                    value("size", "m", 2.4e-6, 4e-9, None),
                ],
            ),
            part(
                "eddy currents",
                Kind::Effect,
                0.17,
                vec![value("delay", "s", 1.27e-3, 8e-6, None)],
            ),
            part(
                "zero drift",
                Kind::Nuisance,
                0.03,
                vec![value("rate", "m/s", 2e-7, 1e-9, None)],
            ),
            part("hum at 50.31 Hz", Kind::Nuisance, 0.012, vec![]),
        ],
        remainder_share: 0.008,
        runs: vec![Run {
            name: "made.csv",
            tick_s: Some(TICK_S),
            field_a_per_m: &field,
            measured: &measured,
            nominal: &nominal,
            amended: &amended,
            nuisance: &nuisance,
            contributions: vec![&creep, &eddy, &zero, &hum],
        }],
        candidates: vec![
            Candidate {
                name: "creep + eddy currents",
                left_rms: 11.6e-9,
                chosen: true,
                note: "the answer",
            },
            Candidate {
                name: "creep",
                left_rms: 0.8e-6,
                chosen: false,
                note: "ln evidence −8200",
            },
            Candidate {
                name: "backlash",
                left_rms: 1.9e-6,
                chosen: false,
                note: "",
            },
        ],
    };
    let mut page = Page::new(
        "A gap, taken apart",
        "Made-up data: `creep` and eddy currents under drift and hum.",
    );
    page.sections = gap.sections();
    print!(
        "{}",
        page.command("cargo run -p anhyst-report --example decomposition")
            .html()
    );
}
