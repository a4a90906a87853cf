//! How something goes over a run, in a few hundred windows whatever the run's length: when they are full, each two become one.

use serde::{Deserialize, Serialize};

const MAX_WINDOWS: usize = 256;

/// What is gathered in a window.
pub(crate) trait Gathered: Copy + Default {
    /// Both together, the later one second.
    fn with(self, later: Self) -> Self;
}

/// Windows of equally many ticks from tick 0 on.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Windows<W> {
    ticks: u64,
    windows: Vec<W>,
}

impl<W> Default for Windows<W> {
    fn default() -> Self {
        Self {
            ticks: 1,
            windows: Vec::with_capacity(MAX_WINDOWS),
        }
    }
}

impl<W: Gathered> Windows<W> {
    /// Takes in what a tick gives.
    pub fn add(&mut self, tick: u64, own: W) {
        while self.place(tick) >= MAX_WINDOWS {
            self.ticks *= 2;
            for place in 0..self.windows.len().div_ceil(2) {
                let later = self.windows.get(2 * place + 1).copied().unwrap_or_default();
                self.windows[place] = self.windows[2 * place].with(later);
            }
            self.windows.truncate(self.windows.len().div_ceil(2));
        }
        let place = self.place(tick);
        if self.windows.len() <= place {
            self.windows.resize(place + 1, W::default());
        }
        self.windows[place] = self.windows[place].with(own);
    }

    /// The window of a tick: their length is a power of two.
    fn place(&self, tick: u64) -> usize {
        (tick >> self.ticks.trailing_zeros()) as usize
    }

    /// Middles, s, and windows; those in which nothing came are empty.
    pub fn all(&self, tick_s: f64) -> impl Iterator<Item = (f64, &W)> {
        let middle_s = move |place: usize| (place as f64 + 0.5) * self.ticks as f64 * tick_s;
        let all = self.windows.iter().enumerate();
        all.map(move |(place, own)| (middle_s(place), own))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Clone, Copy, Default)]
    struct Ends {
        count: u64,
        first: u64,
        last: u64,
    }

    impl Gathered for Ends {
        fn with(self, later: Self) -> Self {
            match (self.count, later.count) {
                (0, _) => later,
                (_, 0) => self,
                (one, other) => Self {
                    count: one + other,
                    first: self.first,
                    last: later.last,
                },
            }
        }
    }

    /// Guards the halving: whatever the length, nothing is lost, counted twice, or told of another time.
    #[test]
    fn every_tick_is_in_the_window_of_its_time() {
        for ticks in [1, 255, 256, 257, 1000, 70_001] {
            let mut windows = Windows::default();
            for tick in 0..ticks {
                let own = Ends {
                    count: 1,
                    first: tick,
                    last: tick,
                };
                windows.add(tick, own);
            }
            let all: Vec<_> = windows.all(1.0).collect();
            assert!(all.len() <= MAX_WINDOWS, "{}", all.len());
            assert_eq!(all.iter().map(|(_, own)| own.count).sum::<u64>(), ticks);
            let half = 0.5 * windows.ticks as f64;
            for (middle, own) in all {
                assert!((own.last as f64) < middle + half && own.first as f64 >= middle - half);
            }
        }
    }
}
