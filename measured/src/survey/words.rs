//! What a header that the door does not know may mean: its words, and the unit that it ends with.

use crate::quantity::{Quantity, Unit, plain};
use crate::run::OUTPUTS;

/// Words of a quantity, as people name channels; the first that is in a header counts.
const WORDS: &[(Quantity, &[&str])] = &[
    (
        Quantity::Time,
        &["time", "t", "zeit", "timestamp", "stamp", "elapsed", "seconds", "sec"],
    ),
    (Quantity::Field, &["field", "h", "hfield", "feld"]),
    (Quantity::Current, &["current", "i", "curr", "icoil", "amps", "strom"]),
    (
        Quantity::Voltage,
        &["voltage", "volt", "volts", "v", "u", "vin", "uin", "vpiezo", "spannung"],
    ),
    (
        Quantity::Displacement,
        &[
            "displacement",
            "disp",
            "position",
            "pos",
            "stroke",
            "elongation",
            "extension",
            "deflection",
            "laser",
            "interferometer",
            "lvdt",
            "capacitive",
            "capsensor",
            "travel",
            "weg",
            "x",
            "y",
            "z",
        ],
    ),
    (Quantity::Strain, &["strain", "eps", "epsilon", "lambda", "dehnung"]),
    (Quantity::Magnetization, &["magnetization", "magnetisation", "mag", "m"]),
    (Quantity::FluxDensity, &["flux", "induction", "b", "bfield", "hall"]),
    (
        Quantity::Temperature,
        &["temperature", "temp", "thermocouple", "pt", "tc"],
    ),
    (Quantity::Force, &["force", "load", "loadcell", "f", "kraft"]),
    (Quantity::LoopId, &["loop", "cycle", "curve", "record", "branch"]),
];
/// Words that say no more than on which side it stands.
const ANY: &[(Quantity, &[&str])] = &[
    (
        Quantity::Input,
        &["input", "drive", "excitation", "actuation", "command", "cmd"],
    ),
    (Quantity::Output, &["output", "response"]),
];
/// What was asked for.
const COMMANDS: &[&str] = &["command", "commanded", "cmd"];
/// What was wanted, or made from other channels: measured by nobody, so never read.
const NOT_MEASURED: &[&str] = &[
    "ref",
    "reference",
    "desired",
    "target",
    "setpoint",
    "demand",
    "error",
    "err",
    "residual",
    "sigma",
    "std",
    "flag",
    "status",
    "model",
    "modelled",
    "simulated",
    "estimate",
    "velocity",
    "speed",
    "acceleration",
];

/// What a header says.
#[derive(Clone, Debug, Default)]
pub(super) struct Said {
    /// By a word.
    pub word: Option<Quantity>,
    /// The word is one letter.
    pub by_letter: bool,
    /// Quantities that have the unit it ends with.
    pub units: Vec<(Quantity, &'static Unit)>,
    /// Nobody measured it.
    pub made: bool,
}

impl Said {
    pub fn by(header: &str) -> Self {
        let units: Vec<(Quantity, &'static Unit)> = Quantity::ALL
            .into_iter()
            .filter_map(|quantity| Some((quantity, quantity.named_unit(header)?)))
            .filter(|(_, unit)| written_as_unit(header, unit))
            .collect();
        let words = words(header);
        let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
        // The unit is no word of the name: "x [V]" is not a voltage by its v.
        let before = before_unit(header, &units);
        let name: Vec<String> = self::words(before);
        let named = |own: &&(Quantity, &[&str])| name.iter().any(|word| own.1.contains(&word.as_str()));
        // The longest word says most: "x" in "x_force" says little.
        let longest = |own: &&(Quantity, &[&str])| {
            let own = name.iter().filter(|word| own.1.contains(&word.as_str()));
            own.map(String::len).max()
        };
        let of = |list: &'static [(Quantity, &[&str])]| list.iter().filter(named).max_by_key(longest);
        let entry = of(WORDS).or_else(|| of(ANY));
        let by_letter = entry.and_then(|own| longest(&own)) == Some(1);
        let word = entry.map(|(quantity, _)| *quantity);
        let commanded = has(COMMANDS);
        let word = match word {
            Some(Quantity::Field) if commanded => Some(Quantity::FieldCommand),
            other => other,
        };
        let answers = word.is_some_and(|quantity| OUTPUTS.contains(&quantity));
        Said {
            word,
            by_letter,
            units,
            made: has(NOT_MEASURED) || commanded && answers,
        }
    }

    /// The unit, if the quantity has it.
    pub fn unit_of(&self, quantity: Quantity) -> Option<&'static Unit> {
        self.units
            .iter()
            .find(|(own, _)| *own == quantity)
            .map(|(_, unit)| *unit)
    }
}

/// A letter alone is a unit if it stands in brackets or is written as one: V, not v.
fn written_as_unit(header: &str, unit: &Unit) -> bool {
    let bracketed = header.trim_end().ends_with([']', ')']);
    let spelled = || header.trim_end().ends_with(unit.symbol);
    bracketed || unit.spelling.len() > 1 || spelled()
}

fn before_unit<'a>(header: &'a str, units: &[(Quantity, &'static Unit)]) -> &'a str {
    if units.is_empty() {
        return header.split(['[', '(']).next().unwrap_or(header);
    }
    let marks = ['[', '(', '_', ' '];
    let unit = units[0].1;
    // A unit of several words, as A_per_m, ends where its first word begins.
    let from = header.char_indices().rev().filter(|(_, letter)| marks.contains(letter));
    let begin = from.map(|(at, _)| at).find(|at| plain(&header[*at..]) == unit.spelling);
    begin.map_or(header, |at| &header[..at])
}

/// The words of a header in lower case: split at marks, at a capital after a small letter, between letters and digits.
fn words(header: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut last = ' ';
    for letter in header.chars() {
        let turns = last.is_lowercase() && letter.is_uppercase()
            || last.is_alphabetic() != letter.is_alphabetic() && last.is_alphanumeric() && letter.is_alphanumeric();
        if turns || !letter.is_alphanumeric() {
            words.push(String::new());
        }
        if letter.is_alphanumeric()
            && let Some(word) = words.last_mut()
        {
            word.extend(letter.to_lowercase());
        }
        last = letter;
    }
    words.retain(|word| !word.is_empty());
    words
}

#[cfg(test)]
mod tests {
    //! Guards what a name is taken for: a monitor of a laser in volts is no voltage that drives anything.
    use super::*;

    #[test]
    fn headers_say_what_people_mean_by_them() {
        let says = |header: &str, word: Option<Quantity>, unit: Option<(Quantity, &str)>| {
            let said = Said::by(header);
            assert_eq!(said.word, word, "{header}");
            let found = unit
                .and_then(|(quantity, _)| said.unit_of(quantity))
                .map(|unit| unit.symbol);
            assert_eq!(found, unit.map(|(_, symbol)| symbol), "{header}");
        };
        use Quantity::{Current, Displacement, Field, FieldCommand, Force, Time, Voltage};
        says("PosX_um", Some(Displacement), Some((Displacement, "µm")));
        says("laser [V]", Some(Displacement), Some((Voltage, "V")));
        says("Drive Voltage (V)", Some(Voltage), Some((Voltage, "V")));
        says("I_coil", Some(Current), None);
        says("H_raw", Some(Field), None);
        says("H_cmd_kA_per_m", Some(FieldCommand), Some((FieldCommand, "kA/m")));
        says("x_force", Some(Force), None);
        says("t", Some(Time), None);
        says("phase_a", None, None);
        says("pt100", Some(Quantity::Temperature), None);
        says("voltage_command", Some(Voltage), None);
        says("drive", Some(Quantity::Input), None);
        assert!(Said::by("pos_ref_um").made && Said::by("position command").made && !Said::by("pos_um").made);
    }
}
