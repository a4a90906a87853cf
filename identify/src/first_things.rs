//! A measured run held against its nominal model before any physics is blamed: `anhyst_measured::check` with a model.

use anhyst_measured::check::{self, Finding};
use anhyst_measured::{MeasuredRun, Quantity};
use anhyst_model::{ActuatorModel, ActuatorOutputs};

use crate::prepared::{PrepareOptions, PreparedRun, simulated};

/// Signs, units, places, times and dead channels of a run's columns that cannot be as they are read; nothing for a sound run.
pub fn first_things(run: &MeasuredRun, model: &ActuatorModel) -> Vec<Finding> {
    let simulate = |run: &MeasuredRun| {
        let prepared = PreparedRun::of(run, &PrepareOptions::default()).ok()?;
        let mut outputs = ActuatorOutputs::default();
        prepared.simulate(model, &mut outputs).ok()?;
        let channels = prepared.channels.iter().filter(|own| own.quantity != Quantity::Field);
        let series = channels.filter_map(|own| {
            let series = simulated(model, &outputs, own.quantity)?;
            let finite = series.iter().all(|value| value.is_finite());
            finite.then(|| (own.quantity, series.to_vec()))
        });
        Some(series.collect())
    };
    check::first_things(run, &simulate)
}
