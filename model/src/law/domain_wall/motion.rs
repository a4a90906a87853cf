//! A material on its way: the single model as its callers see it, and as a [`HysteresisLaw`].

use super::coefficients::Coefficients;
use super::{Hysteresis, HysteresisParameter, MagneticState, on_kernel};
use crate::curve::{IsingEverywhere, LangevinByRange};
use crate::kernel::Kernel;
use crate::law::{HysteresisLaw, LawParameter};
use crate::{Anhysteretic, ModelError};

impl Hysteresis {
    /// The state after the field has moved monotonically to `field_to_a_per_m`.
    ///
    /// Fourth order with substeps of at most [`Hysteresis::longest_substep_a_per_m`]: error of the order
    /// 1e-9 Ms over a loop. The result is continuous in the end field. A field that is not finite gives a
    /// magnetization that is not a number: nothing is guessed.
    pub fn advance(&self, state: MagneticState, field_to_a_per_m: f64) -> MagneticState {
        let longest = self.longest_substep_a_per_m();
        self.moved(state, field_to_a_per_m, longest).0
    }

    /// As [`Hysteresis::advance`] with substeps so many times longer, and the mean magnetization (A/m) on the way: what a
    /// rod feels of a whole tick.
    #[inline]
    pub(crate) fn advance_with_mean(
        &self,
        state: MagneticState,
        field_to_a_per_m: f64,
        coarseness: f64,
    ) -> (MagneticState, f64) {
        let longest = coarseness * self.longest_substep_a_per_m();
        self.moved(state, field_to_a_per_m, longest)
    }

    /// The state at a field, and the mean of M on the way.
    #[inline(always)]
    fn moved(&self, from: MagneticState, field_to: f64, longest: f64) -> (MagneticState, f64) {
        match self.anhysteretic {
            _ if self.cubic_coupling_m2_per_a2 != 0.0 => self.moved_with_cubic(from, field_to, longest),
            Anhysteretic::Langevin => self.moved_on::<LangevinByRange, false>(from, field_to, longest),
            Anhysteretic::Ising => self.moved_on::<IsingEverywhere, false>(from, field_to, longest),
        }
    }

    /// Apart, because inlined beside them it would slow down materials without b₃.
    #[inline(never)]
    fn moved_with_cubic(&self, from: MagneticState, field_to: f64, longest: f64) -> (MagneticState, f64) {
        match self.anhysteretic {
            Anhysteretic::Langevin => self.moved_on::<LangevinByRange, true>(from, field_to, longest),
            Anhysteretic::Ising => self.moved_on::<IsingEverywhere, true>(from, field_to, longest),
        }
    }

    #[inline(always)]
    fn moved_on<C: Kernel, const CUBIC: bool>(
        &self,
        from: MagneticState,
        field_a_per_m: f64,
        longest: f64,
    ) -> (MagneticState, f64) {
        let magnetization = from.magnetization_a_per_m;
        let (magnetization_a_per_m, mean) =
            self.travel::<f64, C, CUBIC>(self.parameters(), from, magnetization, field_a_per_m, longest);
        let end = MagneticState {
            field_a_per_m,
            magnetization_a_per_m,
        };
        (end, mean)
    }

    /// dM/dH at a state for a rising or a falling field: the derived form of (7), no unit.
    pub fn slope(&self, state: MagneticState, rising: bool) -> f64 {
        on_kernel!(self.slope_on(state, rising))
    }

    #[inline]
    pub(super) fn slope_on<C: Kernel, const CUBIC: bool>(&self, state: MagneticState, rising: bool) -> f64 {
        let direction = if rising { 1.0 } else { -1.0 };
        let coefficients = Coefficients::<f64, C, CUBIC>::of(self, direction);
        let (field, magnetization) = (state.field_a_per_m, state.magnetization_a_per_m);
        let fraction = coefficients.curve(field, magnetization);
        if coefficients.lag(&fraction, magnetization) * direction < 0.0 {
            coefficients.reversible_slope(&fraction, magnetization)
        } else {
            coefficients.slope_from(&fraction, magnetization)
        }
    }
}

impl HysteresisLaw for Hysteresis {
    type State = MagneticState;

    fn rest(&self) -> MagneticState {
        MagneticState::default()
    }

    fn parameters(&self) -> Vec<LawParameter> {
        let cubic = self.cubic_coupling_m2_per_a2;
        let any = [f64::NEG_INFINITY, f64::INFINITY];
        let of = |parameter: &HysteresisParameter| {
            let bounds = match parameter {
                HysteresisParameter::Coupling => any,
                HysteresisParameter::Reversibility => [0.0, 1.0],
                _ => [0.0, f64::INFINITY],
            };
            LawParameter::new(parameter.symbol(), parameter.of(self), bounds)
        };
        let prestress = (cubic != 0.0).then(|| LawParameter::new("cubic_coupling_m2_per_a2", cubic, any));
        HysteresisParameter::ALL.iter().map(of).chain(prestress).collect()
    }

    fn validate(&self) -> Result<(), ModelError> {
        self.validate()
    }

    fn input(state: &MagneticState) -> f64 {
        state.field_a_per_m
    }

    fn output(&self, state: &MagneticState) -> f64 {
        state.magnetization_a_per_m
    }

    fn advance(&self, state: &mut MagneticState, field_to: f64) {
        *state = self.advance(*state, field_to);
    }

    fn ahead(&self, state: &MagneticState, field_to: f64) -> (f64, f64) {
        let there = self.advance(*state, field_to);
        let slope = self.slope(there, field_to > state.field_a_per_m);
        (there.magnetization_a_per_m, slope)
    }

    fn slope(&self, state: &MagneticState, rising: bool) -> f64 {
        self.slope(*state, rising)
    }

    /// By the law's own inverse, which knows its phases.
    fn input_for(&self, state: &MagneticState, magnetization_to: f64, field_limit: f64) -> (f64, bool) {
        let inversion = self.advance_to_magnetization(*state, magnetization_to, field_limit);
        (inversion.state.field_a_per_m, !inversion.limited)
    }
}
