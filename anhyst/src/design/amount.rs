//! A number with its unit, as a person writes it: `80um`, `20 kHz`, `0.4T`, `1e-5m`.

const PREFIXES: [(&str, f64); 9] = [
    ("n", 1e-9),
    ("u", 1e-6),
    ("µ", 1e-6),
    ("μ", 1e-6),
    ("m", 1e-3),
    ("k", 1e3),
    ("M", 1e6),
    ("G", 1e9),
    ("c", 1e-2),
];

/// The number in `unit`.
///
/// # Errors
/// A sentence, if it is none, not positive, or in another unit.
pub fn amount(option: &str, text: &str, unit: &str) -> Result<f64, String> {
    let refuse = || {
        let with = if unit.is_empty() { "" } else { " with its unit, " };
        let example = match option {
            "--length" | "--diameter" => "115mm",
            "--noise" if unit == "m" => "10nm",
            _ => example(unit),
        };
        format!("{option} {text}: give a positive number{with}{unit}, as in {option} {example}")
    };
    let text = text.trim();
    let (number, prefix) = match text.strip_suffix(unit) {
        None => return Err(refuse()),
        Some(before) => {
            let before = before.trim_end();
            let prefix = PREFIXES.iter().find(|(prefix, _)| before.ends_with(prefix));
            let prefix = prefix.map_or("", |(prefix, _)| *prefix);
            (before[..before.len() - prefix.len()].trim_end(), prefix)
        }
    };
    let factor = PREFIXES
        .iter()
        .find(|(own, _)| *own == prefix)
        .map_or(1.0, |(_, factor)| *factor);
    let number: f64 = number.parse().map_err(|_| refuse())?;
    // Divided where that is exact: 10 nm are 1e-8, and not the next number.
    let value = if factor < 1.0 {
        number / factor.recip().round()
    } else {
        number * factor
    };
    if value > 0.0 && value.is_finite() {
        Ok(value)
    } else {
        Err(refuse())
    }
}

fn example(unit: &str) -> &'static str {
    match unit {
        "m" => "80um",
        "T" => "0.4T",
        "Hz" => "50Hz",
        "A/m" => "30kA/m",
        "V" => "120V",
        "kg" => "0.5kg",
        "Pa" => "30e9Pa",
        "kg/m3" => "9250kg/m3",
        _ => "10",
    }
}

/// The next of 1, 2, 5 times a power of ten that is not below.
pub fn nice_up(value: f64) -> f64 {
    nice(value, |step, value| step >= value * (1.0 - 1e-9))
}

/// The last that is not above.
pub fn nice_down(value: f64) -> f64 {
    let up = nice_up(value);
    if up <= value * (1.0 + 1e-9) {
        return up;
    }
    let decade = 10_f64.powf(value.log10().floor());
    [5.0, 2.0, 1.0]
        .map(|step| round(step * decade, 1))
        .into_iter()
        .find(|step| *step <= value)
        .unwrap_or(up)
}

fn nice(value: f64, fits: impl Fn(f64, f64) -> bool) -> f64 {
    let decade = 10_f64.powf(value.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| round(step * decade, 1));
    steps.into_iter().find(|step| fits(*step, value)).unwrap_or(value)
}

/// To so many significant digits.
pub fn round(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits - 1).parse().unwrap_or(value)
}

/// The same, not below the value.
pub fn round_up(value: f64, digits: usize) -> f64 {
    let near = round(value, digits);
    if near >= value {
        return near;
    }
    let unit = 10_f64.powf(value.log10().floor() + 1.0 - digits as f64);
    round(near + unit, digits)
}

/// As a scenario has it.
pub fn ron(value: f64) -> String {
    if value == 0.0 || (1e-2..1e6).contains(&value.abs()) {
        format!("{value:?}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // Guards prefixes: `m` before a unit is a thousandth, and is metres alone.
    #[test]
    fn numbers_are_read_with_their_units() {
        for (text, unit, value) in [
            ("80um", "m", 80e-6),
            ("80 µm", "m", 80e-6),
            ("0.08mm", "m", 0.08e-3),
            ("2m", "m", 2.0),
            ("1e-5m", "m", 1e-5),
            ("3", "", 3.0),
            ("10nm", "m", 1e-8),
            ("0.4T", "T", 0.4),
            ("200mT", "T", 0.2),
            ("20kHz", "Hz", 2e4),
            ("30 kA/m", "A/m", 3e4),
            ("12.5MPa", "Pa", 12.5e6),
        ] {
            let read = amount("--x", text, unit).unwrap();
            assert!((read / value - 1.0).abs() < 1e-15, "{text}: {read}");
        }
        for (text, unit) in [
            ("80V", "m"),
            ("-1um", "m"),
            ("0Hz", "Hz"),
            ("120", "V"),
            ("nan", "Hz"),
            ("", "m"),
            ("um", "m"),
            ("kHz", "Hz"),
        ] {
            assert!(amount("--x", text, unit).unwrap_err().contains("--x"), "{text}");
        }
        let said = amount("--limit", "120", "V").unwrap_err();
        for words in ["--limit 120:", "with its unit, V", "--limit 120V"] {
            assert!(said.contains(words), "{said}");
        }
    }

    #[test]
    fn rounding_goes_where_it_says() {
        assert_eq!(
            [nice_up(19_125.0), nice_up(20_000.0), nice_up(2.1e-9), nice_up(60.0)],
            [2e4, 2e4, 5e-9, 100.0]
        );
        assert_eq!(
            [nice_down(51.0), nice_down(50.0), nice_down(1.9e-9), nice_down(0.99)],
            [50.0, 50.0, 1e-9, 0.5]
        );
        assert_eq!(
            [round_up(1.201e-8, 2), round_up(1.2e-8, 2), round_up(9.96e-9, 2)],
            [1.3e-8, 1.2e-8, 1e-8]
        );
        assert_eq!(
            [ron(5e-5), ron(3e4), ron(0.3), ron(0.0), ron(1e9)],
            ["5e-5", "30000.0", "0.3", "0.0", "1e9"]
        );
    }
}
