//! How the loop makes up for each effect that it knows of, or why it cannot: one sentence a kind.

use anhyst_model::EffectKind;

/// What knowing an effect is worth to the loop.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Compensation {
    /// Turned round before it happens, or known to be the sensor's.
    Full(&'static str),
    /// A part of it, or only after the fact.
    Part(&'static str),
    /// Not at all.
    None(&'static str),
}

impl Compensation {
    /// Of that kind.
    pub fn of(kind: EffectKind) -> Self {
        use Compensation::{Full, None, Part};
        match kind {
            EffectKind::LoopDelay => Full("the demand is for that much later, and predictions are delayed by it"),
            EffectKind::AmplifierBandwidth => Full("the inverse leads the lag, and the estimator's field lags by it"),
            EffectKind::EddyCurrent => Full("the inverse leads the lag, and the estimator's field lags by it"),
            EffectKind::BiasShift => Full("the inverse takes the constant field off, and the estimator adds it"),
            EffectKind::AfterEffect => {
                Full("the inverse solves for the magnetization that its creep makes the wanted one")
            }
            EffectKind::QuadraticMagnetostriction => Full("the strain law is inverted with its quadratic part"),
            EffectKind::ThermalExpansion => Full("the strain by warming is reckoned and taken off the demand"),
            EffectKind::LoadChange => Full("feedforward, estimator and feedback work with the other rod"),
            EffectKind::Backlash
            | EffectKind::SecondMode
            | EffectKind::SensorDelay
            | EffectKind::SensorGain
            | EffectKind::SensorDrift
            | EffectKind::PeriodicDisturbance => Full(
                "the reference goes through it before it is compared, so that the feedback does not fight the sensor",
            ),
            EffectKind::SensorSaturation => {
                Part("beyond its limit the sensor is blind: there the feedforward acts alone, and is not disturbed")
            }
            EffectKind::ThermalDrift => Part("the estimator follows `a`, if its law adapts"),
            EffectKind::CoilHeating => {
                Full("the inverse asks a warm coil for more, and the estimator's field falls by it")
            }
            EffectKind::DeltaE | EffectKind::Stiffening | EffectKind::Friction => {
                Full("the feedforward brings up the force along the reference, and the estimator's rods have it")
            }
            EffectKind::AmplifierSaturation | EffectKind::AmplifierSlew => Part(
                "a limit stays a limit: the estimator knows what field comes of a command; move more slowly or less far",
            ),
            EffectKind::ExcessLoss => {
                Full("estimator and inverse step a hysteresis whose pinning grows with the rate of its field")
            }
            EffectKind::Prestress => Full("estimator and inverse step a hysteresis with its cubic coupling"),
            EffectKind::Accommodation => None("what walls are frozen depends on the whole past of every minor loop"),
            EffectKind::Quantisation => None("what is rounded away is lost; it is right in the mean"),
        }
    }

    /// As a sentence for a report.
    pub fn sentence(self, kind: EffectKind) -> String {
        let name = kind.name();
        match self {
            Compensation::Full(how) => format!("`{name}` is compensated: {how}."),
            Compensation::Part(how) => format!("`{name}` is compensated in part: {how}."),
            Compensation::None(why) => format!("`{name}` cannot be compensated by the loop: {why}."),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards against silence: the documents have the same sentences, effect by effect.
    #[test]
    fn the_documents_say_the_same() {
        let document = include_str!("../../../docs/control.md");
        for kind in EffectKind::ALL {
            let (word, how) = match Compensation::of(kind) {
                Compensation::Full(how) => ("yes", how),
                Compensation::Part(how) => ("in part", how),
                Compensation::None(how) => ("no", how),
            };
            let row = format!("| {} | {word} | {how} |", kind.name());
            assert!(document.contains(&row), "docs/control.md lacks the row\n{row}");
        }
    }
}
