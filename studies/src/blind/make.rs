//! From a case to columns: what a rig would have written, and beside it the truth that the workflow never sees.
//!
//! x + σ_x n rounded to 1 nm, H + σ_H n rounded to 0.01 A/m: x displacement, H coil field of the nominal model with what is hidden,
//! n standard normal and white, σ_x 10 to 50 nm and σ_H 0.5 to 3 A/m drawn. A converter with coarse steps rounds the noise, too.
//! Where a drawn excitation cannot make the wanted gap, excitation and size are drawn again.

use anhyst_model::{ActuatorModel, ActuatorOutputs, EffectKind, Noise};
use serde::{Deserialize, Serialize};

use super::case::{Case, Hidden};
use super::draw::Draw;
use super::excitation::{Command, Excitation};
use super::ideal::{Ideal, ideal};
use super::sizes::{Growth, TICK_S, distance_m, run_of};
use crate::error::StudyError;
use anhyst_diagnosis::{Term, rms};
use anhyst_measured::MeasuredRun;
use anhyst_measured::Quantity;

const OUTPUT_NOISE_M: [f64; 2] = [10e-9, 50e-9];
const FIELD_NOISE_A_PER_M: [f64; 2] = [0.5, 3.0];
const OUTPUT_STEP_M: f64 = 1e-9;
const FIELD_STEP_A_PER_M: f64 = 0.01;
const MOST_ATTEMPTS: u64 = 60;
/// Streams of a seed: of the noises, and of the first attempt.
const OUTPUT_STREAM: u64 = 1;
const FIELD_STREAM: u64 = 2;
const ATTEMPT_STREAM: u64 = 100;

/// A number that was hidden.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TrueValue {
    pub effect: String,
    /// As a diagnosis calls it.
    pub name: String,
    pub value: f64,
}

/// How a run was made.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Truth {
    pub names: Vec<String>,
    pub values: Vec<TrueValue>,
    /// Rms of the displacement with each part minus that without it, over the noise.
    pub gaps_over_noise: Vec<f64>,
    pub excitation: Excitation,
    pub amplitude_a_per_m: f64,
    pub output_noise_m: f64,
    pub field_noise_a_per_m: f64,
    /// Excitations drawn until one could show the gap.
    pub attempts: u64,
    /// For one listed effect.
    pub ideal: Option<Ideal>,
}

/// A run, and what is true of it.
pub(super) struct Made {
    pub run: MeasuredRun,
    pub truth: Truth,
}

/// What the drawn effects do to the drawn command.
struct Simulated {
    outputs: ActuatorOutputs,
    /// Laid over the displacement.
    added_m: Vec<f64>,
    values: Vec<TrueValue>,
    gaps_m: Vec<f64>,
    /// Steps of a converter that is coarse, and what reaches it.
    coarse_m: Option<f64>,
    before_rounding: Option<ActuatorOutputs>,
}

/// Makes a case's run on a nominal model.
///
/// # Errors
/// No excitation could make the wanted gap.
pub(super) fn make(case: &Case, nominal: &ActuatorModel, rows: usize) -> Result<Made, StudyError> {
    for attempt in 0..MOST_ATTEMPTS {
        let mut draw = Draw::new(case.seed, ATTEMPT_STREAM + attempt);
        let output_noise_m = draw.log_between(OUTPUT_NOISE_M[0], OUTPUT_NOISE_M[1]);
        let field_noise_a_per_m = draw.log_between(FIELD_NOISE_A_PER_M[0], FIELD_NOISE_A_PER_M[1]);
        let command = Command::drawn(&mut draw, rows as f64 * TICK_S);
        let samples = command.samples(rows, TICK_S);
        let Some(simulated) = simulated(case, nominal, &samples, output_noise_m, &mut draw) else {
            continue;
        };
        let noises = [output_noise_m, field_noise_a_per_m];
        let ideal = match case.hidden {
            Hidden::Terms([Some(term), None]) => ideal(nominal, term, &simulated.outputs, &samples, noises),
            _ => None,
        };
        let truth = Truth {
            names: case.truth(),
            values: simulated.values.clone(),
            gaps_over_noise: simulated.gaps_m.iter().map(|gap| gap / output_noise_m).collect(),
            excitation: command.kind,
            amplitude_a_per_m: command.amplitude_a_per_m,
            output_noise_m,
            field_noise_a_per_m,
            attempts: attempt + 1,
            ideal,
        };
        let run = measured(case, simulated, samples, noises)?;
        return Ok(Made { run, truth });
    }
    Err(StudyError::NotMade {
        sentence: format!(
            "seed {}: none of {MOST_ATTEMPTS} excitations lets {} make a gap of {:?} noises",
            case.seed,
            case.truth().join(" + "),
            case.gaps
        ),
    })
}

fn simulated(
    case: &Case,
    nominal: &ActuatorModel,
    command: &[f64],
    noise_m: f64,
    draw: &mut Draw,
) -> Option<Simulated> {
    let wanted_m = case.gaps.map(|gap| gap * noise_m);
    let mut found = Simulated {
        outputs: ActuatorOutputs::default(),
        added_m: Vec::new(),
        values: Vec::new(),
        gaps_m: Vec::new(),
        coarse_m: None,
        before_rounding: None,
    };
    let mut model = nominal.clone();
    match case.hidden {
        Hidden::Nothing => (),
        Hidden::Terms(terms) => {
            for (term, wanted_m) in terms.into_iter().flatten().zip(wanted_m) {
                let grown = Growth::drawn(term, draw).of_gap(&model, command, TICK_S, wanted_m)?;
                found.values.extend(true_values(term, &grown.values));
                if term == Term::Effect(EffectKind::Quantisation) {
                    found.coarse_m = grown.values.first().copied();
                }
                found.gaps_m.push(grown.gap_m);
                model = grown.model;
            }
        }
        Hidden::Unlisted(own) => {
            let outputs = run_of(&model, command, TICK_S)?;
            found.added_m = own.added(&outputs.displacement_m, TICK_S, wanted_m[0], draw)?;
            found.gaps_m.push(rms(found.added_m.iter().copied()));
        }
    }
    found.outputs = run_of(&model, command, TICK_S)?;
    if found.coarse_m.is_some() {
        // The converter stands behind the noise, so its steps are taken there.
        model.effects.retain(|effect| effect.kind() != EffectKind::Quantisation);
        found.before_rounding = Some(run_of(&model, command, TICK_S)?);
    }
    seen_by_all(nominal, &found, command).then_some(found)
}

/// A second term can undo a first; then there is nothing to find.
fn seen_by_all(nominal: &ActuatorModel, found: &Simulated, command: &[f64]) -> bool {
    let least_m = found.gaps_m.iter().copied().fold(f64::INFINITY, f64::min);
    match run_of(nominal, command, TICK_S) {
        Some(base) if found.gaps_m.len() > 1 => distance_m(&found.outputs, &base) >= 0.5 * least_m,
        base => base.is_some(),
    }
}

fn true_values(term: Term, values: &[f64]) -> Vec<TrueValue> {
    let names: Vec<&str> = match term {
        Term::Effect(kind) => kind.parameters().iter().map(|own| own.name).collect(),
        Term::Parameter(_) => vec![term.name()],
    };
    let named = names.into_iter().zip(values);
    named
        .map(|(name, value)| TrueValue {
            effect: term.name().to_owned(),
            name: name.to_owned(),
            value: *value,
        })
        .collect()
}

fn measured(
    case: &Case,
    simulated: Simulated,
    command: Vec<f64>,
    [output_noise_m, field_noise_a_per_m]: [f64; 2],
) -> Result<MeasuredRun, StudyError> {
    let step_m = simulated.coarse_m.map_or(OUTPUT_STEP_M, |step| step.max(OUTPUT_STEP_M));
    let read =
        |value: f64, rms: f64, step: f64, noise: &mut Noise| libm::rint((value + rms * noise.normal()) / step) * step;
    let (mut output, mut field) = (
        Noise::new(case.seed, OUTPUT_STREAM),
        Noise::new(case.seed, FIELD_STREAM),
    );
    let outputs = simulated.before_rounding.as_ref().unwrap_or(&simulated.outputs);
    let x = outputs.displacement_m.iter().enumerate();
    let displacement = x
        .map(|(row, x)| {
            let added = simulated.added_m.get(row).copied().unwrap_or_default();
            read(x + added, output_noise_m, step_m, &mut output)
        })
        .collect();
    let h = simulated.outputs.field_a_per_m.iter();
    let field = h
        .map(|h| read(*h, field_noise_a_per_m, FIELD_STEP_A_PER_M, &mut field))
        .collect();
    // The name says nothing of what is hidden.
    let run = MeasuredRun::in_memory(
        &format!("seed {}", case.seed),
        Some(TICK_S),
        vec![
            (Quantity::FieldCommand, command),
            (Quantity::Field, field),
            (Quantity::Displacement, displacement),
        ],
    )?;
    Ok(run)
}

#[cfg(test)]
mod tests {
    use super::super::case::{Family, Plan};
    use super::*;

    /// Guards the study's premises: runs repeat exactly, gaps are as drawn, and a run's name does not betray its truth.
    #[test]
    fn runs_are_made_as_drawn() {
        let plan = Plan {
            singles: 6,
            none: 1,
            unlisted: 3,
            pairs: 1,
            limits: 0,
            first_seed: 600_000,
            rows: 2000,
        };
        let nominal = ActuatorModel::terfenol_d();
        for case in plan.cases() {
            let made = make(&case, &nominal, plan.rows).unwrap();
            assert_eq!(made.run, make(&case, &nominal, plan.rows).unwrap().run);
            for (gap, wanted) in made.truth.gaps_over_noise.iter().zip(case.gaps) {
                assert!(
                    (gap / wanted - 1.0).abs() < 0.05,
                    "{:?}: {gap} for {wanted}",
                    case.truth()
                );
            }
            assert!(made.truth.names.iter().all(|name| !made.run.source.contains(name)));
            assert_eq!(made.truth.ideal.is_some(), case.family == Family::Single);
        }
    }
}
