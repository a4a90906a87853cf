//! a(t): the true course of the anhysteretic curve's shape parameter.
//!
//! `Constant` a; `Ramp` a = from + rate·t until `to`; `Thermal` a = a₀·T/T₀ (Langevin: a is proportional to the absolute
//! temperature). a in A/m, t in s from the start of the run, T rod temperature and T₀ its reference in K.
//! Source: the paper's section 5 lets `a` drift; the thermal course is the physics behind such a drift.

use anhyst_ipc::Invalid;
use serde::{Deserialize, Serialize};

/// Course of `a`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub enum ShapeCourse {
    /// Never changes.
    Constant {
        /// a, A/m.
        a_per_m: f64,
    },
    /// Drifts at a constant rate, then stays.
    Ramp {
        /// a at the start, A/m.
        from_a_per_m: f64,
        /// Drift, A/m per s; negative towards a smaller `to`.
        rate_a_per_m_s: f64,
        /// a at the end, A/m.
        to_a_per_m: f64,
    },
    /// Follows the rod's temperature.
    Thermal {
        /// a at the reference temperature, A/m.
        reference_a_per_m: f64,
        /// T₀, K.
        reference_temperature_k: f64,
    },
}

impl Default for ShapeCourse {
    /// The paper's `a`.
    fn default() -> Self {
        ShapeCourse::Constant { a_per_m: 7012.0 }
    }
}

impl ShapeCourse {
    /// a in A/m at a time (s) and a rod temperature (K). The actuator's `thermal_drift` leads a thermal one on from there.
    pub fn shape_a_per_m(&self, time_s: f64, temperature_k: f64) -> f64 {
        match *self {
            ShapeCourse::Constant { a_per_m } => a_per_m,
            ShapeCourse::Ramp {
                from_a_per_m,
                rate_a_per_m_s,
                to_a_per_m,
            } => {
                let drifted = from_a_per_m + rate_a_per_m_s * time_s;
                if rate_a_per_m_s > 0.0 {
                    drifted.min(to_a_per_m)
                } else {
                    drifted.max(to_a_per_m)
                }
            }
            ShapeCourse::Thermal {
                reference_a_per_m,
                reference_temperature_k,
            } => reference_a_per_m * temperature_k / reference_temperature_k,
        }
    }

    /// The shapes (A/m) between which the course is known to move; a thermal one only starts at them.
    pub(crate) fn known_shapes_a_per_m(&self, start_temperature_k: f64) -> [f64; 2] {
        [0.0, f64::MAX].map(|time_s| self.shape_a_per_m(time_s, start_temperature_k))
    }

    /// # Errors
    /// A shape or temperature that is not positive, or a rate that leads away from the ramp's end.
    pub fn validate(&self) -> Result<(), Invalid> {
        match *self {
            ShapeCourse::Constant { a_per_m } => Invalid::unless_positive("a_per_m", a_per_m, "A/m"),
            ShapeCourse::Ramp {
                from_a_per_m,
                rate_a_per_m_s,
                to_a_per_m,
            } => {
                Invalid::unless_positive("from_a_per_m", from_a_per_m, "A/m")?;
                Invalid::unless_positive("to_a_per_m", to_a_per_m, "A/m")?;
                let towards_end = rate_a_per_m_s.is_finite() && rate_a_per_m_s * (to_a_per_m - from_a_per_m) > 0.0;
                if towards_end {
                    return Ok(());
                }
                let sentence = format!(
                    "{rate_a_per_m_s} A/(m s) never leads from {from_a_per_m} A/m to {to_a_per_m} A/m; \
                     its sign must be that of the difference"
                );
                Err(Invalid::new("rate_a_per_m_s", sentence))
            }
            ShapeCourse::Thermal {
                reference_a_per_m,
                reference_temperature_k,
            } => {
                Invalid::unless_positive("reference_a_per_m", reference_a_per_m, "A/m")?;
                Invalid::unless_positive("reference_temperature_k", reference_temperature_k, "K")
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards the drift of the milling scenario: 6400 rising 200 A/m per second, held at 7200; and the falling one.
    #[test]
    fn a_ramp_moves_at_its_rate_and_stops_at_its_end() {
        let rising = ShapeCourse::Ramp {
            from_a_per_m: 6400.0,
            rate_a_per_m_s: 200.0,
            to_a_per_m: 7200.0,
        };
        let falling = ShapeCourse::Ramp {
            from_a_per_m: 7200.0,
            rate_a_per_m_s: -200.0,
            to_a_per_m: 6400.0,
        };
        for (time_s, drifted) in [(0.0, 0.0), (1.5, 300.0), (4.0, 800.0), (100.0, 800.0)] {
            assert_eq!(rising.shape_a_per_m(time_s, 0.0), 6400.0 + drifted);
            assert_eq!(falling.shape_a_per_m(time_s, 0.0), 7200.0 - drifted);
        }
        assert_eq!(rising.known_shapes_a_per_m(293.0), [6400.0, 7200.0]);
    }

    /// Guards the loading of scenarios.
    #[test]
    fn refuses_a_ramp_that_leads_away() {
        let wrong = ShapeCourse::Ramp {
            from_a_per_m: 6400.0,
            rate_a_per_m_s: -1.0,
            to_a_per_m: 7200.0,
        };
        assert_eq!(wrong.validate().unwrap_err().path, "rate_a_per_m_s");
        assert!(ShapeCourse::Constant { a_per_m: f64::NAN }.validate().is_err());
    }
}
