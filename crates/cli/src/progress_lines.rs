//! Lines of progress on stderr, for long work without a terminal.

use std::sync::Arc;
use std::sync::mpsc::{self, RecvTimeoutError, Sender};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use parking_lot::Mutex;

use crate::terminal::say;

/// Lines of progress on stderr, from a separate thread: the work may report nothing for a long
/// time.
pub struct ProgressLines {
    /// Finished work, in words.
    done: Arc<Mutex<String>>,
    /// Thread that writes the lines. It ends with its channel.
    thread: Mutex<Option<(Sender<()>, JoinHandle<()>)>>,
}

impl ProgressLines {
    /// Times in s between lines: short work has no line, long work one per minute.
    const PAUSES_S: [f64; 4] = [10.0, 20.0, 40.0, 60.0];

    pub fn begin() -> Self {
        Self::with(Self::PAUSES_S.map(Duration::from_secs_f64), say)
    }

    /// Starts lines after `pauses`, the last of which repeats. `write` receives each line.
    fn with<const N: usize>(
        pauses: [Duration; N],
        write: impl Fn(String) + Send + 'static,
    ) -> Self {
        let done = Arc::new(Mutex::new(String::new()));
        let (begun, shared) = (Instant::now(), Arc::clone(&done));
        let (sender, ended) = mpsc::channel();
        let tell = move || {
            let mut due = begun;
            for number in 0.. {
                due += pauses[usize::min(number, N - 1)];
                let wait = due.saturating_duration_since(Instant::now());
                if ended.recv_timeout(wait) != Err(RecvTimeoutError::Timeout) {
                    return;
                }
                let time = in_time(begun.elapsed().as_secs_f64());
                write(format!("after {time}: {}", shared.lock()));
            }
        };
        // Without a thread there are no lines, but still results.
        let thread = thread::Builder::new().spawn(tell).ok();
        Self {
            done,
            thread: Mutex::new(thread.map(|thread| (sender, thread))),
        }
    }

    pub fn set(&self, done: String) {
        *self.done.lock() = done;
    }

    /// Ends the lines.
    pub fn end(&self) {
        if let Some((sender, thread)) = self.thread.lock().take() {
            drop(sender);
            // The work does not depend on a line that cannot be written.
            let _ = thread.join();
        }
    }
}

impl Drop for ProgressLines {
    fn drop(&mut self) {
        self.end();
    }
}

/// Returns text such as `2 min 10 s`.
pub fn in_time(seconds: f64) -> String {
    let seconds = seconds.floor();
    let (hours, minutes) = (
        (seconds / 3600.0).floor(),
        (seconds % 3600.0 / 60.0).floor(),
    );
    match seconds {
        3600.0.. => format!("{hours} h {minutes} min"),
        60.0.. => format!("{minutes} min {} s", seconds % 60.0),
        _ => format!("{seconds} s"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_come_now_and_then_until_the_end() {
        let (sender, lines) = std::sync::mpsc::channel();
        let pauses = [Duration::from_millis(20), Duration::from_millis(1)];
        let told = ProgressLines::with(pauses, move |line| {
            sender.send(line).expect("the test listens")
        });
        told.set("3 of 4 cases".to_owned());
        for _ in 0..3 {
            assert_eq!(lines.recv(), Ok("after 0 s: 3 of 4 cases".to_owned()));
        }
        told.end();
        while lines.try_recv().is_ok() {}
        assert!(lines.recv().is_err(), "no line follows the end");
        // Short work has no line.
        let (sender, lines) = std::sync::mpsc::channel();
        let patience = [Duration::from_secs(3600)];
        drop(ProgressLines::with(patience, move |line| {
            sender.send(line).expect("the test listens")
        }));
        assert!(lines.recv().is_err());
    }
}
