//! What `anhyst fit` is told.

use crate::arguments::{JsonArgument, MeasuredFile, OutArgument, TableArguments, ThreadsArgument};
use anhyst_identify::laws::Family;
use anhyst_identify::{FitOptions, Fixed};
use anhyst_measured::{LAW_OUTPUTS, Quantity};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, ValueEnum};

/// `auto`: all of them.
pub const AUTO: &str = "auto";

/// `fit`
#[derive(Debug, Args)]
pub struct FitArguments {
    /// Measured loops; quantities: loop, time, field, flux, magnetization, strain.
    #[command(flatten)]
    pub data: MeasuredFile,
    /// What of them is read.
    #[command(flatten)]
    pub table: TableArguments,
    /// Fit this hysteresis law to any input and output instead of a material; auto: all, chosen by what they predict of data that
    /// are kept back.
    #[arg(long, value_parser = names(), value_name = "LAW")]
    pub law: Option<String>,
    /// With --law: the output (default: displacement, magnetization, flux or strain, the first that was measured).
    #[arg(long, value_parser = outputs(), value_name = "QUANTITY", requires = "law")]
    pub output: Option<Quantity>,
    /// With --law.
    #[command(flatten)]
    pub threads: ThreadsArgument,
    /// Hold a parameter: `--fix alpha=-0.01`
    #[arg(long, value_name = "PARAMETER=VALUE", conflicts_with = "law")]
    pub fix: Vec<Fixed>,
    /// Which anhysteretic curve.
    #[arg(long, value_enum, default_value_t = Curve::Both, conflicts_with = "law")]
    pub curve: Curve,
    /// Random parameter sets that are tried first.
    #[arg(long, default_value_t = FitOptions::default().candidates, value_parser = count, conflicts_with = "law")]
    pub candidates: usize,
    /// How many of them are polished.
    #[arg(long, default_value_t = FitOptions::default().starts, value_parser = count, conflicts_with = "law")]
    pub starts: usize,
    /// Weight of the squared strain error against that of the magnetization.
    #[arg(long, default_value_t = FitOptions::default().strain_weight, conflicts_with = "law")]
    pub strain_weight: f64,
    /// Name of the material (default: the file's).
    #[arg(long)]
    pub name: Option<String>,
    /// Where the results go.
    #[command(flatten)]
    pub out: OutArgument,
    /// How the report is printed.
    #[command(flatten)]
    pub json: JsonArgument,
}

/// The anhysteretic curves to try.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Curve {
    /// Try both and keep the better.
    Both,
    /// coth x − 1/x
    Langevin,
    /// tanh x
    Ising,
}

fn count(text: &str) -> Result<usize, String> {
    match text.parse() {
        Ok(count @ 1..) => Ok(count),
        _ => Err("a whole number of at least 1 is wanted".to_owned()),
    }
}

/// `auto`, and every law by its name.
pub fn names() -> PossibleValuesParser {
    PossibleValuesParser::new(std::iter::once(AUTO).chain(Family::ALL.map(Family::name)))
}

/// An output of a law by its key.
pub fn outputs() -> impl TypedValueParser<Value = Quantity> {
    PossibleValuesParser::new(LAW_OUTPUTS.map(Quantity::key)).try_map(|key| {
        let named = LAW_OUTPUTS.into_iter().find(|quantity| quantity.key() == key);
        named.ok_or("no output has this name")
    })
}
