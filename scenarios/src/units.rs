//! What a scenario's numbers of field and displacement are in: another hysteresis law has other units.

use super::Scenario;
use serde::{Deserialize, Serialize};

/// Units of a run, and whether it is about the paper's `a`.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Units {
    /// Of what drives the actuator: tokens and settings that say A/m mean this.
    pub input: String,
    /// Of what it gives: tokens and settings that say m mean this.
    pub output: String,
    /// Its hysteresis is the domain wall's, with a parameter `a`.
    pub shape: bool,
}

impl Default for Units {
    /// Of a magnetostrictive rod.
    fn default() -> Self {
        Self {
            input: "A/m".into(),
            output: "m".into(),
            shape: true,
        }
    }
}

impl Units {
    /// What drives the actuator, as people call it.
    pub fn input_name(&self) -> &'static str {
        match &*self.input {
            "A/m" => "field in the coil",
            "V" => "voltage",
            "A" => "current",
            _ => "input",
        }
    }

    /// What it gives, as people call it.
    pub fn output_name(&self) -> &'static str {
        match &*self.output {
            "m" => "displacement",
            "T" => "flux density",
            "N" => "force",
            "A/m" => "magnetization",
            _ => "output",
        }
    }

    /// A sentence about a rod in the units of this actuator.
    pub fn reworded(&self, sentence: &str) -> String {
        if self.shape {
            return sentence.to_owned();
        }
        let of_input = sentence
            .replace("A/(m s)", &format!("{}/s", self.input))
            .replace("A/m", &self.input);
        let words = of_input.split(' ').map(|word| match word.strip_prefix('m') {
            Some(mark @ ("" | ":" | "," | ";" | ".")) => format!("{}{mark}", self.output),
            _ => word.to_owned(),
        });
        words.collect::<Vec<_>>().join(" ")
    }

    /// Of a message's number whose name there is `field` and whose unit is `unit`: what a law gives stands where a rod has its magnetization.
    pub fn of_message(&self, field: &str, unit: &str) -> String {
        if self.shape {
            return unit.to_owned();
        }
        let input = if field.contains("magnetization") {
            &self.output
        } else {
            &self.input
        };
        match unit {
            "m" => self.output.clone(),
            "A/m" => input.clone(),
            "A/(m s)" => format!("{input}/s"),
            "m/(A/m)" => format!("{}/({input})", self.output),
            "1/(A/m)" => format!("1/({input})"),
            "1/(A/m)^2" => format!("1/({input})^2"),
            other => other.to_owned(),
        }
    }
}

impl Scenario {
    /// What its numbers are in.
    pub fn units(&self) -> Units {
        self.material().map_or_else(
            |_| Units::default(),
            |material| {
                let [input, output] = material.units().map(str::to_owned);
                Units {
                    input,
                    output,
                    shape: material.law.is_none(),
                }
            },
        )
    }
}

#[cfg(test)]
mod tests {
    use super::Units;

    /// Guards refusals: a stage's limit is no field.
    #[test]
    fn sentences_are_about_the_actuator() {
        let magnet = Units {
            input: "V".into(),
            output: "T".into(),
            shape: false,
        };
        for (of_rod, of_magnet) in [
            ("-120 A/m must be greater than 0 A/m", "-120 V must be greater than 0 V"),
            (
                "needs 3 A/(m s): more than 2 m, or 1 m",
                "needs 3 V/s: more than 2 T, or 1 T",
            ),
        ] {
            assert_eq!(magnet.reworded(of_rod), of_magnet);
            assert_eq!(Units::default().reworded(of_rod), of_rod);
        }
    }
}
