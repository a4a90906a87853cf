//! The controller in the loop: the only file here that knows messages.

use crate::Controller;
use crate::controller::Observation;
use anhyst_ipc::{Block, Change, Demand, FieldCommand, Measurement, NodeId, Now, Previous, SafeField, status_word};

/// The guard limits what is commanded, or does not follow it at all.
const GUARD_LIMITS: u64 = SafeField::AMPLITUDE_LIMITED | SafeField::SLEW_LIMITED;
const GUARD_ACTS: u64 = SafeField::RAMPING | SafeField::SAFE | SafeField::HOLDING;

impl Block for Controller {
    const NODE: NodeId = NodeId::Controller;
    type Inputs = (Now<Measurement>, Previous<SafeField>, Previous<FieldCommand>);
    type Outputs = (Demand,);

    fn change(&mut self, change: &Change) -> bool {
        Controller::change(self, change)
    }

    fn step(
        &mut self,
        tick: u64,
        (Now(measurement), Previous(safe), Previous(command)): Self::Inputs,
    ) -> Self::Outputs {
        let set = |status: u64, bits: u64| status & bits != 0;
        let decision = self.decide(
            tick,
            &Observation {
                displacement_m: measurement.displacement_m,
                field_a_per_m: safe.field_a_per_m,
                open: set(safe.status, GUARD_ACTS),
                field_cut_a_per_m: set(safe.status, GUARD_LIMITS).then_some(command.field_a_per_m - safe.field_a_per_m),
                reached_a_per_m: set(command.status, FieldCommand::LIMITED)
                    .then_some(command.reached_magnetization_a_per_m),
            },
        );
        (Demand {
            magnetization_a_per_m: decision.magnetization_a_per_m,
            magnetization_rate_a_per_m_s: decision.magnetization_rate_a_per_m_s,
            feedforward_a_per_m: decision.feedforward_a_per_m,
            feedback_a_per_m: decision.magnetization_a_per_m - decision.feedforward_a_per_m,
            reference_m: decision.reference_m,
            error_m: decision.error_m,
            integral_m: decision.integral_m,
            status: status_word([
                (decision.integration_stopped, Demand::INTEGRATION_STOPPED),
                (decision.starting, Demand::STARTING),
                (decision.learning, Demand::LEARNING),
                (decision.taken_back, Demand::TAKEN_BACK),
                (decision.changing, Demand::CHANGING),
            ]),
            ..Demand::default()
        },)
    }

    fn memory(&self) -> Option<String> {
        self.learned()
    }
}
