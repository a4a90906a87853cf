//! One estimation law on one open-loop run: how far its `a` is from the true one.
//!
//! A field is commanded, a simulated plant moves, the estimator hears command and displacement. No controller takes part, so
//! that every law sees the same motion.

use anhyst_estimator::{Estimator, EstimatorSettings, LawSettings};
use anhyst_launch::error::RunError;
use anhyst_model::{Amplifier, AmplifierConstants, Material, RodConstants, RodElements};
use anhyst_plant_sim::{Plant, PlantSettings, Sensors, ShapeCourse};
use clap::ValueEnum;
use serde::Serialize;
use std::f64::consts::TAU;

/// As in the milling scenarios.
const TICK_S: f64 = 5e-5;
const ELEMENTS: usize = 8;
/// Judged after this share of the run.
const SETTLED: f64 = 0.5;
/// The paper's true value, and its estimator's first.
const TRUTH_A_PER_M: f64 = 7012.0;
/// Where a drifting `a` is in the middle of the run.
const MIDDLE_A_PER_M: f64 = 6900.0;

/// The motion that has to inform.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Excitation {
    /// Once from 0 to 40 kA/m, as in the paper.
    Ramp,
    /// 20 kA/m at 10 Hz.
    Sine,
    /// 9 kA/m at 50 Hz and 30 % at 150 Hz: a cut of about ±40 µm.
    Milling,
}

impl Excitation {
    /// H at a share (0 to 1) of a run of `seconds`, A/m.
    fn field_a_per_m(self, share: f64, seconds: f64) -> f64 {
        let turns = |hz: f64| (TAU * hz * share * seconds).sin();
        match self {
            Excitation::Ramp => 40e3 * share,
            Excitation::Sine => 20e3 * turns(10.0),
            Excitation::Milling => 9e3 * (turns(50.0) + 0.3 * turns(150.0)),
        }
    }
}

/// One cell of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Case {
    /// Under which motion.
    pub excitation: Excitation,
    /// rms of the displacement sensor.
    pub noise_m: f64,
    /// Of the true `a`, A/m per s.
    pub drift_a_per_m_s: f64,
    /// Length of the run.
    pub seconds: f64,
    /// Of the noise.
    pub seed: u64,
}

/// How well a law did over the second half of the run.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize)]
pub struct LawPerformance {
    /// rms of estimated minus true `a`, A/m.
    pub error_rms_a_per_m: f64,
    /// Mean of the same: a lag, or a bias, A/m.
    pub error_mean_a_per_m: f64,
    /// Share of the ticks in which the estimate was held for want of information.
    pub held_share: f64,
    /// Cramér-Rao bound of the recent motion at the end, A/m; 0 where there is none.
    pub bound_a_per_m: f64,
}

/// Runs one case with one law.
///
/// # Errors
/// Settings that cannot be used.
pub fn run(case: &Case, law: LawSettings) -> Result<LawPerformance, RunError> {
    let setup = |error: &dyn std::fmt::Display| RunError::Setup(error.to_string());
    let (material, constants) = (Material::terfenol_d(), RodConstants::paper());
    let two_pole = RodElements::assemble(&constants, ELEMENTS)
        .map_err(|error| setup(&error))?
        .two_pole(1.0);
    let settings = EstimatorSettings {
        law,
        ..EstimatorSettings::default()
    };
    let amplifier = AmplifierConstants::default();
    let mut estimator =
        Estimator::new(&settings, &material, two_pole, amplifier, TICK_S).map_err(|error| setup(&error))?;
    let plant_settings = plant_settings(case);
    let mut plant =
        Plant::new(&plant_settings, &material, &constants, TICK_S, case.seed).map_err(|error| setup(&error))?;
    let ticks = (case.seconds / TICK_S).round() as u64;
    let (mut performance, mut squares, mut judged) = (LawPerformance::default(), 0.0, 0_u64);
    let mut in_coil = Amplifier::new(amplifier, TICK_S).map_err(|error| setup(&error))?;
    let (mut command, mut field) = (0.0, 0.0);
    for tick in 0..ticks {
        if tick > 0 {
            plant.advance(field);
        }
        let readings = plant.measure();
        let found = estimator.step(tick, command, readings.field_a_per_m, readings.displacement_m);
        let share = (tick + 1) as f64 / ticks as f64;
        if share > SETTLED {
            let error = found.correction.shape_a_per_m - plant.state().shape_a_per_m;
            squares += error * error;
            performance.error_mean_a_per_m += error;
            performance.held_share += f64::from(u8::from(found.correction.held));
            judged += 1;
        }
        let bound = found.excitation.deviation_bound_a_per_m;
        performance.bound_a_per_m = if bound.is_finite() { bound } else { 0.0 };
        command = case.excitation.field_a_per_m(share, case.seconds);
        field = in_coil.step(command).field_a_per_m;
    }
    let judged = judged.max(1) as f64;
    Ok(LawPerformance {
        error_rms_a_per_m: (squares / judged).sqrt(),
        error_mean_a_per_m: performance.error_mean_a_per_m / judged,
        held_share: performance.held_share / judged,
        ..performance
    })
}

fn plant_settings(case: &Case) -> PlantSettings {
    let drift = case.drift_a_per_m_s;
    let shape = if drift == 0.0 {
        ShapeCourse::Constant { a_per_m: TRUTH_A_PER_M }
    } else {
        let half = 0.5 * drift * case.seconds;
        ShapeCourse::Ramp {
            from_a_per_m: MIDDLE_A_PER_M - half,
            rate_a_per_m_s: drift,
            to_a_per_m: MIDDLE_A_PER_M + half,
        }
    };
    PlantSettings {
        shape,
        rod: anhyst_plant_sim::PlantRod::default(),
        sensors: Sensors {
            displacement_noise_m: case.noise_m,
            ..Sensors::default()
        },
        start_temperature_k: 293.0,
        heating: None,
        expansion: None,
        cut: anhyst_plant_sim::Cut::default(),
        contact: anhyst_plant_sim::Contact::default(),
        effects: None,
        material_file: None,
        material: None,
        two_pole: None,
    }
}
