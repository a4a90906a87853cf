//! What a simulated run is composed of: every number that is fitted, what it belongs to, and what is believed of it beforehand.
//!
//! Constants of the nominal chain and the magnetic start of each run are always there, each with a prior: a model file's numbers
//! are measured, too. Effects join and leave; so does the low pass of the recorder. What enters the measurement linearly (zero, drift, lines,
//! a probe's gain) is no unknown: it is profiled out (`likelihood.rs`).

use anhyst_identify::engine::Coordinate;
use anhyst_model::{
    ActuatorModel, Effect, MagneticStart, MagneticState, Material, ModelError, NominalParameter, ParameterRole,
};

use crate::acquisition::LowPass;
use crate::channel::ChannelKind;
use crate::term::Term;
use crate::unknown::{Slot, Unknown, drive_zero_a_per_m};

/// A corner that is so close to an end of its range, by ratio, stands there.
const AT_END: f64 = 1e-3;

/// A sine on a channel that the drive does not make, by its frequency.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub channel: usize,
    pub frequency_hz: f64,
}

/// Everything that is in the model of a measurement.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Composition {
    pub unknowns: Vec<Unknown>,
    pub lines: Vec<Line>,
    /// Of the recorder; its corner is an unknown.
    pub low_passes: Vec<(ChannelKind, LowPass)>,
    /// The zero of the outputs stands still.
    pub no_drift: bool,
    /// Constants that left the box of their prior: they are part of the answer.
    pub freed: Vec<NominalParameter>,
}

impl Composition {
    /// The nominal chain with all its constants, and the starts of runs that have one to be found, with a drift of `a` where one
    /// is believed in (standard deviation, A/m). Constants of a model that was itself fitted are free.
    pub fn nominal(model: &ActuatorModel, starts: &[usize], fitted: bool, shape_drift_a_per_m: Option<f64>) -> Self {
        let mut own = Composition::default();
        for parameter in NominalParameter::ALL {
            if let Some(spec) = parameter.spec(model) {
                own.unknowns.push(Unknown::calibrated(parameter, &spec, fitted));
            }
        }
        own.unknowns
            .extend(starts.iter().map(|run| Unknown::start(*run, &model.material)));
        if let Some(extent) = model.material.field_extent() {
            // A rod of Terfenol-D does not feel it; a steep loop shows it.
            let zero = drive_zero_a_per_m(&model.material);
            own.unknowns.push(Unknown::wandering(Slot::DriveZero, zero, 0.2 * zero));
            own.unknowns
                .extend(starts.iter().map(|run| Unknown::turn(*run, extent)));
        }
        if let Some(deviation) = shape_drift_a_per_m {
            let drifts = starts.iter().map(|run| Slot::ShapeDrift(*run));
            let slots = drifts.chain(starts.iter().skip(1).map(|run| Slot::ShapeOffset(*run)));
            own.unknowns
                .extend(slots.map(|slot| Unknown::wandering(slot, deviation, 0.01 * deviation)));
        }
        own
    }

    /// The same with an effect at these values of its fitted rows, or another constant set free there.
    pub fn with(&self, term: Term, model: &ActuatorModel, values: &[f64]) -> Option<Self> {
        let mut own = self.without(term, model);
        match term {
            Term::Effect(kind) => {
                let known = model.effect(kind);
                for (value, (place, spec)) in values.iter().zip(Term::fitted(kind, model)) {
                    own.unknowns.push(Unknown::of_effect(kind, place, &spec, *value));
                }
                for (place, spec) in kind.parameters_of(&model.material).enumerate() {
                    if spec.role == ParameterRole::Fixed
                        && let Some(deviation) = spec.prior_deviation
                    {
                        let usual = known.map_or(spec.typical, |effect| effect.values()[place]);
                        own.unknowns
                            .push(Unknown::inner(Slot::Effect(kind, place), &spec, usual, deviation));
                    }
                }
            }
            Term::Parameter(parameter) => {
                let spec = parameter.spec(model)?;
                let unknown = own
                    .unknowns
                    .iter_mut()
                    .find(|own| own.slot == Slot::Nominal(parameter))?;
                *unknown = Unknown::free(parameter, &spec, spec.identity()?, *values.first()?);
                own.freed.push(parameter);
            }
        }
        Some(own)
    }

    /// The same where numbers inside an effect that stand at an end of their range begin a deviation away: nothing answers to them at the end.
    pub fn inside(mut self, term: Term) -> Self {
        for unknown in &mut self.unknowns {
            let Coordinate { lower, upper, .. } = unknown.coordinate;
            let is_its = matches!(unknown.slot, Slot::Effect(kind, _) if Term::Effect(kind) == term);
            if let Some((_, deviation)) = unknown
                .coordinate
                .prior
                .filter(|_| is_its && unknown.coordinate.logarithmic)
            {
                if unknown.value == lower {
                    unknown.value *= deviation.exp();
                } else if unknown.value == upper {
                    unknown.value *= (-deviation).exp();
                }
            }
        }
        self
    }

    /// The same without an effect, or with a constant back in the box of its prior.
    pub fn without(&self, term: Term, model: &ActuatorModel) -> Self {
        let mut own = self.clone();
        match term {
            Term::Effect(kind) => own
                .unknowns
                .retain(|unknown| !matches!(unknown.slot, Slot::Effect(of, _) if of == kind)),
            Term::Parameter(parameter) => {
                own.freed.retain(|freed| *freed != parameter);
                let unknown = own.unknowns.iter_mut().find(|own| own.slot == Slot::Nominal(parameter));
                if let Some((unknown, spec)) = unknown.zip(parameter.spec(model)) {
                    *unknown = Unknown::calibrated(parameter, &spec, false);
                }
            }
        }
        own
    }

    /// The same with the recorder's low pass at its corner.
    pub fn with_low_pass(mut self, kind: ChannelKind, low_pass: LowPass) -> Self {
        self.unknowns.retain(|own| own.slot != Slot::Corner(kind));
        self.low_passes.retain(|(own, _)| *own != kind);
        self.low_passes.push((kind, low_pass));
        if low_pass.is_shared && self.corner_of(kind).is_some() {
            return self;
        }
        self.unknowns.push(Unknown::corner(kind, low_pass));
        self
    }

    /// The same with the recorder's low passes, of each channel one.
    pub fn with_low_passes(self, forms: &[(ChannelKind, LowPass)]) -> Self {
        let with = |own: Self, (kind, low_pass): &(ChannelKind, LowPass)| own.with_low_pass(*kind, *low_pass);
        forms.iter().fold(self, with)
    }

    /// The same without the recorder's low passes.
    pub fn without_low_passes(&self) -> Self {
        let mut own = self.clone();
        own.unknowns.retain(|own| !matches!(own.slot, Slot::Corner(_)));
        own.low_passes.clear();
        own
    }

    /// What is in beside the calibrated chain, in the order in which it came.
    pub fn terms(&self) -> Vec<Term> {
        let mut terms: Vec<Term> = Vec::new();
        for unknown in &self.unknowns {
            if let Slot::Effect(kind, _) = unknown.slot
                && !terms.contains(&Term::Effect(kind))
            {
                terms.push(Term::Effect(kind));
            }
        }
        terms.extend(self.freed.iter().map(|parameter| Term::Parameter(*parameter)));
        terms
    }

    /// The model with all that is in.
    pub fn model(&self, nominal: &ActuatorModel) -> Result<ActuatorModel, ModelError> {
        let mut model = nominal.clone();
        let mut effects: Vec<Effect> = Vec::new();
        for unknown in &self.unknowns {
            match unknown.slot {
                Slot::Nominal(parameter) => parameter.set(&mut model, unknown.value),
                Slot::Effect(kind, place) => {
                    if effects.last().is_none_or(|effect| effect.kind() != kind) {
                        effects.push(
                            nominal
                                .effect(kind)
                                .copied()
                                .unwrap_or_else(|| Effect::typical_of(kind, &nominal.material)),
                        );
                    }
                    if let Some(effect) = effects.last_mut() {
                        effect.values_mut()[place] = unknown.value;
                    }
                }
                Slot::Start(_)
                | Slot::Turn(_)
                | Slot::DriveZero
                | Slot::ShapeOffset(_)
                | Slot::ShapeDrift(_)
                | Slot::Corner(_) => {}
            }
        }
        for effect in effects {
            effect.validate_in(&nominal.material)?;
            model = model.with_effect(effect);
        }
        model.validate()?;
        Ok(model)
    }

    /// By how much the drive exceeds its record, A/m.
    pub fn drive_zero_a_per_m(&self) -> Option<f64> {
        let own = self.unknowns.iter().find(|own| own.slot == Slot::DriveZero)?;
        Some(own.value)
    }

    /// Where the material was before a run's first sample: so far from the first way there.
    pub fn start(&self, run: usize, field_a_per_m: f64, material: &Material) -> Option<MagneticStart> {
        let of = |slot: Slot| self.unknowns.iter().find(|own| own.slot == slot).map(|own| own.value);
        Some(MagneticStart {
            state: MagneticState {
                field_a_per_m,
                magnetization_a_per_m: of(Slot::Start(run))? + material.on_first_way(field_a_per_m),
            },
            turn_a_per_m: of(Slot::Turn(run)).unwrap_or(0.0),
        })
    }

    /// How far `a` is above its value at a run's first sample and at its last, A/m.
    pub fn shape_above_a_per_m(&self, run: usize) -> [f64; 2] {
        let of = |slot: Slot| {
            let own = self.unknowns.iter().find(|own| own.slot == slot);
            own.map_or(0.0, |own| own.value)
        };
        let (offset, drift) = (of(Slot::ShapeOffset(run)), of(Slot::ShapeDrift(run)));
        [offset - 0.5 * drift, offset + 0.5 * drift]
    }

    /// The recorder's low pass at the fitted corner.
    pub fn fitted_low_pass(&self, kind: ChannelKind) -> Option<LowPass> {
        let (_, low_pass) = *self.low_passes.iter().find(|(own, _)| *own == kind)?;
        let corner = self.corner_of(kind).map(|place| self.unknowns[place].value);
        Some(LowPass {
            corner_hz: corner.unwrap_or(low_pass.corner_hz),
            ..low_pass
        })
    }

    /// All of them.
    pub fn fitted_low_passes(&self) -> Vec<(ChannelKind, LowPass)> {
        let of = |(kind, _): &(ChannelKind, LowPass)| Some((*kind, self.fitted_low_pass(*kind)?));
        self.low_passes.iter().filter_map(of).collect()
    }

    /// A corner stands at an end of its range.
    pub fn presses_corner(&self) -> bool {
        let corners = self.unknowns.iter().filter(|own| matches!(own.slot, Slot::Corner(_)));
        let mut ends = corners.flat_map(|own| [own.coordinate.lower, own.coordinate.upper].map(|end| own.value / end));
        ends.any(|ratio| ratio.ln().abs() < AT_END)
    }

    /// The unknown that is the corner of a channel's low pass, or of the one that it shares.
    pub fn corner_of(&self, kind: ChannelKind) -> Option<usize> {
        let place = |is: &dyn Fn(Slot) -> bool| self.unknowns.iter().position(|own| is(own.slot));
        place(&|slot| slot == Slot::Corner(kind)).or_else(|| place(&|slot| matches!(slot, Slot::Corner(_))))
    }
}
