//! Guards the law for several parameters: its derivatives, what it holds, what it survives. What it finds is judged by plants of
//! somebody else's making (`independent_plant.rs`, and in the loop `tests/tests/parameters.rs`).

mod common;

use anhyst_estimator::{
    Estimator, EstimatorSettings, LawSettings, MultiParameterSettings, ParameterEstimates, ParameterSettings,
};
use anhyst_model::{
    ActuatorModel, AmplifierConstants, Effect, EffectKind, Hysteresis, Noise, rod_per_strain, with_known_effects,
};
use common::{TICK_S, assert_a_snapshot_continues, command, with};

fn several() -> MultiParameterSettings {
    MultiParameterSettings::default()
}

fn estimator(settings: &EstimatorSettings, effects: &[Effect]) -> Estimator {
    let model = ActuatorModel::terfenol_d();
    let rod = rod_per_strain(model.rod.unwrap(), &model.material);
    let (material, rod) = with_known_effects(&model.material, rod, effects);
    Estimator::with_effects(settings, &material, rod, AmplifierConstants::default(), TICK_S, effects).unwrap()
}

/// Nothing is ever told well enough to move.
fn watching(start_a_per_m: f64) -> EstimatorSettings {
    with(LawSettings::MultiParameter(MultiParameterSettings {
        start_a_per_m,
        noise_m: 1.0,
        ..several()
    }))
}

// Guards the path of the derivatives through creep, strain, rod, second mode and washout: the slope by `a` is the difference of
// neighbouring runs.
#[test]
fn derivatives_are_those_of_neighbouring_runs() {
    let effects = [
        Effect::new(EffectKind::AfterEffect, &[0.0325, 0.03, 3.0]).unwrap(),
        Effect::new(EffectKind::EddyCurrent, &[1.2e-4]).unwrap(),
        Effect::new(EffectKind::ThermalExpansion, &[0.5, 20.0, 12e-6]).unwrap(),
        Effect::new(EffectKind::SecondMode, &[0.03, 900.0, 0.03]).unwrap(),
    ];
    for (effects, washout_hz) in [(&effects[..0], None), (&effects[..], None), (&effects[..], Some(2.0))] {
        let run = |start_a_per_m: f64| {
            let settings = EstimatorSettings {
                washout_hz,
                ..watching(start_a_per_m)
            };
            let mut own = estimator(&settings, effects);
            let found = (0..6000).map(|tick| own.step(tick, command(tick), f64::NAN, 0.0).correction);
            found
                .map(|own| (own.predicted_output_m, own.slope_m_per_a_per_m))
                .collect::<Vec<_>>()
        };
        let [below, exact, above] = [7011.0, 7012.0, 7013.0].map(run);
        let differences = below.iter().zip(&above).map(|(below, above)| 0.5 * (above.0 - below.0));
        let largest = exact.iter().fold(0.0, |most: f64, own| most.max(own.1.abs()));
        let worst = differences
            .zip(&exact)
            .fold(0.0, |most: f64, (own, exact)| most.max((own - exact.1).abs()));
        assert!(
            largest > 1e-9 && worst < 1e-4 * largest,
            "{worst:e} of {largest:e}, {effects:?}"
        );
    }
}

struct After {
    last: ParameterEstimates,
    /// Of k in the last second, as a share.
    worst_pinning: f64,
}

/// Estimates after two seconds of a motion of this size, by a model that is right, with what is added to the measurement.
fn after(settings: MultiParameterSettings, size: f64, added_m: impl Fn(f64) -> f64) -> After {
    let settings = with(LawSettings::MultiParameter(settings));
    let mut truth = estimator(&watching(7012.0), &[]);
    let mut own = estimator(&settings, &[]);
    let (mut noise, mut last, mut worst) = (Noise::new(3, 0), None, 0.0_f64);
    for tick in 0..40_000 {
        let field_a_per_m = size * command(tick);
        let true_m = truth
            .step(tick, field_a_per_m, f64::NAN, f64::NAN)
            .correction
            .predicted_output_m;
        let measured_m = true_m + added_m(TICK_S * tick as f64) + 10e-9 * noise.normal();
        last = own.step(tick, field_a_per_m, f64::NAN, measured_m).parameters;
        if tick >= 20_000 {
            worst = worst.max((last.unwrap().hysteresis.pinning_a_per_m / 4000.0 - 1.0).abs());
        }
    }
    After {
        last: last.unwrap(),
        worst_pinning: worst,
    }
}

#[test]
fn what_the_motion_does_not_tell_is_held() {
    let start = Hysteresis::terfenol_d();
    let first = [0.02, 0.05, 0.05, 0.0, 0.1];
    let shares = |after: After| {
        let (found, from) = (after.last.hysteresis.parameters(), start.parameters());
        let (deviations, told) = (after.last.deviations, after.last.informed_directions);
        let moved: [f64; 5] = std::array::from_fn(|index| (found[index] / from[index] - 1.0).abs());
        let left: [f64; 5] = std::array::from_fn(|index| deviations[index] / from[index].abs());
        println!("moved {moved:?}, left {left:?}, {told} told");
        (moved, left, told)
    };
    let (moved, left, told) = shares(after(several(), 0.0, |_| 0.0));
    assert_eq!((moved, told), ([0.0; 5], 0));
    assert!(
        left.iter()
            .zip(&first)
            .all(|(left, first)| (left - first).abs() < 1e-12)
    );
    // A motion of less than a micrometre tells one product of the parameters, and no more.
    let (moved, left, told) = shares(after(several(), 0.02, |_| 0.0));
    assert_eq!(told, 1);
    assert!(left[2] > 0.8 * first[2], "k is believed known");
    assert!(
        moved.iter().zip(&first).all(|(moved, first)| moved <= first),
        "{moved:?}"
    );
    let (moved, left, told) = shares(after(several(), 1.0, |_| 0.0));
    assert!(told >= 3, "{told}");
    assert!(
        moved.iter().zip(&left).all(|(moved, left)| *moved <= 3.0 * left),
        "{moved:?}"
    );
    assert_eq!(moved[3], 0.0, "alpha is held");
}

#[test]
fn what_no_parameter_explains_makes_it_slow() {
    let hum = |time_s: f64| 300e-9 * libm::sin(std::f64::consts::TAU * 61.3 * time_s + 1.0);
    let off = |annealing_samples: f64| {
        let settings = MultiParameterSettings {
            annealing_samples,
            ..several()
        };
        after(settings, 1.0, hum).worst_pinning
    };
    let (with, without) = (off(100.0), off(0.0));
    println!("k off by {with} with annealing, {without} without");
    assert!(with < 0.5 * without, "{with}, {without}");
}

#[test]
fn no_measurement_breaks_it() {
    let mut own = estimator(&with(LawSettings::MultiParameter(several())), &[]);
    let hostile = [f64::NAN, f64::INFINITY, -1e300, 0.99, -0.99, 1e-3];
    for tick in 0..20_000_u64 {
        let measured_m = if tick % 7 == 0 {
            hostile[(tick / 7) as usize % hostile.len()]
        } else {
            4e-9 * command(tick)
        };
        let found = own.step(tick, command(tick), f64::NAN, measured_m);
        let parameters = found.parameters.unwrap();
        parameters.hysteresis.validate().unwrap();
        assert!(found.magnetization_a_per_m.abs() <= parameters.hysteresis.saturation_magnetization_a_per_m);
        assert!(parameters.deviations.iter().all(|own| own.is_finite() && *own >= 0.0));
        let settings = several();
        for (value, (from, share)) in parameters.hysteresis.parameters().iter().zip([
            (7.65e5, settings.saturation_magnetization.share),
            (7012.0, settings.shape.share),
            (4000.0, settings.pinning.share),
            (-0.01, 0.0),
            (0.18, settings.reversibility.share),
        ]) {
            assert!((value / from).ln().abs() <= 6.0 * share + 1e-12, "{value} from {from}");
        }
    }
}

#[test]
fn a_snapshot_continues() {
    let amplifier = AmplifierConstants::default();
    assert_a_snapshot_continues(&with(LawSettings::MultiParameter(several())), amplifier);
}

#[test]
fn settings_that_cannot_be_used_are_refused() {
    let refusal = |own| {
        with(LawSettings::MultiParameter(own))
            .validate()
            .unwrap_err()
            .to_string()
    };
    let share = |share| ParameterSettings {
        share,
        ..ParameterSettings::default()
    };
    let wide = refusal(MultiParameterSettings {
        pinning: share(0.5),
        ..several()
    });
    assert!(wide.starts_with("law.pinning.share: 0.5"), "{wide}");
    let none = MultiParameterSettings {
        saturation_magnetization: share(0.0),
        shape: share(0.0),
        pinning: share(0.0),
        reversibility: share(0.0),
        ..several()
    };
    assert!(refusal(none).contains("no parameter is estimated"));
    let quiet = refusal(MultiParameterSettings {
        noise_m: 1e-200,
        ..several()
    });
    assert!(quiet.contains("its square is 0"), "{quiet}");
    let nowhere = watching(-1.0).validate().unwrap_err().to_string();
    assert!(nowhere.starts_with("law.start_a_per_m: -1 A/m"), "{nowhere}");
}
