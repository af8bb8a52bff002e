//! A stopped study resumes and ends with the same bytes, however it was stopped. Nothing here is
//! mocked: processes are killed, files are truncated and damaged, disks are full.

#[cfg(unix)]
mod unix;

use std::fs;
use std::io::BufReader;
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::thread::sleep;
use std::time::{Duration, Instant};

use bristle_app::store::journal::{JournalError, Length, StudyKeys};
use bristle_study::grid::CaseResult;
use serde_json::{Value, json};

use crate::program::{self, brush, has, kill, lacks};

/// A study that takes some tenths of a second, with two kinds of passes, and failing cases. Only
/// the velocity has several values: with several depths each run would draw maps, which would take
/// longer than the simulation.
const FILE: &str = concat!(
    brush!(10, "filament_count_uncertainty = 600\n"),
    "
[solver]
relative_tolerance = 1e-4

[study]
brushing_velocity_m_s = { start = 2.0, stop = 24.0, step = 0.5 }
penetration_depth_m = [2.0e-3]
\"contact.friction_coefficient\" = [0.0, 0.1]
\"contact.stiffness_n_m\" = [1e5, 1e300]
"
);
/// Number of cases, and of failing cases.
const CASES: usize = 180;
const FAILURES: usize = 90;
/// The contents of the directory after a study has ended.
const RESULTS: &[&str] = &[
    "figures",
    "journal.jsonl",
    "report.html",
    "runs.csv",
    #[cfg(feature = "parquet")]
    "runs.parquet",
    "study.json",
];

/// Exit statuses: failed cases, bad input or files, Ctrl-C.
const FAILED_CASES: i32 = 3;
const REFUSED: i32 = 2;
const INTERRUPTED: i32 = 130;

/// Returns a study long enough to keep running throughout a test.
fn long_file() -> String {
    FILE.replace("step = 0.5", "step = 0.001")
}

/// `runs.csv` of the undisturbed study, and its duration.
static UNDISTURBED: LazyLock<(String, Duration)> = LazyLock::new(|| {
    let workspace = ResumeDirectory::new();
    let begin = Instant::now();
    ends(&workspace.study(""), FAILED_CASES);
    (workspace.read("runs.csv"), begin.elapsed())
});

/// A directory with the input file of the study and the directory of its results.
struct ResumeDirectory(program::Workspace);

impl ResumeDirectory {
    fn new() -> Self {
        Self(program::Workspace::with(FILE))
    }

    fn result(&self, name: &str) -> PathBuf {
        self.0.path("results").join(name)
    }

    fn write_input(&self, text: &str) {
        self.0.write("case.toml", text);
    }

    fn read(&self, name: &str) -> String {
        self.0.read(&format!("results/{name}"))
    }

    fn journal(&self) -> Vec<u8> {
        fs::read(self.result("journal.jsonl")).unwrap_or_default()
    }

    fn write_journal(&self, bytes: &[u8]) {
        fs::create_dir_all(self.0.path("results")).expect("the directory can be made");
        self.0.write("results/journal.jsonl", bytes);
    }

    /// Returns a call of the study in this directory.
    fn command(&self, options: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bristle"));
        command
            .args(["study", "case.toml", "--out", "results"])
            .args(options.split_whitespace());
        self.set_up(command)
    }

    /// Returns this call from a shell that has run `before`.
    fn command_after(&self, before: &str) -> Command {
        let mut command = Command::new("sh");
        command.args([
            "-c",
            &format!("{before}\nexec \"$0\" study case.toml --out results"),
        ]);
        command.arg(env!("CARGO_BIN_EXE_bristle"));
        self.set_up(command)
    }

    fn set_up(&self, mut command: Command) -> Command {
        command
            .current_dir(self.0.path(""))
            .env_remove("RUST_LOG")
            .stdin(Stdio::null());
        command.stdout(Stdio::piped()).stderr(Stdio::piped());
        command
    }

    fn start(&self, options: &str) -> Child {
        self.command(options).spawn().expect("the program starts")
    }

    /// Runs the study to its end.
    fn study(&self, options: &str) -> Output {
        self.command(options).output().expect("the program starts")
    }

    /// Expects the study to end as if nothing had disturbed it.
    fn ends_as_undisturbed(&self, options: &str) -> Output {
        let output = self.study(options);
        ends(&output, FAILED_CASES);
        self.is_as_undisturbed();
        output
    }

    /// Returns the message of a study that ends as if nothing had disturbed it.
    fn said_undisturbed(&self, options: &str) -> String {
        error_text(&self.ends_as_undisturbed(options))
    }

    /// Expects exactly the files of an undisturbed study.
    fn is_as_undisturbed(&self) {
        assert!(self.read("runs.csv") == UNDISTURBED.0, "runs.csv differs");
        let digest = bristle_codegen::fingerprint::digest(UNDISTURBED.0.as_bytes());
        assert!(
            self.read("study.json").contains(&digest),
            "study.json belongs to another runs.csv"
        );
        assert_eq!(self.0.names("results"), RESULTS);
        assert_eq!(self.done(), CASES);
    }

    /// Returns the number of cases in the journal, none of whose lines is cut off.
    fn done(&self) -> usize {
        let (results, length) = self.contents(FILE).expect("the journal is whole");
        assert_eq!(length.torn, 0, "no line is cut off");
        results.iter().flatten().count()
    }

    /// Expects the study to be refused with unchanged result files.
    fn is_refused(&self, options: &str) -> String {
        let files = || (self.journal(), fs::read(self.result("runs.csv")).ok());
        let before = files();
        let output = self.study(options);
        let message = ends(&output, REFUSED);
        assert!(output.stdout.is_empty());
        assert!(files() == before, "a file has changed: {message}");
        message
    }

    /// Returns the contents of the journal of the study in an input file.
    fn contents(&self, file: &str) -> Result<(Vec<Option<CaseResult>>, Length), JournalError> {
        StudyKeys::new(&program::study(file)).read(BufReader::new(self.journal().as_slice()))
    }

    /// Returns the number of complete lines in the journal, including the header.
    fn lines(&self) -> usize {
        self.journal().iter().filter(|&&byte| byte == b'\n').count()
    }

    /// Waits until the journal has a number of lines, or the process has ended.
    fn wait_for_lines(&self, lines: usize, child: &mut Child) {
        while self.lines() < lines && child.try_wait().expect("the process is ours").is_none() {
            sleep(Duration::from_millis(1));
        }
    }
}

/// Expects a call to end with an exit status. Returns its message.
#[track_caller]
fn ends(output: &Output, status: i32) -> String {
    let message = error_text(output);
    assert_eq!(output.status.code(), Some(status), "{message}");
    message
}

fn error_text(output: &Output) -> String {
    let text = String::from_utf8(output.stderr.clone()).expect("messages are UTF-8");
    assert!(!text.contains("panicked"), "{text}");
    // No progress bar without a terminal.
    assert!(!text.contains(['\r', '\u{1b}']), "{text:?}");
    text
}

#[test]
fn a_study_that_is_killed_twenty_times_ends_with_the_same_bytes() {
    const KILLS: usize = 20;
    let (_, duration) = &*UNDISTURBED;
    let mut random = fastrand::Rng::with_seed(6);
    let mut workspace = ResumeDirectory::new();
    let (mut kills, mut midway) = (0, 0);
    for round in 0.. {
        assert!(
            round < 10 * KILLS,
            "the study is always faster than the kill"
        );
        let options = ["--threads 1", "--threads 2", "--threads 3"][round % 3];
        let mut child = workspace.start(options);
        // Half of the kills come after a random time, which also hits the start and the end. The
        // others come after a random number of cases, which does not depend on the load of the
        // machine.
        if round % 2 == 0 {
            sleep(duration.mul_f64(random.f64()));
        } else {
            let lines = workspace.lines() + random.usize(0..CASES / 2);
            workspace.wait_for_lines(lines, &mut child);
        }
        let status = kill(child);
        // A kill may leave only the last line incomplete.
        let done = workspace
            .contents(FILE)
            .expect("only the last line can be cut off")
            .0
            .iter()
            .flatten()
            .count();
        if let Some(code) = status.code() {
            assert_eq!(code, FAILED_CASES);
            workspace.is_as_undisturbed();
            workspace = ResumeDirectory::new();
            continue;
        }
        kills += 1;
        midway += usize::from(0 < done && done < CASES);
        if kills == KILLS {
            break;
        }
    }
    workspace.ends_as_undisturbed("");
    assert!(
        midway >= KILLS / 5,
        "only {midway} of {KILLS} kills hit a study with some, but not all, cases done"
    );
}

#[test]
fn a_finished_study_is_written_again_from_its_journal() {
    let workspace = ResumeDirectory::new();
    // A killed process has left half a file.
    workspace.write_journal(b"");
    let leftover = "results/.runs.csv.bristle-a1B2c3";
    workspace.0.write(leftover, "half");
    workspace.ends_as_undisturbed("");
    let journal = workspace.journal();
    fs::remove_file(workspace.result("runs.csv")).expect("there is such a file");
    let all = "180 of 180 cases are in `results/journal.jsonl`, 0 remain";
    has(&workspace.said_undisturbed(""), &[all]);
    assert!(workspace.journal() == journal);
    let message = workspace.said_undisturbed("--restart");
    has(&message, &["has been discarded"]);
    lacks(&message, &[" remain"]);
}

/// The unit tests of `bristle_app::store::journal` cut it off at each byte.
#[test]
fn a_line_that_was_cut_off_is_dropped_with_a_note() {
    let workspace = ResumeDirectory::new();
    workspace.ends_as_undisturbed("");
    let whole = workspace.journal();
    workspace.write_journal(&whole[..whole.len() - 1]);
    let output = workspace
        .command("")
        .env("RUST_LOG", "warn")
        .output()
        .expect("the program starts");
    let last = whole.split(|&byte| byte == b'\n').nth(CASES);
    let torn = last.expect("the last line").len();
    let note =
        format!("note: the last {torn} bytes of `results/journal.jsonl` were an incomplete line");
    let logged = "WARN bristle_app::store::journal_file: dropped an incomplete line at the end of the journal";
    has(
        &ends(&output, FAILED_CASES),
        &[&note, "179 of 180 cases", logged],
    );
    workspace.is_as_undisturbed();
    // A header that was cut off is dropped, too.
    workspace.write_journal(&whole[..100]);
    has(
        &workspace.said_undisturbed(""),
        &["were an incomplete line"],
    );
}

/// More tests are in `bristle_app::store::journal`.
#[test]
fn other_journals_are_not_mixed_in() {
    let workspace = ResumeDirectory::new();
    let other = FILE
        .replace("length_m = 0.040", "length_m = 0.041")
        .replace("step = 0.5", "step = 1.0");
    workspace.write_input(&other);
    ends(&workspace.study(""), FAILED_CASES);
    workspace.write_input(FILE);
    let kept = "note: the earlier results, of other settings or another build, are kept in `results/previous`";
    has(&error_text(&workspace.study("")), &[kept]);
    assert!(
        workspace.read("runs.csv") == UNDISTURBED.0,
        "runs.csv differs"
    );
    let names = ["figures", "report.html", "runs.csv", "study.json"];
    assert_eq!(workspace.0.names("results/previous"), names);
    // The cases of the first study are still in the journal.
    workspace.write_input(&other);
    has(
        &error_text(&workspace.study("")),
        &["92 of 92 cases are in", "`results/previous-2`"],
    );
    workspace.write_input(FILE);
    let workspace = ResumeDirectory::new();
    workspace.ends_as_undisturbed("");
    // Damage in the middle.
    let mut journal = workspace.journal();
    let middle = journal.len() / 2;
    journal[middle] ^= 0x10;
    workspace.write_journal(&journal);
    has(&workspace.is_refused(""), &[" is damaged", "--restart"]);
    // Not even a restart discards a file that belongs to someone else.
    workspace.write_journal(b"what I did today\n");
    for options in ["", "--restart"] {
        has(
            &workspace.is_refused(options),
            &["not a journal of Bristle", "move the file away"],
        );
    }
}

#[test]
fn a_second_study_in_the_same_directory_is_refused() {
    let workspace = ResumeDirectory::new();
    workspace.write_input(&long_file());
    let mut first = workspace.start("--threads 1");
    workspace.wait_for_lines(2, &mut first);
    for options in ["", "--restart"] {
        let message = ends(&workspace.study(options), REFUSED);
        let other = "another command is writing to the directory `results`";
        has(&message, &[other]);
    }
    assert!(
        first.try_wait().expect("the process is ours").is_none(),
        "the first one continues"
    );
    kill(first);
    // The lock ends with the process.
    workspace.write_input(FILE);
    workspace.ends_as_undisturbed("--restart");
}

#[test]
fn progress_and_summary_are_for_programs_too() {
    let workspace = ResumeDirectory::new();
    let begin = Instant::now();
    let output = workspace.ends_as_undisturbed("--json");
    let seconds = begin.elapsed().as_secs_f64();
    let text = String::from_utf8(output.stdout.clone()).expect("UTF-8");
    let events: Vec<Value> = text
        .lines()
        .map(|line| serde_json::from_str(line).expect(line))
        .collect();
    let (summary, progress) = events.split_last().expect("a summary");
    assert!(
        progress.len() >= 2 && progress.len() as f64 <= 10.0 * seconds + 2.0,
        "{text}"
    );
    let mut last = 0;
    for event in progress {
        let count = |key: &str| event[key].as_u64().expect("a count");
        assert_eq!(count("total"), CASES as u64);
        assert!(count("done") >= last && count("failures") <= count("done"));
        last = count("done");
        for key in ["rate", "seconds_left"] {
            let known = event[key].as_f64().is_some_and(|number| number >= 0.0);
            assert!(known || event[key].is_null(), "{event}");
        }
    }
    assert!(progress[0]["done"] == 0 && progress[0]["rate"].is_null());
    assert_eq!(last as usize, CASES);
    let mut summary = summary.clone();
    assert!(summary["findings"].take().is_array());
    let method = summary["method"].take();
    assert!(
        method
            .as_str()
            .is_some_and(|text| text.contains("ESDIRK5(4)"))
    );
    let time = summary["seconds"].take().as_f64();
    assert!(time.is_some_and(|time| 0.0 < time && time < seconds));
    let mut files = vec![
        "results/runs.csv",
        "results/study.json",
        "results/report.html",
    ];
    if cfg!(feature = "parquet") {
        files.insert(1, "results/runs.parquet");
    }
    let expected = json!({
        "event": "summary", "cases": CASES, "failures": FAILURES, "resumed": 0,
        "seconds": null, "files": files, "findings": null, "method": null,
    });
    assert_eq!(summary, expected);
    // There are no tables, but warnings and errors are reported.
    let message = error_text(&output);
    assert!(message.starts_with("warning: "), "{message}");
    has(
        &message,
        &[
            "`contact.stiffness_n_m` is 1e300",
            "\nerror: 90 cases failed",
        ],
    );

    let output = workspace.ends_as_undisturbed("--json");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let resumed = format!("\"resumed\":{CASES},");
    has(text.lines().last().expect("a summary"), &[&resumed]);
}

#[test]
fn the_log_is_written_on_request() {
    let workspace = ResumeDirectory::new();
    let log = |filter: &str| {
        let output = workspace
            .command("--restart")
            .env("RUST_LOG", filter)
            .output()
            .expect("the program starts");
        // The log is not on stdout.
        lacks(&String::from_utf8_lossy(&output.stdout), &["bristle_study"]);
        ends(&output, FAILED_CASES)
    };
    let debug = log("debug");
    for (line, count) in [
        (
            "DEBUG bristle_study::grid::scheduler: case done case=",
            CASES - FAILURES,
        ),
        (
            "WARN bristle_study::grid::scheduler: case failed case=",
            FAILURES,
        ),
    ] {
        // Cases whose courses are drawn may be simulated again.
        assert!(debug.matches(line).count() >= count, "{line}");
    }
    let started =
        "INFO bristle_study::grid::scheduler: study started cases=180 to_simulate=180 threads=";
    has(
        &debug,
        &[
            started,
            "DEBUG bristle_app::store::journal_file: journal opened",
        ],
    );
    let warnings = log("bristle=warn");
    has(&warnings, &["WARN bristle_study"]);
    lacks(&warnings, &["INFO"]);
    lacks(&log(""), &["bristle_study"]);
    let wrong = "note: RUST_LOG is `bristle=loudly` and has no effect";
    has(&log("bristle=loudly"), &[wrong]);
}
