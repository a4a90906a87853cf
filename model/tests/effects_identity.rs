//! Guards the score test and the fitter: at its identity an effect is absent, beside it the output moves smoothly, and
//! effects go together in any pair and any order.

mod drive;

use anhyst_model::{Actuator, ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, simulate};

const TICK_S: f64 = 1e-4;

fn displacement(model: &ActuatorModel, commands: &[f64]) -> Vec<f64> {
    let mut outputs = ActuatorOutputs::default();
    simulate(model, TICK_S, ActuatorInputs::commands(commands), &mut outputs).expect("a valid model");
    outputs.displacement_m
}

fn with(effect: Effect) -> ActuatorModel {
    ActuatorModel::terfenol_d().with_effect(effect)
}

fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value * value;
        count += 1.0;
    }
    f64::sqrt(sum / count)
}

#[test]
fn at_its_identity_every_effect_is_absent() {
    let commands = drive::loops(4000);
    let nominal = displacement(&ActuatorModel::terfenol_d(), &commands);
    let size = rms(nominal.iter().copied());
    for kind in EffectKind::ALL {
        let own = displacement(&with(Effect::identity(kind)), &commands);
        let worst = own
            .iter()
            .zip(&nominal)
            .map(|(own, nominal)| (own - nominal).abs())
            .fold(0.0, f64::max);
        assert!(
            worst <= 1e-12 * size,
            "{}: {:e} of the displacement",
            kind.name(),
            worst / size
        );
    }
}

/// Where the library promises a derivative, the gap grows in proportion to the size from its identity, and is not zero; where
/// it promises none, a small size does nothing or jumps.
#[test]
fn beside_its_identity_the_gap_is_proportional_to_the_size() {
    // Without the rests at the end: where the rod's ringing dies out in a gap depends on the gap, and not smoothly.
    let commands = &drive::loops(4000)[..3000];
    for kind in EffectKind::ALL {
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let Some(identity) = parameter.identity() else {
                continue;
            };
            if !kind.differentiable() {
                continue;
            }
            let absent = displacement(&with(Effect::identity(kind)), commands);
            let gap = |share: f64| {
                let mut effect = Effect::identity(kind);
                effect.values_mut()[index] = identity + share * parameter.typical;
                displacement(&with(effect), commands)
                    .iter()
                    .zip(&absent)
                    .map(|(own, absent)| own - absent)
                    .collect::<Vec<f64>>()
            };
            let (once, twice) = (gap(0.2), gap(0.4));
            let size = rms(once.iter().copied());
            let bent = rms(once.iter().zip(&twice).map(|(once, twice)| twice - 2.0 * once));
            let what = format!("{} {}", kind.name(), parameter.name);
            assert!(size > 1e-11, "{what}: gap {size:e} m");
            assert!(bent < 0.1 * size, "{what}: gap {size:e} m, bent by {bent:e} m");
        }
    }
}

/// The smallest interesting size is that: on an ordinary run it makes a gap of the order of a good sensor's noise.
#[test]
fn typical_sizes_make_gaps_like_the_noise() {
    let commands = drive::loops(8000);
    let nominal = displacement(&ActuatorModel::terfenol_d(), &commands);
    for kind in EffectKind::ALL.into_iter().filter(|kind| kind.differentiable()) {
        let own = displacement(&with(Effect::typical(kind)), &commands);
        let gap = rms(own.iter().zip(&nominal).map(|(own, nominal)| own - nominal));
        assert!((3e-10..3e-7).contains(&gap), "{}: {gap:e} m", kind.name());
    }
}

/// Pairs are what the workflow fits next: finite, and the same whatever the order in the file.
#[test]
fn any_two_effects_go_together_in_any_order() {
    let commands = drive::loops(1500);
    for (index, &first) in EffectKind::ALL.iter().enumerate() {
        for &second in &EffectKind::ALL[index + 1..] {
            let effects = [first, second].map(Effect::typical);
            let mut model = ActuatorModel::terfenol_d();
            model.effects = effects.to_vec();
            let one = displacement(&model, &commands);
            model.effects.reverse();
            let other = displacement(&model, &commands);
            assert!(
                one.iter().all(|value| value.is_finite()),
                "{} and {}",
                first.name(),
                second.name()
            );
            assert_eq!(one, other, "{} and {}", first.name(), second.name());
        }
    }
}

/// All at once, at the largest values that still go together: nothing runs away.
#[test]
fn strong_effects_stay_finite() {
    let commands = drive::loops(4000);
    for kind in EffectKind::ALL {
        for share in [0.0, 0.2, 1.0] {
            let mut effect = Effect::typical(kind);
            for (value, parameter) in effect.values_mut().iter_mut().zip(kind.parameters()) {
                *value = parameter.lower + share * (parameter.upper - parameter.lower);
            }
            let model = with(effect);
            if kind == EffectKind::Prestress && model.validate().is_err() {
                continue;
            }
            let own = displacement(&model, &commands);
            assert!(
                own.iter().all(|value| value.is_finite()),
                "{} at {:?}",
                kind.name(),
                effect.values()
            );
        }
    }
    let mut model = ActuatorModel::terfenol_d();
    model.effects = EffectKind::ALL.map(Effect::typical).to_vec();
    assert!(displacement(&model, &commands).iter().all(|value| value.is_finite()));
    assert!(Actuator::new(&model, TICK_S).is_ok());
}
