//! What was worked out lately and is likely to be asked for again, and how much was worked out at all.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// The last few answers, by what was asked.
pub(crate) struct Recent<K, V> {
    kept: usize,
    answers: Mutex<VecDeque<(K, Arc<V>)>>,
}

impl<K, V> Recent<K, V> {
    pub fn new(kept: usize) -> Self {
        Recent {
            kept,
            answers: Mutex::new(VecDeque::new()),
        }
    }

    /// The answer to what is asked, worked out if it is not there.
    pub fn get(
        &self,
        is_asked: impl Fn(&K) -> bool,
        asked: impl FnOnce() -> K,
        answer: impl FnOnce() -> Option<V>,
    ) -> Option<Arc<V>> {
        let lock = || self.answers.lock().unwrap_or_else(PoisonError::into_inner);
        let mut answers = lock();
        if let Some(place) = answers.iter().position(|(own, _)| is_asked(own)) {
            let own = answers.remove(place)?;
            let answer = own.1.clone();
            answers.push_front(own);
            return Some(answer);
        }
        drop(answers);
        let answer = Arc::new(answer()?);
        let mut answers = lock();
        answers.push_front((asked(), answer.clone()));
        answers.truncate(self.kept);
        Some(answer)
    }
}

/// How often something was done.
#[derive(Default)]
pub(crate) struct Tally(AtomicUsize);

impl Tally {
    pub fn count(&self) {
        self.0.fetch_add(1, Ordering::Relaxed);
    }

    pub fn so_far(&self) -> usize {
        self.0.load(Ordering::Relaxed)
    }
}
