//! Units as FMI wants them: each with its exponents of the SI base units.

/// Exponents of a unit, `kg`, `m`, `s`, `A`, `K`; none for a unit that stands in no message.
pub fn exponents(unit: &str) -> Option<[(&'static str, i8); 5]> {
    let [kg, m, s, a, k] = match unit {
        "m" => [0, 1, 0, 0, 0],
        "s" => [0, 0, 1, 0, 0],
        "1/s" => [0, 0, -1, 0, 0],
        "K" => [0, 0, 0, 0, 1],
        "N" => [1, 1, -2, 0, 0],
        "A/m" => [0, -1, 0, 1, 0],
        "A/(m s)" => [0, -1, -1, 1, 0],
        "m/(A/m)" => [0, 2, 0, -1, 0],
        "1/(A/m)" => [0, 1, 0, -1, 0],
        "1/(A/m)^2" => [0, 2, 0, -2, 0],
        _ => return None,
    };
    Some([("kg", kg), ("m", m), ("s", s), ("A", a), ("K", k)])
}

#[cfg(test)]
mod tests {
    use super::exponents;
    use anhyst_ipc::Channel;

    /// Guards the table: a message's new unit must be in it, or an FMU's variable would have none.
    #[test]
    fn every_unit_of_a_message_is_known() {
        for field in Channel::ALL.iter().flat_map(|channel| channel.fields()) {
            assert!(
                field.unit.is_empty() || exponents(field.unit).is_some(),
                "{}: {}",
                field.name,
                field.unit
            );
        }
    }
}
