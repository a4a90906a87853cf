//! One value of a scenario that varies: `path=a..b:n`, the same evenly in the logarithm, `path=a..b:n:log`, or `path=[v, v, …]`.

use anhyst_scenario::{Setting, items};
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;
use std::str::FromStr;

/// More of one value are asked for by mistake.
const MOST_VALUES: u64 = 1_000_000;

/// A path, as that of `--set`, and its values.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Variation {
    /// Field names joined by dots.
    pub path: String,
    /// As RON, in their order.
    pub values: Vec<String>,
    /// Evenly in the logarithm.
    pub logarithmic: bool,
}

/// How the values of a variation are told in a table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Whole numbers.
    Integer,
    /// Numbers.
    Number,
    /// Anything else, as RON.
    Text,
}

impl Variation {
    /// The setting that makes a run have its value at this place.
    pub fn setting(&self, place: usize) -> Setting {
        Setting {
            path: self.path.clone(),
            value: self.values[place].clone(),
        }
    }

    /// What all values have in common.
    pub fn kind(&self) -> Kind {
        let all = |is: fn(&String) -> bool| self.values.iter().all(is);
        if all(|value| value.parse::<i64>().is_ok()) {
            Kind::Integer
        } else if all(|value| value.parse::<f64>().is_ok()) {
            Kind::Number
        } else {
            Kind::Text
        }
    }

    /// As numbers, if they are.
    pub fn numbers(&self) -> Option<Vec<f64>> {
        let numbers = self.values.iter().map(|value| value.parse().ok());
        numbers.collect::<Option<_>>().filter(|_| self.kind() != Kind::Text)
    }
}

impl FromStr for Variation {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let Setting { path, value } = text.parse()?;
        if path == "seed" {
            return Err("seed is varied by --seeds N, from the scenario's own on".into());
        }
        let (values, logarithmic) = if value.starts_with('[') {
            let items = items(&value).ok_or_else(|| format!("{value} is no list; write {path}=[value, value]"))?;
            (items.into_iter().map(str::to_owned).collect(), false)
        } else {
            let range = Range::read(&value).map_err(|sentence| format!("{text}: {sentence}"))?;
            (range.values(), range.logarithmic)
        };
        if values.is_empty() {
            return Err(format!("{text} has no value"));
        }
        let mut known = BTreeSet::new();
        if let Some((place, value)) = (1..).zip(&values).find(|(_, value)| !known.insert(*value)) {
            return Err(format!(
                "{text} has the value {value} twice, the second time at place {place}"
            ));
        }
        Ok(Self {
            path,
            values,
            logarithmic,
        })
    }
}

/// Ends and how many values from one to the other, both among them.
struct Range {
    from: f64,
    to: f64,
    count: u64,
    logarithmic: bool,
    /// Whole ends and a whole step: the values are written as whole numbers, which suit counts, too.
    whole: bool,
}

const FORM: &str = "write path=FROM..TO:COUNT, path=FROM..TO:COUNT:log or path=[value, value]";

impl Range {
    fn read(text: &str) -> Result<Self, String> {
        let (from, rest) = text.split_once("..").ok_or_else(|| FORM.to_owned())?;
        let (to, rest) = rest
            .split_once(':')
            .ok_or_else(|| format!("how many values from {from} to {rest} is not said; {FORM}"))?;
        let (count, logarithmic) = match rest.split_once(':') {
            None => (rest, false),
            Some((count, "log")) => (count, true),
            Some((_, other)) => return Err(format!("after the count stands {other}; only log may: {FORM}")),
        };
        let number = |text: &str| match text.trim().parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(number),
            _ => Err(format!("{text} is no number; {FORM}")),
        };
        let count = count
            .trim()
            .parse::<u64>()
            .ok()
            .filter(|count| (2..=MOST_VALUES).contains(count))
            .ok_or_else(|| format!("{count} is no count from 2 to {MOST_VALUES}"))?;
        let whole = |text: &str| text.trim().parse::<i64>();
        let (from_text, to_text) = (from, to);
        let (from, to) = (number(from)?, number(to)?);
        if from == to {
            return Err(format!("both ends are {from}"));
        }
        if logarithmic && from * to <= 0.0 {
            return Err(format!(
                "from {from} to {to} there is no even step in the logarithm: both must be above 0, or both below"
            ));
        }
        let whole = match (whole(from_text), whole(to_text)) {
            (Ok(from), Ok(to)) => !logarithmic && to.abs_diff(from) % (count - 1) == 0,
            _ => false,
        };
        Ok(Self {
            from,
            to,
            count,
            logarithmic,
            whole,
        })
    }

    fn values(&self) -> Vec<String> {
        (0..self.count).map(|index| self.value(index)).collect()
    }

    fn value(&self, index: u64) -> String {
        let (from, to) = (self.from, self.to);
        let share = index as f64 / (self.count - 1) as f64;
        let value = match index {
            0 => from,
            last if last + 1 == self.count => to,
            // `libm`, so that every machine has the same values.
            _ if self.logarithmic => rounded(from * libm::pow(to / from, share)),
            _ => rounded(from + (to - from) * share),
        };
        if self.whole {
            format!("{value:.0}")
        } else {
            format!("{value:?}")
        }
    }
}

/// To twelve digits: 0.3, not 0.30000000000000004.
fn rounded(value: f64) -> f64 {
    format!("{value:.11e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    //! Guards what is run: values that are asked for, written so that RON takes them, and sentences for what is no such thing.
    use super::*;

    fn values(text: &str) -> Vec<String> {
        text.parse::<Variation>().unwrap().values
    }

    #[test]
    fn ranges_and_lists_are_taken_apart() {
        for (text, wanted) in [
            ("a.b=0..0.4:5", &["0.0", "0.1", "0.2", "0.3", "0.4"][..]),
            ("a=1e-9..1e-7:3:log", &["1e-9", "1e-8", "1e-7"]),
            ("a=-1..-100:3:log", &["-1.0", "-10.0", "-100.0"]),
            ("a=8..2:4", &["8", "6", "4", "2"]),
            ("a=1..2:3", &["1.0", "1.5", "2.0"]),
            ("a=[1.0, (b: [1, 2]), None]", &["1.0", "(b: [1, 2])", "None"]),
        ] {
            assert_eq!(values(text), wanted, "{text}");
        }
        let kind = |text: &str| text.parse::<Variation>().unwrap().kind();
        assert_eq!(
            [kind("a=8..2:4"), kind("a=1..2:3"), kind("a=[1, x]")],
            [Kind::Integer, Kind::Number, Kind::Text]
        );
    }

    #[test]
    fn what_is_no_variation_is_refused() {
        for (text, word) in [
            ("a", "no '='"),
            ("a=1..2", "how many values"),
            ("a=1", "FROM..TO:COUNT"),
            ("a=1..2:1", "1 is no count from 2"),
            ("a=1..2:2:lin", "lin"),
            ("a=0..2:2:log", "logarithm"),
            ("a=x..2:2", "x is no number"),
            ("a=1..inf:2", "inf is no number"),
            ("a=2..2:2", "both ends"),
            ("a=[1, 2", "no list"),
            ("a=[]", "no value"),
            ("a=[1, 2, 1]", "the value 1 twice"),
            ("seed=1..2:2", "--seeds"),
        ] {
            let said = text.parse::<Variation>().unwrap_err();
            assert!(said.contains(word), "{text}: {said}");
        }
    }
}
