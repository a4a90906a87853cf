//! What an estimate is worth: deviations, correlations, information, and sentences where the data cannot carry it.

use super::coordinates::Coordinates;
use super::information::Information;
use super::square_root::SquareRoot;
use anhyst_model::{Anhysteretic, Hysteresis, HysteresisParameter};
use serde::{Deserialize, Serialize};

/// A deviation above this share of the first one: the data have said next to nothing.
const UNINFORMED_SHARE: f64 = 0.5;

/// The estimate with its uncertainty; lists are in the order of the settings.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MultiParameterUncertainty {
    /// What was estimated.
    pub parameters: Vec<HysteresisParameter>,
    /// The estimates, each in its unit.
    pub estimates: Vec<f64>,
    /// Their standard deviations.
    pub deviations: Vec<f64>,
    /// Their correlations, knowledge before the data included.
    pub correlation: Vec<Vec<f64>>,
    /// Information of the data alone, I_ij per product of the two units.
    pub information: Vec<Vec<f64>>,
    /// What a reader must not miss.
    pub warnings: Vec<String>,
}

impl MultiParameterUncertainty {
    pub(super) fn new(
        coordinates: &Coordinates,
        root: &SquareRoot,
        information: &Information,
        hysteresis: &Hysteresis,
        correlation_limit: f64,
    ) -> Self {
        let parameters: Vec<HysteresisParameter> = coordinates.parameters().collect();
        let count = parameters.len();
        let square = |entry: &dyn Fn(usize, usize) -> f64| -> Vec<Vec<f64>> {
            (0..count).map(|i| (0..count).map(|j| entry(i, j)).collect()).collect()
        };
        let scaled: Vec<f64> = (0..count).map(|i| root.covariance(i, i).sqrt()).collect();
        let mut uncertainty = Self {
            estimates: parameters.iter().map(|parameter| parameter.of(hysteresis)).collect(),
            deviations: (0..count)
                .map(|i| scaled[i] * coordinates.unit(i, hysteresis))
                .collect(),
            correlation: square(&|i, j| root.covariance(i, j) / (scaled[i] * scaled[j])),
            information: square(&|i, j| information.about(parameters[i], parameters[j])),
            warnings: Vec::new(),
            parameters,
        };
        let mut warnings = uncertainty.pairs(hysteresis, correlation_limit);
        warnings.extend(uncertainty.singles(coordinates, hysteresis));
        uncertainty.warnings = warnings;
        uncertainty
    }

    fn pairs(&self, hysteresis: &Hysteresis, limit: f64) -> Vec<String> {
        let mut sentences = Vec::new();
        for (i, first) in self.parameters.iter().enumerate() {
            for (j, second) in self.parameters.iter().enumerate().skip(i + 1) {
                let correlation = self.correlation[i][j];
                if correlation.abs() <= limit {
                    continue;
                }
                let (one, other) = (first.symbol(), second.symbol());
                let mut sentence = format!(
                    "{one} and {other} cannot be told apart by these data: \
                     their correlation is {correlation:.4}, the limit {limit}; \
                     hold one of them, or take data with other amplitudes, biases and minor loops"
                );
                let pair = [*first, *second];
                let (shape, coupling) = (HysteresisParameter::Shape, HysteresisParameter::Coupling);
                if pair == [shape, coupling] || pair == [coupling, shape] {
                    sentence += &self.effective_shape(hysteresis);
                }
                sentences.push(sentence);
            }
        }
        sentences
    }

    /// a − α·Ms·s is what one loop fixes where a and α trade.
    fn effective_shape(&self, hysteresis: &Hysteresis) -> String {
        let slope = hysteresis.anhysteretic.initial_slope();
        let scale = slope * hysteresis.saturation_magnetization_a_per_m;
        let effective = hysteresis.shape_a_per_m - hysteresis.coupling * scale;
        let divisor = match hysteresis.anhysteretic {
            Anhysteretic::Langevin => "/3",
            Anhysteretic::Ising => "",
        };
        format!("; what they fix together is a - alpha*Ms{divisor} = {effective:.1} A/m")
    }

    fn singles(&self, coordinates: &Coordinates, hysteresis: &Hysteresis) -> Vec<String> {
        let mut sentences = Vec::new();
        for (i, parameter) in self.parameters.iter().enumerate() {
            let (symbol, unit) = (parameter.symbol(), parameter.unit());
            let (now, first) = (self.deviations[i], coordinates.start_deviation(i));
            if now > UNINFORMED_SHARE * first {
                sentences.push(format!(
                    "the data say next to nothing about {symbol}: \
                     its standard deviation is {now:.3e} {unit} after {first:.3e} {unit} before them"
                ));
            }
            if coordinates.at_edge(i, hysteresis) {
                sentences.push(format!(
                    "{symbol} stands at the edge of its range, {} {unit}: \
                     its standard deviation means nothing, widen the range or hold it",
                    self.estimates[i]
                ));
            }
        }
        sentences
    }
}
