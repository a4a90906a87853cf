//! An axis: its ends, the prefix of its unit, and round ticks.

use super::axis::Axis;
use crate::number;

/// Other units stay as they are within these magnitudes.
const PLAIN: std::ops::Range<f64> = 1e-2..1e5;
/// Base units stay without a prefix from here on: 0.5 T rather than 500 mT.
const MIN_BASE: f64 = 0.1;

/// Where values stand along an axis, and what is written there.
pub(crate) struct Scale {
    /// Ends in the unit, or their logarithms to base ten.
    low: f64,
    high: f64,
    logarithmic: bool,
    pub label: String,
    /// Share of the axis, and text.
    pub ticks: Vec<(f64, String)>,
}

impl Scale {
    /// An axis of so many pixels with a tick about every `spacing`, and `room` beyond the data as a share of them.
    pub fn new(axis: &Axis, values: impl Iterator<Item = f64>, room: f64, pixels: f64, spacing: f64) -> Self {
        let position = |value: f64| if axis.logarithmic { value.log10() } else { value };
        let (low, high) = match axis.range {
            Some((low, high)) => (position(low), position(high)),
            None => roomy(extremes(values.map(position)), room),
        };
        let (low, high) = if low.is_finite() && high.is_finite() && low < high {
            (low, high)
        } else {
            (0.0, 1.0)
        };
        let wanted = (pixels / spacing).max(2.0);
        let (unit, ticks) = if axis.logarithmic {
            let (exponent, unit) = middle(&axis.unit, low, high);
            (unit, decades(low, high, exponent, wanted))
        } else {
            let (exponent, unit) = prefixed(&axis.unit, low.abs().max(high.abs()));
            (unit, round_ticks(low, high, exponent, wanted))
        };
        let share = |at: f64| (at - low) / (high - low);
        Scale {
            low,
            high,
            logarithmic: axis.logarithmic,
            label: label(axis, &unit),
            ticks: ticks.into_iter().map(|(at, text)| (share(at), text)).collect(),
        }
    }

    /// Share of the axis at which a value stands; not finite for one that cannot be drawn.
    pub fn share(&self, value: f64) -> f64 {
        let at = match self.logarithmic {
            true if value > 0.0 => value.log10(),
            true => f64::NAN,
            false => value,
        };
        (at - self.low) / (self.high - self.low)
    }
}

fn extremes(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (low.min(value), high.max(value))
        })
}

/// Ends a little beyond the data; a single value gets room on both sides.
fn roomy((low, high): (f64, f64), room: f64) -> (f64, f64) {
    let span = high - low;
    if span > 1e-12 * low.abs().max(high.abs()) {
        (low - room * span, high + room * span)
    } else {
        let half = if low == 0.0 { 1.0 } else { 0.1 * low.abs() };
        (low - half, high + half)
    }
}

/// The power of ten that is taken out of an axis whose values are of these sizes, and its label.
pub(crate) fn labelled(axis: &Axis, sizes: impl Iterator<Item = f64>) -> (i32, String) {
    let used = sizes.map(f64::abs).filter(|size| !axis.logarithmic || *size > 0.0);
    let (low, high) = extremes(used);
    let (exponent, unit) = match axis.logarithmic {
        true => middle(&axis.unit, low.log10(), high.log10()),
        false => prefixed(&axis.unit, high.max(0.0)),
    };
    (exponent, label(axis, &unit))
}

/// Of an axis over decades, whose ends are logarithms, the prefix of the middle.
fn middle(unit: &str, low: f64, high: f64) -> (i32, String) {
    match number::takes_prefix(unit) {
        true => number::prefixed(unit, 10_f64.powf(0.5 * (low + high))),
        false => (0, unit.to_owned()),
    }
}

fn label(axis: &Axis, unit: &str) -> String {
    match unit {
        "" => axis.name.clone(),
        unit => format!("{}, {unit}", axis.name),
    }
}

/// Power of ten that is taken out of the values, and the unit that says so.
fn prefixed(unit: &str, largest: f64) -> (i32, String) {
    if number::takes_prefix(unit) {
        return match largest {
            0.0 => (0, unit.to_owned()),
            largest if (MIN_BASE..1.0).contains(&largest) => (0, unit.to_owned()),
            largest => number::prefixed(unit, largest),
        };
    }
    if PLAIN.contains(&largest) || largest == 0.0 {
        return (0, unit.to_owned());
    }
    let power = 3 * (largest.max(1e-300).log10() / 3.0).floor() as i32;
    (power, format!("10{} {unit}", superscript(power)).trim_end().to_owned())
}

/// Multiples of 1, 2, 2.5 or 5 times a power of ten.
fn round_ticks(low: f64, high: f64, exponent: i32, wanted: f64) -> Vec<(f64, String)> {
    let unit = 10_f64.powi(exponent);
    let least = (high - low) / unit / wanted;
    let power = least.log10().floor() as i32;
    let mantissas = [1.0, 2.0, 2.5, 5.0, 10.0];
    let mantissa = mantissas
        .into_iter()
        .find(|mantissa| mantissa * 10_f64.powi(power) >= least * (1.0 - 1e-9));
    let mantissa = mantissa.unwrap_or(10.0);
    let step = mantissa * 10_f64.powi(power);
    let decimals = (-power).max(0) as usize + usize::from(mantissa == 2.5 && power <= 0);
    let decimals = decimals - usize::from(mantissa == 10.0 && power < 0);
    let (first, last) = (
        (low / unit / step - 1e-9).ceil() as i64,
        (high / unit / step + 1e-9).floor() as i64,
    );
    (first..=last)
        .map(|count| {
            let value = count as f64 * step;
            (value * unit, format!("{value:.decimals$}").replace('-', "−"))
        })
        .collect()
}

/// Powers of ten; with few of them 2 and 5 times each as well.
fn decades(low: f64, high: f64, exponent: i32, wanted: f64) -> Vec<(f64, String)> {
    let (first, last) = (low.floor() as i32, high.ceil() as i32);
    let every = ((high - low) / wanted).ceil().max(1.0) as i32;
    let mantissas: &[f64] = if high - low < 2.0 { &[1.0, 2.0, 5.0] } else { &[1.0] };
    let powers = (first..=last).filter(|power| power.rem_euclid(every) == 0);
    let all = powers.flat_map(|power| mantissas.iter().map(move |mantissa| (*mantissa, power)));
    all.map(|(mantissa, power)| (f64::from(power) + mantissa.log10(), decade(mantissa, power - exponent)))
        .filter(|(at, _)| *at >= low - 1e-9 && *at <= high + 1e-9)
        .collect()
}

fn decade(mantissa: f64, power: i32) -> String {
    match power {
        0..=3 => format!("{}", mantissa * 10_f64.powi(power)),
        -3..=-1 => format!("{:.*}", -power as usize, mantissa * 10_f64.powi(power)),
        _ if mantissa == 1.0 => format!("10{}", superscript(power)),
        _ => format!("{mantissa}·10{}", superscript(power)),
    }
}

fn superscript(number: i32) -> String {
    let raise = |letter: char| match letter {
        '-' => '⁻',
        digit => ['⁰', '¹', '²', '³', '⁴', '⁵', '⁶', '⁷', '⁸', '⁹'][digit.to_digit(10).unwrap_or(0) as usize],
    };
    number.to_string().chars().map(raise).collect()
}

#[cfg(test)]
mod tests {
    //! Guards what is written beside an axis: a tick off by a prefix is off by a thousand.
    use super::*;

    fn texts(axis: &Axis, low: f64, high: f64) -> (String, Vec<String>) {
        let scale = Scale::new(axis, [low, high].into_iter(), 0.0, 400.0, 80.0);
        (scale.label, scale.ticks.into_iter().map(|(_, text)| text).collect())
    }

    #[test]
    fn values_take_the_prefix_that_makes_them_small_numbers() {
        let is = |name: &str, unit: &str, ends: (f64, f64), label: &str, ticks: &[&str]| {
            let (found, texts) = texts(&Axis::new(name, unit), ends.0, ends.1);
            assert_eq!((found.as_str(), texts.join(" ")), (label, ticks.join(" ")));
        };
        is(
            "displacement",
            "m",
            (-40e-6, 40e-6),
            "displacement, µm",
            &["−40", "−20", "0", "20", "40"],
        );
        is(
            "field",
            "A/m",
            (0.0, 12_000.0),
            "field, kA/m",
            &["0.0", "2.5", "5.0", "7.5", "10.0"],
        );
        is(
            "flux density",
            "T",
            (0.0, 0.5),
            "flux density, T",
            &["0.0", "0.1", "0.2", "0.3", "0.4", "0.5"],
        );
        is(
            "a",
            "A/m",
            (990.0, 999.0),
            "a, A/m",
            &["990", "992", "994", "996", "998"],
        );
        is("gap", "%", (0.0, 4.0), "gap, %", &["0", "1", "2", "3", "4"]);
        is(
            "strain",
            "",
            (0.0, 1.5e-3),
            "strain, 10⁻³",
            &["0.0", "0.5", "1.0", "1.5"],
        );
        is(
            "sample",
            "",
            (0.0, 40_000.0),
            "sample",
            &["0", "10000", "20000", "30000", "40000"],
        );
    }

    #[test]
    fn logarithmic_axes_stand_on_decades() {
        let axis = Axis::new("frequency", "Hz").logarithmic();
        assert_eq!(texts(&axis, 0.1, 5000.0).1, ["0.1", "1", "10", "100", "1000"]);
        assert_eq!(texts(&axis, 1.5, 60.0).1, ["2", "5", "10", "20", "50"]);
        let share = Axis::new("share", "").logarithmic();
        assert_eq!(
            texts(&share, 1e-9, 1e6).1,
            ["10⁻⁹", "10⁻⁶", "0.001", "1", "1000", "10⁶"]
        );
        let error = Axis::new("error", "m").logarithmic();
        let ticks = ["1", "10", "100", "1000"].map(str::to_owned).to_vec();
        assert_eq!(texts(&error, 1e-9, 1e-6), ("error, nm".to_owned(), ticks));
        assert_eq!(
            labelled(&error, [0.0, 1e-9, 1e-6].into_iter()),
            (-9, "error, nm".to_owned())
        );
        let scale = Scale::new(&axis, [1.0, 100.0].into_iter(), 0.0, 400.0, 80.0);
        assert!((scale.share(10.0) - 0.5).abs() < 1e-12 && scale.share(-1.0).is_nan());
    }

    #[test]
    fn nothing_and_a_single_value_still_have_an_axis() {
        assert_eq!(texts(&Axis::new("x", ""), f64::NAN, f64::NAN).1.len(), 6);
        assert!(texts(&Axis::new("x", "m"), 3.0, 3.0).1.contains(&"3.0".to_owned()));
        let inverted = Axis::new("x", "").between(2.0, 1.0);
        assert_eq!(texts(&inverted, 0.0, 1.0).1.len(), 6);
    }
}
