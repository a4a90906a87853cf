//! Guards each effect's physics in the whole chain, against a closed form or a property that only this physics has.
//! What one signal in and one out can show stands beside the effect itself, in `src/effects/`.

use std::f64::consts::PI;

use anhyst_model::{
    Actuator, ActuatorInput, ActuatorInputs, ActuatorModel, ActuatorOutputs, Effect, EffectKind, Magnetostriction,
    simulate,
};

const TICK_S: f64 = 1e-4;

fn with(kind: EffectKind, values: &[f64]) -> ActuatorModel {
    ActuatorModel::terfenol_d().with_effect(Effect::new(kind, values).expect("within its bounds"))
}

fn run(model: &ActuatorModel, commands: &[f64]) -> ActuatorOutputs {
    let mut outputs = ActuatorOutputs::default();
    simulate(model, TICK_S, ActuatorInputs::commands(commands), &mut outputs).expect("a valid model");
    outputs
}

fn sine(amplitude: f64, frequency_hz: f64, count: usize) -> Vec<f64> {
    let angle = 2.0 * PI * frequency_hz * TICK_S;
    (0..count).map(|k| amplitude * (angle * k as f64).sin()).collect()
}

/// Complex amplitude of `values` at a frequency, over their second half, which must hold whole periods.
fn response(values: &[f64], frequency_hz: f64) -> (f64, f64) {
    let half = values.len() / 2;
    let angle = 2.0 * PI * frequency_hz * TICK_S;
    let (mut cosine, mut sine) = (0.0, 0.0);
    for (k, value) in values.iter().enumerate().skip(half) {
        cosine += value * (angle * k as f64).cos();
        sine += value * (angle * k as f64).sin();
    }
    let scale = 2.0 / (values.len() - half) as f64;
    (scale * sine, scale * cosine)
}

/// Field at which M crosses zero upwards, over the last period.
fn coercive_field(commands: &[f64], magnetization: &[f64]) -> f64 {
    let index = (1..commands.len())
        .rev()
        .find(|&k| magnetization[k - 1] < 0.0 && magnetization[k] >= 0.0)
        .expect("a loop");
    let share = magnetization[index - 1] / (magnetization[index - 1] - magnetization[index]);
    commands[index - 1] + share * (commands[index] - commands[index - 1])
}

/// The material is nearly linear at small fields, so the lag shows as that of M: phase −atan ωτ, amplitude 1/√(1 + (ωτ)²).
#[test]
fn an_eddy_current_is_a_first_order_lag_of_the_magnetization() {
    let (frequency_hz, time_constant_s) = (200.0, 3e-4);
    let commands = sine(1.0, frequency_hz, 4000);
    let amplitude = |model: &ActuatorModel| response(&run(model, &commands).magnetization_a_per_m, frequency_hz);
    let (re, im) = amplitude(&ActuatorModel::terfenol_d());
    let (lag_re, lag_im) = amplitude(&with(EffectKind::EddyCurrent, &[time_constant_s]));
    let size = (re * re + im * im).sqrt();
    let ratio = (lag_re * lag_re + lag_im * lag_im).sqrt() / size;
    let turned = 2.0 * PI * frequency_hz * time_constant_s;
    // Smaller fields see a smaller slope; 2 % covers what is left of that at 1 A/m.
    assert!((ratio * (1.0 + turned * turned).sqrt() - 1.0).abs() < 0.02, "{ratio}");
    let phase = lag_im.atan2(lag_re) - im.atan2(re);
    assert!((phase + turned.atan()).abs() < 0.01, "{phase}");
}

/// Coercivity grows like the root of the frequency, and the quasi-static loop is the nominal one.
#[test]
fn excess_loss_widens_loops_with_the_root_of_the_frequency() {
    let growth = |frequency_hz: f64| {
        let count = (3.0 / frequency_hz / TICK_S) as usize;
        let commands = sine(2e4, frequency_hz, count);
        let own = run(&with(EffectKind::ExcessLoss, &[0.1, 0.5]), &commands);
        let nominal = run(&ActuatorModel::terfenol_d(), &commands);
        coercive_field(&commands, &own.magnetization_a_per_m)
            / coercive_field(&commands, &nominal.magnetization_a_per_m)
            - 1.0
    };
    let (slow, fast) = (growth(1.0), growth(16.0));
    assert!(slow > 0.0 && fast < 1.0, "{slow} {fast}");
    assert!((fast / slow - 4.0).abs() < 0.4, "{slow} {fast}");
}

/// A positive b₃ raises M at the knee, a negative one lowers it; near zero field both are nominal.
#[test]
fn prestress_acts_at_the_knee_by_its_sign() {
    let commands: Vec<f64> = (0..1500).map(|k| 20.0 * f64::from(k)).collect();
    let magnetization = |cubic: f64| run(&with(EffectKind::Prestress, &[cubic]), &commands).magnetization_a_per_m;
    let (more, none, less) = (magnetization(3e-14), magnetization(0.0), magnetization(-3e-14));
    assert!(more[1400] > 1.005 * none[1400] && less[1400] < 0.995 * none[1400]);
    assert!((more[50] / none[50] - 1.0).abs() < 1e-4 && (less[50] / none[50] - 1.0).abs() < 1e-4);
}

/// The stepping of the cubic coupling against the equations as they stand, with a thousand small steps of Euler's midpoint
/// rule between samples and without the shift of field and tangent that the library uses.
#[test]
fn prestress_solves_the_equation_with_the_cubic_field() {
    let cubic = 8e-14;
    let model = with(EffectKind::Prestress, &[cubic]);
    let h = model.material.hysteresis;
    let commands: Vec<f64> = [0.0, 12e3, -4e3, 9e3, 2e3, 15e3]
        .windows(2)
        .flat_map(|pair| {
            (0..40)
                .map(|k| pair[0] + (pair[1] - pair[0]) * f64::from(k) / 40.0)
                .collect::<Vec<_>>()
        })
        .collect();
    let (saturation, c) = (h.saturation_magnetization_a_per_m, h.reversibility);
    let slope = |field: f64, m: f64, direction: f64| {
        let coupling = h.coupling + 3.0 * cubic * m * m;
        let effective = field + h.coupling * m + cubic * m * m * m;
        let (value, derivative) = h.anhysteretic.value_and_derivative(effective / h.shape_a_per_m);
        let (man, dman) = (saturation * value, saturation * derivative / h.shape_a_per_m);
        let lag = if (man - m) * direction < 0.0 { 0.0 } else { man - m };
        let irreversible = lag / (h.pinning_a_per_m * direction - coupling / (1.0 - c) * lag);
        (irreversible + c * dman) / (1.0 - c * coupling * dman)
    };
    let outputs = run(&model, &commands);
    let (mut m, mut worst) = (0.0, 0.0_f64);
    for (pair, own) in commands.windows(2).zip(&outputs.magnetization_a_per_m[1..]) {
        let step = (pair[1] - pair[0]) / 1000.0;
        for part in 0..1000 {
            let field = pair[0] + step * f64::from(part);
            let half = m + 0.5 * step * slope(field, m, step.signum());
            m += step * slope(field + 0.5 * step, half, step.signum());
        }
        worst = worst.max((own - m).abs());
    }
    assert!(worst < 1e-5 * saturation, "{worst} A/m");
}

/// A biased minor loop drifts towards the anhysteretic curve faster, and closes after some cycles; the major loop stays.
#[test]
fn accommodation_closes_minor_loops_and_leaves_the_major_one() {
    let mut commands: Vec<f64> = (0..200).map(|k| 500.0 * f64::from(k)).collect();
    commands.extend((0..200).map(|k| 100e3 - 475.0 * f64::from(k)));
    let begin = commands.len();
    let cycle = 40;
    for k in 0..30 * cycle {
        commands.push(5e3 + 1500.0 * (2.0 * PI * f64::from(k) / f64::from(cycle)).sin());
    }
    let tops = |share: f64| -> Vec<f64> {
        let outputs = run(&with(EffectKind::Accommodation, &[share]), &commands);
        (0..30)
            .map(|n| outputs.magnetization_a_per_m[begin + (n * cycle + cycle / 4) as usize])
            .collect()
    };
    let (nominal, own) = (tops(0.0), tops(0.2));
    let opening = |tops: &[f64], n: usize| (tops[n + 1] - tops[n]).abs();
    assert!(
        opening(&own, 0) > 1.02 * opening(&nominal, 0),
        "it drifts more at first"
    );
    assert!(opening(&own, 5) < 0.6 * opening(&nominal, 5), "and less soon after");
    assert!(opening(&own, 28) < 1e-9 * opening(&own, 0), "until it closes");

    let major = sine(1.2e5, 10.0, 3000);
    let largest = |share: f64| run(&with(EffectKind::Accommodation, &[share]), &major).magnetization_a_per_m;
    let (nominal, own) = (largest(0.0), largest(0.2));
    let worst = nominal[1000..]
        .iter()
        .zip(&own[1000..])
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    assert!(worst < 0.01 * 7.65e5, "{worst} A/m");
}

/// After a step of the field the magnetization creeps on by the fraction, most of it within the time constants.
#[test]
fn the_after_effect_creeps_after_a_step() {
    let mut commands = vec![0.0];
    commands.resize(100_001, 6e3);
    let m = run(&with(EffectKind::AfterEffect, &[0.06, 0.03, 0.3]), &commands).magnetization_a_per_m;
    let end = m[100_000];
    assert!((end / m[1] - 1.06).abs() < 1e-3, "{}", end / m[1]);
    // 0.1 s later: 0.02·Σ(1 − e^(−t/τ)) for 0.03, 0.0949 and 0.3 s.
    let expected = 1.0
        + 0.02
            * [0.03, 0.009_f64.sqrt(), 0.3]
                .map(|tau: f64| 1.0 - (-0.1 / tau).exp())
                .iter()
                .sum::<f64>();
    assert!((m[1001] / m[1] - expected).abs() < 1e-4);
}

/// q = 1 makes the linearised law the full one about the bias, λ′(M + M²/Ms).
#[test]
fn a_quadratic_fraction_of_one_is_the_biased_law() {
    let commands = sine(1.2e4, 30.0, 1000);
    let own = run(&with(EffectKind::QuadraticMagnetostriction, &[1.0]), &commands);
    let mut biased = ActuatorModel::terfenol_d();
    biased.material.magnetostriction = Magnetostriction::Biased {
        saturation_magnetostriction: 1.005e-3,
        bias_fraction: 0.5,
    };
    let expected = run(&biased, &commands);
    for (own, expected) in own.displacement_m.iter().zip(&expected.displacement_m) {
        assert!((own - expected).abs() < 1e-17);
    }
}

/// Steady drive: ΔT settles at rτ⟨H²⟩/H₀², and the tip has lengthened by ε ΔT times the rod's share of its free strain.
#[test]
fn heat_settles_and_lengthens_the_rod() {
    let (heating, loss_time_s) = (2.0, 0.5);
    let model = with(EffectKind::ThermalExpansion, &[heating, loss_time_s, 12e-6]);
    let commands = sine(8e3, 100.0, 60_000);
    let (own, nominal) = (run(&model, &commands), run(&ActuatorModel::terfenol_d(), &commands));
    let mean = |values: &[f64]| values[50_000..].iter().sum::<f64>() / 10_000.0;
    let rise = mean(&own.temperature_k) - 293.0;
    assert!((rise / (heating * loss_time_s * 0.32) - 1.0).abs() < 2e-3, "{rise}");
    let longer = mean(&own.displacement_m) - mean(&nominal.displacement_m);
    let metres_per_strain = model.rod.unwrap().dc_gain() / model.material.strain_per_magnetization();
    assert!((longer / (12e-6 * rise * metres_per_strain) - 1.0).abs() < 1e-3);
}

/// Largest amplitude of the tip over frequencies, about a bias: where the resonance is (Hz), and the gain at 10 Hz.
fn resonance(model: &ActuatorModel, bias_a_per_m: f64) -> (f64, f64) {
    let gain = |frequency_hz: f64| {
        let mut actuator = Actuator::new(model, 2e-5).unwrap();
        let angle = 2.0 * PI * frequency_hz * 2e-5;
        let count = (40.0 / (frequency_hz * 2e-5)) as usize;
        let (mut cosine, mut sine) = (0.0, 0.0);
        actuator.step(ActuatorInput::coil_field(bias_a_per_m));
        for k in 0..count {
            let phase = angle * k as f64;
            let output = actuator.step(ActuatorInput::coil_field(bias_a_per_m + 20.0 * phase.sin()));
            if k >= count / 2 {
                cosine += output.displacement_m * phase.cos();
                sine += output.displacement_m * phase.sin();
            }
        }
        (cosine * cosine + sine * sine).sqrt() / count as f64
    };
    let best = (20..80)
        .map(|step| 25.0 * f64::from(step))
        .max_by(|a, b| gain(*a).total_cmp(&gain(*b)));
    (best.unwrap_or(0.0), gain(10.0))
}

/// A lightly damped rod, whose resonance shows.
fn light_rod() -> ActuatorModel {
    let mut model = ActuatorModel::terfenol_d();
    if let Some(rod) = &mut model.rod {
        rod.damping_per_s = 400.0;
    }
    model
}

/// Resonance moves with √s at a bias and not without one; the gain at low frequency stays.
#[test]
fn delta_e_moves_the_resonance_and_not_the_static_gain() {
    let nominal = light_rod();
    let own = nominal
        .clone()
        .with_effect(Effect::new(EffectKind::DeltaE, &[2.0]).unwrap());
    let bias = 1.5e4;
    let mut actuator = Actuator::new(&nominal, 2e-5).unwrap();
    let m = actuator.step(ActuatorInput::coil_field(bias)).magnetization_a_per_m;
    let (at, gain) = resonance(&nominal, bias);
    let (own_at, own_gain) = resonance(&own, bias);
    let stiffer = 1.0 + 2.0 * (m / 7.65e5) * (m / 7.65e5);
    assert!(
        (own_at / at / stiffer.sqrt() - 1.0).abs() < 0.03,
        "{at} to {own_at} Hz, stiffness {stiffer}"
    );
    assert!(own_at > 1.05 * at);
    assert!((own_gain / gain - 1.0).abs() < 1e-3);
    assert_eq!(resonance(&own, 0.0).0, resonance(&nominal, 0.0).0);
}

/// A stiffer, heavier load: static gain falls by 1 + κ, and the resonance moves by √((1 + κ)/(1 + μ)).
#[test]
fn a_load_moves_gain_and_resonance() {
    let nominal = light_rod();
    let own = nominal
        .clone()
        .with_effect(Effect::new(EffectKind::LoadChange, &[0.1, 0.6]).unwrap());
    let ((at, gain), (own_at, own_gain)) = (resonance(&nominal, 0.0), resonance(&own, 0.0));
    assert!((gain / own_gain - 1.1).abs() < 2e-3);
    assert!(
        (own_at / at / (1.1_f64 / 1.6).sqrt() - 1.0).abs() < 0.03,
        "{at} to {own_at} Hz"
    );
}

/// At rest the spring's force balances the strain's: u(1 + βu²) is the nominal displacement.
#[test]
fn stiffening_is_a_cubic_spring() {
    let cubic = 2e8;
    let commands: Vec<f64> = (0..2000).map(|k| 10.0 * f64::from(k.min(1000))).collect();
    let (own, nominal) = (
        run(&with(EffectKind::Stiffening, &[cubic]), &commands),
        run(&ActuatorModel::terfenol_d(), &commands),
    );
    let (u, expected) = (own.displacement_m[1999], nominal.displacement_m[1999]);
    assert!(u < 0.98 * expected);
    assert!((u * (1.0 + cubic * u * u) / expected - 1.0).abs() < 1e-9);
}

/// Friction takes energy out: work of strain over a cycle, ∮ u dλ against the motion, grows by 4·d·amplitude per cycle, Coulomb's
/// figure, and never falls below the nominal; a pushed rod comes to rest.
#[test]
fn friction_takes_coulombs_energy_out_of_a_cycle() {
    let friction_m = 1e-6;
    let commands = sine(8e3, 20.0, 4000);
    // Work per cycle and stiffness, m²: ∮ g M du over the last period, all that is put in and not stored.
    let work = |model: &ActuatorModel| {
        let outputs = run(model, &commands);
        let gain = model.rod.unwrap().dc_gain();
        let (m, u) = (&outputs.magnetization_a_per_m, &outputs.displacement_m);
        (3501..4000)
            .map(|k| 0.5 * gain * (m[k] + m[k - 1]) * (u[k] - u[k - 1]))
            .sum::<f64>()
    };
    let model = with(EffectKind::Friction, &[friction_m, 1e-5, 1e-9]);
    let u = run(&model, &commands).displacement_m;
    let amplitude = u[3500..].iter().fold(0.0_f64, |most, value| most.max(*value));
    let extra = work(&model) - work(&ActuatorModel::terfenol_d());
    let coulomb = 4.0 * friction_m * amplitude;
    assert!((extra / coulomb - 1.0).abs() < 0.05, "{extra:e} of {coulomb:e} m²");
}
