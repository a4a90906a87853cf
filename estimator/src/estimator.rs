//! Field → models → free strains → rods → law: what is known at t_k from the measurement at t_k.
//!
//! Every member of a bank over Θ follows the same field with its own shape parameter, so f(u, θ), a functional of the whole history of the
//! input, is at hand for every θ of the grid at every instant. The magnetization handed on is interpolated in the bank at
//! the corrected estimate. Where several parameters are estimated, one model with its derivatives stands in for the bank.
//! Source: the paper's section 3, made exact for any input by the bank (docs/paper-notes.md).

use crate::coil_field::{CoilFieldModel, FieldKnowledge};
use crate::effects::KnownEffects;
use crate::excitation::Excitation;
use crate::law::Correction;
use crate::models::Models;
use crate::multi_parameter::ParameterEstimates;
use crate::outlier::OutlierTest;
use crate::rods::Rods;
use crate::taught::Weight;
use crate::washout::Washout;
use crate::{EstimatorError, EstimatorSettings};
use anhyst_model::{AmplifierConstants, Effect, Magnetostriction, Material, OwnForces, TwoPole};
use serde::{Deserialize, Serialize};

/// What the estimator knows at t_k.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Estimation {
    /// Field in the material at t_k and t_k+1; without known effects it is the coil's.
    pub field: FieldKnowledge,
    /// Magnetization at t_k at the estimate, A/m.
    pub magnetization_a_per_m: f64,
    /// What the law found.
    pub correction: Correction,
    /// The measurement was left out: it is too far from what was predicted.
    pub outlier: bool,
    /// What the recent motion says about `a`; nothing where `a` is fixed.
    pub excitation: Excitation,
    /// All parameters, where several are estimated.
    pub parameters: Option<ParameterEstimates>,
    /// One weight of another law than the domain wall's, another one every tick.
    pub weight: Option<Weight>,
}

/// The estimator: everything it remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimator {
    field: CoilFieldModel,
    models: Models,
    saturation_a_per_m: f64,
    magnetostriction: Magnetostriction,
    strains: Vec<f64>,
    rods: Rods,
    washout: Option<Washout>,
    outlier_test: OutlierTest,
    effects: Option<Box<KnownEffects>>,
}

impl Estimator {
    /// A demagnetised material in a rod at rest, for ticks of `tick_s`. The material's own `a` is not used: the bank's
    /// members have those of the range. The gain of `two_pole_per_strain` is per unit of free strain
    /// ([`anhyst_model::RodElements::two_pole`] with a strain per magnetization of 1).
    ///
    /// # Errors
    /// A setting or a constant that cannot be used.
    pub fn new(
        settings: &EstimatorSettings,
        material: &Material,
        two_pole_per_strain: TwoPole,
        amplifier: AmplifierConstants,
        tick_s: f64,
    ) -> Result<Self, EstimatorError> {
        Self::with_effects(settings, material, two_pole_per_strain, amplifier, tick_s, &[])
    }

    /// The same for an actuator that has these effects. Those that change nothing but numbers of material and rod must be in
    /// them already ([`anhyst_model::with_known_effects`]).
    ///
    /// # Errors
    /// A setting, a constant or an effect that cannot be used.
    pub fn with_effects(
        settings: &EstimatorSettings,
        material: &Material,
        two_pole_per_strain: TwoPole,
        amplifier: AmplifierConstants,
        tick_s: f64,
        effects: &[Effect],
    ) -> Result<Self, EstimatorError> {
        settings.validate()?;
        material.validate()?;
        let models = Models::new(settings, material, &two_pole_per_strain, tick_s)?;
        let (columns, values) = models.columns();
        let saturation_a_per_m = material.hysteresis.saturation_magnetization_a_per_m;
        let strain_at = |share: f64| {
            material
                .magnetostriction
                .strain(share * saturation_a_per_m, saturation_a_per_m)
        };
        let largest_strain = strain_at(1.0).abs().max(strain_at(-1.0).abs());
        let stroke_m = (largest_strain * two_pole_per_strain.gain / two_pole_per_strain.stiffness_per_s2).abs();
        let own_forces = OwnForces::new(effects, material, two_pole_per_strain, tick_s)?;
        let outlier = settings.outlier;
        let innovation_limit_m = outlier.innovation_limit_m.unwrap_or(stroke_m);
        Ok(Self {
            field: CoilFieldModel::new(settings.field, amplifier, tick_s)?,
            models,
            saturation_a_per_m,
            magnetostriction: material.magnetostriction,
            strains: vec![0.0; columns],
            rods: Rods::new(two_pole_per_strain, tick_s, columns)?.with_own_forces(own_forces, values),
            washout: settings
                .washout_hz
                .map(|corner_hz| Washout::new(corner_hz, columns, tick_s)),
            outlier_test: OutlierTest::new(innovation_limit_m, outlier.at_most_s, tick_s),
            effects: KnownEffects::new(effects, settings, (columns, values), tick_s)?,
        })
    }

    /// Advances to t_k with the safe field of the tick before and the measurements of this one.
    pub fn step(
        &mut self,
        tick: u64,
        last_safe_field_a_per_m: f64,
        measured_field_a_per_m: f64,
        measured_displacement_m: f64,
    ) -> Estimation {
        let coil = self.field.follow(tick, last_safe_field_a_per_m, measured_field_a_per_m);
        let field = match &mut self.effects {
            None => coil,
            Some(effects) => effects.within(tick, coil),
        };
        let pinning_factor = self
            .effects
            .as_mut()
            .map_or(1.0, |effects| effects.pinning_factor(field.now_a_per_m));
        self.models.advance(field.now_a_per_m, pinning_factor);
        let magnetizations = match &mut self.effects {
            None => self.models.magnetizations(),
            Some(effects) => effects.crept(self.models.magnetizations()),
        };
        let own_forces = self.rods.have_own_forces();
        let magnetization_a_per_m = own_forces.then(|| self.models.at_estimate(magnetizations));
        let strains = &mut self.strains;
        self.models
            .strains(&self.magnetostriction, self.saturation_a_per_m, magnetizations, strains);
        if let Some(effects) = &mut self.effects {
            effects.expand(coil.now_a_per_m, strains);
        }
        // At tick 0 the rod is at rest where it stands; there is no interval before it.
        if tick > 0 {
            let at_estimate = magnetization_a_per_m.map(|own| (self.models.at_estimate(strains), own));
            self.rods.advance(strains, at_estimate);
        }
        let sensed_m = match &mut self.effects {
            None => self.rods.displacements_m(),
            Some(effects) => effects.sensed(self.rods.displacements_m()),
        };
        let predicted_m = self.models.at_estimate(sensed_m);
        let outlier = self.outlier_test.leaves_out(measured_displacement_m, predicted_m);
        // A filter must not see it either: it would remember it.
        let believed_m = if outlier { f64::NAN } else { measured_displacement_m };
        let (displacements_m, measured_m) = match &mut self.washout {
            None => (sensed_m, believed_m),
            Some(washout) => {
                let measured_m = washout.measured(believed_m);
                (washout.predicted(sensed_m), measured_m)
            }
        };
        let taught = self.models.learn(&self.strains, displacements_m, measured_m);
        if let Some(change) = &taught.change {
            self.rods.shift(change);
            if let Some(washout) = &mut self.washout {
                washout.shift(change);
            }
        }
        Estimation {
            field,
            magnetization_a_per_m: taught.magnetization_a_per_m,
            correction: taught.correction,
            outlier,
            excitation: taught.excitation,
            parameters: taught.parameters,
            weight: taught.weight,
        }
    }
}
