//! The step between the values of a series, if they stand on a lattice: a converter's last bit or a file's last digit.
//!
//! The step is the greatest common divisor of the small differences between sorted values, found as Euclid does, with
//! a tolerance. Values that lie anywhere give a divisor that fits none of them and are told so.

/// Differences up to this many of the smallest one are looked at; larger ones add up the error of the step.
const NEAREST: f64 = 10.5;
/// Fewest differences that can show a lattice: around its crests a sampled sine has a few that are 1, 3, 5, ... of one.
const MIN_DIFFERENCES: usize = 16;
/// Of steps as coarse as the motion fewer do, where all are alike and each value comes this often: noise never repeats itself.
const MIN_COARSE: usize = 3;
const REPEATED: usize = 20;
/// A remainder below this share of the step is rounding.
const REMAINDER: f64 = 0.05;
/// Share of the differences that must fit.
const FITTING: f64 = 0.98;
/// Values nearer than this share of the largest one are the same value, written with rounding. The coarsest share with
/// which a lattice shows wins: a converter's steps stand above the last digit of the file.
const SAME: [f64; 5] = [1e-5, 1e-6, 1e-7, 1e-8, 1e-12];

/// Step of the lattice on which the values stand, in their unit.
pub fn resolution(series: &[f64]) -> Option<f64> {
    let mut sorted = series.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let largest = sorted.first()?.abs().max(sorted.last()?.abs());
    SAME.iter().find_map(|share| lattice(&sorted, share * largest))
}

fn lattice(sorted: &[f64], same: f64) -> Option<f64> {
    let mut last = sorted[0];
    let mut differences = Vec::new();
    for &value in sorted {
        if value - last > same {
            differences.push(value - last);
            last = value;
        }
    }
    let all = differences.len();
    let smallest = differences.iter().copied().fold(f64::INFINITY, f64::min);
    let mut near: Vec<f64> = differences
        .into_iter()
        .filter(|difference| *difference < NEAREST * smallest)
        .collect();
    let is_coarse = near.len() == all && (all + 1) * REPEATED < sorted.len();
    let min = if is_coarse { MIN_COARSE } else { MIN_DIFFERENCES };
    // Steps as small as what counts as the same are made by this very bound.
    if near.len() < min || smallest < 10.0 * same {
        return None;
    }
    near.sort_unstable_by(f64::total_cmp);
    let step = common_divisor(&near);
    let fits = |difference: &&f64| {
        let count = **difference / step;
        (count - count.round()).abs() < 2.0 * REMAINDER
    };
    let fitting = near.iter().filter(fits).count();
    (fitting as f64 >= FITTING * near.len() as f64).then_some(step)
}

/// Euclid's step over ascending differences; what was seen before refines the divisor.
fn common_divisor(differences: &[f64]) -> f64 {
    let smallest = differences[0];
    let (mut step, mut sum, mut steps) = (smallest, 0.0, 0.0);
    for (seen, &difference) in differences.iter().enumerate() {
        let remainder = (difference % step).min(step - difference % step);
        if remainder > REMAINDER * smallest {
            step = remainder;
            // Happens a few times at most: every divisor is a share of the one before.
            steps = differences[..seen].iter().map(|before| (before / step).round()).sum();
        }
        sum += difference;
        steps += (difference / step).round();
        step = sum / steps;
    }
    step
}

#[cfg(test)]
mod tests {
    //! Guards the step: a lattice seen where there is none would put a false floor under the noise.
    use super::*;
    use rand_chacha::ChaCha8Rng;
    use rand_chacha::rand_core::{Rng, SeedableRng};

    fn smooth(samples: usize) -> Vec<f64> {
        let mut random = ChaCha8Rng::seed_from_u64(1);
        (0..samples)
            .map(|i| 40e-6 * (i as f64 * 0.01).sin() + 20e-9 * (random.next_u32() as f64 / u32::MAX as f64))
            .collect()
    }

    /// Steps of a fifth of the motion leave six values.
    #[test]
    fn a_converter_of_few_steps_is_seen() {
        let step = 17e-6;
        let rounded: Vec<f64> = smooth(4000).iter().map(|x| (x / step).round() * step).collect();
        let found = resolution(&rounded).expect("a lattice");
        assert!((found / step - 1.0).abs() < 1e-6, "{found}");
    }

    #[test]
    fn digits_of_a_file_are_seen() {
        for step in [1e-9, 0.2038e-6] {
            let rounded: Vec<f64> = smooth(4000).iter().map(|x| (x / step).round() * step).collect();
            let found = resolution(&rounded).expect("a lattice");
            assert!((found / step - 1.0).abs() < 1e-3, "{found} instead of {step}");
        }
    }

    #[test]
    fn the_step_may_never_occur_alone() {
        let values: Vec<f64> = (0..400)
            .map(|i| f64::from(i / 2) * 7.0 + f64::from(i % 2) * 3.0)
            .collect();
        assert!((resolution(&values).expect("a lattice") - 1.0).abs() < 1e-9);
    }

    #[test]
    fn values_anywhere_have_no_step() {
        let sine: Vec<f64> = (0..8000)
            .map(|i| 1.8 * (std::f64::consts::TAU * f64::from(i % 200) / 200.0).sin())
            .collect();
        assert_eq!(resolution(&sine), None);
        assert_eq!(resolution(&smooth(4000)), None);
        assert_eq!(resolution(&[1.0; 50]), None);
        assert_eq!(resolution(&[]), None);
    }
}
