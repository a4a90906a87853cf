//! Field → bank of models over Θ → free strains → rods → law: what is known at t_k from the measurement at t_k.
//!
//! Every member follows the same field with its own shape parameter, so f(u, θ), a functional of the whole history of the
//! input, is at hand for every θ of the grid at every instant. The magnetization handed on is interpolated in the bank at
//! the corrected estimate.
//! Source: the paper's section 3, made exact for any input by the bank (docs/paper-notes.md).

use crate::any_law::AnyLaw;
use crate::coil_field::{CoilFieldModel, FieldKnowledge};
use crate::effects::KnownEffects;
use crate::excitation::{Excitation, ExcitationMonitor};
use crate::law::{Correction, Law, Prediction, is_credible};
use crate::outlier::OutlierTest;
use crate::rods::Rods;
use crate::washout::Washout;
use crate::{EstimatorError, EstimatorSettings, Grid, LawSettings, MinMaxSettings};
use anhyst_model::{AmplifierConstants, Bank, Effect, Magnetostriction, Material, Spring, TwoPole};
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
}

/// The estimator: everything it remembers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Estimator {
    field: CoilFieldModel,
    grid: Grid,
    bank: Bank,
    saturation_a_per_m: f64,
    magnetostriction: Magnetostriction,
    strains: Vec<f64>,
    rods: Rods,
    washout: Option<Washout>,
    /// The same filter for the strains, where the law reads them: a law that drives its own rod with them must see
    /// input and output washed alike.
    strain_washout: Option<Washout>,
    outlier_test: OutlierTest,
    monitor: Option<ExcitationMonitor>,
    law: AnyLaw,
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
    /// them already ([`anhyst_model::with_known_effects`]); inside the hysteresis none is taken into account, and in the rod only a spring that stiffens.
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
        let members = settings.law.members();
        let law = AnyLaw::new(&settings.law, &two_pole_per_strain, tick_s)?;
        let min_max = settings.law.min_max().copied().unwrap_or(MinMaxSettings::folded());
        let monitor = match settings.law {
            LawSettings::FixedShape { .. } => None,
            _ => Some(ExcitationMonitor::new(&settings.excitation, &min_max, tick_s)),
        };
        let (lower, upper) = settings.law.range_a_per_m();
        let grid = Grid::new(lower, upper, members);
        let washout = || {
            settings
                .washout_hz
                .map(|corner_hz| Washout::new(corner_hz, members, tick_s))
        };
        let bank = Bank::new(material.hysteresis, grid.shapes_a_per_m())?;
        let saturation_a_per_m = material.hysteresis.saturation_magnetization_a_per_m;
        let strain_at = |share: f64| {
            material
                .magnetostriction
                .strain(share * saturation_a_per_m, saturation_a_per_m)
        };
        let largest_strain = strain_at(1.0).abs().max(strain_at(-1.0).abs());
        let stroke_m = (largest_strain * two_pole_per_strain.gain / two_pole_per_strain.stiffness_per_s2).abs();
        let outlier = settings.outlier;
        let innovation_limit_m = outlier.innovation_limit_m.unwrap_or(stroke_m);
        Ok(Self {
            field: CoilFieldModel::new(settings.field, amplifier, tick_s)?,
            grid,
            bank,
            saturation_a_per_m,
            magnetostriction: material.magnetostriction,
            strains: vec![0.0; members],
            rods: Rods::new(two_pole_per_strain, tick_s, members)?.with_spring(Spring::new(effects)),
            washout: washout(),
            strain_washout: washout().filter(|_| matches!(settings.law, LawSettings::Matrix(_))),
            outlier_test: OutlierTest::new(innovation_limit_m, outlier.at_most_s, tick_s),
            monitor,
            law,
            effects: KnownEffects::new(effects, settings, members, tick_s)?,
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
        self.bank.advance(field.now_a_per_m);
        let magnetizations = match &mut self.effects {
            None => self.bank.magnetizations(),
            Some(effects) => effects.crept(self.bank.magnetizations()),
        };
        for (strain, &magnetization) in self.strains.iter_mut().zip(magnetizations) {
            *strain = self.magnetostriction.strain(magnetization, self.saturation_a_per_m);
        }
        if let Some(effects) = &mut self.effects {
            effects.expand(coil.now_a_per_m, &mut self.strains);
        }
        // At tick 0 the rod is at rest where it stands; there is no interval before it.
        if tick > 0 {
            self.rods.advance(&self.strains);
        }
        let sensed_m = match &mut self.effects {
            None => self.rods.displacements_m(),
            Some(effects) => effects.sensed(self.rods.displacements_m()),
        };
        let predicted_m = self.grid.linear(sensed_m, self.law.shape_a_per_m());
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
        let strains = match &mut self.strain_washout {
            None => self.strains.as_slice(),
            Some(washout) => washout.predicted(&self.strains),
        };
        let prediction = Prediction {
            grid: &self.grid,
            strains,
            displacements_m,
        };
        let excitation = self.monitor.as_mut().map(|monitor| {
            let output = self.grid.smooth(displacements_m, self.law.shape_a_per_m());
            monitor.observe(output, is_credible(measured_m))
        });
        let correction = match excitation {
            Some(Excitation { informed: false, .. }) => self.law.hold(prediction),
            _ => self.law.correct(prediction, measured_m),
        };
        Estimation {
            field,
            magnetization_a_per_m: self.grid.cubic(self.bank.magnetizations(), correction.shape_a_per_m),
            correction,
            outlier,
            excitation: excitation.unwrap_or_default(),
        }
    }
}
