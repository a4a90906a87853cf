//! What is inside an FMU: blocks of a run, stepped by whoever simulates.
//!
//! The step from t_k to t_k+1: a plant is given the field of tick k and measures at t_k+1; controller and inverse answer in tick k what
//! they were told at t_k, and their answer stands at t_k+1, the end of that step; the loop does tick k+1. Before the first step plant and
//! loop have done tick 0, which is the start itself.

use crate::kind::Kind;
use crate::refusal::Refusal;
use crate::tokens::Tokens;
use anhyst_ipc::{Change, Invalid, Now, Previous};
use anhyst_scenario::{Control, InverseBlock, Rig, Scenario, SteppedLoop};

/// The blocks, at t_k.
#[derive(Debug, Clone, PartialEq)]
pub enum Unit {
    Plant(Box<Rig>),
    Inverse(Box<InverseBlock>),
    Controller(Box<Control>),
    Loop(Box<SteppedLoop>),
}

/// Refuses a scenario of which an FMU would show something else than its run.
///
/// # Errors
/// What an FMU cannot have, and what to do.
pub fn refuse_unsteppable(scenario: &Scenario) -> Result<(), Refusal> {
    let refused = |what: &str, instead: &str| Err(Refusal::new(format!("an FMU has no {what}: {instead}")));
    if scenario.clock.realtime().is_some() {
        return refused(
            "clock of its own",
            "time is whoever's that simulates; give --set clock='Lockstep(receive_limit_s: 2.0)'",
        );
    }
    if !scenario.faults.is_empty() {
        return refused(
            "injected faults",
            "they are of links and processes; give --set faults='[]'",
        );
    }
    if !scenario.external_nodes().is_empty() {
        return refused(
            "processes of other programs",
            "give --set external='[]', and connect them around it",
        );
    }
    Ok(())
}

impl Unit {
    /// At the start: what is known there stands in `tokens`.
    pub fn begin(kind: Kind, scenario: &Scenario, tokens: &mut Tokens) -> Result<Self, Invalid> {
        let unit = match kind {
            Kind::Plant => {
                let mut rig = Rig::new(scenario)?;
                rig.measure(0);
                Self::Plant(Box::new(rig))
            }
            Kind::Inverse => Self::Inverse(Box::new(scenario.inverse_block()?)),
            Kind::Controller => Self::Controller(Box::new(Control::new(scenario)?)),
            Kind::Loop => {
                let mut all = SteppedLoop::new(scenario)?;
                all.step(0);
                Self::Loop(Box::new(all))
            }
        };
        unit.tell(tokens);
        Ok(unit)
    }

    /// From t_k to t_k+1, `tick` being k.
    pub fn advance(&mut self, tick: u64, tokens: &mut Tokens) {
        match self {
            Self::Plant(rig) => {
                rig.act(tick, tokens.get(tick));
                rig.measure(tick + 1);
            }
            Self::Inverse(block) => {
                let safe = Previous(tokens.get(tick.saturating_sub(1)));
                let command = block.step(tick, Now(tokens.get(tick)), Now(tokens.get(tick)), safe);
                tokens.put(&command);
            }
            Self::Controller(control) => control.step(tick, tokens.get(tick)),
            Self::Loop(all) => all.step(tick + 1),
        }
        self.tell(tokens);
    }

    /// The first tick that has not been decided yet at t_k: a change comes in there.
    pub fn undecided(&self, tick: u64) -> u64 {
        match self {
            Self::Loop(_) => tick + 1,
            _ => tick,
        }
    }

    /// Takes a change of a setting; false if nobody here has it, or there is no room for more.
    pub fn change(&mut self, change: &Change) -> bool {
        match self {
            Self::Controller(control) => control.change(change),
            Self::Loop(all) => all.control.change(change),
            _ => false,
        }
    }

    fn tell(&self, tokens: &mut Tokens) {
        let (rig, control) = match self {
            Self::Plant(rig) => (Some(&**rig), None),
            Self::Inverse(_) => (None, None),
            Self::Controller(control) => (None, Some(&**control)),
            Self::Loop(all) => (Some(&all.rig), Some(&all.control)),
        };
        if let Some(rig) = rig {
            tokens.put(&rig.measurement);
            tokens.put(&rig.truth);
            tokens.put(&rig.coil_field);
        }
        if let Some(control) = control {
            tokens.put(&control.estimate);
            tokens.put(&control.demand);
            tokens.put(&control.field_command);
            tokens.put(&control.safe_field);
        }
    }
}
