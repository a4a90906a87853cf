//! What a sweep is, as it stands in its folder: resuming and gathering compare it.

use crate::error::SweepError;
use crate::plan::Plan;
use crate::shard::Shard;
use crate::variation::Variation;
use anhyst_scenario::Scenario;
use serde::{Deserialize, Serialize};
use serde_json::Value;

/// `sweep.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// Of the program: another may have other bits.
    pub version: String,
    /// What varies.
    pub variations: Vec<Variation>,
    /// Runs at each combination of values.
    pub seeds: u64,
    /// Of the first of them.
    pub first_seed: u64,
    /// Which of all runs.
    pub shard: Shard,
    /// The effective scenario that the values are set in.
    pub scenario: Value,
}

impl Manifest {
    /// Of a sweep of this program.
    ///
    /// # Errors
    /// If a scenario has no JSON form; ours have.
    pub fn new(plan: &Plan, shard: Shard, scenario: &Scenario) -> Result<Self, SweepError> {
        let told = serde_json::to_value(scenario);
        Ok(Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            variations: plan.variations().to_vec(),
            seeds: plan.seeds(),
            first_seed: plan.seed(0),
            shard,
            scenario: told.map_err(|error| SweepError::Refused(error.to_string()))?,
        })
    }

    /// Its runs.
    ///
    /// # Errors
    /// If it has been meddled with.
    pub fn plan(&self) -> Result<Plan, SweepError> {
        Plan::new(self.variations.clone(), self.seeds, self.first_seed)
    }

    /// The scenario's name.
    pub fn name(&self) -> &str {
        self.scenario["name"].as_str().unwrap_or_default()
    }

    /// The first thing in which a sweep that is asked for differs from this one, which is there, whichever shards they are.
    pub fn difference(&self, asked: &Self) -> Option<String> {
        let differ = |what: &str, there: &dyn ToString, asked: &dyn ToString| {
            let (there, asked) = (there.to_string(), asked.to_string());
            (there != asked).then(|| format!("{what} is {there} there, and {asked} is asked for"))
        };
        let of_program = differ("the program's version", &self.version, &asked.version);
        let of_scenario = || unlike("", &self.scenario, &asked.scenario);
        let of_seeds = || differ("--seeds", &self.seeds, &asked.seeds);
        of_program
            .or_else(|| self.other_variation(asked))
            .or_else(of_seeds)
            .or_else(of_scenario)
    }

    fn other_variation(&self, asked: &Self) -> Option<String> {
        let paths = |own: &Self| -> Vec<String> { own.variations.iter().map(|one| one.path.clone()).collect() };
        let named = |own: &Self| match paths(own) {
            none if none.is_empty() => "nothing".to_owned(),
            paths => paths.join(", "),
        };
        if paths(self) != paths(asked) {
            return Some(format!("there {} varies, and here {}", named(self), named(asked)));
        }
        let pairs = self.variations.iter().zip(&asked.variations);
        let (there, asked) = pairs.into_iter().find(|(there, asked)| there.values != asked.values)?;
        let told = |own: &Variation| match &own.values[..] {
            [first, .., last] => format!("{} values from {first} to {last}", own.values.len()),
            all => all.join(", "),
        };
        let place = there
            .values
            .iter()
            .zip(&asked.values)
            .position(|(one, other)| one != other);
        let first = place.map_or_else(String::new, |place| {
            let (one, other) = (&there.values[place], &asked.values[place]);
            format!("; at place {} {one} there, {other} here", place + 1)
        });
        let path = &there.path;
        Some(format!(
            "{path} has {} there, and {} here{first}",
            told(there),
            told(asked)
        ))
    }
}

/// The path of the first value of two texts that differs, and both values.
fn unlike(path: &str, there: &Value, asked: &Value) -> Option<String> {
    let below = |name: &str| match path {
        "" => name.to_owned(),
        path => format!("{path}.{name}"),
    };
    match (there, asked) {
        (Value::Object(there), Value::Object(asked)) => {
            let names = there
                .keys()
                .chain(asked.keys().filter(|name| !there.contains_key(*name)));
            let value = |of: &serde_json::Map<String, Value>, name: &String| of.get(name).cloned().unwrap_or_default();
            names
                .into_iter()
                .find_map(|name| unlike(&below(name), &value(there, name), &value(asked, name)))
        }
        (Value::Array(there), Value::Array(asked)) if there.len() == asked.len() => {
            let pairs = there.iter().zip(asked).enumerate();
            pairs
                .into_iter()
                .find_map(|(place, (there, asked))| unlike(&below(&place.to_string()), there, asked))
        }
        _ if there == asked => None,
        _ => Some(format!(
            "{path} is {} there, and {} is asked for",
            short(there),
            short(asked)
        )),
    }
}

/// A value in a few letters.
fn short(value: &Value) -> String {
    let text = value.to_string();
    match text.char_indices().nth(80) {
        Some((end, _)) => format!("{}…", &text[..end]),
        None => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn manifest(vary: &[&str], seeds: u64, scenario: Value) -> Manifest {
        Manifest {
            version: "1".into(),
            variations: vary.iter().map(|text| text.parse().unwrap()).collect(),
            seeds,
            first_seed: 1,
            shard: Shard::WHOLE,
            scenario,
        }
    }

    /// Guards folders that hold hours of work: the sentence must name what differs, with both values.
    #[test]
    fn what_differs_is_named() {
        let scenario = |kp: f64, list: Value| json!({"name": "x", "controller": {"kp": kp, "list": list}});
        let there = manifest(&["a=1..3:3"], 2, scenario(0.3, json!([1, 2])));
        let same = || scenario(0.3, json!([1, 2]));
        assert_eq!(there.difference(&there), None);
        let shard = Shard { number: 2, of: 3 };
        assert_eq!(there.difference(&Manifest { shard, ..there.clone() }), None);
        for (asked, words) in [
            (
                manifest(&["a=1..3:3"], 3, same()),
                &["--seeds is 2 there", "3 is asked"][..],
            ),
            (
                manifest(&["a=[1, 4, 3]"], 2, same()),
                &["a has 3 values", "at place 2 2 there, 4 here"],
            ),
            (manifest(&["b=1..3:3"], 2, same()), &["there a varies", "here b"]),
            (manifest(&[], 2, same()), &["here nothing"]),
            (
                manifest(&["a=1..3:3"], 2, scenario(0.4, json!([1, 2]))),
                &["controller.kp is 0.3 there", "0.4"],
            ),
            (
                manifest(&["a=1..3:3"], 2, scenario(0.3, json!([1, 5]))),
                &["controller.list.1 is 2"],
            ),
            (
                manifest(&["a=1..3:3"], 2, scenario(0.3, json!([1]))),
                &["controller.list is [1,2]"],
            ),
            (
                Manifest {
                    version: "2".into(),
                    ..there.clone()
                },
                &["version is 1"],
            ),
        ] {
            let said = there.difference(&asked).unwrap();
            for word in words {
                assert!(said.contains(word), "{word}: {said}");
            }
        }
    }
}
