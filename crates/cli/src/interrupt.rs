//! Ctrl-C, and SIGTERM, which schedulers of clusters and containers send.

use std::process;

use bristle::simulation::Stop;

use crate::values::INTERRUPTED;

/// Returns a mark that the first of these signals sets. The second ends the program.
pub fn stop_on_interrupt() -> Stop {
    let stop = Stop::default();
    let mark = stop.clone();
    // If signals are handled elsewhere, or ignored, that is intended: saved results survive an end
    // without notice.
    let _ = ctrlc::try_set_handler(move || {
        if mark.is_requested() {
            process::exit(INTERRUPTED.into());
        }
        mark.request();
    });
    stop
}
