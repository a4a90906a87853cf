//! The models: one step, with sensitivities, inverse, banks; the signal of the study that the bars come from.

use super::measure::{TANH, Timed};
use anhyst_model::{
    Bank, Hysteresis, Instructions, MagneticState, Material, RodConstants, RodElements, RodElementsPropagator,
    SensitiveState,
};
use std::f64::consts::TAU;
use std::hint::black_box;

pub const STEP: &str = "step";
pub const INVERSE: &str = "inverse step";
const CURVE: &str = "anhysteretic curve";
const ROD: &str = "rod of 8 elements";

/// Banks that are measured.
const BANKS: [usize; 5] = [32, 33, 64, 256, 1024];
/// The one on which instruction sets are compared.
const COMPARED: usize = 64;

pub fn bank_of(members: usize) -> String {
    format!("bank of {members}")
}

/// 20 kHz: 50 Hz with a decaying amplitude, then biased minor loops at 250 Hz. At most 0.06 k a sample.
fn fields(steps: usize) -> Vec<f64> {
    (1..=steps)
        .map(|step| {
            let (time_s, gone) = (step as f64 / 20e3, step as f64 / steps as f64);
            if gone < 0.75 {
                15e3 * (1.0 - gone) * (TAU * 50.0 * time_s).sin()
            } else {
                4e3 + 1.5e3 * (TAU * 250.0 * time_s).sin()
            }
        })
        .collect()
}

fn bank(members: usize) -> Bank {
    let shapes: Vec<f64> = (0..members)
        .map(|member| 6300.0 + 1000.0 * member as f64 / (members - 1) as f64)
        .collect();
    #[expect(clippy::expect_used, reason = "the paper's material is valid")]
    Bank::new(Hysteresis::terfenol_d(), &shapes).expect("a valid bank")
}

/// All of them, `tanh` first.
pub fn timed(steps: usize) -> Vec<Timed<'static>> {
    let hysteresis = Hysteresis::terfenol_d();
    let driven = |name: &str, mut step: Box<dyn FnMut(f64)>| {
        let fields = fields(steps);
        Timed::new(name, "step", steps, move || {
            fields.iter().for_each(|field| step(*field))
        })
    };
    let shape_a_per_m = hysteresis.shape_a_per_m;
    let mut state = MagneticState::default();
    let mut chained = 0.0;
    let mut sensitive = SensitiveState::default();
    let demands: Vec<f64> = fields(steps)
        .into_iter()
        .scan(MagneticState::default(), |state, field| {
            *state = hysteresis.advance(*state, field);
            Some(state.magnetization_a_per_m)
        })
        .collect();
    let mut inverted = MagneticState::default();
    let mut all = vec![
        driven(
            TANH,
            Box::new(move |field| {
                black_box(black_box(field / shape_a_per_m).tanh());
            }),
        ),
        driven(
            CURVE,
            Box::new(move |field| {
                // Each waits for the one before, as the slopes of a step do.
                chained = hysteresis.anhysteretic.value(field / shape_a_per_m + 1e-9 * chained);
                black_box(chained);
            }),
        ),
        driven(
            STEP,
            Box::new(move |field| state = black_box(hysteresis).advance(state, field)),
        )
        .at_least("four curves, one after the other", [(4.0, CURVE)]),
        driven(
            "step with five sensitivities",
            Box::new(move |field| {
                sensitive = black_box(hysteresis).advance_with_sensitivities(sensitive, field);
            }),
        )
        .at_least("a step", [(1.0, STEP)]),
        Timed::new(INVERSE, "step", steps, move || {
            for demand in &demands {
                inverted = black_box(hysteresis)
                    .advance_to_magnetization(inverted, *demand, 3e4)
                    .state;
            }
        })
        .at_least("a forward step", [(1.0, STEP)]),
    ];
    let of_bank = |name: String, members: usize, instructions: Instructions| {
        let (fields, mut bank) = (fields(steps), bank(members));
        Timed::new(name, "member and step", steps * members, move || {
            fields
                .iter()
                .for_each(|field| bank.advance_with(black_box(*field), instructions));
        })
    };
    for members in BANKS {
        let own = of_bank(bank_of(members), members, Instructions::best());
        let largest = BANKS[BANKS.len() - 1];
        all.push(if members == largest {
            own
        } else {
            own.at_least("one so large that no lane is idle", [(1.0, bank_of(largest))])
        });
    }
    for instructions in Instructions::available() {
        let name = format!("bank of {COMPARED}, {}", instructions.name());
        all.push(of_bank(name, COMPARED, instructions));
    }
    all.extend(rod(steps));
    all
}

fn rod(steps: usize) -> Option<Timed<'static>> {
    let elements = RodElements::assemble(&RodConstants::paper(), 8).ok()?;
    let mut rod = RodElementsPropagator::new(&elements, 5e-5).ok()?;
    let force_n = elements.constants().force_per_strain_n() * Material::terfenol_d().strain_per_magnetization();
    let fields = fields(steps);
    Some(Timed::new(ROD, "step", steps, move || {
        fields.iter().for_each(|field| {
            black_box(rod.advance(force_n * field, 0.0));
        });
    }))
}
