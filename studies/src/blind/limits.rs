//! Detection limits: how often an effect is named rightly at a gap, beside what no method could beat.

use serde::{Deserialize, Serialize};

use super::bars::Share;
use super::case::{Family, LIMIT_GAPS, listed};
use super::ideal::{FALSE_ALARM_DEVIATE, Ideal};
use super::outcome::Outcome;
use super::run::StudyRun;

/// Φ⁻¹(0.95)
const DEVIATE_95: f64 = 1.644_853_627;

/// Runs of one effect about one gap.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Level {
    /// Geometric middle of the gaps over the noise that are counted here.
    pub gap_over_noise: f64,
    /// Tie-aware.
    pub right: Share,
    /// Without a tie.
    pub alone: Share,
    /// Mean chance of the ideal to see it, and to name it.
    pub ideal_seen: f64,
    pub ideal_named: f64,
}

/// One effect, or all of them.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Limit {
    pub effect: String,
    pub levels: Vec<Level>,
    /// The smallest gap over noise from which on every run was right; none if the run with the largest gap was not.
    pub right_from: Option<f64>,
    /// Gap over noise at which the ideal sees it, and names it against its nearest rival, 95 times of 100; medians over the runs.
    pub ideal_seen_from: f64,
    pub ideal_named_from: f64,
    /// That most runs had.
    pub nearest_rival: String,
}

/// Upper edges of the levels' gaps: half way (by ratio) to the next; the last takes the rest.
fn level_of(gap: f64) -> usize {
    let edges = LIMIT_GAPS.windows(2).map(|pair| (pair[0] * pair[1]).sqrt());
    edges.take_while(|edge| gap > *edge).count()
}

/// For every effect that was hidden alone, and for all together first.
pub(super) fn limits(runs: &[StudyRun]) -> Vec<Limit> {
    let single: Vec<&StudyRun> = runs
        .iter()
        .filter(|run| matches!(run.family, Family::Single | Family::Limit) && run.truth.is_some())
        .collect();
    let mut limits = vec![limit("all", &single)];
    for term in listed() {
        let own: Vec<&StudyRun> = single
            .iter()
            .copied()
            .filter(|run| run.truth_name() == term.name())
            .collect();
        limits.push(limit(term.name(), &own));
    }
    limits.retain(|limit| limit.levels.iter().any(|level| level.right.of > 0));
    limits
}

fn limit(effect: &str, runs: &[&StudyRun]) -> Limit {
    let level = |place: usize| {
        let own: Vec<&StudyRun> = runs
            .iter()
            .copied()
            .filter(|run| level_of(run.gap_over_noise()) == place)
            .collect();
        let ideals = own.iter().filter_map(|run| run.truth.as_ref()?.ideal.as_ref());
        let mean = |values: Vec<f64>| values.iter().sum::<f64>() / values.len() as f64;
        Level {
            gap_over_noise: LIMIT_GAPS[place],
            right: Share::of(own.iter(), |run| run.outcome.is_right()),
            alone: Share::of(own.iter(), |run| run.outcome == Outcome::Right),
            ideal_seen: mean(ideals.clone().map(Ideal::seen).collect()),
            ideal_named: mean(ideals.map(Ideal::named).collect()),
        }
    };
    let ideals: Vec<(f64, &Ideal)> = runs
        .iter()
        .filter_map(|run| Some((run.gap_over_noise(), run.truth.as_ref()?.ideal.as_ref()?)))
        .collect();
    // Distances grow as the gap does.
    let seen = ideals
        .iter()
        .map(|(gap, own)| gap * (FALSE_ALARM_DEVIATE + DEVIATE_95) / own.deviations);
    let named = ideals
        .iter()
        .map(|(gap, own)| gap * 2.0 * DEVIATE_95 / own.rival_deviations);
    Limit {
        effect: effect.to_owned(),
        levels: (0..LIMIT_GAPS.len()).map(level).collect(),
        right_from: right_from(runs),
        ideal_seen_from: median(seen.collect()),
        ideal_named_from: median(named.collect()),
        nearest_rival: most_frequent(ideals.iter().map(|(_, own)| own.nearest_rival.as_str())),
    }
}

fn right_from(runs: &[&StudyRun]) -> Option<f64> {
    let mut by_gap = runs.to_vec();
    by_gap.sort_by(|one, other| other.gap_over_noise().total_cmp(&one.gap_over_noise()));
    let right = by_gap.iter().take_while(|run| run.outcome.is_right());
    right.last().map(|run| run.gap_over_noise())
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(f64::NAN)
}

/// The first in the alphabet of those that are equally frequent; empty of nothing.
fn most_frequent<'a>(names: impl Iterator<Item = &'a str>) -> String {
    let mut counts = std::collections::BTreeMap::<&str, usize>::new();
    for name in names {
        *counts.entry(name).or_default() += 1;
    }
    let most = counts.values().copied().max();
    let found = counts.iter().find(|(_, count)| Some(**count) == most);
    found.map_or(String::new(), |(name, _)| (*name).to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the levels' borders: a gap belongs to the level that is nearest by ratio.
    #[test]
    fn gaps_go_to_the_nearest_level() {
        for (place, gap) in LIMIT_GAPS.into_iter().enumerate() {
            assert_eq!(level_of(gap), place);
            assert_eq!(level_of(1.3 * gap), place);
            assert_eq!(level_of(gap / 1.3), place);
        }
        assert_eq!(level_of(30.0), LIMIT_GAPS.len() - 1);
    }
}
