//! Checks the attack itself: what it must notice, it notices.

use std::hint::black_box;
use std::process::Command;
use std::thread::sleep;
use std::time::Duration;

use crate::runner::{Limits, Refused, Verdict, judge};
use crate::targets::program::observe;

/// Plants one of each fault.
pub fn run() {
    let limits = Limits {
        time: Duration::from_millis(50),
        memory: 1 << 20,
    };
    let refused = |message: &str| Err(Refused(message.to_owned()));
    let found = |check: &dyn Fn() -> Verdict| judge(limits, check).0;
    let noticed = |expected: &str, check: &dyn Fn() -> Verdict| {
        let problem = found(check).expect_err(expected);
        assert!(problem.contains(expected), "{problem}, and not: {expected}");
    };
    assert_eq!(found(&|| Ok(())), Ok(Ok(())));
    assert_eq!(
        found(&|| refused("line 1: wrong\n  help: right")),
        Ok(refused("line 1: wrong\n  help: right"))
    );
    noticed("panicked", &|| panic!("planted"));
    noticed("took 0.1 s", &|| {
        sleep(Duration::from_millis(80));
        Ok(())
    });
    noticed("memory", &|| {
        black_box(vec![1_u8; 2 << 20]);
        Ok(())
    });
    noticed("an empty message", &|| refused(" \n"));
    noticed("a message of", &|| refused(&"long".repeat(2_000)));
    noticed("a message of", &|| refused(&"a\n".repeat(50)));
    noticed("a raw", &|| refused("unknown key `\u{1b}[31mred`"));

    let shell = |script: &str| {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        let observed =
            observe(command, Duration::from_millis(500)).and_then(|observed| observed.verdict(&[]));
        judge(Limits::default(), || {
            observed.unwrap_or_else(|problem| panic!("{problem}"))
        })
        .0
    };
    assert_eq!(shell("exit 0"), Ok(Ok(())));
    assert_eq!(
        shell("echo 'error: wrong' >&2; exit 2"),
        Ok(refused("error: wrong\n"))
    );
    for (expected, script) in [
        ("ended by", "kill -ABRT $$"),
        ("status 101", "echo 'error: wrong' >&2; exit 101"),
        ("panicked", "echo 'thread panicked at' >&2; exit 2"),
        ("does not begin with", "exit 2"),
        ("a raw", "printf 'error: \\033[31m' >&2; exit 2"),
        ("on stdout", "echo 1; echo 'error: wrong' >&2; exit 2"),
        ("not finite", "echo '{\"force\":NaN}'"),
        ("still running", "sleep 60"),
    ] {
        let problem = shell(script).expect_err(expected);
        assert!(problem.contains(expected), "{problem}, and not: {expected}");
    }
}
