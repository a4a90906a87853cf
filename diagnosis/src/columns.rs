//! Which column of a table holds which quantity, and the factor that takes it to SI units.
//!
//! A header is known by its name ([`KNOWN_HEADERS`], without regard to case), or it is named:
//! `field=H_raw*1000` takes the column `H_raw` and multiplies it by 1000 to get A/m.

use std::path::Path;
use std::str::FromStr;

use crate::error::DiagnosisError;

/// What a column can hold, in SI units once read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    LoopId,
    Time,
    Field,
    FluxDensity,
    Magnetization,
    Strain,
}

impl Quantity {
    pub const ALL: [Quantity; 6] = [
        Quantity::LoopId,
        Quantity::Time,
        Quantity::Field,
        Quantity::FluxDensity,
        Quantity::Magnetization,
        Quantity::Strain,
    ];

    /// The word used in a mapping.
    pub fn key(self) -> &'static str {
        match self {
            Quantity::LoopId => "loop",
            Quantity::Time => "time",
            Quantity::Field => "field",
            Quantity::FluxDensity => "flux",
            Quantity::Magnetization => "magnetization",
            Quantity::Strain => "strain",
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Quantity::LoopId => "loop number",
            Quantity::FluxDensity => "flux density",
            other => other.key(),
        }
    }
}

/// Lower-case header, quantity, factor to SI.
const KNOWN_HEADERS: &[(&str, Quantity, f64)] = &[
    ("loop_id", Quantity::LoopId, 1.0),
    ("loop", Quantity::LoopId, 1.0),
    ("time_s", Quantity::Time, 1.0),
    ("t_s", Quantity::Time, 1.0),
    ("time_ms", Quantity::Time, 1e-3),
    ("field_a_per_m", Quantity::Field, 1.0),
    ("field_ka_per_m", Quantity::Field, 1e3),
    ("h_a_per_m", Quantity::Field, 1.0),
    ("h_ka_per_m", Quantity::Field, 1e3),
    ("h_oe", Quantity::Field, OERSTED_A_PER_M),
    ("b_t", Quantity::FluxDensity, 1.0),
    ("b_mt", Quantity::FluxDensity, 1e-3),
    ("flux_density_t", Quantity::FluxDensity, 1.0),
    ("flux_density_mt", Quantity::FluxDensity, 1e-3),
    ("m_a_per_m", Quantity::Magnetization, 1.0),
    ("m_ka_per_m", Quantity::Magnetization, 1e3),
    ("magnetization_a_per_m", Quantity::Magnetization, 1.0),
    ("magnetization_ka_per_m", Quantity::Magnetization, 1e3),
    ("strain", Quantity::Strain, 1.0),
    ("strain_ppm", Quantity::Strain, 1e-6),
    ("strain_um_per_m", Quantity::Strain, 1e-6),
    ("microstrain", Quantity::Strain, 1e-6),
];

/// 1 Oe in A/m.
const OERSTED_A_PER_M: f64 = 1000.0 / (4.0 * std::f64::consts::PI);

/// Unit that ends a header, lower case, and its factor to SI.
const NAMED_UNITS: &[(&str, &str, f64)] = &[
    ("ka_per_m", "kA/m", 1e3),
    ("ka/m", "kA/m", 1e3),
    ("a_per_m", "A/m", 1.0),
    ("a/m", "A/m", 1.0),
    ("_mt", "mT", 1e-3),
    ("_t", "T", 1.0),
    ("_ppm", "ppm", 1e-6),
    ("_oe", "Oe", OERSTED_A_PER_M),
];

/// A column named by the user: quantity, header, and the factor to SI if one was given.
#[derive(Clone, Debug, PartialEq)]
pub struct ColumnMapping {
    pub quantity: Quantity,
    pub header: String,
    pub scale: Option<f64>,
}

impl FromStr for ColumnMapping {
    type Err = DiagnosisError;

    /// `name=HEADER` or `name=HEADER*SCALE`.
    fn from_str(text: &str) -> Result<Self, DiagnosisError> {
        let refusal = || DiagnosisError::BadMapping {
            text: text.to_owned(),
            expected: "loop, time, field, flux, magnetization or strain, then = and the header, then * and a scale \
                       if the unit is not SI, as in field=H_raw*1000",
        };
        let (key, rest) = text.split_once('=').ok_or_else(refusal)?;
        let quantity = Quantity::ALL
            .into_iter()
            .find(|quantity| quantity.key() == key.trim())
            .ok_or_else(refusal)?;
        let (header, scale) = match rest.rsplit_once('*') {
            Some((header, scale)) => {
                let scale: f64 = scale.trim().parse().map_err(|_| refusal())?;
                if !scale.is_finite() || scale == 0.0 {
                    return Err(refusal());
                }
                (header, Some(scale))
            }
            None => (rest, None),
        };
        if header.trim().is_empty() {
            return Err(refusal());
        }
        Ok(ColumnMapping {
            quantity,
            header: header.trim().to_owned(),
            scale,
        })
    }
}

/// A column found in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Column {
    pub index: usize,
    pub header: String,
    pub scale: f64,
}

/// The columns of one file by quantity.
#[derive(Clone, Debug)]
pub struct Columns {
    found: Vec<(Quantity, Column)>,
}

impl Columns {
    /// Finds every quantity among the headers: named ones first, then by known names.
    pub fn resolve(file: &Path, headers: &[String], mappings: &[ColumnMapping]) -> Result<Self, DiagnosisError> {
        let mut found = Vec::new();
        for quantity in Quantity::ALL {
            let column = match mappings.iter().find(|mapping| mapping.quantity == quantity) {
                Some(mapping) => Some(named(file, headers, mapping)?),
                None => known(file, headers, quantity)?,
            };
            found.extend(column.map(|column| (quantity, column)));
        }
        let columns = Columns { found };
        columns.require(file, headers, Quantity::Field)?;
        Ok(columns)
    }

    pub fn of(&self, quantity: Quantity) -> Option<&Column> {
        self.found
            .iter()
            .find(|(of, _)| *of == quantity)
            .map(|(_, column)| column)
    }

    fn require(&self, file: &Path, headers: &[String], quantity: Quantity) -> Result<(), DiagnosisError> {
        self.of(quantity)
            .map(|_| ())
            .ok_or_else(|| missing(file, headers, quantity))
    }

    /// Header of a quantity, for messages.
    pub fn header(&self, quantity: Quantity) -> String {
        self.of(quantity)
            .map(|column| column.header.clone())
            .unwrap_or_default()
    }
}

fn missing(file: &Path, headers: &[String], quantity: Quantity) -> DiagnosisError {
    let quoted: Vec<String> = headers.iter().map(|header| format!("\"{header}\"")).collect();
    DiagnosisError::MissingColumn {
        file: file.to_owned(),
        quantity: quantity.name(),
        quantity_key: quantity.key(),
        present: quoted.join(", "),
    }
}

fn named(file: &Path, headers: &[String], mapping: &ColumnMapping) -> Result<Column, DiagnosisError> {
    let index = headers
        .iter()
        .position(|header| *header == mapping.header)
        .ok_or_else(|| missing(file, headers, mapping.quantity))?;
    let lower = mapping.header.to_lowercase();
    let unit = NAMED_UNITS.iter().find(|(ending, ..)| lower.ends_with(ending));
    let scale = mapping.scale.or(unit.map(|(.., factor)| *factor)).unwrap_or(1.0);
    if let Some((_, named_unit, expected)) = unit {
        // A sign is a choice (a coil wound the other way); a magnitude that contradicts the name is a mistake.
        let ratio = scale.abs() / expected;
        if !(0.5..2.0).contains(&ratio) {
            let (file, column) = (file.to_owned(), mapping.header.clone());
            return Err(DiagnosisError::ScaleContradictsName {
                file,
                column,
                named_unit,
                expected: *expected,
                scale,
            });
        }
    }
    Ok(Column {
        index,
        header: mapping.header.clone(),
        scale,
    })
}

fn known(file: &Path, headers: &[String], quantity: Quantity) -> Result<Option<Column>, DiagnosisError> {
    let mut hits = headers.iter().enumerate().filter_map(|(index, header)| {
        let lower = header.to_lowercase();
        let scale = KNOWN_HEADERS
            .iter()
            .find(|(name, of, _)| *name == lower && *of == quantity)?
            .2;
        Some(Column {
            index,
            header: header.clone(),
            scale,
        })
    });
    let first = hits.next();
    if let (Some(first), Some(second)) = (&first, hits.next()) {
        return Err(DiagnosisError::TwoColumns {
            file: file.to_owned(),
            quantity: quantity.name(),
            quantity_key: quantity.key(),
            first: first.header.clone(),
            second: second.header,
        });
    }
    Ok(first)
}
