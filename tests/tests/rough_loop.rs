//! Guards what the diagnosis is for: a cut on a rough plant, exported, diagnosed, and made again with the amended model.

mod around;

use anhyst_diagnosis::{DiagnoseOptions, Diagnosed, amended_text, diagnose};
use anhyst_launch::measured_table::measured_table;
use anhyst_measured::{MeasuredRun, RunReadOptions};
use anhyst_scenario::{Scenario, load, load_model, to_ron};
use anhyst_tests::{Witness, repository, rough};
use anhyst_witness::{Constants, Hidden, Material, Noise, Plant, Rod};
use around::Cut;
use std::path::Path;

/// Of the error with the old model, rms over the judged part.
const FALLS_TO: f64 = 0.25;

fn scenario(file: &str, settings: &[&str]) -> Scenario {
    let settings: Vec<_> = settings.iter().map(|setting| setting.parse().unwrap()).collect();
    load(&repository().join("scenarios").join(file), &settings).unwrap()
}

/// What `anhyst export` and `anhyst diagnose` do with a cut; the path of `amended.ron`.
fn amended(scenario: &Scenario, cut: &Cut, rows: Option<&str>, folder: &Path) -> (Diagnosed, String) {
    let (table, model) = (folder.join("run.csv"), folder.join("model.ron"));
    std::fs::write(
        &table,
        measured_table(&cut.measured, &cut.safe, scenario.tick_s, &scenario.units()).csv(),
    )
    .unwrap();
    std::fs::write(&model, to_ron(&scenario.believed_model().unwrap()).unwrap()).unwrap();
    let reading = RunReadOptions {
        rows: rows.map(|rows| rows.parse().unwrap()),
        ..RunReadOptions::default()
    };
    let run = MeasuredRun::read(&table, &reading).unwrap();
    let model = load_model(&model).unwrap();
    let found = diagnose(&model, &[run], &DiagnoseOptions::default(), &mut |_, _| ()).unwrap();
    let file = folder.join("amended.ron");
    std::fs::write(&file, amended_text(&found.diagnosis, &found.amended).unwrap()).unwrap();
    (found, file.display().to_string())
}

/// The cut, the diagnosis, and the cut again on the same plant.
fn twice(settings: &[&str], rows: Option<&str>, witness: &dyn Fn() -> Option<Witness>) -> (Cut, Diagnosed, Cut) {
    let old = scenario("rough.ron", settings);
    let folder = tempfile::tempdir().unwrap();
    let first = around::cut(&old, witness());
    let (found, file) = amended(&old, &first, rows, folder.path());
    let material = format!("material=File({file:?})");
    let settings: Vec<&str> = settings.iter().copied().chain([material.as_str()]).collect();
    let second = around::cut(&scenario("rough.ron", &settings), witness());
    let own = &found.diagnosis;
    println!("{settings:?}\n{}\n{:?}", own.sentence, found.amended);
    for other in own.candidates.iter().take(6) {
        println!(
            "{}: {:.0} in BIC, {:.1} nm left",
            other.name,
            other.delta_bic,
            1e9 * other.gap_after
        );
    }
    println!("before {first:?}\nafter {second:?}: {:.3}", second.rms_m / first.rms_m);
    (first, found, second)
}

/// All of it, each small, where material, rod and effects are those of an independent plant.
fn rough_witness() -> Option<Witness> {
    let material = Material {
        saturation_a_per_m: 7.58e5,
        shape_a_per_m: 7080.0,
        pinning_a_per_m: 3720.0,
        reversible_share: 0.17,
        ..Material::TERFENOL_D
    };
    let rod = Rod {
        damping_per_s: 8100.0,
        stiffness_per_s2: 6.35e7,
        ..Rod::PRINTED
    };
    let hidden = Hidden {
        eddy_current_s: 1e-4,
        creep: 0.03,
        friction_m: 0.2e-6,
        constants: Constants {
            creep_stretch: 0.8,
            friction_speed_m_per_s: 0.7e-3,
            ..Constants::USUAL
        },
        ..Hidden::NOTHING
    };
    Some(Witness {
        plant: Plant::new(material, rod, hidden, 5e-5),
        tick_s: 5e-5,
        shape_a_per_m: Box::new(|_| 7080.0),
        mode: None,
        pushed_m: Box::new(|_| 0.0),
        late_ticks: 0,
        before_m: 0.0,
        of_displacement: Noise::new(1),
        of_field: Noise::new(2),
        faults: Some(rough::faults(Noise::new(3))),
    })
}

#[test]
fn a_rough_plant_is_cut_four_times_better_after_its_diagnosis() {
    let (first, found, second) = twice(&[], None, &|| None);
    assert!(first.rms_m > 300e-9, "{first:?}");
    assert!(second.rms_m <= FALLS_TO * first.rms_m, "{first:?}, then {second:?}");
    assert!(found.diagnosis.effects.iter().any(|own| own.name == "eddy_current"));
}

#[test]
fn a_rough_plant_of_somebody_elses_making_as_well() {
    let (first, _, second) = twice(&[], None, &rough_witness);
    assert!(first.rms_m > 300e-9, "{first:?}");
    assert!(second.rms_m <= FALLS_TO * first.rms_m, "{first:?}, then {second:?}");
}

/// The rows of the table in docs/control.md, one fault at a time.
/// Each ratio at most 1.5 times what is reached.
#[test]
fn each_fault_alone() {
    let good = "plant.sensors=(displacement_noise_m: 10e-9, field_noise_a_per_m: 1.0)";
    let nothing = [
        "plant.material=None",
        "plant.shape=Constant(a_per_m: 7012.0)",
        "plant.two_pole=None",
        "plant.effects=Some([])",
        good,
    ];
    let pinning = |k: f64| {
        format!(
            "plant.material=(name: \"k\", source: \"k\", hysteresis: (anhysteretic: Langevin, \
             saturation_magnetization_a_per_m: 7.65e5, shape_a_per_m: 7012.0, pinning_a_per_m: {k:?}, coupling: -0.01, \
             reversibility: 0.18), magnetostriction: Linearised(saturation_magnetostriction: 1.005e-3, bias_fraction: 0.5))"
        )
    };
    let effects = |own: &str| format!("plant.effects=[{own}]");
    let rows = [
        ("k 5 % off", 0.057, pinning(3800.0)),
        ("k 10 % off", 0.033, pinning(3600.0)),
        (
            "eddy currents 0.1 ms",
            0.007,
            effects("EddyCurrent(time_constant_s: 1e-4)"),
        ),
        (
            "friction 1 um",
            0.006,
            effects("Friction(friction_m: 1e-6, speed_m_per_s: 1e-3)"),
        ),
        ("play 0.5 um", 0.013, effects("Backlash(gap_m: 0.5e-6, start: 0.0)")),
        (
            "creep 3 %",
            0.061,
            effects("AfterEffect(fraction: 0.03, shortest_s: 0.03, longest_s: 3.0)"),
        ),
    ];
    for (name, reached, setting) in rows {
        println!("== {name}");
        let settings: Vec<&str> = nothing.iter().copied().chain([setting.as_str()]).collect();
        let (first, _, second) = twice(&settings, None, &|| None);
        assert!(
            second.rms_m <= 1.5 * reached * first.rms_m,
            "{name}: {first:?}, then {second:?}"
        );
    }
}

/// An `a` that drifts while the run is made.
#[test]
fn a_run_that_drifts() {
    let drift = "plant.shape=Ramp(from_a_per_m: 6980.0, rate_a_per_m_s: 100.0, to_a_per_m: 7200.0)";
    let (first, _, second) = twice(&[drift], None, &|| None);
    assert!(second.rms_m <= FALLS_TO * first.rms_m, "{first:?}, then {second:?}");
}

/// Cut out of the middle of the motion.
#[test]
fn a_run_out_of_the_middle() {
    let (first, _, second) = twice(&[], Some("12345..32344"), &|| None);
    assert!(second.rms_m <= FALLS_TO * first.rms_m, "{first:?}, then {second:?}");
}
