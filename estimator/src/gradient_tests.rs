//! Guards the comparison: where the gradient law does as well as any, and a case where it stands still while the law with
//! covers arrives.
//!
//! The case: Ising, whose curve saturates exponentially. At 38 kA/m and more a shape of 4 kA/m is saturated, M hardly depends on it, and
//! the gradient law has no slope to follow although the output error is large. The chord of a cover reaches out of the plateau.

use super::*;
use crate::Grid;
use anhyst_model::{Anhysteretic, Bank, Hysteresis};

const TICK_S: f64 = 5e-5;
const TICKS: u32 = 60_000;
/// Tip displacement per magnetization, m per A/m: the rod at rest.
const GAIN: f64 = 2.136e-10;

/// Settings of both laws, a material, and a field that swings at 50 Hz.
struct Case {
    curve: Anhysteretic,
    range: (f64, f64),
    members: usize,
    start: f64,
    truth: f64,
    window: Option<f64>,
    center: f64,
    amplitude: f64,
}

impl Case {
    /// Θ of the paper's size is nothing for the gradient law to fail on; this one is.
    fn plateau(center: f64, amplitude: f64, truth: f64, window: Option<f64>) -> Self {
        Self {
            curve: Anhysteretic::Ising,
            range: (4000.0, 36_000.0),
            members: 129,
            start: 4050.0,
            truth,
            window,
            center,
            amplitude,
        }
    }

    fn field(&self, tick: u32) -> f64 {
        let angle = 2.0 * std::f64::consts::PI * 50.0 * TICK_S * f64::from(tick);
        let swing = self.center + self.amplitude * libm::sin(angle);
        swing * (f64::from(tick) / 400.0).min(1.0)
    }

    /// Where the gradient law and the law with covers end, A/m.
    fn run(&self) -> (f64, f64) {
        let settings = MinMaxSettings {
            range_a_per_m: self.range,
            start_a_per_m: self.start,
            members: self.members,
            dead_zone_m: 1e-10,
            window_a_per_m: self.window,
            ..MinMaxSettings::folded()
        };
        let mut gradient = Folded::new(Form::Gradient, &settings, TICK_S);
        let mut covers = Folded::new(Form::Folded, &settings, TICK_S);
        let grid = Grid::new(self.range.0, self.range.1, self.members);
        let base = Hysteresis {
            anhysteretic: self.curve,
            ..Hysteresis::terfenol_d()
        };
        let mut bank = Bank::new(base, grid.shapes_a_per_m()).unwrap();
        let mut plant = Bank::new(base, &[self.truth]).unwrap();
        for tick in 0..TICKS {
            bank.advance(self.field(tick));
            plant.advance(self.field(tick));
            // Both laws start once the field has arrived: on the way up every shape passes through its steep part.
            if tick < 400 {
                continue;
            }
            let outputs: Vec<f64> = bank.magnetizations().iter().map(|m| GAIN * m).collect();
            let prediction = Prediction {
                grid: &grid,
                strains: &outputs,
                displacements_m: &outputs,
            };
            let measured_m = GAIN * plant.magnetizations()[0];
            gradient.correct(prediction, measured_m);
            covers.correct(prediction, measured_m);
        }
        (gradient.shape_a_per_m(), covers.shape_a_per_m())
    }
}

// Guards the finding that makes covers worth their cost.
#[test]
fn on_a_plateau_the_gradient_stands_still_and_covers_arrive() {
    let case = Case::plateau(48e3, 10e3, 30e3, Some(1000.0));
    let (gradient, covers) = case.run();
    println!("gradient {gradient} A/m, covers {covers} A/m, truth {} A/m", case.truth);
    assert!((gradient - case.start).abs() < 1000.0, "gradient law at {gradient} A/m");
    assert!(
        (covers / case.truth - 1.0).abs() < 1e-3,
        "law with covers at {covers} A/m"
    );
}

// Guards fairness: on the paper's range the gradient law converges, from both sides and with both curves.
#[test]
fn on_the_papers_range_the_gradient_law_converges() {
    for curve in [Anhysteretic::Langevin, Anhysteretic::Ising] {
        for start in [6400.0, 7250.0] {
            let case = Case {
                curve,
                range: (6300.0, 7300.0),
                members: 33,
                start,
                truth: 7012.0,
                window: Some(30.0),
                center: 0.0,
                amplitude: 9000.0,
            };
            let (gradient, covers) = case.run();
            assert!(
                (gradient - 7012.0).abs() < 1.0,
                "{curve:?} from {start}: gradient law at {gradient} A/m"
            );
            assert!(
                (covers - 7012.0).abs() < 1.0,
                "{curve:?} from {start}: law with covers at {covers} A/m"
            );
        }
    }
}
