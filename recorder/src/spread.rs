//! How large the tracking error was: its maximum for the event table, and a quantile that fits the height of the error
//! plot. The maximum does not: one fault of 40 µm would flatten hours of 10 nm.

/// Bits of a number that do not tell its bin: 16 bins double it.
const SHIFT: u32 = 48;
/// Below 1 pm everything is zero.
const SMALLEST: u64 = 1e-12f64.to_bits() >> SHIFT;
/// Up to 1 m.
const BINS: usize = 40 * 16;

/// Histogram of absolute errors.
#[derive(Debug, Clone)]
pub(crate) struct Spread {
    bins: [u64; BINS],
    count: u64,
    largest_m: f64,
}

impl Default for Spread {
    fn default() -> Self {
        Self {
            bins: [0; BINS],
            count: 0,
            largest_m: 0.0,
        }
    }
}

impl Spread {
    /// Takes in one error; what is not finite is left out.
    pub fn add(&mut self, error_m: f64) {
        if !error_m.is_finite() {
            return;
        }
        let size = error_m.abs();
        let bin = (size.to_bits() >> SHIFT).saturating_sub(SMALLEST) as usize;
        self.bins[bin.min(BINS - 1)] += 1;
        self.count += 1;
        self.largest_m = self.largest_m.max(size);
    }

    /// The largest error.
    pub fn largest_m(&self) -> f64 {
        self.largest_m
    }

    /// An error that a fraction `share` of all errors does not exceed; None without errors.
    pub fn quantile_m(&self, share: f64) -> Option<f64> {
        let wanted = (share * self.count as f64).ceil() as u64;
        let mut seen = 0;
        let bin = self.bins.iter().position(|count| {
            seen += count;
            seen >= wanted.max(1)
        })?;
        Some(f64::from_bits((SMALLEST + bin as u64 + 1) << SHIFT).min(self.largest_m))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Guards: rare large errors do not set the quantile, and the maximum remembers them.
    #[test]
    fn rare_errors_do_not_rule() {
        let mut spread = Spread::default();
        assert_eq!(spread.quantile_m(0.98), None);
        (0..990).for_each(|_| spread.add(-1e-8));
        (0..10).for_each(|_| spread.add(4e-5));
        spread.add(f64::NAN);
        let quantile = spread.quantile_m(0.98).unwrap();
        assert!((1e-8..1.1e-8).contains(&quantile), "{quantile}");
        assert_eq!(spread.largest_m(), 4e-5);
    }
}
