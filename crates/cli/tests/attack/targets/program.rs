//! The program itself, called with damaged files and arguments: a sample of what the other targets
//! try in this process.

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::os::unix::process::ExitStatusExt;
use std::path::Path;
use std::process::{Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use bristle_input::document::Document;
use fastrand::Rng;
use tempfile::TempDir;

use super::graph::{CHAIN, Graph};
use super::input::Input;
use super::journal::{Journaled, written};
use super::measured::{FORCES, Measured};
use super::results::{Results, saved};
use super::state::{SEEDS, State};
use super::{STUDY, contact, one_of, simulated};
use crate::odd::{EXTREMES, odd_text};
use crate::runner::{Limits, Mutant, Refused, Target, Verdict, plain};

/// Longest run of the program. All calls are quick, but a machine can be busy.
const PATIENCE: Duration = Duration::from_secs(60);
/// Address space, in KiB, and size of a file, in blocks of 512 bytes.
const BOUNDS: &str = "ulimit -v 6000000; ulimit -f 100000";
/// The statuses that the help states: success, a comparison found a deviation, bad input, a
/// simulation failed.
const STATUSES: [i32; 4] = [0, DEVIATION, REFUSED, FAILED];
const DEVIATION: i32 = 1;
const REFUSED: i32 = 2;
const FAILED: i32 = 3;

/// A study of three cases on one curve: maps would take longer to draw than the cases to simulate.
fn small() -> String {
    STUDY.replace("[1e5, 1e300]", "[1e5]")
}

/// Three filaments that touch each other, where a study of one filament states everything else.
const BRUSH: &str = "[brush]\ncolumns = 3\nsteady = false\n";

/// The program.
pub struct Program {
    input: Input,
    /// In-process targets, whose mutants the program reads, with the place of the files and the
    /// call.
    readers: Vec<Reader>,
    /// Files that are in the directory of every call.
    files: Vec<(String, Vec<u8>)>,
    /// `runs.csv` of the study.
    runs: String,
}

/// A target whose mutants a command reads.
struct Reader {
    target: Box<dyn Target>,
    /// Directory of its files.
    directory: &'static str,
    calls: &'static [&'static str],
}

impl Program {
    pub fn new() -> Self {
        let (study, results) = simulated(&small());
        let [study_json, runs] = saved(&study, &results);
        let settings = Document::parse(&small(), "")
            .and_then(|document| document.settings())
            .expect("the file is right");
        let [case_json, metrics, history, profile, shapes] = contact::saved(&settings);
        let file = |name: &str, text: &str| (name.to_owned(), text.as_bytes().to_vec());
        let files = vec![
            file("case.toml", &small()),
            file(
                "compared.toml",
                &format!("{}[measured]\nfile = \"forces.csv\"\n", small()),
            ),
            file("brush.toml", &format!("{}{BRUSH}", small())),
            file("state.json", SEEDS[0]),
            file("graph.json", CHAIN),
            file("forces.csv", FORCES),
            file("study/study.json", &study_json),
            file("study/runs.csv", &runs),
            file("contact/case.json", &case_json),
            file("contact/metrics.json", &metrics),
            file("contact/history.csv", &history),
            file("contact/profile.csv", &profile),
            file("contact/shapes.csv", &shapes),
            file("begun/journal.jsonl", &written(&study, &results[..2])),
            file("outside/kept", "not a result\n"),
        ];
        let reader = |target: Box<dyn Target>, directory, calls| Reader {
            target,
            directory,
            calls,
        };
        let readers = vec![
            reader(
                Box::new(Input::new()),
                "",
                &[
                    "study case.toml --out out",
                    "simulate case.toml --out out",
                    "evaluate case.toml --state state.json",
                ],
            ),
            reader(
                Box::new(State::new()),
                "",
                &["evaluate case.toml --state state.json"],
            ),
            reader(
                Box::new(Graph::new()),
                "",
                &["compare graph.json --states 3"],
            ),
            reader(
                Box::new(Measured::new()),
                "",
                &["study compared.toml --out out"],
            ),
            reader(
                Box::new(Journaled::of(&small())),
                "begun",
                &["study case.toml --out begun"],
            ),
            reader(
                Box::new(Results::of(&small())),
                "study",
                &["plot study", "advise study", "advise study --json"],
            ),
            reader(
                Box::new(contact::Contact::new()),
                "contact",
                &["plot contact"],
            ),
        ];
        Self {
            input: Input::new(),
            readers,
            files,
            runs,
        }
    }

    /// A call with damaged files.
    fn damaged_files(&self, random: &mut Rng) -> Mutant {
        let reader = &self.readers[random.usize(..self.readers.len())];
        let mut mutant = reader.target.mutant(random);
        mutant.call = words(one_of(reader.calls, random));
        for (name, _) in &mut mutant.files {
            *name = Path::new(reader.directory)
                .join(&*name)
                .to_string_lossy()
                .into_owned();
        }
        mutant
    }

    /// Whether the commands take milliseconds. Whatever is refused does.
    fn is_quick(&self, mutant: &Mutant) -> bool {
        let Some((_, bytes)) = mutant.files.iter().find(|(name, _)| name == "case.toml") else {
            return true;
        };
        let text = String::from_utf8_lossy(bytes);
        let Ok(document) = Document::parse(&text, "") else {
            return true;
        };
        let quick_case = document
            .settings()
            .is_ok_and(|settings| self.input.is_quick(&settings));
        document.study().map_or(true, |study| {
            study.case_count() <= 8
                && !study.scatters()
                && !study.has_brush()
                && (0..study.case_count()).all(|case| self.input.is_quick(&study.settings(case)))
        }) && (quick_case || document.settings().is_err())
    }

    /// Calls the program in a directory of its own, and checks the files that it leaves.
    fn call(&self, mutant: &Mutant) -> Result<Verdict, String> {
        let directory = TempDir::new().map_err(|error| error.to_string())?;
        for (name, content) in self.files.iter().chain(&mutant.files) {
            write(&directory.path().join(name), content)
                .map_err(|error| format!("{name}: {error}"))?;
        }
        prepare(directory.path(), mutant.before)?;
        let before = contents(directory.path());
        let mut command = Command::new("sh");
        let script = format!("{BOUNDS}\nexec \"$0\" \"$@\" {}", mutant.redirection);
        command.args(["-c", &script, env!("CARGO_BIN_EXE_bristle")]);
        command
            .args(&mutant.call)
            .current_dir(directory.path())
            .env_remove("RUST_LOG");
        let observed = observe(command, PATIENCE)?;
        let after = contents(directory.path());
        let verdict = observed.verdict(&STATUSES)?;
        if let Some(name) = after.keys().find(|name| name.contains(".bristle-")) {
            return Err(format!("left the temporary file {name}"));
        }
        let is_refused = verdict.is_err();
        if let Some((name, _)) = before
            .iter()
            .find(|(name, content)| is_refused && after.get(*name) != Some(content))
        {
            return Err(format!("changed {name}, though it refused the call"));
        }
        let outside = |files: &BTreeMap<String, Vec<u8>>| -> Vec<(String, Vec<u8>)> {
            files
                .clone()
                .into_iter()
                .filter(|(name, _)| name.starts_with("outside/"))
                .collect()
        };
        if outside(&before) != outside(&after) {
            return Err(format!(
                "wrote outside of its directory: {:?}",
                outside(&after)
            ));
        }
        if !is_refused && !mutant.redirection.is_empty() {
            return Err("did not notice that its output was lost".to_owned());
        }
        if let Some((name, content)) = after
            .iter()
            .find(|(name, _)| name.ends_with(".html") || name.ends_with(".svg"))
        {
            plain(&String::from_utf8_lossy(content))
                .map_err(|problem| format!("{name}: {problem:.200}"))?;
        }
        let resumes = mutant
            .files
            .iter()
            .any(|(name, _)| name == "begun/journal.jsonl");
        if resumes
            && !is_refused
            && after.get("begun/runs.csv").map(Vec::as_slice) != Some(self.runs.as_bytes())
        {
            return Err("the results of a resumed study are not those of a fresh one".to_owned());
        }
        Ok(verdict)
    }
}

/// Runs a script before a call.
fn prepare(directory: &Path, script: &str) -> Result<(), String> {
    let status = Command::new("sh")
        .args(["-ec", script])
        .current_dir(directory)
        .status();
    status
        .is_ok_and(|status| status.success())
        .then_some(())
        .ok_or_else(|| format!("cannot run `{script}`"))
}

fn words(text: &str) -> Vec<String> {
    text.split_whitespace().map(str::to_owned).collect()
}

/// A call with damaged arguments.
fn damaged_arguments(random: &mut Rng) -> Mutant {
    const CALLS: [&str; 13] = [
        "brush brush.toml --out out --frames 5 --vtk",
        "study case.toml --out out --threads 2",
        "study case.toml --out begun --restart --json",
        "simulate case.toml --out out --samples 30 --vtk=5",
        "evaluate case.toml --state state.json",
        "compare graph.json --states 3 --seed 5 --bent",
        "derive --segments 1 --format json",
        "derive --kernels --format rust --out out.rs",
        "plot study --out drawn",
        "advise study --max-velocity 20 --min-ratio 0.1 --max-ratio 0.9",
        "advise study --json",
        "schema",
        "help study",
    ];
    const OPTIONS: [&str; 12] = [
        "--help",
        "--version",
        "--out",
        "--threads",
        "--samples",
        "--vtk",
        "--states",
        "--json",
        "--",
        "-",
        "-x",
        "--no-such",
    ];
    let mut call = words(one_of(&CALLS, random));
    let at = random.usize(..call.len());
    let change = match random.u8(..7) {
        // Without any argument, the program shows its help.
        0 if call.len() > 1 => {
            call.remove(at);
            "drop argument"
        }
        0 | 1 => {
            call.insert(at, call[at].clone());
            "duplicate argument"
        }
        2 => {
            let other = random.usize(..call.len());
            call.swap(at, other);
            "exchange arguments"
        }
        3 => {
            call[at] = one_of(&EXTREMES, random).to_owned();
            "extreme argument"
        }
        4 => {
            // An argument cannot hold NUL.
            call[at] = odd_text(random).replace(['\0', '/'], "");
            "odd argument"
        }
        5 => {
            call.insert(at, one_of(&OPTIONS, random).to_owned());
            "other option"
        }
        _ => {
            call[at] = one_of(
                &[
                    "",
                    ".",
                    "case.toml",
                    "study",
                    "graph.json",
                    "no/such/file",
                    "/dev/null",
                ],
                random,
            )
            .to_owned();
            "other file"
        }
    };
    Mutant {
        change,
        call,
        ..Mutant::default()
    }
}

/// A call in adverse circumstances.
fn adverse(random: &mut Rng) -> Mutant {
    /// What happens, what the shell does, and the call.
    const CIRCUMSTANCES: [(&str, &str, &str); 23] = [
        (
            "FIFO",
            "mkdir out; mkfifo out/checkpoint.bin",
            "brush brush.toml --out out",
        ),
        (
            "directory",
            "mkdir -p out/checkpoint.bin",
            "brush brush.toml --out out",
        ),
        (
            "link",
            "mkdir out; ln -s ../outside/kept out/filaments.csv",
            "brush brush.toml --out out",
        ),
        (
            "killed before",
            "mkdir out; echo > out/.checkpoint.bin.bristle-0a1B2c",
            "brush brush.toml --out out",
        ),
        (
            "FIFO",
            "rm case.toml; mkfifo case.toml",
            "study case.toml --out out",
        ),
        (
            "FIFO",
            "rm case.toml; mkfifo case.toml",
            "simulate case.toml --out out",
        ),
        (
            "FIFO",
            "rm state.json; mkfifo state.json",
            "evaluate case.toml --state state.json",
        ),
        (
            "FIFO",
            "rm graph.json; mkfifo graph.json",
            "compare graph.json",
        ),
        (
            "FIFO",
            "rm forces.csv; mkfifo forces.csv",
            "study compared.toml --out out",
        ),
        (
            "FIFO",
            "rm study/runs.csv; mkfifo study/runs.csv",
            "advise study",
        ),
        (
            "FIFO",
            "mkdir out; mkfifo out/journal.jsonl",
            "study case.toml --out out",
        ),
        (
            "directory",
            "rm case.toml; mkdir case.toml",
            "study case.toml --out out",
        ),
        (
            "directory",
            "mkdir -p out/journal.jsonl",
            "study case.toml --out out",
        ),
        (
            "link",
            "mkdir out; ln -s ../outside/kept out/runs.csv",
            "study case.toml --out out",
        ),
        (
            "link",
            "mkdir out; ln -s ../outside/kept out/report.html",
            "study case.toml --out out",
        ),
        (
            "link",
            "mkdir out; ln -s ../outside/kept out/metrics.json",
            "simulate case.toml --out out",
        ),
        (
            "link",
            "mkdir out; ln -s ../outside/new out/journal.jsonl",
            "study case.toml --out out",
        ),
        (
            "link",
            "mkdir out; ln -s ../outside/new out/history.csv",
            "simulate case.toml --out out",
        ),
        (
            "link",
            "ln -s outside/kept out.rs",
            "derive --kernels --format rust --out out.rs",
        ),
        (
            "killed before",
            "mkdir out; echo > out/.metrics.json.bristle-0a1B2c",
            "simulate case.toml --out out",
        ),
        (
            "killed before",
            "mkdir out; echo > out/.history.csv.bristle-0a1B2c",
            "simulate case.toml --out out",
        ),
        (
            "killed before",
            "mkdir out; echo > out/.runs.csv.bristle-0a1B2c",
            "study case.toml --out out",
        ),
        (
            "killed before",
            "mkdir -p out/figures; echo > out/figures/.history.svg.bristle-0a1B2c",
            "simulate case.toml --out out",
        ),
    ];
    /// Calls that print to stdout.
    const PRINTING: [&str; 8] = [
        "study case.toml --out out --json",
        "evaluate case.toml --state state.json",
        "compare graph.json --states 3",
        "derive --segments 1",
        "derive --kernels --format json",
        "advise study",
        "advise study --json",
        "schema",
    ];
    match random.u8(..6) {
        0 => Mutant {
            change: "full device",
            call: words(one_of(&PRINTING, random)),
            redirection: "> /dev/full",
            ..Mutant::default()
        },
        1 => {
            let name = format!("{}.toml", odd_text(random).replace(['\0', '/'], ""))
                .chars()
                .rev()
                .take(80)
                .collect::<String>();
            let name: String = name.chars().rev().collect();
            let call = vec![
                "study".to_owned(),
                format!("./{name}"),
                "--out".to_owned(),
                "out".to_owned(),
            ];
            Mutant {
                change: "odd name",
                files: vec![(name, small().into_bytes())],
                call,
                ..Mutant::default()
            }
        }
        _ => {
            let (change, before, call) = CIRCUMSTANCES[random.usize(..CIRCUMSTANCES.len())];
            Mutant {
                change,
                call: words(call),
                before,
                ..Mutant::default()
            }
        }
    }
}

impl Target for Program {
    fn name(&self) -> &'static str {
        "program"
    }

    fn count(&self) -> usize {
        300
    }

    fn limits(&self) -> Limits {
        Limits {
            time: 2 * PATIENCE,
            ..Limits::default()
        }
    }

    fn originals(&self) -> Vec<Mutant> {
        let calls = self.readers.iter().flat_map(|reader| reader.calls);
        calls
            .map(|call| Mutant {
                call: words(call),
                ..Mutant::default()
            })
            .collect()
    }

    fn mutant(&self, random: &mut Rng) -> Mutant {
        match random.u8(..5) {
            0 => return damaged_arguments(random),
            1 => return adverse(random),
            _ => {}
        }
        loop {
            let mutant = self.damaged_files(random);
            if self.is_quick(&mutant) {
                return mutant;
            }
        }
    }

    fn check(&self, mutant: &Mutant, _: &mut Rng) -> Verdict {
        self.call(mutant)
            .unwrap_or_else(|problem| panic!("{problem}"))
    }
}

/// What a program has done.
#[derive(Debug)]
pub struct Observed {
    status: ExitStatus,
    stdout: Vec<u8>,
    stderr: Vec<u8>,
}

/// Runs a program to its end, or for some time.
pub fn observe(mut command: Command, patience: Duration) -> Result<Observed, String> {
    const PAUSE: Duration = Duration::from_millis(5);
    let capture = || tempfile::tempfile().map_err(|error| error.to_string());
    let (stdout, stderr) = (capture()?, capture()?);
    let stdio = |file: &fs::File| {
        file.try_clone()
            .map(Stdio::from)
            .map_err(|error| error.to_string())
    };
    command
        .stdin(Stdio::null())
        .stdout(stdio(&stdout)?)
        .stderr(stdio(&stderr)?);
    let mut child = command
        .spawn()
        .map_err(|error| format!("does not start: {error}"))?;
    let begin = Instant::now();
    let status = loop {
        match child.try_wait().map_err(|error| error.to_string())? {
            Some(status) => break status,
            None if begin.elapsed() > patience => {
                // It may have ended by itself just now.
                let _ = child.kill();
                let _ = child.wait();
                return Err(format!(
                    "still running after {:.1} s",
                    patience.as_secs_f64()
                ));
            }
            None => thread::sleep(PAUSE),
        }
    };
    Ok(Observed {
        status,
        stdout: whole(stdout)?,
        stderr: whole(stderr)?,
    })
}

/// The content of a file that was written through another handle.
fn whole(mut file: fs::File) -> Result<Vec<u8>, String> {
    use io::{Read, Seek};
    let mut content = Vec::new();
    file.rewind()
        .and_then(|()| file.read_to_end(&mut content))
        .map_err(|error| error.to_string())?;
    Ok(content)
}

impl Observed {
    /// What the program says of its input. `statuses` are those allowed, in addition to success and
    /// refusal.
    pub fn verdict(&self, statuses: &[i32]) -> Result<Verdict, String> {
        let Self {
            status,
            stdout,
            stderr,
        } = self;
        let text = |bytes: &[u8]| {
            String::from_utf8(bytes.to_vec()).map_err(|_| "output is not UTF-8".to_owned())
        };
        let (stdout, stderr) = (text(stdout)?, text(stderr)?);
        let Some(code) = status.code() else {
            return Err(format!(
                "ended by signal {:?}: {stderr:.500}",
                status.signal()
            ));
        };
        if stderr.contains("panicked") {
            return Err(format!("panicked: {stderr:.1000}"));
        }
        if ![0, REFUSED].contains(&code) && !statuses.contains(&code) {
            return Err(format!("status {code}: {stderr:.500}"));
        }
        if code != REFUSED {
            plain(&stderr)?;
            plain(&stdout)?;
            return match ["NaN", "_n\":null", ":inf"]
                .iter()
                .find(|text| stdout.contains(**text))
            {
                Some(text) => Err(format!(
                    "`{text}` on stdout, which is not finite: {stdout:.500}"
                )),
                None => Ok(Ok(())),
            };
        }
        if !stderr.starts_with("error: ") && !stderr.contains("\nerror: ") {
            return Err(format!(
                "the message does not begin with `error:`: {stderr:.500?}"
            ));
        }
        if !stdout.is_empty() {
            return Err(format!("refused, but has printed on stdout: {stdout:.500}"));
        }
        Ok(Err(Refused(stderr)))
    }
}

fn write(path: &Path, content: &[u8]) -> io::Result<()> {
    if let Some(parent) = path.parent() {
        fs::create_dir_all(parent)?;
    }
    fs::write(path, content)
}

/// The files below a directory, by path.
fn contents(directory: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut found = BTreeMap::new();
    let mut open = vec![directory.to_owned()];
    while let Some(path) = open.pop() {
        let Ok(entries) = fs::read_dir(&path) else {
            continue;
        };
        for entry in entries.flatten() {
            let path = entry.path();
            // Neither links nor FIFOs are followed.
            let Ok(kind) = entry.file_type() else {
                continue;
            };
            if kind.is_dir() {
                open.push(path);
            } else if let Some(content) = kind.is_file().then(|| fs::read(&path).ok()).flatten() {
                let name = path.strip_prefix(directory).unwrap_or(&path);
                found.insert(name.to_string_lossy().into_owned(), content);
            }
        }
    }
    found
}
