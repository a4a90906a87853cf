//! What no material and no coil reaches: a value beyond it is in another unit.

use crate::error::{MeasuredError, Place};
use crate::quantity::Quantity;

/// Quantity, largest believable magnitude, unit, reason.
const LIMITS: &[(Quantity, f64, &str, &str)] = &[
    (
        Quantity::Field,
        1e7,
        "A/m",
        "that is 12.6 T in vacuum, beyond any coil for such a loop",
    ),
    (
        Quantity::FluxDensity,
        3.0,
        "T",
        "iron-cobalt, the strongest material, saturates at 2.45 T",
    ),
    (
        Quantity::Magnetization,
        2.5e6,
        "A/m",
        "iron-cobalt, the strongest material, saturates at 1.95e6 A/m",
    ),
    (
        Quantity::Strain,
        0.02,
        "(m/m)",
        "the largest magnetostriction known is 0.0025, and brittle rods break at 0.01",
    ),
];

/// Refuses a value beyond what any material or coil reaches: its unit is then another one.
pub(crate) fn refuse_beyond(
    quantity: Quantity,
    value: f64,
    place: impl FnOnce() -> Box<Place>,
) -> Result<(), MeasuredError> {
    let Some((.., limit, unit, reason)) = LIMITS.iter().find(|(of, ..)| *of == quantity) else {
        return Ok(());
    };
    if value.abs() <= *limit {
        return Ok(());
    }
    let (quantity_key, quantity) = (quantity.key(), quantity.name());
    Err(MeasuredError::UnitSuspected {
        place: place(),
        quantity,
        quantity_key,
        value,
        limit: *limit,
        unit,
        reason,
    })
}
