//! One tick of the whole loop, and the blocks in which ticks travel to the logger.

use anhyst_ipc::{Channel, CoilField, Demand, Estimate, Everything, FieldCommand, Measurement, SafeField, Truth};
use std::mem::offset_of;

const WORD: usize = size_of::<u64>();

/// The seven tokens of one tick.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[repr(C)]
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
    /// Words of a row.
    pub const WORDS: usize = size_of::<Self>() / WORD;

    /// Rows as they lie in memory.
    pub fn words(rows: &[Self]) -> &[[u64; Self::WORDS]] {
        // SAFETY: a row and its tokens are laid out as in C, of fields of eight bytes, so that there is nothing between them.
        unsafe { std::slice::from_raw_parts(rows.as_ptr().cast(), rows.len()) }
    }

    /// The word at which the fields of a channel's token begin, behind its tick and its time of sending.
    pub const fn place(channel: Channel) -> usize {
        let token = match channel {
            Channel::Measurement => offset_of!(Self, measurement),
            Channel::Truth => offset_of!(Self, truth),
            Channel::Estimate => offset_of!(Self, estimate),
            Channel::Demand => offset_of!(Self, demand),
            Channel::FieldCommand => offset_of!(Self, field_command),
            Channel::SafeField => offset_of!(Self, safe_field),
            Channel::CoilField => offset_of!(Self, coil_field),
        };
        token / WORD + 2
    }

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
#[derive(Debug)]
pub(crate) struct Block {
    /// With room for those that are to come.
    rows: Vec<Row>,
    filled: usize,
    /// Rows that were dropped just before this block.
    pub dropped_before: u64,
}

impl Block {
    /// One with room for so many rows, whose pages exist.
    pub fn new(rows: usize) -> Self {
        let row = Row {
            tick: 1,
            ..Row::default()
        };
        Self {
            rows: vec![row; rows],
            filled: 0,
            dropped_before: 0,
        }
    }

    /// Empties it; of what it has room for only so many rows are to come.
    pub fn reuse(&mut self, rows: usize, dropped_before: u64) {
        self.rows.truncate(rows);
        self.filled = 0;
        self.dropped_before = dropped_before;
    }

    /// Appends the tokens of a tick, each straight to its place; true if there is room for more.
    #[inline(always)]
    pub fn push(&mut self, tick: u64, tokens: &Everything) -> bool {
        if let Some(row) = self.rows.get_mut(self.filled) {
            row.tick = tick;
            row.measurement = tokens.0.0;
            row.truth = tokens.1.0;
            row.estimate = tokens.2.0;
            row.demand = tokens.3.0;
            row.field_command = tokens.4.0;
            row.safe_field = tokens.5.0;
            row.coil_field = tokens.6.0;
            self.filled += 1;
        }
        self.filled < self.rows.len()
    }

    /// The rows in it.
    pub fn rows(&self) -> &[Row] {
        &self.rows[..self.filled]
    }
}
