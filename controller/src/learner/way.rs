//! T, the way from a harmonic of the demand to the displacement with the loop closed, and e, the error at it: a Kalman filter of two complex numbers.
//!
//! After a change ΔC: e ← e − T·ΔC. Heard: E = e + noise of variance σ². State (e, T), covariance [[Pee, Pet], [P̄et, Ptt]].
//! Within a cycle T wanders by 1 % of itself, e by the scatter σ and by what the other harmonics do to this one, 2 % of their motions' sum.

use crate::complex::Complex;
use serde::{Deserialize, Serialize};

/// Standard deviation of T before anything is heard, as a part of the model's; smaller brings long steps where the model errs.
const DOUBT: f64 = 2.0;
/// Where it was told by its neighbours at another speed.
const TOLD: f64 = 0.3;
/// T's own way from cycle to cycle, and where the error grew, as parts of it.
const WANDERS: f64 = 0.01;
const SHAKEN: f64 = 0.1;
/// What a motion of all other harmonics does to this one.
const COUPLING: f64 = 0.02;
/// Standard deviations beyond which the load has changed, or T was quite another.
const GATE: f64 = 5.0;
/// T stays within these parts of the model's: too large is only slow, too small is unstable.
const BOUNDS: (f64, f64) = (0.15, 100.0);

#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Way {
    model: Complex,
    way: Complex,
    error_m: Complex,
    change_m: Complex,
    pee: f64,
    pet: Complex,
    ptt: f64,
}

impl Way {
    /// As the model has it.
    pub fn believed(model: Complex) -> Self {
        Self {
            model,
            way: model,
            ptt: DOUBT * DOUBT * model.square(),
            ..Self::default()
        }
    }

    /// At another frequency: as far from the model there as between two that were heard.
    pub fn between(low: &Self, high: &Self, share: f64, model: Complex) -> Self {
        let ratio = |own: &Self| own.way.over(own.model);
        let (from, to) = (ratio(low), ratio(high));
        let doubt = |own: &Self| own.ptt / own.way.square();
        let way = model.times(from.plus(to.minus(from).scaled(share)));
        let doubt = doubt(low).max(doubt(high)).max(TOLD * TOLD);
        Self {
            model,
            way,
            ptt: (doubt * way.square()).min(Self::believed(model).ptt),
            ..Self::default()
        }
    }

    /// All of it are numbers, and T is one to divide by.
    pub fn is_usable(&self) -> bool {
        let all = [self.model, self.way, self.error_m, self.change_m, self.pet];
        let sizes = all.iter().map(|own| own.square()).chain([self.pee, self.ptt]);
        sizes.sum::<f64>().is_finite() && self.way.square() > 0.0
    }

    /// How far the last change moved the displacement, m.
    pub fn moved_m(&self) -> f64 {
        self.way.times(self.change_m).magnitude()
    }

    /// Takes an error in that no step of its own led to.
    pub fn hear_anew(&mut self, heard_m: Complex, variance: f64) {
        self.error_m = heard_m;
        self.pee = variance;
        self.pet = Complex::ZERO;
        self.change_m = Complex::ZERO;
    }

    /// Takes in what was heard after the last change; `moved_m` is how far all harmonics moved the displacement.
    pub fn hear(&mut self, heard_m: Complex, moved_m: f64, scatter_m: f64) {
        let variance = scatter_m * scatter_m;
        let change = self.change_m;
        let others_m = COUPLING * (moved_m - self.moved_m());
        self.pee +=
            change.square() * self.ptt - 2.0 * change.conjugate().times(self.pet).re + variance + others_m * others_m;
        self.pet = self.pet.minus(change.scaled(self.ptt));
        self.error_m = self.error_m.minus(self.way.times(change));
        let news = heard_m.minus(self.error_m);
        if news.square() > GATE * GATE * (self.pee + variance) {
            self.pee += news.square();
            // As likely the one as the other, as long as any loop may have such a T.
            let unlikely = BOUNDS.1 * BOUNDS.1 * self.model.square();
            let surprise = news.square() / change.square().max(f64::MIN_POSITIVE);
            if surprise < unlikely {
                self.ptt += surprise;
                self.pet = self.pet.minus(change.scaled(surprise));
                self.pee += news.square();
            }
        }
        let total = self.pee + variance;
        let of_error = self.pee / total;
        let of_way = self.pet.conjugate().scaled(1.0 / total);
        self.error_m = self.error_m.plus(news.scaled(of_error));
        self.way = self.way.plus(news.times(of_way));
        self.ptt = (self.ptt - of_way.square() * total).max(0.0);
        self.pet = self.pet.scaled(1.0 - of_error);
        self.pee *= 1.0 - of_error;
        self.wander(WANDERS);
        let (size, model) = (self.way.magnitude(), self.model.magnitude());
        let bounded = size.clamp(BOUNDS.0 * model, BOUNDS.1 * model);
        self.way = if size > 0.0 {
            self.way.scaled(bounded / size)
        } else {
            self.model
        };
    }

    /// Square of the largest motion that the last change may have made, two standard deviations included.
    pub fn most_m2(&self) -> f64 {
        let most = self.way.magnitude() + 2.0 * self.ptt.sqrt();
        most * most * self.change_m.square()
    }

    /// T is less sure than it was thought.
    pub fn doubt(&mut self) {
        self.ptt *= 4.0;
        self.wander(SHAKEN);
    }

    fn wander(&mut self, part: f64) {
        let most = Self::believed(self.model).ptt.max(self.ptt);
        self.ptt = (self.ptt + part * part * self.way.square()).min(most);
    }

    /// ΔC that takes `gain` of the error away, with caution; at most so many times what the model needs.
    pub fn step(&self, gain: f64, longest: f64) -> Complex {
        let step = self
            .way
            .conjugate()
            .times(self.error_m)
            .scaled(gain / (self.way.square() + self.ptt));
        let most_m = longest * self.error_m.magnitude() / self.model.magnitude();
        let size_m = step.magnitude();
        if size_m > most_m {
            step.scaled(most_m / size_m)
        } else {
            step
        }
    }

    /// What the demand was really changed by.
    pub fn changed(&mut self, change_m: Complex) {
        self.change_m = change_m;
    }
}
