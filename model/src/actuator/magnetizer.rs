//! Field → magnetization: the domain wall model with the effects that act inside it.
//!
//! A tick: the rod's temperature sets `a`, the field's rate sets k, then the field moves and walls that were frozen may relax.
//! Where the material has another law, it stands in the place of the domain wall model: its output counts from rest, and time passes
//! for its creep before the input moves.
//! Parameters that change while the field rests leave M where it is. Beside M goes its mean excess, by how much its mean over
//! the tick lies above the mean of its ends: the rod feels the whole tick, and 1 A/m of it is 0.2 nm.

use serde::{Deserialize, Serialize};

use crate::effects::accommodation::Accommodation;
use crate::effects::excess_loss::ExcessLoss;
use crate::effects::intersample_field::{IntersampleField, Piece};
use crate::effects::prestress::under_prestress;
use crate::effects::thermal_drift::ThermalDrift;
use crate::{
    ActuatorModel, EffectKind, Hysteresis, HysteresisLaw, LawModel, LawModelState, MagneticState, MaterialLaw,
};

/// How much longer than [`Hysteresis::longest_substep_a_per_m`] substeps are where a displacement is all that counts:
/// sixteen times the error, 1e-7 Ms, 5 pm on the paper's rod.
const COARSE: f64 = 2.0;

#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Magnetizer {
    hysteresis: Hysteresis,
    ambient_temperature_k: f64,
    thermal_drift: Option<ThermalDrift>,
    /// Over ambient, for `thermal_drift`, K.
    rise_k: f64,
    excess_loss: Option<ExcessLoss>,
    accommodation: Option<Accommodation>,
    /// None of the three.
    plain: bool,
    /// In place of the hysteresis.
    other: Option<Box<OtherLaw>>,
    /// M goes straight between samples, and is computed to 1e-9 Ms.
    pub straight: bool,
    pub state: MagneticState,
}

/// How a run finds the material.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct MagneticStart {
    pub state: MagneticState,
    /// A field at which it turned round before, A/m: of what remembers more than its state. 0: it never did.
    pub turn_a_per_m: f64,
}

impl From<MagneticState> for MagneticStart {
    fn from(state: MagneticState) -> Self {
        MagneticStart {
            state,
            turn_a_per_m: 0.0,
        }
    }
}

/// Of the extent of a law's input, to an extreme before a start.
const HALVINGS: usize = 48;

/// Another law in motion.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct OtherLaw {
    law: LawModel,
    state: LawModelState,
    /// Output at rest.
    zero: f64,
    /// Of the input and of the output, where a calibration has moved the scales that stand for them (a and Ms).
    gains: [f64; 2],
    /// Lowest and highest input.
    extent: [f64; 2],
    /// 0 for sweeps without time.
    tick_s: f64,
}

impl OtherLaw {
    fn new(of: &MaterialLaw, hysteresis: &Hysteresis, tick_s: f64) -> Self {
        let [input_scale, output_scale] = of.scales();
        let state = of.model.rest();
        OtherLaw {
            zero: of.model.output(&state),
            gains: [
                input_scale / hysteresis.shape_a_per_m,
                hysteresis.saturation_magnetization_a_per_m / output_scale,
            ],
            law: of.model.clone(),
            state,
            extent: of.input_extent,
            tick_s: if tick_s.is_finite() { tick_s } else { 0.0 },
        }
    }

    /// Somewhere the input has been before: from rest to where it turned round, to an extreme, and from there to the state's input, so that the
    /// state's output, or what comes nearest to it, stands there. What comes out, from rest.
    fn start(&mut self, MagneticStart { state, turn_a_per_m }: MagneticStart) -> f64 {
        let (mut turned, input) = (self.law.rest(), self.gains[0] * state.field_a_per_m);
        self.law.advance(&mut turned, self.gains[0] * turn_a_per_m);
        let wanted = state.magnetization_a_per_m / self.gains[1] + self.zero;
        let [mut low, mut high] = self.extent.map(|end| end - input);
        // A larger extreme leaves more: the output rises with it.
        for _ in 0..HALVINGS {
            let middle = 0.5 * (low + high);
            self.state = turned.clone();
            self.law.advance(&mut self.state, input + middle);
            self.law.advance(&mut self.state, input);
            if self.law.output(&self.state) < wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        self.gains[1] * (self.law.output(&self.state) - self.zero)
    }

    /// A part of a tick passes, and the input moves; what comes out, from rest, halfway and at the end.
    fn moved(&mut self, share: f64, [from, to]: [f64; 2]) -> [f64; 2] {
        self.law.pass(&mut self.state, share * self.tick_s);
        [0.5 * (from + to), to].map(|input| {
            self.law.advance(&mut self.state, self.gains[0] * input);
            self.gains[1] * (self.law.output(&self.state) - self.zero)
        })
    }
}

impl Magnetizer {
    pub fn new(model: &ActuatorModel, tick_s: f64) -> Self {
        let values = |kind| model.effect(kind).map(|effect| effect.values());
        let thermal_drift = values(EffectKind::ThermalDrift)
            .map(|values| ThermalDrift::new(values, tick_s, model.ambient_temperature_k));
        let excess_loss = values(EffectKind::ExcessLoss).map(|values| ExcessLoss::new(values, tick_s));
        let nominal = model.material.hysteresis;
        let hysteresis = values(EffectKind::Prestress).map_or(nominal, |values| under_prestress(nominal, values));
        let accommodation = values(EffectKind::Accommodation).map(Accommodation::new);
        let plain = thermal_drift.is_none() && excess_loss.is_none() && accommodation.is_none();
        Magnetizer {
            hysteresis,
            ambient_temperature_k: model.ambient_temperature_k,
            thermal_drift,
            rise_k: 0.0,
            excess_loss,
            accommodation,
            plain,
            other: model
                .material
                .law
                .as_ref()
                .map(|law| Box::new(OtherLaw::new(law, &nominal, tick_s))),
            straight: false,
            state: MagneticState::default(),
        }
    }

    /// The first sample finds the material in this state.
    pub fn start(&mut self, start: MagneticStart) {
        self.state = start.state;
        if let Some(other) = &mut self.other {
            self.state.magnetization_a_per_m = other.start(start);
        }
    }

    /// Whether a tick may be stepped by [`Magnetizer::step_plain`].
    pub fn is_plain(&self) -> bool {
        self.plain
    }

    /// Another `a` at ambient temperature from the next sample on, A/m.
    pub fn set_shape(&mut self, shape_a_per_m: f64) {
        self.hysteresis.shape_a_per_m = shape_a_per_m;
    }

    /// `a` at ambient temperature, A/m.
    pub fn ambient_shape_a_per_m(&self) -> f64 {
        self.hysteresis.shape_a_per_m
    }

    /// `a` at the last sample's temperature, A/m.
    pub fn shape_a_per_m(&self) -> f64 {
        self.hysteresis_now().shape_a_per_m
    }

    /// The hysteresis with what the last sample's temperature makes of `a`.
    fn hysteresis_now(&self) -> Hysteresis {
        let mut hysteresis = self.hysteresis;
        if let Some(drift) = &self.thermal_drift {
            hysteresis.shape_a_per_m *= drift.shape_factor(self.rise_k);
        }
        hysteresis
    }

    /// The run's first sample, to which the field goes at once: M (A/m).
    pub fn steady_state(&mut self, coil_field: f64, field: f64, temperature_k: Option<f64>) -> f64 {
        if let Some(drift) = &mut self.thermal_drift {
            drift.warming.steady_state(coil_field);
            self.rise_k = temperature_k.map_or(drift.warming.rise_k(), |known| known - self.ambient_temperature_k);
        }
        self.piece(Piece::straight(0.0, self.state.field_a_per_m, field));
        self.state.magnetization_a_per_m
    }

    /// A tick in which the field goes straight and no effect is at work: M and its mean excess (A/m).
    #[inline]
    pub fn step_plain(&mut self, field: f64) -> (f64, f64) {
        let from = self.state.magnetization_a_per_m;
        let mean = self.moved(&{ self.hysteresis }, 1.0, field);
        let to = self.state.magnetization_a_per_m;
        (to, mean - 0.5 * (from + to))
    }

    /// A tick along turning points: M and its mean excess (A/m).
    pub fn step(&mut self, coil_field: f64, intersample: &IntersampleField, temperature_k: Option<f64>) -> (f64, f64) {
        let from = self.state.magnetization_a_per_m;
        if let Some(drift) = &mut self.thermal_drift {
            let before_k = self.rise_k;
            self.rise_k = match temperature_k {
                Some(known) => known - self.ambient_temperature_k,
                None => drift.warming.step(coil_field),
            };
            let drift = *drift;
            if drift.follows > 0.0 && self.rise_k != before_k {
                let shapes = [before_k, self.rise_k].map(|rise_k| drift.shape_factor(rise_k));
                let shapes = shapes.map(|factor| factor * self.hysteresis.shape_a_per_m);
                self.state.magnetization_a_per_m += drift.follows * self.hysteresis.moved_by_shape(self.state, shapes);
            }
        }
        let mut mean = 0.0;
        for piece in intersample.pieces() {
            mean += piece.span * self.piece(*piece);
        }
        let to = self.state.magnetization_a_per_m;
        (to, mean - 0.5 * (from + to))
    }

    /// Rise of the temperature where it counts here, K.
    pub fn rise_k(&self) -> Option<f64> {
        self.thermal_drift.as_ref().map(|_| self.rise_k)
    }

    /// One monotone piece; returns the mean of M over it.
    fn piece(&mut self, piece: Piece) -> f64 {
        let from = self.state;
        let change = piece.to - from.field_a_per_m;
        let mut hysteresis = self.hysteresis_now();
        // A jump to the first sample has no rate.
        if let Some(loss) = self.excess_loss.as_ref().filter(|_| piece.span > 0.0) {
            hysteresis.pinning_a_per_m *= loss.pinning_factor(change / piece.span);
        }
        let mut mean = match self.accommodation {
            Some(accommodation) => self.relaxing(&accommodation, &hysteresis, piece.to),
            None => self.moved(&hysteresis, piece.span, piece.to),
        };
        let state = self.state;
        // `mean` is that over the field; where the field is curved in time it dwells elsewhere.
        let mean_excess = piece.mean - 0.5 * (from.field_a_per_m + piece.to);
        if change != 0.0 {
            mean += mean_excess * (state.magnetization_a_per_m - from.magnetization_a_per_m) / change;
        }
        mean
    }

    /// The field goes there in a share of the tick; returns the mean of M over the field.
    #[inline]
    fn moved(&mut self, hysteresis: &Hysteresis, share: f64, field: f64) -> f64 {
        let from = self.state.magnetization_a_per_m;
        if let Some(other) = &mut self.other {
            let [middle, to] = other.moved(share, [self.state.field_a_per_m, field]);
            self.state = MagneticState {
                field_a_per_m: field,
                magnetization_a_per_m: to,
            };
            // Simpson's rule.
            return (from + 4.0 * middle + to) / 6.0;
        }
        let coarseness = if self.straight { 1.0 } else { COARSE };
        let (state, mean) = hysteresis.advance_with_mean(self.state, field, coarseness);
        self.state = state;
        if self.straight {
            0.5 * (from + state.magnetization_a_per_m)
        } else {
            mean
        }
    }

    /// The same with frozen walls that relax on the way.
    fn relaxing(&mut self, accommodation: &Accommodation, hysteresis: &Hysteresis, field: f64) -> f64 {
        let from = self.state.field_a_per_m;
        let change = field - from;
        let parts = accommodation.parts(change, hysteresis.pinning_a_per_m);
        let mut sum = 0.0;
        for part in 1..=parts as u32 {
            let before = lag(hysteresis, self.state);
            let mean = self.moved(hysteresis, 0.0, from + change * (f64::from(part) / parts));
            let after = lag(hysteresis, self.state);
            let relaxation = accommodation.relaxation(change / parts, before, after, hysteresis.pinning_a_per_m);
            self.state.magnetization_a_per_m += relaxation;
            sum += mean + 0.5 * relaxation;
        }
        sum / parts
    }
}

/// (Man − M)/(1 − cα ∂Man/∂He), A/m: what M would gain if its walls went all the way.
fn lag(hysteresis: &Hysteresis, state: MagneticState) -> f64 {
    (hysteresis.anhysteretic_at(state) - state.magnetization_a_per_m) / hysteresis.stiffness_of_bending(state)
}
