//! Simulations that Ctrl-C stops: Python is asked for signals while they run, without its lock.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use bristle::simulation::Stop;
use pyo3::prelude::*;

/// The time between two looks at signals.
const PAUSE: Duration = Duration::from_millis(20);
/// Calls between two looks at the clock, which takes longer than a call.
const CALLS: u32 = 16;

/// Looks for signals from within a loop, and tells how far it is.
pub struct Watch {
    stop: Stop,
    tell: Option<Py<PyAny>>,
    calls: u32,
    looked: Instant,
    raised: Option<PyErr>,
}

impl Watch {
    /// A watch that requests `stop` when there is a signal, or an exception of `tell`, which takes
    /// the share that is done.
    pub fn new(stop: &Stop, tell: Option<Py<PyAny>>) -> Self {
        Self {
            stop: stop.clone(),
            tell,
            calls: 0,
            looked: Instant::now(),
            raised: None,
        }
    }

    /// To be called in each round of the loop, with the `share` that is done.
    pub fn look(&mut self, share: f64) {
        self.calls += 1;
        if self.calls.is_multiple_of(CALLS) && self.looked.elapsed() >= PAUSE {
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

    /// The exception of a signal, or of what was told.
    pub fn end(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)
    }
}

/// Calls `tell`, if there is one, with the share that is done, from 0 to 1.
fn tell_share(py: Python<'_>, tell: Option<&Py<PyAny>>, share: f64) -> PyResult<()> {
    tell.map_or(Ok(()), |tell| tell.call1(py, (share,)).map(drop))
}

/// Does `work` on a thread of its own, without Python's lock. A signal requests `stop`, at which
/// `work` has to end early.
pub fn on_a_thread<R: Send>(
    py: Python<'_>,
    stop: &Stop,
    work: impl FnOnce() -> R + Send,
) -> PyResult<R> {
    on_a_thread_telling(py, stop, |_| Ok(()), work)
}

/// [`on_a_thread`], which calls `tell` now and then. Its exception counts as a signal.
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
                // The receiver waits for it.
                let _ = done.send(work());
            });
            let mut raised = Ok(());
            loop {
                match result.recv_timeout(PAUSE) {
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

/// [`on_a_thread`], which calls `tell`, if there is one, now and then with the share that is done.
/// `work` tells it what that is.
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

/// Does `work`, which cannot be stopped, on a thread of its own without Python's lock. After a
/// signal it ends unseen.
pub fn unseen<R: Send + 'static>(
    py: Python<'_>,
    work: impl FnOnce() -> R + Send + 'static,
) -> PyResult<R> {
    py.detach(|| {
        let (done, result) = channel();
        thread::Builder::new().spawn(move || {
            // Nobody waits for it after a signal.
            let _ = done.send(work());
        })?;
        loop {
            match result.recv_timeout(PAUSE) {
                Ok(result) => return Ok(result),
                Err(RecvTimeoutError::Timeout) => Python::attach(|py| py.check_signals())?,
                Err(RecvTimeoutError::Disconnected) => panic!("the thread ended without a result"),
            }
        }
    })
}
