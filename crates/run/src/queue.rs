//! A list of runs of which several execute at once.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;

/// Calls `work` with each item of a list, at most `jobs` calls at the same time, in the order of
/// the list. The arguments are the number of the job (below `jobs`), the index of the item and the
/// item. After a call that returns `Break` or panics no further item is taken; the calls in
/// progress go on to their ends.
///
/// # Panics
/// If `work` panics.
pub fn for_each<T: Sync>(
    jobs: usize,
    items: &[T],
    work: impl Fn(usize, usize, &T) -> ControlFlow<()> + Sync,
) {
    let next = AtomicUsize::new(0);
    let closed = AtomicBool::new(false);
    let take_items = |job| {
        while !closed.load(Ordering::Relaxed) {
            let n = next.fetch_add(1, Ordering::Relaxed);
            let Some(item) = items.get(n) else { break };
            let guard = CloseOnPanic(&closed);
            let flow = work(job, n, item);
            drop(guard);
            if flow.is_break() {
                closed.store(true, Ordering::Relaxed);
            }
        }
    };
    thread::scope(|scope| {
        for job in 0..jobs.clamp(1, items.len().max(1)) {
            let take_items = &take_items;
            scope.spawn(move || take_items(job));
        }
    });
}

/// Closes the queue if it is dropped by a panic.
struct CloseOnPanic<'a>(&'a AtomicBool);

impl Drop for CloseOnPanic<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.store(true, Ordering::Relaxed);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::{Barrier, Mutex};

    #[test]
    fn each_item_is_taken_once_and_in_order_by_one_job() {
        let items = [10, 20, 30, 40];
        let taken = Mutex::new(Vec::new());
        for_each(1, &items, |job, n, item| {
            taken.lock().unwrap().push((job, n, *item));
            ControlFlow::Continue(())
        });
        let taken = taken.into_inner().unwrap();
        assert_eq!(taken, [(0, 0, 10), (0, 1, 20), (0, 2, 30), (0, 3, 40)]);
    }

    #[test]
    fn as_many_items_as_jobs_are_worked_on_at_once() {
        let (meeting, jobs_seen) = (Barrier::new(3), Mutex::new(Vec::new()));
        for_each(3, &[(); 3], |job, _, ()| {
            // Passes only if all three calls are in progress.
            meeting.wait();
            jobs_seen.lock().unwrap().push(job);
            ControlFlow::Continue(())
        });
        let mut jobs = jobs_seen.into_inner().unwrap();
        jobs.sort_unstable();
        assert_eq!(jobs, [0, 1, 2]);
        for_each(5, &[] as &[u8], |_, _, _| panic!("nothing to take"));
    }

    #[test]
    fn a_break_or_a_panic_closes_the_queue() {
        let count = AtomicUsize::new(0);
        let stop_at = |last: usize, how: fn() -> ControlFlow<()>| {
            count.store(0, Ordering::Relaxed);
            for_each(1, &[(); 9], |_, n, ()| {
                count.fetch_add(1, Ordering::Relaxed);
                if n == last { how() } else { ControlFlow::Continue(()) }
            });
        };
        stop_at(2, || ControlFlow::Break(()));
        assert_eq!(count.load(Ordering::Relaxed), 3);
        let panicked = std::panic::catch_unwind(|| stop_at(4, || panic!("for the test")));
        assert!(panicked.is_err());
        assert_eq!(count.load(Ordering::Relaxed), 5);
    }
}
