//! Independent work on all cores, results in the order of the work.

use anhyst_identify::parallel;

/// `work` of every item and its place, on `threads` threads. What an item gives must not depend on the others.
pub fn map<T: Sync, R: Send>(threads: usize, items: &[T], work: impl Fn(usize, &T) -> R + Sync) -> Vec<R> {
    let numbered: Vec<(usize, &T)> = items.iter().enumerate().collect();
    parallel::map(threads, &numbered, |(place, item)| work(*place, item))
}

#[cfg(test)]
mod tests {
    // Guards the order: whichever thread is first, results stand where their items stood.
    #[test]
    fn results_stand_in_the_order_of_the_items() {
        let items: Vec<u64> = (0..100).collect();
        let squares = super::map(4, &items, |i, item| {
            std::thread::sleep(std::time::Duration::from_micros(100 - item));
            i as u64 * item
        });
        assert_eq!(squares, items.iter().map(|item| item * item).collect::<Vec<_>>());
        assert!(super::map(4, &[], |_, item: &u64| *item).is_empty());
    }
}
