//! The inverse in the loop: which tokens it reads and what it says.

use crate::{Command, Inverse, Known, Wanted};
use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, NodeId, Now};
use anhyst_model::MagneticState;

const LIMITED: u64 = 1;
/// An estimate that is older says nothing about the magnetic state any more. In lockstep it is never older than this tick.
const OLDEST_ESTIMATE_TICKS: u64 = 2;

impl Block for Inverse {
    const NODE: NodeId = NodeId::Inverse;
    type Inputs = (Now<Demand>, Now<Estimate>);
    type Outputs = (FieldCommand,);

    fn step(&mut self, tick: u64, (Now(demand), Now(estimate)): Self::Inputs) -> Self::Outputs {
        let wanted = Wanted {
            magnetization_a_per_m: demand.magnetization_a_per_m,
            magnetization_rate_a_per_m_s: demand.magnetization_rate_a_per_m_s,
        };
        if tick.saturating_sub(estimate.tick) > OLDEST_ESTIMATE_TICKS {
            return (field_command(self.step_uninformed(wanted)),);
        }
        let known = Known {
            shape_a_per_m: estimate.shape_a_per_m,
            state: MagneticState {
                field_a_per_m: estimate.field_a_per_m,
                magnetization_a_per_m: estimate.magnetization_a_per_m,
            },
            next_field_a_per_m: estimate.next_field_a_per_m,
        };
        (field_command(Inverse::step(self, wanted, known)),)
    }
}

fn field_command(command: Command) -> FieldCommand {
    FieldCommand {
        field_a_per_m: command.field_a_per_m,
        coil_field_a_per_m: command.coil_field_a_per_m,
        start_magnetization_a_per_m: command.start_magnetization_a_per_m,
        reached_magnetization_a_per_m: command.reached_magnetization_a_per_m,
        status: if command.limited { LIMITED } else { 0 },
        ..FieldCommand::default()
    }
}
