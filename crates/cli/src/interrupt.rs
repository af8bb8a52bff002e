//! Ctrl-C, SIGTERM of schedulers and containers, and SIGHUP of terminals that are closed.

use std::process;

use bristle::simulation::Stop;

use crate::values::INTERRUPTED;

/// Returns a mark that the first of these signals sets. The second ends the program.
pub fn stop_on_interrupt() -> Stop {
    let stop = Stop::default();
    let mark = stop.clone();
    on_interrupt(move || {
        if mark.is_requested() {
            process::exit(INTERRUPTED.into());
        }
        mark.request();
    });
    stop
}

/// Calls `handle` on each signal, from another thread. Signals that are ignored from the start stay
/// so: SIGHUP under `nohup`, SIGINT in the background of a script.
#[cfg(unix)]
pub fn on_interrupt(mut handle: impl FnMut() + Send + 'static) {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::iterator::Signals;

    let signals = [SIGHUP, SIGINT, SIGTERM];
    let handled = signals.into_iter().filter(|signal| !is_ignored(*signal));
    // Without a handler a signal ends the program, which saved results survive.
    if let Ok(mut signals) = Signals::new(handled) {
        std::thread::spawn(move || signals.forever().for_each(|_| handle()));
    }
}

/// Returns `true` if a signal is ignored, as far as Linux tells.
#[cfg(unix)]
fn is_ignored(signal: i32) -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status
        .lines()
        .find_map(|line| line.strip_prefix("SigIgn:"))
        .and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok());
    ignored.is_some_and(|mask| (mask >> (signal - 1)) & 1 == 1)
}

/// Calls `handle` on Ctrl-C and where the console is closed, from another thread.
#[cfg(not(unix))]
pub fn on_interrupt(handle: impl FnMut() + Send + 'static) {
    // Without a handler a signal ends the program, which saved results survive.
    let _ = ctrlc::try_set_handler(handle);
}
