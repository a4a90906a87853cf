//! From hypotheses to a winner: singles, then pairs, then all nominal parameters beside them.

use anhyst_model::{ActuatorModel, EffectKind, NominalParameter};

use anhyst_identify::engine::dot;

use crate::observation::Observation;
use crate::probes::Surroundings;
use crate::score::{ScoreTest, Scored, library_statistics, score};
use crate::screening::{Base, Screened, screen};
use crate::system::{ChannelKind, Setting, Signals};
use crate::term::Term;
use crate::workbench::{Fitted, Workbench};
use anhyst_identify::parallel;

/// A fall of χ² below this is not worth a fit.
const WORTH_A_FIT: f64 = 8.0;

/// What an effect needs and neither model nor data have, in a sentence.
pub(crate) fn lacking(model: &ActuatorModel, signals: &[Signals], kind: EffectKind) -> Option<&'static str> {
    let timed = signals.iter().all(|run| run.tick_s.is_some());
    let warm = signals.iter().all(|run| run.temperature.is_some());
    if kind.needs_time() && !timed {
        Some("it needs time, which the data lack")
    } else if kind.needs_rod() && model.rod.is_none() {
        Some("it acts on a moving rod, which the model lacks")
    } else if kind.needs_coil(warm) && !model.coil {
        Some("its cause is a coil, which the model lacks")
    } else {
        None
    }
}

/// Every term that the model and the data allow.
pub(crate) fn terms(bench: &Workbench, signals: &[Signals]) -> Vec<Term> {
    let kinds = EffectKind::ALL
        .into_iter()
        .filter(|kind| lacking(bench.model, signals, *kind).is_none());
    let parameters = NominalParameter::ALL
        .into_iter()
        .filter(|parameter| parameter.of(bench.model).is_some());
    kinds.map(Term::Effect).chain(parameters.map(Term::Parameter)).collect()
}

/// Output residual of each run in the output's unit.
pub(crate) fn output_residuals(observation: &Observation, residual: &[f64], runs: usize) -> Vec<Vec<f64>> {
    let mut residuals = vec![Vec::new(); runs];
    for channel in observation.of_kind(ChannelKind::Output) {
        residuals[channel.run] = residual[channel.rows.clone()]
            .iter()
            .map(|z| z * channel.noise_rms)
            .collect();
    }
    residuals
}

/// A fit with the test of what it leaves.
#[derive(Clone)]
pub(crate) struct Tested {
    pub fit: Fitted,
    pub signals: Vec<Signals>,
    pub test: ScoreTest,
}

/// Holds the residual of a fit against the directions.
pub(crate) fn tested(bench: &Workbench, fit: Fitted, library: &[Screened]) -> Option<Tested> {
    let signals = bench.system.signals(&fit.settings)?;
    let scored = Scored {
        observation: bench.observation,
        residual: &fit.solution.residual,
        columns: &fit.solution.columns,
        signals: &signals,
    };
    let test = score(&scored, library);
    Some(Tested { fit, signals, test })
}

/// Screens terms beside a fit.
pub(crate) fn screen_beside(bench: &Workbench, fit: &Fitted, signals: &[Signals], terms: &[Term]) -> Vec<Screened> {
    let Some(outputs) = bench.simulate(&fit.settings) else {
        return Vec::new();
    };
    let residual = &fit.solution.residual;
    let residuals = output_residuals(bench.observation, residual, signals.len());
    let surroundings = Surroundings {
        model: bench.model,
        signals,
        residuals: &residuals,
        lattice: bench.lattice,
    };
    screen(
        bench,
        &Base {
            settings: &fit.settings,
            outputs: &outputs,
            residual,
        },
        &surroundings,
        terms,
    )
}

/// Starts of fits of one more term beside those of a base.
pub(crate) fn starts_beside(base: &[Setting], screened: &[Screened]) -> Vec<Vec<Setting>> {
    let worth = screened.iter().filter(|own| own.best_gain() > WORTH_A_FIT);
    worth
        .flat_map(|own| {
            own.starts.iter().map(|start| {
                let mut settings = base.to_vec();
                settings.push(Setting {
                    term: own.term,
                    values: start.values.clone(),
                });
                settings
            })
        })
        .collect()
}

/// Best first, one of each set of terms.
pub(crate) fn sort(fits: &mut Vec<Fitted>) {
    fits.sort_by(|one, other| one.bic.total_cmp(&other.bic));
    let mut seen: Vec<Vec<Term>> = Vec::new();
    fits.retain(|fit| {
        let mut terms = fit.terms();
        terms.sort_unstable();
        let new = !seen.contains(&terms);
        if new {
            seen.push(terms);
        }
        new
    });
}

/// Fits of a single and one more: the terms whose directions promise most of what the single leaves.
pub(crate) fn pairs_with(bench: &Workbench, seed: &Fitted, library: &[Screened], most: usize) -> Vec<Fitted> {
    let Some(signals) = bench.system.signals(&seed.settings) else {
        return Vec::new();
    };
    let seconds = promising(bench, seed, library, most);
    let mut screened = screen_beside(bench, seed, &signals, &seconds);
    screened.iter_mut().for_each(|own| own.starts.truncate(1));
    bench.fit_all(&starts_beside(&seed.settings, &screened), false)
}

/// Pairs of terms, by the fall of χ² that their directions promise together; the answer must be linear for it to hold.
pub(crate) fn promising_pairs(
    bench: &Workbench,
    nominal: &Fitted,
    library: &[Screened],
    most: usize,
) -> Vec<[Term; 2]> {
    let training = &bench.observation.training;
    let residual = &nominal.solution.residual;
    // One direction each: the one that the residual has most of.
    let directions: Vec<(Term, Vec<f64>, f64, f64)> = library
        .iter()
        .filter_map(|own| {
            let singles = own.directions.iter().flatten().map(|direction| {
                let direction: Vec<f64> = direction.iter().map(|z| f64::from(*z)).collect();
                let (size, along) = (
                    dot(training, &direction, &direction),
                    dot(training, &direction, residual),
                );
                (own.term, direction, size, along)
            });
            let gain = |own: &(Term, Vec<f64>, f64, f64)| if own.2 > 0.0 { own.3 * own.3 / own.2 } else { 0.0 };
            singles
                .filter(|own| own.2 > 0.0)
                .max_by(|one, other| gain(one).total_cmp(&gain(other)))
        })
        .collect();
    let indices: Vec<usize> = (0..directions.len()).collect();
    let rows = parallel::map(bench.threads, &indices, |&row| {
        let (_, one, size, along) = &directions[row];
        let pair = |column: usize| {
            let (_, other, other_size, other_along) = &directions[column];
            let both = dot(training, one, other);
            let determinant = size * other_size - both * both;
            // Two directions that are one promise nothing together.
            if determinant <= 1e-6 * size * other_size {
                return 0.0;
            }
            (along * along * other_size - 2.0 * along * other_along * both + other_along * other_along * size)
                / determinant
        };
        (0..row).map(|column| (pair(column), row, column)).collect::<Vec<_>>()
    });
    let mut pairs: Vec<(f64, usize, usize)> = rows.into_iter().flatten().collect();
    pairs.sort_by(|one, other| other.0.total_cmp(&one.0));
    pairs
        .into_iter()
        .take(most)
        .map(|(_, row, column)| [directions[row].0, directions[column].0])
        .collect()
}

/// Fits of two terms from one's single fit and the other's screening beside it.
pub(crate) fn fit_pairs(bench: &Workbench, pairs: &[[Term; 2]], singles: &[Fitted]) -> Vec<Fitted> {
    let fits = parallel::map(bench.threads, pairs, |[one, other]| {
        let position = |term: Term| singles.iter().position(|single| single.terms() == [term]);
        // The better single first: the other is sought in what it leaves.
        let first = match (position(*one), position(*other)) {
            (Some(a), Some(b)) => &singles[a.min(b)],
            (a, b) => &singles[a.or(b)?],
        };
        let second = if first.has(*one) { *other } else { *one };
        let signals = bench.system.signals(&first.settings)?;
        let own = Workbench {
            linear: bench.linear.clone(),
            threads: 1,
            ..*bench
        };
        let screened = screen_beside(&own, first, &signals, &[second]);
        let start = screened.first()?.starts.first()?.values.clone();
        let mut settings = first.settings.clone();
        settings.push(Setting {
            term: second,
            values: start,
        });
        own.fit(&settings, false, 1)
    });
    fits.into_iter().flatten().collect()
}

/// Share of the best statistic with which a limit is still tried.
const LIMITS_WORTH: f64 = 0.1;

/// Terms not in a fit, by how much of its residual their directions explain beyond what it can move itself.
pub(crate) fn promising(bench: &Workbench, fit: &Fitted, library: &[Screened], most: usize) -> Vec<Term> {
    let scored = Scored {
        observation: bench.observation,
        residual: &fit.solution.residual,
        columns: &fit.solution.columns,
        signals: &[],
    };
    let mut best: Vec<(Term, f64)> = Vec::new();
    for (term, statistic) in library_statistics(&scored, library) {
        if fit.has(term) {
            continue;
        }
        match best.iter_mut().find(|(own, _)| *own == term) {
            Some((_, own)) => *own = own.max(statistic),
            None => best.push((term, statistic)),
        }
    }
    best.sort_by(|one, other| other.1.total_cmp(&one.1));
    // A limit tried at a level that is not its own looks weaker than it is.
    let worth = best.first().map_or(0.0, |(_, statistic)| LIMITS_WORTH * statistic);
    let chosen = best.into_iter().enumerate().filter(|(rank, (term, statistic))| {
        *statistic > WORTH_A_FIT && (*rank < most || (term.is_limit() && *statistic > worth))
    });
    chosen.map(|(_, (term, _))| term).collect()
}

/// Fits of every term alone whose screening promises anything.
pub(crate) fn try_singles(bench: &Workbench, library: &[Screened]) -> Vec<Fitted> {
    let mut singles = bench.fit_all(&starts_beside(&[], library), false);
    sort(&mut singles);
    singles
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what a model says of itself: without a coil no effect of its heat or induction is sought, with a measured
    /// temperature the two of heat are, and creep always is.
    #[test]
    fn what_a_coil_causes_is_not_sought_without_one() {
        let mut model = ActuatorModel::terfenol_d();
        let missing = |model: &ActuatorModel, warm: bool| {
            let run = Signals {
                tick_s: Some(1e-4),
                temperature: warm.then(Vec::new),
                ..Signals::default()
            };
            let kinds = EffectKind::ALL.into_iter();
            kinds
                .filter(|kind| lacking(model, std::slice::from_ref(&run), *kind).is_some())
                .collect::<Vec<_>>()
        };
        assert!(missing(&model, false).is_empty());
        model.coil = false;
        let by_induction = [EffectKind::CoilHeating, EffectKind::EddyCurrent];
        let by_heat = [EffectKind::ThermalDrift, EffectKind::ThermalExpansion];
        assert_eq!(missing(&model, true), by_induction);
        assert_eq!(missing(&model, false), [by_induction, by_heat].concat());
    }
}
