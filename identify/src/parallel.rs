//! The same work on many items by a few threads; results in the order of the items, whatever the timing.
//!
//! Here long work is given up, too: all of it comes by here many times a second. After [`give_up`] the next item of any work on any thread
//! unwinds as a panic does, without its message, up to whoever catches [`GivenUp`]: no function on the way need know of it.

use std::any::Any;
use std::ops::ControlFlow;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

/// What unwinds from work that was given up.
pub struct GivenUp;

static GIVING_UP: AtomicBool = AtomicBool::new(false);

/// Ends what this process works on, here and in other threads, at the next item.
pub fn give_up() {
    GIVING_UP.store(true, Ordering::Relaxed);
}

/// Takes it back: work may begin again.
pub fn go_on() {
    GIVING_UP.store(false, Ordering::Relaxed);
}

fn stand_by() {
    if GIVING_UP.load(Ordering::Relaxed) {
        resume_unwind(Box::new(GivenUp));
    }
}

/// f of every item, on up to `threads` threads.
pub fn map<T: Sync, R: Send>(threads: usize, items: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let mut done: Vec<Option<R>> = items.iter().map(|_| None).collect();
    each(
        threads,
        0..items.len(),
        |index| (index, f(&items[index])),
        |(index, result)| {
            done[index] = Some(result);
            ControlFlow::Continue(())
        },
    );
    done.into_iter().flatten().collect()
}

/// f of every item, on up to `threads` threads and no more than there can be items; each result goes to `keep` as soon as it is there, in
/// whatever order. No item is begun after `keep` has broken off.
pub fn each<T: Send, R: Send>(
    threads: usize,
    items: impl Iterator<Item = T> + Send,
    f: impl Fn(T) -> R + Sync,
    mut keep: impl FnMut(R) -> ControlFlow<()> + Send,
) {
    let threads = items.size_hint().1.map_or(threads, |most| threads.min(most));
    if threads <= 1 {
        for item in items {
            stand_by();
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
    let unwound: Mutex<Option<Box<dyn Any + Send>>> = Mutex::new(None);
    let work = |item: T| {
        let done = catch_unwind(AssertUnwindSafe(|| {
            stand_by();
            f(item)
        }));
        done.map_err(|payload| {
            if let (Ok(mut waiting), Ok(mut unwound)) = (waiting.lock(), unwound.lock()) {
                *waiting = None;
                unwound.get_or_insert(payload);
            }
        })
    };
    std::thread::scope(|scope| {
        for _ in 0..threads {
            scope.spawn(|| {
                while let Some(item) = next() {
                    let Ok(result) = work(item) else { return };
                    // A poisoned lock means that another thread panicked in it: the scope passes that panic on.
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
    // As it was thrown, so that whoever catches it knows what it is.
    if let Ok(Some(payload)) = unwound.into_inner() {
        resume_unwind(payload);
    }
}

/// Threads that this machine runs side by side.
pub fn available() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

#[cfg(test)]
mod tests {
    use std::ops::ControlFlow;
    use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};

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

    /// Guards the system's threads: no more are begun than there are items, however many are allowed.
    #[test]
    fn no_more_threads_than_items_are_begun() {
        let own = std::thread::current().id();
        for threads in [1, 1_000_000] {
            let by = super::map(threads, &[()], |()| std::thread::current().id());
            assert_eq!(by, [own], "{threads}");
        }
    }

    /// Guards the end of work that was given up: it unwinds out of nested work on other threads as what it is.
    #[test]
    fn work_that_is_given_up_unwinds_as_such() {
        // Of this test alone: a flag of the process would end others' work.
        let nested = |_: &u32| super::map(2, &[0, 1], |_: &u32| -> u32 { resume_unwind(Box::new(super::GivenUp)) });
        for threads in [1, 3] {
            let unwound = catch_unwind(AssertUnwindSafe(|| super::map(threads, &[0, 1, 2, 3], nested)));
            assert!(
                unwound.is_err_and(|payload| payload.is::<super::GivenUp>()),
                "{threads}"
            );
        }
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
