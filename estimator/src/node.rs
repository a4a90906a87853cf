//! The estimator in the loop: which tokens it reads and what it says.

use crate::law::is_credible;
use crate::{Estimation, Estimator};
use anhyst_ipc::{Block, Estimate, Measurement, NodeId, Now, Previous, SafeField, status_word};

impl Block for Estimator {
    const NODE: NodeId = NodeId::Estimator;
    type Inputs = (Now<Measurement>, Previous<SafeField>);
    type Outputs = (Estimate,);

    fn step(&mut self, tick: u64, (Now(measured), Previous(safe)): Self::Inputs) -> Self::Outputs {
        // A measurement of another tick says where the rod was then: compared with where it is now, it would mislead.
        let (coil_a_per_m, displacement_m) = if measured.tick == tick {
            (measured.coil_field_a_per_m, measured.displacement_m)
        } else {
            (f64::NAN, f64::NAN)
        };
        let estimation = Estimator::step(self, tick, safe.field_a_per_m, coil_a_per_m, displacement_m);
        (estimate(&estimation, is_credible(displacement_m)),)
    }

    /// The field has gone on, and the rod with it: a hysteresis needs all of it.
    fn follow(&mut self, tick: u64, inputs: Self::Inputs) {
        Block::step(self, tick, inputs);
    }
}

fn estimate(estimation: &Estimation, measured: bool) -> Estimate {
    let correction = &estimation.correction;
    let (values, deviations, informed_directions) = match &estimation.parameters {
        None => Default::default(),
        Some(all) => (
            all.hysteresis.parameters(),
            all.deviations,
            u64::from(all.informed_directions),
        ),
    };
    let [
        saturation_magnetization_a_per_m,
        _,
        pinning_a_per_m,
        coupling,
        reversibility,
    ] = values;
    let [
        saturation_magnetization_deviation_a_per_m,
        _,
        pinning_deviation_a_per_m,
        coupling_deviation,
        reversibility_deviation,
    ] = deviations;
    let weight = estimation.weight.unwrap_or_default();
    Estimate {
        shape_a_per_m: correction.shape_a_per_m,
        field_a_per_m: estimation.field.now_a_per_m,
        magnetization_a_per_m: estimation.magnetization_a_per_m,
        next_field_a_per_m: estimation.field.next_a_per_m,
        output_error_m: correction.output_error_m,
        predicted_output_m: correction.predicted_output_m,
        lower_cover_m: correction.lower_cover_m,
        upper_cover_m: correction.upper_cover_m,
        slope_m_per_a_per_m: correction.slope_m_per_a_per_m,
        standard_deviation_a_per_m: correction.standard_deviation_a_per_m,
        information_per_a2_per_m2: estimation.excitation.information_per_a2_per_m2,
        excitation_above_per_a_per_m: finite_inverse(estimation.excitation.least_error_above_a_per_m),
        excitation_below_per_a_per_m: finite_inverse(estimation.excitation.least_error_below_a_per_m),
        saturation_magnetization_a_per_m,
        pinning_a_per_m,
        coupling,
        reversibility,
        saturation_magnetization_deviation_a_per_m,
        pinning_deviation_a_per_m,
        coupling_deviation,
        reversibility_deviation,
        informed_directions,
        weight_index: weight.index,
        weight: weight.value,
        status: status_word([
            (correction.adapting, Estimate::ADAPTING),
            (correction.at_edge, Estimate::AT_EDGE),
            (correction.held, Estimate::HELD),
            (correction.fixed, Estimate::FIXED),
            (estimation.outlier, Estimate::OUTLIER),
            (!measured, Estimate::UNMEASURED),
        ]),
        ..Estimate::default()
    }
}

/// An infinite number has no place in a token: not that of a condition that never holds, and not the inverse of one that
/// holds for any error, as without a dead zone.
fn finite_inverse(least_error_a_per_m: f64) -> f64 {
    (1.0 / least_error_a_per_m).clamp(0.0, f64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{EstimatorSettings, LawSettings};
    use anhyst_ipc::{Channel, wiring};
    use anhyst_model::{AmplifierConstants, Material, TwoPole};

    /// The paper's, its gain per strain.
    const ROD: TwoPole = TwoPole {
        gain: 6.965e6,
        damping_per_s: 7.8899e3,
        stiffness_per_s2: 6.4251e7,
        force_gain_per_kg: 0.0,
    };

    // Guards the arrows of the loop: the safe field is the one of the tick before, the only way to break the circle.
    #[test]
    fn reads_this_measurement_and_the_last_safe_field() {
        let arrows: Vec<_> = wiring::<Estimator>()
            .iter()
            .map(|wire| (wire.channel, wire.delay))
            .collect();
        assert_eq!(arrows, [(Channel::Measurement, 0), (Channel::SafeField, 1)]);
    }

    // Guards the message: tick 0 is a demagnetised rod, a fixed estimate says so, and a silent sensor is told.
    #[test]
    fn tick_zero_and_status_bits() {
        let make = |law| {
            let settings = EstimatorSettings {
                law,
                ..EstimatorSettings::default()
            };
            Estimator::new(
                &settings,
                &Material::terfenol_d(),
                ROD,
                AmplifierConstants::default(),
                5e-5,
            )
            .unwrap()
        };
        let mut fixed = make(LawSettings::FixedShape { shape_a_per_m: 7012.0 });
        let silent = Measurement {
            tick: 1,
            displacement_m: f64::NAN,
            ..Measurement::default()
        };
        let (first,) = Block::step(
            &mut fixed,
            0,
            (Now(Measurement::default()), Previous(SafeField::default())),
        );
        assert_eq!(
            (first.shape_a_per_m, first.field_a_per_m, first.status),
            (7012.0, 0.0, Estimate::FIXED)
        );
        let (second,) = Block::step(&mut fixed, 1, (Now(silent), Previous(SafeField::default())));
        assert_eq!(
            (second.status, second.output_error_m),
            (Estimate::FIXED | Estimate::HELD | Estimate::UNMEASURED, 0.0)
        );
        let mut folded = make(LawSettings::default());
        let (first,) = Block::step(&mut folded, 0, (Now(silent), Previous(SafeField::default())));
        assert_eq!(
            (first.shape_a_per_m, first.status),
            (6800.0, Estimate::HELD | Estimate::UNMEASURED)
        );
    }

    // Guards real time: where measurements are late, the old one that is there does not move the estimate.
    #[test]
    fn an_old_measurement_is_none() {
        let (material, amplifier) = (Material::terfenol_d(), AmplifierConstants::default());
        let make = |law| {
            let settings = EstimatorSettings {
                law,
                ..EstimatorSettings::default()
            };
            Estimator::new(&settings, &material, ROD, amplifier, 5e-4).unwrap()
        };
        let shape_a_per_m = 7012.0;
        let mut actuator = make(LawSettings::FixedShape { shape_a_per_m });
        let mut estimator = make(LawSettings::default());
        let (mut worst_a_per_m, mut old) = (0.0_f64, Measurement::default());
        for tick in 0..4000 {
            let field_a_per_m = 9000.0 * libm::sin(std::f64::consts::TAU * 50.0 * 5e-4 * tick as f64);
            let truth = Estimator::step(&mut actuator, tick, field_a_per_m, f64::NAN, f64::NAN);
            let measured = Measurement {
                tick,
                displacement_m: truth.correction.predicted_output_m,
                ..Measurement::default()
            };
            let late = tick >= 2000 && tick % 100 < 5;
            old = if late { old } else { measured };
            let safe = SafeField {
                field_a_per_m,
                ..SafeField::default()
            };
            let (estimate,) = Block::step(&mut estimator, tick, (Now(old), Previous(safe)));
            assert_eq!(estimate.status & Estimate::UNMEASURED != 0, late, "tick {tick}");
            if tick >= 1900 {
                worst_a_per_m = worst_a_per_m.max((estimate.shape_a_per_m - shape_a_per_m).abs());
            }
        }
        assert!(worst_a_per_m < 5.0, "{worst_a_per_m} A/m");
    }

    // Guards what the estimate says of itself: nothing at rest, more than the limit once the rod moves, always a number.
    #[test]
    fn the_estimate_says_how_well_it_is_informed() {
        let (material, amplifier) = (Material::terfenol_d(), AmplifierConstants::default());
        for name in LawSettings::ADAPTIVE {
            let settings = EstimatorSettings {
                law: LawSettings::named(name).unwrap(),
                ..EstimatorSettings::default()
            };
            let mut estimator = Estimator::new(&settings, &material, ROD, amplifier, 5e-5).unwrap();
            let mut last = Estimate::default();
            for tick in 0..4000 {
                let angle = std::f64::consts::TAU * 50.0 * 5e-5 * tick as f64;
                let safe = SafeField {
                    field_a_per_m: 9000.0 * angle.sin(),
                    ..SafeField::default()
                };
                let measured = Measurement {
                    tick,
                    ..Measurement::default()
                };
                (last,) = Block::step(&mut estimator, tick, (Now(measured), Previous(safe)));
                let said = [
                    last.information_per_a2_per_m2,
                    last.excitation_above_per_a_per_m,
                    last.excitation_below_per_a_per_m,
                ];
                let right = said.iter().all(|value| value.is_finite() && *value >= 0.0);
                assert!(right, "{name}: {said:?} at tick {tick}");
                assert!(tick > 0 || said[0] == 0.0, "{name}: {said:?} at tick {tick}");
            }
            let worst = settings.excitation.worst_deviation_a_per_m;
            assert!(
                1.0 / last.information_per_a2_per_m2.sqrt() < worst && last.status & Estimate::HELD == 0,
                "{name}"
            );
        }
    }
}
