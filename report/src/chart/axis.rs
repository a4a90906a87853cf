//! What stands along a side of a chart: a name, a unit, and which values.

/// What is drawn along one side.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    pub name: String,
    /// SI unit, which takes a prefix (`m`, `A/m`, `s`), or any other, which takes none (`%`, `ppm`, `dB`), or nothing.
    pub unit: String,
    pub logarithmic: bool,
    /// Ends in the unit; those of the data if none.
    pub range: Option<(f64, f64)>,
}

impl Axis {
    pub fn new(name: &str, unit: &str) -> Self {
        Axis {
            name: name.to_owned(),
            unit: unit.to_owned(),
            logarithmic: false,
            range: None,
        }
    }

    #[must_use]
    pub fn logarithmic(mut self) -> Self {
        self.logarithmic = true;
        self
    }

    #[must_use]
    pub fn between(mut self, low: f64, high: f64) -> Self {
        self.range = Some((low, high));
        self
    }

    /// Whether it is the time of a run.
    pub fn is_time(&self) -> bool {
        (self.name.as_str(), self.unit.as_str()) == ("time", "s")
    }
}

/// "field, A/m": a name and its unit.
impl From<&str> for Axis {
    fn from(text: &str) -> Self {
        match text.rsplit_once(", ") {
            Some((name, unit)) => Axis::new(name, unit),
            None => Axis::new(text, ""),
        }
    }
}
