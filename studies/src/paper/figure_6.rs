//! Fig. 6: the scalar law (14)-(18) on (23): â from 6800 to 7012 A/m, and the error; the same with errata left in.

use super::figure::{Figure, MEMBERS, Points, RANGE_A_PER_M, START_A_PER_M, TRUTH_A_PER_M, finding, refused};
use super::printed::{Erratum, PrintedScalar};
use anhyst_estimator::{Grid, Scalar, ScalarPlant, ScalarSettings};
use anhyst_launch::error::RunError;
use anhyst_model::{Anhysteretic, Bank, Hysteresis};
use anhyst_report::chart::{Chart, Curve, TIME};
use std::f64::consts::TAU;

const TICK_S: f64 = 1e-4;
const SECONDS: f64 = 3.0;
const PEAK_A_PER_M: f64 = 40e3;
/// Every so many ticks a point is drawn.
const DRAWN: u32 = 20;

/// Both laws on one motion.
enum Law {
    Derived(Scalar),
    Printed(PrintedScalar),
}

/// What a run drew and where it ended.
struct Run {
    shape: Points,
    error: Points,
    last: f64,
    /// Sum of all steps upwards of V = ỹ_ε² + θ̃²/γ, over V at the start.
    growth: f64,
}

fn ramp(time_s: f64) -> f64 {
    PEAK_A_PER_M * time_s / SECONDS
}

fn sine(time_s: f64) -> f64 {
    PEAK_A_PER_M * (TAU * time_s).sin()
}

pub fn figure() -> Result<Figure, RunError> {
    let (langevin, ising) = (Anhysteretic::Langevin, Anhysteretic::Ising);
    let from = START_A_PER_M;
    let on_ramp = run(langevin, ramp, from, None)?;
    let on_ramp_ising = run(ising, ramp, from, None)?;
    let printed_ramp = run(langevin, ramp, from, Some(Erratum::Pairing))?;
    let argument_ramp = run(ising, ramp, from, Some(Erratum::Argument))?;
    let on_sine = run(langevin, sine, from, None)?;
    let printed_sine = run(langevin, sine, from, Some(Erratum::Pairing))?;
    let off = |run: &Run| format!("{:.2}", run.last - TRUTH_A_PER_M);
    let mut findings = vec![
        finding(
            "â after the ramp from 6800, Langevin: off by, A/m",
            "\"7012\"",
            off(&on_ramp),
            &format!("{} (covers)", off(&printed_ramp)),
        ),
        finding(
            "â after the ramp from 6800, Ising: off by, A/m",
            "\"7012\"",
            off(&on_ramp_ising),
            &format!("{} (sat)", off(&argument_ramp)),
        ),
        finding(
            "â after a sine from 6800, Langevin: off by, A/m",
            "",
            off(&on_sine),
            &format!("{} (covers)", off(&printed_sine)),
        ),
        finding(
            "growth of the Lyapunov function on the ramp, Ising, share of its start",
            "0",
            format!("{:.1e}", on_ramp_ising.growth),
            &format!("{:.1e} (sat)", argument_ramp.growth),
        ),
    ];
    for start in [6400.0, 7250.0] {
        for (anhysteretic, name) in [(langevin, "Langevin"), (ising, "Ising")] {
            let reached = run(anhysteretic, ramp, start, None)?;
            findings.push(finding(
                &format!("â after the ramp from {start}, {name}: off by, A/m"),
                "",
                off(&reached),
                "",
            ));
        }
    }
    Ok(Figure {
        number: 6,
        title: "Scalar law: estimate and error".into(),
        paper_says: "â converges quickly from 6800 to 7012; ỹ stays within ε.".into(),
        we_get: "It does, on the ramp and on a sine. From above the truth it does so only where the convexity switches (Ising): with \
                 Langevin condition (19) does not hold there, as the excitation monitor says. With the covers paired as (18) prints them, \
                 or with ŷ in sat(), the estimate ends elsewhere."
            .into(),
        charts: vec![
            Chart::new("(a) estimate on the ramp", TIME, "â, A/m").series(vec![
                    Curve::of("Langevin", on_ramp.shape),
                    Curve::of("Ising", on_ramp_ising.shape),
                    Curve::of("Langevin, covers as printed in (18)", printed_ramp.shape).dashed(),
                    Curve::of("Ising, sat(ŷ/ε) as printed", argument_ramp.shape).dashed(),
                    Curve::of("truth", vec![[0.0, TRUTH_A_PER_M], [SECONDS, TRUTH_A_PER_M]]).dashed(),
                ]),
            Chart::new("(b) error on the ramp", TIME, "ỹ, A s/m").series(vec![Curve::of("Langevin", on_ramp.error), Curve::of("Ising", on_ramp_ising.error)]),
            Chart::new("estimate on a sine of 1 Hz", TIME, "â, A/m").series(vec![
                    Curve::of("Langevin", on_sine.shape),
                    Curve::of("Langevin, covers as printed in (18)", printed_sine.shape).dashed(),
                    Curve::of("truth", vec![[0.0, TRUTH_A_PER_M], [SECONDS, TRUTH_A_PER_M]]).dashed(),
                ]),
        ],
        findings,
    })
}

fn run(
    anhysteretic: Anhysteretic,
    field: fn(f64) -> f64,
    start_a_per_m: f64,
    erratum: Option<Erratum>,
) -> Result<Run, RunError> {
    let settings = ScalarSettings {
        start_a_per_m,
        decay_per_s: 1000.0,
        dead_zone: 0.002,
        gain: 500.0,
    };
    let base = Hysteresis {
        anhysteretic,
        ..Hysteresis::terfenol_d()
    };
    let grid = Grid::new(RANGE_A_PER_M.0, RANGE_A_PER_M.1, MEMBERS);
    let mut bank = Bank::new(base, grid.shapes_a_per_m()).map_err(refused)?;
    let mut material = Bank::new(base, &[TRUTH_A_PER_M]).map_err(refused)?;
    let mut plant = ScalarPlant::new(settings.decay_per_s);
    let mut law = match erratum {
        None => Law::Derived(Scalar::new(settings, MEMBERS, TICK_S)),
        Some(erratum) => Law::Printed(PrintedScalar::new(erratum, settings, MEMBERS, TICK_S)),
    };
    let mut run = Run {
        shape: vec![[0.0, start_a_per_m]],
        error: Vec::new(),
        last: start_a_per_m,
        growth: 0.0,
    };
    let lyapunov = |shape: f64, error: f64| {
        let outside = error - error.clamp(-settings.dead_zone, settings.dead_zone);
        outside * outside + (shape - TRUTH_A_PER_M).powi(2) / settings.gain
    };
    let first = lyapunov(start_a_per_m, 0.0);
    let mut before = first;
    for tick in 1..=(SECONDS / TICK_S) as u32 {
        let time_s = f64::from(tick) * TICK_S;
        bank.advance(field(time_s));
        material.advance(field(time_s));
        let observed = plant.advance(material.magnetizations()[0], TICK_S);
        let [shape, error] = match &mut law {
            Law::Derived(law) => {
                let found = law.correct(&grid, bank.magnetizations(), observed);
                [found.shape_a_per_m, found.output_error_m]
            }
            Law::Printed(law) => law.correct(&grid, bank.magnetizations(), observed),
        };
        if tick % DRAWN == 0 {
            run.shape.push([time_s, shape]);
            run.error.push([time_s, error]);
        }
        run.last = shape;
        let now = lyapunov(shape, error);
        run.growth += (now - before).max(0.0) / first;
        before = now;
    }
    Ok(run)
}
