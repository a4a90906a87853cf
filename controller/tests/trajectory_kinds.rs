//! Guards the trajectories that are scanned, stepped, swept and excited with: derivatives and joints of random ones, bounds, closed forms.

mod common;

use anhyst_controller::{
    Course, Lines, MultisineSettings, RasterSettings, SawtoothSettings, Spacing, StepsSettings, Sweep, Trajectory,
    TrajectorySettings, TriangleSettings,
};
use common::{TICK_S, derivatives};
use proptest::prelude::*;
use std::f64::consts::{PI, TAU};
use std::path::Path;

fn load(settings: &TrajectorySettings) -> Trajectory {
    Trajectory::load(settings, 0.0, TICK_S, Path::new(".")).unwrap()
}

fn position(trajectory: &Trajectory, time_s: f64) -> f64 {
    trajectory.at(time_s).position_m
}

fn steps(levels_m: &[f64], over_s: f64) -> StepsSettings {
    StepsSettings {
        levels_m: levels_m.to_vec(),
        dwell_s: 0.01,
        over_s,
        velocity_limit_m_per_s: None,
        acceleration_limit_m_per_s2: None,
        repeat: false,
    }
}

/// A trajectory, its shortest time (s), and the ends that it stays between (m).
type Instance = (TrajectorySettings, f64, (f64, f64));

fn around(mean_m: f64, amplitude_m: f64) -> (f64, f64) {
    (mean_m - amplitude_m, mean_m + amplitude_m)
}

prop_compose! {
    fn random_steps()(
        heights_m in prop::collection::vec(1e-6..10e-6, 2..6),
        over_s in 1e-3..20e-3,
        limits in (prop::option::of(1e-3..1e-1), prop::option::of(1.0..100.0)),
        repeat: bool,
    ) -> Instance {
        let levels_m: Vec<f64> = (1..).zip(heights_m).map(|(factor, height_m)| {
            height_m * f64::from(if factor % 2 == 0 { factor } else { -factor })
        }).collect();
        let ends = levels_m.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), own| {
            (low.min(*own), high.max(*own))
        });
        let settings = StepsSettings {
            velocity_limit_m_per_s: limits.0,
            acceleration_limit_m_per_s2: limits.1,
            repeat,
            ..steps(&levels_m, over_s)
        };
        (TrajectorySettings::Steps(settings), over_s, ends)
    }
}

prop_compose! {
    fn random_scan()(
        kind in 0..4,
        (mean_m, amplitude_m) in (-20e-6..20e-6, 1e-6..60e-6),
        frequency_hz in 1.0..150.0,
        back in 0.1..0.5,
        turn in 0.3..0.99,
    ) -> Instance {
        let period_s = 1.0 / frequency_hz;
        let (settings, turn_s) = match kind {
            0 => {
                let own = TriangleSettings { mean_m, amplitude_m, frequency_hz, turn: 0.5 * turn };
                (TrajectorySettings::Triangle(own), 0.5 * turn * period_s)
            }
            1 => {
                let own = SawtoothSettings { mean_m, amplitude_m, frequency_hz, back, turn: back * turn };
                (TrajectorySettings::Sawtooth(own), back * turn * period_s)
            }
            _ => {
                // Length and turn such that the sharp corners are at the amplitude.
                let (line_s, turn_s) = ((1.0 - back) * period_s, back * period_s);
                let own = RasterSettings {
                    mean_m,
                    length_m: 2.0 * amplitude_m / (1.0 + turn_s / line_s),
                    line_s,
                    turn_s,
                    back_s: (kind == 3).then_some(turn * line_s),
                };
                (TrajectorySettings::Raster(own), turn_s)
            }
        };
        (settings, turn_s, around(mean_m, amplitude_m))
    }
}

prop_compose! {
    fn random_sweep()(
        (mean_m, amplitude_m) in (-20e-6..20e-6, 1e-6..60e-6),
        (from_hz, to_hz) in (1.0..500.0, 1.0..500.0),
        over_s in 0.05..1.0,
        linear: bool,
        taper in prop::option::of(0.02..0.5),
    ) -> Instance {
        let spacing = if linear { Spacing::Linear } else { Spacing::Logarithmic };
        let taper_s = taper.map(|part| part * over_s);
        let own = Sweep { mean_m, amplitude_m, from_hz, to_hz, over_s, spacing, taper_s };
        let shortest_s = (0.2 / f64::max(from_hz, to_hz)).min(taper_s.unwrap_or(0.1 * over_s));
        (TrajectorySettings::Sweep(own), shortest_s, around(mean_m, amplitude_m))
    }
}

prop_compose! {
    fn random_multisine()(
        (mean_m, amplitude_m) in (-20e-6..20e-6, 0.1e-6..1e-6),
        (from_hz, step_hz) in (1.0..100.0, 1.0..50.0),
        lines in 1..30,
    ) -> Instance {
        let to_hz = from_hz + f64::from(lines - 1) * step_hz;
        let own = MultisineSettings { mean_m, amplitude_m, lines: Lines::Grid { from_hz, to_hz, step_hz } };
        (TrajectorySettings::Multisine(own), 0.2 / to_hz, around(mean_m, amplitude_m * f64::from(lines)))
    }
}

fn random() -> impl Strategy<Value = Instance> {
    prop_oneof![random_steps(), random_scan(), random_sweep(), random_multisine()]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    /// Each derivative is the slope of the one before, everywhere: where pieces meet, too, so none of them jumps. What stays within
    /// its ends stays there.
    #[test]
    fn derivatives_are_slopes_and_ends_are_kept((settings, shortest_s, (low_m, high_m)) in random()) {
        let trajectory = load(&settings);
        // The fifth derivative may jump: a step over it is off by a quarter of that, times its length.
        let step_s = 1e-4 * shortest_s;
        let samples = 4000;
        let time_s = |index: i32| (f64::from(index) + 0.37) * (1.3 / f64::from(samples));
        let mut scale = [high_m - low_m, 1e-300, 1e-300, 1e-300, 1e-300];
        for index in 0..samples {
            let own = derivatives(trajectory.at(time_s(index)));
            prop_assert!(own[0] >= low_m - 1e-15 && own[0] <= high_m + 1e-15, "{} m at {} s", own[0], time_s(index));
            scale = std::array::from_fn(|order| f64::max(scale[order], own[order].abs()));
        }
        for index in 0..samples {
            let [before, now, after] =
                [-1.0, 0.0, 1.0].map(|part| derivatives(trajectory.at(time_s(index) + part * step_s)));
            for order in 1..5 {
                let slope = (after[order - 1] - before[order - 1]) / (2.0 * step_s);
                // Both ways of computing it lose digits of the order before, and within a step the curve bends.
                let allowed = 2e-3 * scale[order] + 1e-11 * scale[order - 1] / step_s;
                let off = (slope - now[order]).abs();
                prop_assert!(off <= allowed, "derivative {order} at {} s: {slope:e}, not {:e}", time_s(index), now[order]);
            }
        }
    }

    /// What is said to repeat repeats, turn by turn.
    #[test]
    fn what_repeats_is_the_same_a_turn_later((settings, shortest_s, (low_m, high_m)) in random(), part in 0.0..1.0) {
        let trajectory = load(&settings);
        if let Some(turns) = trajectory.turns(1.0) {
            let now_s = part / turns;
            for later in [1.0, 7.0] {
                let [now, then] = [now_s, now_s + later / turns].map(|time_s| position(&trajectory, time_s));
                // The time is rounded, and the way is that steep.
                let allowed_m = 1e-9 * (high_m - low_m) * (1.0 + turns.recip() / shortest_s);
                prop_assert!((then - now).abs() <= allowed_m, "{now} m, {then} m {later} turns later");
            }
        }
    }
}

/// Closed forms: outside the turns the sharp triangle, arcsin(sin); in them no more acceleration than 630/256·|Δv|/L, and just that.
#[test]
fn a_triangle_is_straight_but_for_its_turns() {
    let (amplitude_m, frequency_hz, turn) = (30e-6, 20.0, 0.1);
    let trajectory = load(&TrajectorySettings::Triangle(TriangleSettings {
        mean_m: 2e-6,
        amplitude_m,
        frequency_hz,
        turn,
    }));
    let Course::Scan(scan) = trajectory.course() else {
        panic!("no scan")
    };
    let (mut most, mut on_lines) = (0.0_f64, 0);
    for index in 0..100_000 {
        let time_s = f64::from(index) * 2e-6;
        let motion = trajectory.at(time_s);
        most = most.max(motion.acceleration_m_per_s2.abs());
        if scan.line(time_s).is_none() {
            continue;
        }
        on_lines += 1;
        let sharp_m = 2e-6 + amplitude_m * 2.0 / PI * (TAU * frequency_hz * time_s).sin().asin();
        assert!(
            (motion.position_m - sharp_m).abs() < 1e-12,
            "{} m at {time_s} s",
            motion.position_m
        );
        // At a turn's very edge the time is rounded.
        assert!(motion.acceleration_m_per_s2.abs() < 1e-12 && motion.snap_m_per_s4.abs() < 1e-12);
    }
    // Two turns of a tenth of the period each.
    assert!((79_990..=80_010).contains(&on_lines), "{on_lines}");
    let jump = 8.0 * amplitude_m * frequency_hz;
    let expected = 630.0 / 256.0 * jump / (turn / frequency_hz);
    assert!((most / expected - 1.0).abs() < 1e-6, "{most} against {expected}");
}

/// A raster's lines have the stated length and time, and are numbered one after the other; a way back that is of use is one, too.
#[test]
fn lines_of_a_raster_are_as_long_as_stated() {
    for (back_s, lines_a_period) in [(None, 2), (Some(5e-3), 1)] {
        let settings = RasterSettings {
            mean_m: 0.0,
            length_m: 40e-6,
            line_s: 20e-3,
            turn_s: 4e-3,
            back_s,
        };
        let trajectory = load(&TrajectorySettings::Raster(settings));
        let Course::Scan(scan) = trajectory.course() else {
            panic!("no scan")
        };
        let period_s = 20e-3 + back_s.unwrap_or(20e-3) + 8e-3;
        let mut ends: Vec<(f64, f64)> = Vec::new();
        for index in 0..(3.0 * period_s / 1e-6) as u32 {
            let time_s = f64::from(index) * 1e-6;
            if let Some(line) = scan.line(time_s) {
                ends.resize((line.number as usize + 1).max(ends.len()), (f64::NAN, 0.0));
                let end = &mut ends[line.number as usize];
                if end.0.is_nan() {
                    end.0 = position(&trajectory, time_s);
                }
                end.1 = position(&trajectory, time_s);
            }
        }
        assert!(ends.len() as u64 > 2 * lines_a_period, "{ends:?}");
        // The first one begins in its middle, the last one is cut off.
        for (number, (first_m, last_m)) in ends.iter().enumerate().take(ends.len() - 1).skip(1) {
            let way = if lines_a_period == 2 && number % 2 == 1 {
                -1.0
            } else {
                1.0
            };
            assert!(
                (first_m + way * 20e-6).abs() < 5e-9 && (last_m - way * 20e-6).abs() < 5e-9,
                "{number}: {ends:?}"
            );
        }
    }
}

/// Closed forms: the limits are reached and not exceeded, 2.4609·h/v and √(9.372·h/a) long; a step begins when it is said to.
#[test]
fn steps_keep_their_limits() {
    let height_m = 20e-6;
    let with = |velocity: Option<f64>, acceleration: Option<f64>| StepsSettings {
        velocity_limit_m_per_s: velocity,
        acceleration_limit_m_per_s2: acceleration,
        ..steps(&[5e-6, 5e-6 + height_m, 0.0], 0.0)
    };
    for (settings, limit, order) in [(with(Some(0.01), None), 0.01, 1), (with(None, Some(20.0)), 20.0, 2)] {
        let trajectory = load(&TrajectorySettings::Steps(settings));
        let Course::Steps(found) = trajectory.course() else {
            panic!("no steps")
        };
        let most = (0..100_000).fold(0.0_f64, |most, index| {
            most.max(derivatives(trajectory.at(f64::from(index) * 1e-6))[order].abs())
        });
        assert!((most / limit - 1.0).abs() < 1e-5, "{most} against {limit}");
        let first = found.steps()[0];
        assert_eq!((first.at_s, first.from_m, first.to_m), (0.01, 5e-6, 25e-6));
        assert_eq!(position(&trajectory, first.at_s), 5e-6);
        assert!((position(&trajectory, first.at_s + first.over_s) - 25e-6).abs() < 1e-18);
        assert_eq!(
            (found.begun(0.009), found.begun(0.0125).map(|own| own.0)),
            (None, Some(0))
        );
    }
    // A step that repeats goes on into the next period's first dwell.
    let repeating = StepsSettings {
        repeat: true,
        ..steps(&[0.0, 1e-6], 0.002)
    };
    let trajectory = load(&TrajectorySettings::Steps(repeating));
    let Course::Steps(found) = trajectory.course() else {
        panic!("no steps")
    };
    // Period 24 ms: dwell, step, dwell, step back, which begins at 22 ms.
    let (place, since_s) = found.begun(0.030).unwrap();
    assert!(place == 1 && (since_s - 0.008).abs() < 1e-12, "{place}, {since_s}");
    assert_eq!(found.begun(0.0355).map(|own| own.0), Some(0));
}

/// Closed forms: the angle is the integral of the frequency, here by Simpson's rule, and the frequency is the stated one.
#[test]
fn a_sweep_goes_through_its_frequencies() {
    for (spacing, middle_hz) in [(Spacing::Linear, 205.0), (Spacing::Logarithmic, 4000.0_f64.sqrt())] {
        let sweep = Sweep {
            mean_m: 0.0,
            amplitude_m: 1e-6,
            from_hz: 10.0,
            to_hz: 400.0,
            over_s: 2.0,
            spacing,
            taper_s: Some(0.2),
        };
        let hz = |time_s: f64| sweep.angle_and_frequency_hz(time_s).unwrap().1;
        assert!((hz(1.0) / middle_hz - 1.0).abs() < 1e-12, "{} Hz", hz(1.0));
        let pieces = 20_000;
        let piece_s = 1.3 / f64::from(pieces);
        let turns: f64 = (0..pieces)
            .map(|piece| f64::from(piece) * piece_s)
            .map(|from_s| piece_s / 6.0 * (hz(from_s) + 4.0 * hz(from_s + 0.5 * piece_s) + hz(from_s + piece_s)))
            .sum();
        let found_m = position(&load(&TrajectorySettings::Sweep(sweep)), 1.3);
        assert!((found_m - 1e-6 * (TAU * turns).sin()).abs() < 1e-14, "{found_m} m");
        assert_eq!(sweep.angle_and_frequency_hz(2.0), None);
    }
}

/// Every line has the stated amplitude and nothing else is there; the phases keep the peak small (sines in phase: √(2·32) = 8).
#[test]
fn a_multisine_has_its_lines_and_a_small_peak() {
    let trajectory = load(&TrajectorySettings::Multisine(MultisineSettings {
        mean_m: 0.0,
        amplitude_m: 1e-6,
        lines: Lines::Grid {
            from_hz: 10.0,
            to_hz: 320.0,
            step_hz: 10.0,
        },
    }));
    assert_eq!(trajectory.turns(0.1), Some(1.0));
    let samples: Vec<f64> = (0..4000)
        .map(|index| position(&trajectory, f64::from(index) * 2.5e-5))
        .collect();
    for line in 0..40_u32 {
        let (sine, cosine) = samples
            .iter()
            .enumerate()
            .fold((0.0, 0.0), |(sine, cosine), (index, own)| {
                let angle = TAU * f64::from(line) * index as f64 / 4000.0;
                (sine + own * angle.sin(), cosine + own * angle.cos())
            });
        let amplitude_m = 2.0 / 4000.0 * f64::hypot(sine, cosine);
        let expected_m = if (1..=32).contains(&line) { 1e-6 } else { 0.0 };
        assert!((amplitude_m - expected_m).abs() < 1e-15, "{line}: {amplitude_m} m");
    }
    let crest = common::largest(&samples) / common::rms(&samples);
    assert!((1.2..2.0).contains(&crest), "crest factor {crest}");
}
