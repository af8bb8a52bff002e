//! Random input files, options and calls: each is accepted, or refused with a message that locates
//! the mistake.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::time::Duration;

use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::record::Record;
use bristle::simulation::{Sampling, simulate_with};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use proptest::test_runner::{RngSeed, TestRunner};

use crate::corpora::targets::{STUDY, assert_presentable, read_input};
use crate::program::{Workspace, settings, sparse};

/// Values of other types, numbers that TOML lacks, and texts that control terminals.
const ODD: &str = "true|[]|{}|[1.0, nan]|{ start = 1, stop = 2, step = 0.5 }|[[1.0]]|\"25\"|\"\"|\
    1979-05-27|-inf|1e999|-0.0|5e-324|1e308|0x7fffffff|1_000|1.|.5|18446744073709551616|0,03|\
    30 mm|\"30 mm\"|\"\\u001b[31m\\u202e\"|\u{1b}[31m\u{202e}\0";

/// Words in place of an argument.
const WORDS: &str = "|.|-|--|-x|--help|--json|--no-such|-1|1e16|nan|case.toml|no/such/file|\
    /dev/null|\u{1b}[31m\u{202e}|\u{9b}2J\nerror: forged";

/// Simulation of a contact, with all its files.
const SIMULATE: &str = if cfg!(feature = "vtk") {
    "simulate case.toml --out out --vtk=5"
} else {
    "simulate case.toml --out out"
};

/// Calls with their exit statuses: success, a refusal, and others that the help states.
const CALLS: [(&str, &[i32]); 9] = [
    ("study case.toml --out out --no-figures", &[0, 2, 3]),
    ("study case.toml --out out --json", &[0, 2, 3]),
    (SIMULATE, &[0, 2, 3]),
    ("evaluate case.toml --state state.json", &[0, 2]),
    ("derive case.toml --format json --out graph.json", &[0, 2]),
    ("compare graph.json --states 3 --seed 5", &[0, 1, 2]),
    ("report study --out drawn --figures svg", &[0, 2]),
    ("advise study --max-velocity 20 --json", &[0, 2]),
    ("explain filament.length_m", &[0, 2]),
];

/// Tests a property on values of a strategy, equal in each run. PROPTEST_CASES and
/// PROPTEST_RNG_SEED request others.
fn for_all<S: Strategy>(cases: u32, strategy: S, test: impl Fn(S::Value)) {
    let mut config = ProptestConfig {
        failure_persistence: None,
        ..ProptestConfig::default()
    };
    if std::env::var_os("PROPTEST_CASES").is_none() {
        config.cases = cases;
    }
    if config.rng_seed == RngSeed::Random {
        config.rng_seed = RngSeed::Fixed(1);
    }
    TestRunner::new(config)
        .run(&strategy, |value| {
            test(value);
            Ok(())
        })
        .unwrap_or_else(|error| panic!("{error}"));
}

/// A change of the lines of an input file.
#[derive(Clone, Debug)]
enum Edit {
    /// States a setting, in place of equivalent ones.
    Set(&'static Parameter, String),
    Repeat(Index),
    Drop(Index),
    Misspell(Index),
    Replace(Index, &'static str),
}

fn one_of(texts: &'static str) -> impl Strategy<Value = &'static str> {
    select(texts.split('|').collect::<Vec<_>>())
}

fn parameter() -> impl Strategy<Value = &'static Parameter> {
    (0..PARAMETERS.len()).prop_map(|index| &PARAMETERS[index])
}

/// Returns a setting with a value near its default.
fn near() -> impl Strategy<Value = (&'static Parameter, f64)> {
    (parameter(), 0.25_f64..4.0).prop_map(|(own, factor)| {
        let value = factor * own.get(&settings(STUDY));
        let step = if own.range.whole { value.fract() } else { 0.0 };
        (own, value - step)
    })
}

/// Returns a setting with any value.
fn far() -> impl Strategy<Value = (&'static Parameter, f64)> {
    (parameter(), prop_oneof![proptest::num::f64::ANY, -1e4..1e4])
}

/// Returns a setting with the text of its value.
fn stated() -> impl Strategy<Value = (&'static Parameter, String)> {
    prop_oneof![
        3 => near().prop_map(in_toml),
        1 => far().prop_map(in_toml),
        1 => (parameter(), one_of(ODD)).prop_map(|(own, text)| (own, text.to_owned())),
    ]
}

fn in_toml((own, value): (&'static Parameter, f64)) -> (&'static Parameter, String) {
    (own, own.format(value).replace("NaN", "nan"))
}

fn edit() -> impl Strategy<Value = Edit> {
    prop_oneof![
        4 => stated().prop_map(|(own, text)| Edit::Set(own, text)),
        1 => any::<Index>().prop_map(Edit::Repeat),
        1 => any::<Index>().prop_map(Edit::Drop),
        1 => any::<Index>().prop_map(Edit::Misspell),
        1 => (any::<Index>(), one_of(ODD)).prop_map(|(at, text)| Edit::Replace(at, text)),
    ]
}

/// States a setting in place of equivalent ones. Returns the number of its line.
fn set(lines: &mut Vec<String>, parameter: &Parameter, value: &str) -> usize {
    let heading = format!("[{}]", parameter.section());
    if !lines.contains(&heading) {
        lines.push(heading.clone());
    }
    let mut is_within = false;
    lines.retain(|line| {
        is_within = line == &heading || is_within && !line.starts_with('[');
        let key = line.split(" = ").next().unwrap_or_default();
        !is_within || parameter.group().all(|other| other.key() != key)
    });
    let at = lines.iter().position(|line| *line == heading);
    let at = at.expect("the heading is there") + 1;
    lines.insert(at, format!("{} = {value}", parameter.key()));
    at + 1
}

fn edited(edits: &[Edit]) -> String {
    let mut lines: Vec<String> = STUDY.lines().map(str::to_owned).collect();
    for edit in edits {
        let count = lines.len();
        let at = |index: &Index| index.index(count);
        match edit {
            Edit::Set(parameter, value) => drop(set(&mut lines, parameter, value)),
            Edit::Repeat(index) => lines.insert(at(index), lines[at(index)].clone()),
            Edit::Drop(index) => drop(lines.remove(at(index))),
            Edit::Misspell(index) => {
                let line = &mut lines[at(index)];
                *line = line.replacen('_', "", 1);
            }
            Edit::Replace(index, text) => lines[at(index)] = (*text).to_owned(),
        }
    }
    lines.join("\n") + "\n"
}

#[test]
fn files_and_options_are_accepted_or_refused_at_their_place() {
    let counts = [const { Cell::new(0) }; 2];
    let option = stated().prop_map(|(own, text)| format!("{}={text}", own.path));
    let files = (vec(edit(), 0..5), vec(option, 0..3));
    for_all(2000, files, |(edits, options)| {
        let read = read_input(&edited(&edits), &options);
        let count = &counts[usize::from(read.is_err())];
        count.set(count.get() + 1);
        if let Err(error) = read
            && let Some(key) = &error.key
        {
            let name = key.rsplit('.').next().expect("a key");
            assert!(error.to_string().contains(name), "{key}: {error}");
        }
    });
    assert!(counts.iter().all(|count| count.get() > 200), "{counts:?}");
}

#[test]
fn a_value_outside_its_range_is_refused_with_its_key_and_line() {
    let outside = far().prop_filter("in its range", |(own, value)| !own.range.contains(*value));
    for_all(1000, outside.prop_map(in_toml), |(parameter, value)| {
        let (case, _) = STUDY.split_once("\n[study]").expect("a study");
        let mut lines: Vec<String> = case.lines().map(str::to_owned).collect();
        let line = set(&mut lines, parameter, &value);
        let error = read_input(&lines.join("\n"), &[]).expect_err(parameter.path);
        assert_eq!(
            (error.key.as_deref(), error.location.line),
            (Some(parameter.path), line),
            "{error}"
        );
    });
}

#[test]
fn allowed_settings_have_finite_results() {
    let ended = Cell::new(0);
    for_all(64, vec(near(), 1..4), |changes| {
        let mut changed = settings(STUDY);
        for (parameter, value) in changes {
            parameter.set(&mut changed, value);
        }
        let sampling = Sampling {
            samples: 5,
            profile: true,
            ..Sampling::default()
        };
        if changed.check().is_err() {
            return;
        }
        match simulate_with(&changed, sampling) {
            Ok(simulation) => {
                assert!(simulation.metrics.is_finite(), "{:?}", simulation.metrics);
                assert!(simulation.history.iter().all(Record::is_finite));
                ended.set(ended.get() + 1);
            }
            Err(error) => assert_presentable(&error.to_string()),
        }
    });
    assert!(ended.get() > 20);
}

/// Runs a call and checks status, message and files.
fn assert_ends(files: &BTreeMap<String, Vec<u8>>, file: &str, call: &[&str], statuses: &[i32]) {
    let workspace = Workspace::new();
    workspace.make("study");
    for (name, content) in files {
        workspace.write(name, content);
    }
    workspace.write("case.toml", file);
    let before = workspace.files(".");
    let mut command = workspace.bristle("");
    let output = command.args(call).timeout(Duration::from_secs(60)).output();
    let output = output.expect("the program starts");
    let after = workspace.files(".");
    let [stdout, stderr] =
        [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).expect("UTF-8"));
    let told = format!("{call:?}: {:?}\n{stdout}\n{stderr}", output.status);
    let status = output.status.code().unwrap_or_else(|| panic!("{told}"));
    let is_odd = ["panicked", "\nerror: forged"].map(|odd| stderr.contains(odd));
    assert!(statuses.contains(&status) && is_odd == [false; 2], "{told}");
    let is_half = |name: &String| name.contains(".bristle-");
    assert!(!after.keys().any(is_half), "{told}");
    if status == 2 {
        assert_presentable(&stderr);
        assert!(format!("\n{stderr}").contains("\nerror: "), "{told}");
        let is_kept = |(name, content): (&String, &Vec<u8>)| after.get(name) == Some(content);
        assert!(stdout.is_empty() && before.iter().all(is_kept), "{told}");
    } else {
        let is_odd = ["NaN", "_n\":null", ":inf"].map(|odd| stdout.contains(odd));
        assert!(is_odd == [false; 3], "{told}");
        let texts = after.iter().filter(|(name, _)| name.ends_with(".html"));
        let texts = texts.map(|(_, text)| String::from_utf8_lossy(text).into_owned());
        let is_invisible =
            |letter: char| letter != '\n' && bristle_study::text::is_invisible(letter);
        for text in texts.chain([stdout, stderr]) {
            assert!(!text.contains(is_invisible), "{call:?}: {text:.300}");
        }
    }
}

#[test]
fn calls_end_with_a_status_and_whole_files() {
    // Advice on filaments that touch would be verified with a brush.
    let workspace = Workspace::with(&sparse(&STUDY.replace("1e5, 1e300", "1e5")));
    workspace.run("study case.toml --out study --no-figures");
    workspace.run("derive --segments 1 --format json --out graph.json");
    let state = include_bytes!("../../../../fuzz/corpus/state/accepted-one.json");
    workspace.write("state.json", state);
    let files = workspace.files(".");
    // A brush, or sampled tools, would take seconds.
    let is_quick = |edit: &Edit| match edit {
        Edit::Set(own, _) => !["brush", "uncertainty", "tool"].contains(&own.section()),
        _ => true,
    };
    let edits = vec(edit().prop_filter("slow", is_quick), 0..3);
    let damage = (any::<Index>(), 0..3, one_of(WORDS));
    let calls = (edits, select(&CALLS[..]), proptest::option::of(damage));
    for_all(150, calls, |(edits, (call, statuses), damage)| {
        let mut words: Vec<&str> = call.split(' ').collect();
        if let Some((at, how, word)) = damage {
            let at = at.index(words.len());
            match how {
                0 if words.len() > 1 => drop(words.remove(at)),
                1 => words.insert(at, words[at]),
                _ => words[at] = word,
            }
        }
        assert_ends(&files, &edited(&edits), &words, statuses);
    });
}
