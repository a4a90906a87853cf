//! Guards the witness itself: curves that another program computed, closed forms of the rod, and steps that are small enough.

use anhyst_witness::{Curve, Hidden, Material, Noise, Plant, Rig, Rod, Sensor, excitation};
use std::f64::consts::TAU;
use std::path::Path;

const TICK_S: f64 = 1e-4;

/// The constants behind a file's name, as model/tests/reference/README.md has them.
fn material(name: &str) -> Material {
    let curve = if name.starts_with("ising") {
        Curve::Ising
    } else {
        Curve::Langevin
    };
    let base = Material {
        curve,
        ..Material::TERFENOL_D
    };
    let changed = |saturation_a_per_m, shape_a_per_m, pinning_a_per_m, coupling, reversible_share| Material {
        curve,
        saturation_a_per_m,
        shape_a_per_m,
        pinning_a_per_m,
        coupling,
        reversible_share,
        ..base
    };
    match name {
        _ if name.contains("positive_coupling") => Material { coupling: 0.01, ..base },
        _ if name.contains("soft") => changed(4.0e5, 2500.0, 300.0, -0.002, 0.4),
        _ if name.contains("hard") => changed(7.65e5, 7012.0, 9000.0, -0.01, 0.05),
        _ => base,
    }
}

#[test]
fn the_hysteresis_is_that_of_the_reference_curves() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../model/tests/reference");
    let (mut curves, mut worst) = (0, 0.0_f64);
    for entry in std::fs::read_dir(folder).expect("the curves") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "csv") {
            continue;
        }
        let name = path.file_stem().expect("a name").to_string_lossy().into_owned();
        let material = material(&name);
        let mut plant = Plant::new(material, Rod::PRINTED, Hidden::default(), TICK_S).with_substeps(128);
        let (mut error, mut largest) = (0.0_f64, 0.0_f64);
        for line in std::fs::read_to_string(&path).expect("a curve").lines().skip(1) {
            let cells: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
            plant.advance(cells[0], material.shape_a_per_m, &mut |_| {});
            error = error.max((plant.magnetization_a_per_m() - cells[1]).abs());
            largest = largest.max(cells[1].abs());
        }
        println!("{name}: {:.1e} of max|M|", error / largest);
        (curves, worst) = (curves + 1, worst.max(error / largest));
    }
    assert_eq!(curves, 32);
    assert!(worst < 1e-7, "{worst:.1e} of max|M|");
}

/// ü + k̂u̇ + ĉu = wM: the static gain, and a sine's gain with the amplitude small enough for M to be a sine.
#[test]
fn the_rod_is_that_of_two_poles() {
    let rod = Rod::PRINTED;
    let shape = Material::TERFENOL_D.shape_a_per_m;
    let mut plant = Plant::new(Material::TERFENOL_D, rod, Hidden::default(), TICK_S);
    for _ in 0..1000 {
        plant.advance(5e3, shape, &mut |_| {});
    }
    let expected = rod.gain / rod.stiffness_per_s2 * plant.magnetization_a_per_m();
    assert!((plant.tip_m() / expected - 1.0).abs() < 1e-9, "{} m", plant.tip_m());

    // All reversible: M is a function of the field, linear for a small one.
    let linear = Material {
        reversible_share: 1.0,
        ..Material::TERFENOL_D
    };
    let (hz, amplitude) = (500.0, 10.0);
    let mut plant = Plant::new(
        linear,
        rod,
        Hidden {
            eddy_current_s: 2e-4,
            ..Hidden::default()
        },
        TICK_S / 10.0,
    );
    let slope = linear.magnetization(1.0, 0.0).0;
    let ([mut cosine, mut sine], cycle) = ([0.0; 2], 200);
    for sample in 1..=40 * cycle {
        let phase = TAU * hz * sample as f64 * TICK_S / 10.0;
        plant.advance(amplitude * phase.sin(), shape, &mut |_| {});
        if sample > 39 * cycle {
            cosine += 2.0 / cycle as f64 * phase.cos() * plant.tip_m();
            sine += 2.0 / cycle as f64 * phase.sin() * plant.tip_m();
        }
    }
    let omega = TAU * hz;
    let of_rod = (rod.stiffness_per_s2 - omega * omega).hypot(rod.damping_per_s * omega);
    let gain = amplitude * slope * rod.gain / of_rod / (1.0_f64).hypot(omega * 2e-4);
    let lag = (rod.damping_per_s * omega).atan2(rod.stiffness_per_s2 - omega * omega) + (omega * 2e-4).atan();
    assert!(
        (cosine.hypot(sine) / gain - 1.0).abs() < 1e-3,
        "{}",
        cosine.hypot(sine) / gain
    );
    assert!(
        ((-cosine).atan2(sine) - lag).abs() < 1e-3,
        "{} rad instead of {lag}",
        (-cosine).atan2(sine)
    );
}

/// Noise of 20 nm is the least that a test must see through: what the steps leave is far below, behind lags of a small part of a tick, too.
#[test]
fn sixteen_steps_a_tick_are_enough() {
    let slow = Hidden {
        eddy_current_s: 1.8e-4,
        creep: 0.03,
        friction_m: 1.5e-6,
        backlash_m: 1.8e-6,
        ..Hidden::default()
    };
    let short = Hidden {
        eddy_current_s: 4e-6,
        amplifier_lag_s: 5e-6,
        ..Hidden::default()
    };
    let shape = Material::TERFENOL_D.shape_a_per_m;
    let command = excitation(TICK_S);
    for (hidden, finer) in [(slow, 64), (short, 512)] {
        let mut own = Plant::new(Material::TERFENOL_D, Rod::PRINTED, hidden, TICK_S);
        let mut finer = own.clone().with_substeps(finer);
        let mut square = 0.0;
        for &field in &command[1..] {
            own.advance(field, shape, &mut |_| {});
            finer.advance(field, shape, &mut |_| {});
            square += (own.sensed_m() - finer.sensed_m()).powi(2);
        }
        let rms = (square / command.len() as f64).sqrt();
        println!("{rms:.1e} m rms");
        assert!(rms < 1e-10, "{rms:.1e} m rms");
    }
}

/// A sensor's delay of a tick and a half is that, and its other numbers are what they say.
#[test]
fn the_sensor_does_what_it_says() {
    let quiet = Sensor {
        noise_m: 0.0,
        resolution_m: 1e-15,
        ..Sensor::GOOD
    };
    let with = |sensor: Sensor| {
        Rig { sensor, ..Rig::NOMINAL }
            .record(TICK_S, excitation(TICK_S))
            .displacement_m
    };
    let plain = with(quiet);
    let late = with(Sensor {
        delay_s: 2.0 * TICK_S,
        ..quiet
    });
    assert!(
        plain
            .iter()
            .zip(&late[2..])
            .all(|(one, other)| (one - other).abs() < 2e-15)
    );
    let clipped = with(Sensor {
        relative_gain: 0.1,
        limit_m: 3e-5,
        ..quiet
    });
    for (plain, clipped) in plain.iter().zip(clipped) {
        assert!(((1.1 * plain).clamp(-3e-5, 3e-5) - clipped).abs() < 2e-15);
    }
    let mut noise = Noise::new(3);
    let drawn: Vec<f64> = (0..100_000).map(|_| noise.normal()).collect();
    let moment = |power: i32| drawn.iter().map(|x| x.powi(power)).sum::<f64>() / drawn.len() as f64;
    // Four standard deviations of each.
    assert!(moment(1).abs() < 0.013 && (moment(2) - 1.0).abs() < 0.018 && (moment(4) - 3.0).abs() < 0.13);
}
