//! The inverse in the loop: which tokens it reads and what it says.

use crate::{Command, Inverse, Known, Wanted};
use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, NodeId, Now, Previous, SafeField};
use anhyst_model::MagneticState;

const LIMITED: u64 = 1;
const FALLEN_BACK: u64 = 2;
/// Bit of `SafeField::status`: leave the estimate alone.
const FALL_BACK: u64 = 32;

impl Block for Inverse {
    const NODE: NodeId = NodeId::Inverse;
    type Inputs = (Now<Demand>, Now<Estimate>, Previous<SafeField>);
    type Outputs = (FieldCommand,);

    fn step(&mut self, tick: u64, (Now(demand), Now(estimate), Previous(safe)): Self::Inputs) -> Self::Outputs {
        let wanted = Wanted {
            magnetization_a_per_m: demand.magnetization_a_per_m,
            magnetization_rate_a_per_m_s: demand.magnetization_rate_a_per_m_s,
        };
        let known = Known {
            shape_a_per_m: estimate.shape_a_per_m,
            state: MagneticState {
                field_a_per_m: estimate.field_a_per_m,
                magnetization_a_per_m: estimate.magnetization_a_per_m,
            },
            next_field_a_per_m: estimate.next_field_a_per_m,
        };
        let fall_back = safe.status & FALL_BACK != 0;
        let command = self.step_guarded(tick, wanted, known, fall_back, safe.field_a_per_m);
        (field_command(command, fall_back),)
    }
}

fn field_command(command: Command, fallen_back: bool) -> FieldCommand {
    FieldCommand {
        field_a_per_m: command.field_a_per_m,
        coil_field_a_per_m: command.coil_field_a_per_m,
        start_magnetization_a_per_m: command.start_magnetization_a_per_m,
        reached_magnetization_a_per_m: command.reached_magnetization_a_per_m,
        status: u64::from(command.limited) * LIMITED + u64::from(fallen_back) * FALLEN_BACK,
        ..FieldCommand::default()
    }
}
