//! How hard a fit looks.

/// How hard to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawOptions {
    /// Parts that are kept back in turn.
    pub folds: usize,
    /// Places that are tried before the search closes in, for each inner number.
    pub draws: usize,
    /// Steps of the search.
    pub steps: u64,
    /// More samples than this are thinned for the search, turning points kept.
    pub samples: usize,
    pub seed: u64,
}

impl Default for LawOptions {
    fn default() -> Self {
        LawOptions {
            folds: 5,
            draws: 8,
            steps: 50,
            samples: 20_000,
            seed: 1,
        }
    }
}
