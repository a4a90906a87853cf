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

/// The gap that an effect makes beside its identity, in its parameter of that index.
fn gap(kind: EffectKind, index: usize, identity: f64, change: f64, commands: &[f64]) -> Vec<f64> {
    let absent = displacement(&with(Effect::identity(kind)), commands);
    let mut effect = Effect::identity(kind);
    effect.values_mut()[index] = identity + change;
    displacement(&with(effect), commands)
        .iter()
        .zip(&absent)
        .map(|(own, absent)| own - absent)
        .collect()
}

/// Rms of the gap, and by what share of it the gap of twice the size is not its double.
fn size_and_bend(once: &[f64], twice: &[f64]) -> (f64, f64) {
    let size = rms(once.iter().copied());
    (
        size,
        rms(once.iter().zip(twice).map(|(once, twice)| twice - 2.0 * once)) / size,
    )
}

/// Where the library promises a derivative, the gap grows in proportion to the size from its identity, and is not zero; where
/// it promises none, a small size does nothing or jumps. Backlash has it while the tip moves, see below.
#[test]
fn beside_its_identity_the_gap_is_proportional_to_the_size() {
    let commands = drive::loops(4000);
    for kind in EffectKind::ALL {
        if !kind.description().differentiable || kind == EffectKind::Backlash {
            continue;
        }
        for (index, parameter) in kind.parameters().iter().enumerate() {
            let Some(identity) = parameter.identity() else {
                continue;
            };
            let [once, twice] =
                [0.01, 0.02].map(|share| gap(kind, index, identity, share * parameter.typical, &commands));
            let (size, bend) = size_and_bend(&once, &twice);
            let what = format!("{} {}", kind.name(), parameter.name);
            assert!(size > 1e-12, "{what}: gap {size:e} m");
            assert!(bend < 0.05, "{what}: gap {size:e} m, bent by {bend:e} of it");
        }
    }
}

/// Backlash g at rest is what the play operator allows, no more than a half gap and no derivative: where the tip comes to
/// rest within the gap, the sensor's end lies where the last swings left it (twice the size misses its double by half).
/// While the tip moves it is proportional, and all of it g/2.
#[test]
fn backlash_is_proportional_while_the_tip_moves_and_bounded_at_rest() {
    let commands = drive::loops(4000);
    let typical = EffectKind::Backlash.parameters()[0].typical;
    let [once, twice] = [0.01, 0.02].map(|share| gap(EffectKind::Backlash, 0, 0.0, share * typical, &commands));
    let (size, bend) = size_and_bend(&once[..3000], &twice[..3000]);
    assert!(bend < 0.05, "bent by {bend:e}");
    let half = 0.5 * 0.01 * typical;
    assert!(size > 0.8 * half && size < half, "gap {size:e} m of {half:e} m");
    let rounding = 1e-9 * half;
    for (once, twice) in once.iter().zip(&twice) {
        assert!(once.abs() <= half + rounding && twice.abs() <= 2.0 * half + rounding);
    }
    let full = once[..3000]
        .iter()
        .filter(|own| (own.abs() - half).abs() <= rounding)
        .count();
    assert!(full > 2700, "{full} of 3000 samples at half the gap");
}

/// The smallest interesting size is that: on an ordinary run it makes a gap of the order of a good sensor's noise.
#[test]
fn typical_sizes_make_gaps_like_the_noise() {
    let commands = drive::loops(8000);
    let nominal = displacement(&ActuatorModel::terfenol_d(), &commands);
    for kind in EffectKind::ALL
        .into_iter()
        .filter(|kind| kind.description().differentiable)
    {
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
