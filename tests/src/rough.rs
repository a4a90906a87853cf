//! Rigs as they are, and worse: the witness with constants, effects and sensors drawn from a seed.

use crate::{SensorFaults, Witness};
use anhyst_witness::{Constants, Hidden, Laws, Material, Mode, Noise, Plant, Rod, Shaking};

const TICK_S: f64 = 5e-5;

/// Between the ends, uniformly.
fn within(noise: &mut Noise, ends: [f64; 2]) -> f64 {
    ends[0] + (ends[1] - ends[0]) * noise.uniform()
}

/// 10 nm white, 10 nm whose power falls as 1/f, 5 nm at 49.97 Hz; a probe off by 0.3 % and 3 A/m.
pub fn faults(mut noise: Noise) -> SensorFaults {
    let mut slow = [0.0; 6];
    let added_m = move |time_s: f64| {
        // First-order noises a factor 5 apart, from 0.25 ms on: a spectrum like 1/f.
        let mut kept: f64 = 0.8;
        for own in &mut slow {
            *own = kept * *own + (1.0 - kept * kept).sqrt() * noise.normal();
            kept = kept.powf(0.2);
        }
        let coloured: f64 = slow.iter().sum();
        4e-9 * coloured + 5e-9 * (std::f64::consts::TAU * 49.97 * time_s).sin()
    };
    SensorFaults {
        added_m: Box::new(added_m),
        field_gain: 1.003,
        field_zero_a_per_m: 3.0,
    }
}

/// The plant that milling.ron believes in, with such a sensor: what no learning can be better than.
pub fn nominal(seed: u64) -> Witness {
    let plant = Plant::new(Material::TERFENOL_D, Rod::PRINTED, Hidden::NOTHING, TICK_S);
    witness(plant, 1.0, seed)
}

fn witness(plant: Plant, shape: f64, seed: u64) -> Witness {
    let noise = |own: u64| Noise::new(0x5eed_0000 + 4 * seed + own);
    Witness {
        plant,
        tick_s: TICK_S,
        shape_a_per_m: Box::new(move |time_s| shape * (6400.0 + 200.0 * time_s).min(7200.0)),
        mode: None,
        pushed_m: Box::new(|_| 0.0),
        late_ticks: 0,
        before_m: 0.0,
        of_displacement: noise(0),
        of_field: noise(1),
        faults: Some(faults(noise(2))),
    }
}

/// A plant whose k, c and Ms are so many times what is believed, with white noise on its sensors and nothing else.
pub fn other_material([pinning, reversible, saturation]: [f64; 3]) -> Witness {
    let usual = Material::TERFENOL_D;
    let material = Material {
        pinning_a_per_m: pinning * usual.pinning_a_per_m,
        reversible_share: reversible * usual.reversible_share,
        saturation_a_per_m: saturation * usual.saturation_a_per_m,
        ..usual
    };
    Witness {
        faults: None,
        ..witness(Plant::new(material, Rod::PRINTED, Hidden::NOTHING, TICK_S), 1.0, 0)
    }
}

/// Every constant a few per cent off, and a little of everything.
pub fn rough(seed: u64) -> Witness {
    let mut noise = Noise::new(seed);
    let own = &mut noise;
    let mut off = |deviation: f64| 1.0 + deviation * own.normal();
    let usual = Material::TERFENOL_D;
    let shape = off(0.01);
    let material = Material {
        saturation_a_per_m: off(0.01) * usual.saturation_a_per_m,
        shape_a_per_m: shape * 6400.0,
        pinning_a_per_m: off(0.03) * usual.pinning_a_per_m,
        reversible_share: off(0.06) * usual.reversible_share,
        ..usual
    };
    let rod = Rod {
        stiffness_per_s2: off(0.02) * Rod::PRINTED.stiffness_per_s2,
        damping_per_s: off(0.03) * Rod::PRINTED.damping_per_s,
        ..Rod::PRINTED
    };
    let hidden = Hidden {
        eddy_current_s: within(own, [70e-6, 150e-6]),
        creep: within(own, [0.02, 0.05]),
        friction_m: within(own, [0.12e-6, 0.28e-6]),
        constants: Constants {
            creep_stretch: within(own, [0.5, 1.5]),
            friction_speed_m_per_s: within(own, [0.5e-3, 1.5e-3]),
            ..Constants::USUAL
        },
        ..Hidden::NOTHING
    };
    let mode = Mode {
        gain: within(own, [0.02, 0.04]),
        hz: within(own, [600.0, 1100.0]),
        damping_ratio: within(own, [0.02, 0.05]),
    };
    Witness {
        mode: Some(Shaking::new(mode, 0.0, Laws::Usual)),
        ..witness(Plant::new(material, rod, hidden, TICK_S), shape, seed)
    }
}

/// Constants up to 20 % off, eddy currents, up to three ticks more of delay, a mode anywhere above 300 Hz; `a` stays.
pub fn wild(seed: u64) -> Witness {
    let mut noise = Noise::new(seed);
    let own = &mut noise;
    let mut off = || within(own, [0.8, 1.2]);
    let usual = Material::TERFENOL_D;
    let shape_a_per_m = off() * 6800.0;
    let material = Material {
        saturation_a_per_m: off() * usual.saturation_a_per_m,
        shape_a_per_m,
        pinning_a_per_m: off() * usual.pinning_a_per_m,
        reversible_share: off() * usual.reversible_share,
        ..usual
    };
    let rod = Rod {
        gain: off() * Rod::PRINTED.gain,
        stiffness_per_s2: off() * Rod::PRINTED.stiffness_per_s2,
        damping_per_s: off() * Rod::PRINTED.damping_per_s,
        ..Rod::PRINTED
    };
    let hidden = Hidden {
        eddy_current_s: within(own, [0.0, 200e-6]),
        ..Hidden::NOTHING
    };
    let mode = Mode {
        gain: within(own, [0.02, 0.04]),
        hz: 300.0 * within(own, [0.0, 10_f64.ln()]).exp(),
        damping_ratio: within(own, [0.02, 0.05]),
    };
    Witness {
        shape_a_per_m: Box::new(move |_| shape_a_per_m),
        mode: Some(Shaking::new(mode, 0.0, Laws::Usual)),
        late_ticks: within(own, [0.0, 4.0]) as usize,
        ..witness(Plant::new(material, rod, hidden, TICK_S), 1.0, seed)
    }
}
