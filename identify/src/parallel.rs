//! The same work on many items by a few threads; results in the order of the items, whatever the timing.

use std::ops::ControlFlow;
use std::sync::Mutex;

/// f of every item, on up to `threads` threads.
pub fn map<T: Sync, R: Send>(threads: usize, items: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let mut done: Vec<(usize, R)> = Vec::with_capacity(items.len());
    let threads = threads.min(items.len());
    each(
        threads,
        0..items.len(),
        |index| (index, f(&items[index])),
        |result| {
            done.push(result);
            ControlFlow::Continue(())
        },
    );
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, result)| result).collect()
}

/// f of every item, on up to `threads` threads; each result goes to `keep` as soon as it is there, in whatever order. No item is begun
/// after `keep` has broken off.
pub fn each<T: Send, R: Send>(
    threads: usize,
    items: impl Iterator<Item = T> + Send,
    f: impl Fn(T) -> R + Sync,
    mut keep: impl FnMut(R) -> ControlFlow<()> + Send,
) {
    if threads <= 1 {
        for item in items {
            if keep(f(item)).is_break() {
                return;
            }
        }
        return;
    }
    // None from the moment when nothing is begun any more.
    let waiting = Mutex::new(Some(items));
    let keep = Mutex::new(keep);
    let next = || waiting.lock().ok()?.as_mut()?.next();
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(item) = next() {
                    let result = f(item);
                    // A poisoned lock means that another thread panicked: the scope passes that panic on.
                    let Ok(mut keep) = keep.lock() else { return };
                    if keep(result).is_break()
                        && let Ok(mut waiting) = waiting.lock()
                    {
                        *waiting = None;
                    }
                }
            });
        }
    });
}

/// Threads that this machine runs side by side.
pub fn available() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;

    /// Guards reproducibility: the order of results must not depend on which thread was faster.
    #[test]
    fn results_keep_their_order() {
        let items: Vec<u64> = (0..100).collect();
        let slow_first = |item: &u64| {
            std::thread::sleep(std::time::Duration::from_micros(100 - item));
            item * item
        };
        assert_eq!(
            super::map(4, &items, slow_first),
            super::map(1, &items, |item| item * item)
        );
    }

    /// Guards an end that is asked for: with one thread nothing follows it, with several nothing is begun after it.
    #[test]
    fn nothing_is_begun_after_a_break() {
        for threads in [1, 4] {
            let mut kept = 0;
            super::each(
                threads,
                0..1000,
                |item: u32| item,
                |_| {
                    kept += 1;
                    if kept == 10 {
                        ControlFlow::Break(())
                    } else {
                        ControlFlow::Continue(())
                    }
                },
            );
            // Those that were under way are kept, too.
            assert!((10..10 + threads).contains(&kept), "{kept}");
        }
    }
}
