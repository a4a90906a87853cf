//! What is said of a text that is no good RON, or not of the form that a field has: the field, its unit, and what is wanted.

use super::source;
use anhyst_measured::nearest;
use ron::Error;

/// Endings of fields' names and the units that they say; the longer before the shorter.
const UNITS: [(&str, &str); 26] = [
    ("_m_per_a_per_m", "m per A/m"),
    ("_n_s_per_m2", "N s/m²"),
    ("_n_s_per_m", "N s/m"),
    ("_n_per_m2", "N/m²"),
    ("_n_per_m", "N/m"),
    ("_a_per_m_s", "A/(m s)"),
    ("_a_per_m", "A/m"),
    ("_kg_per_m3", "kg/m³"),
    ("_per_kg", "1/kg"),
    ("_per_s2", "1/s²"),
    ("_per_s", "1/s"),
    ("_per_k", "1/K"),
    ("_m_per_s", "m/s"),
    ("_pa", "Pa"),
    ("_hz", "Hz"),
    ("_rpm", "rpm"),
    ("_deg", "degrees"),
    ("_us", "µs"),
    ("_kg", "kg"),
    ("_ticks", "ticks"),
    ("_w", "W"),
    ("_n", "N"),
    ("_k", "K"),
    ("_t", "T"),
    ("_m", "m"),
    ("_s", "s"),
];

/// The sentence for an error at a byte of a text.
pub fn sentence(text: &str, byte: usize, error: &Error) -> String {
    // What is missing is told at the bracket that closes its struct, which touches the last value in it.
    let at = byte + usize::from(matches!(error, Error::MissingStructField { .. }));
    let field = source::read(text).map(|place| place.path_at(at)).unwrap_or_default();
    let unit = UNITS.iter().find(|(ending, _)| field.ends_with(ending));
    let of_unit = unit.map_or_else(String::new, |(_, unit)| format!(" in {unit}"));
    let (before, after) = text.split_at_checked(byte).unwrap_or((text, ""));
    // What stands before the place as the begin of a number.
    let number = &before[before
        .trim_end_matches(|letter: char| letter.is_ascii_digit() || "+-.".contains(letter))
        .len()..];
    let wanted = match error {
        Error::ExpectedComma if !number.is_empty() && after.starts_with('.') => {
            return format!("{}what is wanted is a whole number, not one with a point", of(&field));
        }
        Error::ExpectedComma if !number.is_empty() => {
            let is_in = unit.map_or_else(String::new, |(_, unit)| format!("; it is in {unit}"));
            return format!("{field}: a number stands alone, as {number}{is_in}");
        }
        Error::SuggestRawIdentifier(found) | Error::InvalidIdentifier(found)
            if found.starts_with(|own: char| own.is_ascii_digit()) =>
        {
            return format!("a number has a point, not a comma, as 7.5; after the comma a name is wanted, not {found}");
        }
        Error::SuggestRawIdentifier(found) => {
            return format!(
                "{found} is no name: a text stands in \"quotes\", and a file of a material is File(\"FILE\")"
            );
        }
        Error::IntegerOutOfBounds => "a whole number, neither negative nor too large".to_owned(),
        Error::ExpectedInteger => "a whole number".to_owned(),
        Error::ExpectedFloat => format!("a number{of_unit}, such as 2.5 or 1e-3"),
        Error::ExpectedIdentifier if field.ends_with("material") => "File(\"FILE\") or Inline(…)".to_owned(),
        Error::ExpectedIdentifier => "a name without quotes".to_owned(),
        Error::ExpectedBoolean => "true or false".to_owned(),
        Error::ExpectedString => "a text in \"quotes\"".to_owned(),
        Error::ExpectedArray => "a list, as [1.0, 2.0]".to_owned(),
        Error::ExpectedOption => format!("None, or a value{of_unit}"),
        Error::ExpectedStructLike | Error::ExpectedNamedStructLike(_) => {
            "fields in brackets, as (name: value)".to_owned()
        }
        Error::ExpectedMap => "a map, as { \"name\": value }".to_owned(),
        Error::NoSuchStructField { expected, found, outer } => {
            // A scenario's `fault` is read only to be refused; what it may have instead of all others is read by another struct.
            let is_scenario = outer.as_deref() == Some("Scenario");
            let own = expected.iter().filter(|name| !is_scenario || **name != "fault");
            let others: &[&str] = if is_scenario { &["based_on", "set"] } else { &[] };
            let expected: Vec<&str> = own.chain(others).copied().collect();
            return unknown(&of(&field), "field", found, &expected);
        }
        Error::NoSuchEnumVariant { expected, found, .. } => {
            return unknown(&of(&field), "variant", found, expected);
        }
        Error::MissingStructField { field: name, .. } => return format!("{}the field `{name}` is missing", of(&field)),
        Error::DuplicateStructField { field: name, .. } => {
            return format!("{}the field `{name}` stands twice", of(&field));
        }
        _ => String::new(),
    };
    let named = of(&field);
    if wanted.is_empty() {
        format!("{named}{error}")
    } else {
        format!("{named}{error}: what is wanted is {wanted}")
    }
}

/// A field before what is said of it; nothing at the top.
fn of(field: &str) -> String {
    if field.is_empty() {
        String::new()
    } else {
        format!("{field}: ")
    }
}

/// A name that nothing has, and the one that is likely meant.
fn unknown(of: &str, what: &str, found: &str, expected: &[&str]) -> String {
    let meant = nearest(found, expected.iter().copied()).map(|name| format!("; is `{name}` meant?"));
    let names: Vec<String> = expected.iter().map(|name| format!("`{name}`")).collect();
    let instead = match &names[..] {
        [] => format!("there is no {what} here"),
        names => format!("expected one of {}", names.join(", ")),
    };
    format!(
        "{of}unexpected {what} `{found}`, {instead}{}",
        meant.unwrap_or_default()
    )
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only read")]
    struct Outer {
        seed: u64,
        inner: Vec<Inner>,
        #[serde(default)]
        kind: Kind,
    }

    #[derive(Debug, Default, Deserialize)]
    enum Kind {
        #[default]
        Plain,
    }

    #[derive(Debug, Deserialize)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only read")]
    struct Inner {
        rate_a_per_m_s: f64,
    }

    fn said(text: &str) -> String {
        let error = ron::from_str::<Outer>(text).unwrap_err();
        let lines: usize = text
            .split_inclusive('\n')
            .take(error.span.start.line - 1)
            .map(str::len)
            .sum();
        let begin = lines + error.span.start.col - 1;
        let blanks = text[begin..].len() - text[begin..].trim_start().len();
        super::sentence(text, begin + blanks, &error.code)
    }

    /// Guards what a newcomer reads: which field, in which unit, of which form.
    #[test]
    fn field_unit_and_form_are_said() {
        for (text, words) in [
            (
                "(seed: \"one\", inner: [])",
                &["seed: Expected integer", "a whole number"][..],
            ),
            (
                "(\n seed: 1,\n inner: [(rate_a_per_m_s: 1), (rate_a_per_m_s: fast)])",
                &["inner.1.rate_a_per_m_s", "Expected float", "a number in A/(m s)"],
            ),
            ("(sede: 1, inner: [])", &["sede", "is `seed` meant?"]),
            (
                "(seed: 1, inner: [(rate_a_per_m_s: 1), (rate: 1)])",
                &["inner.1: unexpected field `rate`, expected one of `rate_a_per_m_s`"],
            ),
            (
                "(seed: 1, inner: [()])",
                &["inner: the field `rate_a_per_m_s` is missing"],
            ),
            ("(seed: 1)", &["the field `inner` is missing"]),
            (
                "(seed: 1, kind: Plian)",
                &["kind: unexpected variant `Plian`", "is `Plain` meant?"],
            ),
            ("(seed: 1, seed: 1)", &["the field `seed` stands twice"]),
            ("(seed: 1, inner: 3)", &["inner: Expected", "a list"]),
            ("(seed: 1.5, inner: [])", &["seed: what is wanted is a whole number"]),
            (
                "(seed: 1, kind: \"Plain\")",
                &["kind: Expected", "a name without quotes"],
            ),
            ("(seed: -1, inner: [])", &["seed: ", "neither negative nor"]),
            (
                "(seed: 1, inner: [(rate_a_per_m_s: 7.5kA)])",
                &["rate_a_per_m_s: a number stands alone, as 7.5; it is in A/(m s)"],
            ),
            ("(inner: [(rate_a_per_m_s: 7,5)])", &["a point, not a comma"]),
            (
                "(seed: 1, kind: one.ron)",
                &["one.ron is no name: a text stands in \"quotes\""],
            ),
        ] {
            let said = said(text);
            for word in words {
                assert!(said.contains(word), "no \"{word}\" in: {said}");
            }
        }
    }
}
