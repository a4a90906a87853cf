//! Effects on the field, one behind the other: a tick's field goes through the amplifier's, then the material's.

use serde::{Deserialize, Serialize};

use crate::effects::field_lag::FieldLag;
use crate::effects::intersample_field::{FieldEffect, IntersampleField};
use crate::effects::limit::Limit;
use crate::effects::{
    amplifier_bandwidth, amplifier_saturation, amplifier_slew, bias_shift, coil_heating, eddy_current, loop_delay,
};
use crate::{AmplifierConstants, Effect, EffectKind, ModelError, Stage};

macro_rules! fields {
    ($($kind:ident in $file:ident),* $(,)?) => {
        /// Any effect that takes one field and gives another.
        #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
        enum FieldStage {
            $($kind($file::$kind),)*
        }

        impl FieldStage {
            /// None for an effect of another sort.
            fn of(effect: &Effect, tick_s: f64) -> Result<Option<Self>, ModelError> {
                Ok(match effect.kind() {
                    $(EffectKind::$kind => Some(Self::$kind(FieldEffect::new(effect.values(), tick_s)?)),)*
                    _ => None,
                })
            }

            fn kind(&self) -> EffectKind {
                match self {
                    $(Self::$kind(_) => EffectKind::$kind,)*
                }
            }

            fn steady_state(&mut self, field: f64) -> f64 {
                match self {
                    $(Self::$kind(effect) => effect.steady_state(field),)*
                }
            }

            #[inline]
            fn follow(&mut self, input: &IntersampleField, output: &mut IntersampleField) {
                match self {
                    $(Self::$kind(effect) => {
                        for piece in input.pieces() {
                            effect.follow(*piece, output);
                        }
                    })*
                }
            }
        }
    };
}

fields! {
    LoopDelay in loop_delay,
    AmplifierSaturation in amplifier_saturation,
    AmplifierSlew in amplifier_slew,
    AmplifierBandwidth in amplifier_bandwidth,
    CoilHeating in coil_heating,
    EddyCurrent in eddy_current,
    BiasShift in bias_shift,
}

/// The field effects of one stage, in the order of the chain.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Fields(Vec<FieldStage>);

impl Fields {
    /// Those among `effects` that belong to the stage.
    pub fn of(effects: &[Effect], stage: Stage, tick_s: f64) -> Result<Self, ModelError> {
        let mut fields = Vec::new();
        for effect in effects.iter().filter(|effect| effect.kind().stage() == stage) {
            fields.extend(FieldStage::of(effect, tick_s)?);
        }
        fields.sort_by_key(FieldStage::kind);
        Ok(Fields(fields))
    }

    /// The nominal amplifier, and the effects in it.
    pub fn of_amplifier(nominal: &AmplifierConstants, effects: &[Effect], tick_s: f64) -> Result<Self, ModelError> {
        let mut fields = Vec::new();
        // A sweep without time is slower than any delay, limit of rate, or lag.
        if tick_s.is_finite() {
            if nominal.delay_ticks > 0 {
                let delay = loop_delay::LoopDelay::of(f64::from(nominal.delay_ticks) * tick_s, tick_s)?;
                fields.push(FieldStage::LoopDelay(delay));
            }
            if let Some(limit) = nominal.slew_limit_a_per_m_s {
                fields.push(FieldStage::AmplifierSlew(amplifier_slew::AmplifierSlew::of(
                    limit, tick_s,
                )));
            }
            if nominal.bandwidth_hz.is_some() {
                let lag = FieldLag::new(nominal.lag_s(), tick_s);
                let bandwidth = amplifier_bandwidth::AmplifierBandwidth::First(lag);
                fields.push(FieldStage::AmplifierBandwidth(bandwidth));
            }
        }
        if let Some(limit) = nominal.field_limit_a_per_m {
            let clip = amplifier_saturation::AmplifierSaturation::new(Limit::clip(limit));
            fields.push(FieldStage::AmplifierSaturation(clip));
        }
        fields.extend(Self::of(effects, Stage::Amplifier, tick_s)?.0);
        // Stable: the nominal part of a kind comes before the effect.
        fields.sort_by_key(FieldStage::kind);
        Ok(Fields(fields))
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// The run's first sample through all of them.
    pub fn steady_state(&mut self, field: f64) -> f64 {
        self.0.iter_mut().fold(field, |field, stage| stage.steady_state(field))
    }

    /// One tick's field through all of them; `spare` is room to work in.
    #[inline]
    pub fn follow(&mut self, intersample: &mut IntersampleField, spare: &mut IntersampleField) {
        for stage in &mut self.0 {
            spare.clear();
            stage.follow(intersample, spare);
            intersample.take(spare);
        }
    }
}
