//! Effects with one number in and one out, one behind the other: of the magnetization and of the sensor.
//!
//! A stretch of samples goes through one effect after the other, so that the choice of the effect is made once a
//! stretch and its loop is compiled for it.

use serde::{Deserialize, Serialize};

use crate::effects::signal::Signal;
use crate::effects::{
    after_effect, backlash, periodic_disturbance, quantisation, second_mode, sensor_delay, sensor_drift, sensor_gain,
    sensor_saturation,
};
use crate::{Effect, EffectKind, ModelError, Stage};

macro_rules! signals {
    ($($kind:ident in $file:ident),* $(,)?) => {
        /// Any effect that is a signal in and a signal out.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        // An actuator has a few of them: the bytes that a box would save are fewer than the time it would cost in every sample.
        #[allow(clippy::large_enum_variant)]
        enum SignalStage {
            $($kind($file::$kind),)*
        }

        impl SignalStage {
            /// None for an effect of another sort.
            fn of(effect: &Effect, tick_s: f64) -> Result<Option<Self>, ModelError> {
                Ok(match effect.kind() {
                    $(EffectKind::$kind => Some(Self::$kind(Signal::new(effect.values(), tick_s)?)),)*
                    _ => None,
                })
            }

            fn kind(&self) -> EffectKind {
                match self {
                    $(Self::$kind(_) => EffectKind::$kind,)*
                }
            }

            fn pass(&mut self, first: bool, samples: &mut [f64]) {
                match self {
                    $(Self::$kind(signal) => pass(signal, first, samples),)*
                }
            }
        }
    };
}

signals! {
    AfterEffect in after_effect,
    PeriodicDisturbance in periodic_disturbance,
    Backlash in backlash,
    SecondMode in second_mode,
    SensorDelay in sensor_delay,
    SensorGain in sensor_gain,
    SensorDrift in sensor_drift,
    SensorSaturation in sensor_saturation,
    Quantisation in quantisation,
}

fn pass<S: Signal>(signal: &mut S, first: bool, samples: &mut [f64]) {
    let mut samples = samples.iter_mut();
    if first && let Some(sample) = samples.next() {
        *sample = signal.steady_state(*sample);
    }
    for sample in samples {
        *sample = signal.step(*sample);
    }
}

/// The signal effects of one stage, in the order of the chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Signals(Vec<SignalStage>);

impl Signals {
    /// Those among `effects` that belong to the stage.
    pub fn of(effects: &[Effect], stage: Stage, tick_s: f64) -> Result<Self, ModelError> {
        let mut signals = Vec::new();
        for effect in effects.iter().filter(|effect| effect.kind().stage() == stage) {
            signals.extend(SignalStage::of(effect, tick_s)?);
        }
        signals.sort_by_key(SignalStage::kind);
        Ok(Signals(signals))
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Sends a stretch of samples through all of them; `first` where it is the run's first.
    pub fn pass(&mut self, first: bool, samples: &mut [f64]) {
        for signal in &mut self.0 {
            signal.pass(first, samples);
        }
    }
}
