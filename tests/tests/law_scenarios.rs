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
        // What stands in the tokens in the place of `a` is no figure.
        assert_eq!(
            [&runs[4]["a_true_a_per_m"], &runs[4]["a_error_rms_a_per_m"]],
            [&Value::Null; 2]
        );
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
            "piezo/sine",
            "expect.a_final_error_a_per_m=5.0",
            "expect.a_final_error_a_per_m: 5 is for a material that has an a",
        ),
        (
            "milling",
            "estimator.law=FixedWeights",
            "for a material with another law",
        ),
        (
            "piezo/sine",
            "controller.trajectory=Profile(spindle_rpm: 600.0, mean_m: 25e-6, lobes: [(1, 60e-6, 0.0)])",
            "within the limit of 120 V and the inputs that its law was fitted to, 0 to 100 V",
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

/// Four backlashes, as wide as `WIDTHS` says.
#[derive(Default)]
struct Backlashes([f64; 4]);

impl Backlashes {
    const WIDTHS: [f64; 4] = [0.0, 12.0, 24.0, 44.0];
    const GAINS: [f64; 4] = [3e-7, 4e-8, 3e-8, 5e-8];

    fn moved(&mut self, to: f64) -> f64 {
        let own = self.0.iter_mut().zip(Self::WIDTHS).zip(Self::GAINS);
        own.map(|((follower, width), gain)| {
            *follower = follower.max(to - 0.5 * width).min(to + 0.5 * width);
            gain * *follower
        })
        .sum()
    }
}

/// What `diagnose` names in 6000 samples, against a law that has the backlashes and nothing else, and again against what it amended; no code is shared.
fn named(
    [input, output]: [&str; 2],
    columns: &str,
    tick_s: f64,
    mut sample: impl FnMut(f64) -> [f64; 2],
) -> [Vec<String>; 2] {
    let root = tempfile::tempdir().unwrap();
    let mut noise = 99_u64;
    let mut text = format!("time_s,{columns}\n");
    for index in 0..6000 {
        let t = tick_s * f64::from(index);
        let [driven, answer] = sample(t);
        noise = noise.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        let answer = answer + 3e-9 * ((noise >> 40) as f64 / f64::from(1 << 23) - 1.0);
        text.push_str(&format!("{t},{driven},{answer}\n"));
    }
    let (data, model) = (root.path().join("run.csv"), root.path().join("law.ron"));
    std::fs::write(&data, text).unwrap();
    let law = format!(
        "(input: {input}, output: {output}, start: Rest, input_extent: (0.0, 90.0), model: (offset: 0.0, slope: 0.0, \
         laws: [Plays(groups: [(warp: Straight, radii: [0.0, 6.0, 12.0, 22.0], weights: {:?})])]))",
        Backlashes::GAINS
    );
    std::fs::write(&model, law).unwrap();
    let [first, again] = ["found", "again"].map(|name| root.path().join(name));
    let amended = first.join("amended.ron");
    let words = |path: &std::path::PathBuf| path.to_string_lossy().into_owned();
    let data = words(&data);
    [(&model, &first), (&amended, &again)].map(|(model, to)| {
        let arguments = [
            "diagnose",
            "--model",
            &words(model),
            "--data",
            &data,
            "--out",
            &words(to),
            "--json",
        ];
        let found: Value = serde_json::from_str(&Finished::run(&arguments, LIMIT).expect(0).out).unwrap();
        let effects = found["effects"].as_array().unwrap();
        assert!(
            effects.is_empty() || found["explained"].as_f64().unwrap() > 0.9,
            "{found}"
        );
        let names = effects.iter().map(|own| own["name"].as_str().unwrap().to_owned());
        names.collect()
    })
}

#[test]
fn creep_beside_another_law_is_named() {
    let (mut stage, mut slow) = (Backlashes::default(), [0.0_f64; 3]);
    let lags = [0.1, 1.0, 10.0].map(|time_constant_s: f64| (time_constant_s, 8e-9));
    let found = named(["Voltage", "Displacement"], "voltage_V,displacement_m", 0.005, |t| {
        let volts = 50.0 * (1.0 - (-t).exp()) + (10.0 + t) * (2.0 * std::f64::consts::PI * 0.7 * t).sin();
        let creep = slow.iter_mut().zip(lags).map(|(own, (time_constant_s, weight))| {
            *own += (0.005 / time_constant_s) * (volts - *own);
            weight * *own
        });
        let creep: f64 = creep.sum();
        [volts, stage.moved(volts) + creep]
    });
    assert_eq!(found, [vec!["after_effect".to_owned()], Vec::new()]);
}

/// A flux density is an output like any other: eddy currents keep the field from the core for 2 ms.
#[test]
fn a_lag_beside_another_law_is_named_from_the_flux() {
    let (mut core, mut inside) = (Backlashes::default(), 0.0_f64);
    let found = named(["Field", "FluxDensity"], "field_A_per_m,flux_density_T", 0.001, |t| {
        let field = |t: f64| (1.0 - (-t).exp()) * (40.0 * (12.0 * t).sin() + 20.0 * (31.0 * t).sin());
        let mut flux = core.moved(inside);
        for part in 1..=20 {
            let then = (t - 0.001 + 5e-5 * (f64::from(part) - 0.5)).max(0.0);
            inside += (1.0 - f64::exp(-5e-5 / 0.002)) * (field(then) - inside);
            flux = core.moved(inside);
        }
        [field(t), flux]
    });
    assert_eq!(found, [vec!["eddy_current".to_owned()], Vec::new()]);
}
