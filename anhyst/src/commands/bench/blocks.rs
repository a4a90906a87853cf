//! Each block of a scenario's loop alone, fed with what it hears in a run.

use super::measure::Timed;
use super::models::{INVERSE, STEP, bank_of};
use anhyst_ipc::{Block, CoilField, Demand, Estimate, FieldCommand, Measurement, Message, Now, Previous, SafeField};
use anhyst_launch::error::RunError;
use anhyst_scenario::Scenario;
use std::hint::black_box;
use std::rc::Rc;

/// What is heard in a tick, and in the one before.
#[derive(Clone, Copy, Default)]
struct Heard {
    measurement: Measurement,
    estimate: Estimate,
    demand: Demand,
    command: FieldCommand,
    safe: SafeField,
    coil: CoilField,
}

/// Names of the blocks' rows, in loop order.
pub const BLOCKS: [&str; 6] = ["plant", "estimator", "controller", "inverse", "guard", "amplifier"];

/// All six.
///
/// # Errors
/// A setting that cannot be used.
pub fn timed(scenario: &Scenario, ticks: usize) -> Result<Vec<Timed<'static>>, RunError> {
    let all: Rc<[Heard]> = heard(scenario, ticks)?.into();
    let members = scenario.estimator.law.members();
    let [plant, estimator, controller, inverse, guard, amplifier] = BLOCKS;
    let mut inverting = scenario.inverse_block()?;
    let to_inverse = all.clone();
    Ok(vec![
        block(plant, &all, scenario.plant_block()?, |[before, _]| {
            (Previous(before.coil),)
        })
        .at_least("a step", [(1.0, STEP)]),
        block(estimator, &all, scenario.estimator_block()?, |[before, now]| {
            (Now(now.measurement), Previous(before.safe))
        })
        .at_least("its bank", [(members as f64, bank_of(members))]),
        block(controller, &all, scenario.controller()?, |[before, now]| {
            (Now(now.measurement), Previous(before.safe), Previous(before.command))
        }),
        Timed::new(inverse, "tick", ticks, move || {
            for (tick, [before, now]) in ways(&to_inverse) {
                black_box(inverting.step(tick, Now(now.demand), Now(now.estimate), Previous(before.safe)));
            }
        })
        .at_least("a step and an inverse step", [(1.0, STEP), (1.0, INVERSE)]),
        block(guard, &all, scenario.guard_block()?, |[_, now]| {
            (
                Now(now.command),
                Now(now.measurement),
                Now(now.demand),
                Now(now.estimate),
            )
        }),
        block(
            amplifier,
            &all,
            scenario.amplifier_block()?,
            |[_, now]| (Now(now.safe),),
        ),
    ])
}

/// Ticks, each with what was said in the one before and what is in this.
fn ways(heard: &[Heard]) -> impl Iterator<Item = (u64, &[Heard; 2])> {
    (0..).zip(heard.array_windows())
}

/// Goes on from turn to turn, as it would in a longer run of the same.
fn block<B: Block + 'static>(
    name: &str,
    heard: &Rc<[Heard]>,
    mut block: B,
    inputs: fn(&[Heard; 2]) -> B::Inputs,
) -> Timed<'static> {
    let heard = heard.clone();
    Timed::new(name, "tick", heard.len() - 1, move || {
        for (tick, own) in ways(&heard) {
            black_box(block.step(tick, inputs(black_box(own))));
        }
    })
}

fn stamped<M: Message>(mut token: M, tick: u64) -> M {
    token.stamp(tick, 0);
    token
}

/// A run's tokens; the first place is for before the run.
fn heard(scenario: &Scenario, ticks: usize) -> Result<Vec<Heard>, RunError> {
    let mut plant = scenario.plant_block()?;
    let mut estimator = scenario.estimator_block()?;
    let mut controller = scenario.controller()?;
    let mut inverse = scenario.inverse_block()?;
    let mut guard = scenario.guard_block()?;
    let mut amplifier = scenario.amplifier_block()?;
    let mut heard = vec![Heard::default()];
    for tick in 0..ticks as u64 {
        let before = heard[heard.len() - 1];
        let (measurement, _) = plant.step(tick, (Previous(before.coil),));
        let measurement = stamped(measurement, tick);
        let (estimate,) = Block::step(&mut estimator, tick, (Now(measurement), Previous(before.safe)));
        let estimate = stamped(estimate, tick);
        let told = (Now(measurement), Previous(before.safe), Previous(before.command));
        let (demand,) = controller.step(tick, told);
        let demand = stamped(demand, tick);
        let command = inverse.step(tick, Now(demand), Now(estimate), Previous(before.safe));
        let command = stamped(command, tick);
        let (safe,) = guard.step(tick, (Now(command), Now(measurement), Now(demand), Now(estimate)));
        let safe = stamped(safe, tick);
        let (coil,) = amplifier.step(tick, (Now(safe),));
        heard.push(Heard {
            measurement,
            estimate,
            demand,
            command,
            safe,
            coil: stamped(coil, tick),
        });
    }
    Ok(heard)
}
