//! `a` alone, by any law of the loop: a bank of whole actuators over Θ, run along the data, then the law sample by sample.

use super::report::{EstimateReport, EstimatedParameter};
use super::{Choices, Estimated, refused};
use anhyst_estimator::{
    AnyLaw, ExcitationMonitor, ExcitationSettings, Grid, Law, LawSettings, MinMaxSettings, Prediction, Tuning,
};
use anhyst_identify::estimate::Observed;
use anhyst_identify::parallel;
use anhyst_launch::error::RunError;
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{ActuatorModel, EffectKind, Stage, TwoPole};
use std::collections::BTreeMap;
use std::time::Instant;

/// Half-width of Θ as a share of the model's `a`, unless the user says otherwise.
const HALF_RANGE: f64 = 0.1;
/// The laws' constants are for metres: strains and magnetizations are counted in parts of their range, as if in this many metres.
const SCALE_M: f64 = 50e-6;
/// Nothing of the run is forgotten when it is asked what the whole of it says.
const NEVER_S: f64 = 1e9;
/// Passes in which the instrument's zero settles.
const OFFSET_PASSES: usize = 8;
/// A residual beyond the noise by this factor is not noise.
const UNEXPLAINED: f64 = 1.5;
/// A residual that an estimate raises by more than this factor is no matter of noise.
const WORSE: f64 = 1.05;

/// The bank's outputs along the run, member by member.
struct Predicted {
    grid: Grid,
    outputs: Vec<Vec<f64>>,
    strains: Vec<Vec<f64>>,
}

/// Estimates `a`.
///
/// # Errors
/// A law that does not exist or does not fit the model, a range that cannot be spanned, a model that cannot be run.
pub fn one_parameter(
    run: &MeasuredRun,
    model: &ActuatorModel,
    choices: &Choices,
    progress: impl Fn(u64) + Sync,
) -> Result<Estimated, RunError> {
    let observed = Observed::of(run, model, choices.settle_s).map_err(refused)?;
    let nominal = model.material.hysteresis.shape_a_per_m;
    let range = choices
        .range_a_per_m
        .unwrap_or((nominal * (1.0 - HALF_RANGE), nominal * (1.0 + HALF_RANGE)));
    let start = choices.start_a_per_m.unwrap_or_else(|| nominal.clamp(range.0, range.1));
    if choices.law == "matrix" {
        check_matrix(&observed, model)?;
    }
    let began = Instant::now();
    let untuned = named(&choices.law)?;
    let tuning = |sensitivity_m_per_a_per_m, noise_m| Tuning {
        range_a_per_m: range,
        start_a_per_m: start,
        tick_s: observed.tick_s(),
        noise_m,
        sensitivity_m_per_a_per_m,
        drift_variance_per_s: choices.drift_variance_per_s,
    };
    let probe = LawSettings::tuned(&choices.law, &tuning(1e-9, 1e-9)).unwrap_or(untuned);
    probe
        .validate()
        .map_err(|invalid| RunError::Setup(invalid.to_string()))?;
    let predicted = predict(&observed, model, range, (probe.members(), choices.threads), progress)?;
    let unit_m = unit_m(&observed);
    let sensitivity = predicted.sensitivity(start) * unit_m;
    let settings =
        LawSettings::tuned(&choices.law, &tuning(sensitivity.max(1e-15), observed.noise * unit_m)).unwrap_or(probe);
    let mut law = AnyLaw::new(&settings, &two_pole(model), observed.tick_s())
        .map_err(|error| RunError::Setup(error.to_string()))?;
    let mut course = predicted.follow(&observed, &mut law, unit_m, 0.0);
    // The zero of a strain gauge or a fluxmeter is arbitrary: it is taken off, with the law run again, until it stays.
    let mut offset = 0.0;
    for _ in 0..if observed.output == Quantity::Displacement {
        0
    } else {
        OFFSET_PASSES
    } {
        offset = predicted.offset(&observed, course.value);
        law = AnyLaw::new(&settings, &two_pole(model), observed.tick_s())
            .map_err(|error| RunError::Setup(error.to_string()))?;
        course = predicted.follow(&observed, &mut law, unit_m, offset);
    }
    let seconds = began.elapsed().as_secs_f64();
    // What wanders is judged where it was, not with where it ended.
    let along = (choices.drift_variance_per_s > 0.0).then(|| predicted.along(&course));
    finish(run, model, choices, &observed, course, (seconds, offset, along))
}

fn named(law: &str) -> Result<LawSettings, RunError> {
    LawSettings::named(law).ok_or_else(|| {
        let known = LawSettings::ADAPTIVE.join(", ");
        RunError::Setup(format!("--law {law}: there is no such law; there are {known}"))
    })
}

/// The matrix law has the rod's own dynamics inside: nothing may stand between the free strain and the measured tip but that rod.
fn check_matrix(observed: &Observed, model: &ActuatorModel) -> Result<(), RunError> {
    if observed.output != Quantity::Displacement || model.rod.is_none() {
        let output = observed.output.name();
        return Err(RunError::Setup(format!(
            "--law matrix needs the displacement of a rod, and the output is the {output}; take another law"
        )));
    }
    let between = |kind: EffectKind| matches!(kind.stage(), Stage::Rod | Stage::Sensor);
    match model.effects.iter().find(|effect| between(effect.kind())) {
        Some(effect) => Err(RunError::Setup(format!(
            "--law matrix knows only the two poles of the rod, and the model has {} behind the free strain; take another law",
            effect.kind().name()
        ))),
        None => Ok(()),
    }
}

/// The rod per unit of free strain; where there is none, one that no law looks at.
fn two_pole(model: &ActuatorModel) -> TwoPole {
    let per_strain = 1.0 / model.material.strain_per_magnetization();
    let rod = model.rod.unwrap_or(TwoPole {
        gain: 1.0,
        damping_per_s: 1.0,
        stiffness_per_s2: 1.0,
        force_gain_per_kg: 0.0,
    });
    TwoPole {
        gain: rod.gain * per_strain,
        ..rod
    }
}

/// Metres that one unit of the output is counted as.
fn unit_m(observed: &Observed) -> f64 {
    if observed.output == Quantity::Displacement {
        return 1.0;
    }
    let bounds = observed
        .measured
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        });
    SCALE_M / (bounds.1 - bounds.0).max(f64::MIN_POSITIVE)
}

fn predict(
    observed: &Observed,
    model: &ActuatorModel,
    (lower, upper): (f64, f64),
    (members, threads): (usize, usize),
    progress: impl Fn(u64) + Sync,
) -> Result<Predicted, RunError> {
    let grid = Grid::new(lower, upper, members);
    let runs = parallel::map(threads, grid.shapes_a_per_m(), |&shape| {
        let mut member = model.clone();
        member.material.hysteresis.shape_a_per_m = shape;
        let done = observed.simulate(&member).map_err(refused);
        progress(observed.len() as u64);
        done.map(|[output, strain]| (output, strain))
    });
    let runs = runs.into_iter().collect::<Result<Vec<_>, RunError>>()?;
    let (outputs, strains) = runs.into_iter().unzip();
    Ok(Predicted { grid, outputs, strains })
}

/// Where the law went, and what the run says whatever the law.
struct Course {
    rows: Vec<[f64; 2]>,
    value: f64,
    sd: f64,
    sd_of_law: bool,
    informed: bool,
    at_edge: bool,
    least_errors_a_per_m: [f64; 2],
}

impl Predicted {
    /// rms of dY/da about its mean, at a shape.
    fn sensitivity(&self, shape_a_per_m: f64) -> f64 {
        let grid = &self.grid;
        let samples = self.outputs.first().map_or(0, Vec::len);
        let mut row = vec![0.0; self.outputs.len()];
        let (mut sum, mut squares) = (0.0, 0.0);
        for sample in 0..samples {
            self.row(sample, 1.0, &mut row);
            let slope = grid.smooth(&row, shape_a_per_m).slope;
            sum += slope;
            squares += slope * slope;
        }
        let mean = sum / samples.max(1) as f64;
        (squares / samples.max(1) as f64 - mean * mean).max(0.0).sqrt()
    }

    /// Mean of measured minus predicted at a shape.
    fn offset(&self, observed: &Observed, shape_a_per_m: f64) -> f64 {
        let mut row = vec![0.0; self.outputs.len()];
        let compared = observed.measured.iter().enumerate().skip(observed.run.settling_rows);
        let left = compared.map(|(sample, measured)| {
            self.row(sample, 1.0, &mut row);
            measured - self.grid.smooth(&row, shape_a_per_m).value
        });
        left.sum::<f64>() / (observed.len() - observed.run.settling_rows).max(1) as f64
    }

    /// The output where the course of the estimate was at each sample.
    fn along(&self, course: &Course) -> Vec<f64> {
        let mut row = vec![0.0; self.outputs.len()];
        let samples = course.rows.iter().enumerate();
        samples
            .map(|(sample, [value, _])| {
                self.row(sample, 1.0, &mut row);
                self.grid.smooth(&row, *value).value
            })
            .collect()
    }

    fn row(&self, sample: usize, unit_m: f64, row: &mut [f64]) {
        for (place, member) in row.iter_mut().zip(&self.outputs) {
            *place = unit_m * member[sample];
        }
    }

    fn follow(&self, observed: &Observed, law: &mut AnyLaw, unit_m: f64, offset: f64) -> Course {
        let noise_m = (observed.noise * unit_m).max(1e-15);
        let forgetting_nothing = ExcitationSettings {
            noise_m,
            memory_s: NEVER_S,
            ..ExcitationSettings::default()
        };
        let mut monitor = ExcitationMonitor::new(&forgetting_nothing, &MinMaxSettings::folded(), observed.tick_s());
        let members = self.outputs.len();
        let (mut displacements_m, mut strains) = (vec![0.0; members], vec![0.0; members]);
        let mut course = Course {
            rows: Vec::with_capacity(observed.len()),
            value: law.shape_a_per_m(),
            sd: f64::INFINITY,
            sd_of_law: false,
            informed: false,
            at_edge: false,
            least_errors_a_per_m: [f64::INFINITY; 2],
        };
        let unknown_sd = self.grid.upper_a_per_m() - self.grid.lower_a_per_m();
        course
            .rows
            .resize(observed.run.settling_rows, [course.value, unknown_sd]);
        for (sample, &measured) in observed.measured.iter().enumerate().skip(observed.run.settling_rows) {
            self.row(sample, unit_m, &mut displacements_m);
            for (place, member) in strains.iter_mut().zip(&self.strains) {
                *place = member[sample];
            }
            let seen = monitor.observe(self.grid.smooth(&displacements_m, law.shape_a_per_m()), true);
            let prediction = Prediction {
                grid: &self.grid,
                strains: &strains,
                displacements_m: &displacements_m,
            };
            let found = law.correct(prediction, unit_m * (measured - offset));
            course.sd_of_law = found.standard_deviation_a_per_m > 0.0;
            let sd = if course.sd_of_law {
                found.standard_deviation_a_per_m
            } else {
                seen.deviation_bound_a_per_m
            };
            (course.value, course.sd) = (found.shape_a_per_m, sd);
            (course.informed, course.at_edge) = (seen.informed, found.at_edge);
            course.least_errors_a_per_m = [seen.least_error_above_a_per_m, seen.least_error_below_a_per_m];
            course.rows.push([course.value, sd.min(unknown_sd)]);
        }
        course
    }
}

fn finish(
    run: &MeasuredRun,
    model: &ActuatorModel,
    choices: &Choices,
    observed: &Observed,
    course: Course,
    (seconds, offset, along): (f64, f64, Option<Vec<f64>>),
) -> Result<Estimated, RunError> {
    let [given, _] = observed.simulate(model).map_err(refused)?;
    let before = residual_rms(observed, &given);
    let mut notes = notes(observed, offset);
    let predicted = if let Some(along) = along {
        notes.push("a drifts: what is left is judged along its course; the value is that at the end".to_owned());
        along
    } else {
        let mut amended = model.clone();
        amended.material.hysteresis.shape_a_per_m = course.value;
        let [predicted, _] = observed.simulate(&amended).map_err(refused)?;
        predicted
    };
    let after = residual_rms(observed, &predicted);
    // An estimate that wanders is judged along its course, not with where it ends.
    if choices.drift_variance_per_s == 0.0 {
        refuse_worse(observed.output.unit(), before, after)?;
    }
    let report = EstimateReport {
        parameters: BTreeMap::from([(
            "a".to_owned(),
            EstimatedParameter {
                value: course.value,
                standard_deviation: course.sd,
            },
        )]),
        informed: course.informed && !course.at_edge,
        law: choices.law.clone(),
        standard_deviation_of_law: course.sd_of_law,
        samples: observed.len(),
        samples_per_s: observed.len() as f64 / seconds.max(1e-9),
        output: observed.output.name().to_owned(),
        noise_rms: observed.noise,
        residual_rms_before: before,
        residual_rms_after: after,
        data: run.source.clone(),
        data_hash: run.data_hash.clone(),
        notes,
        warnings: warnings(observed, choices, &course, after),
    };
    Ok(Estimated {
        report,
        abscissa: abscissa(observed),
        courses: vec![("a".to_owned(), course.rows)],
        predicted,
    })
}

/// What was decided on the way, and the instrument's zero.
pub fn notes(observed: &Observed, offset: f64) -> Vec<String> {
    let mut notes = observed.run.notes.clone();
    if observed.output != Quantity::Displacement {
        let (unit, name) = (observed.output.unit(), observed.output.name());
        notes.push(format!(
            "the zero of the measured {name} is off by {offset:.4e} {unit}; it was estimated too and taken off"
        ));
    }
    notes
}

fn warnings(observed: &Observed, choices: &Choices, course: &Course, after: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    if course.at_edge {
        warnings.push(format!(
            "a ended at the edge of its range, {:.1} A/m: give a wider one with --range-a-per-m",
            course.value
        ));
    }
    if !course.informed {
        warnings.push(format!(
            "this run does not say enough about a: the best standard deviation that it allows is {:.3} A/m",
            course.sd
        ));
    }
    let [above, below] = course.least_errors_a_per_m;
    if choices.law == "scalar" && !(above.is_finite() && below.is_finite()) {
        let side = if above.is_finite() { "below" } else { "above" };
        warnings.push(format!(
            "condition (19) does not hold for a true a {side} the estimate: from there the scalar law, with covers over the whole range, \
             stops short; the folded and the Gauss-Newton law do not"
        ));
    }
    unexplained(observed, after, false, &mut warnings);
    warnings
}

/// # Errors
/// An estimate that predicts worse than the model as given is none.
fn refuse_worse(unit: &str, before: f64, after: f64) -> Result<(), RunError> {
    // What noise makes of an estimate that was right from the start is far below.
    if after <= WORSE * before {
        return Ok(());
    }
    Err(RunError::Setup(format!(
        "the estimate leaves {after:.3e} {unit} rms and the model as given {before:.3e}: the law went astray, and its values are none. \
         Estimate fewer parameters, or begin with what `anhyst fit` makes of the same data"
    )))
}

/// Says so when the residual is no noise, and whether the standard deviations know.
pub fn unexplained(observed: &Observed, after: f64, known: bool, warnings: &mut Vec<String>) {
    if observed.noise > 0.0 && after > UNEXPLAINED * observed.noise {
        warnings.push(format!(
            "{:.2e} {} rms are left, {:.1} times the noise: the model lacks something, and the standard deviations {}; \
             `anhyst diagnose` looks for it",
            after,
            observed.output.unit(),
            after / observed.noise,
            if known {
                "say how far an error of this kind moves the values"
            } else {
                "do not know it"
            }
        ));
    }
}

/// rms of measured minus predicted; for strain and magnetization without their means, whose zeros are the instruments'.
pub fn residual_rms(observed: &Observed, predicted: &[f64]) -> f64 {
    let count = (observed.len() - observed.run.settling_rows).max(1) as f64;
    let left = || {
        let compared = observed.measured.iter().zip(predicted).skip(observed.run.settling_rows);
        compared.map(|(measured, predicted)| measured - predicted)
    };
    let mean = match observed.output {
        Quantity::Displacement => 0.0,
        _ => left().sum::<f64>() / count,
    };
    (left().map(|left| (left - mean) * (left - mean)).sum::<f64>() / count).sqrt()
}

/// Time, or the number of the sample.
pub fn abscissa(observed: &Observed) -> Vec<f64> {
    match &observed.run.time_s {
        Some(time_s) => time_s.clone(),
        None => (0..observed.len()).map(|sample| sample as f64).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards against values that nobody should use: of a soft magnet's sweep five parameters raised the residual from 620 to 5040 A/m.
    #[test]
    fn an_estimate_that_predicts_worse_is_refused() {
        let refused = refuse_worse("A/m", 620.0, 5040.0).expect_err("it is worse");
        assert!(refused.to_string().contains("5.040e3 A/m"), "{refused}");
        assert!(refuse_worse("A/m", 620.0, 621.0).is_ok());
    }
}
