//! Guards what is said of a run before any physics: nothing of sound runs, whatever effect and nuisance is in them, and of each of them the
//! right word when it is spoilt.
//!
//! The runs are not part of the project: see `anhyst_witness::shared`.

use std::fmt::Write as _;
use std::path::Path;

use anhyst_identify::{first_things, parallel};
use anhyst_measured::check::{Finding, FindingKind};
use anhyst_measured::{ColumnMapping, MeasuredRun, Quantity, RunReadOptions};
use anhyst_model::{
    ActuatorInputs, ActuatorModel, ActuatorOutputs, Anhysteretic, DriveSignal, Hysteresis, Noise, simulate,
};
use anhyst_witness::shared;

const COMMAND: Quantity = Quantity::FieldCommand;
const FIELD: Quantity = Quantity::Field;
const TIP: Quantity = Quantity::Displacement;

fn read(file: &Path, columns: &[&str], rows: Option<&str>) -> MeasuredRun {
    let options = RunReadOptions {
        mappings: columns
            .iter()
            .map(|text| text.parse::<ColumnMapping>().unwrap())
            .collect(),
        rows: rows.map(|text| text.parse().unwrap()),
        ..RunReadOptions::default()
    };
    MeasuredRun::read(file, &options).unwrap_or_else(|refusal| panic!("{refusal}"))
}

fn model(name: &str) -> ActuatorModel {
    let file = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../scenarios/models")
        .join(name);
    let options = ron::Options::default().with_default_extension(ron::extensions::Extensions::IMPLICIT_SOME);
    options.from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

/// The runs of two independent simulators, each with command, field and displacement.
fn made() -> Vec<MeasuredRun> {
    let (Some(rigged), Some(hidden)) = (shared("rigged"), shared("hidden")) else {
        return Vec::new();
    };
    let rigged = (1..=30).map(|number| rigged.join(format!("rig{number:02}.parquet")));
    let hidden = (1..=12).map(|number| hidden.join(format!("case{number:02}.csv")));
    rigged.chain(hidden).map(|file| read(&file, &[], None)).collect()
}

/// Real runs, each with a model of its actuator or material.
fn real() -> Vec<(MeasuredRun, ActuatorModel)> {
    let Some(data) = shared("data") else { return Vec::new() };
    let piezo = ["time=t_s", "command=v_in_V*1000", "displacement=disp_um*1e-6"];
    let mut all: Vec<(MeasuredRun, ActuatorModel)> =
        ["ident_1Hz_sine.csv", "tracking_linear_vs_hysteresis_inverse.csv"]
            .map(|file| data.join("piezo_stage_ntu_dbo").join(file))
            .map(|file| (read(&file, &piezo, None), model("piezo_stage.ron")))
            .into();
    let terfenol = data.join("terfenol_d_7MPa_factory/terfenol_d_H_B_strain.csv");
    all.push((read(&terfenol, &[], Some("..1139")), model("terfenol_d_measured.ron")));
    let soft = [
        "amorphous_perp",
        "mnzn_ferrite_3amp_b",
        "mnzn_ferrite_4amp",
        "mnzn_hp_ferrite_4amp",
        "steel_M130_27s_3amp",
    ];
    let files = soft.map(|name| data.join(format!("soft_magnetics_szewczyk/{name}.csv")));
    let forc = data.join("forc_pmagpy/forc_train_every6th.csv");
    for file in files.into_iter().chain([forc]) {
        let loops = MeasuredRun::read_loops(&file, &RunReadOptions::default()).unwrap();
        let model = material(&loops);
        all.extend(loops.into_iter().map(|run| (run, model.clone())));
    }
    all
}

/// A material of about the right size for loops, nothing more.
fn material(loops: &[MeasuredRun]) -> ActuatorModel {
    let peak = |quantity: Quantity| {
        let all = loops.iter().flat_map(|run| run.series(quantity).unwrap());
        all.fold(0.0_f64, |most, value| most.max(value.abs()))
    };
    let mut model = ActuatorModel::terfenol_d();
    model.rod = None;
    model.material.hysteresis = Hysteresis {
        anhysteretic: Anhysteretic::Langevin,
        saturation_magnetization_a_per_m: 1.2 * peak(Quantity::Magnetization),
        shape_a_per_m: peak(FIELD) / 4.0,
        pinning_a_per_m: peak(FIELD) / 6.0,
        coupling: 0.0,
        reversibility: 0.3,
        cubic_coupling_m2_per_a2: 0.0,
    };
    model
}

fn sentences(findings: &[Finding]) -> Vec<&str> {
    findings.iter().map(|finding| finding.sentence.as_str()).collect()
}

#[test]
fn sound_runs_are_left_alone() {
    let nominal = model("nominal.ron");
    let mut all: Vec<(MeasuredRun, ActuatorModel)> = made().into_iter().map(|run| (run, nominal.clone())).collect();
    all.extend(real());
    let found = parallel::map(parallel::available(), &all, |(run, model)| first_things(run, model));
    for ((run, _), found) in all.iter().zip(&found) {
        assert!(
            found.is_empty(),
            "{} loop {}: {:?}",
            run.source,
            run.loop_id,
            sentences(found)
        );
    }
}

/// One way to spoil a run, and what must be said of it: kind, channel, columns to paste.
struct Spoilt {
    name: String,
    series: Vec<(Quantity, Vec<f64>)>,
    kind: FindingKind,
    channel: Quantity,
    amended: Vec<String>,
}

/// The series of a run, with one changed.
struct Source<'a>(&'a MeasuredRun);

impl Source<'_> {
    fn with(&self, quantity: Quantity, change: &dyn Fn(&[f64]) -> Vec<f64>) -> Vec<(Quantity, Vec<f64>)> {
        let all = [COMMAND, FIELD, TIP, Quantity::Strain, Quantity::FluxDensity].into_iter();
        let own = all.filter_map(|own| Some((own, self.0.series(own)?)));
        own.map(|(own, values)| {
            (
                own,
                if own == quantity {
                    change(values)
                } else {
                    values.to_vec()
                },
            )
        })
        .collect()
    }

    fn multiplied(&self, quantity: Quantity, factor: f64) -> Spoilt {
        Spoilt {
            name: format!("{} times {factor:e}", quantity.name()),
            series: self.with(quantity, &|values| values.iter().map(|value| factor * value).collect()),
            kind: if factor == -1.0 {
                FindingKind::Sign
            } else {
                FindingKind::Scale
            },
            channel: quantity,
            amended: vec![format!("{}={}*{}", quantity.key(), quantity.header(), 1.0 / factor)],
        }
    }

    fn exchanged(&self, one: Quantity, other: Quantity) -> Spoilt {
        let mut series = self.with(one, &|_| self.0.series(other).unwrap().to_vec());
        for (quantity, values) in &mut series {
            if *quantity == other {
                *values = self.0.series(one).unwrap().to_vec();
            }
        }
        Spoilt {
            name: format!("{} and {} exchanged", one.name(), other.name()),
            series,
            kind: FindingKind::Swapped,
            channel: one,
            amended: vec![
                format!("{}={}*1", one.key(), other.header()),
                format!("{}={}*1", other.key(), one.header()),
            ],
        }
    }

    /// What was measured later stands beside what was measured earlier; both ends are cut off.
    fn shifted(&self, quantity: Quantity, rows: i64) -> Spoilt {
        let cut = rows.unsigned_abs() as usize;
        let mut series = self.with(quantity, &|values| values.to_vec());
        for (own, values) in &mut series {
            let first = if (*own == quantity) == (rows > 0) { 0 } else { cut };
            *values = values[first..first + values.len() - cut].to_vec();
        }
        Spoilt {
            name: format!("{} {rows} rows late", quantity.name()),
            series,
            kind: FindingKind::Shifted,
            channel: quantity,
            amended: vec![format!("{}=-", quantity.key())],
        }
    }

    fn clipped(&self, quantity: Quantity) -> Spoilt {
        let clip = |values: &[f64]| -> Vec<f64> {
            let (low, high) = anhyst_measured::sweep::extremes(values);
            let most = low + 0.85 * (high - low);
            values.iter().map(|value| value.min(most)).collect()
        };
        let leave = quantity == FIELD && self.0.series(COMMAND).is_some();
        Spoilt {
            name: format!("{} clipped", quantity.name()),
            series: self.with(quantity, &clip),
            kind: FindingKind::Saturated,
            channel: quantity,
            amended: if leave { vec!["field=-".into()] } else { Vec::new() },
        }
    }

    /// A twentieth of the rows, where it moves most.
    fn stuck(&self, quantity: Quantity) -> Spoilt {
        let stick = |values: &[f64]| -> Vec<f64> {
            let rows = (values.len() / 20).clamp(10, 60);
            let moved = |at: &usize| (values[at + rows] - values[*at]).abs();
            let most = (1..values.len() - rows - 1)
                .max_by(|one, other| moved(one).total_cmp(&moved(other)))
                .unwrap();
            let mut stuck = values.to_vec();
            stuck[most..most + rows].fill(values[most]);
            stuck
        };
        let leave = quantity == FIELD && self.0.series(COMMAND).is_some();
        Spoilt {
            name: format!("{} stuck", quantity.name()),
            series: self.with(quantity, &stick),
            kind: FindingKind::Stuck,
            channel: quantity,
            amended: if leave { vec!["field=-".into()] } else { Vec::new() },
        }
    }
}

fn wrong(run: &MeasuredRun, model: &ActuatorModel, spoilt: Vec<Spoilt>) -> Vec<String> {
    let judged = spoilt.into_iter().filter_map(|spoilt| {
        let made = MeasuredRun::in_memory("spoilt", run.tick_s, spoilt.series).unwrap();
        let found = first_things(&made, model);
        let right = matches!(&found[..], [one] if (one.kind, one.channel) == (spoilt.kind, spoilt.channel) && one.amended_columns == spoilt.amended);
        (!right).then(|| format!("{} loop {}, {}: {:?}", run.source, run.loop_id, spoilt.name, sentences(&found)))
    });
    judged.collect()
}

#[test]
fn spoilt_made_runs_are_told_what_is_wrong() {
    let nominal = model("nominal.ron");
    let said = parallel::map(parallel::available(), &made(), |whole| {
        // A part of each, for speed.
        let part = |quantity: Quantity| (quantity, whole.series(quantity).unwrap()[..12_000].to_vec());
        let run = MeasuredRun::in_memory(&whole.source, whole.tick_s, [COMMAND, FIELD, TIP].map(part).into()).unwrap();
        let own = Source(&run);
        let mut spoilt: Vec<Spoilt> = Vec::new();
        for quantity in [COMMAND, FIELD, TIP] {
            spoilt.extend([-1.0, 1e3, 1e-3].map(|factor| own.multiplied(quantity, factor)));
        }
        spoilt.push(own.multiplied(FIELD, 1.0 / 79.577_471_545_947_67));
        for (one, other) in [(TIP, COMMAND), (TIP, FIELD), (COMMAND, FIELD)] {
            spoilt.push(own.exchanged(one, other));
        }
        spoilt.extend([
            own.shifted(FIELD, 20),
            own.shifted(FIELD, -20),
            own.shifted(COMMAND, 20),
        ]);
        spoilt.extend([FIELD, TIP].map(|quantity| own.clipped(quantity)));
        spoilt.extend([FIELD, TIP].map(|quantity| own.stuck(quantity)));
        wrong(&run, &nominal, spoilt)
    });
    let said: Vec<String> = said.into_iter().flatten().collect();
    assert!(said.is_empty(), "{} wrong:\n{}", said.len(), said.join("\n"));
}

#[test]
fn spoilt_real_runs_are_told_what_is_wrong() {
    let said = parallel::map(parallel::available(), &real(), |(run, model)| {
        let own = Source(run);
        let outputs = [TIP, Quantity::FluxDensity, Quantity::Strain];
        let mut spoilt: Vec<Spoilt> = Vec::new();
        for quantity in outputs.into_iter().filter(|own| run.series(*own).is_some()) {
            spoilt.extend([-1.0, 1e3, 1e-3].map(|factor| own.multiplied(quantity, factor)));
            spoilt.extend([own.clipped(quantity), own.stuck(quantity)]);
        }
        wrong(run, model, spoilt)
    });
    let said: Vec<String> = said.into_iter().flatten().collect();
    assert!(said.is_empty(), "{} wrong:\n{}", said.len(), said.join("\n"));
}

/// Rows that a recorder lost and stamps that jitter are mended by the reader, said, and nothing else is.
#[test]
fn lost_rows_and_jitter_are_mended() {
    let nominal = model("nominal.ron");
    let said = parallel::map(parallel::available(), &made(), |run| {
        let tick_s = run.tick_s.unwrap();
        let mut wrong = Vec::new();
        for (name, lost, jitter) in [("lost", true, 0.0), ("jitter", false, 0.3)] {
            let mut text = "time_s,field_command_A_per_m,field_A_per_m,displacement_m\n".to_owned();
            let of = |quantity: Quantity| run.series(quantity).unwrap();
            for row in (0..12_000).filter(|row| !lost || row % 977 != 500 && !(6000..6005).contains(row)) {
                let at_s = tick_s * (row as f64 + jitter * (row as f64 * 2.4).sin());
                writeln!(text, "{at_s},{},{},{}", of(COMMAND)[row], of(FIELD)[row], of(TIP)[row]).unwrap();
            }
            let folder = tempfile::tempdir().unwrap();
            let file = folder.path().join("run.csv");
            std::fs::write(&file, text).unwrap();
            let mended = read(&file, &[], None);
            let found = first_things(&mended, &nominal);
            let off = mended
                .series(TIP)
                .unwrap()
                .iter()
                .zip(of(TIP))
                .map(|(one, other)| (one - other).abs());
            let off = off.fold(0.0, f64::max);
            let one = matches!(&found[..], [one] if one.kind == FindingKind::Resampled);
            // Some noises of a sample that was filled in.
            if !one || mended.len() != 12_000 || off > 300e-9 {
                wrong.push(format!(
                    "{} {name}: {off:.1e} m off, {:?}",
                    run.source,
                    sentences(&found)
                ));
            }
        }
        wrong
    });
    let said: Vec<String> = said.into_iter().flatten().collect();
    assert!(said.is_empty(), "{} wrong:\n{}", said.len(), said.join("\n"));
}

/// What is advised is accepted by the reader and mends the run, on a run that needs no shared folder.
#[test]
fn what_is_advised_can_be_pasted() {
    let nominal = ActuatorModel::terfenol_d();
    let signal = DriveSignal::standard(0.5);
    let commands: Vec<f64> = (0..5000)
        .map(|row| signal.field_a_per_m(f64::from(row) * 1e-4))
        .collect();
    let mut outputs = ActuatorOutputs::default();
    simulate(&nominal, 1e-4, ActuatorInputs::commands(&commands), &mut outputs).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("run.csv");
    let headers = ["time_s", "field_command_A_per_m", "field_A_per_m", "displacement_m"];
    let cases = [
        (
            [1.0, 1.0, 1.0, -1.0],
            "displacement has the other sign",
            ["displacement=displacement_m*-1", ""],
        ),
        (
            [1.0, 1.0, 1.0, 1e-3],
            "displacement is 1000 times too small",
            ["displacement=displacement_m*1000", ""],
        ),
        (
            [1.0, 1.0, 0.012_566_370_614_359_173, 1.0],
            "field looks like Oe",
            ["field=field_A_per_m*79.57747154594767", ""],
        ),
        (
            [1.0, 1.0, -1.0, 1.0],
            "field has the other sign",
            ["field=field_A_per_m*-1", ""],
        ),
        (
            [1.0, 0.012_566_370_614_359_173, 0.012_566_370_614_359_173, 1.0],
            "field command and field looks like Oe",
            [
                "command=field_command_A_per_m*79.57747154594767",
                "field=field_A_per_m*79.57747154594767",
            ],
        ),
    ];
    let mut noise = Noise::new(3, 0);
    for (factors, said, advised) in cases {
        let mut text = headers.join(",") + "\n";
        for (row, (command, tip)) in commands.iter().zip(&outputs.displacement_m).enumerate() {
            let seen = [
                row as f64 * 1e-4,
                *command,
                command + noise.normal(),
                tip + 20e-9 * noise.normal(),
            ];
            let cells: Vec<String> = seen
                .iter()
                .zip(factors)
                .map(|(own, factor)| (own * factor).to_string())
                .collect();
            writeln!(text, "{}", cells.join(",")).unwrap();
        }
        std::fs::write(&file, text).unwrap();
        let found = first_things(&read(&file, &[], None), &nominal);
        let advice: Vec<&str> = advised.into_iter().filter(|own| !own.is_empty()).collect();
        assert!(
            found.len() == 1 && found[0].sentence.starts_with(said),
            "{said}: {:?}",
            sentences(&found)
        );
        assert!(
            advice
                .iter()
                .all(|own| found[0].sentence.contains(&format!("--column '{own}'"))),
            "{:?}",
            sentences(&found)
        );
        assert_eq!(found[0].amended_columns, advice);
        let mended = first_things(&read(&file, &advice, None), &nominal);
        assert!(mended.is_empty(), "{said}: {:?}", sentences(&mended));
    }
}
