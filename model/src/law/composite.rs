//! y = y₀ + b v + Σ h(v) + Σ d_k x_k,  x_k' = (v − x_k)/τ_k: hysteresis with what stands beside it in measured data.
//!
//! v input, y output, y₀ the sensor's zero, b ≥ 0 a line, h laws, x_k slow lags of weight d_k ≥ 0: creep, whose slow part spreads
//! over decades of time. Between two samples the input stands still ([`LawModel::pass`]), then it moves ([`HysteresisLaw::advance`]);
//! so the inverse of a sample is that of everything else with the lags as they are. Without history: at rest at input 0.
//! Source of the creep: Kuhnen and Janocha (1998), a sum of first-order operators; Jung and Gweon, Rev. Sci. Instrum. 71 (2000) 1896.

use serde::{Deserialize, Serialize};

use super::bouc_wen::BoucWenState;
use super::domain_wall::MagneticState;
use super::{BoucWen, HysteresisLaw, LawParameter, PlaySum, PlaySumState, Preisach, PreisachState, ScaledDomainWall};
use crate::ModelError;
use crate::error::{require, require_not_negative, require_positive};

/// Any law.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Law {
    /// Weighted generalised plays; Prandtl-Ishlinskii is one of them.
    Plays(PlaySum),
    /// Preisach.
    Preisach(Preisach),
    /// Bouc-Wen.
    BoucWen(BoucWen),
    /// The paper's law.
    DomainWall(ScaledDomainWall),
}

/// What a [`Law`] remembers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs)]
pub enum LawState {
    Plays(PlaySumState),
    Preisach(PreisachState),
    BoucWen(BoucWenState),
    DomainWall(MagneticState),
}

/// The same for whichever law it is; a state of another law cannot come about, and stays as it is.
macro_rules! with_state {
    ($law:expr, $state:expr, $own:ident, $of:ident => $answer:expr, $else:expr) => {
        match ($law, $state) {
            (Law::Plays($own), LawState::Plays($of)) => $answer,
            (Law::Preisach($own), LawState::Preisach($of)) => $answer,
            (Law::BoucWen($own), LawState::BoucWen($of)) => $answer,
            (Law::DomainWall($own), LawState::DomainWall($of)) => $answer,
            _ => $else,
        }
    };
}

macro_rules! with_law {
    ($law:expr, $own:ident => $answer:expr) => {
        match $law {
            Law::Plays($own) => $answer,
            Law::Preisach($own) => $answer,
            Law::BoucWen($own) => $answer,
            Law::DomainWall($own) => $answer,
        }
    };
}

impl HysteresisLaw for Law {
    type State = LawState;

    fn rest(&self) -> LawState {
        match self {
            Law::Plays(own) => LawState::Plays(own.rest()),
            Law::Preisach(own) => LawState::Preisach(own.rest()),
            Law::BoucWen(own) => LawState::BoucWen(own.rest()),
            Law::DomainWall(own) => LawState::DomainWall(own.rest()),
        }
    }

    fn parameters(&self) -> Vec<LawParameter> {
        with_law!(self, own => own.parameters())
    }

    fn validate(&self) -> Result<(), ModelError> {
        with_law!(self, own => own.validate())
    }

    fn input(state: &LawState) -> f64 {
        match state {
            LawState::Plays(own) => own.input,
            LawState::Preisach(own) => own.input,
            LawState::BoucWen(own) => own.input,
            LawState::DomainWall(own) => own.field_a_per_m,
        }
    }

    fn output(&self, state: &LawState) -> f64 {
        with_state!(self, state, own, of => own.output(of), f64::NAN)
    }

    fn advance(&self, state: &mut LawState, input_to: f64) {
        with_state!(self, state, own, of => own.advance(of, input_to), ());
    }

    fn ahead(&self, state: &LawState, input_to: f64) -> (f64, f64) {
        with_state!(self, state, own, of => own.ahead(of, input_to), (f64::NAN, f64::NAN))
    }

    fn slope(&self, state: &LawState, rising: bool) -> f64 {
        with_state!(self, state, own, of => own.slope(of, rising), f64::NAN)
    }

    fn input_for(&self, state: &LawState, output_to: f64, input_limit: f64) -> (f64, bool) {
        with_state!(self, state, own, of => own.input_for(of, output_to, input_limit), (f64::NAN, false))
    }
}

impl Law {
    /// What the output is linear in, each not negative.
    pub fn weights(&self) -> Vec<f64> {
        match self {
            Law::Plays(own) => own.groups.iter().flat_map(|group| &group.weights).copied().collect(),
            Law::Preisach(own) => own.free_weights().to_vec(),
            Law::BoucWen(own) => vec![own.amplitude],
            Law::DomainWall(own) => vec![own.gain],
        }
    }

    fn weight_count(&self) -> usize {
        match self {
            Law::Plays(own) => own.groups.iter().map(|group| group.weights.len()).sum(),
            Law::Preisach(own) => own.free_weights().len(),
            Law::BoucWen(_) | Law::DomainWall(_) => 1,
        }
    }

    fn set_weights(&mut self, weights: &[f64]) {
        match self {
            Law::Plays(own) => {
                let own = own.groups.iter_mut().flat_map(|group| &mut group.weights);
                own.zip(weights).for_each(|(own, weight)| *own = *weight);
            }
            Law::Preisach(own) => own.set_free_weights(weights),
            Law::BoucWen(own) => own.amplitude = weights[0],
            Law::DomainWall(own) => own.gain = weights[0],
        }
    }

    fn regressors(&self, state: &LawState, into: &mut Vec<f64>) {
        match (self, state) {
            (Law::Plays(_), LawState::Plays(of)) => into.extend(&of.plays),
            (Law::Preisach(own), LawState::Preisach(of)) => own.regressors(of, into),
            (Law::BoucWen(_), LawState::BoucWen(of)) => into.push(of.yielded),
            (Law::DomainWall(_), LawState::DomainWall(of)) => into.push(of.magnetization_a_per_m),
            _ => {}
        }
    }
}

/// One lag of the creep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SlowLag {
    /// τ, s.
    pub time_constant_s: f64,
    /// d, output per input.
    pub weight: f64,
}

impl SlowLag {
    /// The share of its way that a lag goes in a time.
    pub fn share_in(time_constant_s: f64, time_s: f64) -> f64 {
        -libm::expm1(-time_s / time_constant_s)
    }
}

/// Laws in parallel, a line and creep.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LawModel {
    /// y₀.
    pub offset: f64,
    /// b.
    pub slope: f64,
    /// h; none for a line alone.
    pub laws: Vec<Law>,
    /// Creep; of a run without time it is left out.
    #[serde(default)]
    pub creep: Vec<SlowLag>,
}

/// What a [`LawModel`] remembers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LawModelState {
    input: f64,
    laws: Vec<LawState>,
    lags: Vec<f64>,
    /// The time that `shares` are for, s.
    shares_of_s: f64,
    shares: Vec<f64>,
}

impl LawModel {
    /// Time passes at the present input.
    pub fn pass(&self, state: &mut LawModelState, time_s: f64) {
        if state.shares_of_s != time_s {
            state.shares_of_s = time_s;
            for (share, lag) in state.shares.iter_mut().zip(&self.creep) {
                *share = SlowLag::share_in(lag.time_constant_s, time_s);
            }
        }
        for (lag, share) in state.lags.iter_mut().zip(&state.shares) {
            *lag += share * (state.input - *lag);
        }
    }

    /// What the output is linear in: offset, line, the weights of each law in turn, those of the lags. All but the offset are not
    /// negative.
    pub fn weights(&self) -> Vec<f64> {
        let laws = self.laws.iter().flat_map(Law::weights);
        let lags = self.creep.iter().map(|lag| lag.weight);
        [self.offset, self.slope].into_iter().chain(laws).chain(lags).collect()
    }

    /// Takes other weights, as many as there are. A state from before keeps sums of the old ones: [`LawModel::reweigh`] it.
    pub fn set_weights(&mut self, weights: &[f64]) {
        let (beside, mut weights) = weights.split_at(2);
        (self.offset, self.slope) = (beside[0], beside[1]);
        for law in &mut self.laws {
            let (own, rest) = weights.split_at(law.weight_count());
            law.set_weights(own);
            weights = rest;
        }
        for (lag, weight) in self.creep.iter_mut().zip(weights) {
            lag.weight = *weight;
        }
    }

    /// Brings a state to other weights than those that it was made with: where the law is, not what it gave.
    pub fn reweigh(&self, state: &mut LawModelState) {
        for (law, own) in self.laws.iter().zip(&mut state.laws) {
            if let (Law::Preisach(law), LawState::Preisach(own)) = (law, own) {
                law.reweigh(own);
            }
        }
    }

    /// Leaves out what has no weight: plays, laws, lags. The output stays the same.
    pub fn drop_zeros(&mut self) {
        self.laws.retain_mut(|law| {
            if let Law::Plays(own) = law {
                own.drop_zeros();
            }
            law.weights().iter().any(|weight| *weight != 0.0)
        });
        self.creep.retain(|lag| lag.weight != 0.0);
    }

    /// d output/d weight of each of [`LawModel::weights`], which for a law's own amplitude holds while it is above 0.
    pub fn regressors(&self, state: &LawModelState, into: &mut Vec<f64>) {
        into.clear();
        into.extend([1.0, state.input]);
        for (law, own) in self.laws.iter().zip(&state.laws) {
            law.regressors(own, into);
        }
        into.extend(&state.lags);
    }

    /// All that is not a law.
    fn beside(&self, state: &LawModelState, input: f64) -> f64 {
        let mut output = self.offset + self.slope * input;
        for (lag, value) in self.creep.iter().zip(&state.lags) {
            output += lag.weight * value;
        }
        output
    }
}

impl HysteresisLaw for LawModel {
    type State = LawModelState;

    fn rest(&self) -> LawModelState {
        LawModelState {
            input: 0.0,
            laws: self.laws.iter().map(HysteresisLaw::rest).collect(),
            lags: vec![0.0; self.creep.len()],
            shares_of_s: 0.0,
            shares: vec![0.0; self.creep.len()],
        }
    }

    /// Of creep each group of equal weights counts once.
    fn parameters(&self) -> Vec<LawParameter> {
        let any = [f64::NEG_INFINITY, f64::INFINITY];
        let mut parameters = vec![LawParameter::new("offset", self.offset, any)];
        if self.slope != 0.0 {
            parameters.push(LawParameter::weight("line", self.slope));
        }
        parameters.extend(self.laws.iter().flat_map(HysteresisLaw::parameters));
        let mut before = None;
        for lag in &self.creep {
            if before.replace(lag.weight) != Some(lag.weight) {
                parameters.push(LawParameter::weight(
                    format!("creep from {:.2e} s", lag.time_constant_s),
                    lag.weight,
                ));
            }
        }
        parameters
    }

    fn validate(&self) -> Result<(), ModelError> {
        require(true, "offset of a law", self.offset, "(unit of the output)", "finite")?;
        require_not_negative(self.slope, "line beside a law", "(output per input)")?;
        for lag in &self.creep {
            require_positive(lag.time_constant_s, "time constant of creep", "s")?;
            require_not_negative(lag.weight, "weight of creep", "(output per input)")?;
        }
        self.laws.iter().try_for_each(HysteresisLaw::validate)
    }

    fn input(state: &LawModelState) -> f64 {
        state.input
    }

    fn output(&self, state: &LawModelState) -> f64 {
        let laws = self.laws.iter().zip(&state.laws);
        laws.fold(self.beside(state, state.input), |sum, (law, own)| sum + law.output(own))
    }

    fn advance(&self, state: &mut LawModelState, input_to: f64) {
        state.input = input_to;
        for (law, own) in self.laws.iter().zip(&mut state.laws) {
            law.advance(own, input_to);
        }
    }

    fn ahead(&self, state: &LawModelState, input_to: f64) -> (f64, f64) {
        let (mut output, mut slope) = (self.beside(state, input_to), self.slope);
        for (law, own) in self.laws.iter().zip(&state.laws) {
            let (of_law, slope_of_law) = law.ahead(own, input_to);
            output += of_law;
            slope += slope_of_law;
        }
        (output, slope)
    }

    fn slope(&self, state: &LawModelState, rising: bool) -> f64 {
        let laws = self.laws.iter().zip(&state.laws);
        laws.fold(self.slope, |sum, (law, own)| sum + law.slope(own, rising))
    }
}
