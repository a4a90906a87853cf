//! What the recorder hears.

use crate::block::Now;
use crate::messages::{CoilField, Demand, Estimate, FieldCommand, Measurement, SafeField, Truth};

/// Every token of a tick.
pub type Everything = (
    Now<Measurement>,
    Now<Truth>,
    Now<Estimate>,
    Now<Demand>,
    Now<FieldCommand>,
    Now<SafeField>,
    Now<CoilField>,
);
