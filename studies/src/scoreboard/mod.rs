//! A scoreboard on open data: every hysteresis law and a line, each set judged as its source does or as a user would.
//!
//! The data lie in a folder that the caller names; none of them is fetched. A set whose files are not there is left out, with the place
//! where they are to be had.

mod on_line;
mod oscillator;

pub use on_line::OnLineScore;
pub use oscillator::{OscillatorScore, oscillator};

use anhyst_identify::laws::{Family, LawData, LawError, LawFit, LawOptions, fit_each, fit_laws, predict};
use anhyst_measured::{MeasuredError, MeasuredRun, RunReadOptions};
use anhyst_model::ModelError;
use serde::Serialize;
use std::path::Path;
use thiserror::Error;

/// How a set judges.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Protocol {
    /// All records by one set of numbers, and each left out in turn: % of its range.
    LeaveOneOut,
    /// Fitted to the file, run freely along another: rms after the mean.
    Across { other: &'static str },
    /// Parts of one record kept back.
    KeptBack,
}

/// One open set.
struct OpenSet {
    name: &'static str,
    file: &'static str,
    columns: &'static [&'static str],
    protocol: Protocol,
    /// What others have reported of these data, with the source.
    published: &'static str,
    /// Where the data are.
    source: &'static str,
}

const PIEZO: &[&str] = &["voltage=v_in_V", "displacement=disp_um*1e-6", "time=t_s"];
const SINE: &str = "piezo_stage_ntu_dbo/ident_1Hz_sine.csv";
const TRACKING: &str = "piezo_stage_ntu_dbo/tracking_linear_vs_hysteresis_inverse.csv";
const NTU: &str = "github.com/yan9a/DiscreteBacklashOperator (MIT), commit 79fd060";
const SZEWCZYK: &str = "github.com/romanszewczyk/JAmodel (MIT), commit 4bbe905";

const fn ferrite(name: &'static str, file: &'static str) -> OpenSet {
    OpenSet {
        name,
        file,
        columns: &[],
        protocol: Protocol::LeaveOneOut,
        published: "none for one set of numbers over all amplitudes",
        source: SZEWCZYK,
    }
}

const SETS: [OpenSet; 8] = [
    OpenSet {
        name: "piezo stage, sine to tracking",
        file: SINE,
        columns: PIEZO,
        protocol: Protocol::Across { other: TRACKING },
        published: "tracking by the authors' discrete backlash inverse 0.58 µm rms (Aye and Ang, ICSTSD 2018)",
        source: NTU,
    },
    OpenSet {
        name: "piezo stage, tracking to sine",
        file: TRACKING,
        columns: PIEZO,
        protocol: Protocol::Across { other: SINE },
        published: "none",
        source: NTU,
    },
    ferrite(
        "MnZn ferrite, 4 amplitudes",
        "soft_magnetics_szewczyk/mnzn_ferrite_4amp.csv",
    ),
    ferrite(
        "MnZn power ferrite, 4 amplitudes",
        "soft_magnetics_szewczyk/mnzn_hp_ferrite_4amp.csv",
    ),
    ferrite(
        "MnZn ferrite, 3 amplitudes",
        "soft_magnetics_szewczyk/mnzn_ferrite_3amp_b.csv",
    ),
    ferrite(
        "electrical steel, 3 amplitudes",
        "soft_magnetics_szewczyk/steel_M130_27s_3amp.csv",
    ),
    OpenSet {
        name: "Terfenol-D, 7 MPa, one loop",
        file: "terfenol_d_7MPa_factory/terfenol_d_H_B_strain.csv",
        columns: &[],
        protocol: Protocol::KeptBack,
        published: "none",
        source: "github.com/Nir-MTK/Terfenol_D_Pneumatic_Valve (GPL-3.0), commit 1a019b4",
    },
    OpenSet {
        name: "first-order reversal curves of a rock",
        file: "forc_pmagpy/forc_train_every6th.csv",
        columns: &[],
        protocol: Protocol::Across {
            other: "forc_pmagpy/forc_heldout.csv",
        },
        published: "none",
        source: "github.com/PmagPy/PmagPy (BSD-3), data_files/forc_diagram/conventional_example.forc",
    },
];

/// What cannot be judged.
#[derive(Debug, Error)]
pub enum ScoreError {
    #[error(transparent)]
    Measured(#[from] MeasuredError),
    #[error(transparent)]
    Law(#[from] LawError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error("{folder} holds none of the open data sets; they are to be had from: {sources}")]
    NoData { folder: String, sources: String },
}

/// One law on one set.
#[derive(Clone, Debug, Serialize)]
pub struct LawScore {
    pub law: &'static str,
    /// Numbers that the fit chose.
    pub parameters: usize,
    /// rms of what the fit leaves, % of the range.
    pub fitted_percent: f64,
    /// By the set's own metric, % of the range.
    pub score_percent: f64,
    /// The same in the output's unit, where the metric is one of a length.
    pub score: f64,
    /// Of each record left out, % of its range.
    pub left_out_percent: Vec<f64>,
}

/// One set.
#[derive(Clone, Debug, Serialize)]
pub struct SetScore {
    pub set: &'static str,
    pub metric: &'static str,
    pub unit: &'static str,
    pub published: &'static str,
    pub source: &'static str,
    /// What `fit --law auto` takes, which knows nothing of the score.
    pub chosen: &'static str,
    /// Best first.
    pub laws: Vec<LawScore>,
    /// The other way round, on line: plays with weights up to 60 % wrong, adapted along the other file.
    pub on_line: Option<OnLineScore>,
}

/// The board.
#[derive(Clone, Debug, Serialize)]
pub struct Scoreboard {
    pub sets: Vec<SetScore>,
    /// The Bouc-Wen benchmark, on data made here.
    pub oscillator: Vec<OscillatorScore>,
    /// Sets whose files are not there, and where they are to be had.
    pub missing: Vec<String>,
}

/// How many sets there are, the one that is made among them.
pub fn sets() -> usize {
    SETS.len() + 1
}

/// Judges every set that the folder holds; `progress` is told each one's name when it is done.
///
/// # Errors
/// A folder without any, and files that are there but cannot be read.
pub fn scoreboard(folder: &Path, threads: usize, progress: &mut dyn FnMut(&str)) -> Result<Scoreboard, ScoreError> {
    let mut board = Scoreboard {
        sets: Vec::new(),
        oscillator: Vec::new(),
        missing: Vec::new(),
    };
    for set in &SETS {
        let other = match set.protocol {
            Protocol::Across { other } => other,
            _ => set.file,
        };
        if folder.join(set.file).is_file() && folder.join(other).is_file() {
            board.sets.push(judged(folder, set, threads)?);
        } else {
            board
                .missing
                .push(format!("{}: {} from {}", set.name, set.file, set.source));
        }
        progress(set.name);
    }
    if board.sets.is_empty() {
        return Err(ScoreError::NoData {
            folder: folder.display().to_string(),
            sources: board.missing.join("; "),
        });
    }
    board.oscillator = oscillator(threads, |_| true);
    progress("Bouc-Wen oscillator");
    Ok(board)
}

fn read(folder: &Path, file: &str, columns: &[&str]) -> Result<Vec<MeasuredRun>, ScoreError> {
    let mappings: Result<_, MeasuredError> = columns.iter().map(|column| column.parse()).collect();
    let options = RunReadOptions {
        mappings: mappings?,
        ..RunReadOptions::default()
    };
    Ok(MeasuredRun::read_records(&folder.join(file), &options)?)
}

fn judged(folder: &Path, set: &OpenSet, threads: usize) -> Result<SetScore, ScoreError> {
    let runs = read(folder, set.file, set.columns)?;
    let data = LawData::of(&runs, None, None)?;
    let options = LawOptions::default();
    let fits = fit_each(&data, &options, threads);
    let mut adapted = None;
    let percent = |rms: f64, range: f64| 100.0 * rms / range;
    let score = |fit: &LawFit, score_percent: f64, score: f64, left_out_percent: Vec<f64>| LawScore {
        law: fit.report.law,
        parameters: fit.report.parameters,
        fitted_percent: 100.0 * fit.report.nrmse,
        score_percent,
        score,
        left_out_percent,
    };
    let (metric, mut laws) = match set.protocol {
        Protocol::KeptBack => {
            let of = |fit: &LawFit| {
                score(
                    fit,
                    100.0 * fit.report.held_out_nrmse,
                    fit.report.held_out_nrmse * fit.report.range,
                    vec![],
                )
            };
            (
                "parts of the record kept back, rms over the range",
                fits.iter().map(of).collect(),
            )
        }
        Protocol::Across { other } => {
            let other = LawData::of(&read(folder, other, set.columns)?, Some(data.input), Some(data.output))?;
            // Over time only: an adaptation of sweeps would be another fit.
            let plays = fits.iter().find(|fit| fit.report.law == Family::BentPlays.name());
            if let Some(plays) = plays.filter(|_| data.has_time()) {
                adapted = Some(on_line::on_line(&plays.file, &other, &data)?);
            }
            let of = |fit: &LawFit| {
                let error = predict(&fit.file, &other).error;
                score(
                    fit,
                    percent(error.rms_after_mean, error.range),
                    error.rms_after_mean,
                    vec![],
                )
            };
            (
                "free run along the other file, rms after the mean",
                fits.iter().map(of).collect::<Vec<_>>(),
            )
        }
        Protocol::LeaveOneOut => {
            let mut laws: Vec<LawScore> = fits.iter().map(|fit| score(fit, 0.0, 0.0, vec![])).collect();
            for out in 0..runs.len() {
                let (held, kept): (Vec<_>, Vec<_>) = runs.iter().cloned().enumerate().partition(|(own, _)| *own == out);
                let of = |part: Vec<(usize, MeasuredRun)>| {
                    let runs: Vec<MeasuredRun> = part.into_iter().map(|(_, run)| run).collect();
                    LawData::of(&runs, Some(data.input), Some(data.output))
                };
                let (held, kept) = (of(held)?, of(kept)?);
                for fit in fit_each(&kept, &options, threads) {
                    let error = predict(&fit.file, &held).error;
                    if let Some(own) = laws.iter_mut().find(|own| own.law == fit.report.law) {
                        own.left_out_percent.push(percent(error.rms, error.range));
                    }
                }
            }
            for own in &mut laws {
                let squares: f64 = own.left_out_percent.iter().map(|share| share * share).sum();
                own.score_percent = (squares / own.left_out_percent.len().max(1) as f64).sqrt();
                own.score = own.score_percent;
            }
            (
                "each amplitude left out in turn, rms over its own range, rms over amplitudes",
                laws,
            )
        }
    };
    laws.sort_by(|one, other| one.score_percent.total_cmp(&other.score_percent));
    Ok(SetScore {
        set: set.name,
        metric,
        unit: data.output.unit(),
        published: set.published,
        source: set.source,
        on_line: adapted,
        chosen: fit_laws(None, &data, &options, threads, &|_, _| ())?.report.law,
        laws,
    })
}
