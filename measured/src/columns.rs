//! Which column of a table holds which quantity, and what takes it to SI units.
//!
//! A header is known by its name ([`Quantity::known_header`]), or it is named: `field=H_raw*1000` takes the column
//! `H_raw` and multiplies it by 1000 to get A/m, `temperature=T*1+273.15` adds an offset after the factor, and
//! `current=-` leaves the quantity out.

use std::path::Path;
use std::str::FromStr;

use crate::error::MeasuredError;
use crate::quantity::{Quantity, Unit};
use crate::spelling::nearest;

/// The header that stands for "do not read this quantity".
pub(crate) const LEFT_OUT: &str = "-";

/// A column named by the user: quantity, header, and the factor and offset to SI if they were given.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMapping {
    pub quantity: Quantity,
    pub header: String,
    pub scale: Option<f64>,
    /// Added after scaling.
    pub offset: Option<f64>,
}

impl FromStr for ColumnMapping {
    type Err = MeasuredError;

    /// `name=HEADER`, `name=HEADER*SCALE`, `name=HEADER*SCALE+OFFSET` or `name=-`.
    fn from_str(text: &str) -> Result<Self, MeasuredError> {
        let key = text.split('=').next().unwrap_or_default().trim();
        let near = nearest(key, Quantity::ALL.map(Quantity::key)).filter(|near| *near != key);
        let refusal = || MeasuredError::BadMapping {
            text: text.to_owned(),
            meant: near.map_or_else(String::new, |near| format!("is {near}= meant? Else ")),
            keys: keys(&Quantity::ALL),
        };
        let (key, rest) = text.split_once('=').ok_or_else(refusal)?;
        let quantity = Quantity::of_key(key.trim()).ok_or_else(refusal)?;
        let (header, numbers) = match rest.rsplit_once('*') {
            Some((header, numbers)) => (header, Some(scale_and_offset(numbers.trim()).ok_or_else(refusal)?)),
            None => (rest, None),
        };
        if header.trim().is_empty() {
            return Err(refusal());
        }
        Ok(ColumnMapping {
            quantity,
            header: header.trim().to_owned(),
            scale: numbers.map(|(scale, _)| scale),
            offset: numbers.and_then(|(_, offset)| offset),
        })
    }
}

/// As it is read.
impl std::fmt::Display for ColumnMapping {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}={}", self.quantity.key(), self.header)?;
        match (self.scale, self.offset) {
            (None, _) => Ok(()),
            (Some(scale), None) => write!(formatter, "*{scale:e}"),
            (Some(scale), Some(offset)) => write!(formatter, "*{scale:e}{offset:+e}"),
        }
    }
}

/// `SCALE`, `SCALE+OFFSET` or `SCALE-OFFSET`; the sign of an exponent is no beginning of an offset.
fn scale_and_offset(text: &str) -> Option<(f64, Option<f64>)> {
    let number = |part: &str| part.trim().parse::<f64>().ok().filter(|value| value.is_finite());
    let usable = |scale: f64| (scale != 0.0).then_some(scale);
    if let Some(scale) = number(text) {
        return Some((usable(scale)?, None));
    }
    let signs = text.match_indices(['+', '-']).map(|(index, _)| index);
    let mut splits = signs.filter_map(|index| Some((number(&text[..index])?, number(&text[index..])?)));
    let (scale, offset) = splits.next()?;
    Some((usable(scale)?, Some(offset)))
}

/// Keys of quantities as a list for a sentence: "loop, time or strain".
pub(crate) fn keys(quantities: &[Quantity]) -> String {
    let keys: Vec<_> = quantities.iter().map(|quantity| quantity.key()).collect();
    match keys.split_last() {
        Some((last, others)) if !others.is_empty() => format!("{} or {last}", others.join(", ")),
        _ => keys.concat(),
    }
}

/// A column found in a file: its value times `scale` plus `offset` is in SI units.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub index: usize,
    pub header: String,
    pub scale: f64,
    pub offset: f64,
    /// The user wrote the scale, so an unlikely magnitude is meant.
    pub(crate) scale_given: bool,
    /// The unit that a mapped column's name says.
    pub(crate) named: Option<&'static Unit>,
}

impl Column {
    /// The unit in the name needs another scale than the one given. A sign is a choice (a coil wound the other way).
    pub(crate) fn contradiction(&self, file: &Path) -> Option<MeasuredError> {
        let unit = self.named?;
        let agrees = (0.5..2.0).contains(&(self.scale.abs() / unit.factor));
        (!agrees).then(|| MeasuredError::ScaleContradictsName {
            file: file.to_owned(),
            column: self.header.clone(),
            named_unit: unit.symbol,
            expected: unit.factor,
            scale: self.scale,
        })
    }
}

/// The columns of one file by quantity.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns {
    found: Vec<(Quantity, Column)>,
}

impl Columns {
    /// Finds every wanted quantity among the headers: named ones first, then by known names.
    pub(crate) fn resolve(
        file: &Path,
        headers: &[String],
        mappings: &[ColumnMapping],
        wanted: &[Quantity],
    ) -> Result<Self, MeasuredError> {
        refuse_mappings(mappings, wanted)?;
        let mut found = Vec::new();
        for &quantity in wanted {
            let column = match mappings.iter().find(|mapping| mapping.quantity == quantity) {
                Some(mapping) if mapping.header == LEFT_OUT => None,
                Some(mapping) => Some(named(file, headers, mapping)?),
                None => known(file, headers, quantity)?,
            };
            found.extend(column.map(|column| (quantity, column)));
        }
        Ok(Columns { found })
    }

    pub fn of(&self, quantity: Quantity) -> Option<&Column> {
        self.iter().find(|(of, _)| *of == quantity).map(|(_, column)| column)
    }

    pub fn iter(&self) -> impl Iterator<Item = (Quantity, &Column)> {
        self.found.iter().map(|(quantity, column)| (*quantity, column))
    }
}

/// A mapping that would change nothing is a mistake.
fn refuse_mappings(mappings: &[ColumnMapping], wanted: &[Quantity]) -> Result<(), MeasuredError> {
    for (index, mapping) in mappings.iter().enumerate() {
        let quantity_key = mapping.quantity.key();
        if let Some(before) = mappings[..index]
            .iter()
            .find(|other| other.quantity == mapping.quantity)
        {
            return Err(MeasuredError::MappedTwice {
                quantity_key,
                first: before.header.clone(),
                second: mapping.header.clone(),
            });
        }
        if !wanted.contains(&mapping.quantity) {
            return Err(MeasuredError::NotWanted {
                quantity_key,
                wanted: keys(wanted),
            });
        }
    }
    Ok(())
}

/// A mapping as a user would write it.
pub(crate) fn option(quantity: Quantity, header: &str, scale: f64, offset: f64) -> String {
    let scale = if (1e-3..1e6).contains(&scale.abs()) {
        scale.to_string()
    } else {
        format!("{scale:e}")
    };
    let offset = if offset == 0.0 {
        String::new()
    } else {
        format!("{offset:+}")
    };
    format!("{}={header}*{scale}{offset}", quantity.key())
}

/// Headers as a message lists them.
pub(crate) fn quoted(headers: &[String]) -> String {
    let quoted: Vec<String> = headers.iter().map(|header| format!("\"{header}\"")).collect();
    quoted.join(", ")
}

pub(crate) fn missing(file: &Path, headers: &[String], quantity: Quantity) -> MeasuredError {
    MeasuredError::MissingColumn {
        file: file.to_owned(),
        quantity: quantity.name(),
        quantity_key: quantity.key(),
        present: quoted(headers),
    }
}

/// The column that a user names.
pub(crate) fn named(file: &Path, headers: &[String], mapping: &ColumnMapping) -> Result<Column, MeasuredError> {
    let quantity = mapping.quantity;
    let same = |header: &&String| **header == mapping.header;
    let index = headers.iter().position(|header| same(&header));
    let index = index.ok_or_else(|| MeasuredError::NoSuchHeader {
        file: file.to_owned(),
        header: mapping.header.clone(),
        quantity: quantity.name(),
        meant: nearest(&mapping.header, headers.iter().map(String::as_str))
            .map_or_else(String::new, |near| format!("Is \"{near}\" meant? ")),
        present: quoted(headers),
    })?;
    let times = headers.iter().filter(same).count();
    if times > 1 {
        let (file, column) = (file.to_owned(), mapping.header.clone());
        return Err(MeasuredError::HeaderTwice { file, column, times });
    }
    let unit = quantity.named_unit(&mapping.header);
    if let (None, None, Some(strange)) = (unit, mapping.scale, quantity.strange_unit(&mapping.header)) {
        return Err(MeasuredError::StrangeUnit {
            file: file.to_owned(),
            column: mapping.header.clone(),
            named_unit: strange,
            unit: quantity.unit(),
            quantity_key: quantity.key(),
        });
    }
    let from_name = unit.map_or((1.0, 0.0), |unit| (unit.factor, unit.offset));
    Ok(Column {
        index,
        header: mapping.header.clone(),
        scale: mapping.scale.unwrap_or(from_name.0),
        // Who writes a scale says all there is to say, the offset too.
        offset: mapping
            .offset
            .unwrap_or(if mapping.scale.is_some() { 0.0 } else { from_name.1 }),
        scale_given: mapping.scale.is_some(),
        named: unit,
    })
}

fn known(file: &Path, headers: &[String], quantity: Quantity) -> Result<Option<Column>, MeasuredError> {
    let mut hits = headers.iter().enumerate().filter_map(|(index, header)| {
        let (scale, offset) = quantity.known_header(header)?;
        Some(Column {
            index,
            header: header.clone(),
            scale,
            offset,
            scale_given: false,
            named: None,
        })
    });
    let first = hits.next();
    match (&first, hits.next()) {
        (Some(first), Some(second)) if first.header == second.header => Err(MeasuredError::HeaderTwice {
            file: file.to_owned(),
            column: first.header.clone(),
            times: 2 + hits.count(),
        }),
        (Some(first), Some(second)) => Err(MeasuredError::TwoColumns {
            file: file.to_owned(),
            quantity: quantity.name(),
            quantity_key: quantity.key(),
            first: first.header.clone(),
            second: second.header,
        }),
        _ => Ok(first),
    }
}

#[cfg(test)]
mod tests {
    //! Guards what a mapping means: a sign taken for an exponent would shift or scale a whole column.
    use super::*;

    #[test]
    fn scales_and_offsets_are_told_apart() {
        let numbers = |text: &str| {
            let mapping: ColumnMapping = text.parse().ok()?;
            assert_eq!(
                mapping.to_string().parse().ok(),
                Some(mapping.clone()),
                "{mapping} is another one"
            );
            Some((mapping.header, mapping.scale, mapping.offset))
        };
        let is = |text, header: &str, scale, offset| {
            assert_eq!(numbers(text), Some((header.to_owned(), scale, offset)), "{text}");
        };
        is("displacement=d*1e-6", "d", Some(1e-6), None);
        is("Displacement_m=d*2e-6-1e-4", "d", Some(2e-6), Some(-1e-4));
        is("temperature = T+x *1+273.15", "T+x", Some(1.0), Some(273.15));
        is("flux_density=a*b*-1", "a*b", Some(-1.0), None);
        is("current=-", "-", None, None);
        for wrong in [
            "field=H*1e",
            "field=H*1+",
            "field=H*0",
            "field=H*nan",
            "speed=v",
            "field=*2",
        ] {
            assert_eq!(numbers(wrong), None, "{wrong}");
        }
    }
}
