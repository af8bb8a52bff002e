//! Threads that share the work on a brush.

use std::num::NonZeroUsize;
use std::sync::{Mutex, PoisonError};
use std::{iter, thread};

use rayon::iter::{IntoParallelIterator, ParallelIterator};
use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Threads, or the calling one alone.
pub struct Team {
    threads: usize,
    /// Pool that shares loops; `None` if each item has a thread of its own.
    pool: Option<ThreadPool>,
}

impl Team {
    /// Starts at most `threads` threads, not more than there are processors or `parts` of the work
    /// that can be done at the same time. They share the loops of [`for_each`] if `shares_loops`.
    ///
    /// # Errors
    /// If the system refuses threads.
    pub fn new(
        threads: usize,
        parts: usize,
        shares_loops: bool,
    ) -> Result<Self, ThreadPoolBuildError> {
        let processors = thread::available_parallelism().map_or(1, NonZeroUsize::get);
        Self::of(threads.min(processors).min(parts), shares_loops)
    }

    fn of(threads: usize, shares_loops: bool) -> Result<Self, ThreadPoolBuildError> {
        let pool = (threads > 1 && shares_loops)
            .then(|| ThreadPoolBuilder::new().num_threads(threads).build())
            .transpose()?;
        Ok(Self { threads, pool })
    }

    /// Applies `work` to all items, each on a thread of its own. Threads that share loops do few
    /// items one after the other, each together.
    pub fn run<T: Send>(
        &self,
        mut items: impl ExactSizeIterator<Item = T> + Send,
        work: impl Fn(T) + Sync,
    ) {
        let threads = self.threads.min(items.len());
        if let Some(pool) = &self.pool
            && items.len() < 2 * self.threads
        {
            return pool.install(|| items.for_each(&work));
        }
        if threads <= 1 {
            return items.for_each(work);
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

/// Applies `work` to all items, in undetermined order, on all threads of the current pool.
pub fn for_each<T: Send>(items: impl Iterator<Item = T>, work: impl Fn(T) + Sync + Send) {
    if rayon::current_thread_index().is_none() {
        items.for_each(work);
    } else {
        let items: Vec<T> = items.collect();
        items.into_par_iter().for_each(work);
    }
}

#[cfg(test)]
mod tests {
    use std::panic::{AssertUnwindSafe, catch_unwind};

    use super::*;

    fn count(team: &Team, items: usize, of_each: usize) -> Vec<usize> {
        let mut counts = vec![vec![0; of_each]; items];
        team.run(counts.iter_mut(), |counts| {
            for _ in 0..50 {
                for_each(counts.iter_mut(), |count| *count += 1);
            }
        });
        counts.concat()
    }

    #[test]
    fn every_item_is_done_once() {
        for (threads, shares_loops) in [(1, true), (2, true), (4, true), (3, false)] {
            let team = Team::of(threads, shares_loops).expect("threads");
            for items in [1, 2, 9] {
                assert_eq!(count(&team, items, 13), vec![50; 13 * items]);
            }
        }
    }

    #[test]
    fn there_are_no_more_threads_than_work_and_processors() {
        let threads = |parts| Team::new(1000, parts, true).expect("threads").threads;
        let processors = thread::available_parallelism().map_or(1, NonZeroUsize::get);
        assert_eq!(threads(1000), processors.min(1000));
        assert_eq!(threads(1), 1);
    }

    #[test]
    fn a_panic_ends_the_work_of_all_threads() {
        for items in [1, 9] {
            let team = Team::of(2, true).expect("threads");
            let work = |_| for_each(0..8, |k| assert!(k != 5, "on purpose"));
            assert!(catch_unwind(AssertUnwindSafe(|| team.run(0..items, work))).is_err());
        }
    }
}
