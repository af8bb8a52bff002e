//! Text for people: results on stdout, all else on stderr and above the progress bar, if any. Also
//! the log requested by `RUST_LOG`.

use std::env::{self, VarError};
use std::fmt::Display;
use std::io::{self, Write};
use std::path::Path;

use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::Finding;
use bristle_app::store::staged::{FileError, StagedFile};
use bristle_study::text::layout::WIDTH;
use bristle_study::text::{Lines, shown_path};
use indicatif::ProgressBar;
use parking_lot::Mutex;
use terminal_size::terminal_size_of;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::layer::SubscriberExt;
use tracing_subscriber::util::SubscriberInitExt;

/// The bar below the text.
static BAR: Mutex<Option<ProgressBar>> = Mutex::new(None);

/// Keeps a bar below all text written from now on.
pub fn keep_below(bar: &ProgressBar) {
    *BAR.lock() = Some(bar.clone());
}

/// Forgets the bar, once it has been cleared.
pub fn nothing_below() {
    *BAR.lock() = None;
}

/// Tells the user a message. Text quoted in it cannot drive the terminal. A closed stderr is not an
/// error.
pub fn say(message: impl Display) {
    above_the_bar(|| {
        let _ = writeln!(io::stderr(), "{}", Lines(message));
    });
}

/// Writes a last message in place of the bar.
pub fn say_at_the_end(message: impl Display) {
    let bar = BAR.lock().take();
    if let Some(bar) = bar {
        bar.finish_and_clear();
    }
    let _ = writeln!(io::stderr(), "{}", Lines(message));
}

fn above_the_bar<R>(write: impl FnOnce() -> R) -> R {
    let bar = BAR.lock().clone();
    match bar {
        Some(bar) => bar.suspend(write),
        None => write(),
    }
}

/// Writes a log to stderr if the environment variable `RUST_LOG` requests one, with values such as
/// `debug` or `bristle_study=debug`.
///
/// Only levels per module can be selected. The usual filter would add regular expressions.
pub fn start_log() {
    const VARIABLE: &str = "RUST_LOG";
    let wanted = match env::var(VARIABLE) {
        Ok(wanted) if !wanted.is_empty() => wanted,
        Ok(_) | Err(VarError::NotPresent) => return,
        Err(VarError::NotUnicode(_)) => {
            return say(format_args!(
                "note: {VARIABLE} is not text and has no effect"
            ));
        }
    };
    match wanted.parse::<Targets>() {
        Ok(targets) => {
            let lines = tracing_subscriber::fmt::layer()
                .with_ansi(false)
                .with_writer(|| Log);
            tracing_subscriber::registry()
                .with(targets)
                .with(lines)
                .init();
        }
        Err(error) => {
            say(format_args!(
                "note: {VARIABLE} is `{wanted}` and has no effect: {error}; try `debug` or `bristle=debug`"
            ));
        }
    }
}

/// Writes whole lines of the log.
struct Log;

impl Write for Log {
    fn write(&mut self, lines: &[u8]) -> io::Result<usize> {
        above_the_bar(|| write!(io::stderr(), "{}", Lines(String::from_utf8_lossy(lines))))?;
        Ok(lines.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        io::stderr().flush()
    }
}

/// Writes data to stdout. A reader that stops early, such as `head`, is not an error.
pub fn print(data: &str) -> io::Result<()> {
    print_by(|| io::stdout().write_all(data.as_bytes()))
}

/// Minimum width of tables, in columns.
const MIN_WIDTH: usize = 40;

/// Returns the width in columns of results on stdout: the value of `COLUMNS`, or else the width of
/// the terminal; 80 without a terminal.
pub fn width() -> usize {
    let stated = env::var("COLUMNS")
        .ok()
        .and_then(|columns| columns.parse().ok())
        .filter(|columns| *columns > 0);
    let measured = || terminal_size_of(io::stdout()).map(|(width, _)| usize::from(width.0));
    stated.or_else(measured).unwrap_or(WIDTH).max(MIN_WIDTH)
}

/// Prints results that people read. As in [`say`], text quoted in them cannot drive the terminal.
pub fn show(results: impl Display) -> io::Result<()> {
    let text = Lines(results).to_string();
    print(&format!("{}\n", text.trim_end_matches('\n')))
}

/// Calls a function that writes to stdout, and flushes its output. All output to stdout passes
/// through here.
pub fn print_by(write: impl FnOnce() -> io::Result<()>) -> io::Result<()> {
    match write().and_then(|()| io::stdout().flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
}

/// Shows the assumed settings, if any.
pub fn show_assumptions(assumptions: &Assumptions) -> io::Result<()> {
    if assumptions.list.is_empty() {
        Ok(())
    } else {
        show(format_args!("\n{}", assumptions.text(width())))
    }
}

/// Tells the user the findings about results.
pub fn say_findings(findings: &[Finding]) {
    findings.iter().map(Finding::warning).for_each(say);
}

/// Tells the user the place of earlier results that others have replaced.
pub fn say_kept(place: &Path) {
    say(format_args!(
        "note: the earlier results, of other settings or another build, are kept in `{}`",
        shown_path(place)
    ));
}

/// Tells the user that a file was written.
pub fn say_written(path: &Path) {
    say(format_args!("wrote {}", shown_path(path)));
}

/// Gives files their final names, and tells the user.
pub fn commit(files: impl IntoIterator<Item = StagedFile>) -> Result<(), FileError> {
    files
        .into_iter()
        .try_for_each(|file| file.commit().map(|path| say_written(&path)))
}
