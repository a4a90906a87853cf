//! Magnitudes that no actuator has betray a wrong unit: 40 as a displacement in metres is 40 µm without its scale.
//!
//! Each quantity has a likely span, and some have a limit of physics, which ends the span above. Outside the span a run is
//! refused with the unit that would bring it nearest to what is usual, or with the other column that it is swapped with. Who
//! writes the scale means it: `displacement=x*1` silences the suspicion, not the limits of physics.

use crate::columns::{Column, option};
use crate::error::MeasuredError;
use crate::quantity::{CELSIUS_ZERO_K, OERSTED_A_PER_M, Quantity};
use crate::run::{INPUTS, Selection, Series, median_step_s};

/// What of a series is compared.
#[derive(Clone, Copy, PartialEq)]
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

/// A unit that is often left out: symbol, factor, offset.
type Guess = (&'static str, f64, f64);

/// What is likely, in SI units.
struct Likely {
    quantity: Quantity,
    size: Size,
    /// Least, most, and what is usual.
    span: [f64; 3],
    /// Why less is unlikely, and why more is.
    reasons: [&'static str; 2],
    guesses: &'static [Guess],
    /// Why the most is never exceeded, where it is not.
    physical: Option<&'static str>,
}

impl Likely {
    const fn of(quantity: Quantity, size: Size, span: [f64; 3], reasons: [&'static str; 2]) -> Self {
        Likely {
            quantity,
            size,
            span,
            reasons,
            guesses: &[],
            physical: None,
        }
    }

    const fn or(self, guesses: &'static [Guess]) -> Self {
        Likely { guesses, ..self }
    }

    /// The most is a limit of physics, for the reason why more is unlikely unless another is given.
    const fn never(self, reason: &'static str) -> Self {
        Likely {
            physical: Some(reason),
            ..self
        }
    }
}

const fn field(quantity: Quantity) -> Likely {
    let reasons = [
        "so weak a field moves no magnetostrictive actuator",
        "that is 12.6 T in vacuum, beyond any coil for such a run",
    ];
    Likely::of(quantity, Size::Peak, [50.0, 1e7, 2e4], reasons).or(&[
        ("kA/m", 1e3, 0.0),
        ("Oe", OERSTED_A_PER_M, 0.0),
        ("mA/m", 1e-3, 0.0),
    ])
}

/// How a refusal of too much words its limit.
const TOO_MUCH: &str = "at most";
const STRAINS: &str = "the largest magnetostriction known is 0.0025, and brittle rods break at 0.01";
const STRONGEST_M: &str = "iron-cobalt, the strongest material, saturates at 1.95e6 A/m";
const STRONGEST_B: &str = "iron-cobalt, the strongest material, saturates at 2.45 T";
const MORE: &str = "a material for actuators has far more";

const LIKELY: [Likely; 11] = [
    Likely::of(
        Quantity::Time,
        Size::Tick,
        [1e-8, 0.049, 1e-4],
        [
            "no such actuator is sampled so fast",
            "so slow a clock sees no dynamics",
        ],
    )
    .or(&[("ms", 1e-3, 0.0), ("µs", 1e-6, 0.0)]),
    field(Quantity::FieldCommand),
    field(Quantity::Field).never("that is 12.6 T in vacuum, beyond any coil for such a loop"),
    Likely::of(
        Quantity::Current,
        Size::Peak,
        [1e-6, 1e3, 3.0],
        ["no coil answers to so little", "no such coil carries so much"],
    )
    .or(&[("mA", 1e-3, 0.0), ("kA", 1e3, 0.0)]),
    Likely::of(
        Quantity::Voltage,
        Size::Peak,
        [1e-5, 5e3, 100.0],
        ["no amplifier answers to so little", "no such amplifier reaches so much"],
    )
    .or(&[("mV", 1e-3, 0.0), ("kV", 1e3, 0.0)]),
    Likely::of(
        Quantity::Displacement,
        Size::Swing,
        [1e-10, 5e-3, 2e-5],
        [
            "no displacement sensor sees so little",
            "a solid-state actuator moves a small share of its length",
        ],
    )
    .or(&[("mm", 1e-3, 0.0), ("µm", 1e-6, 0.0), ("nm", 1e-9, 0.0)]),
    Likely::of(
        Quantity::Strain,
        Size::Peak,
        [1e-9, 0.02, 5e-4],
        ["no strain gauge sees so little", STRAINS],
    )
    .or(&[("ppm", 1e-6, 0.0), ("%", 1e-2, 0.0)])
    .never(STRAINS),
    // Before the magnetization, which is made from it.
    Likely::of(Quantity::FluxDensity, Size::Peak, [1e-5, 3.0, 0.8], [MORE, STRONGEST_B])
        .or(&[("mT", 1e-3, 0.0), ("G", 1e-4, 0.0)])
        .never(STRONGEST_B),
    Likely::of(
        Quantity::Magnetization,
        Size::Peak,
        [1e3, 2.5e6, 5e5],
        [MORE, STRONGEST_M],
    )
    .or(&[("kA/m", 1e3, 0.0), ("MA/m", 1e6, 0.0), ("mA/m", 1e-3, 0.0)])
    .never(STRONGEST_M),
    Likely::of(
        Quantity::Temperature,
        Size::Least,
        [150.0, 1500.0, 300.0],
        [
            "that is colder than -123 °C",
            "that is hotter than any magnet's Curie point",
        ],
    )
    .or(&[("°C", 1.0, CELSIUS_ZERO_K), ("mK", 1e-3, 0.0)]),
    Likely::of(
        Quantity::Force,
        Size::Peak,
        [0.0, 1e7, 1e3],
        ["", "no machine tool stands so much"],
    )
    .or(&[("mN", 1e-3, 0.0), ("µN", 1e-6, 0.0)]),
];

/// Refuses a series whose magnitude is that of another unit, and a scale that the column's own name contradicts.
pub(crate) fn check(
    selection: &Selection,
    series: &[Option<Vec<f64>>],
    time_s: Option<&[f64]>,
) -> Result<(), MeasuredError> {
    let moves = [Quantity::Displacement, Quantity::Strain]
        .iter()
        .any(|quantity| series[quantity.index()].is_some());
    let mut unlikely = Vec::new();
    for likely in &LIKELY {
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
        let least = if weak_is_fine { 0.0 } else { likely.span[0] };
        let (at, size) = likely.size_of(values);
        let fits = |size: f64| size >= least && size <= likely.span[1];
        let named = as_named(column, size);
        if let Some(contradiction) = column.contradiction(&selection.sheet.file)
            && (!fits(size) || fits(named) && likely.distance(named) < likely.distance(size))
        {
            return Err(contradiction);
        }
        if !fits(size) && !column.scale_given && size != 0.0 {
            unlikely.push(Unlikely {
                likely,
                column,
                values,
                at,
                size,
                least,
            });
        }
    }
    if let Some(first) = unlikely.first() {
        return Err(first.suspicion(selection, first.swapped_with(&unlikely[1..])));
    }
    limits(selection, series)
}

/// What [`check`] refuses as too much for an actuator, as a sentence: a law may be of a damper, or of a wire that remembers its shape.
pub(crate) fn doubt(selection: &Selection, series: &Series) -> Result<Option<String>, MeasuredError> {
    let mut driven = series.clone();
    if INPUTS.iter().all(|quantity| series[quantity.index()].is_none()) {
        driven[Quantity::Displacement.index()] = None;
    }
    if !is_magnetic(series) {
        driven[Quantity::Strain.index()] = None;
    }
    match check(selection, &driven, None) {
        Err(refused @ MeasuredError::Unlikely { bound, .. }) => {
            limits(selection, series)?;
            Ok((bound == TOO_MUCH).then(|| refused.to_string()))
        }
        other => other.map(|()| None),
    }
}

/// A field drives it.
fn is_magnetic(series: &[Option<Vec<f64>>]) -> bool {
    [Quantity::Field, Quantity::FieldCommand]
        .iter()
        .any(|quantity| series[quantity.index()].is_some())
}

/// Refuses values beyond what any material or coil reaches: their unit is then another one.
pub(crate) fn limits(selection: &Selection, series: &[Option<Vec<f64>>]) -> Result<(), MeasuredError> {
    for likely in &LIKELY {
        let (quantity, [_, limit, _]) = (likely.quantity, likely.span);
        // Heat strains a wire that remembers its shape by 0.08.
        if quantity == Quantity::Strain && !is_magnetic(series) {
            continue;
        }
        let (Some(reason), Some(values)) = (likely.physical, &series[quantity.index()]) else {
            continue;
        };
        let beyond = values.iter().position(|value| value.abs() > limit);
        if let (Some(at), Some(column)) = (beyond, selection.column(quantity)) {
            return Err(MeasuredError::UnitSuspected {
                place: selection.sheet.place(selection.rows[at], column),
                quantity: quantity.name(),
                quantity_key: quantity.key(),
                value: values[at],
                limit,
                unit: quantity.unit(),
                reason,
            });
        }
    }
    Ok(())
}

/// How far a series lies from what is usual for its quantity, as a logarithm; 0 where nothing is.
pub(crate) fn oddity(quantity: Quantity, values: &[f64]) -> f64 {
    let likely = LIKELY.iter().find(|likely| likely.quantity == quantity);
    likely.map_or(0.0, |likely| likely.distance(likely.size_of(values).1))
}

/// What takes values that lie outside what is likely of their quantity into it: the unit that they look like, factor and offset to SI.
pub(crate) fn looks_like(quantity: Quantity, values: &[f64]) -> Option<(&'static str, f64, f64)> {
    let likely = LIKELY.iter().find(|likely| likely.quantity == quantity)?;
    let size = likely.size_of(values).1;
    let [least, most, _] = likely.span;
    // A weak field is another material's, not another unit.
    let weak = size < least && matches!(quantity, Quantity::Field | Quantity::FieldCommand);
    if (least..=most).contains(&size) || size == 0.0 || weak {
        return None;
    }
    likely.nearest(size, least).copied()
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

    /// The unit under which a size is likely and nearest to what is usual.
    fn nearest(&self, size: f64, least: f64) -> Option<&'static Guess> {
        let under = |guess: &Guess| size * guess.1 + guess.2;
        let fits = |guess: &&Guess| (least..=self.span[1]).contains(&under(guess));
        let near = self.guesses.iter().filter(fits);
        near.min_by(|one, other| self.distance(under(one)).total_cmp(&self.distance(under(other))))
    }

    /// How far a size lies from what is usual, as the logarithm of their ratio.
    fn distance(&self, size: f64) -> f64 {
        (size / self.span[2]).ln().abs()
    }
}

/// A series outside its likely span.
struct Unlikely<'a> {
    likely: &'a Likely,
    column: &'a Column,
    values: &'a [f64],
    at: usize,
    size: f64,
    least: f64,
}

impl Unlikely<'_> {
    /// This quantity's size if the other column held it.
    fn fits_in(&self, other: &Unlikely) -> bool {
        let scale = self.column.scale / other.column.scale;
        let values: Vec<f64> = other.values.iter().map(|value| value * scale).collect();
        let (_, size) = self.likely.size_of(&values);
        size >= self.least && size <= self.likely.span[1]
    }

    /// The other unlikely column with which both become likely.
    fn swapped_with<'a>(&self, others: &'a [Self]) -> Option<&'a Self> {
        let timed = |own: &Self| own.likely.size == Size::Tick;
        let fits = |other: &&Self| !timed(self) && !timed(other) && self.fits_in(other) && other.fits_in(self);
        others.iter().find(fits)
    }

    fn suspicion(&self, selection: &Selection, swapped: Option<&Self>) -> MeasuredError {
        let (likely, column, size) = (self.likely, self.column, self.size);
        let (quantity, low) = (likely.quantity, size < self.least);
        let what = match likely.size {
            Size::Peak => format!("the {} reaches", quantity.name()),
            Size::Swing => format!("the {} spans", quantity.name()),
            Size::Least => format!("the {} goes down to", quantity.name()),
            Size::Tick => "the time between samples is".to_owned(),
        };
        let as_read = option(quantity, &column.header, column.scale, 0.0);
        let remedy = match swapped {
            Some(other) => format!(
                "It looks swapped with column \"{}\": map them with {} and {}",
                other.column.header,
                option(quantity, &other.column.header, column.scale, 0.0),
                option(other.likely.quantity, &column.header, other.column.scale, 0.0),
            ),
            None => self.other_unit(),
        };
        MeasuredError::Unlikely {
            place: selection.sheet.place(selection.rows[self.at], column),
            what,
            size,
            unit: quantity.unit(),
            bound: if low { "at least" } else { TOO_MUCH },
            limit: if low { self.least } else { likely.span[1] },
            reason: likely.reasons[usize::from(!low)],
            remedy: format!("{remedy}, or, if it is right, say so with {as_read}"),
        }
    }

    fn other_unit(&self) -> String {
        let (likely, column) = (self.likely, self.column);
        match likely.nearest(self.size, self.least) {
            Some((unit, factor, offset)) => format!(
                "It looks like {unit}: map it with {}",
                option(likely.quantity, &column.header, column.scale * factor, *offset)
            ),
            None => format!("Map it with {}={}*SCALE", likely.quantity.key(), column.header),
        }
    }
}
