//! What a study is made of: a nominal model, and the rig that the witness makes of its numbers.
//!
//! The witness's drives, noise and effects are those of a rod of Terfenol-D: fields of some kA/m and some ten micrometres. A model of another
//! size is scaled to it and its records back: v = f H, y = g u, with f, g the ratios of the shapes (input scales) and of the displacements at
//! saturation (output scales); 1 for Terfenol-D.

use anhyst_measured::Quantity;
use anhyst_model::{
    ActuatorModel, AmplifierConstants, Anhysteretic, EffectKind, Law, LawModel, Magnetostriction, Stage, Warp,
};
use anhyst_witness::{self as witness, Effect, Element, Made, Material, Operator, Rig, Rod, Value};
use std::sync::Arc;

use crate::error::StudyError;

/// H of the witness where a law's input is at its end, A/m.
const END_A_PER_M: f64 = 13e3;
/// u of the witness there, m.
const REACH_M: f64 = 60e-6;

/// A nominal model and its rig.
#[derive(Clone, Debug)]
pub struct Subject {
    model: ActuatorModel,
    rig: Rig,
    /// f, unit of the model's input per A/m.
    input: f64,
    /// g, unit of its output per m.
    output: f64,
}

impl Subject {
    /// Of a model: a material with a rod or a law with or without, and nothing found in it yet.
    ///
    /// # Errors
    /// What the witness has not: the first part of the model that it cannot be made of.
    pub fn of(mut model: ActuatorModel) -> Result<Self, StudyError> {
        // As in the loop: whatever a law gives, a flux density, too, is called a displacement behind a rod.
        if let Some(law) = &mut model.material.law {
            law.output_unit = Quantity::Displacement.unit().to_owned();
        }
        let refused = |lacking: &'static str| StudyError::NoRig {
            model: model.name.clone(),
            lacking,
        };
        let rod = match model.rod {
            Some(rod) => Rod {
                gain: rod.gain,
                damping_per_s: rod.damping_per_s,
                stiffness_per_s2: rod.stiffness_per_s2,
                follows_at_once: false,
            },
            None if model.material.law.is_some() => Rod {
                gain: Rod::PRINTED.stiffness_per_s2,
                follows_at_once: true,
                ..Rod::PRINTED
            },
            None => return Err(refused("a rod (two poles)")),
        };
        let dc_gain = rod.gain / rod.stiffness_per_s2;
        if !model.effects.is_empty() {
            return Err(refused("no effects in the nominal model"));
        }
        if model.amplifier != AmplifierConstants::default() {
            return Err(refused("an amplifier that passes commands on as they are"));
        }
        let own = model.material.hysteresis;
        let usual = Material::TERFENOL_D;
        let (input, output, law) = match &model.material.law {
            None => {
                if !matches!(model.material.magnetostriction, Magnetostriction::Linearised { .. }) {
                    return Err(refused("a linearised magnetostriction"));
                }
                let relative = dc_gain / (Rod::PRINTED.gain / Rod::PRINTED.stiffness_per_s2);
                let saturation = own.saturation_magnetization_a_per_m / usual.saturation_a_per_m;
                (own.shape_a_per_m / usual.shape_a_per_m, relative * saturation, None)
            }
            Some(law) => {
                let operator = operator(&law.model);
                let [low, high] = law.input_extent;
                let [at_low, at_high] = law.reach();
                let one_sided = low > -0.1 * high;
                let end = if one_sided { high } else { high.min(-low) };
                let reach = if one_sided { at_high } else { 0.5 * (at_high - at_low) };
                let input_per_field = end / END_A_PER_M;
                let law = witness::Law {
                    operator: Arc::new(operator),
                    input_per_field,
                    magnetization_per_output: usual.saturation_a_per_m / own.saturation_magnetization_a_per_m,
                    one_sided,
                };
                (input_per_field, dc_gain * reach / REACH_M, Some(law))
            }
        };
        let saturation = own.saturation_magnetization_a_per_m / usual.saturation_a_per_m;
        let rig = Rig {
            material: Material {
                curve: curve(own.anhysteretic),
                pinning_a_per_m: own.pinning_a_per_m / input,
                coupling: own.coupling * saturation / input,
                reversible_share: own.reversibility,
                ..usual
            },
            law,
            rod: Rod {
                gain: rod.gain * saturation / output,
                ..rod
            },
            ..Rig::NOMINAL
        };
        Ok(Subject {
            model,
            rig,
            input,
            output,
        })
    }

    /// What the diagnosis is given.
    pub fn model(&self) -> &ActuatorModel {
        &self.model
    }

    /// What the runs are drawn of.
    pub fn rig(&self) -> &Rig {
        &self.rig
    }

    /// Those of `effects` that can be in it.
    pub fn effects(&self, effects: &[Effect]) -> Vec<Effect> {
        let law = self.model.material.law.is_some();
        let rests = self.rig.rod.follows_at_once;
        let can_be = |effect: &Effect| {
            let kind = EffectKind::ALL.into_iter().find(|kind| kind.name() == effect.name());
            match kind {
                None if rests && [Effect::XBump, Effect::XDrag].contains(effect) => false,
                Some(kind) if rests && kind.needs_rod() => false,
                // The pinning is the domain wall's.
                None => !(law && *effect == Effect::XAsymmetry),
                // What warms is given in fields and strains of a magnetostrictive rod.
                Some(kind) if law => kind.stage() != Stage::Hysteresis && !kind.needs_coil(false),
                Some(kind) => self.model.coil || !kind.needs_coil(false),
            }
        };
        effects.iter().copied().filter(can_be).collect()
    }

    /// A run in the model's units.
    pub fn in_its_units(&self, mut made: Made) -> Made {
        let scaled = |values: &mut Vec<f64>, factor: f64| values.iter_mut().for_each(|value| *value *= factor);
        let (record, truth) = (&mut made.record, &mut made.truth);
        scaled(&mut record.command_a_per_m, self.input);
        scaled(&mut record.field_a_per_m, self.input);
        scaled(&mut record.displacement_m, self.output);
        for part in &mut truth.parts {
            scaled(&mut part.contribution_a_per_m, self.input);
            scaled(&mut part.contribution_m, self.output);
            part.gap_m *= self.output;
            for value in &mut part.values {
                value.value *= self.factor(value);
            }
        }
        for size in [
            &mut truth.noise_m,
            &mut truth.gap_m,
            &mut truth.gap_to_the_nominal_model_m,
            &mut truth.gap_of_the_nuisance_m,
        ] {
            *size *= self.output;
        }
        made
    }

    fn factor(&self, value: &Value) -> f64 {
        match value.name {
            "field_limit_a_per_m" | "slew_limit_a_per_m_s" | "bias_field_a_per_m" => self.input,
            "friction_m" | "speed_m_per_s" | "gap_m" | "limit_m" | "step_m" => self.output,
            "cubic_stiffness_per_m2" => self.output.powi(-2),
            // With the square of the field over one that is the same for all.
            "heating_k_per_s" => self.input.powi(-2),
            _ => 1.0,
        }
    }
}

fn curve(own: Anhysteretic) -> witness::Curve {
    match own {
        Anhysteretic::Langevin => witness::Curve::Langevin,
        Anhysteretic::Ising => witness::Curve::Ising,
    }
}

/// The same law in the witness's words.
fn operator(law: &LawModel) -> Operator {
    let mut parts = Vec::new();
    for own in &law.laws {
        match own {
            Law::Plays(own) => parts.extend(own.groups.iter().map(|group| Element::Plays {
                warp: match group.warp {
                    Warp::Straight => witness::Warp::Straight,
                    Warp::Quadratic {
                        bend,
                        middle,
                        half_span,
                    } => witness::Warp::Bent([bend, middle, half_span]),
                    Warp::Tanh { scale } => witness::Warp::Saturating(scale),
                },
                radii: group.radii.clone(),
                weights: group.weights.clone(),
            })),
            Law::Preisach(own) => parts.push(Element::Preisach {
                levels: own.levels().to_vec(),
                weights: own.weights().to_vec(),
            }),
            Law::BoucWen(own) => parts.push(Element::BoucWen {
                amplitude: own.amplitude,
                yield_input: own.yield_input,
                exponent: own.exponent,
                loading_share: own.loading_share,
                stiffens: own.stiffens,
            }),
            Law::DomainWall(own) => parts.push(Element::DomainWall {
                material: Material {
                    curve: curve(own.hysteresis.anhysteretic),
                    saturation_a_per_m: own.hysteresis.saturation_magnetization_a_per_m,
                    shape_a_per_m: own.hysteresis.shape_a_per_m,
                    pinning_a_per_m: own.hysteresis.pinning_a_per_m,
                    coupling: own.hysteresis.coupling,
                    reversible_share: own.hysteresis.reversibility,
                    cubic_coupling: own.hysteresis.cubic_coupling_m2_per_a2,
                },
                gain: own.gain,
            }),
        }
    }
    Operator {
        slope: law.slope,
        parts,
        creep: law.creep.iter().map(|lag| (lag.time_constant_s, lag.weight)).collect(),
    }
}
