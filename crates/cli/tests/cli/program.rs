//! The program under test, the working directory of the tests, and their common input.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command as Process, ExitStatus};

use assert_cmd::Command;
use bristle::model::record::Column;
use bristle::model::settings::Settings;
use bristle_study::grid::Study;
use bristle_study::input::document::Document;
use serde_json::Value;
use tempfile::TempDir;

/// Returns a call of the program in a directory, with arguments separated by spaces. Its lines fit
/// 80 columns.
///
/// The environment variable `BRISTLE_TEST_PROGRAM` may give the absolute path of another build. A
/// release build speeds up tests that take minutes.
pub fn bristle(directory: &Path, arguments: &str) -> Command {
    let other = std::env::var_os("BRISTLE_TEST_PROGRAM").map(Command::new);
    let mut command =
        other.unwrap_or_else(|| Command::cargo_bin("bristle").expect("the program is built"));
    command
        .env_remove("COLUMNS")
        .current_dir(directory)
        .args(arguments.split_whitespace());
    command
}

/// Option for shapes of a contact or a brush; empty of a program without the feature.
pub const VTK: &str = if cfg!(feature = "vtk") { "--vtk=2" } else { "" };

/// Expands to the sections `[tool]` and `[filament]` of an input file: the paper's brush with a
/// number of segments, and further lines of `[tool]`.
macro_rules! brush {
    ($segments:literal) => {
        brush!($segments, "")
    };
    ($segments:literal, $more:literal) => {
        concat!(
            "[tool]\nbody_radius_m = 0.140\nwidth_m = 0.020\nfilament_count = 10500\n",
            $more,
            "\n[filament]\nsegments = ",
            $segments,
            "\nlength_m = 0.040\ndiameter_m = 1.18e-3\n"
        )
    };
}

pub(crate) use brush;

/// Reduces this brush to too few filaments to touch each other.
pub fn sparse(text: &str) -> String {
    let few = text.replace("filament_count = 10500", "filament_count = 1000");
    few.replace(
        "filament_count_uncertainty = 600",
        "filament_count_uncertainty = 60",
    )
}

/// Returns the settings in an input file.
pub fn settings(text: &str) -> Settings {
    Document::parse(text, "case.toml")
        .and_then(|document| document.settings())
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the study in an input file.
pub fn study(text: &str) -> Study {
    Document::parse(text, "case.toml")
        .and_then(|document| document.study())
        .unwrap_or_else(|error| panic!("{error}"))
}

/// Returns the words of a text, whose lines may break between any two.
pub fn words(text: &str) -> String {
    text.split_whitespace().collect::<Vec<_>>().join(" ")
}

/// Expects a text to have these parts.
#[track_caller]
pub fn has(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "no `{part}` in\n{text}");
    }
}

/// Expects a text to have none of these parts.
#[track_caller]
pub fn lacks(text: &str, parts: &[&str]) {
    for part in parts {
        assert!(!text.contains(part), "`{part}` in\n{text}");
    }
}

/// Expects a number to be near another, within a share of it.
#[track_caller]
pub fn is_near(found: f64, expected: f64, share: f64) {
    assert!(
        (found / expected - 1.0).abs() < share,
        "{found}, not {expected}"
    );
}

/// Returns the data in the page of a study.
pub fn page_data(page: &str) -> Value {
    let (_, data) = page.split_once("id=\"data\">").expect("the data");
    let (data, _) = data.split_once("</script>").expect("their end");
    serde_json::from_str(data).expect("JSON")
}

/// Returns the number in a cell of a table.
pub fn number(row: &BTreeMap<String, String>, key: &str) -> f64 {
    row[key].parse().expect(key)
}

/// Returns the section of a document below a heading of the second level.
pub fn section<'p>(page: &'p str, heading: &str) -> &'p str {
    let (_, section) = page
        .split_once(&format!("\n## {heading}\n"))
        .expect(heading);
    section.split("\n## ").next().unwrap_or(section)
}

/// Returns the row of docs/results.md about a column of results.
pub fn documented<T>(column: &Column<T>) -> String {
    let &Column {
        key,
        symbol,
        unit,
        name,
        meaning,
        ..
    } = column;
    // A bar would end the cell.
    let meaning = meaning.replace('|', r"\|");
    format!("| `{key}` | {symbol} | {unit} | {name}: {meaning} |")
        .replace("|  |", "| |")
        .replace("|  |", "| |")
}

/// Checks that the part of a file between two texts, at their first occurrence, equals `derived`,
/// which comes from a table. Where snapshots are updated (`INSTA_UPDATE=always`), writes that part
/// instead.
pub fn is_derived(path: &str, [before, after]: [&str; 2], derived: &str) {
    let place = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../..")
        .join(path);
    let file = fs::read_to_string(&place).expect(path);
    let start = file.find(before).expect(before) + before.len();
    let end = start + file[start..].find(after).expect(after);
    let found = &file[start..end];
    if found == derived {
        return;
    }
    if std::env::var("INSTA_UPDATE").is_ok_and(|update| update == "always") {
        fs::write(&place, [&file[..start], derived, &file[end..]].concat()).expect(path);
    } else {
        panic!("{path} is stale; INSTA_UPDATE=always writes\n{derived}\nwhere it has\n{found}");
    }
}

/// Kills a process.
pub fn kill(mut child: Child) -> ExitStatus {
    child.kill().expect("the process is ours");
    child.wait().expect("the process is ours")
}

/// Sends a process the signal of Ctrl-C.
pub fn interrupt(child: &Child) {
    send("-INT", child);
}

/// Sends a signal, as "-TERM", to a process.
pub fn send(signal: &str, child: &Child) {
    let sent = Process::new("kill")
        .args([signal, &child.id().to_string()])
        .status();
    assert!(sent.expect("`kill` is there").success());
}

/// Returns `true` if interrupts are ignored here, so that a test of them must be left out.
/// Background jobs of a shell ignore them, and so do their child processes.
pub fn ignores_interrupts() -> bool {
    let ignored = Process::new("sh")
        .args(["-c", "kill -INT $$"])
        .status()
        .expect("there is a shell")
        .success();
    if ignored {
        println!("skipped: interrupts are ignored here");
    }
    ignored
}

/// A directory with input files and results, removed at the end of a test.
pub struct Workspace(TempDir);

impl Workspace {
    pub fn new() -> Self {
        Self(TempDir::new().expect("a temporary directory"))
    }

    /// Creates a directory with the input file `case.toml`.
    pub fn with(file: &str) -> Self {
        let workspace = Self::new();
        workspace.write("case.toml", file);
        workspace
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, text: impl AsRef<[u8]>) {
        fs::write(self.path(name), text).expect(name);
    }

    pub fn read(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).expect(name)
    }

    pub fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).expect(name)
    }

    pub fn json(&self, name: &str) -> Value {
        serde_json::from_str(&self.read(name)).expect(name)
    }

    /// Returns a number in a JSON file.
    pub fn number(&self, name: &str, key: &str) -> f64 {
        self.json(name)[key].as_f64().expect(key)
    }

    /// Returns a column of numbers of a table.
    pub fn column(&self, name: &str, key: &str) -> Vec<f64> {
        self.rows(name).iter().map(|row| number(row, key)).collect()
    }

    /// Returns the rows of a table, by the keys of its heading.
    pub fn rows(&self, name: &str) -> Vec<BTreeMap<String, String>> {
        let mut reader = csv::Reader::from_path(self.path(name)).expect(name);
        reader
            .deserialize()
            .map(|row| row.expect("a row"))
            .collect()
    }

    /// Creates a directory and its parents.
    pub fn make(&self, name: &str) {
        fs::create_dir_all(self.path(name)).expect(name);
    }

    /// Removes a directory.
    pub fn remove(&self, name: &str) {
        fs::remove_dir_all(self.path(name)).expect(name);
    }

    /// Returns the sorted names of the entries of a directory; none if it does not exist.
    pub fn names(&self, directory: &str) -> Vec<String> {
        let entries = fs::read_dir(self.path(directory)).into_iter().flatten();
        let mut names: Vec<String> = entries
            .map(|entry| {
                entry
                    .expect("an entry")
                    .file_name()
                    .into_string()
                    .expect("a name")
            })
            .collect();
        names.sort();
        names
    }

    /// Returns all files below a directory, with their contents.
    pub fn files(&self, directory: &str) -> BTreeMap<String, Vec<u8>> {
        let mut files = BTreeMap::new();
        for name in self.names(directory) {
            let path = format!("{directory}/{name}");
            if self.path(&path).is_dir() {
                files.extend(
                    self.files(&path)
                        .into_iter()
                        .map(|(below, bytes)| (format!("{name}/{below}"), bytes)),
                );
            } else {
                files.insert(name, self.bytes(&path));
            }
        }
        files
    }

    /// Returns the files of a study without its journal, whose cases are in order of completion.
    pub fn results(&self, directory: &str) -> BTreeMap<String, Vec<u8>> {
        let mut files = self.files(directory);
        files.remove("journal.jsonl");
        files
    }

    /// Returns a call of the program in this directory.
    pub fn bristle(&self, arguments: &str) -> Command {
        bristle(self.0.path(), arguments)
    }

    /// Returns the program as a separate process, which can be stopped.
    pub fn process(&self, arguments: &str) -> Process {
        let mut process = Process::new(env!("CARGO_BIN_EXE_bristle"));
        process
            .current_dir(self.0.path())
            .args(arguments.split_whitespace());
        process
    }

    /// Returns stdout and stderr of a successful command.
    pub fn run(&self, arguments: &str) -> [String; 2] {
        let output = self
            .bristle(arguments)
            .assert()
            .success()
            .get_output()
            .clone();
        let texts =
            [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
        // Neither is a terminal; only a terminal has bars that are redrawn.
        assert!(
            texts
                .iter()
                .all(|text| !text.contains(['\r', '\u{1b}', '\u{8}'])),
            "{arguments}: {texts:?}"
        );
        texts
    }

    /// Returns stdout of a successful command.
    pub fn printed(&self, arguments: &str) -> String {
        let [printed, _] = self.run(arguments);
        printed
    }

    /// Returns the JSON that a command prints to stdout.
    pub fn printed_json(&self, arguments: &str) -> Value {
        serde_json::from_str(&self.printed(arguments)).expect("JSON")
    }

    /// Returns stderr of a successful command.
    pub fn said(&self, arguments: &str) -> String {
        let [_, said] = self.run(arguments);
        said
    }

    /// Returns stdout followed by stderr of a successful command.
    pub fn told(&self, arguments: &str) -> String {
        self.run(arguments).concat()
    }

    /// Returns the message of a command that refuses its input, and prints nothing else.
    #[track_caller]
    pub fn refused(&self, arguments: &str) -> String {
        let message = self.failed(arguments, 2);
        assert!(
            message.contains("error: ") && !message.contains("panicked"),
            "{arguments}: {message}"
        );
        message
    }

    /// Returns the message of a command that ends with an exit status, and prints nothing else.
    #[track_caller]
    pub fn failed(&self, arguments: &str, status: i32) -> String {
        let ended = self.bristle(arguments).assert().code(status).stdout("");
        String::from_utf8(ended.get_output().stderr.clone()).expect("UTF-8")
    }

    /// Expects a command to refuse its input with a message that has these parts.
    #[track_caller]
    pub fn refuses(&self, arguments: &str, parts: &[&str]) {
        has(&self.refused(arguments), parts);
    }

    /// Expects a file to exist.
    #[track_caller]
    pub fn has_file(&self, name: &str) {
        assert!(self.path(name).is_file(), "{name}");
    }

    /// Expects no file of this name.
    #[track_caller]
    pub fn has_no(&self, name: &str) {
        assert!(!self.path(name).exists(), "{name}");
    }
}
