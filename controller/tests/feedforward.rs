//! Guards the rod's inverse and the hold's correction: tracking through an exactly propagated two-pole rod, no feedback.

mod common;

use anhyst_controller::TrajectorySettings;
use anhyst_model::Magnetostriction;
use common::{Rig, TICK_S, largest, rms, settings, two_tones};

/// Error after the start, in m: rms, max.
fn tracking(hold_correction: bool, law: Option<Magnetostriction>, mean_m: f64) -> (f64, f64) {
    let TrajectorySettings::Harmonics { terms, .. } = two_tones() else {
        panic!()
    };
    let mut settings = settings(TrajectorySettings::Harmonics { mean_m, terms });
    settings.start_s = 0.05;
    settings.hold_correction = hold_correction;
    let mut rig = Rig::new(&settings);
    if let Some(law) = law {
        rig.material.magnetostriction = law;
        rig.controller = anhyst_controller::Controller::new(
            &settings,
            common::rod(),
            &rig.material,
            TICK_S,
            std::path::Path::new("."),
        )
        .unwrap();
    }
    let errors = rig.errors(0.3);
    let steady = &errors[(0.1 / TICK_S) as usize..];
    (rms(steady), largest(steady))
}

/// 50 and 150 Hz at 20 kHz: the uncorrected hold leaves A·(ωT)²/12 of both, nanometres; the corrected one picometres.
#[test]
fn hold_correction_takes_tracking_from_nanometres_to_picometres() {
    let without = tracking(false, None, 0.0);
    let with = tracking(true, None, 0.0);
    println!(
        "without the correction: {:.3e} m rms, {:.3e} m max",
        without.0, without.1
    );
    println!("with the correction:    {:.3e} m rms, {:.3e} m max", with.0, with.1);
    assert!(with.1 < 1e-11, "{with:?}");
    assert!(without.1 > 1e-9, "{without:?}");
}

/// The residue of the uncorrected hold is the closed form A·(ωT)²/12, to the 0.3 % that images of the lines add.
#[test]
fn what_the_hold_takes_away_is_its_closed_form() {
    let mut settings = settings(TrajectorySettings::Harmonics {
        mean_m: 0.0,
        terms: vec![(40e-6, 50.0, 0.0)],
    });
    settings.start_s = 0.05;
    settings.hold_correction = false;
    let errors = Rig::new(&settings).errors(0.3);
    let omega_tick = std::f64::consts::TAU * 50.0 * TICK_S;
    let expected = 40e-6 * omega_tick * omega_tick / 12.0;
    let found = largest(&errors[(0.1 / TICK_S) as usize..]);
    assert!(
        (found / expected - 1.0).abs() < 5e-3,
        "{found:e} m, expected {expected:e} m"
    );
}

/// Curved strain laws: λ⁻¹ is taken, and what the correction leaves is T²/12·λ''/λ'·(dM/dt)², below 1 nm here.
#[test]
fn curved_strain_laws_are_inverted() {
    for (law, mean_m) in [
        (
            Magnetostriction::Biased {
                saturation_magnetostriction: 1.005e-3,
                bias_fraction: 0.5,
            },
            0.0,
        ),
        (
            Magnetostriction::Quadratic {
                saturation_magnetostriction: 1.005e-3,
            },
            60e-6,
        ),
    ] {
        let (rms_m, max_m) = tracking(true, Some(law), mean_m);
        println!("{law:?}: {rms_m:.3e} m rms, {max_m:.3e} m max");
        assert!(max_m < 5e-9, "{law:?}: {max_m:e} m");
    }
}

/// The rate that travels beside the demand is its derivative, through the strain law.
#[test]
fn rate_is_the_derivative_of_the_feedforward() {
    let mut rig = Rig::new(&settings(two_tones()));
    let demands: Vec<_> = (0..2000).map(|_| rig.step((0.0, 0.0)).0).collect();
    let peak = demands.iter().fold(0.0_f64, |peak, demand| {
        peak.max(demand.magnetization_rate_a_per_m_s.abs())
    });
    for three in demands.windows(3) {
        let numeric = (three[2].feedforward_a_per_m - three[0].feedforward_a_per_m) / (2.0 * TICK_S);
        let found = three[1].magnetization_rate_a_per_m_s;
        assert!(
            (numeric - found).abs() < 1e-3 * peak,
            "{numeric} against {found} A/(m s)"
        );
    }
}

/// A trajectory that saturation cannot give is refused with the numbers that show it.
#[test]
fn unreachable_profiles_are_refused() {
    let far = TrajectorySettings::Harmonics {
        mean_m: 0.0,
        terms: vec![(400e-6, 50.0, 0.0)],
    };
    let refusal = common::controller(&settings(far)).validate_reach(0.1).unwrap_err();
    println!("{refusal}");
    assert!(refusal.sentence.contains("765000 A/m"), "{refusal}");
    let near = common::controller(&settings(two_tones()));
    near.validate_reach(0.1).unwrap();
    let peak = near.peak_magnetization(0.1);
    println!("peak {} A/m at {} s", peak.magnetization_a_per_m, peak.time_s);
    assert!((1.5e5..2.6e5).contains(&peak.magnetization_a_per_m.abs()));
}
