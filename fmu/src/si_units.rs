//! Units as FMI wants them: each with its exponents of the SI base units.

/// Exponents of a unit, `kg`, `m`, `s`, `A`, `K`; none for a unit that is not known. Above and below one stroke there are products, squares, and
/// fractions in parentheses.
pub fn exponents(unit: &str) -> Option<[(&'static str, i8); 5]> {
    let powers = powers(unit)?;
    let mut places = ["kg", "m", "s", "A", "K"].into_iter().zip(powers);
    Some(std::array::from_fn(|_| places.next().expect("there are five")))
}

fn powers(unit: &str) -> Option<[i8; 5]> {
    let combined = |one: &str, other: &str, sign: i8| {
        let (one, other) = (powers(one)?, powers(other)?);
        Some(std::array::from_fn(|place| one[place] + sign * other[place]))
    };
    if let Some((above, below)) = unit.split_once('/').filter(|_| !unit.starts_with('(')) {
        return combined(above, below, -1);
    }
    if let Some(base) = unit.strip_suffix("^2") {
        return combined(base, base, 1);
    }
    if let Some(inside) = unit.strip_prefix('(').and_then(|rest| rest.strip_suffix(')')) {
        return powers(inside);
    }
    if let Some((first, rest)) = unit.split_once(' ') {
        return combined(first, rest, 1);
    }
    Some(match unit {
        "1" => [0, 0, 0, 0, 0],
        "kg" => [1, 0, 0, 0, 0],
        "m" => [0, 1, 0, 0, 0],
        "s" => [0, 0, 1, 0, 0],
        "A" => [0, 0, 0, 1, 0],
        "K" => [0, 0, 0, 0, 1],
        "N" => [1, 1, -2, 0, 0],
        "V" => [1, 2, -3, -1, 0],
        "T" => [1, 0, -2, -1, 0],
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::exponents;
    use anhyst_ipc::Channel;
    use anhyst_scenario::Units;

    /// Guards the table: a message's new unit must be in it, or an FMU's variable would have none.
    #[test]
    fn every_unit_of_a_message_is_known() {
        let of = |input: &str, output: &str, shape| Units {
            input: input.into(),
            output: output.into(),
            shape,
        };
        for units in [
            Units::default(),
            of("V", "m", false),
            of("A", "T", false),
            of("A/m", "T", false),
        ] {
            for field in Channel::ALL.iter().flat_map(|channel| channel.fields()) {
                let unit = units.of_message(field.name, field.unit);
                assert!(unit.is_empty() || exponents(&unit).is_some(), "{}: {unit}", field.name);
            }
        }
    }

    #[test]
    fn products_fractions_and_squares_are_read() {
        for (unit, powers) in [
            ("A/(m s)", [0, -1, -1, 1, 0]),
            ("1/(A/m)^2", [0, 2, 0, -2, 0]),
            ("m/(V)", [-1, -1, 3, 1, 0]),
            ("V/s", [1, 2, -4, -1, 0]),
        ] {
            assert_eq!(exponents(unit).unwrap().map(|(_, own)| own), powers, "{unit}");
        }
        assert_eq!(exponents("furlong"), None);
    }
}
