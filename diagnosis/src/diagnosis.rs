//! What a diagnosis says, as `diagnosis.json` holds it, and the model and the series that go with it.

use anhyst_measured::check::Finding;
use anhyst_model::ActuatorModel;
use serde::{Deserialize, Serialize};

use crate::cost::Cost;
use crate::experiment::Experiment;
use crate::locate::{ChannelGap, GapOver};
use crate::shares::Contribution;
use crate::sight::{Detectable, NotExcited};
use crate::unlisted::UnknownTerm;

/// The answer in a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
    /// A column is not what it is read as: no physics was looked at.
    Columns,
    /// One effect or a pair of them.
    Named,
    /// Several explanations that these data cannot separate.
    Ambiguous,
    /// Another value of a nominal parameter.
    Parameter,
    /// The sensor, not the actuator.
    Sensor,
    /// Nothing is missing.
    None,
    /// The data could not have shown anything.
    NotExcited,
    /// Something is missing that nothing in the library is believed to explain.
    #[default]
    Unknown,
}

impl Verdict {
    /// As the JSON file says it.
    pub fn name(self) -> &'static str {
        match self {
            Verdict::Columns => "columns",
            Verdict::Named => "named",
            Verdict::Ambiguous => "ambiguous",
            Verdict::Parameter => "parameter",
            Verdict::Sensor => "sensor",
            Verdict::None => "none",
            Verdict::NotExcited => "not_excited",
            Verdict::Unknown => "unknown",
        }
    }
}

/// A fitted number with its standard deviation.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FittedValue {
    pub name: String,
    pub unit: String,
    pub value: f64,
    /// None where the data do not fix it.
    pub standard_deviation: Option<f64>,
    /// Of the model as given, for a nominal parameter.
    pub nominal: Option<f64>,
}

/// An effect, a constant or a part of the nuisance that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    pub name: String,
    /// Of the gap, beside everything else; see `shares.rs`.
    pub share: f64,
    /// The same where nothing but the constants and the nuisance is in beside it.
    pub share_alone: f64,
    pub values: Vec<FittedValue>,
}

/// One line of the ranking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    pub name: String,
    pub terms: usize,
    /// 2 (J' − J) over the answer; lower is better.
    pub delta_bic: f64,
    /// Rms of what it leaves of the output, in its unit.
    pub gap_after: f64,
}

/// One direction in which something could be missing, and what the residual says to it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ScoreGroup {
    /// A term's name, or what a free curve stands over.
    pub name: String,
    /// Twice the fall of J.
    pub statistic: f64,
    pub degrees: usize,
    /// Probability of as much by chance, for this direction alone.
    pub tail: f64,
}

/// All directions.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ScoreTest {
    /// Most telling first.
    pub groups: Vec<ScoreGroup>,
    /// Smallest tail times the number of groups, at most 1.
    pub family_tail: f64,
}

impl ScoreTest {
    pub(crate) fn of(mut groups: Vec<ScoreGroup>) -> Self {
        groups.sort_by(|one, other| {
            let excess = |group: &ScoreGroup| group.statistic - group.degrees as f64;
            // Tails underflow together; then the larger excess tells more.
            one.tail
                .total_cmp(&other.tail)
                .then(excess(other).total_cmp(&excess(one)))
        });
        let smallest = groups.first().map_or(1.0, |group| group.tail);
        ScoreTest {
            family_tail: (smallest * groups.len() as f64).min(1.0),
            groups,
        }
    }
}

/// A run that was diagnosed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DataSource {
    pub source: String,
    /// XXH3 of the file's bytes.
    pub data_hash: String,
    pub rows: usize,
}

/// Everything that `anhyst diagnose` found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    pub verdict: Verdict,
    /// The verdict as a sentence.
    pub sentence: String,
    /// In order of share.
    pub effects: Vec<FoundEffect>,
    /// What the measurement adds: zero, drift, lines, gain of a probe, the recorder's low pass, the magnetic start.
    pub nuisance: Vec<FoundEffect>,
    /// Constants of the model, calibrated beside the effects.
    pub parameters: Vec<FoundEffect>,
    /// Share of the gap's energy: 1 − |left|²/|gap|².
    pub explained: f64,
    /// Rms of what is left, noise included, in the output's unit.
    pub remainder_rms: f64,
    /// Names of other explanations that these data allow; those of a pair are joined by " + ".
    pub ambiguous_with: Vec<String>,
    pub unknown_term: Option<UnknownTerm>,
    /// Signs, units, places and dead channels of columns, each with the `--column` to paste, and rows that were resampled.
    #[serde(skip_deserializing)]
    pub first_things: Vec<Finding>,
    /// Held-out rms of measured minus model as given, in the output's unit.
    pub gap_before: f64,
    /// The same with what was found.
    pub gap_after: f64,
    pub noise_rms: f64,
    /// m, or empty for strain.
    pub unit: String,
    /// Sentences on where the gap is.
    #[serde(rename = "where")]
    pub place: Vec<String>,
    /// 0 to 1: share of the evidence among all explanations that were fitted.
    pub confidence: f64,
    pub experiment: Option<Experiment>,
    /// 2 (J' − J), of the best rival outside `ambiguous_with` over the answer's.
    pub delta_bic: Option<f64>,
    pub runner_up: Option<Candidate>,
    /// Those of `parameters` that moved for sure.
    pub calibrated: Vec<FoundEffect>,
    pub test_before: ScoreTest,
    pub test_after: ScoreTest,
    pub channels: Vec<ChannelGap>,
    pub gap_over: Vec<GapOver>,
    pub candidates: Vec<Candidate>,
    pub detectable: Vec<Detectable>,
    pub not_excited: Vec<NotExcited>,
    pub model: String,
    pub data: Vec<DataSource>,
    /// What it took, by kind of work.
    pub cost: Vec<Cost>,
}

/// A diagnosis, the model with what was found, and the series behind the pictures.
#[derive(Clone, Debug)]
pub struct Diagnosed {
    pub diagnosis: Diagnosis,
    /// The model as given where nothing was found or named.
    pub amended: ActuatorModel,
    /// The model with the runner-up instead, where there is one.
    pub runner_up: Option<ActuatorModel>,
    pub runs: Vec<RunSeries>,
    /// The parts of the gap.
    pub contributions: Vec<Contribution>,
}

/// One run as measured and as modelled before and after, over the rows that are compared.
#[derive(Clone, Debug)]
pub struct RunSeries {
    pub source: String,
    pub tick_s: Option<f64>,
    pub measured: Vec<f64>,
    pub before: Vec<f64>,
    pub after: Vec<f64>,
    /// What the measurement adds, beside its zero.
    pub nuisance: Vec<f64>,
    /// Field in the nominal model, A/m.
    pub field_a_per_m: Vec<f64>,
}
