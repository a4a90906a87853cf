//! Numbers as people read them: so many significant digits, an SI prefix, a minus that is one.

use std::fmt::{Display, Formatter};

/// Powers of ten with an SI prefix.
const PREFIXES: [(i32, &str); 9] = [
    (-15, "f"),
    (-12, "p"),
    (-9, "n"),
    (-6, "µ"),
    (-3, "m"),
    (0, ""),
    (3, "k"),
    (6, "M"),
    (9, "G"),
];
/// Units that take a prefix, alone or before a stroke: m, m/s, A/m.
const PREFIXED: [&str; 11] = ["m", "s", "Hz", "A", "V", "N", "T", "W", "J", "Pa", "K"];

/// A value with a prefix before its unit, four significant digits: `Si(3.11e-6, "m")` is "3.110 µm". Strain (`m/m`) comes
/// in parts per million; a unit that takes no prefix (`%`, `dB`) stays. `{:#}` as in [`Digits`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Si<'a>(pub f64, pub &'a str);

/// A value in so many significant digits; below a thousandth and from a million on as a power of ten. `{:#}` leaves out zeros
/// that say nothing, for limits and counts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Digits(pub f64, pub usize);

impl Display for Si<'_> {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let Si(value, unit) = *self;
        if unit == "m/m" {
            return write!(formatter, "{} ppm", Digits(1e6 * value, 4));
        }
        let (exponent, unit) = match takes_prefix(unit) {
            true => prefixed(unit, value.abs()),
            false => (0, unit.to_owned()),
        };
        let digits = Digits(value * 10_f64.powi(-exponent), 4);
        let text = match formatter.alternate() {
            true => format!("{digits:#} {unit}"),
            false => format!("{digits} {unit}"),
        };
        formatter.write_str(text.trim_end())
    }
}

impl Display for Digits {
    fn fmt(&self, formatter: &mut Formatter<'_>) -> std::fmt::Result {
        let Digits(value, digits) = *self;
        // Rounded first: 0.99999 has as many decimals as 1.
        let rounded = format!("{value:.*e}", digits.saturating_sub(1));
        let power = rounded
            .rsplit_once('e')
            .and_then(|(_, power)| power.parse::<i32>().ok());
        let text = match power {
            Some(power @ -3..6) if value != 0.0 => {
                format!("{value:.*}", (digits as i32 - 1 - power).max(0) as usize)
            }
            Some(_) if value != 0.0 => rounded,
            _ => value.to_string(),
        };
        let (digits, power) = text.split_at(text.find('e').unwrap_or(text.len()));
        let text = match formatter.alternate() && digits.contains('.') {
            true => digits.trim_end_matches('0').trim_end_matches('.').to_owned() + power,
            false => text,
        };
        formatter.write_str(&text.replace('-', "−"))
    }
}

/// A share in percent with so many decimals; what rounds to nothing has no sign.
pub fn percent(share: f64, decimals: usize) -> String {
    let text = format!("{:.decimals$} %", 100.0 * share);
    match text.strip_prefix('-') {
        Some(size) if size.contains(|digit: char| matches!(digit, '1'..='9')) => format!("−{size}"),
        Some(size) => size.to_owned(),
        None => text,
    }
}

/// Whether a prefix may stand before a unit.
pub(crate) fn takes_prefix(unit: &str) -> bool {
    PREFIXED.contains(&unit.split('/').next().unwrap_or_default())
}

/// The power of ten that makes a value a small number, and the unit with its prefix.
pub(crate) fn prefixed(unit: &str, size: f64) -> (i32, String) {
    let wanted = if size > 0.0 && size.is_finite() {
        // A value that rounds up to the next prefix is written with it.
        3 * ((size * (1.0 + 5e-5)).log10() / 3.0).floor() as i32
    } else {
        0
    };
    let wanted = wanted.clamp(-15, 9);
    let prefix = PREFIXES.iter().find(|(exponent, _)| *exponent == wanted);
    (wanted, format!("{}{unit}", prefix.map_or("", |(_, prefix)| prefix)))
}

#[cfg(test)]
mod tests {
    //! Guards what is read off: a prefix wrong by one is a factor of a thousand.
    use super::*;

    #[test]
    fn values_take_the_prefix_that_makes_them_small_numbers() {
        for (value, unit, text) in [
            (3.11e-6, "m", "3.110 µm"),
            (-250.04e-9, "m", "−250.0 nm"),
            (999.99e-9, "m", "1.000 µm"),
            (12_500.0, "A/m", "12.50 kA/m"),
            (0.0, "m", "0 m"),
            (4.2e-6, "m/m", "4.200 ppm"),
            (0.25, "%", "0.2500 %"),
            (7.0, "", "7.000"),
            (f64::NAN, "m", "NaN m"),
            (2e-18, "m", "0.002000 fm"),
        ] {
            assert_eq!(Si(value, unit).to_string(), text);
        }
        assert_eq!(format!("{:#}", Si(8e3, "Hz")), "8 kHz");
    }

    #[test]
    fn a_percentage_has_the_same_minus_and_none_at_zero() {
        for (share, decimals, text) in [(-0.0123, 1, "−1.2 %"), (-1e-5, 1, "0.0 %"), (0.5, 0, "50 %")] {
            assert_eq!(percent(share, decimals), text);
        }
    }

    #[test]
    fn digits_are_as_many_as_asked() {
        for (value, digits, text) in [
            (7012.0, 5, "7012.0"),
            (-0.0421, 5, "−0.042100"),
            (2.136e-10, 5, "2.1360e−10"),
            (1234567.0, 3, "1.23e6"),
            (f64::INFINITY, 3, "inf"),
        ] {
            assert_eq!(Digits(value, digits).to_string(), text);
        }
        let trimmed = [50.0, 5e-5, 0.25, 100.0, 0.0].map(|value| format!("{:#}", Digits(value, 5)));
        assert_eq!(trimmed, ["50", "5e−5", "0.25", "100", "0"]);
    }
}
