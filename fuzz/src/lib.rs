//! Bodies of the fuzz targets: each passes bytes to public readers and asserts their invariants.
//!
//! `crates/cli/tests/cli/corpora.rs` includes this file, so that `cargo test` replays the corpora.
//! A target returns the message if the bytes are refused.
//!
//! Journals, results and checkpoints have digests, which no mutation can match, and they depend on
//! the build. Their corpora refer to files that this build writes: see [`expanded`].

use std::io;
use std::sync::OnceLock;

use bristle::brush::{BrushRun, Checkpoint, RunOptions};
use bristle::model::settings::{BrushSettings, Settings};
use bristle::simulation::{Sampling, simulate_with};
use bristle_app::insight::measured::{compare, comparison_table, unusual_points, write_comparison};
use bristle_app::store::checkpoint::{read_checkpoint, state_bytes, state_of, write_checkpoint};
use bristle_app::store::journal::{StudyKeys, header};
use bristle_app::store::results::{
    FileHashes, case_text, read_brush_history, read_case, read_contacts, read_filaments,
    read_history, read_interaction, read_profile, read_runs, read_shapes, read_study,
    read_turn_impulses, study_text, write_brush_history, write_contacts, write_filaments,
    write_history, write_metrics, write_profile, write_runs, write_shapes,
};
use bristle_codegen::back::json::{from_json, to_json};
use bristle_codegen::back::languages::rust::emit;
use bristle_codegen::back::source::Origin;
use bristle_equations::comparison::{States, compare_graph};
use bristle_equations::evaluation::evaluate;
use bristle_equations::state::parse_state;
use bristle_study::grid::{CaseResult, Study, run_study};
use bristle_study::input::control_points::read_control_points;
use bristle_study::input::document::Document;
use bristle_study::input::input_error::InputError;
use bristle_study::input::measured::{
    Measurement, TableFormat, measured_text, read_measured, read_radii,
};
use bristle_study::input::table::DataError;
use serde_json::{Value, json};

/// A reader with its invariants; the error is the message of the reader.
pub type Target = fn(&[u8]) -> Result<(), String>;

/// All targets, by the names of their corpora.
pub const TARGETS: [(&str, Target); 7] = [
    ("graph", graph),
    ("input", input),
    ("state", state),
    ("tables", tables),
    ("results", results),
    ("journal", journal),
    ("checkpoint", checkpoint),
];

/// Maximum length of a message about bad input, in characters and in lines.
const MAX_MESSAGE_CHARS: usize = 4_000;
const MAX_MESSAGE_LINES: usize = 40;

/// Maximum number of segments of which the whole equations are evaluated: derivation takes long.
const MAX_EVALUATED: usize = 3;

/// A study of six quick cases, of which the last three fail.
pub const STUDY: &str = "\
[tool]
body_radius_m = 0.140
width_m = 0.020
filament_count = 10500
filament_count_uncertainty = 600

[filament]
segments = 3
length_m = 0.040
diameter_m = 1.18e-3

[contact]
friction_coefficient = 0.1

[process]
brushing_velocity_m_s = 10.0
penetration_depth_m = 1.0e-3

[solver]
relative_tolerance = 1e-3
samples = 20

[study]
brushing_velocity_m_s = [5.0, 10.0, 20.0]
penetration_depth_m = [1.0e-3]
\"contact.stiffness_n_m\" = [1e5, 1e300]
";

/// Checks that a message is not empty, is short, and cannot control the terminal.
pub fn assert_presentable(message: &str) {
    let is_invisible = |letter: char| {
        letter != '\n' && letter.is_control()
            || matches!(letter, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    assert!(!message.trim().is_empty(), "an empty message");
    assert!(!message.contains(is_invisible), "{message:?}");
    assert!(
        message.chars().count() <= MAX_MESSAGE_CHARS
            && message.lines().count() <= MAX_MESSAGE_LINES,
        "a long message: {message}"
    );
}

/// The message of an error.
fn refused(error: impl ToString) -> String {
    let message = error.to_string();
    assert_presentable(&message);
    message
}

/// Checks a graph: it is valid, can be evaluated, emitted as Rust and compared with the derivation,
/// and keeps its bytes when it is written and read again.
pub fn graph(bytes: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(bytes);
    let file = from_json(&text).map_err(refused)?;
    for kernel in &file.kernels {
        assert_eq!(kernel.graph.validate(), Ok(()));
        let point = vec![0.6; kernel.graph.symbols().len()];
        let values = kernel.graph.evaluate(&point);
        assert_eq!(values.len(), kernel.graph.nodes().len());
    }
    let written = to_json(&file.kernels, &file.generator).expect("constants are finite");
    let again = from_json(&written).expect("what is written can be read");
    let rewritten = to_json(&again.kernels, &again.generator).expect("it was written before");
    assert_eq!(written, rewritten);
    let origin = Origin {
        title: "A file.",
        maker: &file.generator,
        again: "cargo fuzz",
    };
    let source = emit(&file.kernels, origin).expect("what is read can be emitted");
    syn::parse_file(&source).expect("what is emitted is Rust");
    match compare_graph(&text, 3, States::All, 1) {
        Ok(comparison) => {
            let table = comparison.to_string();
            let is_control = |letter: char| letter != '\n' && letter.is_control();
            assert!(
                table.len() < 100_000 && !table.contains(is_control),
                "{table:?}"
            );
        }
        Err(error) => drop(refused(error)),
    }
    Ok(())
}

/// Checks an input file: accepted settings and studies are allowed, and are equal in an input file
/// and in a result file.
pub fn input(bytes: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(bytes);
    read_input(&text, &[]).map_err(refused)
}

/// [`input`] with options of the command line. An error states its place: a line of the file, or
/// the option.
///
/// # Errors
/// If the text states neither a case nor a study.
pub fn read_input(text: &str, options: &[String]) -> Result<(), InputError> {
    let read = || {
        let document = Document::parse_with(text, "case.toml", options)?;
        let (settings, study) = (document.settings(), document.study());
        if let Err(error) = document.settings_without_process() {
            assert!(settings.is_err(), "{error}");
        }
        if let Ok(settings) = &settings {
            settings_read_back(settings);
        }
        if let Ok(study) = &study {
            study_reads_back(study, document.measured().is_some());
        }
        settings
            .map(drop)
            .or_else(|error| study.map(drop).map_err(|_| error))
    };
    let read: Result<(), InputError> = read();
    if let Err(error) = &read {
        let place = &error.location;
        let message = refused(error);
        let is_option = place.file.starts_with("--set");
        assert!(
            is_option || place.file == "case.toml" && place.line <= text.lines().count() + 1,
            "{place:?}"
        );
        assert!(message.contains(&format!("{}:{}:", place.file, place.line)) || is_option);
    }
    read
}

/// A value as TOML, with the objects of the root as sections.
fn toml(value: &Value, is_root: bool) -> String {
    match value {
        Value::Object(entries) if is_root => entries
            .iter()
            .map(|(name, section)| {
                let lines = section.as_object().into_iter().flatten();
                let lines = lines.map(|(key, value)| format!("{key} = {}\n", toml(value, false)));
                format!("[{name}]\n{}", lines.collect::<String>())
            })
            .collect(),
        Value::Object(entries) => {
            let entries = entries
                .iter()
                .map(|(key, value)| format!("{key} = {}", toml(value, false)));
            format!("{{ {} }}", entries.collect::<Vec<_>>().join(", "))
        }
        Value::Array(items) => {
            let items: Vec<_> = items.iter().map(|item| toml(item, false)).collect();
            format!("[{}]", items.join(", "))
        }
        scalar => scalar.to_string(),
    }
}

fn settings_read_back(settings: &Settings) {
    assert_eq!(settings.check(), Ok(()));
    let mut value = json!(settings);
    if let Some(process) = value["process"].as_object_mut()
        && settings.process.tool_force_n.is_some()
    {
        // An input file states either the force or the depth.
        process.remove("penetration_depth_m");
    }
    let written = toml(&value, true);
    let again = Document::parse(&written, "again.toml").and_then(|document| document.settings());
    assert_eq!(again.as_ref(), Ok(settings), "{written}");
    let case = read_case(&case_text(settings, &FileHashes::new()), "case.json");
    assert_eq!(case.map(|case| case.settings).as_ref(), Ok(settings));
}

fn study_reads_back(study: &Study, measured: bool) {
    let written = study_text(study, b"", measured);
    let read = read_study(&written, "study.json").expect("it was written");
    assert_eq!(study_text(&read.study, b"", read.measured), written);
    for case in [0, study.case_count() / 2, study.case_count() - 1] {
        assert_eq!(study.settings(case).check(), Ok(()), "case {case}");
        assert_eq!(study.settings(case), read.study.settings(case));
    }
}

/// Checks a state of a filament: it is the same when it is written and read again, and its
/// evaluation is finite.
pub fn state(bytes: &[u8]) -> Result<(), String> {
    let state = parse_state(&String::from_utf8_lossy(bytes)).map_err(refused)?;
    let written = json!({
        "base_angle": state.base_angle, "base_rate": state.base_rate,
        "base_acceleration": state.base_acceleration, "gravity": state.gravity,
        "q": state.q, "v": state.v,
    });
    assert_eq!(parse_state(&written.to_string()).as_ref(), Ok(&state));
    if state.q.len() <= 2 * MAX_EVALUATED {
        let settings = Settings::paper(10.0, 1e-3);
        match evaluate(&settings.filament, settings.tool.body_radius_m, &state) {
            Ok(evaluation) => {
                let json = json!(evaluation).to_string();
                assert!(!json.contains("null"), "not finite: {json}");
            }
            Err(error) => drop(refused(error)),
        }
    }
    Ok(())
}

/// Checks tables of numbers: measured forces, radii and control points. Accepted forces and points
/// are the same when they are written and read again. The comparison with a study is finite and
/// bounded.
pub fn tables(bytes: &[u8]) -> Result<(), String> {
    let text = String::from_utf8_lossy(bytes);
    let format = TableFormat::default();
    let forces = read_measured(&text, "forces.csv", &format);
    if let Ok(forces) = &forces {
        let again = read_measured(&measured_text(forces, &[]), "again.csv", &format);
        assert_eq!(again.as_ref(), Ok(forces));
        assert_compared(forces);
    }
    let points = read_control_points(&text, "points.csv");
    if let Ok(points) = &points {
        let rows = points.iter().map(|[x, y]| format!("{x:?},{y:?}\n"));
        let written = format!("x_m,y_m\n{}", rows.collect::<String>());
        let again = read_control_points(&written, "again.csv");
        assert_eq!(again.as_ref(), Ok(points));
    }
    let radii = read_radii(&text, "radii.csv", &format);
    any([forces.map(drop), points.map(drop), radii.map(drop)])
}

fn assert_compared(forces: &[Measurement]) {
    let WrittenResults { study, results, .. } = written();
    let comparisons = compare(study, results, forces);
    let table = comparison_table(&comparisons, 80);
    let rows = in_memory(|out| write_comparison(out, &comparisons));
    assert!(table.len() < 20_000, "a table of {} bytes", table.len());
    assert!(unusual_points(study, forces).len() <= 3);
    assert_eq!(rows.lines().count(), 1 + comparisons.len() * forces.len());
    for report in [table, rows] {
        assert!(
            !report.contains("NaN") && !report.contains("inf"),
            "{report}"
        );
    }
}

/// Returns `Ok` if a reader accepts, else the message of the first one.
fn any<const N: usize>(read: [Result<(), DataError>; N]) -> Result<(), String> {
    let messages: Vec<_> = read
        .into_iter()
        .filter_map(Result::err)
        .map(refused)
        .collect();
    if messages.len() < N {
        Ok(())
    } else {
        Err(messages[0].clone())
    }
}

/// Checks saved results of studies, contacts and brushes. Accepted results are the same when they
/// are written and read again. A file with a digest is accepted only as it was written.
pub fn results(bytes: &[u8]) -> Result<(), String> {
    let (text, written) = (expanded(bytes), written());
    let text = String::from_utf8_lossy(&text);
    let settings = |study: &Study| study_text(study, b"", false);
    let study = read_study(&text, "study.json").map(|read| {
        assert_eq!(settings(&read.study), settings(&written.study));
        study_reads_back(&read.study, read.measured);
    });
    let case = read_case(&text, "case.json").map(|read| {
        assert_eq!(read.settings, written.study.settings(0));
    });
    // Under its own digest any table is parsed to its end; under that of the results only one table
    // is accepted.
    let runs = [text.as_bytes(), written.runs().as_bytes()].map(|hashed| {
        let study = study_text(&written.study, hashed, false);
        let study = read_study(&study, "study.json").expect("it was written");
        let read = |text: &str| read_runs(text, "runs.csv", &study);
        read(&text)
    });
    let [runs, genuine] = runs;
    if let Ok(read) = &genuine {
        assert_eq!(read, &written.kept);
    }
    if let Ok(read) = &runs {
        let again = in_memory(|out| write_runs(out, &written.study, read));
        let study = study_text(&written.study, again.as_bytes(), false);
        let study = read_study(&study, "study.json").expect("it was written");
        assert_eq!(read_runs(&again, "runs.csv", &study).as_ref(), Ok(read));
    }
    let impulses = read_turn_impulses(&text, "metrics.json");
    let interaction = read_interaction(&text, "metrics.json");
    any([
        study,
        case,
        runs.map(drop),
        impulses.map(drop),
        interaction.map(drop),
        round_trip(&text, read_history, |out, read| write_history(out, read)),
        round_trip(&text, read_profile, |out, read| write_profile(out, read)),
        round_trip(&text, read_shapes, |out, read| write_shapes(out, read)),
        round_trip(&text, read_filaments, |out, read| {
            write_filaments(out, read)
        }),
        round_trip(&text, read_contacts, |out, read| write_contacts(out, read)),
        round_trip(&text, read_brush_history, |out, read| {
            write_brush_history(out, read)
        }),
    ])
}

fn round_trip<T: PartialEq + std::fmt::Debug>(
    text: &str,
    read: impl Fn(&str, &str) -> Result<Vec<T>, DataError>,
    write: impl Fn(&mut Vec<u8>, &[T]) -> io::Result<()>,
) -> Result<(), DataError> {
    let rows = read(text, "table.csv")?;
    let again = in_memory(|out| write(out, &rows));
    assert_eq!(read(&again, "again.csv").as_ref(), Ok(&rows));
    Ok(())
}

/// Checks a journal: each accepted result was written. Without the torn end, the rest is read as
/// before.
pub fn journal(bytes: &[u8]) -> Result<(), String> {
    let (bytes, WrittenResults { study, results, .. }) = (expanded(bytes), written());
    let keys = StudyKeys::new(study);
    let (read, length) = keys.read(bytes.as_slice()).map_err(refused)?;
    assert_eq!(length.intact + length.torn, bytes.len() as u64);
    for (read, written) in read.iter().zip(results) {
        assert!(read.as_ref().is_none_or(|read| read == written));
    }
    let again = keys.read(&bytes[..length.intact as usize]);
    let (again, rest) = again.expect("the intact part is intact");
    assert_eq!((again, rest.intact, rest.torn), (read, length.intact, 0));
    Ok(())
}

/// Checks a checkpoint: an accepted state is the written one. Any bytes of a state keep their value
/// when they are written and read again.
pub fn checkpoint(bytes: &[u8]) -> Result<(), String> {
    if let Some(state) = state_of(bytes) {
        let written = state_bytes(&state);
        let again = state_of(&written).expect("it was written");
        assert_eq!(state_bytes(&again), written);
    }
    let (bytes, WrittenResults { brush, state, .. }) = (expanded(bytes), written());
    let read = read_checkpoint(brush, FRAMES, &bytes).map_err(refused)?;
    assert_eq!(&read, state);
    Ok(())
}

/// Frames of the brush in [`WrittenResults`].
const FRAMES: usize = 2;

/// Results, and the files that this build writes from them.
struct WrittenResults {
    study: Study,
    results: Vec<CaseResult>,
    /// The results without the one number that is in no table.
    kept: Vec<CaseResult>,
    brush: Settings,
    state: Checkpoint,
    files: Vec<(&'static str, Vec<u8>)>,
}

impl WrittenResults {
    fn runs(&self) -> String {
        in_memory(|out| write_runs(out, &self.study, &self.results))
    }
}

fn in_memory(write: impl FnOnce(&mut Vec<u8>) -> io::Result<()>) -> String {
    let mut text = Vec::new();
    write(&mut text).expect("memory takes what is written to it");
    String::from_utf8(text).expect("results are text")
}

fn study_of(file: &str) -> (Study, Vec<CaseResult>) {
    let study = Document::parse(file, "case.toml").and_then(|document| document.study());
    let study = study.expect("the file is right");
    let results = run_study(&study, None, || ()).expect("the threads start");
    (study, results)
}

fn journal_of(study: &Study, results: &[CaseResult]) -> Vec<u8> {
    let keys = StudyKeys::new(study);
    let lines = results.iter().enumerate();
    let lines = lines.map(|(case, result)| keys.line(case, result));
    (header().to_owned() + &lines.collect::<String>()).into_bytes()
}

/// A brush of three filaments that touch each other, before its end.
fn brush() -> (Settings, Checkpoint) {
    let mut settings = Settings::paper(10.0, 1e-3);
    (settings.filament.segments, settings.tool.filament_count) = (2, 682.0);
    settings.solver.relative_tolerance = 1e-2;
    settings.brush = Some(BrushSettings {
        columns: Some(3),
        rows: Some(1),
        steady: false,
        ..BrushSettings::default()
    });
    let options = RunOptions {
        frames: FRAMES,
        ..RunOptions::default()
    };
    let mut run = BrushRun::new(&settings, options).expect("a brush");
    while run.done() < 0.3 {
        assert!(run.advance().expect("steps"));
    }
    (settings, run.checkpoint())
}

fn written() -> &'static WrittenResults {
    static WRITTEN: OnceLock<WrittenResults> = OnceLock::new();
    WRITTEN.get_or_init(|| {
        let (study, results) = study_of(STUDY);
        let (other, other_results) = study_of(&STUDY.replace("0.040", "0.041"));
        let mut kept = results.clone();
        for summary in kept.iter_mut().flatten() {
            summary.statistics.chart_changes = 0;
        }
        let settings = study.settings(0);
        let sampling = Sampling {
            samples: 5,
            shapes: 2,
            profile: true,
            ..Sampling::default()
        };
        let contact = simulate_with(&settings, sampling).expect("a quick pass");
        let (brush, state) = brush();
        let runs = in_memory(|out| write_runs(out, &study, &results));
        let texts = [
            ("study.json", study_text(&study, runs.as_bytes(), false)),
            ("runs.csv", runs),
            ("case.json", case_text(&settings, &FileHashes::new())),
            (
                "metrics.json",
                in_memory(|out| write_metrics(out, &settings, &contact)),
            ),
            (
                "history.csv",
                in_memory(|out| write_history(out, &contact.history)),
            ),
            (
                "profile.csv",
                in_memory(|out| write_profile(out, &contact.profile)),
            ),
            (
                "shapes.csv",
                in_memory(|out| write_shapes(out, &contact.shapes)),
            ),
        ];
        let mut files = vec![
            ("journal.jsonl", journal_of(&study, &results)),
            ("other.jsonl", journal_of(&other, &other_results)),
            ("checkpoint.bin", write_checkpoint(&brush, FRAMES, &state)),
        ];
        files.extend(texts.map(|(name, text)| (name, text.into_bytes())));
        WrittenResults {
            study,
            results,
            kept,
            brush,
            state,
            files,
        }
    })
}

/// Replaces each line of the form `@FILE [LINE] [OLD => NEW]` by a file that this build writes, or
/// by one line of it, counted from 1, in which `NEW` replaces the first `OLD`.
fn expanded(bytes: &[u8]) -> Vec<u8> {
    let lines = bytes.split_inclusive(|&byte| byte == b'\n');
    lines
        .flat_map(|line| referred(line).unwrap_or_else(|| line.to_vec()))
        .collect()
}

fn referred(line: &[u8]) -> Option<Vec<u8>> {
    let reference = str::from_utf8(line.strip_prefix(b"@")?)
        .ok()?
        .trim_end_matches('\n');
    let (name, change) = reference.split_once(' ').unwrap_or((reference, ""));
    let (_, file) = written().files.iter().find(|(own, _)| *own == name)?;
    let (number, change) = match change.split_once(' ').unwrap_or((change, "")) {
        (number, rest) if number.parse::<usize>().is_ok() => (number.parse().ok(), rest),
        _ => (None, change),
    };
    let mut part = match number {
        Some(number) => {
            let mut lines = file.split_inclusive(|&byte| byte == b'\n');
            lines.nth(usize::checked_sub(number, 1)?)?.to_vec()
        }
        None => file.clone(),
    };
    if let Some((old, new)) = change.split_once(" => ") {
        let at = part
            .windows(old.len().max(1))
            .position(|bytes| bytes == old.as_bytes())?;
        part.splice(at..at + old.len(), new.bytes());
    }
    Some(part)
}
