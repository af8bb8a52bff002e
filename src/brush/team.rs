//! Threads that share the work on a brush.
//!
//! A step consists of about a hundred loops over groups of filaments, many of which take less time
//! than it takes to wake up a thread. Therefore threads do not sleep in between: they look for
//! work, and only those that have found none for a while sleep, a little at a time. There are never
//! more of them than processors, because one that looks for work would keep another from doing it.

use std::cell::Cell;
use std::num::NonZeroUsize;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};
use std::thread;
use std::time::Duration;
use std::{hint, iter, mem};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder, Yield};

thread_local! {
    /// The number of threads of the [`Team`] that this one belongs to. A thread of somebody else's
    /// pool belongs to none.
    static THREADS: Cell<usize> = const { Cell::new(1) };
}

/// Threads, or the calling one alone.
pub struct Team(Option<ThreadPool>);

impl Team {
    /// So many threads, but not more than there are processors, or `parts` of the work that can be
    /// done at the same time.
    ///
    /// # Errors
    /// If the system refuses them.
    pub fn new(threads: usize, parts: usize) -> Result<Self, ThreadPoolBuildError> {
        let processors = thread::available_parallelism().map_or(1, NonZeroUsize::get);
        Self::of(threads.min(processors).min(parts))
    }

    fn of(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let builder = || {
            ThreadPoolBuilder::new()
                .num_threads(threads)
                .start_handler(move |_| THREADS.set(threads))
        };
        (threads > 1)
            .then(|| builder().build())
            .transpose()
            .map(Self)
    }

    /// Does `work` on all items: on each with all threads, which share the loops of [`for_each`] in
    /// it, or, if there are enough items, on each with a thread of its own.
    pub fn run<T: Send>(
        &self,
        mut items: impl ExactSizeIterator<Item = T> + Send,
        work: impl Fn(T) + Sync,
    ) {
        let Some(pool) = &self.0 else {
            return items.for_each(work);
        };
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
    /// The same before the thread sleeps, which is long after the loops of a step have found it
    /// waiting.
    const YIELDS: usize = 2000;
    /// Loops follow each other more quickly than this.
    const NAP: Duration = Duration::from_micros(100);
    let mut waits = 0;
    while left.load(Ordering::Acquire) > 0 {
        if rayon::yield_now() == Some(Yield::Executed) {
            waits = 0;
            continue;
        }
        waits += 1;
        if waits <= SPINS {
            hint::spin_loop();
        } else if waits <= SPINS + YIELDS {
            thread::yield_now();
        } else {
            thread::sleep(NAP);
        }
    }
}

/// Does `work` on all items, in an order that is not determined, on all threads of the [`Team`]
/// that this is called in. Items come with the number of their group, so that a group stays with
/// one thread, whose caches know it.
pub fn for_each<T: Send>(items: impl Iterator<Item = (usize, T)>, work: impl Fn(T) + Sync) {
    let threads = THREADS.get();
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
        let team = Team::of(threads).expect("threads");
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
    fn threads_of_other_pools_are_left_alone() {
        let pool = ThreadPoolBuilder::new()
            .num_threads(2)
            .build()
            .expect("threads");
        let own = Mutex::new(Vec::new());
        pool.install(|| {
            let team = Team::of(1).expect("a thread");
            team.run([0].into_iter(), |_| {
                for_each((0..20).map(|k| (k, k)), |_| {
                    // Long enough for the other thread to come.
                    thread::sleep(Duration::from_millis(1));
                    own.lock().expect("no panic").push(thread::current().id());
                });
            });
            own.lock().expect("no panic").push(thread::current().id());
        });
        let own = own.into_inner().expect("no panic");
        assert!(own.len() == 21 && own.iter().all(|thread| *thread == own[0]));
    }

    #[test]
    fn there_are_no_more_threads_than_work_and_processors() {
        let threads = |team: Team| team.0.map_or(1, |pool| pool.current_num_threads());
        let processors = thread::available_parallelism().map_or(1, NonZeroUsize::get);
        assert_eq!(
            threads(Team::new(1000, 1000).expect("threads")),
            processors.min(1000)
        );
        assert_eq!(threads(Team::new(1000, 1).expect("threads")), 1);
    }

    #[test]
    fn a_panic_ends_the_work_of_all_threads() {
        for items in [1, 9] {
            let team = Team::of(2).expect("threads");
            let work = |_| for_each((0..8).map(|k| (k, k)), |k| assert!(k != 5, "on purpose"));
            assert!(catch_unwind(AssertUnwindSafe(|| team.run(0..items, work))).is_err());
        }
    }
}
