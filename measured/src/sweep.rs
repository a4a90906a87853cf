//! A measured field made fit to drive a rate-independent model.
//!
//! Every change of sign of a noisy dH is a reversal to such a model, so noise ratchets it. The whole sweep is
//! known here, so nothing needs to lag: turning points are those extremes from which the field retreats by more
//! than a threshold, and between two of them the field is replaced by the monotone sequence nearest to it in
//! least squares (isotonic regression, pool adjacent violators; Barlow et al. 1972). A clean sweep stays as it is.

/// Retreat that counts as a reversal, as a share of the field's range.
pub const DEFAULT_THRESHOLD: f64 = 0.005;

/// Indices where the field turns round by more than `threshold` of its range, without first and last sample.
pub fn turning_points(field: &[f64], threshold: f64) -> Vec<usize> {
    let (low, high) = extremes(field);
    let retreat = threshold * (high - low);
    let mut turns = Vec::new();
    // Highest and lowest sample since the last turn; the direction is open until one of them is left behind.
    let (mut top, mut bottom) = (0, 0);
    let mut rising = None;
    for (index, &value) in field.iter().enumerate() {
        if value >= field[top] {
            top = index;
        }
        if value <= field[bottom] {
            bottom = index;
        }
        if rising != Some(false) && field[top] - value > retreat {
            if top > 0 {
                turns.push(top);
            }
            (rising, bottom, top) = (Some(false), index, index);
        } else if rising != Some(true) && value - field[bottom] > retreat {
            if bottom > 0 {
                turns.push(bottom);
            }
            (rising, top, bottom) = (Some(true), index, index);
        }
    }
    turns
}

/// The field, monotone between its turning points.
pub fn monotone_between_turns(field: &[f64], threshold: f64) -> Vec<f64> {
    let mut cleaned = field.to_vec();
    let mut bounds = vec![0];
    bounds.extend(turning_points(field, threshold));
    bounds.push(field.len().saturating_sub(1));
    for pair in bounds.windows(2) {
        let (first, last) = (pair[0], pair[1]);
        if last <= first {
            continue;
        }
        // The turning point itself is an extreme of both branches and stays.
        let inner = first + usize::from(first > 0)..last + usize::from(last + 1 == field.len());
        let sign = if field[last] >= field[first] { 1.0 } else { -1.0 };
        isotonic(&mut cleaned[inner], sign);
    }
    cleaned
}

/// Pool adjacent violators: nearest sequence in least squares that never goes against `sign`.
fn isotonic(values: &mut [f64], sign: f64) {
    let mut pools: Vec<(f64, usize)> = Vec::new();
    for &value in values.iter() {
        pools.push((value, 1));
        while let [.., (before, before_count), (mean, count)] = pools[..] {
            if sign * before <= sign * mean {
                break;
            }
            let total = before_count + count;
            pools.truncate(pools.len() - 2);
            pools.push((
                (before * before_count as f64 + mean * count as f64) / total as f64,
                total,
            ));
        }
    }
    let means = pools
        .into_iter()
        .flat_map(|(mean, count)| std::iter::repeat_n(mean, count));
    values.iter_mut().zip(means).for_each(|(value, mean)| *value = mean);
}

/// Smallest and largest value; infinite and the wrong way round for an empty series.
pub fn extremes(series: &[f64]) -> (f64, f64) {
    series
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| {
            (low.min(value), high.max(value))
        })
}

#[cfg(test)]
mod tests {
    //! Guards the drive of the model: noise must not become reversals, and a clean sweep must not change.
    use super::*;

    fn triangle(samples: usize) -> Vec<f64> {
        (0..samples)
            .map(|i| {
                let phase = 4.0 * i as f64 / samples as f64;
                if phase < 1.0 {
                    phase
                } else if phase < 3.0 {
                    2.0 - phase
                } else {
                    phase - 4.0
                }
            })
            .collect()
    }

    #[test]
    fn a_clean_sweep_stays_as_it_is() {
        let field = triangle(400);
        assert_eq!(turning_points(&field, DEFAULT_THRESHOLD), vec![100, 300]);
        assert_eq!(monotone_between_turns(&field, DEFAULT_THRESHOLD), field);
    }

    #[test]
    fn small_retreats_are_pooled_without_bias() {
        let clean = triangle(400);
        let noisy: Vec<f64> = clean
            .iter()
            .enumerate()
            .map(|(i, h)| h + 0.003 * (i as f64 * 2.4).sin())
            .collect();
        let turns = turning_points(&noisy, 0.02);
        assert_eq!(turns.len(), 2, "{turns:?}");
        let cleaned = monotone_between_turns(&noisy, 0.02);
        let reversals = cleaned
            .windows(3)
            .filter(|w| (w[1] - w[0]) * (w[2] - w[1]) < 0.0)
            .count();
        assert_eq!(reversals, 2);
        let bias: f64 = cleaned.iter().zip(&clean).map(|(c, h)| c - h).sum::<f64>() / 400.0;
        assert!(bias.abs() < 3e-4, "{bias}");
    }
}
