//! A scenario's blocks: the one place that builds them, for the processes of a run and for whoever steps them by hand.

use super::Scenario;
use anhyst_estimator::Estimator;
use anhyst_guard::Guard;
use anhyst_inverse::{Drive, Inverse, LawInverse};
use anhyst_ipc::{Block, Demand, Estimate, FieldCommand, Invalid, NodeId, Now, Previous, SafeField};
use anhyst_plant_sim::{AmplifierNode, PlantNode};

fn refused(node: NodeId) -> impl Fn(&dyn std::fmt::Display) -> Invalid {
    move |error| Invalid::new(node.name(), error.to_string())
}

/// What stands in the inverse's place: the inverse, or a signal that needs none.
#[derive(Debug, Clone, PartialEq)]
#[allow(clippy::large_enum_variant)] // There is one in a process, and a box would be one more hop a tick.
pub enum InverseBlock {
    /// The hysteresis inverse.
    Inverse(Inverse),
    /// That of another hysteresis law than the domain wall's.
    Law(LawInverse),
    /// A prescribed field.
    Drive(Drive),
}

impl Scenario {
    /// The simulated plant, at rest.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn plant_block(&self) -> Result<PlantNode, Invalid> {
        let rod = &self.rod.constants;
        PlantNode::new(&self.plant, self.material()?, rod, self.tick_s, self.seed)
            .map_err(|error| refused(NodeId::Plant)(&error))
    }

    /// The simulated amplifier, at rest, with its watchdog.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn amplifier_block(&self) -> Result<AmplifierNode, Invalid> {
        AmplifierNode::new(&self.amplifier, self.tick_s)
            .and_then(|node| node.with_watchdog(&self.watchdog))
            .map_err(|error| refused(NodeId::Amplifier)(&error))
    }

    /// The estimator.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn estimator_block(&self) -> Result<Estimator, Invalid> {
        let (believed, rod_per_strain) = self.believed()?;
        Estimator::with_effects(
            &self.estimator,
            &believed,
            rod_per_strain,
            self.amplifier,
            self.tick_s,
            &self.effects,
        )
        .map_err(|error| refused(NodeId::Estimator)(&error))
    }

    /// The inverse, or the signal that the scenario has in its place.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn inverse_block(&self) -> Result<InverseBlock, Invalid> {
        let limit_a_per_m = self.guard.acting_field_limit_a_per_m();
        if self.inverse.is_open_loop() {
            let driven = self.inverse.driven();
            return Ok(InverseBlock::Drive(Drive::new(&driven, self.tick_s, limit_a_per_m)?));
        }
        let (believed, _) = self.believed()?;
        if let Some(law) = &believed.law {
            let inverse = LawInverse::new(&self.inverse, law, &self.amplifier, limit_a_per_m, self.tick_s);
            return inverse
                .map(InverseBlock::Law)
                .map_err(|error| refused(NodeId::Inverse)(&error));
        }
        Inverse::with_effects(
            &self.inverse,
            believed.hysteresis,
            &self.amplifier,
            limit_a_per_m,
            &self.effects,
            self.tick_s,
        )
        .and_then(|inverse| inverse.with_fall_back(&self.amplifier, self.tick_s))
        .map(InverseBlock::Inverse)
        .map_err(|error| refused(NodeId::Inverse)(&error))
    }

    /// The guard, with what it is told of the loop.
    ///
    /// # Errors
    /// A setting that cannot be used.
    pub fn guard_block(&self) -> Result<Guard, Invalid> {
        Ok(Guard::new(&self.guard, self.tick_s)?.believing(&self.beliefs()?))
    }
}

impl InverseBlock {
    /// As [`Block::step`] of what is in it.
    pub fn step(
        &mut self,
        tick: u64,
        demand: Now<Demand>,
        estimate: Now<Estimate>,
        safe: Previous<SafeField>,
    ) -> FieldCommand {
        let (command,) = match self {
            Self::Inverse(block) => Block::step(block, tick, (demand, estimate, safe)),
            Self::Law(block) => Block::step(block, tick, (demand, estimate, safe)),
            Self::Drive(block) => block.step(tick, (demand, estimate, safe)),
        };
        command
    }
}
