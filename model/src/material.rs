//! A material: its hysteresis, its magnetostriction, and where the numbers come from.

use serde::{Deserialize, Serialize};

use crate::error::require;
use crate::{Hysteresis, HysteresisLaw, LawModel, Magnetostriction, ModelError};

/// Everything that describes a magnetostrictive material at one temperature and stress, or what stands in its place.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    pub name: String,
    /// Publication, data sheet or measured file that the numbers come from.
    pub source: String,
    /// Where another law is given, only the scales of its input (a) and output (Ms): moved, they calibrate it.
    pub hysteresis: Hysteresis,
    pub magnetostriction: Magnetostriction,
    /// Another law in place of the domain wall's: a piezo stack's, an electromagnet's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub law: Option<MaterialLaw>,
}

/// Any hysteresis law, from what drives an actuator to what it gives.
///
/// Whatever is called a field elsewhere is then its input, whatever is called a magnetization its output counted from rest, and the
/// free strain is the output itself.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialLaw {
    /// Of the input, as `V`.
    pub input_unit: String,
    /// Of the output, as `m`.
    pub output_unit: String,
    /// What the input may be, lowest and highest.
    pub input_extent: [f64; 2],
    pub model: LawModel,
}

impl MaterialLaw {
    /// Half of what the input may be.
    pub fn input_scale(&self) -> f64 {
        0.5 * (self.input_extent[1] - self.input_extent[0])
    }

    /// The output at the ends of the input, along the first way there from rest, counted from rest.
    pub fn reach(&self) -> [f64; 2] {
        let rest = self.model.rest();
        let zero = self.model.output(&rest);
        self.input_extent.map(|end| {
            let mut state = rest.clone();
            self.model.advance(&mut state, end);
            self.model.pass(&mut state, f64::INFINITY);
            self.model.output(&state) - zero
        })
    }

    /// What stands for a and Ms of a material that has this law, as it is fitted.
    pub fn scales(&self) -> [f64; 2] {
        let [low, high] = self.reach();
        // Room above the first way: a strain law ends at Ms.
        [self.input_scale(), LAW_ROOM * low.abs().max(high.abs())]
    }

    fn validate(&self) -> Result<(), ModelError> {
        self.model.validate()?;
        let [low, high] = self.input_extent;
        let ends = low <= 0.0 && high >= 0.0 && low < high;
        require(
            ends,
            "lowest input of a law",
            low,
            "(unit of the input)",
            "at most 0, and below the highest",
        )?;
        require(
            high.is_finite(),
            "highest input of a law",
            high,
            "(unit of the input)",
            "finite",
        )
    }
}

/// Ms over what a magnet keeps of saturation, roughly.
const KEPT: f64 = 2.5;
/// Ms over the largest output of another law.
const LAW_ROOM: f64 = 2.0;

impl Material {
    /// The paper's Terfenol-D, biased at Ms/2, λs = 1.005e-3.
    pub fn terfenol_d() -> Self {
        Material {
            name: String::from("Terfenol-D"),
            source: String::from("Nealis and Smith, section 5"),
            hysteresis: Hysteresis::terfenol_d(),
            magnetostriction: Magnetostriction::Linearised {
                saturation_magnetostriction: 1.005e-3,
                bias_fraction: 0.5,
            },
            law: None,
        }
    }

    /// What another law stands for.
    ///
    /// # Errors
    /// A law that is none, or that gives nothing within its input's extent.
    pub fn of_law(name: &str, source: &str, law: MaterialLaw) -> Result<Self, ModelError> {
        law.validate()?;
        let [shape_a_per_m, size] = law.scales();
        let named = "output of a law at its largest input";
        require(size > 0.0, named, size, "(unit of the output)", "finite and not 0")?;
        Ok(Material {
            name: name.to_owned(),
            source: source.to_owned(),
            hysteresis: Hysteresis {
                saturation_magnetization_a_per_m: size,
                shape_a_per_m,
                pinning_a_per_m: shape_a_per_m,
                coupling: 0.0,
                ..Hysteresis::terfenol_d()
            },
            magnetostriction: Magnetostriction::Parabolic {
                slope_m_per_a: 1.0,
                square_m2_per_a2: 0.0,
            },
            law: Some(law),
        })
    }

    /// What another law gives on the first way to an input, from rest; of the domain wall law what a field of 0 has, 0.
    pub fn on_first_way(&self, field: f64) -> f64 {
        self.law.as_ref().map_or(0.0, |law| {
            let mut state = law.model.rest();
            let zero = law.model.output(&state);
            let [input_scale, output_scale] = law.scales();
            law.model
                .advance(&mut state, input_scale / self.hysteresis.shape_a_per_m * field);
            let size = self.hysteresis.saturation_magnetization_a_per_m / output_scale;
            size * (law.model.output(&state) - zero)
        })
    }

    /// Between which fields another law's input lies, A/m.
    pub fn field_extent(&self) -> Option<[f64; 2]> {
        let law = self.law.as_ref()?;
        let per_input = self.hysteresis.shape_a_per_m / law.scales()[0];
        Some(law.input_extent.map(|end| end * per_input))
    }

    /// What a run's unknown first magnetization is measured by: Ms; of another law 2.5 times what it keeps at input 0 of an extreme.
    pub fn start_scale(&self) -> f64 {
        self.law
            .as_ref()
            .map_or(self.hysteresis.saturation_magnetization_a_per_m, |law| {
                let rest = law.model.rest();
                let kept = law.input_extent.map(|end| {
                    let mut state = rest.clone();
                    law.model.advance(&mut state, end);
                    law.model.advance(&mut state, 0.0);
                    (law.model.output(&state) - law.model.output(&rest)).abs()
                });
                KEPT * kept[0].max(kept[1])
            })
    }

    /// Units of what drives it and of what it gives: A/m and m of a magnetostrictive rod.
    pub fn units(&self) -> [&str; 2] {
        self.law
            .as_ref()
            .map_or(["A/m", "m"], |law| [&law.input_unit, &law.output_unit])
    }

    /// The unit here of what is told in this one for a magnetostrictive rod: parameters have names and units of that.
    pub fn unit_of(&self, unit: &str) -> String {
        let [input, output] = self.units();
        match unit {
            "A/m" => input.to_owned(),
            "A/(m s)" if self.law.is_some() => format!("{input}/s"),
            "m" => output.to_owned(),
            "m/s" => format!("{output}/s"),
            other => other.to_owned(),
        }
    }

    /// By how many powers of ten input and output of its law are larger than those of a rod of Terfenol-D, 10 kA/m and 30 µm; 1 without
    /// a law.
    pub(crate) fn decades(&self) -> [f64; 2] {
        let Some(law) = &self.law else { return [1.0; 2] };
        let largest = |ends: [f64; 2]| ends[0].abs().max(ends[1].abs());
        let decade = |size: f64, usual: f64| {
            let decade = 10_f64.powf((size / usual).log10().round());
            if decade.is_normal() { decade } else { 1.0 }
        };
        [
            decade(largest(law.input_extent), 1e4),
            decade(largest(law.reach()), 3e-5),
        ]
    }

    /// Checks the hysteresis and the magnetostriction.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.law.as_ref().map_or(Ok(()), MaterialLaw::validate)?;
        self.hysteresis.validate()?;
        self.magnetostriction.validate()
    }

    /// dλ/dM at M = 0 (m/A): what a linear rod is built on. Zero for the even laws.
    pub fn strain_per_magnetization(&self) -> f64 {
        self.magnetostriction
            .slope(0.0, self.hysteresis.saturation_magnetization_a_per_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards what is told of a law: its own units, and of a rod those of its parameters.
    #[test]
    fn units_are_those_of_the_law() {
        let law = MaterialLaw {
            input_unit: "V".into(),
            output_unit: "rad".into(),
            input_extent: [0.0, 100.0],
            model: LawModel {
                slope: 1e-7,
                ..LawModel::default()
            },
        };
        let mirror = Material::of_law("mirror", "made up", law).unwrap();
        let told = ["A/m", "A/(m s)", "m", "m/s", "K"];
        assert_eq!(told.map(|unit| mirror.unit_of(unit)), ["V", "V/s", "rad", "rad/s", "K"]);
        assert_eq!(told.map(|unit| Material::terfenol_d().unit_of(unit)), told);
    }
}
