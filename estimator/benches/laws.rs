//! Time of one correction of every law, of the excitation monitor and of both covers, as a share of the bank's step.
//!
//! `cargo bench --workspace --bench laws`. The bank has 32 members and is driven at 20 kHz, so a law has one
//! tick's budget beside it; the aim is a law below a tenth of the bank. Shares carry over between machines better than
//! nanoseconds do. The laws see what they would see in the loop: displacements of the bank through the paper's rod and
//! a true shape that moves. Least of several rounds, so that a busy machine disturbs little.

use anhyst_estimator::{
    AnyLaw, Covers, ExcitationMonitor, ExcitationSettings, GaussNewtonSettings, Grid, Law, LawSettings, MinMaxSettings,
    Prediction,
};
use anhyst_model::{Bank, Material, RodState, TwoPole, TwoPolePropagator};
use std::hint::black_box;
use std::time::Instant;

const MEMBERS: usize = 32;
const TICK_S: f64 = 5e-5;
/// Ten periods of 50 Hz.
const TICKS: usize = 4000;
const ROUNDS: usize = 150;

/// ±40 µm at 50 Hz and 30 % at 150 Hz, roughly, A/m.
fn field(tick: usize) -> f64 {
    let angle = 2.0 * std::f64::consts::PI * 50.0 * TICK_S * tick as f64;
    9000.0 * (angle.sin() + 0.3 * (3.0 * angle).sin())
}

/// What is timed: a name and what it does in a tick.
type Timed<'a> = (&'static str, Box<dyn FnMut(usize) + 'a>);

/// Nanoseconds per tick of each, least of the rounds. All take turns in a round, so that a machine that is now faster
/// and now slower disturbs their shares little.
fn time_per_tick(timed: &mut [Timed<'_>]) -> Vec<f64> {
    let mut least = vec![f64::INFINITY; timed.len()];
    for _ in 0..ROUNDS {
        for ((_, step), least) in timed.iter_mut().zip(&mut least) {
            let start = Instant::now();
            for tick in 0..TICKS {
                step(black_box(tick));
            }
            *least = least.min(start.elapsed().as_nanos() as f64 / TICKS as f64);
        }
    }
    least
}

/// The bank's outputs, tick by tick, and the measurement of a rod whose shape goes from 6400 to 7200 A/m.
struct Course {
    grid: Grid,
    strains: Vec<Vec<f64>>,
    displacements_m: Vec<Vec<f64>>,
    measured_m: Vec<f64>,
}

fn rod(material: &Material) -> TwoPole {
    TwoPole {
        gain: 1.3724e-2 / material.strain_per_magnetization(),
        damping_per_s: 7.8899e3,
        stiffness_per_s2: 6.4251e7,
        force_gain_per_kg: 0.0,
    }
}

fn course(material: &Material) -> Course {
    let grid = Grid::new(6300.0, 7300.0, MEMBERS);
    let mut bank = Bank::new(material.hysteresis, grid.shapes_a_per_m()).expect("valid bank");
    let propagator = TwoPolePropagator::new(rod(material), TICK_S).expect("valid rod");
    let (mut rods, mut accelerations) = (vec![RodState::default(); MEMBERS], vec![0.0; MEMBERS]);
    let mut course = Course {
        strains: Vec::new(),
        displacements_m: Vec::new(),
        measured_m: Vec::new(),
        grid,
    };
    for tick in 0..TICKS {
        bank.advance(field(tick));
        let saturation = material.hysteresis.saturation_magnetization_a_per_m;
        let strains: Vec<f64> = bank
            .magnetizations()
            .iter()
            .map(|&magnetization| material.magnetostriction.strain(magnetization, saturation))
            .collect();
        for ((state, acceleration), strain) in rods.iter_mut().zip(&mut accelerations).zip(&strains) {
            let reached = rod(material).gain * strain;
            *state = propagator.advance(*state, *acceleration, reached);
            *acceleration = reached;
        }
        let displacements: Vec<f64> = rods.iter().map(|state| state.displacement_m).collect();
        let truth = 6400.0 + 800.0 * tick as f64 / TICKS as f64;
        course.measured_m.push(course.grid.smooth(&displacements, truth).value);
        course.strains.push(strains);
        course.displacements_m.push(displacements);
    }
    course
}

impl Course {
    fn prediction(&self, tick: usize) -> Prediction<'_> {
        Prediction {
            grid: &self.grid,
            strains: &self.strains[tick],
            displacements_m: &self.displacements_m[tick],
        }
    }
}

fn laws(material: &Material) -> Vec<(&'static str, AnyLaw)> {
    let whole_range = MinMaxSettings {
        window_a_per_m: None,
        ..MinMaxSettings::folded()
    };
    let matrix_whole_range = MinMaxSettings {
        window_a_per_m: None,
        ..MinMaxSettings::matrix()
    };
    let laws = [
        ("fixed shape", LawSettings::FixedShape { shape_a_per_m: 7012.0 }),
        ("folded, window", LawSettings::Folded(MinMaxSettings::folded())),
        ("folded, whole range", LawSettings::Folded(whole_range)),
        ("Gauss-Newton", LawSettings::GaussNewton(GaussNewtonSettings::default())),
        ("gradient", LawSettings::Gradient(MinMaxSettings::without_window())),
        ("matrix, window", LawSettings::Matrix(MinMaxSettings::matrix())),
        ("matrix, whole range", LawSettings::Matrix(matrix_whole_range)),
        (
            "scalar, whole range",
            LawSettings::Scalar(MinMaxSettings::without_window()),
        ),
    ];
    laws.map(|(name, settings)| (name, AnyLaw::new(&settings, &rod(material), TICK_S).expect("valid law")))
        .into()
}

fn main() {
    let material = Material::terfenol_d();
    let course = &course(&material);
    let fields: Vec<f64> = (0..TICKS).map(field).collect();
    let mut bank = Bank::new(material.hysteresis, course.grid.shapes_a_per_m()).expect("valid bank");
    let mut timed: Vec<Timed> = vec![("bank of 32", Box::new(move |tick| bank.advance(fields[tick])))];
    for (name, mut law) in laws(&material) {
        timed.push((
            name,
            Box::new(move |tick| {
                black_box(law.correct(course.prediction(tick), course.measured_m[tick]));
            }),
        ));
    }
    let mut monitor = ExcitationMonitor::new(&ExcitationSettings::default(), &MinMaxSettings::folded(), TICK_S);
    timed.push((
        "excitation monitor",
        Box::new(move |tick| {
            let output = course.grid.smooth(&course.displacements_m[tick], 7012.0);
            black_box(monitor.observe(output, true));
        }),
    ));
    let mut hulls = Covers::with_members(MEMBERS);
    timed.push((
        "both hulls of 32",
        Box::new(move |tick| hulls.update(course.grid.shapes_a_per_m(), black_box(&course.displacements_m[tick]))),
    ));
    let mut covers = Covers::with_members(MEMBERS);
    timed.push((
        "both covers of 32 at one shape",
        Box::new(move |tick| {
            let values = &course.displacements_m[tick];
            black_box(covers.around(&course.grid, 0..MEMBERS, values, black_box(7012.0)));
        }),
    ));
    let nanoseconds = time_per_tick(&mut timed);
    for ((name, _), each) in timed.iter().zip(&nanoseconds) {
        let share = 100.0 * each / nanoseconds[0];
        println!("{name:34} {each:8.1} ns  {share:5.1} % of the bank");
    }
}
