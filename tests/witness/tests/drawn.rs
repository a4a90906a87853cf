//! Guards what a study rests on: drawn runs repeat, are what their truth says, and disturb as told.

use anhyst_witness::{Drive, Effect, Filter, Made, Nuisance, Rig, Surroundings, Wanted};

const TICK_S: f64 = 1e-4;

fn drawn(effects: Vec<Effect>, nuisance: Nuisance, seed: u64) -> Made {
    let wanted = Wanted {
        effects,
        nuisance,
        drive: Some(Drive::Broadband),
        gap_over_noise: None,
        rows: 5_000,
    };
    Rig::NOMINAL
        .draw(seed, &wanted)
        .unwrap_or_else(|refusal| panic!("{refusal}"))
}

fn rms(values: &[f64]) -> f64 {
    (values.iter().map(|value| value * value).sum::<f64>() / values.len() as f64).sqrt()
}

/// Every nuisance once, each with another effect.
#[test]
fn runs_are_what_their_truth_says() {
    for (place, nuisance) in Nuisance::ALL.into_iter().enumerate() {
        let effect = Effect::OF_TWO_LAWS[place % Effect::OF_TWO_LAWS.len()];
        let seed = 40 + place as u64;
        let made = drawn(vec![effect], nuisance, seed);
        let (truth, part) = (&made.truth, &made.truth.parts[0]);
        let ratio = part.gap_m / truth.noise_m;
        println!(
            "{} {}: {ratio:.1}, share {:.3}",
            nuisance.name(),
            truth.name(),
            part.share
        );
        assert!((3.0..=100.0).contains(&ratio));
        let own = &part.contribution_m;
        let mean = own.iter().sum::<f64>() / own.len() as f64;
        let deviation = rms(&own.iter().map(|value| value - mean).collect::<Vec<f64>>());
        assert!((deviation / part.gap_m - 1.0).abs() < 1e-12);
        if matches!(
            nuisance,
            Nuisance::Clean | Nuisance::Held | Nuisance::OtherLaw | Nuisance::Probe
        ) {
            // Nothing but noise is beside it.
            let expected = part.gap_m.powi(2) / (part.gap_m.powi(2) + truth.noise_m.powi(2));
            assert!((part.share - expected).abs() < 0.02, "{}", part.share);
            assert!(truth.gap_of_the_nuisance_m < 1e-9);
        }
        if seed == 40 {
            assert_eq!(made, drawn(vec![effect], nuisance, seed));
        }
    }
}

/// Two at once: what each adds beside the other; together they make the gap.
#[test]
fn two_effects_share_the_gap() {
    let made = drawn(vec![Effect::EddyCurrent, Effect::Backlash], Nuisance::Coloured, 7);
    let shares: f64 = made.truth.parts.iter().map(|part| part.share).sum();
    let noise = (made.truth.noise_m / made.truth.gap_m).powi(2);
    assert!((shares + noise - 1.0).abs() < 0.15, "{shares} + {noise}");
}

/// Nothing hidden: a wrong probe, lines and a past make the gaps that they must.
#[test]
fn disturbances_alone_hide_nothing() {
    let gap = |nuisance| drawn(Vec::new(), nuisance, 3).truth.gap_of_the_nuisance_m;
    assert!(gap(Nuisance::Clean) < 1e-9 && gap(Nuisance::Probe) < 1e-9 && gap(Nuisance::Held) < 1e-9);
    assert!((5e-9..25e-9).contains(&gap(Nuisance::Line)));
    assert!(gap(Nuisance::History) > 50e-9 && gap(Nuisance::OffNominal) > 20e-9);
    let coloured = drawn(Vec::new(), Nuisance::Coloured, 3);
    // As slow as the run in parts, so not at the rms that was asked for.
    let own = &coloured.rig;
    let wanted = own.sensor.noise_m.hypot(own.surroundings.coloured_m);
    assert!((0.6..1.4).contains(&(coloured.truth.noise_m / wanted)));
}

/// The filter's gain is Butterworth's on white noise: its noise bandwidth is (π/2n)/sin(π/2n) of its corner.
#[test]
fn the_filter_is_butterworths() {
    for order in [2, 3, 6] {
        let filter = Filter {
            order,
            corner_hz: 1000.0,
            field_too: false,
        };
        let mut rig = Rig {
            surroundings: Surroundings {
                filter: Some(filter),
                ..Surroundings::NOTHING
            },
            substeps: 8,
            ..Rig::NOMINAL
        };
        rig.sensor.noise_m = 1.0;
        let left = rms(&rig.noise_m(TICK_S, 100_000));
        let angle = 0.5 * std::f64::consts::PI / order as f64;
        let expected = (1000.0 / 5000.0 * angle / angle.sin()).sqrt();
        assert!(
            (left / expected - 1.0).abs() < 0.02,
            "order {order}: {left} instead of {expected}"
        );
    }
}
