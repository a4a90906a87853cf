//! Guards the smaller parts: magnetostriction, material, sensor, play.

use anhyst_model::{Magnetostriction, Material, Noise, Play, Sensor};

const SATURATION: f64 = 7.65e5;
const LAMBDA: f64 = 1.005e-3;

fn laws() -> [Magnetostriction; 5] {
    [
        Magnetostriction::Linearised {
            saturation_magnetostriction: LAMBDA,
            bias_fraction: 0.5,
        },
        Magnetostriction::Quadratic {
            saturation_magnetostriction: LAMBDA,
        },
        Magnetostriction::Biased {
            saturation_magnetostriction: LAMBDA,
            bias_fraction: 0.5,
        },
        Magnetostriction::Polynomial {
            gamma1_m2_per_a2: 3.62e-15,
            gamma2_m4_per_a4: 0.0,
        },
        Magnetostriction::Polynomial {
            gamma1_m2_per_a2: 3.62e-15,
            gamma2_m4_per_a4: -1e-27,
        },
    ]
}

#[test]
fn strain_slope_and_inverse_agree() {
    for law in laws() {
        law.validate().expect("valid");
        for part in 0..=20 {
            let magnetization = SATURATION * f64::from(part) / 20.0;
            let strain = law.strain(magnetization, SATURATION);
            let back = law.inverse(strain, SATURATION).expect("reachable");
            assert!(
                (back - magnetization).abs() < 1e-8 * SATURATION,
                "{law:?} at {magnetization}: {back}"
            );
            let step = 1.0;
            let difference = (law.strain(magnetization + step, SATURATION)
                - law.strain(magnetization - step, SATURATION))
                / (2.0 * step);
            assert!((law.slope(magnetization, SATURATION) - difference).abs() < 1e-13);
        }
    }
}

/// On the rising branch the strain goes from its least to its most, also where M⁴ bends it down again before saturation.
#[test]
fn the_rising_branch_ends_where_the_law_turns_round() {
    let bent = Magnetostriction::Polynomial {
        gamma1_m2_per_a2: 3.62e-15,
        gamma2_m4_per_a4: -1e-26,
    };
    let softening = Magnetostriction::Polynomial {
        gamma1_m2_per_a2: -3.62e-15,
        gamma2_m4_per_a4: 1e-26,
    };
    for law in laws().into_iter().chain([bent, softening]) {
        let (low, high) = law.branch_a_per_m(SATURATION);
        assert!(-SATURATION <= low && low < high && high <= SATURATION, "{law:?}");
        for part in 1..100 {
            let inside = low + (high - low) * 0.01 * f64::from(part);
            let slope = law.slope(inside, SATURATION) / law.slope(0.5 * (low + high), SATURATION);
            assert!(
                slope > 0.0,
                "{law:?} turns round at {inside} A/m of [{low}, {high}] A/m"
            );
        }
        let beyond = law.slope(1.001 * high, SATURATION) * law.slope(0.5 * (low + high), SATURATION);
        assert!(high == SATURATION || beyond < 0.0, "{law:?} rises on beyond {high} A/m");
    }
}

#[test]
fn paper_equations_eight_and_nine() {
    let [linearised, quadratic, biased, ..] = laws();
    assert!((quadratic.strain(SATURATION, SATURATION) - 1.5 * LAMBDA).abs() < 1e-15);
    let m = 1e5;
    // (9) as the difference of two squares of (8).
    let expected = quadratic.strain(m + SATURATION / 2.0, SATURATION) - quadratic.strain(SATURATION / 2.0, SATURATION);
    assert!((biased.strain(m, SATURATION) - expected).abs() < 1e-15);
    assert!((linearised.slope(0.0, SATURATION) / biased.slope(0.0, SATURATION) - 1.0).abs() < 1e-15);
    assert!((linearised.strain(m, SATURATION) - 1.5 * LAMBDA / SATURATION * m).abs() < 1e-15);
}

#[test]
fn unreachable_strain_has_no_magnetization() {
    let [linearised, quadratic, biased, even, bent] = laws();
    assert!(linearised.inverse(-1e-3, SATURATION).is_some());
    assert_eq!(quadratic.inverse(-1e-6, SATURATION), None);
    assert_eq!(even.inverse(-1e-6, SATURATION), None);
    let lowest = biased.strain(-0.5 * SATURATION, SATURATION);
    assert!(
        biased
            .inverse(0.999 * lowest, SATURATION)
            .is_some_and(|m| m > -0.5 * SATURATION)
    );
    assert_eq!(biased.inverse(1.001 * lowest, SATURATION), None);
    // γ₁M² + γ₂M⁴ with γ₂ < 0 has a highest strain, γ₁²/(−4γ₂).
    assert_eq!(bent.inverse(1.001 * 3.62e-15 * 3.62e-15 / 4e-27, SATURATION), None);
    assert_eq!(quadratic.inverse(f64::NAN, SATURATION), None);
    assert_eq!(quadratic.inverse(0.0, SATURATION), Some(0.0));
}

#[test]
fn material_reads_only_what_it_knows() {
    let material = Material::terfenol_d();
    material.validate().expect("valid");
    let text = serde_json::to_string(&material).expect("serialises");
    assert_eq!(serde_json::from_str::<Material>(&text).expect("reads"), material);
    assert!(serde_json::from_str::<Material>(&text.replacen("\"coupling\"", "\"alpha\"", 1)).is_err());
    let bad = Magnetostriction::Quadratic {
        saturation_magnetostriction: 1005.0,
    };
    assert!(
        Material {
            magnetostriction: bad,
            ..material
        }
        .validate()
        .is_err()
    );
}

#[test]
fn noise_is_normal_reproducible_and_split_by_stream() {
    let draw = |seed, stream| {
        let mut noise = Noise::new(seed, stream);
        (0..100_000).map(|_| noise.normal()).collect::<Vec<f64>>()
    };
    let numbers = draw(7, 1);
    assert_eq!(numbers, draw(7, 1));
    assert!(numbers[..10] != draw(7, 2)[..10] && numbers[..10] != draw(8, 1)[..10]);
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let variance = numbers.iter().map(|n| n * n).sum::<f64>() / count;
    let fourth = numbers.iter().map(|n| n.powi(4)).sum::<f64>() / count;
    assert!(mean.abs() < 0.015 && (variance - 1.0).abs() < 0.02 && (fourth - 3.0).abs() < 0.15);
    let other = draw(7, 2);
    let correlation = numbers.iter().zip(&other).map(|(a, b)| a * b).sum::<f64>() / count;
    assert!(correlation.abs() < 0.015, "streams correlate: {correlation}");
}

#[test]
fn stored_noise_goes_on_with_the_same_numbers() {
    let mut noise = Noise::new(3, 4);
    for _ in 0..7 {
        noise.normal();
    }
    let text = serde_json::to_string(&noise).expect("serialises");
    let mut restored: Noise = serde_json::from_str(&text).expect("restores");
    for _ in 0..20 {
        assert_eq!(noise.normal(), restored.normal());
    }
}

#[test]
fn sensors_quantise_and_can_be_silent() {
    let mut noise = Noise::new(1, 0);
    let ideal = Sensor::default();
    assert_eq!(ideal.measure(1.25e-6, &mut noise), 1.25e-6);
    let coarse = Sensor {
        noise_rms: 0.0,
        resolution: 1e-8,
    };
    assert!((coarse.measure(1.2345e-6, &mut noise) - 1.23e-6).abs() < 1e-15);
    assert!(
        Sensor {
            noise_rms: -1.0,
            resolution: 0.0
        }
        .validate()
        .is_err()
    );
}

/// The play turns noise of 1 A/m rms on a rising field into a field that hardly ever falls.
#[test]
fn play_of_three_deviations_hides_noise() {
    let mut noise = Noise::new(5, 0);
    let mut play = Play::new(3.0).expect("valid");
    let mut raw_reversals = 0;
    let (mut last_raw, mut last, mut falls) = (0.0, 0.0, 0);
    for step in 0..20_000 {
        let measured = f64::from(step) * 0.1 + noise.normal();
        let followed = play.follow(measured);
        raw_reversals += i32::from(measured < last_raw);
        falls += i32::from(followed < last);
        (last_raw, last) = (measured, followed);
    }
    assert!(raw_reversals > 5_000 && falls < 10, "{raw_reversals} and {falls}");
    assert!((play.output() - (2000.0 - 3.0)).abs() < 6.0);
    let mut straight = Play::new(0.0).expect("valid");
    assert_eq!(straight.follow(1.5), 1.5);
    assert_eq!(straight.follow(f64::NAN), 1.5);
    assert!(Play::new(-1.0).is_err());
}
