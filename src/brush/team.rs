//! Threads that share the work on a brush.
//!
//! A step consists of about a hundred loops over groups of filaments, many of which take less time than it takes to wake up a thread.
//! Therefore threads do not sleep in between: they look for work until the steps are done.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::{hint, iter, mem};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder, Yield};

/// Threads, or the calling one alone.
pub struct Team(Option<ThreadPool>);

impl Team {
    /// So many threads.
    ///
    /// # Errors
    /// If the system refuses them.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let pool = (threads > 1).then(|| ThreadPoolBuilder::new().num_threads(threads).build());
        pool.transpose().map(Self)
    }

    /// Does `work` on all items: on each with all threads, which share the loops of [`for_each`] in it, or, if there are enough items, on
    /// each with a thread of its own.
    pub fn run<T: Send>(&self, mut items: impl ExactSizeIterator<Item = T> + Send, work: impl Fn(T) + Sync) {
        let Some(pool) = &self.0 else { return items.for_each(work) };
        let threads = pool.current_num_threads();
        if items.len() < 2 * threads {
            return pool.install(|| awake(|| items.for_each(&work)));
        }
        let items = Mutex::new(&mut items);
        let next = || items.lock().unwrap_or_else(PoisonError::into_inner).next();
        thread::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|| iter::from_fn(next).for_each(&work));
            }
        });
    }
}

/// Takes one off a number in the end, even if there is a panic before.
struct Done<'a>(&'a AtomicUsize);

impl Drop for Done<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Release);
    }
}

/// Does `work`, while the other threads look for parts of it.
fn awake<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let (left, own) = (AtomicUsize::new(1), rayon::current_thread_index());
    rayon::scope(|scope| {
        scope.spawn_broadcast(|_, context| {
            if Some(context.index()) != own {
                help_until_none(&left);
            }
        });
        let _done = Done(&left);
        work()
    })
}

/// Does the work of others until nothing is `left`.
fn help_until_none(left: &AtomicUsize) {
    /// Short waits before another program may have the processor.
    const SPINS: usize = 64;
    let mut spins = 0;
    while left.load(Ordering::Acquire) > 0 {
        if rayon::yield_now() == Some(Yield::Executed) {
            spins = 0;
        } else if spins < SPINS {
            spins += 1;
            hint::spin_loop();
        } else {
            thread::yield_now();
        }
    }
}

/// Does `work` on all items, in an order that is not determined, on all threads of the [`Team`] that this is called in. Items come with the
/// number of their group, so that a group stays with one thread, whose caches know it.
pub fn for_each<T: Send>(items: impl Iterator<Item = (usize, T)>, work: impl Fn(T) + Sync) {
    let threads = rayon::current_thread_index().map_or(1, |_| rayon::current_num_threads());
    if threads == 1 {
        items.for_each(|(_, item)| work(item));
        return;
    }
    let mut parts: Vec<Vec<T>> = (0..threads).map(|_| Vec::new()).collect();
    items.for_each(|(group, item)| parts[group % threads].push(item));
    let parts: Vec<Mutex<Vec<T>>> = parts.into_iter().map(Mutex::new).collect();
    // First its own part, then those that others have not begun.
    let take_parts = || {
        let own = rayon::current_thread_index().unwrap_or(0);
        for part in (own..threads).chain(0..own) {
            let items = mem::take(&mut *parts[part].lock().unwrap_or_else(PoisonError::into_inner));
            items.into_iter().for_each(&work);
        }
    };
    let left = AtomicUsize::new(threads - 1);
    rayon::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|_| {
                let _done = Done(&left);
                take_parts();
            });
        }
        take_parts();
        help_until_none(&left);
    });
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    fn count(threads: usize, items: usize, of_each: usize) -> Vec<usize> {
        let team = Team::new(threads).expect("threads");
        let mut counts = vec![vec![0; of_each]; items];
        team.run(counts.iter_mut(), |counts| {
            for _ in 0..50 {
                for_each(counts.iter_mut().enumerate(), |count| *count += 1);
            }
        });
        counts.concat()
    }

    #[test]
    fn every_item_is_done_once() {
        for threads in 1..5 {
            for items in [1, 2, 9] {
                assert_eq!(count(threads, items, 13), vec![50; 13 * items]);
            }
        }
    }

    #[test]
    fn a_panic_ends_the_work_of_all_threads() {
        for items in [1, 9] {
            let team = Team::new(2).expect("threads");
            let work = |_| for_each((0..8).map(|k| (k, k)), |k| assert!(k != 5, "on purpose"));
            assert!(catch_unwind(AssertUnwindSafe(|| team.run(0..items, work))).is_err());
        }
    }
}
