use super::*;
use anhyst_controller::TrajectorySettings;

const EXPECT: Expect = Expect {
    tolerance_m: Some(1e-6),
    ..Expect::NONE
};

// Guards against a verdict on nothing: with every demand late no error is judged, and that is no success.
#[test]
fn a_run_of_which_nothing_was_judged_does_not_hold() {
    let mut judge = Judge::new(EXPECT, 1e-3, 1e4);
    let see = |judge: &mut Judge, tick: u64, demanded: u64| {
        let truth = Truth {
            tick,
            ..Truth::default()
        };
        let demand = Demand {
            tick: demanded,
            ..Demand::default()
        };
        let fields = (&SafeField::default(), &CoilField::default());
        judge.observe(
            tick,
            (&Measurement::default(), &truth),
            &Estimate::default(),
            &demand,
            fields,
        );
    };
    see(&mut judge, 5, 4);
    assert!(judge.verdict().failures(&EXPECT)[0].contains("not one of 1 ticks"));
    see(&mut judge, 6, 6);
    assert!(judge.verdict().failures(&EXPECT).is_empty());
    // Of three ticks two went by while the judge's process was not there.
    let most = judge.verdict().of_ticks(3, 1e-3, &EXPECT);
    assert_eq!((most.unjudged_ticks, most.failures(&EXPECT).len()), (2, 1));
}

// Guards the guard's word: what leaves it, and what is in the coil, is held against its lowest field, too.
#[test]
fn fields_below_the_lowest_are_counted() {
    let below = |lowest: Option<f64>, given: f64, coil: f64| {
        let mut judge = Judge::new(EXPECT, 1e-3, 1e4).with_lowest_field(lowest);
        let given = SafeField {
            field_a_per_m: given,
            ..SafeField::default()
        };
        let coil = CoilField {
            field_a_per_m: coil,
            ..CoilField::default()
        };
        let (measured, truth) = (Measurement::default(), Truth::default());
        judge.observe(
            0,
            (&measured, &truth),
            &Estimate::default(),
            &Demand::default(),
            (&given, &coil),
        );
        let verdict = judge.verdict();
        assert_eq!(verdict.field_lowest_a_per_m, given.field_a_per_m);
        verdict.beyond_limit_ticks
    };
    assert_eq!(below(None, -1e4, -1e4), 0);
    assert_eq!(below(Some(-2e3), -2e3, -2050.0), 0);
    assert_eq!(below(Some(-2e3), -2001.0, 0.0), 1);
    assert_eq!(below(Some(-2e3), 0.0, -2101.0), 1);
}

// Guards against blaming the guard: the amplifier takes the field away by itself, and the summary must tell.
#[test]
fn an_amplifier_that_goes_its_own_way_is_counted() {
    let mut judge = Judge::new(EXPECT, 1e-3, 1e4);
    let limited = CoilField::AMPLITUDE_LIMITED | CoilField::SLEW_LIMITED;
    for (tick, status) in [limited, CoilField::RAMPING, CoilField::SAFE, CoilField::RETURNING, 0]
        .into_iter()
        .enumerate()
    {
        let coil = CoilField {
            status,
            ..CoilField::default()
        };
        let (truth, demand) = (Truth::default(), Demand::default());
        let fields = (&SafeField::default(), &coil);
        judge.observe(
            tick as u64,
            (&Measurement::default(), &truth),
            &Estimate::default(),
            &demand,
            fields,
        );
    }
    let verdict = judge.verdict();
    assert_eq!((verdict.watchdog_ticks, verdict.first_watchdog_tick), (3, 1));
}

/// Guards the truth between the samples: a tip that is right at every sample and elsewhere between them does not hold.
#[test]
fn an_error_between_the_samples_is_judged() {
    let trajectory = || Trajectory::load(&TrajectorySettings::Rest, 0.0, 1e-3, std::path::Path::new(".")).unwrap();
    for (displacement_between_m, told) in [
        (0.9e-6, ""),
        (2e-6, "2.000 µm at 0.0065 s, between the samples,"),
        (f64::NAN, "NaN"),
    ] {
        let mut judge = Judge::new(EXPECT, 1e-3, 1e4).following(Some(trajectory()));
        for tick in 0..10 {
            let truth = Truth {
                tick,
                displacement_between_m: if tick == 7 { displacement_between_m } else { 0.0 },
                ..Truth::default()
            };
            let demand = Demand {
                tick,
                ..Demand::default()
            };
            let fields = (&SafeField::default(), &CoilField::default());
            let (measured, estimate) = (Measurement::default(), Estimate::default());
            judge.observe(tick, (&measured, &truth), &estimate, &demand, fields);
        }
        let verdict = judge.verdict();
        let failures = verdict.failures(&EXPECT);
        assert_eq!(failures.len(), usize::from(!told.is_empty()), "{failures:?}");
        assert!(failures.iter().all(|own| own.contains(told)), "{failures:?}");
        assert_eq!(verdict.first_exceeded_at_s.is_some(), !told.is_empty());
        // Before the first sample there is nothing; rms over the nine others.
        let rms_m = verdict.between.unwrap().rms_m;
        assert!((rms_m - displacement_between_m / 3.0).abs() < 1e-12 || rms_m.is_nan());
    }
}

// Guards that a cut whose field was beyond every limit, or no number, is never called good, however small its error.
#[test]
fn a_wild_field_does_not_hold() {
    let failures = |asked: f64, in_coil: f64| {
        let mut judge = Judge::new(EXPECT, 1e-3, 1e4);
        let asked = SafeField {
            field_a_per_m: asked,
            ..SafeField::default()
        };
        let in_coil = CoilField {
            field_a_per_m: in_coil,
            ..CoilField::default()
        };
        let (truth, demand) = (Truth::default(), Demand::default());
        judge.observe(
            0,
            (&Measurement::default(), &truth),
            &Estimate::default(),
            &demand,
            (&asked, &in_coil),
        );
        judge.verdict().failures(&EXPECT)
    };
    assert_eq!(failures(1e4, -1.01e4), Vec::<String>::new());
    assert_eq!(
        failures(0.0, f64::NAN),
        ["coil_field_not_finite: the amplifier said a field that is no finite number in 1 ticks, first in tick 0"]
    );
    assert!(failures(1.000_1e4, 0.0)[0].contains("beyond the guard's limit in 1 ticks"));
    assert!(failures(0.0, -1.02e4)[0].contains("up to 10.20 kA/m"));
    for wild in [f64::NAN, f64::INFINITY] {
        assert!(failures(wild, 0.0)[0].contains("no finite number in 1 ticks"));
        assert!(failures(0.0, wild)[0].contains("no finite number in 1 ticks"));
    }
}
