//! Fig. 4: a function with its convex and its concave cover; once drawn freely, once as the bank gives it.

use super::figure::{Figure, MEMBERS, Points, RANGE_A_PER_M, finding, refused};
use anhyst_estimator::{Covers, Grid};
use anhyst_launch::error::RunError;
use anhyst_model::{Anhysteretic, Bank, Hysteresis};
use anhyst_report::chart::{Chart, Curve};

/// Where the Ising curve's M is convex over one part of Θ and concave over the other.
const FIELD_A_PER_M: f64 = 18.2e3;
const DRAWN: usize = 401;

pub fn figure() -> Result<Figure, RunError> {
    let (lower, upper) = RANGE_A_PER_M;
    let drawn = Grid::new(0.0, 10.0, DRAWN);
    let wavy: Vec<f64> = drawn
        .shapes_a_per_m()
        .iter()
        .map(|&x| (0.9 * x).sin() + 0.08 * (x - 5.0) * (x - 5.0))
        .collect();
    let free = covered(&drawn, &wavy, |theta| theta);

    let grid = Grid::new(lower, upper, MEMBERS);
    let base = Hysteresis {
        anhysteretic: Anhysteretic::Ising,
        ..Hysteresis::terfenol_d()
    };
    let mut bank = Bank::new(base, grid.shapes_a_per_m()).map_err(refused)?;
    for step in 1..=((FIELD_A_PER_M / 200.0) as i32) {
        bank.advance(200.0 * f64::from(step));
    }
    let chord = less_chord(&grid, bank.magnetizations());
    let hull = covered(&grid, &chord, |shape| shape * 1e-3);
    let widest = |curves: &[Curve]| {
        let gaps = curves[1]
            .points
            .iter()
            .zip(&curves[2].points)
            .map(|(low, high)| high[1] - low[1]);
        gaps.fold(0.0_f64, f64::max)
    };
    let gap = widest(&hull);
    Ok(Figure {
        number: 4,
        title: "Convex and concave cover of f(u, θ)".into(),
        paper_says: "(16) and (17): the cover is f where f is concave (convex) in the sense of Definition 1, and a chord elsewhere.".into(),
        we_get: "Covers of a bank are its lower and upper convex hulls, built in one pass over the members. Below: the bank's own f at \
                 18.2 kA/m, less its chord over Θ because the bend is small against the slope."
            .into(),
        charts: vec![
            Chart::new("any f with its covers", "θ", "f(θ)").series(free),
            Chart::new("M(u, a) of the Ising curve at 18.2 kA/m, less its chord", "a, kA/m", "A/m").series(hull),
        ],
        findings: vec![finding(
            "widest gap between the covers of M over Θ at 18.2 kA/m, A/m",
            "",
            format!("{gap:.2}"),
            "",
        )],
    })
}

fn less_chord(grid: &Grid, values: &[f64]) -> Vec<f64> {
    let (shapes, last) = (grid.shapes_a_per_m(), values.len() - 1);
    let slope = (values[last] - values[0]) / (shapes[last] - shapes[0]);
    let chord = |shape: f64| values[0] + slope * (shape - shapes[0]);
    shapes
        .iter()
        .zip(values)
        .map(|(&shape, value)| value - chord(shape))
        .collect()
}

/// f, lower cover, upper cover.
fn covered(grid: &Grid, values: &[f64], abscissa: impl Fn(f64) -> f64) -> Vec<Curve> {
    let thetas = grid.shapes_a_per_m();
    let mut covers = Covers::with_members(thetas.len());
    covers.update(thetas, values);
    let along = |value: &dyn Fn(usize) -> f64| -> Points {
        (0..thetas.len()).map(|j| [abscissa(thetas[j]), value(j)]).collect()
    };
    vec![
        Curve::of("f", along(&|j| values[j])),
        Curve::of(
            "convex cover",
            along(&|j| covers.lower_at(thetas, values, thetas[j]).value),
        ),
        Curve::of(
            "concave cover",
            along(&|j| covers.upper_at(thetas, values, thetas[j]).value),
        ),
    ]
}
