//! Magnitudes that no actuator has betray a wrong unit: 40 as a displacement in metres is 40 µm without its scale.
//!
//! Each quantity has a likely span. Outside it the run is refused with the unit that would bring it nearest to what is
//! usual. Who writes the scale means it: `displacement=x*1` silences the suspicion, not the limits of physics in
//! [`crate::limits`].

use super::selection::Selection;
use super::time::median_step_s;
use crate::columns::Column;
use crate::error::MeasuredError;
use crate::limits;
use crate::quantity::{CELSIUS_ZERO_K, Quantity};

/// What of a series is compared.
#[derive(Clone, Copy)]
enum Size {
    /// Largest magnitude.
    Peak,
    /// Largest less smallest value: the zero of a sensor is arbitrary.
    Swing,
    /// Smallest value.
    Least,
    /// Median interval.
    Tick,
}

/// What is likely, in SI units.
struct Likely {
    quantity: Quantity,
    size: Size,
    least: f64,
    most: f64,
    usual: f64,
    /// Why less is unlikely, and why more is.
    reasons: [&'static str; 2],
    /// Units that are often left out: symbol, factor, offset.
    guesses: &'static [(&'static str, f64, f64)],
}

const FIELD_GUESSES: &[(&str, f64, f64)] = &[("kA/m", 1e3, 0.0), ("Oe", 79.577, 0.0), ("mA/m", 1e-3, 0.0)];
const FIELD_REASONS: [&str; 2] = [
    "so weak a field moves no magnetostrictive actuator",
    "that is 12.6 T in vacuum, beyond any coil for such a run",
];

const LIKELY: &[Likely] = &[
    Likely {
        quantity: Quantity::Time,
        size: Size::Tick,
        least: 1e-8,
        most: 0.049,
        usual: 1e-4,
        reasons: [
            "no such actuator is sampled so fast",
            "so slow a clock sees no dynamics",
        ],
        guesses: &[("ms", 1e-3, 0.0), ("µs", 1e-6, 0.0)],
    },
    Likely {
        quantity: Quantity::FieldCommand,
        size: Size::Peak,
        least: 50.0,
        most: 1e7,
        usual: 2e4,
        reasons: FIELD_REASONS,
        guesses: FIELD_GUESSES,
    },
    Likely {
        quantity: Quantity::Field,
        size: Size::Peak,
        least: 50.0,
        most: 1e7,
        usual: 2e4,
        reasons: FIELD_REASONS,
        guesses: FIELD_GUESSES,
    },
    Likely {
        quantity: Quantity::Current,
        size: Size::Peak,
        least: 1e-6,
        most: 1e3,
        usual: 3.0,
        reasons: ["no coil answers to so little", "no such coil carries so much"],
        guesses: &[("mA", 1e-3, 0.0), ("kA", 1e3, 0.0)],
    },
    Likely {
        quantity: Quantity::Voltage,
        size: Size::Peak,
        least: 1e-5,
        most: 5e3,
        usual: 100.0,
        reasons: ["no amplifier answers to so little", "no such amplifier reaches so much"],
        guesses: &[("mV", 1e-3, 0.0), ("kV", 1e3, 0.0)],
    },
    Likely {
        quantity: Quantity::Displacement,
        size: Size::Swing,
        least: 1e-10,
        most: 5e-3,
        usual: 2e-5,
        reasons: [
            "no displacement sensor sees so little",
            "a solid-state actuator moves a small share of its length",
        ],
        guesses: &[("mm", 1e-3, 0.0), ("µm", 1e-6, 0.0), ("nm", 1e-9, 0.0)],
    },
    Likely {
        quantity: Quantity::Strain,
        size: Size::Peak,
        least: 1e-9,
        most: 0.02,
        usual: 5e-4,
        reasons: [
            "no strain gauge sees so little",
            "the largest magnetostriction known is 0.0025, and brittle rods break at 0.01",
        ],
        guesses: &[("ppm", 1e-6, 0.0), ("%", 1e-2, 0.0)],
    },
    Likely {
        quantity: Quantity::Magnetization,
        size: Size::Peak,
        least: 1e3,
        most: 2.5e6,
        usual: 5e5,
        reasons: [
            "a material for actuators has far more",
            "iron-cobalt, the strongest material, saturates at 1.95e6 A/m",
        ],
        guesses: &[("kA/m", 1e3, 0.0), ("MA/m", 1e6, 0.0), ("mA/m", 1e-3, 0.0)],
    },
    Likely {
        quantity: Quantity::FluxDensity,
        size: Size::Peak,
        least: 1e-5,
        most: 3.0,
        usual: 0.8,
        reasons: [
            "a material for actuators has far more",
            "iron-cobalt, the strongest material, saturates at 2.45 T",
        ],
        guesses: &[("mT", 1e-3, 0.0), ("G", 1e-4, 0.0)],
    },
    Likely {
        quantity: Quantity::Temperature,
        size: Size::Least,
        least: 150.0,
        most: 1500.0,
        usual: 300.0,
        reasons: [
            "that is colder than -123 °C",
            "that is hotter than any magnet's Curie point",
        ],
        guesses: &[("°C", 1.0, CELSIUS_ZERO_K), ("mK", 1e-3, 0.0)],
    },
    Likely {
        quantity: Quantity::Force,
        size: Size::Peak,
        least: 0.0,
        most: 1e7,
        usual: 1e3,
        reasons: ["", "no machine tool stands so much"],
        guesses: &[("mN", 1e-3, 0.0), ("µN", 1e-6, 0.0)],
    },
];

/// Refuses a series whose magnitude is that of another unit, and a scale that the column's own name contradicts.
pub(super) fn check(
    selection: &Selection,
    series: &[Option<Vec<f64>>],
    time_s: Option<&[f64]>,
) -> Result<(), MeasuredError> {
    let moves = [Quantity::Displacement, Quantity::Strain]
        .iter()
        .any(|quantity| series[quantity.index()].is_some());
    for likely in LIKELY {
        let quantity = likely.quantity;
        let values = if quantity == Quantity::Time {
            time_s
        } else {
            series[quantity.index()].as_deref()
        };
        let (Some(values), Some(column)) = (values, selection.columns.of(quantity)) else {
            continue;
        };
        // A weak field is nothing odd where only magnetization is measured: soft ferrites saturate at 80 A/m.
        let weak_is_fine = !moves && matches!(quantity, Quantity::Field | Quantity::FieldCommand);
        let least = if weak_is_fine { 0.0 } else { likely.least };
        let (at, size) = likely.size_of(values);
        let fits = |size: f64| size >= least && size <= likely.most;
        if let Some(contradiction) = column.contradiction(&selection.sheet.file)
            && (!fits(size) || fits(as_named(column, size)))
        {
            return Err(contradiction);
        }
        if !fits(size) && !column.scale_given && size != 0.0 {
            return Err(likely.suspicion(selection, column, at, size, least));
        }
        for (&row, &value) in selection.rows.iter().zip(values) {
            limits::refuse_beyond(quantity, value, || selection.sheet.place(row, column))?;
        }
    }
    Ok(())
}

/// The size under the scale that the column's name asks for instead of the one given.
fn as_named(column: &Column, size: f64) -> f64 {
    column
        .named
        .map_or(size, |unit| size / column.scale.abs() * unit.factor)
}

impl Likely {
    /// Index of the sample that decides, and the size.
    fn size_of(&self, values: &[f64]) -> (usize, f64) {
        let extreme = |key: fn(f64) -> f64| {
            let keys = values.iter().map(|value| key(*value)).enumerate();
            keys.max_by(|one, other| one.1.total_cmp(&other.1)).unwrap_or((0, 0.0))
        };
        let (peak, magnitude) = extreme(f64::abs);
        match self.size {
            Size::Peak => (peak, magnitude),
            Size::Swing => (peak, extreme(|value| value).1 + extreme(|value| -value).1),
            Size::Least => {
                let (index, negative) = extreme(|value| -value);
                (index, -negative)
            }
            Size::Tick => (1, median_step_s(values)),
        }
    }

    fn suspicion(&self, selection: &Selection, column: &Column, at: usize, size: f64, least: f64) -> MeasuredError {
        let (key, header, low) = (self.quantity.key(), &column.header, size < least);
        let what = match self.size {
            Size::Peak => format!("the {} reaches", self.quantity.name()),
            Size::Swing => format!("the {} spans", self.quantity.name()),
            Size::Least => format!("the {} goes down to", self.quantity.name()),
            Size::Tick => "the time between samples is".to_owned(),
        };
        let distance = |factor: f64, offset: f64| ((size * factor + offset) / self.usual).ln().abs();
        let fits = |factor: f64, offset: f64| (least..=self.most).contains(&(size * factor + offset));
        let near = self.guesses.iter().filter(|(_, factor, offset)| fits(*factor, *offset));
        let guess = near.min_by(|one, other| distance(one.1, one.2).total_cmp(&distance(other.1, other.2)));
        let remedy = match guess {
            Some((unit, factor, offset)) => {
                let total = column.scale * factor;
                let offset = if *offset == 0.0 {
                    String::new()
                } else {
                    format!("{offset:+}")
                };
                format!(
                    "It looks like {unit}: map it with {key}={header}*{}{offset}",
                    written(total)
                )
            }
            None => format!("Map it with {key}={header}*SCALE"),
        };
        MeasuredError::Unlikely {
            place: selection.sheet.place(selection.rows[at], column),
            what,
            size,
            unit: self.quantity.unit(),
            bound: if low { "at least" } else { "at most" },
            limit: if low { least } else { self.most },
            reason: self.reasons[usize::from(!low)],
            remedy: format!(
                "{remedy}, or, if it is right, say so with {key}={header}*{}",
                written(column.scale)
            ),
        }
    }
}

/// A scale as a user would write it.
fn written(scale: f64) -> String {
    if (1e-3..1e6).contains(&scale.abs()) {
        scale.to_string()
    } else {
        format!("{scale:e}")
    }
}
