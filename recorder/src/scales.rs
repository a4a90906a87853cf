//! In what units a run is drawn: those of people for a rod (kA/m, µm, nm), those of its law for another one.

/// A factor on a token's number, and the unit that it is then in.
#[derive(Debug, Clone, PartialEq)]
pub struct Scale {
    pub factor: f64,
    pub unit: String,
}

impl Scale {
    fn new(factor: f64, unit: impl Into<String>) -> Self {
        Self {
            factor,
            unit: unit.into(),
        }
    }
}

/// Of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Scales {
    /// What drives it: fields.
    pub input: Scale,
    /// What its hysteresis gives: magnetizations.
    pub response: Scale,
    /// What is measured.
    pub output: Scale,
    /// Errors of that.
    pub error: Scale,
    /// Its hysteresis is the domain wall's, with a parameter `a`.
    pub shape: bool,
}

impl Default for Scales {
    /// Of a magnetostrictive rod.
    fn default() -> Self {
        Self {
            input: Scale::new(1e-3, "kA/m"),
            response: Scale::new(1e-3, "kA/m"),
            output: Scale::new(1e6, "µm"),
            error: Scale::new(1e9, "nm"),
            shape: true,
        }
    }
}

impl Scales {
    /// Of another hysteresis law whose input and output are in these SI units.
    pub fn of_law(input: &str, output: &str) -> Self {
        let (shown, error) = if output == "m" {
            (Scale::new(1e6, "µm"), Scale::new(1e9, "nm"))
        } else {
            (Scale::new(1.0, output), Scale::new(1e3, format!("m{output}")))
        };
        Self {
            input: Scale::new(1.0, input),
            response: shown.clone(),
            output: shown,
            error,
            shape: false,
        }
    }

    /// Names of the axes of input, response and output.
    pub(crate) fn axes(&self) -> [String; 3] {
        let words = if self.shape {
            ["field H", "magnetization M", "displacement"]
        } else {
            ["input", "output of the law", "measured"]
        };
        let [input, response, output] = words;
        [
            format!("{input} [{}]", self.input.unit),
            format!("{response} [{}]", self.response.unit),
            format!("{output} [{}]", self.output.unit),
        ]
    }
}
