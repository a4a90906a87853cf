//! Fig. 7: the matrix law (20)-(21) on the rod (13): estimate and error; as printed (ΣB = 0), and integrated explicitly as in the paper.

use super::figure::{Figure, MEMBERS, Points, RANGE_A_PER_M, START_A_PER_M, TRUTH_A_PER_M, finding, refused};
use anhyst_estimator::{Covers, Grid, Matrix, MatrixConstants, Mode, Modes};
use anhyst_launch::error::RunError;
use anhyst_model::{Anhysteretic, Bank, Hysteresis, RodState, TwoPole, TwoPolePropagator};
use anhyst_report::chart::{Chart, Curve, TIME};

/// The paper's w, k̂ and ĉ.
const ROD: TwoPole = TwoPole {
    gain: 1.3724e-2,
    damping_per_s: 7.8899e3,
    stiffness_per_s2: 6.4251e7,
    force_gain_per_kg: 0.0,
};
/// μ of the output z = ẏ + μy: any value between 0 and k̂ makes it strictly positive real.
const ZERO_PER_S: f64 = 4000.0;
const TICK_S: f64 = 5e-5;
const SECONDS: f64 = 3.0;
const PEAK_A_PER_M: f64 = 40e3;
/// Every so many ticks a point is drawn.
const DRAWN: u32 = 40;
/// dM/da where the ramp says most, A/m per A/m.
const SENSITIVITY: f64 = 30.0;

/// How the law is stepped.
enum Law {
    /// As this project does it.
    Exact(Box<Matrix>),
    /// Explicit Euler, as the paper.
    Explicit(Explicit),
}

struct Explicit {
    constants: MatrixConstants,
    covers: Covers,
    rod: RodState,
    shape_a_per_m: f64,
}

struct Run {
    shape: Points,
    error: Points,
    last: f64,
    /// How often the estimate turned round.
    turns: u32,
    /// Largest distance from the truth in the last third, A/m.
    late: f64,
}

pub fn figure() -> Result<Figure, RunError> {
    let (langevin, ising) = (Anhysteretic::Langevin, Anhysteretic::Ising);
    let of = |anhysteretic, start| run(anhysteretic, exact(start)?, start);
    let (on_langevin, on_ising) = (of(langevin, START_A_PER_M)?, of(ising, START_A_PER_M)?);
    let from_below = of(ising, 6400.0)?;
    let explicit = run(ising, explicit(), START_A_PER_M)?;
    let refusal = printed_output().map_or_else(|refusal| refusal.to_string(), |_| "accepted".to_owned());
    let off = |run: &Run| format!("{:.2}", run.last - TRUTH_A_PER_M);
    Ok(Figure {
        number: 7,
        title: "Matrix law: estimate and error".into(),
        paper_says: "â converges on the damped rod, moderately slower than in the scalar case; the step must be small, because the \
                     forcing at the next step is not known and jumps between the covers make the update oscillate."
            .into(),
        we_get: format!(
            "With the output z = ẏ + μy, of relative degree one, it converges at 20 kHz without oscillation: with a bank the forcing at the \
             next step is known for every a, so that the step is implicit and exact. With the displacement alone, as printed, the law is \
             refused: {refusal}"
        ),
        charts: vec![
            Chart::new("(a) estimate on the ramp", TIME, "â, A/m").series(vec![
                    Curve::of("Langevin", on_langevin.shape.clone()),
                    Curve::of("Ising", on_ising.shape.clone()),
                    Curve::of("Ising, as printed: Σ B = 0", vec![[0.0, START_A_PER_M], [SECONDS, START_A_PER_M]]).dashed(),
                    Curve::of("Ising, explicit integration", explicit.shape).dashed(),
                    Curve::of("truth", vec![[0.0, TRUTH_A_PER_M], [SECONDS, TRUTH_A_PER_M]]).dashed(),
                ]),
            Chart::new("(b) error on the ramp", TIME, "z̃, µm/s").series(vec![Curve::of("Langevin", on_langevin.error.clone()), Curve::of("Ising", on_ising.error.clone())]),
        ],
        findings: vec![
            finding("â from 6800, Langevin: off by, A/m", "\"7012\"", off(&on_langevin), "-212.00 (never moves)"),
            finding("â from 6800, Ising: off by, A/m", "\"7012\"", off(&on_ising), "-212.00 (never moves)"),
            finding("â from 6400, Ising: off by, A/m", "", off(&from_below), ""),
            finding(
                "largest error of â in the last second at 20 kHz, Ising, A/m",
                "\"highly oscillatory\"",
                format!("{:.2}", on_ising.late),
                &format!("{:.2} (explicit)", explicit.late),
            ),
            finding(
                "turns of â in 60 000 ticks, Ising",
                "",
                on_ising.turns.to_string(),
                &format!("{} (explicit)", explicit.turns),
            ),
        ],
    })
}

/// Both modes of the rod, seen by its displacement as in the paper.
fn printed_output() -> Result<Modes, anhyst_estimator::EstimatorError> {
    let half = 0.5 * ROD.damping_per_s;
    let omega = (ROD.stiffness_per_s2 - half * half).sqrt();
    let modes = [1.0, -1.0].map(|sign| {
        let eigenvalue_per_s = num_complex::Complex64::new(-half, sign * omega);
        let input = ROD.gain / num_complex::Complex64::new(0.0, 2.0 * sign * omega);
        Mode {
            eigenvalue_per_s,
            input,
        }
    });
    Modes::new(&modes)
}

/// ε is 0.1 A/m where the ramp says most, and γ follows 200 times a second there. [`Modes::of_rod`] has z in metres, y + ẏ/μ, for an input
/// in displacements at rest.
fn constants(start_a_per_m: f64) -> MatrixConstants {
    let per_a_per_m = SENSITIVITY * ROD.dc_gain();
    MatrixConstants {
        start_a_per_m,
        dead_zone: 0.1 * per_a_per_m,
        gain: 200.0 / (per_a_per_m * per_a_per_m),
        window_a_per_m: None,
    }
}

fn exact(start_a_per_m: f64) -> Result<Law, RunError> {
    let modes = Modes::of_rod(&ROD, ZERO_PER_S).map_err(refused)?;
    let law = Matrix::new(&modes, constants(start_a_per_m), MEMBERS, TICK_S).map_err(refused)?;
    Ok(Law::Exact(Box::new(law)))
}

fn explicit() -> Law {
    Law::Explicit(Explicit {
        constants: constants(START_A_PER_M),
        covers: Covers::with_members(MEMBERS),
        rod: RodState::default(),
        shape_a_per_m: START_A_PER_M,
    })
}

impl Explicit {
    fn correct(&mut self, grid: &Grid, inputs: &[f64], measured: f64) -> [f64; 2] {
        let thetas = grid.shapes_a_per_m();
        self.covers.update(thetas, inputs);
        let error = self.rod.displacement_m + self.rod.velocity_m_per_s / ZERO_PER_S - measured;
        let cover = if error > 0.0 {
            self.covers.lower_at(thetas, inputs, self.shape_a_per_m)
        } else {
            self.covers.upper_at(thetas, inputs, self.shape_a_per_m)
        };
        let zone = self.constants.dead_zone;
        let predicted = grid.linear(inputs, self.shape_a_per_m);
        let injected = (predicted - cover.value).abs() * (error / zone).clamp(-1.0, 1.0);
        let outside = error - error.clamp(-zone, zone);
        let RodState {
            displacement_m,
            velocity_m_per_s,
        } = self.rod;
        let acceleration =
            ROD.stiffness_per_s2 * (predicted - injected - displacement_m) - ROD.damping_per_s * velocity_m_per_s;
        self.rod = RodState {
            displacement_m: displacement_m + TICK_S * velocity_m_per_s,
            velocity_m_per_s: velocity_m_per_s + TICK_S * acceleration,
        };
        self.shape_a_per_m = grid.project(self.shape_a_per_m - self.constants.gain * TICK_S * outside * cover.slope);
        [self.shape_a_per_m, error]
    }
}

impl Law {
    /// θ̂ (A/m) and z̃ (m).
    fn correct(&mut self, grid: &Grid, inputs: &[f64], measured: f64) -> [f64; 2] {
        match self {
            Law::Exact(law) => {
                let found = law.correct(grid, inputs, measured);
                [found.shape_a_per_m, found.output_error_m]
            }
            Law::Explicit(law) => law.correct(grid, inputs, measured),
        }
    }
}

fn run(anhysteretic: Anhysteretic, mut law: Law, start_a_per_m: f64) -> Result<Run, RunError> {
    let grid = Grid::new(RANGE_A_PER_M.0, RANGE_A_PER_M.1, MEMBERS);
    let base = Hysteresis {
        anhysteretic,
        ..Hysteresis::terfenol_d()
    };
    let mut bank = Bank::new(base, grid.shapes_a_per_m()).map_err(refused)?;
    let mut material = Bank::new(base, &[TRUTH_A_PER_M]).map_err(refused)?;
    let propagator = TwoPolePropagator::new(ROD, TICK_S).map_err(refused)?;
    let (mut rod, mut acceleration) = (RodState::default(), 0.0);
    let mut inputs = [0.0; MEMBERS];
    let mut run = Run {
        shape: vec![[0.0, start_a_per_m]],
        error: Vec::new(),
        last: start_a_per_m,
        turns: 0,
        late: 0.0,
    };
    let mut last_step = 0.0;
    for tick in 1..=(SECONDS / TICK_S).round() as u32 {
        let time_s = f64::from(tick) * TICK_S;
        let field = PEAK_A_PER_M * time_s / SECONDS;
        bank.advance(field);
        material.advance(field);
        let reached = ROD.gain * material.magnetizations()[0];
        rod = propagator.advance(rod, acceleration, reached);
        acceleration = reached;
        for (input, magnetization) in inputs.iter_mut().zip(bank.magnetizations()) {
            *input = ROD.dc_gain() * magnetization;
        }
        let measured = rod.displacement_m + rod.velocity_m_per_s / ZERO_PER_S;
        let [shape, error] = law.correct(&grid, &inputs, measured);
        let step = shape - run.last;
        run.turns += u32::from(step * last_step < 0.0);
        last_step = if step == 0.0 { last_step } else { step };
        run.last = shape;
        if time_s > 2.0 / 3.0 * SECONDS {
            run.late = run.late.max((shape - TRUTH_A_PER_M).abs());
        }
        if tick % DRAWN == 0 {
            run.shape.push([time_s, shape]);
            run.error.push([time_s, error * ZERO_PER_S * 1e6]);
        }
    }
    Ok(run)
}
