//! v with h(v) = y for a law whose output does not fall with its input, the memory frozen at where it stands.
//!
//! Newton's step, at first towards a limit of which nothing is known but that the input may not pass it: a sample moves little, and what a
//! law would give at the limit costs some laws far more than all the rest. The step that goes beyond the demand closes a bracket, which
//! every evaluation narrows; so does the limit, once a step would leave it or many have stayed short. Where the slope says nothing (a flat
//! stretch, a kink) the bracket is halved; so it is where a step is not half as long as the one before the last: across a bend steps can
//! go to and fro between two points for ever. A sum of plays is straight between its kinks, so that two or three steps end it; others gain
//! digits quadratically. It ends where the output is met to rounding or the bracket holds no other number.
//! The guard against going to and fro: Press et al., *Numerical Recipes* (2007), §9.4.

use super::HysteresisLaw;

/// More halvings than a double has bits.
const MAX_STEPS: usize = 128;
/// So many steps may stay short of the demand before the limit is looked at.
const MAX_SHORT: usize = 8;

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
    search(law, state, (here, present), end, output_to, rising)
}

/// From an input that is short of the demand towards a limit.
fn search<L: HysteresisLaw + ?Sized>(
    law: &L,
    state: &L::State,
    (here, present): (f64, f64),
    end: f64,
    output_to: f64,
    rising: bool,
) -> (f64, bool) {
    let sign = if rising { 1.0 } else { -1.0 };
    let slope = law.slope(state, rising);
    // What the output changes by where the input's last digit does is no error; a slope that is no number says nothing.
    let mut size = present.abs().max(output_to.abs()).max((slope * here).abs());
    // The far one is not short of the demand; of the limit that is not known yet.
    let (mut near, mut far, mut bounded) = (here, end, false);
    // The best so far, for a rounding that is never met.
    let mut best = (here, (output_to - present).abs());
    let mut newton = here + (output_to - present) / slope;
    let mut tried = here;
    // How far the step before the last went, and the last.
    let mut lengths = [f64::INFINITY; 2];
    for step in 0..MAX_STEPS {
        if !bounded && (step == MAX_SHORT || !is_between(newton, near, far)) {
            let (at_end, _) = law.ahead(state, end);
            let error = output_to - at_end;
            if sign * error > 0.0 {
                return (end, false);
            }
            size = size.max(at_end.abs());
            if error.abs() < best.1 {
                best = (end, error.abs());
            }
            bounded = true;
        }
        let is_short = 2.0 * (newton - tried).abs() <= lengths[0];
        let next = if is_between(newton, near, far) && (is_short || !bounded) {
            newton
        } else {
            0.5 * (near + far)
        };
        if next == tried || next == near || next == far {
            break;
        }
        lengths = [lengths[1], (next - tried).abs()];
        tried = next;
        let (output, slope) = law.ahead(state, tried);
        let error = output_to - output;
        if error.abs() < best.1 {
            best = (tried, error.abs());
        }
        if error.abs() <= 2.0 * f64::EPSILON * size {
            break;
        }
        if sign * error > 0.0 {
            near = tried;
        } else {
            (far, bounded) = (tried, true);
        }
        newton = tried + error / slope;
    }
    (best.0, true)
}

fn is_between(tried: f64, near: f64, far: f64) -> bool {
    let (low, high) = if near < far { (near, far) } else { (far, near) };
    tried > low && tried < high
}
