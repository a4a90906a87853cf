//! One tick of the whole loop, and the blocks in which ticks travel to the logger.

use anhyst_ipc::{CoilField, Demand, Estimate, FieldCommand, Measurement, SafeField, Truth};

/// The seven tokens of one tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct Row {
    pub tick: u64,
    pub measurement: Measurement,
    pub truth: Truth,
    pub estimate: Estimate,
    pub demand: Demand,
    pub field_command: FieldCommand,
    pub safe_field: SafeField,
    pub coil_field: CoilField,
}

impl Row {
    /// Reference minus true displacement.
    pub fn true_error_m(&self) -> f64 {
        self.demand.reference_m - self.truth.displacement_m
    }

    /// The error that the run is judged by: the true one where it is known.
    pub fn judged_error_m(&self, has: Presence) -> f64 {
        if has.truth {
            self.true_error_m()
        } else {
            self.demand.error_m
        }
    }
}

/// What a recording has besides the loop's own tokens. A real rig has no truth, not every rig a thermometer, not every law
/// a standard deviation or anything to be informed about: their tokens are zero throughout, and drawing those zeros would be a lie.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Presence {
    pub truth: bool,
    pub thermometer: bool,
    pub deviation: bool,
    pub information: bool,
    /// There is a parameter `a`.
    pub shape: bool,
    /// Other parameters than `a` are estimated.
    pub parameters: bool,
    pub force: bool,
}

impl Presence {
    /// What the rows hold.
    pub fn of(rows: &[Row]) -> Self {
        let any = |test: fn(&Row) -> bool| rows.iter().any(test);
        Self {
            truth: any(|row| row.truth.shape_a_per_m != 0.0 || row.truth.displacement_m != 0.0),
            thermometer: any(|row| row.measurement.temperature_k != 0.0),
            deviation: any(|row| row.estimate.standard_deviation_a_per_m != 0.0),
            information: any(|row| row.estimate.information_per_a2_per_m2 != 0.0),
            // Another law tells its weights in turn.
            shape: !any(|row| row.estimate.weight != 0.0),
            parameters: any(|row| row.estimate.saturation_magnetization_a_per_m != 0.0),
            force: any(|row| row.truth.cutting_force_n != 0.0),
        }
    }
}

/// A stretch of ticks on its way to the logger.
#[derive(Debug, Default)]
pub(crate) struct Block {
    pub rows: Vec<Row>,
    /// Rows that were dropped just before this block.
    pub dropped_before: u64,
}
