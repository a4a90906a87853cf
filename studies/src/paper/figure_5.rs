//! Fig. 5: (a) the integrand of (19) for θ̂ = 6800 and θ = 7012 A/m on the ramp; (b) the convexity of M(u, a) in `a`.

use super::figure::{Figure, MEMBERS, Points, RANGE_A_PER_M, START_A_PER_M, TRUTH_A_PER_M, finding, refused};
use anhyst_estimator::Grid;
use anhyst_launch::error::RunError;
use anhyst_model::{Anhysteretic, Bank, Hysteresis};
use anhyst_report::chart::{Chart, Curve};

const PEAK_A_PER_M: f64 = 40e3;
const STEPS: u32 = 400;

/// What one anhysteretic curve gives along the ramp.
struct Seen {
    /// f(û) − f(θ), kA/m.
    difference: Points,
    /// Smallest second difference of M over Θ, A/m.
    least_bend: Points,
    /// Largest.
    most_bend: Points,
}

pub fn figure() -> Result<Figure, RunError> {
    let langevin = along_the_ramp(Anhysteretic::Langevin)?;
    let ising = along_the_ramp(Anhysteretic::Ising)?;
    let convex_to = |seen: &Seen| {
        seen.least_bend
            .iter()
            .take_while(|point| point[1] > 0.0)
            .last()
            .map(|point| point[0])
    };
    let concave_from = |seen: &Seen| seen.most_bend.iter().find(|point| point[1] < 0.0).map(|point| point[0]);
    let said = |place: Option<f64>| place.map_or_else(|| "nowhere".to_owned(), |field| format!("{field:.1}"));
    let positive = |seen: &Seen| seen.difference.iter().all(|point| point[1] > 0.0);
    Ok(Figure {
        number: 5,
        title: "Excitation: the integrand of (19), and the convexity of M(u, a)".into(),
        paper_says: "On the ramp the integrand stays positive while M switches its convexity.".into(),
        we_get: "The integrand stays positive with either curve. The switch exists with the Ising curve (2) only; with Langevin (1) \
                 M is convex in a all along the ramp, so that of the two conditions after (19) neither can be met from above the truth."
            .into(),
        charts: vec![
            Chart::new("(a) f(6800) − f(7012)", "field H, kA/m", "kA/m").series(vec![Curve::of("Langevin", langevin.difference.clone()), Curve::of("Ising", ising.difference.clone())]),
            Chart::new("(b) second difference of M over Θ", "field H, kA/m", "A/m").series(vec![
                    Curve::of("Langevin, least", langevin.least_bend.clone()),
                    Curve::of("Langevin, most", langevin.most_bend.clone()),
                    Curve::of("Ising, least", ising.least_bend.clone()),
                    Curve::of("Ising, most", ising.most_bend.clone()),
                ]),
        ],
        findings: vec![
            finding(
                "integrand positive on the whole ramp",
                "yes",
                format!("Langevin {}, Ising {}", yes(positive(&langevin)), yes(positive(&ising))),
                "",
            ),
            finding(
                "Ising: convex up to, concave from, kA/m",
                "switches",
                format!("{}, {}", said(convex_to(&ising)), said(concave_from(&ising))),
                "",
            ),
            finding(
                "Langevin: convex up to, concave from, kA/m",
                "switches",
                format!("{} (the end), {}", said(convex_to(&langevin)), said(concave_from(&langevin))),
                "",
            ),
        ],
    })
}

fn yes(is: bool) -> &'static str {
    if is { "yes" } else { "no" }
}

fn along_the_ramp(anhysteretic: Anhysteretic) -> Result<Seen, RunError> {
    let grid = Grid::new(RANGE_A_PER_M.0, RANGE_A_PER_M.1, MEMBERS);
    let base = Hysteresis {
        anhysteretic,
        ..Hysteresis::terfenol_d()
    };
    let mut bank = Bank::new(base, grid.shapes_a_per_m()).map_err(refused)?;
    let mut two = Bank::new(base, &[START_A_PER_M, TRUTH_A_PER_M]).map_err(refused)?;
    let mut seen = Seen {
        difference: Vec::new(),
        least_bend: Vec::new(),
        most_bend: Vec::new(),
    };
    for step in 1..=STEPS {
        let field = PEAK_A_PER_M * f64::from(step) / f64::from(STEPS);
        bank.advance(field);
        two.advance(field);
        let bends = bank.magnetizations().windows(3).map(|m| m[0] - 2.0 * m[1] + m[2]);
        let (least, most) = bends.fold((f64::INFINITY, f64::NEG_INFINITY), |(least, most), bend| {
            (least.min(bend), most.max(bend))
        });
        let shown = field * 1e-3;
        let pair = two.magnetizations();
        seen.difference.push([shown, (pair[0] - pair[1]) * 1e-3]);
        seen.least_bend.push([shown, least]);
        seen.most_bend.push([shown, most]);
    }
    Ok(seen)
}
