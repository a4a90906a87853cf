//! Every arrow of the loop, from the blocks' own types.

use anhyst_controller::Controller;
use anhyst_estimator::Estimator;
use anhyst_guard::Guard;
use anhyst_inverse::Inverse;
use anhyst_ipc::{Everything, Inputs, NodeId, Wire, wiring};
use anhyst_plant_sim::{AmplifierNode, PlantNode};

/// Every arrow of the loop.
pub fn wires() -> Vec<Wire> {
    [
        wiring::<PlantNode>(),
        wiring::<Estimator>(),
        wiring::<Controller>(),
        wiring::<Inverse>(),
        wiring::<Guard>(),
        wiring::<AmplifierNode>(),
        Everything::wires(NodeId::Recorder),
    ]
    .concat()
}
