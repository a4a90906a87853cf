//! The seven tokens of the loop. Tick `k` is the instant `t_k`; every node answers tick `k` with a token of tick `k`.
//!
//! Timing: the plant measures at `t_k`; what is computed from it during `(t_k, t_k+1]` is in the coil at `t_k+2`, and
//! fields are linear between ticks. That is one sample of computing delay and one of first-order hold.

use crate::message::{Channel, Field, Message, message};

/// Calls `$body` with the message type of a channel.
#[macro_export]
macro_rules! with_message {
    (@ $type:ty, $message:ident => $body:expr) => {{
        type $message = $type;
        $body
    }};
    ($channel:expr, $message:ident => $body:expr) => {
        match $channel {
            $crate::Channel::Measurement => $crate::with_message!(@ $crate::Measurement, $message => $body),
            $crate::Channel::Truth => $crate::with_message!(@ $crate::Truth, $message => $body),
            $crate::Channel::Estimate => $crate::with_message!(@ $crate::Estimate, $message => $body),
            $crate::Channel::Demand => $crate::with_message!(@ $crate::Demand, $message => $body),
            $crate::Channel::FieldCommand => $crate::with_message!(@ $crate::FieldCommand, $message => $body),
            $crate::Channel::SafeField => $crate::with_message!(@ $crate::SafeField, $message => $body),
            $crate::Channel::CoilField => $crate::with_message!(@ $crate::CoilField, $message => $body),
        }
    };
}

message! {
    /// What the sensors say at `t_k`.
    Measurement on Measurement {
        /// Measured displacement of the rod's tip.
        displacement_m: f64 in "m",
        /// Measured field in the coil.
        coil_field_a_per_m: f64 in "A/m",
        /// Measured temperature of the rod; 0 where no sensor is fitted.
        temperature_k: f64 in "K",
    }
}

message! {
    /// What is really so at `t_k`: exists only in simulation; only the recorder and tests read it.
    Truth on Truth {
        /// True displacement of the rod's tip.
        displacement_m: f64 in "m",
        /// True field in the coil.
        coil_field_a_per_m: f64 in "A/m",
        /// True magnetization.
        magnetization_a_per_m: f64 in "A/m",
        /// True shape parameter a of the anhysteretic curve.
        shape_a_per_m: f64 in "A/m",
        /// True temperature of the rod.
        temperature_k: f64 in "K",
        /// Force of the cut on the rod's tip, positive against the rod.
        cutting_force_n: f64 in "N",
        /// True displacement of the rod's tip half a tick before t_k; at t_0 that of t_0.
        displacement_between_m: f64 in "m",
    }
}

message! {
    /// What the estimator knows at `t_k`: the parameter, the magnetic state, and how sure it is.
    Estimate on Estimate {
        /// Estimated shape parameter a.
        shape_a_per_m: f64 in "A/m",
        /// Best knowledge of the coil's field at t_k.
        field_a_per_m: f64 in "A/m",
        /// Magnetization at t_k, interpolated in the bank at the estimate.
        magnetization_a_per_m: f64 in "A/m",
        /// Field that is already on its way: in the coil at t_k+1.
        next_field_a_per_m: f64 in "A/m",
        /// Predicted minus filtered measured output, the error of (14).
        output_error_m: f64 in "m",
        /// Output that the model predicts at the estimate, f(a).
        predicted_output_m: f64 in "m",
        /// Lower (convex) cover of f at the estimate.
        lower_cover_m: f64 in "m",
        /// Upper (concave) cover of f at the estimate.
        upper_cover_m: f64 in "m",
        /// Slope of the cover that was used, the direction phi* of (18).
        slope_m_per_a_per_m: f64 in "m/(A/m)",
        /// Standard deviation of the estimate; 0 where the law gives none.
        standard_deviation_a_per_m: f64 in "A/m",
        /// Fisher information about a in the recent motion; its inverse square root is the Cramér-Rao bound. 0: none.
        information_per_a2_per_m2: f64 in "1/(A/m)^2",
        /// Condition (19) holds for a true a above the estimate by more than the inverse of this; 0: for none.
        excitation_above_per_a_per_m: f64 in "1/(A/m)",
        /// The same for a true a below the estimate.
        excitation_below_per_a_per_m: f64 in "1/(A/m)",
        /// Estimated saturation magnetization; 0 where `a` alone is estimated, and so are all that follow.
        saturation_magnetization_a_per_m: f64 in "A/m",
        /// Estimated k.
        pinning_a_per_m: f64 in "A/m",
        /// Estimated alpha.
        coupling: f64 in "",
        /// Estimated c.
        reversibility: f64 in "",
        /// Standard deviation of Ms; 0 where it is held.
        saturation_magnetization_deviation_a_per_m: f64 in "A/m",
        /// That of k.
        pinning_deviation_a_per_m: f64 in "A/m",
        /// That of alpha.
        coupling_deviation: f64 in "",
        /// That of c.
        reversibility_deviation: f64 in "",
        /// Directions of the parameters that the recent motion tells.
        informed_directions: u64 in "",
        /// Of a material with another law than the domain wall's: which of its weights this tick tells, in turn.
        weight_index: u64 in "",
        /// That weight, in output per what it is multiplied with; of the domain wall law 0.
        weight: f64 in "",
        /// Bits:
        status: u64 in "" {
            ADAPTING = 1 "adapting (outside the dead zone)",
            AT_EDGE = 2 "at an edge of the parameter's range",
            HELD = 4 "held (nothing is learnt)",
            FIXED = 8 "fixed by the scenario",
            OUTLIER = 16 "the measurement was left out, because it is too far from the predicted",
            UNMEASURED = 32 "no usable measurement of this tick has come",
        },
    }
}

message! {
    /// What the controller wants, decided at `t_k` for `t_k+2`.
    Demand on Demand {
        /// Magnetization wanted at t_k+2: feedforward plus feedback.
        magnetization_a_per_m: f64 in "A/m",
        /// Time derivative of the feedforward part at t_k+2, for the compensation of lags.
        magnetization_rate_a_per_m_s: f64 in "A/(m s)",
        /// Feedforward part of the magnetization.
        feedforward_a_per_m: f64 in "A/m",
        /// Feedback (PID) part of the magnetization.
        feedback_a_per_m: f64 in "A/m",
        /// Reference at t_k, the same instant as the measurement.
        reference_m: f64 in "m",
        /// Reference at t_k minus measured displacement at t_k.
        error_m: f64 in "m",
        /// State of the PID's integrator, in metres of demanded displacement.
        integral_m: f64 in "m",
        /// Bits:
        status: u64 in "" {
            INTEGRATION_STOPPED = 1 "integration stopped (anti-windup)",
            STARTING = 2 "start not finished (bumpless)",
            LEARNING = 4 "what repeats is learned",
            TAKEN_BACK = 8 "the error grew while learning: taken back",
            CHANGING = 16 "a changed setting is on its way to its new value",
        },
    }
}

message! {
    /// The field that brings the magnetization to the demand, for `t_k+2`.
    FieldCommand on FieldCommand {
        /// Field wanted from the amplifier.
        field_a_per_m: f64 in "A/m",
        /// Field wanted in the coil at t_k+2, before the amplifier's lag is compensated.
        coil_field_a_per_m: f64 in "A/m",
        /// Predicted magnetization at t_k+1, where the inversion starts.
        start_magnetization_a_per_m: f64 in "A/m",
        /// Magnetization that the commanded field is predicted to reach.
        reached_magnetization_a_per_m: f64 in "A/m",
        /// Bits:
        status: u64 in "" {
            LIMITED = 1 "the demand needs more field than the limit",
            FALLEN_BACK = 2 "fallen back to the nominal inverse",
        },
    }
}

message! {
    /// The field that the amplifier may have: limited, and safe whatever the others do.
    SafeField on SafeField {
        /// Field for t_k+2.
        field_a_per_m: f64 in "A/m",
        /// Bits:
        status: u64 in "" {
            AMPLITUDE_LIMITED = 1 "limited in amplitude",
            SLEW_LIMITED = 2 "limited in slew",
            RAMPING = 4 "ramping to the safe field",
            SAFE = 8 "at the safe field",
            HOLDING = 16 "holding the last field",
            FALL_BACK = 32 "the inverse is to leave the estimate alone (fall back)",
        },
        /// Number of the event that was raised in this tick; 0: none.
        event: u64 in "",
    }
}

message! {
    /// The field in the coil at `t_k+1`: the interval that begins at `t_k` ends with it.
    CoilField on CoilField {
        /// Field at t_k+1.
        field_a_per_m: f64 in "A/m",
        /// Bits:
        status: u64 in "" {
            AMPLITUDE_LIMITED = 1 "amplitude limit",
            SLEW_LIMITED = 2 "slew limit",
            RAMPING = 4 "ramping to the safe field because nobody commands",
            SAFE = 8 "at it for that reason",
            RETURNING = 16 "on the way back to the commands",
        },
    }
}

/// A status word: the bits that are set.
pub fn status_word<const N: usize>(bits: [(bool, u64); N]) -> u64 {
    let set = bits.into_iter().filter(|(set, _)| *set);
    set.fold(0, |status, (_, bit)| status | bit)
}

impl Channel {
    /// The fields of its tokens.
    pub const fn fields(self) -> &'static [Field] {
        with_message!(self, M => M::FIELDS)
    }
}
