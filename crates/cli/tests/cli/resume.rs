//! However a study is stopped, it resumes and ends with the same bytes. Nothing here is mocked:
//! processes are killed, files are truncated and damaged, disks are full.

use std::fs;
use std::io::{BufReader, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Output, Stdio};
use std::sync::LazyLock;
use std::thread::sleep;
use std::time::{Duration, Instant};

use bristle_store::journal::{Contents, Journal, JournalError};
use serde_json::Value;

use crate::program::{self, brush, has, ignores_interrupts, interrupt, kill};

/// A study that takes some tenths of a second, with two kinds of passes, and cases that fail. Only
/// the velocity has several values. With several depths each run would draw maps, which would take
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
/// The number of its cases, and of those that fail.
const CASES: usize = 180;
const FAILURES: usize = 90;
/// The contents of the directory after a study has ended.
const RESULTS: &[&str] = if cfg!(feature = "parquet") {
    &[
        "figures",
        "journal.jsonl",
        "report.html",
        "runs.csv",
        "runs.parquet",
        "study.json",
    ]
} else {
    &[
        "figures",
        "journal.jsonl",
        "report.html",
        "runs.csv",
        "study.json",
    ]
};

/// Exit statuses: failed cases, bad input or files, Ctrl-C.
const FAILED_CASES: i32 = 3;
const REFUSED: i32 = 2;
const INTERRUPTED: i32 = 130;

/// A study long enough to keep running throughout a test.
fn long_file() -> String {
    FILE.replace("step = 0.5", "step = 0.001")
}

/// `runs.csv` of the undisturbed study, and the time that it takes.
static UNDISTURBED: LazyLock<(String, Duration)> = LazyLock::new(|| {
    let workspace = Workspace::new();
    let begin = Instant::now();
    let output = workspace.study("");
    let duration = begin.elapsed();
    assert_eq!(
        output.status.code(),
        Some(FAILED_CASES),
        "{}",
        error_text(&output)
    );
    (workspace.read("runs.csv"), duration)
});

/// A directory with the input file of the study and the directory of its results.
struct Workspace(program::Workspace);

impl Workspace {
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

    /// A call of the study in this directory.
    fn command(&self, options: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_bristle"));
        command
            .args(["study", "case.toml", "--out", "results"])
            .args(options.split_whitespace());
        self.set_up(command)
    }

    /// The same from a shell that has run `before`.
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
        assert_eq!(
            output.status.code(),
            Some(FAILED_CASES),
            "{}",
            error_text(&output)
        );
        self.is_as_undisturbed();
        output
    }

    /// Expects the files of an undisturbed study, and no others.
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

    /// The number of cases in the journal, no line of which is cut off.
    fn done(&self) -> usize {
        let contents = self.contents().expect("the journal is whole");
        assert_eq!(contents.torn, 0, "no line is cut off");
        contents.results.iter().flatten().count()
    }

    /// Expects the study to be refused, and its result files to stay unchanged.
    fn is_refused(&self, options: &str) -> String {
        let files = || (self.journal(), fs::read(self.result("runs.csv")).ok());
        let before = files();
        let output = self.study(options);
        let message = error_text(&output);
        assert_eq!(output.status.code(), Some(REFUSED), "{message}");
        assert!(output.stdout.is_empty());
        assert!(files() == before, "a file has changed: {message}");
        message
    }

    /// The contents of the journal.
    fn contents(&self) -> Result<Contents, JournalError> {
        let study = program::study(FILE);
        Journal::new(&study).read(&study, BufReader::new(self.journal().as_slice()))
    }

    /// The number of complete lines in the journal, including the header.
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

fn error_text(output: &Output) -> String {
    let text = String::from_utf8(output.stderr.clone()).expect("messages are UTF-8");
    assert!(!text.contains("panicked"), "{text}");
    // No progress bar where there is no terminal.
    assert!(!text.contains(['\r', '\u{1b}']), "{text:?}");
    text
}

#[test]
fn a_study_that_is_killed_twenty_times_ends_with_the_same_bytes() {
    const KILLS: usize = 20;
    let (_, duration) = &*UNDISTURBED;
    let mut random = fastrand::Rng::with_seed(6);
    let mut workspace = Workspace::new();
    let (mut kills, mut midway, mut ends) = (0, 0, 0);
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
            .contents()
            .expect("only the last line can be cut off")
            .results
            .iter()
            .flatten()
            .count();
        if let Some(code) = status.code() {
            assert_eq!(code, FAILED_CASES);
            workspace.is_as_undisturbed();
            workspace = Workspace::new();
            ends += 1;
            continue;
        }
        kills += 1;
        midway += usize::from(0 < done && done < CASES);
        if kills == KILLS {
            break;
        }
    }
    workspace.ends_as_undisturbed("");
    println!(
        "{kills} kills, {midway} of them with some cases done; {ends} studies ended before their kill"
    );
    assert!(
        midway >= KILLS / 5,
        "only {midway} of {KILLS} kills hit a study with some, but not all, cases done"
    );
}

#[test]
fn a_finished_study_is_written_again_from_its_journal() {
    let workspace = Workspace::new();
    workspace.ends_as_undisturbed("");
    let journal = workspace.journal();
    fs::remove_file(workspace.result("runs.csv")).expect("there is such a file");
    let message = error_text(&workspace.ends_as_undisturbed(""));
    assert!(
        message.contains("180 of 180 cases are in `results/journal.jsonl`, 0 remain"),
        "{message}"
    );
    assert!(workspace.journal() == journal);
    let message = error_text(&workspace.ends_as_undisturbed("--restart"));
    assert!(
        message.contains("has been discarded") && !message.contains(" remain"),
        "{message}"
    );
}

#[test]
fn a_line_that_was_cut_off_is_dropped_with_a_note() {
    let workspace = Workspace::new();
    workspace.ends_as_undisturbed("");
    let whole = workspace.journal();
    let last = whole[..whole.len() - 1]
        .iter()
        .rposition(|&byte| byte == b'\n')
        .expect("several lines")
        + 1;
    for cut in [
        whole.len() - 1,
        whole.len() - 2,
        usize::midpoint(last, whole.len()),
        last + 1,
    ] {
        workspace.write_journal(&whole[..cut]);
        let message = error_text(&workspace.ends_as_undisturbed(""));
        let note = format!(
            "note: the last {} bytes of `results/journal.jsonl` were an incomplete line",
            cut - last
        );
        has(&message, &[&note, "179 of 180 cases"]);
        assert_eq!(workspace.lines(), CASES + 1);
    }
    // The same for a header that was cut off.
    for cut in [0, 1, 300] {
        workspace.write_journal(&whole[..cut]);
        let message = error_text(&workspace.ends_as_undisturbed(""));
        assert_eq!(
            message.contains("were an incomplete line"),
            cut > 0,
            "{message}"
        );
    }
}

#[test]
fn damage_in_the_middle_is_refused() {
    let workspace = Workspace::new();
    workspace.ends_as_undisturbed("");
    let mut journal = workspace.journal();
    let middle = journal.len() / 2;
    journal[middle] ^= 0x10;
    workspace.write_journal(&journal);
    let line = journal[..middle]
        .iter()
        .filter(|&&byte| byte == b'\n')
        .count()
        + 1;
    has(
        &workspace.is_refused(""),
        &[
            "results/journal.jsonl",
            &format!("line {line} is damaged"),
            "--restart",
            "--out",
        ],
    );
    workspace.ends_as_undisturbed("--restart");
}

#[test]
fn results_of_other_settings_are_not_mixed_in() {
    let workspace = Workspace::new();
    workspace.write_input(
        &FILE
            .replace("length_m = 0.040", "length_m = 0.041")
            .replace("step = 0.5", "step = 1.0"),
    );
    assert_eq!(workspace.study("").status.code(), Some(FAILED_CASES));
    workspace.write_input(FILE);
    has(
        &workspace.is_refused(""),
        &[
            "cannot resume from `results/journal.jsonl`",
            "filament.length_m: 0.041 there, 0.04 here",
            "sweep of process.brushing_velocity_m_s: 23 values from 2.0 to 24.0 there, 45 values",
            "--restart",
            "--out",
        ],
    );
    workspace.ends_as_undisturbed("--restart");
}

#[test]
fn results_of_another_build_are_not_mixed_in() {
    let workspace = Workspace::new();
    // With a valid check for the line.
    let study = program::study(FILE);
    let header = Journal::new(&study).header().to_owned();
    let (object, _) = header.split_once(",\"check\"").expect("a check");
    let object = object.replacen(bristle::equations::FINGERPRINT, &"0".repeat(64), 1);
    let check = &bristle_codegen::fingerprint::digest(object.as_bytes())[..16];
    workspace.write_journal(format!("{object},\"check\":\"{check}\"}}\n").as_bytes());
    has(
        &workspace.is_refused(""),
        &["equations (SHA-256): 000000000000 there"],
    );
    workspace.ends_as_undisturbed("--restart");
}

#[test]
fn a_file_that_is_not_a_journal_is_left_alone() {
    let workspace = Workspace::new();
    workspace.write_journal(b"what I did today\n");
    for options in ["", "--restart"] {
        has(
            &workspace.is_refused(options),
            &["not the journal of a study", "move the file away"],
        );
    }
}

#[test]
fn a_second_study_in_the_same_directory_is_refused() {
    let workspace = Workspace::new();
    workspace.write_input(&long_file());
    let mut first = workspace.start("--threads 1");
    workspace.wait_for_lines(2, &mut first);
    for options in ["", "--restart"] {
        let output = workspace.study(options);
        assert_eq!(output.status.code(), Some(REFUSED));
        has(
            &error_text(&output),
            &["another study is writing to the directory `results`"],
        );
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
fn leftovers_of_a_killed_process_are_removed() {
    let workspace = Workspace::new();
    workspace.write_journal(b"");
    workspace
        .0
        .write("results/.runs.csv.bristle-a1B2c3", "half");
    workspace.ends_as_undisturbed("");
}

#[test]
fn progress_and_summary_are_for_programs_too() {
    let workspace = Workspace::new();
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
        let keys: Vec<&String> = event.as_object().expect("an object").keys().collect();
        assert_eq!(keys.len(), 6, "{event}");
        assert_eq!(event["event"], "progress");
        assert_eq!(event["total"], CASES);
        let count = |key: &str| event[key].as_u64().expect("a count");
        assert!(count("done") >= last && count("failures") <= count("done"));
        last = count("done");
        for key in ["rate", "seconds_left"] {
            let known = event[key].as_f64().is_some_and(|number| number >= 0.0);
            assert!(known || event[key].is_null(), "{event}");
        }
    }
    assert_eq!(progress[0]["done"], 0);
    assert_eq!(progress[0]["rate"], Value::Null);
    assert_eq!(last as usize, CASES);
    assert_eq!(
        (&summary["event"], &summary["cases"]),
        (&Value::from("summary"), &Value::from(CASES))
    );
    assert_eq!(
        (&summary["failures"], &summary["resumed"]),
        (&Value::from(FAILURES), &Value::from(0))
    );
    let tables: &[&str] = if cfg!(feature = "parquet") {
        &["results/runs.csv", "results/runs.parquet"]
    } else {
        &["results/runs.csv"]
    };
    let files = [tables, &["results/study.json", "results/report.html"]].concat();
    assert_eq!(summary["files"], serde_json::json!(files));
    assert!(
        summary["seconds"]
            .as_f64()
            .is_some_and(|time| 0.0 < time && time < seconds)
    );
    // There are no tables, but warnings of what is unusual and errors are reported.
    let message = error_text(&output);
    let (unusual, failures) = message.split_at(message.find("error: ").expect("an error"));
    assert!(
        unusual
            .lines()
            .all(|line| line.starts_with("warning: ") || line.starts_with("         ")),
        "{message}"
    );
    assert!(
        unusual.contains("`contact.stiffness_n_m` is 1e300"),
        "{message}"
    );
    assert!(failures.starts_with("error: 90 cases failed"), "{message}");

    let output = workspace.ends_as_undisturbed("--json");
    let text = String::from_utf8(output.stdout).expect("UTF-8");
    let summary: Value =
        serde_json::from_str(text.lines().last().expect("a summary")).expect("JSON");
    assert_eq!(
        (&summary["resumed"], &summary["failures"]),
        (&Value::from(CASES), &Value::from(FAILURES))
    );
}

#[test]
fn a_reader_that_leaves_does_not_stop_a_study() {
    let workspace = Workspace::new();
    let mut child = workspace.start("--json");
    let mut stdout = child.stdout.take().expect("a pipe");
    stdout
        .read_exact(&mut [0; 10])
        .expect("the first object comes");
    drop(stdout);
    let output = child.wait_with_output().expect("the process is ours");
    assert_eq!(
        output.status.code(),
        Some(FAILED_CASES),
        "{}",
        error_text(&output)
    );
    assert!(workspace.read("runs.csv") == UNDISTURBED.0);
}

#[test]
fn the_log_is_written_on_request() {
    let workspace = Workspace::new();
    let log = |filter: &str| {
        let output = workspace
            .command("--restart")
            .env("RUST_LOG", filter)
            .output()
            .expect("the program starts");
        assert_eq!(output.status.code(), Some(FAILED_CASES));
        assert!(
            !String::from_utf8_lossy(&output.stdout).contains("bristle_grid"),
            "the log is not on stdout"
        );
        error_text(&output)
    };
    let debug = log("debug");
    assert_eq!(
        debug
            .matches("DEBUG bristle_grid::scheduler: case done case=")
            .count(),
        CASES - FAILURES
    );
    assert_eq!(
        debug
            .matches("WARN bristle_grid::scheduler: case failed case=")
            .count(),
        FAILURES
    );
    let started = "INFO bristle_grid::scheduler: study started cases=180 to_simulate=180 threads=";
    has(
        &debug,
        &[started, "DEBUG bristle_store::journal_file: journal opened"],
    );
    let warnings = log("bristle=warn");
    assert!(
        warnings.contains("WARN bristle_grid") && !warnings.contains("INFO"),
        "{warnings}"
    );
    assert!(!log("").contains("bristle_grid"));
    let wrong = log("bristle=loudly");
    assert!(
        wrong.contains("note: RUST_LOG is `bristle=loudly` and has no effect"),
        "{wrong}"
    );

    // The log also reports a dropped line of the journal.
    let journal = workspace.journal();
    workspace.write_journal(&journal[..journal.len() - 1]);
    let output = workspace
        .command("")
        .env("RUST_LOG", "warn")
        .output()
        .expect("the program starts");
    let dropped =
        "WARN bristle_store::journal_file: dropped an incomplete line at the end of the journal";
    has(&error_text(&output), &[dropped]);
}

#[cfg(unix)]
mod unix {
    use super::*;

    #[test]
    fn an_interrupt_tells_how_to_resume() {
        if ignores_interrupts() {
            return;
        }
        let workspace = Workspace::new();
        workspace.write_input(&long_file());
        let mut child = workspace.start("--threads 2");
        workspace.wait_for_lines(5, &mut child);
        interrupt(&child);
        let output = child.wait_with_output().expect("the process is ours");
        let message = error_text(&output);
        assert_eq!(output.status.code(), Some(INTERRUPTED), "{message}");
        let study = program::study(&long_file());
        let contents = Journal::new(&study)
            .read(&study, workspace.journal().as_slice())
            .expect("a whole journal");
        let done = contents.results.iter().flatten().count();
        assert_eq!(contents.torn, 0, "no line is cut off");
        let (total, expected) = (
            study.case_count(),
            "are in `results/journal.jsonl`; run the same command again to resume",
        );
        assert!(
            message.contains(&format!("stopped: {done} of {total} cases {expected}")),
            "{message}"
        );
    }

    /// Writing fails if a file would exceed the limit set by the shell, just as it would on a full
    /// disk.
    #[test]
    fn a_file_that_cannot_grow_loses_nothing() {
        let workspace = Workspace::new();
        // A block has 512 bytes, or 1024 in some shells. Untrapped, the signal that comes with the
        // error would end the program.
        let limited = |blocks: u32| {
            let before = format!("trap '' XFSZ\nulimit -f {blocks}");
            workspace
                .command_after(&before)
                .output()
                .expect("there is a shell")
        };
        let stops = |blocks: u32, file: &str| {
            let output = limited(blocks);
            let message = error_text(&output);
            assert_eq!(output.status.code(), Some(REFUSED), "{message}");
            assert!(
                message.contains("error: cannot write `") && !message.contains(".bristle-"),
                "{message}"
            );
            assert!(
                message.contains(&format!("results/{file}`: File too large")),
                "{message}"
            );
            (message, workspace.done())
        };
        // Not even the header fits.
        let (_, done) = stops(1, "journal.jsonl");
        assert_eq!(workspace.0.names("results"), ["journal.jsonl"]);
        assert_eq!((workspace.journal().len(), done), (0, 0));
        // Some cases do.
        let (message, done) = stops(30, "journal.jsonl");
        assert_eq!(workspace.0.names("results"), ["figures", "journal.jsonl"]);
        assert!(0 < done && done < CASES);
        let done = format!("{done} of 180 cases are in the journal");
        has(&message, &[&done, "run the same command again to resume"]);
        workspace.ends_as_undisturbed("");
        // All do, but the table of results does not: the earlier one stays.
        workspace.0.write("results/runs.csv", "the earlier one");
        let (message, done) = stops(2, "runs.csv");
        assert!(
            message.contains("180 of 180 cases are in the journal"),
            "{message}"
        );
        assert_eq!(
            (done, workspace.read("runs.csv").as_str()),
            (CASES, "the earlier one")
        );
        assert_eq!(workspace.0.names("results"), RESULTS);
        workspace.ends_as_undisturbed("");
    }

    /// Runs a script as root of a namespace of its own, in which it may mount. Returns `None` if
    /// the system forbids it.
    fn with_mounts(workspace: &Workspace, script: &str) -> Option<Output> {
        let unshare = |script: &str| {
            let mut command = Command::new("unshare");
            command.args([
                "--map-root-user",
                "--mount",
                "sh",
                "-e",
                "-c",
                script,
                env!("CARGO_BIN_EXE_bristle"),
            ]);
            workspace.set_up(command).output()
        };
        fs::create_dir_all(workspace.0.path("results")).expect("the directory can be made");
        if !unshare("mount -t tmpfs none results").is_ok_and(|output| output.status.success()) {
            println!("skipped: this system forbids mounting");
            return None;
        }
        Some(unshare(script).expect("it has just run"))
    }

    #[test]
    fn a_full_disk_loses_nothing() {
        let workspace = Workspace::new();
        let script = "
            mount -t tmpfs -o size=40k none results
            \"$0\" study case.toml --out results > shown || echo status $?
            ls -A results
            cp results/journal.jsonl first.jsonl
            mount -o remount,size=64m results
            \"$0\" study case.toml --out results > shown || echo status $?
            ls -A results
            cp results/runs.csv runs.csv";
        let Some(output) = with_mounts(&workspace, script) else {
            return;
        };
        let message = error_text(&output);
        let said = String::from_utf8(output.stdout).expect("UTF-8");
        assert_eq!(
            said,
            format!(
                "status 2\nfigures\njournal.jsonl\nstatus 3\n{}\n",
                RESULTS.join("\n")
            ),
            "{message}"
        );
        assert!(
            message.contains("cannot write `results/journal.jsonl`: No space left on device"),
            "{message}"
        );
        assert!(
            message.contains("cases are in the journal; once there is room"),
            "{message}"
        );
        workspace.write_journal(&fs::read(workspace.0.path("first.jsonl")).expect("the journal"));
        let done = workspace.done();
        assert!(0 < done && done < CASES, "{message}");
        assert!(
            message.contains(&format!(
                "{done} of 180 cases are in `results/journal.jsonl`"
            )),
            "{message}"
        );
        assert!(
            fs::read_to_string(workspace.0.path("runs.csv")).expect("runs.csv") == UNDISTURBED.0
        );
    }

    #[test]
    fn a_read_only_directory_is_refused() {
        let workspace = Workspace::new();
        workspace.ends_as_undisturbed("");
        let before = (workspace.journal(), workspace.read("runs.csv"));
        let script = "
            mount --bind results results
            mount -o remount,ro,bind results
            for option in --json --restart; do
                \"$0\" study case.toml --out results $option || echo status $?
            done";
        let Some(output) = with_mounts(&workspace, script) else {
            return;
        };
        let message = error_text(&output);
        assert_eq!(
            String::from_utf8(output.stdout).expect("UTF-8"),
            "status 2\nstatus 2\n",
            "{message}"
        );
        let expected = "error: cannot write to the directory `results`: Read-only file system";
        assert_eq!(message.matches(expected).count(), 2, "{message}");
        assert!((workspace.journal(), workspace.read("runs.csv")) == before);
        assert_eq!(workspace.0.names("results"), RESULTS);
    }
}
