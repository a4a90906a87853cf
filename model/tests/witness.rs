//! Guards physics by a second opinion: actuators that `anhyst-witness` computes with other methods and without our code, with the same numbers.
//! What differs is far below what a diagnosis must see.

use anhyst_model::{ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, simulate};
use anhyst_witness as witness;
use anhyst_witness::{Drive, Nuisance, Rig, Wanted};

const TICK_S: f64 = 1e-4;

fn drawn(effects: Vec<witness::Effect>, seed: u64) -> witness::Made {
    let wanted = Wanted {
        effects,
        nuisance: Nuisance::Clean,
        drive: Some(Drive::Broadband),
        gap_over_noise: None,
        rows: 8_000,
    };
    Rig::NOMINAL
        .draw(seed, &wanted)
        .unwrap_or_else(|refusal| panic!("{refusal}"))
}

/// Rms of model minus witness: displacement (m) and field (A/m).
fn apart(model: &ActuatorModel, made: &witness::Made) -> (f64, f64) {
    let command = &made.record.command_a_per_m;
    let answer = made.rig.answer(TICK_S, command.clone());
    let mut outputs = ActuatorOutputs::default();
    simulate(model, TICK_S, ActuatorInputs::commands(command), &mut outputs).unwrap();
    let rms = |one: &[f64], other: &[f64]| {
        let squares = one.iter().zip(other).map(|(one, other)| (one - other).powi(2));
        (squares.sum::<f64>() / one.len() as f64).sqrt()
    };
    (
        rms(&outputs.displacement_m, &answer.displacement_m),
        rms(&outputs.field_a_per_m, &answer.field_a_per_m),
    )
}

#[test]
fn nothing_hidden_is_the_nominal_model() {
    for seed in 0..3 {
        let (displacement_m, field_a_per_m) = apart(&ActuatorModel::terfenol_d(), &drawn(Vec::new(), seed));
        println!("{:.3} nm, {field_a_per_m:.1e} A/m", 1e9 * displacement_m);
        assert!(displacement_m < 0.2e-9 && field_a_per_m < 1e-9);
    }
}

#[test]
fn every_listed_effect_is_the_one_of_the_library() {
    for (place, effect) in witness::Effect::LISTED.into_iter().enumerate() {
        let kind = EffectKind::ALL.into_iter().find(|kind| kind.name() == effect.name());
        let mut hidden = Effect::typical(kind.unwrap_or_else(|| panic!("{effect:?} has no name of the library")));
        let made = drawn(vec![effect], 100 + place as u64);
        let part = &made.truth.parts[0];
        for value in &part.values {
            hidden = hidden.with(value.name, value.value).unwrap();
        }
        let (displacement_m, field_a_per_m) = apart(&ActuatorModel::terfenol_d().with_effect(hidden), &made);
        println!(
            "{}: {:.2} nm of {:.0} nm, {field_a_per_m:.3} A/m",
            effect.name(),
            1e9 * displacement_m,
            1e9 * part.gap_m
        );
        let share = match effect {
            // Behind the noise, which an answer is without.
            witness::Effect::Quantisation => continue,
            // The model leaves M where it is while `a` grows, and what relaxes does not act back through α.
            witness::Effect::ThermalDrift => 0.04,
            witness::Effect::Accommodation => 0.07,
            // Between samples the model's way is a straight line.
            _ => 0.01,
        };
        assert!(displacement_m < share * part.gap_m + 0.1e-9, "{}", effect.name());
    }
}
