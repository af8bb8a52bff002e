//! Signals, full disks and read-only directories on Unix.

use std::process::Command;

use super::{CASES, INTERRUPTED, REFUSED, RESULTS, ResumeDirectory, ends, error_text, long_file};
use crate::program::{has, ignores_interrupts, interrupt, lacks, send};

#[test]
fn an_interrupt_tells_how_to_resume() {
    if ignores_interrupts() {
        return;
    }
    let workspace = ResumeDirectory::new();
    workspace.write_input(&long_file());
    let mut child = workspace.start("--threads 2");
    workspace.wait_for_lines(5, &mut child);
    interrupt(&child);
    let output = child.wait_with_output().expect("the process is ours");
    let message = ends(&output, INTERRUPTED);
    let (results, length) = workspace.contents(&long_file()).expect("a whole journal");
    assert_eq!(length.torn, 0, "no line is cut off");
    let (done, total) = (results.iter().flatten().count(), results.len());
    let expected = format!(
        "stopped: {done} of {total} cases are in `results/journal.jsonl`; run the same command again to resume"
    );
    has(&message, &[&expected]);
}

/// `nohup` ignores SIGHUP, which is no reason to lose SIGTERM.
#[test]
fn a_program_that_ignores_hangups_stops_on_sigterm() {
    let workspace = ResumeDirectory::new();
    workspace.write_input(&long_file());
    let mut command = workspace.command_after("trap '' HUP");
    let mut child = command.spawn().expect("there is a shell");
    workspace.wait_for_lines(5, &mut child);
    send("-HUP", &child);
    send("-TERM", &child);
    let output = child.wait_with_output().expect("the process is ours");
    let message = ends(&output, INTERRUPTED);
    has(&message, &["run the same command again to resume"]);
}

/// Writing fails if a file would exceed the limit of the shell, as on a full disk.
#[test]
fn a_file_that_cannot_grow_loses_nothing() {
    let workspace = ResumeDirectory::new();
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
        let message = ends(&limited(blocks), REFUSED);
        has(
            &message,
            &[
                "error: cannot write `",
                &format!("results/{file}`: File too large"),
            ],
        );
        lacks(&message, &[".bristle-"]);
        (message, workspace.done())
    };
    // Not even the header fits.
    let (_, done) = stops(0, "journal.jsonl");
    assert_eq!(workspace.0.names("results"), ["journal.jsonl"]);
    assert_eq!((workspace.journal().len(), done), (0, 0));
    // Some cases fit.
    let (message, done) = stops(30, "journal.jsonl");
    assert_eq!(workspace.0.names("results"), ["figures", "journal.jsonl"]);
    assert!(0 < done && done < CASES);
    let done = format!("{done} of 180 cases are in the journal");
    has(&message, &[&done, "run the same command again to resume"]);
    workspace.ends_as_undisturbed("");
    // All cases fit, but the table of results does not: the earlier one stays.
    workspace.0.write("results/runs.csv", "the earlier one");
    let (message, done) = stops(2, "runs.csv");
    has(&message, &["180 of 180 cases are in the journal"]);
    assert_eq!(
        (done, workspace.read("runs.csv").as_str()),
        (CASES, "the earlier one")
    );
    assert_eq!(workspace.0.names("results"), RESULTS);
    workspace.ends_as_undisturbed("");
}

#[test]
fn a_read_only_directory_is_refused() {
    let workspace = ResumeDirectory::new();
    workspace.ends_as_undisturbed("");
    let before = (workspace.journal(), workspace.read("runs.csv"));
    // As root of a separate namespace, where it may mount.
    let unshare = |script: &str| {
        let mut command = Command::new("unshare");
        command.args(["--map-root-user", "--mount", "sh", "-e", "-c", script]);
        command.arg(env!("CARGO_BIN_EXE_bristle"));
        workspace.set_up(command).output()
    };
    let mount = "mount --bind results results\nmount -o remount,ro,bind results\n";
    if !unshare(mount).is_ok_and(|output| output.status.success()) {
        println!("skipped: this system forbids mounting");
        return;
    }
    let script = "
        for option in --json --restart; do
            \"$0\" study case.toml --out results $option || echo status $?
        done";
    let output = unshare(&format!("{mount}{script}")).expect("it has just run");
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
