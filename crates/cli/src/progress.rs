//! The progress of a study: a bar for people at a terminal, or one JSON object per line for programs. And that of one long
//! simulation: a bar.

use std::collections::VecDeque;
use std::io;
use std::path::PathBuf;
use std::sync::{Mutex, MutexGuard};
use std::time::{Duration, Instant};

use bristle_text::is_invisible;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::terminal::{self, print};

/// Shortest time between two progress objects.
const BETWEEN_EVENTS: Duration = Duration::from_millis(100);
/// Time in s over which the rate is averaged, as the cases of one study can differ in length by a factor of a hundred.
const WINDOW_S: f64 = 10.0;
/// Shortest time in s between the samples that the rate is computed from.
const SPACING_S: f64 = 0.2;

/// One line on stdout with `--json`. Keys may be added.
#[derive(Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
enum Event<'a> {
    /// Written at most ten times per second: first before any case, last after all of them.
    Progress {
        /// Cases that have a result, including those of an earlier run.
        done: usize,
        total: usize,
        /// Those of `done` that ended with an error.
        failures: usize,
        /// Recent rate in cases per second; null before the first case.
        rate: Option<f64>,
        /// Time left at this rate, in s.
        seconds_left: Option<f64>,
    },
    /// The last line, once all files are written.
    Summary {
        cases: usize,
        failures: usize,
        /// Cases whose results came from the journal of an earlier run.
        resumed: usize,
        /// Time taken by the other cases, in s.
        seconds: f64,
        files: &'a [PathBuf],
    },
}

/// Reports the progress of a study, from any thread.
pub struct Progress {
    total: usize,
    resumed: usize,
    begun: Instant,
    state: Mutex<Tally>,
    output: Output,
}

enum Output {
    Bar(ProgressBar),
    Json,
}

struct Tally {
    done: usize,
    failures: usize,
    pace: Pace,
    /// When the last object was written.
    told: Instant,
    /// The first error of writing an object. It does not stop the study, whose results are in files.
    error: Option<io::Error>,
}

impl Progress {
    /// Starts with the cases that already have a result.
    pub fn begin(total: usize, resumed: usize, failures: usize, json: bool) -> Self {
        let begun = Instant::now();
        let output = if json {
            Output::Json
        } else {
            let bar = ProgressBar::new(total as u64).with_style(style()).with_position(resumed as u64);
            terminal::keep_below(&bar);
            Output::Bar(bar)
        };
        let state = Tally { done: resumed, failures, pace: Pace::new(), told: begun, error: None };
        let progress = Self { total, resumed, begun, state: Mutex::new(state), output };
        progress.tell(&mut progress.state());
        progress
    }

    /// Counts a case.
    pub fn case_done(&self, failed: bool) {
        let now = Instant::now();
        let mut state = self.state();
        state.done += 1;
        state.failures += usize::from(failed);
        let (seconds, simulated) = (now.duration_since(self.begun).as_secs_f64(), state.done - self.resumed);
        state.pace.count(seconds, simulated);
        match &self.output {
            Output::Json if now.duration_since(state.told) < BETWEEN_EVENTS => {}
            _ => {
                state.told = now;
                self.tell(&mut state);
            }
        }
    }

    /// Ends the bar, and returns the time since the start in s.
    pub fn end(&self) -> f64 {
        match &self.output {
            Output::Bar(bar) => bar.finish_and_clear(),
            Output::Json => self.tell(&mut self.state()),
        }
        terminal::nothing_below();
        self.begun.elapsed().as_secs_f64()
    }

    /// Writes the last object, if the output is JSON. Returns the first error of writing any object.
    pub fn summarise(self, seconds: f64, files: &[PathBuf]) -> io::Result<()> {
        if let Output::Json = self.output {
            let mut state = self.state();
            let (cases, failures) = (state.done, state.failures);
            state.print(&Event::Summary { cases, failures, resumed: self.resumed, seconds, files });
        }
        self.state().error.take().map_or(Ok(()), Err)
    }

    fn tell(&self, state: &mut Tally) {
        let rate = state.pace.rate();
        let seconds_left = rate.map(|rate| (self.total - state.done) as f64 / rate);
        match &self.output {
            Output::Bar(bar) => {
                bar.set_position(state.done as u64);
                bar.set_message(in_words(rate, seconds_left, state.failures));
            }
            Output::Json => {
                let (done, failures) = (state.done, state.failures);
                state.print(&Event::Progress { done, total: self.total, failures, rate, seconds_left });
            }
        }
    }

    fn state(&self) -> MutexGuard<'_, Tally> {
        self.state.lock().expect("nothing panics while holding the progress")
    }
}

/// Style of the bar. indicatif shows it on a terminal only. The message follows the number of cases.
pub fn style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:30} {pos}/{len} cases{msg}").unwrap_or_else(|_| ProgressStyle::default_bar())
}

/// The text after the number of cases, such as `, 680/s, 2 s left, 1 failed`.
fn in_words(rate: Option<f64>, seconds_left: Option<f64>, failures: usize) -> String {
    let mut text = String::new();
    if let Some(rate) = rate {
        text += &if rate >= 9.95 { format!(", {rate:.0}/s") } else { format!(", {rate:.2}/s") };
    }
    if let Some(seconds) = seconds_left {
        text += &time_left(seconds);
    }
    if failures > 0 {
        text += &format!(", {failures} failed");
    }
    text
}

/// Such as `, 2 min 10 s left`.
fn time_left(seconds: f64) -> String {
    let seconds = seconds.ceil();
    let (hours, minutes) = ((seconds / 3600.0).floor(), (seconds % 3600.0 / 60.0).floor());
    match seconds {
        3600.0.. => format!(", {hours} h {minutes} min left"),
        60.0.. => format!(", {minutes} min {} s left", seconds % 60.0),
        _ => format!(", {seconds} s left"),
    }
}

/// The progress of one long simulation: nothing at first, then a bar on a terminal.
pub struct PassProgress {
    begun: Instant,
    /// What is simulated, in words.
    what: &'static str,
    /// The share that was done when it began.
    earlier: f64,
    bar: Option<ProgressBar>,
}

impl PassProgress {
    /// A simulation that ends sooner shows no bar.
    const PATIENCE: Duration = Duration::from_secs(2);
    /// Parts of the bar.
    const PARTS: f64 = 1000.0;

    /// Starts with the share that an `earlier` run has done of `what`.
    pub fn begin(what: &'static str, earlier: f64) -> Self {
        Self { begun: Instant::now(), what, earlier, bar: None }
    }

    /// Shows what share of it, from 0 to 1, is done.
    pub fn tell(&mut self, share: f64) {
        let passed = self.begun.elapsed();
        if passed < Self::PATIENCE {
            return;
        }
        let bar = self.bar.get_or_insert_with(|| {
            let bar = ProgressBar::new(Self::PARTS as u64).with_style(pass_style(self.what));
            terminal::keep_below(&bar);
            bar
        });
        bar.set_position((Self::PARTS * share) as u64);
        let rate = (share - self.earlier) / passed.as_secs_f64();
        bar.set_message(if rate > 0.0 { time_left((1.0 - share) / rate) } else { String::new() });
    }

    /// Ends the bar.
    pub fn end(self) {
        if let Some(bar) = self.bar {
            bar.finish_and_clear();
            terminal::nothing_below();
        }
    }
}

/// Style of the bar of one simulation.
fn pass_style(what: &str) -> ProgressStyle {
    ProgressStyle::with_template(&format!("{{bar:30}} {{percent}} % of {what}{{msg}}"))
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

impl Tally {
    /// Writes a line to stdout, and keeps the first error.
    fn print(&mut self, event: &Event<'_>) {
        // A path that is not Unicode cannot be written as JSON; its file is written all the same.
        if let Ok(line) = serde_json::to_string(event)
            && let Err(error) = print(&(visible(&line) + "\n"))
        {
            self.error.get_or_insert(error);
        }
    }
}

/// JSON with the characters escaped that could drive a terminal or disguise a path. JSON has such characters in strings only.
fn visible(json: &str) -> String {
    let mut visible = String::with_capacity(json.len());
    for letter in json.chars() {
        if is_invisible(letter) {
            visible.extend(letter.encode_utf16(&mut [0; 2]).iter().map(|unit| format!("\\u{unit:04x}")));
        } else {
            visible.push(letter);
        }
    }
    visible
}

/// The recent rate of a count.
struct Pace {
    /// Times in s and counts, the earliest first, including one before the window.
    points: VecDeque<(f64, usize)>,
    last: (f64, usize),
}

impl Pace {
    /// Starts at zero seconds with a count of zero.
    fn new() -> Self {
        Self { points: VecDeque::from([(0.0, 0)]), last: (0.0, 0) }
    }

    /// Records a count. Neither the count nor the time may be less than before.
    fn count(&mut self, seconds: f64, count: usize) {
        self.last = (seconds, count);
        if self.points.back().is_none_or(|&(latest, _)| seconds - latest >= SPACING_S) {
            self.points.push_back(self.last);
        }
        while self.points.get(1).is_some_and(|&(second, _)| second <= seconds - WINDOW_S) {
            self.points.pop_front();
        }
    }

    /// Counts per second over the window.
    fn rate(&self) -> Option<f64> {
        let &(from_seconds, from_count) = self.points.front()?;
        let (seconds, count) = self.last;
        let rate = (count - from_count) as f64 / (seconds - from_seconds);
        (rate.is_finite() && rate > 0.0).then_some(rate)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_rate_is_recent() {
        let mut pace = Pace::new();
        assert_eq!(pace.rate(), None);
        pace.count(0.0, 1);
        assert_eq!(pace.rate(), None, "no time has passed");
        pace.count(0.5, 1);
        assert_eq!(pace.rate(), Some(2.0));
        // Slow for 100 s, then ten times as fast.
        let mut pace = Pace::new();
        for count in 1..=100 {
            pace.count(count as f64, count);
        }
        assert_eq!(pace.rate(), Some(1.0));
        for count in 101..=300 {
            pace.count(100.0 + 0.1 * (count - 100) as f64, count);
        }
        let rate = pace.rate().expect("a rate");
        assert!((rate - 10.0).abs() < 0.1, "{rate}");
        assert!(pace.points.len() < 60);
    }

    #[test]
    fn paths_in_json_are_visible_and_stay_the_same() {
        let path = "a\u{9b}2J\u{202e}\u{e0001}ä\u{1b}";
        let json = visible(&serde_json::to_string(path).expect("JSON"));
        assert_eq!(json, r#""a\u009b2J\u202e\udb40\udc01ä\u001b""#);
        assert_eq!(serde_json::from_str::<String>(&json).expect("JSON"), path);
    }

    #[test]
    fn words_fit_the_time() {
        assert_eq!(in_words(None, None, 0), "");
        assert_eq!(in_words(Some(680.4), Some(1.2), 1), ", 680/s, 2 s left, 1 failed");
        assert_eq!(in_words(Some(1.5), Some(59.5), 0), ", 1.50/s, 1 min 0 s left");
        assert_eq!(in_words(Some(0.25), Some(3600.0 * 5.0 + 61.0), 0), ", 0.25/s, 5 h 1 min left");
    }
}
