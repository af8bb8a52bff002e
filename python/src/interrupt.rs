//! Simulations that Ctrl-C stops: Python is asked for signals while they run without its lock.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use bristle::simulation::Stop;
use pyo3::prelude::*;

/// Time between two checks for signals.
const SIGNAL_INTERVAL: Duration = Duration::from_millis(20);
/// Number of calls between two reads of the clock, which takes longer than a call.
const CALLS_PER_CLOCK_READ: u32 = 16;

/// Checks for signals from within a loop, and reports its progress.
pub struct Watch {
    stop: Stop,
    tell: Option<Py<PyAny>>,
    calls: u32,
    looked: Instant,
    raised: Option<PyErr>,
}

impl Watch {
    /// Creates a watch that requests `stop` at a signal, or at an exception of `tell`, which
    /// receives the share that is done.
    pub fn new(stop: &Stop, tell: Option<Py<PyAny>>) -> Self {
        Self {
            stop: stop.clone(),
            tell,
            calls: 0,
            looked: Instant::now(),
            raised: None,
        }
    }

    /// Checks for signals; called in each round of the loop, with the `share` that is done.
    pub fn look(&mut self, share: f64) {
        self.calls += 1;
        if self.calls.is_multiple_of(CALLS_PER_CLOCK_READ)
            && self.looked.elapsed() >= SIGNAL_INTERVAL
        {
            self.looked = Instant::now();
            let looked = Python::attach(|py| {
                py.check_signals()
                    .and_then(|()| tell_share(py, self.tell.as_ref(), share))
            });
            if let Err(error) = looked {
                self.stop.request();
                self.raised = Some(error);
            }
        }
    }

    /// Returns the exception of a signal, or of `tell`.
    pub fn end(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)
    }
}

/// Calls `tell`, if any, with the share that is done, from 0 to 1.
fn tell_share(py: Python<'_>, tell: Option<&Py<PyAny>>, share: f64) -> PyResult<()> {
    tell.map_or(Ok(()), |tell| tell.call1(py, (share,)).map(drop))
}

/// Does `work` on a separate thread, without Python's lock. A signal requests `stop`, at which
/// `work` has to end early.
pub fn on_a_thread<R: Send>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    on_a_thread_telling(py, stop, |_| Ok(()), work)
}

/// Extends [`on_a_thread`]: calls `tell` now and then. Its exception counts as a signal.
pub fn on_a_thread_telling<R: Send>(
    py: Python<'_>,
    stop: &Stop,
    tell: impl Fn(Python<'_>) -> PyResult<()> + Sync,
    work: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    py.detach(|| {
        thread::scope(|scope| {
            let (done, result) = channel();
            scope.spawn(move || {
                // The receiver waits for the result.
                let _ = done.send(work());
            });
            let mut raised = Ok(());
            loop {
                match result.recv_timeout(SIGNAL_INTERVAL) {
                    Ok(result) => return raised.map(|()| result),
                    Err(RecvTimeoutError::Timeout) if raised.is_ok() => {
                        raised = Python::attach(|py| py.check_signals().and_then(|()| tell(py)));
                        if raised.is_err() {
                            stop.request();
                        }
                    }
                    Err(RecvTimeoutError::Timeout) => {}
                    // The thread has panicked, and so does the scope.
                    Err(RecvTimeoutError::Disconnected) => {
                        panic!("the thread ended without a result")
                    }
                }
            }
        })
    })
}

/// Extends [`on_a_thread`]: calls `tell`, if any, now and then with the share that is done, which
/// `work` reports.
pub fn on_a_thread_sharing<R: Send>(
    py: Python<'_>,
    stop: &Stop,
    tell: Option<Py<PyAny>>,
    work: impl FnOnce(&(dyn Fn(f64) + Sync)) -> R + Send,
) -> PyResult<R> {
    let done = AtomicU64::default();
    let tell = |py: Python<'_>| {
        tell_share(
            py,
            tell.as_ref(),
            f64::from_bits(done.load(Ordering::Relaxed)),
        )
    };
    on_a_thread_telling(py, stop, tell, || {
        work(&|share: f64| done.store(share.to_bits(), Ordering::Relaxed))
    })
}

/// Does `work`, which cannot be stopped, on a separate thread without Python's lock. After a signal
/// its result is lost.
pub fn unseen<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> R + Send + 'static,
) -> PyResult<R> {
    py.detach(|| {
        let (done, result) = channel();
        thread::Builder::new().spawn(move || {
            // No receiver waits for the result after a signal.
            let _ = done.send(work());
        })?;
        loop {
            match result.recv_timeout(SIGNAL_INTERVAL) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => panic!("the thread ended without a result"),
            }
        }
    })
}
