//! The inverse in the loop: which tokens it reads and what it says.

use crate::{Command, Inverse, MagnetizationDemand, OtherParameters, StateEstimate};
use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, NodeId, Now, Previous, SafeField, status_word};
use anhyst_model::MagneticState;

impl Block for Inverse {
    const NODE: NodeId = NodeId::Inverse;
    type Inputs = (Now<Demand>, Now<Estimate>, Previous<SafeField>);
    type Outputs = (FieldCommand,);

    fn step(&mut self, tick: u64, inputs: Self::Inputs) -> Self::Outputs {
        // By reference: taken apart in the arguments, the tokens are copied once more.
        let (Now(demand), Now(estimate), Previous(safe)) = &inputs;
        let wanted = MagnetizationDemand {
            magnetization_a_per_m: demand.magnetization_a_per_m,
            magnetization_rate_a_per_m_s: demand.magnetization_rate_a_per_m_s,
        };
        let known = StateEstimate {
            shape_a_per_m: estimate.shape_a_per_m,
            // A material without saturation: only `a` is estimated.
            others: (estimate.saturation_magnetization_a_per_m > 0.0).then_some(OtherParameters {
                saturation_magnetization_a_per_m: estimate.saturation_magnetization_a_per_m,
                pinning_a_per_m: estimate.pinning_a_per_m,
                coupling: estimate.coupling,
                reversibility: estimate.reversibility,
            }),
            state: MagneticState {
                field_a_per_m: estimate.field_a_per_m,
                magnetization_a_per_m: estimate.magnetization_a_per_m,
            },
            next_field_a_per_m: estimate.next_field_a_per_m,
        };
        let fall_back = safe.status & SafeField::FALL_BACK != 0;
        let command = self.step_guarded(tick, wanted, known, fall_back, safe.field_a_per_m);
        (field_command(command, fall_back),)
    }

    /// What it remembers of the material goes on; the answer was not given, so that before it stays the last.
    fn follow(&mut self, tick: u64, inputs: Self::Inputs) {
        let last = self.last;
        Block::step(self, tick, inputs);
        self.last = last;
    }
}

pub(crate) fn field_command(command: Command, fallen_back: bool) -> FieldCommand {
    FieldCommand {
        field_a_per_m: command.field_a_per_m,
        coil_field_a_per_m: command.coil_field_a_per_m,
        start_magnetization_a_per_m: command.start_magnetization_a_per_m,
        reached_magnetization_a_per_m: command.reached_magnetization_a_per_m,
        status: status_word([
            (command.limited, FieldCommand::LIMITED),
            (fallen_back, FieldCommand::FALLEN_BACK),
        ]),
        ..FieldCommand::default()
    }
}
