//! What a diagnosis says, as `diagnosis.json` holds it, and the model and the series that go with it.

use anhyst_model::ActuatorModel;
use serde::{Deserialize, Serialize};

use crate::experiment::Experiment;
use crate::freeform::UnknownTerm;
use crate::locate::{ChannelGap, GapOver};
use crate::score::ScoreTest;
use crate::sight::{Detectable, NotExcited};

/// The answer in a word.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Verdict {
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
    /// Something is missing and nothing in the library explains it.
    Unknown,
}

impl Verdict {
    /// As the JSON file says it.
    pub fn name(self) -> &'static str {
        match self {
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

/// An effect or parameter that was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FoundEffect {
    pub name: String,
    pub values: Vec<FittedValue>,
}

/// One line of the ranking.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Candidate {
    pub name: String,
    pub terms: usize,
    /// Over the best; lower is better.
    pub delta_bic: f64,
    /// Held-out rms of the output, in its unit.
    pub gap_after: f64,
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
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Diagnosis {
    pub verdict: Verdict,
    /// The verdict as a sentence.
    pub sentence: String,
    pub effects: Vec<FoundEffect>,
    /// Names of other explanations that these data allow; those of a pair are joined by " + ".
    pub ambiguous_with: Vec<String>,
    pub unknown_term: Option<UnknownTerm>,
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
    /// BIC of the best rival outside `ambiguous_with` over the winner's.
    pub delta_bic: Option<f64>,
    pub runner_up: Option<Candidate>,
    /// Calibrated nominal parameters, where all of them had to be let free.
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
}

/// One run as measured and as modelled before and after.
#[derive(Clone, Debug)]
pub struct RunSeries {
    pub source: String,
    pub tick_s: Option<f64>,
    pub measured: Vec<f64>,
    pub before: Vec<f64>,
    pub after: Vec<f64>,
    /// Field in the nominal model, A/m.
    pub field_a_per_m: Vec<f64>,
}
