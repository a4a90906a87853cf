//! One row of the table: name and unit, neutral value, bounds, scale, what is believed beforehand, how it is looked for.

/// What a parameter is to its model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ParameterRole {
    /// With every size at its identity the effect is absent; a nominal constant is absent from a search at its nominal value.
    Size {
        /// A value within the bounds.
        identity: f64,
    },
    /// Fitted beside the sizes; without meaning while the effect is absent.
    Shape,
    /// Hardly determined by ordinary data: stays at `typical` unless told otherwise, and may be left out of a model file.
    Fixed,
}

/// A signal of a run whose size tells at which levels a limit would bite.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signal {
    /// |H| of the drive.
    Drive,
    /// |dH/dt| of the drive.
    DriveRate,
    /// |y| of the output.
    Output,
}

/// Where a search begins with a number, and whether the output has a derivative in it there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Screening {
    /// Once, at the smallest value worth finding: the output answers smoothly.
    Once,
    /// A limit does nothing until it bites: at levels that a signal reaches. No derivative at the identity.
    Levels(Signal),
    /// Read off the lattice on which the measured values stand. No derivative anywhere, so it is never fitted.
    Lattice,
    /// Frequencies over the band of the run.
    Band,
    /// Frequencies at which the residual's spectrum peaks: chosen among as many as there are rows.
    Lines,
}

/// One number of a model.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterSpec {
    /// With its unit, `time_constant_s`, as it stands in files and reports.
    pub name: &'static str,
    /// SI; empty for a number without unit.
    pub unit: &'static str,
    /// Smallest value accepted.
    pub lower: f64,
    /// Largest value accepted.
    pub upper: f64,
    /// Smallest size worth finding (of an effect: at a noise of 20 nm), or the usual value of another parameter.
    pub typical: f64,
    /// Spread starting values by ratio between `typical` and `upper`, not evenly.
    pub logarithmic: bool,
    /// Size, shape or fixed.
    pub role: ParameterRole,
    /// Standard deviation of what is believed beforehand, about the identity; of a held number by ratio (if it spreads so) about its
    /// usual value. None: nothing is, and a held number stays where it is.
    pub prior_deviation: Option<f64>,
    /// Of a nominal constant: how far a careful data sheet or calibration is off, standard deviation.
    pub tolerance: Option<f64>,
    /// How it is looked for.
    pub screening: Screening,
}

impl ParameterSpec {
    /// A size whose identity is 0.
    pub(crate) const fn size(
        name: &'static str,
        unit: &'static str,
        [lower, upper]: [f64; 2],
        typical: f64,
    ) -> ParameterSpec {
        ParameterSpec {
            name,
            unit,
            lower,
            upper,
            typical,
            logarithmic: false,
            role: ParameterRole::Size { identity: 0.0 },
            prior_deviation: None,
            tolerance: None,
            screening: Screening::Once,
        }
    }

    /// A limit of a signal: at its upper bound it never bites.
    pub(crate) const fn limit(
        name: &'static str,
        unit: &'static str,
        [lower, upper]: [f64; 2],
        typical: f64,
        signal: Signal,
    ) -> ParameterSpec {
        ParameterSpec {
            logarithmic: true,
            role: ParameterRole::Size { identity: upper },
            screening: Screening::Levels(signal),
            ..Self::size(name, unit, [lower, upper], typical)
        }
    }

    pub(crate) const fn shape(name: &'static str, unit: &'static str, bounds: [f64; 2], typical: f64) -> ParameterSpec {
        ParameterSpec {
            role: ParameterRole::Shape,
            ..Self::size(name, unit, bounds, typical)
        }
    }

    pub(crate) const fn fixed(name: &'static str, unit: &'static str, bounds: [f64; 2], typical: f64) -> ParameterSpec {
        ParameterSpec {
            role: ParameterRole::Fixed,
            ..Self::size(name, unit, bounds, typical)
        }
    }

    pub(crate) const fn by_ratio(self) -> ParameterSpec {
        ParameterSpec {
            logarithmic: true,
            ..self
        }
    }

    pub(crate) const fn believed(self, deviation: f64) -> ParameterSpec {
        ParameterSpec {
            prior_deviation: Some(deviation),
            ..self
        }
    }

    pub(crate) const fn screened(self, screening: Screening) -> ParameterSpec {
        ParameterSpec { screening, ..self }
    }

    /// The row for an actuator whose input and output are so many times those of a rod of Terfenol-D. What absence means stays.
    pub(crate) fn sized(self, [input, output]: [f64; 2]) -> ParameterSpec {
        let factor = match self.unit {
            "A/m" | "A/(m s)" => input,
            "m" | "m/s" => output,
            "1/m²" => 1.0 / (output * output),
            _ => return self,
        };
        let (mut lower, mut upper) = (factor * self.lower, factor * self.upper);
        if self.is_limit() {
            upper = self.upper;
        } else if !self.is_fitted() {
            // May be left out of a file, and is the usual one then.
            (lower, upper) = (lower.min(self.lower), upper.max(self.upper));
        }
        ParameterSpec {
            lower,
            upper,
            typical: factor * self.typical,
            ..self
        }
    }

    /// The value at which it changes nothing; none unless it is a size.
    pub fn identity(&self) -> Option<f64> {
        match self.role {
            ParameterRole::Size { identity } => Some(identity),
            ParameterRole::Shape | ParameterRole::Fixed => None,
        }
    }

    /// The value where its effect is absent: the identity of a size, the usual value of another.
    pub fn neutral(&self) -> f64 {
        self.identity().unwrap_or(self.typical)
    }

    /// It is fitted where its effect is.
    pub fn is_fitted(&self) -> bool {
        self.role != ParameterRole::Fixed
    }

    /// It is fitted as its logarithm: a limit, or a shape whose size is unknown by decades. A size that may be 0 has none.
    pub fn is_fitted_by_ratio(&self) -> bool {
        self.is_limit() || (self.role == ParameterRole::Shape && self.logarithmic)
    }

    /// A limit: absent at its upper bound, without a smallest size.
    pub fn is_limit(&self) -> bool {
        matches!(self.screening, Screening::Levels(_))
    }
}
