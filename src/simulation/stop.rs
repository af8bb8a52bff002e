//! A request to end simulations early.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Request that simulations end early, from any thread. Clones share one request.
///
/// A simulation checks the request before each step, and ends with
/// [`Stopped`](super::IntegrationError::Stopped).
///
/// ```
/// use bristle::model::settings::Settings;
/// use bristle::simulation::{IntegrationError, Pass, Sampling, SimulationError, Stop};
///
/// let stop = Stop::default();
/// let pass = Pass::new(&Settings::paper(10.0, 1e-3)).until(&stop);
/// stop.request();
/// let stopped = SimulationError::Integration(IntegrationError::Stopped);
/// assert_eq!(pass.simulate(Sampling::default()), Err(stopped));
/// ```
#[derive(Clone, Debug, Default)]
pub struct Stop(Arc<AtomicBool>);

impl Stop {
    /// Makes the request.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Returns `true` if the request has been made.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}
