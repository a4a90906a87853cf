//! Guards scenarios whose material has another hysteresis law than the paper's: what they reach, their bits, what they refuse, and that the
//! controller's side follows a stage that shares no code with it.

use anhyst_ipc::Measurement;
use anhyst_scenario::{Control, load};
use anhyst_tests::{Finished, LIMIT, assert_same, digest, folders, repository};
use serde_json::Value;

/// The runs side by side, the last one being the best: rms errors.
fn compared(folder: &str, motion: &str) -> Vec<Value> {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().to_string_lossy().into_owned();
    let kinds = ["_pid_alone", "_line", "_fixed_inverse", "_adaptive_inverse", ""];
    let files = kinds.map(|kind| format!("scenarios/{folder}/{motion}{kind}.ron"));
    let mut arguments = vec!["run"];
    arguments.extend(files.iter().map(String::as_str));
    arguments.extend(["--json", "--out", &out]);
    let told = Finished::run(&arguments, LIMIT).expect(0);
    assert!(root.path().join("compare.html").is_file());
    serde_json::from_str(&told.out).unwrap()
}

fn number(summary: &Value, name: &str) -> f64 {
    summary[name]
        .as_f64()
        .unwrap_or_else(|| panic!("no number {name} in {summary}"))
}

/// Of a stroke of 40 um or 0.5 T: each structure is worth its trouble, and the last one holds what its file says.
#[test]
fn every_structure_is_worth_its_trouble() {
    for (folder, motion, rms, adaptive, unit) in [
        ("piezo", "sine", 2.74e-9, 334e-9, "m"),
        ("piezo", "raster", 5.15e-9, 170e-9, "m"),
        ("magnet", "field", 34.6e-6, 422e-6, "T"),
    ] {
        let runs = compared(folder, motion);
        let errors: Vec<f64> = runs.iter().map(|run| number(run, "error_rms_m")).collect();
        assert!(errors[2] < 0.2 * errors[0].min(errors[1]), "{errors:?}");
        assert!(errors[3] < 0.8 * errors[2] && errors[3] < 1.5 * adaptive, "{errors:?}");
        assert!(errors[4] < 1.5 * rms, "{errors:?}");
        assert_eq!(runs[4]["held"], true, "{motion}");
        assert_eq!(runs[4]["units"]["output"], unit);
    }
}

#[test]
fn processes_give_the_bits_of_one_process_and_a_recording_replays() {
    let (_root, [embedded, separate]) = folders();
    let run = |out: &std::path::Path, more: &[&str]| {
        let out = out.to_string_lossy().into_owned();
        let short = [
            "--set",
            "duration_s=1.4",
            "--set",
            "expect.settling_s=1.2",
            "--out",
            &out,
        ];
        let arguments = [&["run", "scenarios/piezo/sine.ron"], &short[..], more].concat();
        let finished = Finished::run(&arguments, LIMIT);
        assert!(matches!(finished.code, Some(0 | 1)), "{}", finished.err);
    };
    run(&embedded, &["--embedded", "--no-recording"]);
    run(&separate, &[]);
    assert_same(&embedded, &separate);
    assert_eq!(digest(&embedded), digest(&separate));
    Finished::run(&["replay", &separate.to_string_lossy()], LIMIT).expect(0);
}

#[test]
fn what_does_not_go_together_is_refused_by_name() {
    for (scenario, setting, said) in [
        ("piezo/sine", "estimator.law=Folded()", "take Weights() or FixedWeights"),
        ("piezo/sine", "rod=()", "rod.resonance"),
        (
            "milling",
            "estimator.law=FixedWeights",
            "for a material with another law",
        ),
        (
            "piezo/sine",
            "controller.trajectory=Profile(spindle_rpm: 600.0, mean_m: 25e-6, lobes: [(1, 60e-6, 0.0)])",
            "the limit of 120 V reaches only",
        ),
    ] {
        let file = format!("scenarios/{scenario}.ron");
        let refused = Finished::run(&["check", &file, "--set", setting], LIMIT).expect(2);
        let words = refused.err.split_whitespace().collect::<Vec<_>>().join(" ");
        assert!(words.replace("│ ", "").contains(said), "{said}\n{}", refused.err);
    }
}

/// Backlashes behind soft springs before a resonance, moved by hand: metres from volts.
struct Stage {
    followers: [f64; 5],
    volts: f64,
    position_m: f64,
    velocity_m_per_s: f64,
}

impl Stage {
    fn step(&mut self, to_v: f64, tick_s: f64) -> f64 {
        let (from_v, parts) = (self.volts, 20);
        let step_s = tick_s / f64::from(parts);
        let rate = 2.0 * std::f64::consts::PI * 490.0;
        for part in 1..=parts {
            self.volts = from_v + (to_v - from_v) * f64::from(part) / f64::from(parts);
            let mut pull_m = 0.33e-6 * self.volts;
            for (follower, (width, gain)) in
                self.followers
                    .iter_mut()
                    .zip([(4.0, 3e-8), (12.0, 4e-8), (24.0, 3e-8), (44.0, 2e-8), (70.0, 5e-8)])
            {
                *follower = follower.max(self.volts - 0.5 * width).min(self.volts + 0.5 * width);
                pull_m += gain * *follower;
            }
            let force = rate * rate * (pull_m - self.position_m) - 0.05 * rate * self.velocity_m_per_s;
            self.velocity_m_per_s += step_s * force;
            self.position_m += step_s * self.velocity_m_per_s;
        }
        self.position_m
    }
}

#[test]
fn a_stage_of_other_code_is_followed_and_taught() {
    let error_m = |settings: &[&str]| {
        let settings: Vec<_> = settings.iter().map(|text| text.parse().unwrap()).collect();
        let scenario = load(&repository().join("scenarios/piezo/sine.ron"), &settings).unwrap();
        let mut control = Control::new(&scenario).unwrap();
        let mut stage = Stage {
            followers: [0.0; 5],
            volts: 0.0,
            position_m: 0.0,
            velocity_m_per_s: 0.0,
        };
        // An amplifier of one pole; its field at the instant of the next tick.
        let keep = (-2.0 * std::f64::consts::PI * 1600.0 * scenario.tick_s).exp();
        let (mut volts, mut squares, mut count) = (0.0, 0.0, 0);
        for tick in 0..scenario.ticks() {
            let position_m = stage.step(volts, scenario.tick_s);
            control.step(
                tick,
                Measurement {
                    tick,
                    displacement_m: position_m,
                    coil_field_a_per_m: volts,
                    ..Measurement::default()
                },
            );
            volts = keep * volts + (1.0 - keep) * control.safe_field.field_a_per_m;
            if tick as f64 * scenario.tick_s > 9.0 {
                squares += (control.demand.reference_m - position_m).powi(2);
                count += 1;
            }
        }
        (squares / f64::from(count)).sqrt()
    };
    let fixed = error_m(&["controller.learning=None", "estimator.law=FixedWeights"]);
    let adaptive = error_m(&["controller.learning=None"]);
    let learned = error_m(&[]);
    println!("{fixed:.3e} {adaptive:.3e} {learned:.3e}");
    assert!(adaptive < 0.35 * fixed, "{fixed:.3e} {adaptive:.3e}");
    assert!(learned < 20e-9, "{learned:.3e}");
}
