//! The progress of a study: a bar for people at a terminal, or one JSON object per line for
//! programs. One long simulation has a bar, too. Where stderr is no terminal, occasional lines of
//! text replace the bar.

use std::io;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle_app::insight::findings::Finding;
use bristle_app::report::tables::check_table;
use bristle_app::run::{ProgressObserver, StudyRun};
use bristle_app::store::method::{method_of_case, method_of_study};
use bristle_study::grid::check::largest_change;
use bristle_study::grid::{Study, work};
use bristle_study::text::is_invisible;
use indicatif::{ProgressBar, ProgressStyle};
use parking_lot::{Mutex, MutexGuard};
use serde::Serialize;
use serde_json::{Value, json};

use crate::progress_lines::{ProgressLines, in_time};
use crate::terminal::{self, print, show};

/// Minimum time between two progress objects.
const MIN_EVENT_INTERVAL: Duration = Duration::from_millis(100);

/// One line on stdout with `--json`. Keys may be added.
#[derive(Serialize)]
#[serde(tag = "event", rename_all = "lowercase")]
enum Event<'a> {
    /// Written at most ten times per second: first before any case, last after all of them.
    Progress {
        /// Cases that have a result, including those of an earlier run.
        done: usize,
        total: usize,
        /// Cases of `done` that ended with an error.
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
        findings: &'a [Finding],
        /// Method of the results, as a paragraph.
        method: String,
    },
}

/// Reports the progress of a study, from any thread.
pub struct Progress {
    /// Number of cases, and of those with a result from an earlier run.
    total: usize,
    resumed: usize,
    /// Work of each case relative to the others; zero for a case with a result, or of another
    /// shard.
    works: Vec<f64>,
    begun: Instant,
    state: Mutex<Tally>,
    /// The cases that are simulated here, for their rate. This bar is hidden.
    simulated: ProgressBar,
    /// Lines of text while the recommendation is simulated.
    waiting: Mutex<Option<Waiting>>,
    output: Output,
}

enum Output {
    Bar(ProgressBar),
    Lines(ProgressLines),
    Json,
}

struct Tally {
    done: usize,
    /// Work done since the start, and remaining work.
    work: [f64; 2],
    failures: usize,
    /// Time of the last written object.
    told: Instant,
    /// Time that the study took in s, once it has ended.
    seconds: f64,
    /// First error of writing an object. It does not stop the study, whose results are in files.
    error: Option<io::Error>,
}

impl Progress {
    /// Starts with the results that the cases for which `is_own` is true already have.
    pub fn begin(run: &StudyRun, is_own: impl Fn(usize) -> bool, json: bool) -> Self {
        let study = run.study();
        let (mut total, mut resumed, mut failures) = (0, 0, 0);
        let mut works = vec![0.0; study.case_count()];
        for (case, result) in run.results().iter().enumerate() {
            if !is_own(case) {
                continue;
            }
            total += 1;
            match result {
                None => works[case] = work(study, case),
                Some(result) => {
                    resumed += 1;
                    failures += usize::from(result.is_err());
                }
            }
        }
        let begun = Instant::now();
        let output = if json {
            Output::Json
        } else {
            let bar =
                bar(total as u64, "{bar:30} {pos}/{len} cases{msg}").with_position(resumed as u64);
            if bar.is_hidden() {
                Output::Lines(ProgressLines::begin())
            } else {
                terminal::keep_below(&bar);
                Output::Bar(bar)
            }
        };
        let state = Tally {
            done: resumed,
            work: [0.0, works.iter().sum()],
            failures,
            told: begun,
            seconds: 0.0,
            error: None,
        };
        let progress = Self {
            total,
            resumed,
            works,
            begun,
            state: Mutex::new(state),
            simulated: ProgressBar::hidden(),
            waiting: Mutex::new(None),
            output,
        };
        progress.tell(&mut progress.state());
        progress
    }

    /// Returns the number of cases, and of failed cases.
    pub fn counts(&self) -> (usize, usize) {
        (self.total, self.state().failures)
    }

    /// Returns the time from the start to the end in s.
    pub fn seconds(&self) -> f64 {
        self.state().seconds
    }

    /// Writes the last object, if the output is JSON. Returns the first error of writing any
    /// object.
    pub fn summarise(
        self,
        files: &[PathBuf],
        findings: &[Finding],
        study: &Study,
    ) -> io::Result<()> {
        if let Output::Json = self.output {
            let mut state = self.state();
            let (cases, failures, seconds) = (state.done, state.failures, state.seconds);
            state.print(&Event::Summary {
                cases,
                failures,
                resumed: self.resumed,
                seconds,
                files,
                findings,
                method: method_of_study(study, env!("CARGO_PKG_VERSION")),
            });
        }
        self.state().error.take().map_or(Ok(()), Err)
    }

    fn tell(&self, state: &mut Tally) {
        let rate = Some(self.simulated.per_sec()).filter(|rate| rate.is_finite() && *rate > 0.0);
        let seconds_left = state.seconds_left(self.begun.elapsed().as_secs_f64());
        match &self.output {
            Output::Bar(bar) => {
                bar.set_position(state.done as u64);
                bar.set_message(in_words(rate, seconds_left, state.failures));
            }
            Output::Lines(lines) => {
                let (done, total, words) = (
                    state.done,
                    self.total,
                    in_words(rate, seconds_left, state.failures),
                );
                lines.set(format!("{done} of {total} cases{words}"));
            }
            Output::Json => {
                let (done, failures) = (state.done, state.failures);
                state.print(&Event::Progress {
                    done,
                    total: self.total,
                    failures,
                    rate,
                    seconds_left,
                });
            }
        }
    }

    fn state(&self) -> MutexGuard<'_, Tally> {
        self.state.lock()
    }
}

impl ProgressObserver for Progress {
    fn case_done(&self, case: usize, failed: bool) {
        let now = Instant::now();
        let mut state = self.state();
        state.done += 1;
        let [done, left] = state.work;
        state.work = [done + self.works[case], left - self.works[case]];
        state.failures += usize::from(failed);
        self.simulated.inc(1);
        match &self.output {
            Output::Json if now.duration_since(state.told) < MIN_EVENT_INTERVAL => {}
            _ => {
                state.told = now;
                self.tell(&mut state);
            }
        }
    }

    fn answering(&self) {
        let json = matches!(self.output, Output::Json);
        if !json {
            terminal::say("simulating the recommendation");
        }
        *self.waiting.lock() = Some(Waiting::begin(RECOMMENDING, json));
    }

    fn answered(&self) {
        self.waiting.lock().take();
    }

    fn ended(&self) {
        match &self.output {
            Output::Bar(bar) => bar.finish_and_clear(),
            Output::Lines(lines) => lines.end(),
            Output::Json => self.tell(&mut self.state()),
        }
        terminal::nothing_below();
        self.state().seconds = self.begun.elapsed().as_secs_f64();
    }
}

/// Creates a bar with its template, whose message comes last. indicatif shows it on a terminal
/// only.
fn bar(length: u64, template: &str) -> ProgressBar {
    ProgressBar::new(length)
        .with_style(ProgressStyle::with_template(template).expect("the template is right"))
}

/// Returns the text after the number of cases, such as `, 680/s, 2 s left, 1 failed`.
fn in_words(rate: Option<f64>, seconds_left: Option<f64>, failures: usize) -> String {
    let mut text = String::new();
    if let Some(rate) = rate {
        text += &if rate >= 9.95 {
            format!(", {rate:.0}/s")
        } else {
            format!(", {rate:.2}/s")
        };
    }
    if let Some(seconds) = seconds_left {
        text += &time_left(seconds);
    }
    if failures > 0 {
        text += &format!(", {failures} failed");
    }
    text
}

/// Returns text such as `, 2 min 10 s left`.
fn time_left(seconds: f64) -> String {
    format!(", {} left", in_time(seconds.ceil()))
}

/// Progress of one long simulation, from any thread: nothing at first, then a bar on a terminal.
pub struct PassProgress {
    begun: Instant,
    /// Name of the simulation, in words.
    what: &'static str,
    /// Share that was done at the start.
    earlier: f64,
    /// `true` if progress is JSON.
    json: bool,
    shown: Mutex<Shown>,
    lines: Option<ProgressLines>,
}

/// Time and share of the last display, and the bar, if any.
struct Shown {
    at: Instant,
    /// Largest reported share: a new estimate must not run backwards.
    share: f64,
    bar: Option<ProgressBar>,
}

impl PassProgress {
    /// Duration below which a simulation shows no bar.
    const BAR_DELAY: Duration = Duration::from_secs(2);
    /// Minimum time between two updates of the display: a pass reports each of its steps.
    const MIN_BAR_INTERVAL: Duration = Duration::from_millis(50);
    /// Number of parts of the bar.
    const BAR_PARTS: f64 = 1000.0;

    /// Starts with the share of `what` that an `earlier` run has done.
    pub fn begin(what: &'static str, earlier: f64, json: bool) -> Self {
        let lines = (!json && ProgressBar::new(1).is_hidden()).then(ProgressLines::begin);
        let now = Instant::now();
        let progress = Self {
            begun: now,
            what,
            earlier,
            json,
            shown: Mutex::new(Shown {
                at: now,
                share: earlier,
                bar: None,
            }),
            lines,
        };
        progress.set_line(earlier, String::new());
        progress
    }

    fn set_line(&self, share: f64, left: String) {
        if let Some(lines) = &self.lines {
            lines.set(format!("{:.0} % of {}{left}", 100.0 * share, self.what));
        }
    }

    /// Shows the share of the simulation that is done, from 0 to 1.
    pub fn tell(&self, share: f64) {
        let passed = self.begun.elapsed();
        let mut shown = self.shown.lock();
        shown.share = share.max(shown.share);
        let (share, pause) = (
            shown.share,
            if self.json {
                MIN_EVENT_INTERVAL
            } else {
                Self::MIN_BAR_INTERVAL
            },
        );
        if passed < Self::BAR_DELAY || shown.at.elapsed() < pause {
            return;
        }
        shown.at = Instant::now();
        if self.json {
            // The result reports an error if stdout cannot be written.
            let _ = print_object("progress", &json!({ "share": share }));
            return;
        }
        let rate = (share - self.earlier) / passed.as_secs_f64();
        let left = if rate > 0.0 {
            time_left((1.0 - share) / rate)
        } else {
            String::new()
        };
        if self.lines.is_some() {
            return self.set_line(share, left);
        }
        let bar = shown.bar.get_or_insert_with(|| {
            let bar = bar(
                Self::BAR_PARTS as u64,
                &format!("{{bar:30}} {{percent}} % of {}{{msg}}", self.what),
            );
            terminal::keep_below(&bar);
            bar
        });
        bar.set_position((Self::BAR_PARTS * share) as u64);
        bar.set_message(left);
    }
}

/// Text of the lines while a recommendation is simulated.
pub const RECOMMENDING: &str = "the recommendation is being simulated";

/// Occasional lines during long work without progress reports.
pub struct Waiting {
    _lines: Option<ProgressLines>,
}

impl Waiting {
    /// Starts lines that name the work `what`.
    pub fn begin(what: &str, json: bool) -> Self {
        let lines = (!json).then(ProgressLines::begin);
        lines.iter().for_each(|lines| lines.set(what.to_owned()));
        Self { _lines: lines }
    }
}

/// Ends the bar.
impl Drop for PassProgress {
    fn drop(&mut self) {
        if let Some(bar) = &self.shown.get_mut().bar {
            bar.finish_and_clear();
            terminal::nothing_below();
        }
    }
}

impl Tally {
    /// Returns the remaining time in s after `seconds`.
    fn seconds_left(&self, seconds: f64) -> Option<f64> {
        let [done, left] = self.work;
        // Rounding may leave a negative difference.
        (done > 0.0).then(|| (seconds * left / done).max(0.0))
    }

    /// Writes a line to stdout, and keeps the first error.
    fn print(&mut self, event: &Event<'_>) {
        // A path that is not Unicode cannot be written as JSON; its file is written nevertheless.
        if let Ok(line) = serde_json::to_string(event)
            && let Err(error) = print(&(visible(&line) + "\n"))
        {
            self.error.get_or_insert(error);
        }
    }
}

/// Prints an object as a line of JSON with the name of its `event`.
pub fn print_object(event: &str, object: &Value) -> io::Result<()> {
    let mut line = json!({ "event": event });
    if let (Value::Object(line), Value::Object(object)) = (&mut line, object) {
        line.extend(object.clone());
    }
    print(&(visible(&line.to_string()) + "\n"))
}

/// Prints the text of `metrics.json`, the findings and the method as a line of JSON.
pub fn print_result(metrics: &[u8], findings: &[Finding], settings: &Settings) -> io::Result<()> {
    let metrics: Value = serde_json::from_slice(metrics)?;
    let method = method_of_case(settings);
    print_object(
        "result",
        &json!({ "metrics": metrics, "findings": findings, "method": method }),
    )
}

/// Shows how `metrics` change in a more precise simulation, called `again`, as a table or as a line
/// of JSON.
pub fn show_check(again: &str, metrics: &Metrics, checked: &Metrics, json: bool) -> io::Result<()> {
    if json {
        let change = largest_change(metrics, checked);
        print_object(
            "check",
            &json!({ "again": again, "largest_change": change }),
        )
    } else {
        show(format_args!("\n{}", check_table(again, metrics, checked)))
    }
}

/// Escapes characters in JSON that could drive a terminal or disguise a path. JSON has such
/// characters in strings only.
fn visible(json: &str) -> String {
    let mut visible = String::with_capacity(json.len());
    for letter in json.chars() {
        if is_invisible(letter) {
            visible.extend(
                letter
                    .encode_utf16(&mut [0; 2])
                    .iter()
                    .map(|unit| format!("\\u{unit:04x}")),
            );
        } else {
            visible.push(letter);
        }
    }
    visible
}

#[cfg(test)]
mod tests {
    use super::*;

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
        assert_eq!(
            in_words(Some(680.4), Some(1.2), 1),
            ", 680/s, 2 s left, 1 failed"
        );
        assert_eq!(
            in_words(Some(1.5), Some(59.5), 0),
            ", 1.50/s, 1 min 0 s left"
        );
        assert_eq!(
            in_words(Some(0.25), Some(3600.0 * 5.0 + 61.0), 0),
            ", 0.25/s, 5 h 1 min left"
        );
    }
}
