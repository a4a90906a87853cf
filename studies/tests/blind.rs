//! A handful of short runs of the blind study, always tested; `anhyst study blind` is the whole of it.

use anhyst_model::ActuatorModel;
use anhyst_studies::blind::{Family, Outcome, Plan, StudyRun, Subject, study};
use anhyst_witness::{Drive, Effect, Nuisance};

/// A run of a second with an effect of twenty noises, or nothing; seeds of their own, the one after so many.
fn run(nuisance: Nuisance, effect: Option<Effect>, drive: Drive, after: usize) -> StudyRun {
    run_of(nuisance, effect, drive, after, 20.0)
}

/// The same with an effect of so many noises.
fn run_of(nuisance: Nuisance, effect: Option<Effect>, drive: Drive, after: usize, gap_over_noise: f64) -> StudyRun {
    let plan = Plan {
        none: 1 + after as u64,
        singles: 1 + after as u64,
        pairs: 0,
        unlisted: 1,
        limits: 0,
        first_seed: 30_000_000,
        rows: 10_000,
    };
    let family = match effect {
        None => Family::None,
        Some(effect) if effect.is_listed() => Family::Single,
        Some(_) => Family::Unlisted,
    };
    let subject = Subject::of(ActuatorModel::terfenol_d()).unwrap();
    let mut cases = plan.cases(&subject);
    cases.retain(|case| case.family == family && case.nuisance == nuisance);
    let mut case = cases.swap_remove(after);
    case.wanted.effects = effect.into_iter().collect();
    case.wanted.gap_over_noise = effect.map(|_| gap_over_noise);
    case.wanted.drive = Some(drive);
    let run = study(&case, &subject);
    println!("{} under {}: {}", run.truth(), run.nuisance, run.answer());
    run
}

/// Guards what a diagnosis is for: whatever disturbs, what is hidden is named, how much of the gap it makes, and where: of some eighty
/// places two may be told wrongly, two missed.
#[test]
fn what_is_hidden_is_named_whatever_disturbs() {
    let (mut claimed, mut there, mut right) = (0, 0, 0);
    for (nuisance, effect) in [
        (Nuisance::Clean, Effect::Friction),
        (Nuisance::Coloured, Effect::EddyCurrent),
        (Nuisance::Hum, Effect::Accommodation),
        (Nuisance::Probe, Effect::AmplifierBandwidth),
        (Nuisance::History, Effect::ExcessLoss),
        (Nuisance::OffNominal, Effect::Backlash),
        (Nuisance::AntiAlias, Effect::EddyCurrent),
        (Nuisance::OtherLaw, Effect::Friction),
        (Nuisance::OtherLaw, Effect::SensorSaturation),
    ] {
        let run = run(nuisance, Some(effect), Drive::Broadband, 0);
        assert!(run.outcome.is_right(), "{run:#?}");
        let part = &run.hidden[0];
        if let (Some(truth), Some(found)) = (part.share, part.share_found) {
            assert!((found - truth).abs() < 0.05, "{run:#?}");
        }
        for own in &run.said.as_ref().unwrap().places {
            (claimed, there, right) = (claimed + own.claimed, there + own.there, right + own.right);
        }
    }
    println!("places: {claimed} told, {there} there, {right} both");
    assert!(claimed <= right + 2 && there <= right + 2);
}

/// Guards the one filter before field and output: a delay or a lag of the amplifier is no difference of two filters with a delay of the sensor or eddy
/// currents beside it.
#[test]
fn what_comes_late_before_one_filter_is_the_amplifiers() {
    for (effect, after) in [(Effect::LoopDelay, 0), (Effect::AmplifierBandwidth, 1)] {
        let run = run(Nuisance::AntiAlias, Some(effect), Drive::Broadband, after);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards the order of filter and converter, and what a coarse lattice hides of the former: it is no lag or delay beside the latter.
#[test]
fn what_a_filter_does_beneath_coarse_steps_is_no_effect() {
    for after in [1, 2] {
        let run = run(Nuisance::AntiAlias, Some(Effect::Quantisation), Drive::Broadband, after);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards the sharp trials of limits: a round one at any level is no edge that a filter behind it rounds.
#[test]
fn a_limit_is_found_behind_a_filter() {
    for after in [1, 2, 4, 5] {
        let run = run(
            Nuisance::AntiAlias,
            Some(Effect::AmplifierSaturation),
            Drive::Sweep,
            after,
        );
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards against a second name for coarse steps behind a recorder's filter, whose lag a delay imitates: the few rows that either leaves on another step
/// are the only numbers that tell the two apart.
#[test]
fn coarse_steps_behind_a_filter_are_one_effect() {
    for after in 0..4 {
        let run = run(Nuisance::AntiAlias, Some(Effect::Quantisation), Drive::Broadband, after);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// A run of the study's own length, by seeds that the study has left.
fn whole_run(first_seed: u64, nuisance: Nuisance, index: usize, hidden: Effect) -> StudyRun {
    let plan = Plan {
        none: 0,
        singles: 23,
        pairs: 0,
        unlisted: 0,
        limits: 0,
        first_seed,
        rows: 40_000,
    };
    let subject = Subject::of(ActuatorModel::terfenol_d()).unwrap();
    let mut cases = plan.cases(&subject);
    cases.retain(|case| case.nuisance == nuisance);
    assert_eq!(cases[index].wanted.effects, [hidden]);
    study(&cases[index], &subject)
}

/// Guards the order of a filter: what it delays by more than another is no effect's, in plain sight of the noise or beneath coarse steps, whose own
/// spectrum is no filter's.
#[test]
fn what_a_filters_order_delays_is_no_effect() {
    for (nuisance, index, hidden) in [
        (Nuisance::AntiAlias, 2, Effect::Backlash),
        (Nuisance::AntiAlias, 19, Effect::Quantisation),
        (Nuisance::All, 11, Effect::Quantisation),
    ] {
        let run = whole_run(72_000_000, nuisance, index, hidden);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards a name against the end of its range: a modulus that grows 4.87 times is fitted best by 5, with nothing left.
#[test]
fn a_size_may_stand_at_its_end_where_nothing_is_left() {
    let run = whole_run(72_000_000, Nuisance::All, 10, Effect::DeltaE);
    assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
}

/// Guards a delay against a mode where the sampling ends, of which only its delay is left.
#[test]
fn a_delay_is_no_mode_out_of_the_band() {
    let run = whole_run(73_000_000, Nuisance::Line, 4, Effect::SensorDelay);
    assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
}

/// Guards values against constants that were bent before the effect joined: a load's mass came out by half too small, three deviations.
#[test]
fn what_bent_without_the_effect_goes_back_beside_it() {
    let run = whole_run(73_000_000, Nuisance::Clean, 2, Effect::LoadChange);
    let intervals = &run.said.as_ref().unwrap().intervals;
    let mass = intervals.iter().find(|own| own.name == "relative_mass").unwrap();
    assert!(
        (mass.value - mass.truth).abs() < 2.0 * mass.standard_deviation,
        "{mass:?}"
    );
}

/// Guards the time in which warmth is lost: it is the rig's, not the library's.
#[test]
fn a_time_of_loss_is_found_with_its_heating() {
    let run = whole_run(73_000_000, Nuisance::Held, 6, Effect::ThermalDrift);
    let intervals = &run.said.as_ref().unwrap().intervals;
    for own in intervals {
        assert!((own.value / own.truth - 1.0).abs() < 0.15, "{own:?}");
    }
}

/// Guards that what is sure is told where nothing else is, however little of the noise it moves: an amplifier's lag behind a filter.
#[test]
fn what_is_sure_is_told_however_small() {
    let run = run_of(
        Nuisance::AntiAlias,
        Some(Effect::AmplifierBandwidth),
        Drive::Multisine,
        0,
        5.0,
    );
    assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
}

/// Guards pairs that something else could stand for: a free curve over the magnetization for both, a drift of the zero for the second.
#[test]
fn what_has_a_name_is_not_left_to_a_curve_or_a_drift() {
    let plan = Plan {
        none: 0,
        singles: 0,
        pairs: 6,
        unlisted: 0,
        limits: 0,
        first_seed: 99_110_000,
        rows: 40_000,
    };
    let subject = Subject::of(ActuatorModel::terfenol_d()).unwrap();
    let cases = plan.cases(&subject).into_iter();
    let pairs: Vec<_> = cases.filter(|case| case.nuisance == Nuisance::Clean).collect();
    for (case, hidden) in [
        (&pairs[5], [Effect::QuadraticMagnetostriction, Effect::Stiffening]),
        (&pairs[1], [Effect::ExcessLoss, Effect::ThermalExpansion]),
    ] {
        assert_eq!(case.wanted.effects, hidden);
        let run = study(case, &subject);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards a mode's gain against the tick, on rigs that go through it in eight steps: straight lines from tick to tick lose up to 2 % of it.
#[test]
fn a_modes_gain_is_that_of_the_rig() {
    for after in 0..4 {
        let run = run(Nuisance::Clean, Some(Effect::SecondMode), Drive::Broadband, after);
        let intervals = &run.said.as_ref().unwrap().intervals;
        let gain = intervals.iter().find(|own| own.name == "gain").unwrap();
        println!("{intervals:?}");
        assert!(
            (gain.value - gain.truth).abs() < 3.0 * gain.standard_deviation,
            "{gain:?}"
        );
    }
}

/// Guards noise like 1/f beside a small effect: what shows as white has a part of it (`MAX_LEAK`), and the rest is no misfit beneath which nothing is seen.
#[test]
fn noise_like_1_f_hides_no_small_effect() {
    let run = run(Nuisance::Coloured, Some(Effect::BiasShift), Drive::Broadband, 4);
    assert!(run.outcome.is_right(), "{run:#?}");
}

/// Guards against names for the form of a law: diffusion is no lag, loss and load, round gaps are no friction, and what the library says otherwise
/// (a loss that grows like the logarithm, a mode that is damped against the rod) is no second effect.
#[test]
fn another_law_of_a_kind_is_one_name() {
    for effect in [
        Effect::EddyCurrent,
        Effect::AmplifierBandwidth,
        Effect::Backlash,
        Effect::ExcessLoss,
        Effect::SecondMode,
    ] {
        let run = run(Nuisance::OtherLaw, Some(effect), Drive::Broadband, 0);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards against false alarms: a nuisance alone is no effect, even where noise moves the constants so that more is left than with those given,
/// nor is a filter whose field is a straight line between the rows, whose order the noise beneath the gap shows only once the gap is explained,
/// or which only the motion tells.
#[test]
fn nothing_is_named_where_nothing_is_hidden() {
    for (nuisance, drive, after) in [
        (Nuisance::Coloured, Drive::Multisine, 12),
        (Nuisance::Hum, Drive::Broadband, 0),
        (Nuisance::History, Drive::Broadband, 0),
        (Nuisance::Drift, Drive::Broadband, 0),
        (Nuisance::AntiAlias, Drive::Broadband, 2),
        (Nuisance::AntiAlias, Drive::Broadband, 6),
        (Nuisance::AntiAlias, Drive::Multisine, 3),
        (Nuisance::All, Drive::Broadband, 0),
    ] {
        let run = run(nuisance, None, drive, after);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards a name that works against the rest of the gap: a bias that takes away what was magnetised before the run.
#[test]
fn parts_that_cancel_are_both_there_where_they_explain_all() {
    // The first of them from another first magnetization.
    for after in [0, 2, 4] {
        let run = run(Nuisance::History, Some(Effect::BiasShift), Drive::Broadband, after);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}

/// Guards trust in a name: what the library does not hold is given none of its names, nor two whose parts cancel.
#[test]
fn what_nobody_listed_is_unknown() {
    for (nuisance, effect, drive, gap_over_noise) in [
        (Nuisance::Clean, Effect::XRipple, Drive::Broadband, 20.0),
        (Nuisance::Clean, Effect::XAsymmetry, Drive::Broadband, 20.0),
        // What was tried is believed more than that nothing is missing.
        (Nuisance::Line, Effect::XAsymmetry, Drive::Sweep, 6.0),
        (Nuisance::Probe, Effect::XAsymmetry, Drive::Broadband, 6.0),
    ] {
        let run = run_of(nuisance, Some(effect), drive, 0, gap_over_noise);
        assert_eq!(run.outcome, Outcome::Right, "{run:#?}");
    }
}
