//! Simulations that Ctrl-C stops: Python is asked for signals while they run, without its lock.

use std::sync::mpsc::{RecvTimeoutError, channel};
use std::thread;
use std::time::{Duration, Instant};

use bristle::simulation::Stop;
use pyo3::prelude::*;

/// The time between two looks at signals.
const PAUSE: Duration = Duration::from_millis(20);
/// Calls between two looks at the clock, which takes longer than a call.
const CALLS: u32 = 16;

/// Looks for signals from within a loop.
pub struct Watch {
    stop: Stop,
    calls: u32,
    looked: Instant,
    raised: Option<PyErr>,
}

impl Watch {
    /// A watch that requests `stop` when there is a signal.
    pub fn new(stop: &Stop) -> Self {
        Self { stop: stop.clone(), calls: 0, looked: Instant::now(), raised: None }
    }

    /// To be called in each round of the loop.
    pub fn look(&mut self) {
        self.calls += 1;
        if self.calls.is_multiple_of(CALLS) && self.looked.elapsed() >= PAUSE {
            self.looked = Instant::now();
            if let Err(error) = Python::attach(|py| py.check_signals()) {
                self.stop.request();
                self.raised = Some(error);
            }
        }
    }

    /// The exception that a signal has raised.
    pub fn end(self) -> PyResult<()> {
        self.raised.map_or(Ok(()), Err)
    }
}

/// Does `work` on a thread of its own, without Python's lock. A signal requests `stop`, at which `work` has to end early.
pub fn on_a_thread<R: Send>(py: Python<'_>, stop: &Stop, work: impl FnOnce() -> R + Send) -> PyResult<R> {
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
                    Err(RecvTimeoutError::Disconnected) => panic!("the thread ended without a result"),
                }
            }
        })
    })
}

/// Does `work`, which cannot be stopped, on a thread of its own without Python's lock. After a signal it ends unseen.
pub fn unseen<R: Send + 'static>(py: Python<'_>, work: impl FnOnce() -> R + Send + 'static) -> PyResult<R> {
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
