//! v with h(v) = y for a law whose output does not fall with its input, the memory frozen at where it stands.
//!
//! Newton's step inside a bracket that every evaluation narrows; where the slope says nothing (a flat stretch, a kink) the
//! bracket is halved. A sum of plays is straight between its kinks, so that two or three steps end it; others gain digits
//! quadratically. It ends where the output is met to rounding or the bracket holds no other number.

use super::HysteresisLaw;

/// More halvings than a double has bits.
const MAX_STEPS: usize = 128;

/// See [`HysteresisLaw::input_for`].
pub(super) fn input_for<L: HysteresisLaw + ?Sized>(
    law: &L,
    state: &L::State,
    output_to: f64,
    input_limit: f64,
) -> (f64, bool) {
    let here = L::input(state);
    let inside = here.clamp(-input_limit, input_limit);
    if output_to.is_nan() || inside != here {
        return (inside, false);
    }
    let present = law.output(state);
    if output_to == present {
        return (here, true);
    }
    let rising = output_to > present;
    let end = if rising { input_limit } else { -input_limit };
    let sign = if rising { 1.0 } else { -1.0 };
    let short_of = |output: f64| sign * (output_to - output);
    let (at_end, _) = law.ahead(state, end);
    if short_of(at_end) > 0.0 {
        return (end, false);
    }
    let found = search(law, state, (here, present), (end, at_end), output_to, sign);
    (found, true)
}

/// Between a near input that is short of the demand and a far one that is not.
fn search<L: HysteresisLaw + ?Sized>(
    law: &L,
    state: &L::State,
    (mut near, at_near): (f64, f64),
    (mut far, at_far): (f64, f64),
    output_to: f64,
    sign: f64,
) -> f64 {
    let rounding = 2.0 * f64::EPSILON * at_near.abs().max(at_far.abs()).max(output_to.abs());
    let slope = law.slope(state, sign > 0.0);
    let mut tried = within(near + (output_to - at_near) / slope, near, far);
    // The best so far, for a rounding that is never met.
    let mut best = (far, (at_far - output_to).abs());
    for _ in 0..MAX_STEPS {
        let (output, slope) = law.ahead(state, tried);
        let error = output_to - output;
        if error.abs() < best.1 {
            best = (tried, error.abs());
        }
        if error.abs() <= rounding {
            break;
        }
        if sign * error > 0.0 {
            near = tried;
        } else {
            far = tried;
        }
        let newton = tried + error / slope;
        let next = within(newton, near, far);
        if next == tried || next == near || next == far {
            break;
        }
        tried = next;
    }
    best.0
}

/// A step, or the middle of the bracket where the step leaves it or is no number.
fn within(step: f64, near: f64, far: f64) -> f64 {
    let (low, high) = if near < far { (near, far) } else { (far, near) };
    if step > low && step < high {
        step
    } else {
        0.5 * (low + high)
    }
}
