//! The workflow: set up, decompose, tell, and the series behind the pictures.

use anhyst_identify::{first_things, parallel};
use anhyst_measured::check::Finding;
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::ActuatorModel;

use crate::channel::ChannelKind;
use crate::composition::Composition;
use crate::cost::Meter;
use crate::decomposition::Decomposition;
use crate::diagnosis::{Candidate, DataSource, Diagnosed, Diagnosis, RunSeries, Verdict};
use crate::error::DiagnosisError;
use crate::evidence::Evidence;
use crate::experiment::{Comparison, Experiment, advise};
use crate::likelihood::{Bench, Point};
use crate::locate::{channel_gaps, locate, sentences};
use crate::nuisance::nuisance_series;
use crate::plant::Plant;
use crate::recorder;
use crate::search::JOINS;
use crate::setup::{DiagnoseOptions, setup};
use crate::shares::remainder_rms;
use crate::sight::sight;
use crate::signals::signals;
use crate::statistics::rms;
use crate::unlisted::UnknownTerm;
use crate::verdict::{Told, candidates, moved, name, tell, tests};
use crate::wording::{amplifier_sentences, sentence};

/// Share of the rows on which a held-out gap is not measured.
const TRAINING: f64 = 0.75;
/// Sentences on where the gap is.
const MAX_SENTENCES: usize = 6;
/// Explanations that are named beside the first.
pub(crate) const MAX_TIES: usize = 2;

/// Compares a model with runs and says what is missing; `progress` hears what is being done and how far it has come (0 to 1).
///
/// # Errors
/// Runs that hold nothing the model could be compared with, or a model that cannot be simulated on them.
pub fn diagnose(
    model: &ActuatorModel,
    runs: &[MeasuredRun],
    options: &DiagnoseOptions,
    progress: &mut dyn FnMut(&str, f64),
) -> Result<Diagnosed, DiagnosisError> {
    progress("signs, units and places of the columns", 0.0);
    let first_things: Vec<Finding> = runs.iter().flat_map(|run| first_things(run, model)).collect();
    if first_things.iter().any(|own| !own.amended_columns.is_empty()) {
        return Ok(misread(model, runs, first_things));
    }
    let plant = setup(model, runs, options)?;
    let output = plant.output;
    let threads = if options.threads == 0 {
        parallel::available()
    } else {
        options.threads
    };
    let no_simulation = || DiagnosisError::NoDiagnosis {
        sentence: format!("the model \"{}\" cannot be simulated on these runs", model.name),
    };
    let mut meter = Meter::new(plant.memory.clone(), progress);
    meter.begin("the recorder", 0.0);
    let mut bench = Bench::new(plant, threads);
    let found = recorder::decomposed(&mut bench, &mut |what, done| meter.begin(what, done));
    let found = found.ok_or_else(no_simulation)?;
    let model_on_runs = bench.plant.model.clone();
    meter.begin("weighing the evidence", 0.93);
    let told = tell(&bench, &model_on_runs, &found).ok_or_else(no_simulation)?;
    let unit = match output {
        Quantity::Strain => "",
        other => other.unit(),
    };
    let named = !told.effects.is_empty();
    let improved = told.remainder_rms < rms_of_gap(&bench, &found);
    let mut amended = if improved {
        found
            .last
            .point
            .composition
            .model(&model_on_runs)
            .map_err(|_| no_simulation())?
    } else {
        model.clone()
    };
    // A creep that was prepared for long runs and not found goes again.
    amended.effects.retain(|effect| {
        let term = crate::term::Term::Effect(effect.kind());
        model.effect(effect.kind()).is_some() || found.last.point.composition.terms().contains(&term)
    });
    if amended != *model {
        let files: Vec<String> = runs
            .iter()
            .map(|run| format!("{}, XXH3 {}", run.source, run.data_hash))
            .collect();
        amended.source = format!("{}; amended by anhyst diagnose from {}", model.source, files.join("; "));
    }
    let mut diagnosis = diagnosis(&bench, &model_on_runs, runs, &found, &told, unit);
    diagnosis.first_things = first_things;
    let runner_up = diagnosis.runner_up.as_ref().and_then(|rival| {
        let fits = found.tried.iter().chain(&found.ties);
        let fit = fits
            .into_iter()
            .find(|fit| name(&fit.point.composition.terms()) == rival.name)?;
        fit.point.composition.model(&model_on_runs).ok()
    });
    let series = series(&bench, runs, &found, improved);
    meter.begin("done", 1.0);
    diagnosis.cost = meter.costs();
    Ok(Diagnosed {
        diagnosis,
        amended,
        runner_up: runner_up.filter(|_| named),
        runs: series,
        contributions: told.contributions,
    })
}

/// What is said of a run whose columns are not what they are read as.
fn misread(model: &ActuatorModel, runs: &[MeasuredRun], first_things: Vec<Finding>) -> Diagnosed {
    let sentences = first_things.iter().map(|own| {
        let columns = own.amended_columns.iter().map(|column| format!(" --column {column}"));
        let columns = columns.collect::<String>();
        if columns.is_empty() {
            own.sentence.clone()
        } else {
            format!("{} Read it with{columns}.", own.sentence)
        }
    });
    Diagnosed {
        diagnosis: Diagnosis {
            verdict: Verdict::Columns,
            sentence: sentences.collect::<Vec<_>>().join(" "),
            confidence: 1.0,
            unit: "m".to_owned(),
            model: model.name.clone(),
            data: sources(runs),
            first_things,
            ..Diagnosis::default()
        },
        amended: model.clone(),
        runner_up: None,
        runs: Vec::new(),
        contributions: Vec::new(),
    }
}

fn sources(runs: &[MeasuredRun]) -> Vec<DataSource> {
    let source = |run: &MeasuredRun| DataSource {
        source: run.source.clone(),
        data_hash: run.data_hash.clone(),
        rows: run.len(),
    };
    runs.iter().map(source).collect()
}

fn rms_of_gap(bench: &Bench, found: &Decomposition) -> f64 {
    remainder_rms(bench, &found.nominal)
}

/// A fit's point with all that its names explain among what is left: the gap beside calibration and nuisance.
fn to_name(bench: &Bench, model: &ActuatorModel, last: &Point) -> Point {
    let terms = last.composition.terms().into_iter();
    let bare = terms.fold(last.composition.clone(), |own, term| own.without(term, model));
    let mut own = last.clone();
    for (left, change) in own
        .residual
        .iter_mut()
        .zip(bench.change(last, &bare).unwrap_or_default())
    {
        *left -= change;
    }
    own
}

fn diagnosis(
    bench: &Bench,
    model: &ActuatorModel,
    runs: &[MeasuredRun],
    found: &Decomposition,
    told: &Told,
    unit: &str,
) -> Diagnosis {
    let signals = signals(&bench.plant, &found.nominal.runs);
    let last = &found.last.point;
    let to_name = to_name(bench, model, last);
    let noise_rms = Evidence::new(bench, last).noise_rms(&last.levels);
    let channels = channel_gaps(bench, &to_name, &noise_rms, unit);
    let gap_over = locate(bench, &to_name, &channels, &signals);
    let mut place = amplifier_sentences(&channels);
    place.extend(sentences(&gap_over, &channels, MAX_SENTENCES));
    let (detectable, not_excited) = sight(model, found, &signals);
    let (test_before, test_after) = tests(found);
    let candidates = candidates(bench, found);
    let answer = name(&found.last.point.composition.terms());
    let tied: Vec<String> = found
        .ties
        .iter()
        .map(|fit| name(&fit.point.composition.terms()))
        .collect();
    let rivals = candidates
        .iter()
        .filter(|own| own.name != answer && !tied.contains(&own.name));
    let runner_up: Option<Candidate> = rivals
        .min_by(|one, other| one.delta_bic.total_cmp(&other.delta_bic))
        .cloned();
    let (gap_before, gap_after) = held_out(bench, found);
    let unknown_term = found
        .unlisted
        .first()
        .filter(|own| own.gain > JOINS)
        .map(|own| UnknownTerm {
            curves: vec![own.curve.clone()],
            share_of_energy_explained: {
                let left = remainder_rms(bench, &found.last.point);
                (own.curve.rms / left.max(f64::MIN_POSITIVE)).powi(2).min(1.0)
            },
        });
    let mut own = Diagnosis {
        verdict: told.verdict,
        sentence: String::new(),
        effects: told.effects.clone(),
        nuisance: told.nuisance.clone(),
        explained: told.explained,
        remainder_rms: told.remainder_rms,
        ambiguous_with: tied.into_iter().take(MAX_TIES).collect(),
        unknown_term,
        gap_before,
        gap_after,
        noise_rms: told.noise_rms,
        unit: unit.to_owned(),
        place,
        confidence: told.confidence,
        experiment: None,
        delta_bic: runner_up.as_ref().map(|rival| rival.delta_bic),
        runner_up,
        calibrated: moved(&told.parameters),
        parameters: told.parameters.clone(),
        test_before,
        test_after,
        channels,
        gap_over,
        candidates,
        detectable,
        not_excited,
        model: model.name.clone(),
        data: sources(runs),
        first_things: Vec::new(),
        cost: Vec::new(),
    };
    if own.verdict == Verdict::Ambiguous {
        own.experiment = experiment(bench, model, found);
    }
    own.sentence = sentence(&own);
    own
}

/// Rms of the output on rows that were not fitted, under the model as given and with what was found.
fn held_out(bench: &Bench, found: &Decomposition) -> (f64, f64) {
    let part = Bench::new(bench.plant.first_part(TRAINING), bench.threads);
    let predicted = |composition: &Composition| {
        let point = part.point(composition)?;
        let mut squares = Vec::new();
        for ((index, channel), (_, fitted)) in bench.plant.outputs().zip(part.plant.outputs()) {
            let run = &point.runs[channel.run];
            let model = &bench.plant.series(channel, run)[channel.rows.clone()];
            let seen = fitted.rows.len();
            let left: Vec<f64> = bench.plant.measured[index]
                .iter()
                .zip(model)
                .map(|(y, m)| y - m)
                .collect();
            // The linear nuisance goes on as it was: its columns over all rows, at the coefficients of the first.
            let all = nuisance_series(&bench.plant, &point.composition, &point.nuisance, index, seen);
            let left: Vec<f64> = left.iter().zip(&all).map(|(own, nuisance)| own - nuisance).collect();
            let zero = left[..seen].iter().sum::<f64>() / seen as f64;
            squares.extend(left[seen..].iter().map(|own| own - zero));
        }
        Some(rms(squares))
    };
    let before = predicted(&Composition::default());
    let whole = found.last.first_part(bench, &part);
    let refitted = part.fit(&found.last.point.composition, Some(&whole));
    let after = refitted.and_then(|fit| predicted(&fit.point.composition));
    let fallback = |point| remainder_rms(bench, point);
    (
        before.unwrap_or_else(|| fallback(&found.nominal)),
        after.unwrap_or_else(|| fallback(&found.last.point)),
    )
}

fn experiment(bench: &Bench, model: &ActuatorModel, found: &Decomposition) -> Option<Experiment> {
    let plant: &Plant = &bench.plant;
    let fits = std::iter::once(&found.last).chain(found.ties.iter().take(MAX_TIES));
    let (mut models, mut names) = (Vec::new(), Vec::new());
    for fit in fits {
        models.push(fit.point.composition.model(model).ok()?);
        names.push(name(&fit.point.composition.terms()));
    }
    let drives = plant.runs.iter().flat_map(|run| run.drive_a_per_m.iter());
    let noise = |kind| {
        plant
            .channels
            .iter()
            .find(|own| own.kind == kind)
            .map(|own| own.noise_rms)
    };
    advise(&Comparison {
        models: &models,
        names: &names,
        amplitude_a_per_m: drives.fold(0.0_f64, |most, value| most.max(value.abs())),
        tick_s: plant.runs.first().and_then(|run| run.tick_s),
        output_noise: noise(ChannelKind::Output)?,
        field_noise: noise(ChannelKind::Field),
        threads: bench.threads,
    })
}

/// Measured output and both models, on the instrument's own zero. Where nothing is amended both are the model as given.
fn series(bench: &Bench, runs: &[MeasuredRun], found: &Decomposition, improved: bool) -> Vec<RunSeries> {
    let plant = &bench.plant;
    let amended = if improved { &found.last.point } else { &found.nominal };
    plant
        .outputs()
        .map(|(index, channel)| {
            let measured = plant.measured[index].clone();
            let shifted = |model: &[f64]| {
                let zero = measured.iter().zip(model).map(|(y, m)| y - m).sum::<f64>() / measured.len() as f64;
                model.iter().map(|value| value + zero).collect::<Vec<f64>>()
            };
            let before = &plant.series(channel, &found.nominal.runs[channel.run])[channel.rows.clone()];
            let after = shifted(&plant.series(channel, &amended.runs[channel.run])[channel.rows.clone()]);
            let left = bench.left(amended, channel);
            let nuisance = measured
                .iter()
                .zip(&after)
                .zip(&left)
                .map(|((y, m), left)| y - m - left);
            RunSeries {
                source: runs[channel.run].source.clone(),
                tick_s: runs[channel.run].tick_s,
                before: shifted(before),
                nuisance: nuisance.collect(),
                after,
                field_a_per_m: found.nominal.runs[channel.run].field_a_per_m[channel.rows.clone()].to_vec(),
                measured,
            }
        })
        .collect()
}
