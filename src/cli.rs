//! The command line: reads files, calls the library, writes results. Text for people goes to stderr, data to files or stdout.

use std::io::{self, Write};
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode};
use std::time::Instant;

use clap::{Args, Parser, Subcommand, ValueEnum};
use indicatif::{ProgressBar, ProgressStyle};
use thiserror::Error;

use bristle::advice::{AdviceError, Limits, advise};
use bristle::comparison::{ComparisonError, compare_graph};
use bristle::derive::{DeriveError, DeriveFormat, Equations, derive};
use bristle::document::Document;
use bristle::evaluation::{EvaluationError, evaluate};
use bristle::input_error::InputError;
use bristle::measured::comparison_table;
use bristle::page::{page, record};
use bristle::parameters::Parameter;
use bristle::report::{write_history, write_metrics, write_runs};
#[cfg(feature = "parquet")]
use bristle::report::{write_history_parquet, write_runs_parquet};
use bristle::results::{case_text, study_text};
use bristle::schema::input_schema;
use bristle::simulation::{Sampling, SimulationError, simulate_with};
use bristle::state::{StateError, parse_state};
use bristle::study::{CaseResult, Study, VELOCITY, complete_study};
use bristle::tables::study_tables;
use bristle::vtk::MAX_SHAPES;

use bristle_codegen::compare::States;

use crate::files::{FileError, StagedFile, prepare_directory, read_graph, read_text, remove, remove_leftovers};
use crate::journal_file::{Earlier, JOURNAL, JournalFile, JournalFileError};
use crate::pictures::{
    COMPARISON, Drawn, FIGURES, MEASURED, PicturesError, draw_history, draw_saved, draw_study, measured_forces,
    remove_unfinished,
};
use crate::progress::Progress;
use crate::saved::{CASE, HISTORY, HISTORY_PARQUET, RUNS, RUNS_PARQUET, STUDY, SavedError, saved_study};
use crate::terminal::{say, say_at_the_end, start_log};
use crate::validation::{self, Extent, Outcome};
use crate::vtk_files::{commit_vtk, prepare_vtk, stage_vtk};

/// Exit status where what is compared disagrees.
const DISAGREEMENT: u8 = 1;
/// Exit status where the input or the call is wrong.
const BAD_INPUT: u8 = 2;
/// Exit status where a simulation failed.
const SIMULATION_FAILED: u8 = 3;
/// Exit status where Ctrl-C has stopped a study, as shells have it: 128 and the signal's number.
const INTERRUPTED: i32 = 130;
/// Names of the result files.
const REPORT: &str = "report.html";
const METRICS: &str = "metrics.json";
const COMPARISONS: &str = "validation.csv";
const PAGE: &str = "validation.md";
/// Most threads that a study may ask for.
const MAX_THREADS: u64 = 1024;
/// Most states that a comparison may ask for.
const MAX_STATES: u64 = 100_000;
/// Most failed cases that a study prints; the others stand in its file.
const MAX_FAILURES_SHOWN: usize = 5;

const EXAMPLES: &str = "\
Examples:
  bristle study examples/zirconia.toml --out results    all contacts of a study
  bristle simulate examples/zirconia.toml --out one     one contact and its course over time
  bristle plot results                                  the figures of a study once more
  bristle advise results --max-velocity 20              where its tool force is high
  bristle derive --segments 2                           the equations of motion, to read
  bristle validate                                      the simulator beside exact solutions

Units are SI throughout, angles in radians. The unit is part of each name, as in length_m or
contact_normal_impulse_n_s.

RUST_LOG=debug writes a log to stderr; RUST_LOG=bristle::study=debug that of one module.

Exit status:
  0    all is well
  1    a comparison has found a deviation
  2    the input or the call is wrong, or a file cannot be read or written; no file of results has
       been changed, and a study keeps in its journal what it has simulated
  3    a simulation failed; a study has written the results of the others
  130  Ctrl-C has stopped a study, which the same command continues";

/// Contact forces of brushing tools, from the equations of motion of one filament.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Study(StudyArgs),
    Simulate(SimulateArgs),
    Evaluate(EvaluateArgs),
    Derive(DeriveArgs),
    Compare(CompareArgs),
    Validate(ValidateArgs),
    Plot(PlotArgs),
    Advise(AdviseArgs),
    /// Print the JSON schema of an input file
    ///
    /// The schema states each setting's meaning, unit, default and limits. An editor that knows it completes and checks input
    /// files as they are written.
    Schema,
}

/// Simulate every case that [study] of a file asks for, and write DIR/runs.csv, DIR/report.html and DIR/figures
///
/// Each entry of [study] sweeps one setting over a list or an evenly spaced range:
///
///   [study]
///   brushing_velocity_m_s = { start = 2.5, stop = 30.0, step = 2.5 }
///   penetration_depth_m = [0.5e-3, 1.0e-3]
///   "filament.segments" = [10, 25, 50]
///
/// The cases are all combinations. runs.csv has a row for each: settings, contact metrics,
/// solver statistics, and status (ok or the error). A program built with the feature parquet
/// writes the same table as runs.parquet too. A case that fails does not stop the others,
/// and makes the exit status 3. report.html is a page to look
/// through in a browser: maps, one contact at a time in motion, settings.
///
/// DIR/figures has maps and curves of the metrics as SVG and PNG;
/// `bristle plot DIR` draws them again. Measured forces are drawn beside simulated ones, and
/// deviations written to DIR/measured_comparison.csv, if the file names them:
///
///   [measured]
///   file = "forces.csv"
///
/// with the columns brushing_velocity_m_s, penetration_depth_m, force_n and std_n.
///
/// Where filaments are not known exactly, standard deviations in the file make the study repeat each
/// case with sampled tools, and state the band that 95 % of their forces lie in, and what it comes from:
///
///   [uncertainty]
///   diameter_std_m = 0.03e-3
///   youngs_modulus_std_pa = 0.3e9
///
/// A study can be stopped at any moment, by Ctrl-C or a crash: the same command goes on where it
/// was. Each case that is done is a line of DIR/journal.jsonl; what is lost are the cases that
/// were being simulated, and after a loss of power those of the last tenth of a second. The
/// results are the same to the bit. A journal of other settings, or made by another Bristle, is
/// refused; --restart gives it up. Only one study at a time can write to a directory.
///
/// With --json each line on stdout is an object. While cases are simulated, at most ten a second:
///   {"event":"progress","done":40,"total":120,"failures":0,"rate":680.2,"seconds_left":0.12}
/// done counts the cases with a result, failures those of them that failed, rate cases a second;
/// rate and seconds_left are null as long as they are unknown. At the end:
///   {"event":"summary","cases":120,"failures":0,"resumed":30,"seconds":0.13,
///    "files":["results/runs.csv","results/study.json","results/report.html"]}
/// resumed counts the cases that were in the journal already, and files are those now written.
#[derive(Args)]
#[command(verbatim_doc_comment)]
struct StudyArgs {
    /// Input file, see `bristle schema`
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Directory for the results, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of threads [default: one a core]; does not change the results
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..=MAX_THREADS))]
    threads: Option<u64>,
    /// Simulate all cases anew, and give up what DIR/journal.jsonl holds
    #[arg(long)]
    restart: bool,
    /// Print progress and summary to stdout, as JSON objects, in place of tables
    #[arg(long)]
    json: bool,
}

impl StudyArgs {
    /// The number of threads that was asked for.
    fn threads(&self) -> Option<NonZeroUsize> {
        self.threads.and_then(|threads| NonZeroUsize::new(threads as usize))
    }
}

/// Simulate one contact, and write DIR/metrics.json, DIR/history.csv and a figure
///
/// metrics.json is a flat object with the contact metrics and the solver's statistics. history.csv has forces, deflection, tip
/// position and energies at equally spaced times; their number changes no metric. A program built with the feature parquet writes
/// the same table as history.parquet too. DIR/figures/history.svg and .png show force and tip deflection over time. [study] is
/// ignored.
///
/// With --vtk the filament's nodes are written for ParaView: open DIR/vtk/contact.pvd. It lists a file for each of 200 equally
/// spaced times in s, or N with --vtk=N, the first and the last instant included, and the workpiece. Positions are in m; at each
/// node stand arc length, velocity, contact force, gap to the workpiece and angle of the joint.
#[derive(Args)]
struct SimulateArgs {
    /// Input file, see `bristle schema`
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Directory for the results, made where there is none
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of rows of history.csv, in place of [solver] samples
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "solver.samples"))]
    samples: Option<usize>,
    /// Write N shapes of the filament to DIR/vtk, for ParaView [default: none; 200 if N is left out]
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "200",
        value_parser = clap::value_parser!(u64).range(2..=MAX_SHAPES as u64),
    )]
    vtk: Option<u64>,
}

/// Print mass matrix, accelerations and energies at one state, as JSON
///
/// The state is a JSON file of base angle (rad), rate (rad/s) and acceleration (rad/s²),
/// gravity (m/s²), and for each segment the polar angle φ and the azimuth θ (rad) in q, their
/// rates (rad/s) in v:
///
///   {"base_angle": -1.5, "base_rate": 50, "base_acceleration": 0, "gravity": [0, 0, 0],
///    "q": [1.57, -1.5], "v": [0, 50]}
///
/// The number of segments follows from q. Contact is left out, so FILE.toml need not state
/// velocity and depth.
#[derive(Args)]
#[command(verbatim_doc_comment)]
struct EvaluateArgs {
    /// Input file, for tool and filament
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// The state
    #[arg(long, value_name = "STATE.json")]
    state: PathBuf,
}

/// Show the equations of motion of a filament
///
/// Either the whole equations of N segments, or the kernels of one segment and one joint that the solver loops over.
#[derive(Args)]
struct DeriveArgs {
    #[command(flatten)]
    equations: EquationsArgs,
    /// Form of the equations; math, latex and markdown are for reading, and take minutes beyond 100 segments
    #[arg(long, value_enum, default_value_t = Format::Math)]
    format: Format,
    /// File to write instead of stdout
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,
}

/// Compare a graph of another engine with the built-in derivation, output by output, at random states
///
/// GRAPH.json holds the whole equations of some number of segments, or the kernels of the solver; derivations/ has
/// such graphs and what makes them, docs/graph-format.md the format. The table shows the largest deviation of each
/// output relative to its size. The exit status is 1 if one deviates by more than 1e-12.
#[derive(Args)]
struct CompareArgs {
    /// The graph
    #[arg(value_name = "GRAPH.json")]
    file: PathBuf,
    /// Number of states
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=MAX_STATES))]
    states: u64,
    /// Seed of the states
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Leave straight states out, where springs stated through the arc cosine are singular
    #[arg(long)]
    bent: bool,
}

/// Compare the simulator with exact solutions, other codes and the paper, and write DIR/validation.csv
///
/// The table shows each number beside what it should be, who says so, its error and how far it may be off. validation.csv has
/// the same with all digits; validation.md is a page with the formulas, the reasons for the tolerances and the figures, which
/// lie beside it as SVG. The exit status is 1 if one number is off by more than its tolerance, or cannot be computed.
#[derive(Args)]
struct ValidateArgs {
    /// Studies of convergence too
    #[arg(long)]
    full: bool,
    /// Directory for the results, made where there is none
    #[arg(long, value_name = "DIR", default_value = "validation")]
    out: PathBuf,
}

/// Draw saved results once more, to DIR/figures
///
/// DIR is what `bristle study` or `bristle simulate` has written to. Of a study: maps and curves of tip deflection, contact time,
/// contact time ratio, impulse and tool force over the swept settings, and the tool force beside measured ones. Of one contact:
/// force and tip deflection over time. Each figure is drawn as SVG and PNG, with the same bytes as by the command that made the
/// results.
#[derive(Args)]
struct PlotArgs {
    /// Directory with results
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Directory for the figures, which go to its subdirectory `figures` [default: DIR]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Say where the tool force of a study is high, from saved results
///
/// DIR is what `bristle study` has written to. The table has the highest tool force F_n,w of all cases and within the limits, at
/// each brushing velocity and at each penetration depth; the most force per velocity and per depth; and local maxima along the
/// tier, the line between sweeping and striking. Each line names a case by its row in runs.csv, and has a sentence on it. Nothing
/// is interpolated. Where further settings are swept, there is a table for each of their combinations.
#[derive(Args)]
struct AdviseArgs {
    /// Directory with the results of a study
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Highest brushing velocity in m/s, for the highest force within the limits
    #[arg(long, value_name = "V_B", value_parser = parse_velocity)]
    max_velocity: Option<f64>,
    /// Lowest contact time ratio, from 0 (striking) to 1 (sweeping)
    #[arg(long, value_name = "RATIO", value_parser = parse_ratio)]
    min_ratio: Option<f64>,
    /// Highest contact time ratio
    #[arg(long, value_name = "RATIO", value_parser = parse_ratio)]
    max_ratio: Option<f64>,
    /// Print one JSON object, in SI units, in place of the table
    #[arg(long)]
    json: bool,
}

#[derive(Args)]
#[group(required = true, multiple = false)]
struct EquationsArgs {
    /// The whole equations of N segments, 1 to 400
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "filament.segments"))]
    segments: Option<usize>,
    /// The kernels of the solver
    #[arg(long)]
    kernels: bool,
}

impl From<&EquationsArgs> for Equations {
    fn from(arguments: &EquationsArgs) -> Self {
        // clap lets exactly one of the two pass.
        arguments.segments.map_or(Self::Kernels, Self::Whole)
    }
}

#[derive(Clone, Copy, ValueEnum)]
enum Format {
    /// Readable mathematics, as text
    Math,
    /// A LaTeX document
    Latex,
    /// A page with formulas; of whole equations, the way from the energies to them
    Markdown,
    /// Rust source
    Rust,
    /// The expression graph
    Json,
}

impl From<Format> for DeriveFormat {
    fn from(format: Format) -> Self {
        match format {
            Format::Math => Self::Math,
            Format::Latex => Self::Latex,
            Format::Markdown => Self::Markdown,
            Format::Rust => Self::Rust,
            Format::Json => Self::Json,
        }
    }
}

/// Reads a whole number that the setting at `path` may be.
fn parse_count(text: &str, path: &str) -> Result<usize, String> {
    let parameter = Parameter::find(path).ok_or("no such setting")?;
    let allowed = || format!("must be {}", parameter.allowed());
    let count: usize = text.parse().map_err(|_| allowed())?;
    parameter.check(count as f64).map_err(|_| allowed())?;
    Ok(count)
}

/// Reads a brushing velocity.
fn parse_velocity(text: &str) -> Result<f64, String> {
    let parameter = Parameter::find(VELOCITY).ok_or("no such setting")?;
    let velocity = text.parse().ok().filter(|&velocity| parameter.check(velocity).is_ok());
    velocity.ok_or_else(|| format!("must be {}", parameter.allowed()))
}

/// Reads a contact time ratio.
fn parse_ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse().ok().filter(|ratio| (0.0..=1.0).contains(ratio));
    ratio.ok_or_else(|| "must be a number from 0 to 1".to_owned())
}

/// What can end a command early.
#[derive(Debug, Error)]
enum CliError {
    #[error(transparent)]
    File(#[from] FileError),
    #[error(transparent)]
    Input(#[from] InputError),
    #[error("{}: {error}", path.display())]
    State { path: PathBuf, error: StateError },
    #[error(transparent)]
    Evaluation(#[from] EvaluationError),
    #[error(transparent)]
    Derive(#[from] DeriveError),
    #[error("{}: {error}", path.display())]
    Comparison { path: PathBuf, error: Box<ComparisonError> },
    #[error("the simulation failed: {0}")]
    Simulation(#[from] SimulationError),
    #[error(transparent)]
    Pictures(#[from] PicturesError),
    #[error(transparent)]
    Saved(#[from] SavedError),
    #[error("{}: {error}", path.display())]
    Advice { path: PathBuf, error: AdviceError },
    #[error("cannot start threads: {0}")]
    Threads(io::Error),
    #[error(transparent)]
    Journal(#[from] JournalFileError),
    #[error(
        "{error}\n{done} of {total} cases are in the journal: once there is room, the same command goes on from there"
    )]
    Unfinished { error: FileError, done: usize, total: usize },
    #[error("cannot write to stdout: {0}")]
    Stdout(#[from] io::Error),
}

/// Runs the command that the process was called with.
pub fn run() -> ExitCode {
    start_log();
    let result = match Cli::parse().command {
        Command::Study(arguments) => study(&arguments),
        Command::Simulate(arguments) => simulate_one(&arguments),
        Command::Evaluate(arguments) => evaluate_state(&arguments),
        Command::Derive(arguments) => derive_equations(&arguments),
        Command::Compare(arguments) => compare_derivations(&arguments),
        Command::Validate(arguments) => validate(&arguments),
        Command::Plot(arguments) => plot(&arguments),
        Command::Advise(arguments) => advise_from(&arguments),
        Command::Schema => print(&input_schema()),
    };
    match result {
        Ok(status) => status,
        Err(error) => {
            say(format_args!("error: {error}"));
            match error {
                CliError::Simulation(_) => SIMULATION_FAILED.into(),
                _ => BAD_INPUT.into(),
            }
        }
    }
}

fn study(arguments: &StudyArgs) -> Result<ExitCode, CliError> {
    let text = read_text(&arguments.file)?;
    let name = arguments.file.to_string_lossy();
    let document = Document::parse(&text, &name)?;
    let study = document.study()?;
    let measured = document.measured_file().map(|file| measured_forces(&beside(&arguments.file, file))).transpose()?;
    prepare_directory(&arguments.out, &[RUNS, RUNS_PARQUET, STUDY, REPORT, MEASURED, JOURNAL])?;
    prepare_directory(&arguments.out.join(FIGURES), &[])?;

    let (mut journal, earlier) = JournalFile::open(&arguments.out, &study, arguments.restart)?;
    remove_leftovers(&arguments.out, &[RUNS, RUNS_PARQUET, STUDY, REPORT, MEASURED, COMPARISON]);
    remove_unfinished(&arguments.out);
    tell_of_earlier(&earlier, &arguments.out.join(JOURNAL));
    let (results, progress, seconds) = simulate_cases(&study, arguments, &mut journal, earlier.results)?;

    let total = study.case_count();
    let files = write_results(arguments, &study, &results, measured.as_ref().map(|(text, _)| text.as_str()))?;
    let points = measured.map_or_else(Vec::new, |(_, points)| points);
    let drawn = draw_study(&arguments.out, &study, &results, &points)?;

    if !arguments.json {
        say(study_tables(&study, &results));
        say(format_args!("{total} cases in {seconds:.2} s"));
        files.iter().for_each(|path| say_written(path));
        say_drawn(&drawn);
    }
    progress.summarise(seconds, &files);

    let failures: Vec<(usize, &String)> =
        results.iter().enumerate().filter_map(|(case, result)| Some((case, result.as_ref().err()?))).collect();
    if failures.is_empty() {
        return Ok(ExitCode::SUCCESS);
    }
    let cases = if failures.len() == 1 { "case" } else { "cases" };
    say(format_args!("error: {} {cases} failed, see the column `status`:", failures.len()));
    for (case, message) in failures.into_iter().take(MAX_FAILURES_SHOWN) {
        say(format_args!("  row {}: {message}", case + 1));
    }
    Ok(SIMULATION_FAILED.into())
}

/// Tells what a journal held that the study begins with.
fn tell_of_earlier(earlier: &Earlier, path: &Path) {
    let path = path.display();
    if earlier.given_up {
        say(format_args!("note: the earlier journal `{path}` is given up"));
    }
    if earlier.torn > 0 {
        let torn = earlier.torn;
        say(format_args!("note: the last {torn} bytes of `{path}` were not written to their end, and are dropped"));
    }
    let (done, total) = (earlier.results.iter().flatten().count(), earlier.results.len());
    if done > 0 {
        say(format_args!("{done} of {total} cases are in `{path}`, {} are left", total - done));
    }
}

/// Simulates the cases without a result, each of which goes into the journal, and returns all results, with the seconds.
fn simulate_cases(
    study: &Study,
    arguments: &StudyArgs,
    journal: &mut JournalFile,
    mut results: Vec<Option<CaseResult>>,
) -> Result<(Vec<CaseResult>, Progress, f64), CliError> {
    let total = study.case_count();
    stop_on_interrupt(journal, total, arguments.out.join(JOURNAL));
    let failures = results.iter().flatten().filter(|result| result.is_err()).count();
    let progress = Progress::begin(total, journal.cases(), failures, arguments.json);
    let simulated = complete_study(study, arguments.threads(), &mut results, |case, result| {
        let flow = journal.append(case, result);
        if flow.is_continue() {
            progress.case_done(result.is_err());
        }
        flow
    });
    let seconds = progress.end();
    journal.settle().map_err(|error| CliError::Unfinished { error, done: journal.cases(), total })?;
    simulated.map_err(CliError::Threads)?;
    let results = results.into_iter().map(|result| result.expect("every case is done")).collect();
    Ok((results, progress, seconds))
}

/// Lets Ctrl-C end the program between two lines of the journal, and tell how to go on.
fn stop_on_interrupt(journal: &JournalFile, total: usize, path: PathBuf) {
    let stop = journal.stopper(move |done| {
        let path = path.display();
        say_at_the_end(format_args!(
            "stopped: {done} of {total} cases are in `{path}`; the same command goes on from there"
        ));
        process::exit(INTERRUPTED)
    });
    // Where signals are handled elsewhere, or ignored, that is meant; and the journal stands an end without notice.
    let _ = ctrlc::try_set_handler(stop);
}

/// Writes what a study has found, beside the `measured` forces that it is compared with, and returns the paths.
fn write_results(
    arguments: &StudyArgs,
    study: &Study,
    results: &[CaseResult],
    measured: Option<&str>,
) -> Result<Vec<PathBuf>, CliError> {
    let total = study.case_count();
    let name = arguments.file.file_name().unwrap_or(arguments.file.as_os_str()).to_string_lossy();
    let unfinished = |error| CliError::Unfinished { error, done: total, total };
    let directory = &arguments.out;
    let mut runs = Vec::new();
    write_runs(&mut runs, study, results).expect("memory takes what is written to it");
    let mut staged = vec![StagedFile::write(directory.join(RUNS), |out| out.write_all(&runs)).map_err(unfinished)?];
    let settings = study_text(study, &runs, measured.is_some());
    #[cfg(feature = "parquet")]
    {
        let content = |out: &mut (dyn Write + Send)| write_runs_parquet(out, study, results, &settings);
        staged.push(StagedFile::write(directory.join(RUNS_PARQUET), content).map_err(unfinished)?);
    }
    if let Some(text) = measured {
        staged.push(stage_text(directory, MEASURED, text).map_err(unfinished)?);
    }
    staged.push(stage_text(directory, STUDY, &settings).map_err(unfinished)?);
    let courses = record(study, results, arguments.threads()).map_err(CliError::Threads)?;
    staged.push(stage_text(directory, REPORT, &page(&name, study, results, &courses)).map_err(unfinished)?);
    let files = staged.into_iter().map(StagedFile::commit).collect::<Result<_, _>>().map_err(unfinished)?;
    // What an earlier study had, and this one has not.
    let has_measured = measured.is_some();
    let others = [(RUNS_PARQUET, cfg!(feature = "parquet")), (MEASURED, has_measured), (COMPARISON, has_measured)];
    for (name, _) in others.into_iter().filter(|(_, is_written)| !is_written) {
        remove(&directory.join(name)).map_err(unfinished)?;
    }
    Ok(files)
}

/// A file of a directory with this text, under a temporary name.
fn stage_text(directory: &Path, name: &str, text: &str) -> Result<StagedFile, FileError> {
    StagedFile::write(directory.join(name), |out| out.write_all(text.as_bytes()))
}

/// Style of the progress bar, which indicatif shows on a terminal only.
fn progress_style() -> ProgressStyle {
    ProgressStyle::with_template("{bar:40} {pos}/{len} cases, {eta} left")
        .unwrap_or_else(|_| ProgressStyle::default_bar())
}

fn simulate_one(arguments: &SimulateArgs) -> Result<ExitCode, CliError> {
    let text = read_text(&arguments.file)?;
    let name = arguments.file.to_string_lossy();
    let settings = Document::parse(&text, &name)?.settings()?;
    prepare_directory(&arguments.out, &[METRICS, HISTORY, HISTORY_PARQUET, CASE])?;
    let shapes = arguments.vtk.unwrap_or(0) as usize;
    if shapes > 0 {
        prepare_vtk(&arguments.out, shapes)?;
    }

    let samples = arguments.samples.unwrap_or(settings.solver.samples);
    let simulation = simulate_with(&settings, Sampling { samples, shapes, loads: true })?;
    let metrics = StagedFile::write(arguments.out.join(METRICS), |out| write_metrics(out, &simulation))?;
    let history = StagedFile::write(arguments.out.join(HISTORY), |out| write_history(out, &simulation.history))?;
    let case = case_text(&settings);
    #[cfg(feature = "parquet")]
    let table = StagedFile::write(arguments.out.join(HISTORY_PARQUET), |out| {
        write_history_parquet(out, &simulation.history, &case)
    })?;
    let vtk = stage_vtk(&arguments.out, &settings, &simulation.shapes)?;
    stage_text(&arguments.out, CASE, &case)?.commit()?;
    say_written(&metrics.commit()?);
    say_written(&history.commit()?);
    #[cfg(feature = "parquet")]
    say_written(&table.commit()?);
    if !cfg!(feature = "parquet") {
        remove(&arguments.out.join(HISTORY_PARQUET))?;
    }
    commit_vtk(&arguments.out, vtk, shapes)?.iter().for_each(|path| say_written(path));
    say_drawn(&draw_history(&arguments.out, &settings, &simulation.history)?);
    Ok(ExitCode::SUCCESS)
}

fn plot(arguments: &PlotArgs) -> Result<ExitCode, CliError> {
    let out = arguments.out.as_ref().unwrap_or(&arguments.results);
    for drawn in draw_saved(&arguments.results, out)? {
        say_drawn(&drawn);
    }
    Ok(ExitCode::SUCCESS)
}

fn advise_from(arguments: &AdviseArgs) -> Result<ExitCode, CliError> {
    let path = &arguments.results;
    let (saved, results) = saved_study(path)?.ok_or_else(|| SavedError::NoStudy(path.clone()))?;
    let AdviseArgs { max_velocity: max_velocity_m_s, min_ratio, max_ratio, .. } = *arguments;
    let advice = advise(&saved.study, &results, Limits { max_velocity_m_s, min_ratio, max_ratio })
        .map_err(|error| CliError::Advice { path: path.clone(), error })?;
    if arguments.json {
        let json = serde_json::to_string(&advice).map_err(io::Error::from)?;
        return print(&(json + "\n"));
    }
    print(&advice.text())
}

fn evaluate_state(arguments: &EvaluateArgs) -> Result<ExitCode, CliError> {
    let text = read_text(&arguments.file)?;
    let name = arguments.file.to_string_lossy();
    let settings = Document::parse(&text, &name)?.settings_without_process()?;
    let state = parse_state(&read_text(&arguments.state)?)
        .map_err(|error| CliError::State { path: arguments.state.clone(), error })?;
    let evaluation = evaluate(&settings.filament, settings.tool.body_radius_m, &state)?;
    let mut json = serde_json::to_string(&evaluation).map_err(io::Error::from)?;
    json.push('\n');
    print(&json)
}

fn derive_equations(arguments: &DeriveArgs) -> Result<ExitCode, CliError> {
    let equations = derive((&arguments.equations).into(), arguments.format.into())?;
    match &arguments.out {
        None => print(&equations),
        Some(path) => {
            let file = StagedFile::write(path.clone(), |out| out.write_all(equations.as_bytes()))?;
            say_written(&file.commit()?);
            Ok(ExitCode::SUCCESS)
        }
    }
}

fn compare_derivations(arguments: &CompareArgs) -> Result<ExitCode, CliError> {
    let text = read_graph(&arguments.file)?;
    let which = if arguments.bent { States::Bent } else { States::All };
    let comparison = compare_graph(&text, arguments.states as usize, which, arguments.seed)
        .map_err(|error| CliError::Comparison { path: arguments.file.clone(), error: Box::new(error) })?;
    print(&comparison.to_string())?;
    Ok(agreement(comparison.agrees()))
}

fn validate(arguments: &ValidateArgs) -> Result<ExitCode, CliError> {
    let extent = if arguments.full { Extent::Full } else { Extent::Quick };
    prepare_directory(&arguments.out, &[COMPARISONS, PAGE])?;

    let start = Instant::now();
    let bar = ProgressBar::new(validation::case_count() as u64).with_style(progress_style());
    let outcomes = validation::run(extent, || bar.inc(1));
    bar.finish_and_clear();
    let seconds = start.elapsed().as_secs_f64();

    let written = write_validation(&arguments.out, &outcomes, extent);
    say(format_args!("{} cases in {seconds:.2} s", validation::case_count()));
    // Last, so that the verdict is what a terminal shows; and also where the files cannot be written.
    print(&validation::table(&outcomes))?;
    written?;
    Ok(agreement(validation::agrees(&outcomes)))
}

/// Writes what a validation has compared, its page and its figures.
fn write_validation(directory: &Path, outcomes: &[Outcome], extent: Extent) -> Result<(), CliError> {
    let stage = |name: &str, text: String| stage_text(directory, name, &text);
    let comparisons = directory.join(COMPARISONS);
    let mut files = vec![StagedFile::write(comparisons, |out| validation::write_rows(out, outcomes))?];
    files.push(stage(PAGE, validation::page(outcomes, extent))?);
    for figure in outcomes.iter().flat_map(Outcome::figures) {
        files.push(stage(&format!("{}.svg", figure.name), figure.svg())?);
    }
    for file in files {
        say_written(&file.commit()?);
    }
    Ok(())
}

/// Exit status of a comparison.
fn agreement(agrees: bool) -> ExitCode {
    if agrees { ExitCode::SUCCESS } else { DISAGREEMENT.into() }
}

/// Writes data to stdout. That a reader such as `head` has seen enough is no error.
fn print(data: &str) -> Result<ExitCode, CliError> {
    let mut stdout = io::stdout().lock();
    match stdout.write_all(data.as_bytes()).and_then(|()| stdout.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(error.into()),
        _ => Ok(ExitCode::SUCCESS),
    }
}

fn say_written(path: &Path) {
    say(format_args!("wrote {}", path.display()));
}

fn say_drawn(Drawn { message, comparisons }: &Drawn) {
    say(message);
    if !comparisons.is_empty() {
        say(comparison_table(comparisons));
    }
}

/// A path that a file states, which is relative to the file's directory.
fn beside(file: &Path, path: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_is_an_exit_status() {
        assert_eq!(agreement(true), ExitCode::SUCCESS);
        assert_eq!(agreement(false), ExitCode::from(1));
    }
}
