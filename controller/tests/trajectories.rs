//! Guards the trajectories' derivatives, their continuity, and the messages about tables that cannot be used.

mod common;

use anhyst_controller::{SpeedChange, Trajectory, TrajectorySettings};
use common::{TICK_S, derivatives};
use std::f64::consts::TAU;
use std::io::Write as _;
use std::path::Path;

fn load(settings: &TrajectorySettings, start_s: f64) -> Trajectory {
    Trajectory::load(settings, start_s, TICK_S, Path::new(".")).unwrap()
}

fn table(text: &str) -> tempfile::NamedTempFile {
    let mut file = tempfile::NamedTempFile::new().unwrap();
    file.write_all(text.as_bytes()).unwrap();
    file
}

fn table_settings(file: &tempfile::NamedTempFile, repeat: bool) -> TrajectorySettings {
    TrajectorySettings::Table {
        file: file.path().into(),
        repeat,
    }
}

/// A revolution of 40 ms with unequal steps, closed.
fn revolution() -> tempfile::NamedTempFile {
    let rows: String = (0..=80)
        .map(|row| {
            let part = f64::from(row) / 80.0;
            let time_s = 0.04 * (part + 0.002 * (3.0 * TAU * part).sin());
            format!(
                "{time_s:.17e}, {:.17e}\n",
                20e-6 * (TAU * time_s / 0.04).sin() + 5e-6 * (3.0 * TAU * time_s / 0.04).cos()
            )
        })
        .collect();
    table(&format!("# a comment\ntime_s, position_m\n{rows}"))
}

fn kinds() -> Vec<(&'static str, Trajectory)> {
    let file = revolution();
    vec![
        ("rest", load(&TrajectorySettings::Rest, 0.0)),
        ("harmonics", load(&common::two_tones(), 0.0)),
        ("harmonics with start", load(&common::two_tones(), 0.1)),
        (
            "profile that changes its speed",
            load(
                &TrajectorySettings::Profile {
                    spindle_rpm: 3000.0,
                    mean_m: 3e-6,
                    lobes: vec![(1, 30e-6, 0.1), (3, 9e-6, -0.7)],
                    speed_changes: vec![SpeedChange {
                        at_s: 0.06,
                        rpm: 4200.0,
                        over_s: 0.05,
                    }],
                },
                0.05,
            ),
        ),
        (
            "profile",
            load(
                &TrajectorySettings::Profile {
                    spindle_rpm: 3000.0,
                    mean_m: 3e-6,
                    lobes: vec![(1, 30e-6, 0.1), (3, 9e-6, -0.7)],
                    speed_changes: Vec::new(),
                },
                0.05,
            ),
        ),
        (
            "ramps",
            load(
                &TrajectorySettings::SmoothRamps {
                    points: vec![(0.01, 0.0), (0.03, 30e-6), (0.05, 30e-6), (0.09, -20e-6)],
                },
                0.0,
            ),
        ),
        ("table", load(&table_settings(&file, false), 0.0)),
        ("repeating table with start", load(&table_settings(&file, true), 0.05)),
    ]
}

/// Each derivative integrates to the one before (Simpson, on steps that no joint straddles by more than one of many).
#[test]
fn every_derivative_is_that_of_the_one_before() {
    for (name, trajectory) in kinds() {
        let (mut scale, mut worst) = ([1e-300_f64; 5], [0.0_f64; 4]);
        let step_s = 2e-6;
        for index in 0..60_000 {
            let from_s = f64::from(index) * step_s;
            let [from, middle, to] = [0.0, 0.5, 1.0].map(|part| derivatives(trajectory.at(from_s + part * step_s)));
            for order in 0..4 {
                scale[order + 1] = scale[order + 1].max(middle[order + 1].abs());
                let integral = step_s / 6.0 * (from[order + 1] + 4.0 * middle[order + 1] + to[order + 1]);
                worst[order] = worst[order].max((to[order] - from[order] - integral).abs() / step_s);
            }
        }
        let relative: Vec<f64> = (0..4).map(|order| worst[order] / scale[order + 1]).collect();
        println!("{name}: {relative:?}");
        // A table that stands still outside jumps in jerk and snap at its two ends, and there only.
        let checked = if name == "table" { 2 } else { 4 };
        for (order, worst) in relative.iter().enumerate().take(checked) {
            assert!(
                *worst < 1e-3,
                "{name}: derivative {} is off by {worst} of its largest value",
                order + 1
            );
        }
    }
}

/// No derivative jumps where pieces meet: points of ramps, rows of a table, its joint, the end of the start.
#[test]
fn pieces_meet_smoothly() {
    for (name, trajectory) in kinds() {
        let scale = (0..60_000).fold([1e-300_f64; 5], |scale, index| {
            let values = derivatives(trajectory.at(f64::from(index) * 2e-6));
            std::array::from_fn(|order| scale[order].max(values[order].abs()))
        });
        let rows = (0..=240).map(|row| {
            let part = f64::from(row % 80) / 80.0;
            0.04 * (f64::from(row / 80) + part + 0.002 * (3.0 * TAU * part).sin())
        });
        for joint_s in [0.01, 0.03, 0.05, 0.09, 0.1].into_iter().chain(rows) {
            let outside = name == "table" && !(1e-6..0.0399).contains(&joint_s);
            let [before, after] = [-1e-10, 1e-10].map(|off| derivatives(trajectory.at(joint_s + off)));
            for order in 0..if outside { 3 } else { 5 } {
                let jump = (after[order] - before[order]).abs() / scale[order];
                assert!(
                    jump < 1e-5,
                    "{name}: derivative {order} jumps by {jump} of its largest value at {joint_s} s"
                );
            }
        }
    }
}

/// Closed forms: a sine's derivatives, the blend's middle, the profile as harmonics of the spindle.
#[test]
fn closed_forms_hold() {
    let sine = load(
        &TrajectorySettings::Harmonics {
            mean_m: 1e-6,
            terms: vec![(2e-6, 50.0, 0.4)],
        },
        0.0,
    );
    let (omega, time_s) = (TAU * 50.0, 0.0123);
    let angle = omega * time_s + 0.4;
    let expected = [
        1e-6 + 2e-6 * angle.sin(),
        2e-6 * omega * angle.cos(),
        -2e-6 * omega.powi(2) * angle.sin(),
        -2e-6 * omega.powi(3) * angle.cos(),
        2e-6 * omega.powi(4) * angle.sin(),
    ];
    for (found, expected) in derivatives(sine.at(time_s)).into_iter().zip(expected) {
        assert!(
            (found - expected).abs() < 1e-12 * expected.abs(),
            "{found:e} against {expected:e}"
        );
    }
    let ramp = load(
        &TrajectorySettings::SmoothRamps {
            points: vec![(0.0, 0.0), (2.0, 4e-6)],
        },
        0.0,
    )
    .at(1.0);
    assert!((ramp.position_m - 2e-6).abs() < 1e-20);
    assert!((ramp.velocity_m_per_s - 630.0 / 256.0 * 2e-6).abs() < 1e-18);
    assert_eq!((ramp.acceleration_m_per_s2, ramp.snap_m_per_s4), (0.0, 0.0));
    let profile = TrajectorySettings::Profile {
        spindle_rpm: 3000.0,
        mean_m: 0.0,
        lobes: vec![(1, 40e-6, 0.0), (3, 12e-6, 0.3)],
        speed_changes: Vec::new(),
    };
    assert_eq!(load(&profile, 0.0), load(&common::two_tones(), 0.0));
}

/// A repeating table of a sine: error of the sixth order in the step, and the period after the first like the first.
#[test]
fn spline_converges_with_the_sixth_order() {
    let error = |rows: u32| {
        let text: String = (0..=rows)
            .map(|row| {
                let part = f64::from(row) / f64::from(rows);
                format!("{:.17e},{:.17e}\n", 0.02 * part, 40e-6 * (TAU * part).sin())
            })
            .collect();
        let file = table(&format!("time_s,position_m\n{text}"));
        let trajectory = load(&table_settings(&file, true), 0.0);
        (0..10_000).fold(0.0_f64, |worst, index| {
            let time_s = f64::from(index) * 7e-6;
            worst.max((trajectory.at(time_s).position_m - 40e-6 * (TAU * time_s / 0.02).sin()).abs())
        })
    };
    let errors = [10, 20, 40].map(error);
    println!("10, 20, 40 rows a period: {errors:?} m");
    for two in errors.windows(2) {
        assert!((50.0..80.0).contains(&(two[0] / two[1])), "{errors:?}");
    }
}

/// The unit in a column's name: the same way in milliseconds and micrometres, however it is written.
#[test]
fn tables_have_their_units_in_their_names() {
    let rows = |factors: (f64, f64)| -> String {
        (0..=40)
            .map(|row| {
                let part = f64::from(row) / 40.0;
                let (time_s, position_m) = (0.02 * part, 40e-6 * (TAU * part).sin());
                format!("{:.17e},{:.17e}\n", time_s * factors.0, position_m * factors.1)
            })
            .collect()
    };
    let read = |header: &str, factors: (f64, f64)| {
        let file = table(&format!("{header}\n{}", rows(factors)));
        load(&table_settings(&file, true), 0.0)
    };
    let plain = read("time_s,position_m", (1.0, 1.0));
    for (header, factors) in [
        ("time_ms,position_um", (1e3, 1e6)),
        ("Time [ms], Position [µm]", (1e3, 1e6)),
        ("t_us,displacement_nm", (1e6, 1e9)),
        ("t (s),position (mm)", (1.0, 1e3)),
    ] {
        let other = read(header, factors);
        for index in 0..500 {
            let [one, two] = [&plain, &other].map(|own| own.at(f64::from(index) * 7e-5).position_m);
            assert!((one - two).abs() < 1e-17, "{header}: {one} m, {two} m");
        }
    }
}

/// A table that cannot be used is refused with file, row and column.
#[test]
fn tables_are_refused_with_row_and_column() {
    let cases = [
        (
            "time_s,position_m\n0,0\n0.1,abc\n",
            false,
            "row 3, column position_m: \"abc\" is not a finite number",
        ),
        ("time_s,position_m\n0,0\n0.1,NaN\n", false, "row 3, column position_m"),
        (
            "time_s,position_m\n0,0\n0.1,1e-6\n0.1,2e-6\n",
            false,
            "row 4, column time_s: 0.1 s does not come after",
        ),
        (
            "time_s,position_furlong\n0,0\n0.1,1\n",
            false,
            "row 1 has no column \"position_m\" (or with another unit: m, mm, um, nm), only: time_s, position_furlong",
        ),
        (
            "time_s,t_ms,position_um\n0,0,0\n0.1,100,1\n",
            false,
            "row 1 has both \"time_s\" and \"t_ms\": which of them is the time is not clear",
        ),
        ("time_s,position_m\n0,0\n0.1\n", false, "line: 3"),
        ("time_s,position_m\n", false, "it has no rows"),
        ("time_s,position_m\n0,0\n", false, "it has 1 row"),
        (
            "time_s,position_m\n0,0\n0.1,1e-6\n",
            true,
            "its last position_m 0.000001 m is not its first, 0 m",
        ),
    ];
    for (text, repeat, expected) in cases {
        let file = table(text);
        let refusal = Trajectory::load(&table_settings(&file, repeat), 0.0, TICK_S, Path::new(".")).unwrap_err();
        let shown = refusal.to_string();
        assert!(shown.contains(expected), "{shown}\nexpected: {expected}");
        assert!(shown.contains(&file.path().display().to_string()), "{shown}");
    }
    let missing = TrajectorySettings::Table {
        file: "no_such.csv".into(),
        repeat: false,
    };
    let refusal = Trajectory::load(&missing, 0.0, TICK_S, Path::new("/folder")).unwrap_err();
    assert!(refusal.to_string().contains("/folder/no_such.csv"), "{refusal}");
}

/// Numbers that make no trajectory are refused where they stand.
#[test]
fn bad_numbers_are_refused_where_they_stand() {
    let cases = [
        (
            TrajectorySettings::Harmonics {
                mean_m: 0.0,
                terms: vec![(1e-6, 50.0, 0.0), (1e-6, 6000.0, 0.0)],
            },
            "terms.1",
        ),
        (
            TrajectorySettings::Harmonics {
                mean_m: f64::NAN,
                terms: vec![],
            },
            "mean_m",
        ),
        (
            TrajectorySettings::Profile {
                spindle_rpm: 0.0,
                mean_m: 0.0,
                lobes: vec![],
                speed_changes: Vec::new(),
            },
            "spindle_rpm",
        ),
        (
            TrajectorySettings::Profile {
                spindle_rpm: 3000.0,
                mean_m: 0.0,
                lobes: vec![(0, 1e-6, 0.0)],
                speed_changes: Vec::new(),
            },
            "lobes.0",
        ),
        (TrajectorySettings::SmoothRamps { points: vec![] }, "points"),
        (
            TrajectorySettings::SmoothRamps {
                points: vec![(0.0, 0.0), (0.0, 1e-6)],
            },
            "points.1",
        ),
    ];
    for (settings, path) in cases {
        assert_eq!(settings.validate(TICK_S).unwrap_err().path, path);
    }
}

/// A change of speed that never comes is refused, and is left out of a shorter run.
#[test]
fn a_change_of_speed_after_the_end_is_refused() {
    let change = |at_s: f64| SpeedChange {
        at_s,
        rpm: 4200.0,
        over_s: 0.05,
    };
    let settings = common::settings(TrajectorySettings::Profile {
        spindle_rpm: 3000.0,
        mean_m: 0.0,
        lobes: vec![(1, 30e-6, 0.0)],
        speed_changes: vec![change(1.0), change(2.0)],
    });
    assert_eq!(settings.validate(TICK_S, 2.1), Ok(()));
    let refusal = settings.validate(TICK_S, 2.0).unwrap_err();
    assert_eq!(refusal.path, "trajectory.speed_changes.1.at_s");
    let TrajectorySettings::Profile { speed_changes, .. } = settings.trajectory.within(2.0) else {
        panic!("no profile")
    };
    assert_eq!(speed_changes, vec![change(1.0)]);
}

/// A smooth start begins with everything at rest at 0, whatever the trajectory.
#[test]
fn starts_begin_at_rest() {
    for (name, trajectory) in kinds()
        .into_iter()
        .filter(|(name, _)| name.contains("start") || *name == "profile")
    {
        assert_eq!(derivatives(trajectory.at(0.0)), [0.0; 5], "{name}");
        assert!(trajectory.starting(0.0) && !trajectory.starting(0.1), "{name}");
    }
}
