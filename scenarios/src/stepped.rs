//! The loop as a value that its owner steps: the same blocks as in a run's processes, tokens handed over directly.
//!
//! [`Rig`] is what is in the machine (amplifier and plant), [`Control`] what commands it (estimator, controller, inverse, guard), and
//! [`SteppedLoop`] both, in the order of [`anhyst_ipc::NodeId::LOOP_ORDER`]: its tokens have the bits of an embedded run's. All of them
//! are state and nothing else: a clone goes on as the original would. Injected faults are the processes' matter and not here.

use super::{InverseBlock, Scenario};
use anhyst_controller::Controller;
use anhyst_estimator::Estimator;
use anhyst_guard::Guard;
use anhyst_ipc::{
    Block, Change, CoilField, Demand, Estimate, FieldCommand, Invalid, Measurement, Message, Now, Previous, SafeField,
    Truth,
};
use anhyst_plant_sim::{AmplifierNode, PlantNode};

fn stamped<M: Message>(mut token: M, tick: u64) -> M {
    token.stamp(tick, 0);
    token
}

/// Amplifier and plant.
#[derive(Debug, Clone, PartialEq)]
pub struct Rig {
    amplifier: AmplifierNode,
    plant: PlantNode,
    /// What the sensors said last.
    pub measurement: Measurement,
    /// What was really so then.
    pub truth: Truth,
    /// What the amplifier said last.
    pub coil_field: CoilField,
}

impl Rig {
    /// At rest, before tick 0.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn new(scenario: &Scenario) -> Result<Self, Invalid> {
        Ok(Self {
            amplifier: scenario.amplifier_block()?,
            plant: scenario.plant_block()?,
            measurement: Measurement::default(),
            truth: Truth::default(),
            coil_field: CoilField::default(),
        })
    }

    /// Goes to `tick` and measures there.
    pub fn measure(&mut self, tick: u64) {
        let (measurement, truth) = self.plant.step(tick, (Previous(self.coil_field),));
        self.measurement = stamped(measurement, tick);
        self.truth = stamped(truth, tick);
    }

    /// Gives the amplifier the field of `tick`, in which was measured before.
    pub fn act(&mut self, tick: u64, safe: SafeField) {
        let (coil_field,) = self.amplifier.step(tick, (Now(safe),));
        self.coil_field = stamped(coil_field, tick);
    }
}

/// Estimator, controller, inverse and guard.
#[derive(Debug, Clone, PartialEq)]
pub struct Control {
    estimator: Estimator,
    controller: Controller,
    inverse: InverseBlock,
    guard: Guard,
    /// What the estimator said last.
    pub estimate: Estimate,
    /// What the controller said last.
    pub demand: Demand,
    /// What the inverse said last.
    pub field_command: FieldCommand,
    /// What the guard said last.
    pub safe_field: SafeField,
}

impl Control {
    /// At rest, before tick 0.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn new(scenario: &Scenario) -> Result<Self, Invalid> {
        Ok(Self {
            estimator: scenario.estimator_block()?,
            controller: scenario.controller()?,
            inverse: scenario.inverse_block()?,
            guard: scenario.guard_block()?,
            estimate: Estimate::default(),
            demand: Demand::default(),
            field_command: FieldCommand::default(),
            safe_field: SafeField::default(),
        })
    }

    /// Answers the measurement of `tick`.
    pub fn step(&mut self, tick: u64, measurement: Measurement) {
        let safe = Previous(self.safe_field);
        let (estimate,) = Block::step(&mut self.estimator, tick, (Now(measurement), safe));
        self.estimate = stamped(estimate, tick);
        let heard = (Now(measurement), safe, Previous(self.field_command));
        let (demand,) = self.controller.step(tick, heard);
        self.demand = stamped(demand, tick);
        let (demand, estimate) = (Now(self.demand), Now(self.estimate));
        self.field_command = stamped(self.inverse.step(tick, demand, estimate, safe), tick);
        let (safe_field,) = self
            .guard
            .step(tick, (Now(self.field_command), Now(measurement), demand, estimate));
        self.safe_field = stamped(safe_field, tick);
    }

    /// Takes a change of a setting between two ticks; false if it is none of the controller's, or there is no room for more.
    pub fn change(&mut self, change: &Change) -> bool {
        Block::change(&mut self.controller, change)
    }
}

/// The whole loop.
#[derive(Debug, Clone, PartialEq)]
pub struct SteppedLoop {
    /// What is commanded.
    pub rig: Rig,
    /// What commands.
    pub control: Control,
}

impl SteppedLoop {
    /// At rest, before tick 0.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn new(scenario: &Scenario) -> Result<Self, Invalid> {
        Ok(Self {
            rig: Rig::new(scenario)?,
            control: Control::new(scenario)?,
        })
    }

    /// Does `tick`; they come one after another, from 0 on.
    pub fn step(&mut self, tick: u64) {
        self.rig.measure(tick);
        self.control.step(tick, self.rig.measurement);
        self.rig.act(tick, self.control.safe_field);
    }
}
