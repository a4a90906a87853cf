//! The quantities that measured tables hold: one table for loops and runs, with names, SI units and known headers.
//!
//! A header is known as STEM_UNIT without regard to case (`H_kA_per_m`, `displacement_um`, `Field [A/m]`); the unit
//! gives the factor to SI, and for degrees Celsius the offset to kelvin. Strain has no unit (1e-6 is 1 ppm).

use serde::{Deserialize, Serialize};

/// What a column can hold, in SI units once read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Quantity {
    LoopId,
    Time,
    FieldCommand,
    Field,
    Current,
    Voltage,
    Displacement,
    Strain,
    Magnetization,
    FluxDensity,
    Temperature,
    Force,
    /// What drives a law, whatever it is, in the unit of its column.
    Input,
    /// What a law gives, whatever it is, in the unit of its column.
    Output,
}

/// A unit as headers spell it (lower case), its factor to SI and the offset that is added after the factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Unit {
    pub spelling: &'static str,
    /// As messages write it.
    pub symbol: &'static str,
    pub factor: f64,
    pub offset: f64,
}

const fn unit(spelling: &'static str, symbol: &'static str, factor: f64) -> Unit {
    Unit {
        spelling,
        symbol,
        factor,
        offset: 0.0,
    }
}

/// 0 °C in kelvin.
pub(crate) const CELSIUS_ZERO_K: f64 = 273.15;

const fn celsius(spelling: &'static str) -> Unit {
    Unit {
        spelling,
        symbol: "°C",
        factor: 1.0,
        offset: CELSIUS_ZERO_K,
    }
}

/// 1 Oe in A/m.
pub(crate) const OERSTED_A_PER_M: f64 = 1000.0 / (4.0 * std::f64::consts::PI);

const TIMES: &[Unit] = &[unit("s", "s", 1.0), unit("ms", "ms", 1e-3), unit("us", "µs", 1e-6)];
const FIELDS: &[Unit] = &[
    unit("a_per_m", "A/m", 1.0),
    unit("ka_per_m", "kA/m", 1e3),
    unit("oe", "Oe", OERSTED_A_PER_M),
];
const CURRENTS: &[Unit] = &[unit("a", "A", 1.0), unit("ma", "mA", 1e-3)];
const VOLTAGES: &[Unit] = &[unit("v", "V", 1.0), unit("mv", "mV", 1e-3), unit("kv", "kV", 1e3)];
const LENGTHS: &[Unit] = &[
    unit("m", "m", 1.0),
    unit("mm", "mm", 1e-3),
    unit("um", "µm", 1e-6),
    unit("nm", "nm", 1e-9),
];
const STRAINS: &[Unit] = &[unit("ppm", "ppm", 1e-6), unit("um_per_m", "µm/m", 1e-6)];
const MAGNETIZATIONS: &[Unit] = &[unit("a_per_m", "A/m", 1.0), unit("ka_per_m", "kA/m", 1e3)];
const FLUX_DENSITIES: &[Unit] = &[unit("t", "T", 1.0), unit("mt", "mT", 1e-3)];
const TEMPERATURES: &[Unit] = &[unit("k", "K", 1.0), celsius("c"), celsius("degc")];
const FORCES: &[Unit] = &[unit("n", "N", 1.0), unit("kn", "kN", 1e3), unit("mn", "mN", 1e-3)];

/// How one quantity is called.
struct Entry {
    quantity: Quantity,
    /// The word used in a mapping; `header` and `others` are accepted too.
    key: &'static str,
    others: &'static [&'static str],
    name: &'static str,
    header: &'static str,
    unit: &'static str,
    stems: &'static [&'static str],
    units: &'static [Unit],
    /// Headers without a unit, and their factor.
    bare: &'static [(&'static str, f64)],
}

const ENTRIES: [Entry; 14] = [
    Entry {
        quantity: Quantity::LoopId,
        key: "loop",
        others: &[],
        name: "loop number",
        header: "loop_id",
        unit: "",
        stems: &[],
        units: &[],
        bare: &[("loop_id", 1.0), ("loop", 1.0)],
    },
    Entry {
        quantity: Quantity::Time,
        key: "time",
        others: &[],
        name: "time",
        header: "time_s",
        unit: "s",
        stems: &["time", "t"],
        units: TIMES,
        bare: &[],
    },
    Entry {
        quantity: Quantity::FieldCommand,
        key: "command",
        others: &["field_command"],
        name: "field command",
        header: "field_command_A_per_m",
        unit: "A/m",
        stems: &["field_command"],
        units: FIELDS,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Field,
        key: "field",
        others: &[],
        name: "field",
        header: "field_A_per_m",
        unit: "A/m",
        stems: &["field", "h"],
        units: FIELDS,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Current,
        key: "current",
        others: &[],
        name: "current",
        header: "current_A",
        unit: "A",
        stems: &["current"],
        units: CURRENTS,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Voltage,
        key: "voltage",
        others: &[],
        name: "voltage",
        header: "voltage_V",
        unit: "V",
        stems: &["voltage"],
        units: VOLTAGES,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Displacement,
        key: "displacement",
        others: &[],
        name: "displacement",
        header: "displacement_m",
        unit: "m",
        stems: &["displacement", "disp"],
        units: LENGTHS,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Strain,
        key: "strain",
        others: &[],
        name: "strain",
        header: "strain",
        unit: "m/m",
        stems: &["strain"],
        units: STRAINS,
        bare: &[("strain", 1.0), ("microstrain", 1e-6)],
    },
    Entry {
        quantity: Quantity::Magnetization,
        key: "magnetization",
        others: &[],
        name: "magnetization",
        header: "magnetization_A_per_m",
        unit: "A/m",
        stems: &["magnetization", "m"],
        units: MAGNETIZATIONS,
        bare: &[],
    },
    Entry {
        quantity: Quantity::FluxDensity,
        key: "flux",
        others: &["flux_density"],
        name: "flux density",
        header: "flux_density_T",
        unit: "T",
        stems: &["flux_density", "b"],
        units: FLUX_DENSITIES,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Temperature,
        key: "temperature",
        others: &[],
        name: "temperature",
        header: "temperature_K",
        unit: "K",
        stems: &["temperature", "temp"],
        units: TEMPERATURES,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Force,
        key: "force",
        others: &[],
        name: "force",
        header: "force_N",
        unit: "N",
        stems: &["force"],
        units: FORCES,
        bare: &[],
    },
    Entry {
        quantity: Quantity::Input,
        key: "input",
        others: &[],
        name: "input",
        header: "input",
        unit: "",
        stems: &[],
        units: &[],
        bare: &[("input", 1.0)],
    },
    Entry {
        quantity: Quantity::Output,
        key: "output",
        others: &[],
        name: "output",
        header: "output",
        unit: "",
        stems: &[],
        units: &[],
        bare: &[("output", 1.0)],
    },
];

impl Quantity {
    pub const ALL: [Quantity; 14] = [
        Quantity::LoopId,
        Quantity::Time,
        Quantity::FieldCommand,
        Quantity::Field,
        Quantity::Current,
        Quantity::Voltage,
        Quantity::Displacement,
        Quantity::Strain,
        Quantity::Magnetization,
        Quantity::FluxDensity,
        Quantity::Temperature,
        Quantity::Force,
        Quantity::Input,
        Quantity::Output,
    ];

    fn entry(self) -> &'static Entry {
        &ENTRIES[self.index()]
    }

    /// Place in [`Quantity::ALL`].
    pub(crate) fn index(self) -> usize {
        self as usize
    }

    /// The word used in a mapping.
    pub fn key(self) -> &'static str {
        self.entry().key
    }

    /// As a sentence calls it.
    pub fn name(self) -> &'static str {
        self.entry().name
    }

    /// The header that needs no mapping, as in `displacement_m`.
    pub fn header(self) -> &'static str {
        self.entry().header
    }

    /// SI unit; empty for a number of a loop, m/m for strain.
    pub fn unit(self) -> &'static str {
        self.entry().unit
    }

    /// Key, full name or standard header, without regard to case.
    pub(crate) fn of_key(text: &str) -> Option<Quantity> {
        let is = |word: &&str| word.eq_ignore_ascii_case(text);
        let entry = ENTRIES
            .iter()
            .find(|entry| is(&entry.key) || is(&entry.header) || entry.others.iter().any(is))?;
        Some(entry.quantity)
    }

    /// Factor and offset to SI if this header holds this quantity.
    pub(crate) fn known_header(self, header: &str) -> Option<(f64, f64)> {
        let (entry, header) = (self.entry(), plain(header));
        let bare = entry.bare.iter().find(|(name, _)| *name == header);
        if let Some((_, factor)) = bare {
            return Some((*factor, 0.0));
        }
        entry.stems.iter().find_map(|stem| {
            let ending = header.strip_prefix(stem)?.strip_prefix('_')?;
            let unit = entry.units.iter().find(|unit| unit.spelling == ending)?;
            Some((unit.factor, unit.offset))
        })
    }

    /// The symbol of a unit with this factor to SI, other than SI's own.
    pub(crate) fn unit_of(self, factor: f64) -> Option<&'static str> {
        let same = |unit: &&Unit| unit.factor != 1.0 && (unit.factor / factor - 1.0).abs() < 1e-6;
        self.entry().units.iter().find(same).map(|unit| unit.symbol)
    }

    /// The unit that ends a header, if it names one of this quantity.
    pub(crate) fn named_unit(self, header: &str) -> Option<&'static Unit> {
        let header = plain(header);
        let ends = |unit: &&Unit| {
            let Some(before) = header.strip_suffix(unit.spelling) else {
                return false;
            };
            // A short unit needs a mark before it ("x_t"); a long one cannot be the end of a word ("HkA/m").
            before.ends_with('_') || unit.spelling.contains("_per_")
        };
        let all = self.entry().units.iter();
        all.filter(ends).max_by_key(|unit| unit.spelling.len())
    }
}

/// Units that headers end with and that are not read, as headers spell them: who has them says the scale.
const STRANGE: &[(Quantity, &[&str])] = &[
    (Quantity::Field, &["koe"]),
    (Quantity::FieldCommand, &["koe"]),
    (
        Quantity::Displacement,
        &["in", "inch", "inches", "mil", "mils", "thou", "ft", "cm", "counts"],
    ),
    (Quantity::FluxDensity, &["g", "gs", "gauss"]),
    (Quantity::Temperature, &["f", "degf"]),
    (
        Quantity::Force,
        &["lb", "lbs", "lbf", "kgf", "psi", "pa", "kpa", "mpa", "bar"],
    ),
];

impl Quantity {
    /// The unit that ends a header and is none of those read.
    pub(crate) fn strange_unit(self, header: &str) -> Option<&'static str> {
        let header = plain(header);
        let (_, ending) = header.rsplit_once('_')?;
        let (_, units) = STRANGE.iter().find(|(own, _)| *own == self)?;
        units.iter().find(|unit| **unit == ending).copied()
    }
}

/// Whether a text is a unit of some quantity, in brackets or not, and no more.
pub(crate) fn is_unit(text: &str) -> bool {
    let spelling = plain(text);
    let mut all = ENTRIES.iter().flat_map(|entry| entry.units);
    all.any(|unit| unit.spelling == spelling)
}

/// Lower case, µ as u, and one underscore for every space, bracket and mark: "Field [kA/m]" becomes "field_ka_per_m".
pub(crate) fn plain(header: &str) -> String {
    let mut text = String::with_capacity(header.len());
    for letter in header.chars().flat_map(char::to_lowercase) {
        match letter {
            'µ' | 'μ' => text.push('u'),
            '°' => text.push_str("deg"),
            '/' => text.push_str("_per_"),
            ' ' | '(' | ')' | '[' | ']' | '_' | ',' => {
                if !text.ends_with('_') {
                    text.push('_');
                }
            }
            other => text.push(other),
        }
    }
    text.trim_matches('_').to_owned()
}

#[cfg(test)]
mod tests {
    //! Guards the table: an entry out of place would read one quantity as another.
    use super::*;

    #[test]
    fn entries_stand_in_the_order_of_the_quantities() {
        for (index, quantity) in Quantity::ALL.into_iter().enumerate() {
            assert_eq!((quantity.index(), ENTRIES[index].quantity), (index, quantity));
            assert_eq!(Quantity::of_key(quantity.key()), Some(quantity));
            assert_eq!(Quantity::of_key(quantity.header()), Some(quantity));
        }
    }

    #[test]
    fn every_standard_header_is_known_to_its_own_quantity_alone() {
        for quantity in Quantity::ALL {
            for other in Quantity::ALL {
                let known = other.known_header(quantity.header());
                assert_eq!(
                    known,
                    (quantity == other).then_some((1.0, 0.0)),
                    "{quantity:?} as {other:?}"
                );
            }
        }
    }

    #[test]
    fn units_are_read_however_they_are_written() {
        let known = |quantity: Quantity, header| quantity.known_header(header);
        assert_eq!(known(Quantity::Field, "H [kA/m]"), Some((1e3, 0.0)));
        assert_eq!(known(Quantity::Displacement, "Displacement (µm)"), Some((1e-6, 0.0)));
        assert_eq!(known(Quantity::Temperature, "temperature_degC"), Some((1.0, 273.15)));
        assert_eq!(known(Quantity::Field, "field_command_A_per_m"), None);
        let named = |quantity: Quantity, header| quantity.named_unit(header).map(|unit| unit.symbol);
        assert_eq!(named(Quantity::Displacement, "disp_um"), Some("µm"));
        assert_eq!(named(Quantity::Voltage, "v_in_V"), Some("V"));
        assert_eq!(named(Quantity::Field, "HkA/m"), Some("kA/m"));
        assert_eq!(named(Quantity::Displacement, "sum"), None);
        assert_eq!(named(Quantity::Time, "sample_t"), None);
    }
}
