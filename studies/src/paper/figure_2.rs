//! Fig. 2: (a) anhysteretic and (b) total magnetization; with the printed (7) beside the derived one.

use super::figure::{Figure, Points, finding};
use anhyst_launch::error::RunError;
use anhyst_model::{Anhysteretic, Hysteresis, MagneticState};
use anhyst_report::chart::{Chart, Curve};

const PEAK_A_PER_M: f64 = 30e3;
const STEP_A_PER_M: f64 = 50.0;
/// The printed slope is marched with steps this much finer: a classical fourth-order rule that knows no switch.
const FINE: usize = 20;
const KILO: f64 = 1e-3;

pub fn figure() -> Result<Figure, RunError> {
    let material = Hysteresis::terfenol_d();
    let ising = Hysteresis {
        anhysteretic: Anhysteretic::Ising,
        ..material
    };
    let scaled = ising.with_shape(3.0 * ising.shape_a_per_m);
    let derived = total(&material);
    let printed = total_as_printed(&material);
    let largest = derived.iter().fold(0.0_f64, |most, point| most.max(point[1].abs()));
    let apart = derived
        .iter()
        .zip(&printed)
        .fold(0.0_f64, |most, (one, other)| most.max((one[1] - other[1]).abs()));
    let remanence = derived
        .windows(2)
        .rev()
        .find(|pair| pair[0][0] < 0.0 && pair[1][0] >= 0.0)
        .map_or(0.0, |pair| pair[1][1]);
    let reached = 100.0 * largest * 1e3 / material.saturation_magnetization_a_per_m;
    Ok(Figure {
        number: 2,
        title: "Anhysteretic and total magnetization".into(),
        paper_says: "(1) and (2) are equivalent to third order; (3)-(7) add domain wall losses.".into(),
        we_get: "The same shapes. With the same a the two anhysteretic curves differ by a factor of 3 in slope; they are equal up to \
                 third order only when (2) takes three times the a of (1). The printed sign in (7) bends the whole loop."
            .into(),
        charts: vec![
            Chart::new("(a) anhysteretic magnetization", "field H, kA/m", "Man, kA/m").series(vec![
                    Curve::of("Langevin (1), a = 7012 A/m", anhysteretic(&material)),
                    Curve::of("Ising (2), a = 7012 A/m", anhysteretic(&ising)),
                    Curve::of("Ising (2), a = 3 × 7012 A/m", anhysteretic(&scaled)).dashed(),
                ]),
            Chart::new("(b) total magnetization", "field H, kA/m", "M, kA/m").series(vec![
                    Curve::of("derived slope", derived.clone()),
                    Curve::of("slope as printed in (7)", printed).dashed(),
                    Curve::of("anhysteretic", anhysteretic(&material)).dashed(),
                ]),
        ],
        findings: vec![
            finding(
                "slope of (2) over that of (1) at zero, same a",
                "1 (\"equivalent\")",
                format!("{:.6}", ising.initial_susceptibility() / material.initial_susceptibility()),
                "",
            ),
            finding("magnetization at 30 kA/m, % of Ms", "", format!("{reached:.2}"), ""),
            finding("remanence on the closing branch, kA/m", "", format!("{:.2}", remanence.abs()), ""),
            finding(
                "largest distance of the loop with the printed (7), % of its largest M",
                "",
                "0 (derived)".into(),
                &format!("{:.2}", 100.0 * apart / largest),
            ),
        ],
    })
}

/// Man over H with its own magnetization in the effective field: H = a·x − α·Ms·curve(x) for every x.
fn anhysteretic(material: &Hysteresis) -> Points {
    let of = |x: f64| {
        let magnetization = material.saturation_magnetization_a_per_m * material.anhysteretic.value(x);
        let field = material.shape_a_per_m * x - material.coupling * magnetization;
        [field * KILO, magnetization * KILO]
    };
    (-1200..=1200)
        .map(|step| of(0.01 * f64::from(step)))
        .filter(|point| point[0].abs() <= PEAK_A_PER_M * KILO)
        .collect()
}

/// Up from zero, then once around.
fn course() -> Vec<f64> {
    let quarter = (PEAK_A_PER_M / STEP_A_PER_M) as i64;
    let up = 1..=quarter;
    let down = (-quarter..quarter).rev();
    let back = (-quarter + 1)..=quarter;
    up.chain(down)
        .chain(back)
        .map(|step| step as f64 * STEP_A_PER_M)
        .collect()
}

fn total(material: &Hysteresis) -> Points {
    let mut state = MagneticState::default();
    let follow = |field: f64| {
        state = material.advance(state, field);
        [field * KILO, state.magnetization_a_per_m * KILO]
    };
    course().into_iter().map(follow).collect()
}

fn total_as_printed(material: &Hysteresis) -> Points {
    let mut state = MagneticState::default();
    let follow = |field: f64| {
        let step = (field - state.field_a_per_m) / FINE as f64;
        let slope = |ahead: f64, magnetization: f64| {
            let there = MagneticState {
                field_a_per_m: state.field_a_per_m + ahead,
                magnetization_a_per_m: magnetization,
            };
            material.slope_as_printed(there, step > 0.0)
        };
        let mut magnetization = state.magnetization_a_per_m;
        for fine in 0..FINE {
            let at = fine as f64 * step;
            let first = slope(at, magnetization);
            let second = slope(at + 0.5 * step, magnetization + 0.5 * step * first);
            let third = slope(at + 0.5 * step, magnetization + 0.5 * step * second);
            let fourth = slope(at + step, magnetization + step * third);
            magnetization += step / 6.0 * (first + 2.0 * (second + third) + fourth);
        }
        state = MagneticState {
            field_a_per_m: field,
            magnetization_a_per_m: magnetization,
        };
        [field * KILO, magnetization * KILO]
    };
    course().into_iter().map(follow).collect()
}
