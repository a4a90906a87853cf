//! Blocks that answer with zeros: same wiring, same messages, no work. What a loop of them takes is the transport's.

use crate::error::RunError;
use anhyst_controller::Controller;
use anhyst_estimator::Estimator;
use anhyst_guard::Guard;
use anhyst_inverse::Inverse;
use anhyst_ipc::{Block, Connections, Node, NodeId, Stage};
use anhyst_plant_sim::{AmplifierNode, PlantNode};
use std::marker::PhantomData;

/// A block in the place of `B` that does nothing.
struct Empty<B>(PhantomData<B>);

impl<B: Block> Block for Empty<B>
where
    B::Outputs: Default,
{
    const NODE: NodeId = B::NODE;
    type Inputs = B::Inputs;
    type Outputs = B::Outputs;

    fn step(&mut self, _tick: u64, _inputs: Self::Inputs) -> Self::Outputs {
        Self::Outputs::default()
    }
}

fn open<B>(connections: &mut Connections, ticks: u64) -> Result<Box<dyn Stage>, RunError>
where
    B: Block + 'static,
    B::Outputs: Default,
{
    Ok(Box::new(Node::open(Empty::<B>(PhantomData), connections, ticks)?))
}

/// The stage of `node`, empty.
///
/// # Errors
/// If a link cannot be opened.
pub fn empty_stage(node: NodeId, ticks: u64, connections: &mut Connections) -> Result<Box<dyn Stage>, RunError> {
    match node {
        NodeId::Plant => open::<PlantNode>(connections, ticks),
        NodeId::Estimator => open::<Estimator>(connections, ticks),
        NodeId::Controller => open::<Controller>(connections, ticks),
        NodeId::Inverse => open::<Inverse>(connections, ticks),
        NodeId::Guard => open::<Guard>(connections, ticks),
        NodeId::Amplifier => open::<AmplifierNode>(connections, ticks),
        NodeId::Recorder => Err(RunError::Setup("the recorder is no stage of the loop".into())),
    }
}
