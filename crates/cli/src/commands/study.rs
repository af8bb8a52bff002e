//! `bristle study`.

#[cfg(feature = "parquet")]
use std::io::Write;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};
use std::process::{self, ExitCode};

use bristle::simulation::Simulation;
use bristle_report::page::{Course, Recorder, page};
#[cfg(feature = "parquet")]
use bristle_report::parquet::write_runs_parquet;
use bristle_report::tables::study_tables;
use bristle_study::document::Document;
use bristle_study::results::{study_text, write_runs};
use bristle_study::study::{CaseResult, Study, complete_study_sampled};
use clap::Args;

use crate::error::{CliError, SIMULATION_FAILED};
use crate::files::{StagedFile, beside, prepare_directory, read_text, remove, remove_leftovers};
use crate::journal_file::{Earlier, JOURNAL, JournalFile};
use crate::pictures::{COMPARISON, FIGURES, MEASURED, draw_study, measured_forces, remove_unfinished, say_drawn};
use crate::progress::Progress;
use crate::saved::{RUNS, RUNS_PARQUET, STUDY};
use crate::terminal::{say, say_at_the_end, say_written};

/// Exit status where Ctrl-C has stopped a study, as shells have it: 128 and the signal's number.
const INTERRUPTED: i32 = 130;
/// Name of the page.
const REPORT: &str = "report.html";
/// Most threads that a study may ask for.
const MAX_THREADS: u64 = 1024;
/// Most failed cases that a study prints; the others stand in its file.
const MAX_FAILURES_SHOWN: usize = 5;

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
pub struct StudyArgs {
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

/// Runs the command.
pub fn run(arguments: &StudyArgs) -> Result<ExitCode, CliError> {
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
    let recorder = Recorder::new(&study);
    let (results, progress, seconds) = simulate_cases(&study, arguments, &mut journal, earlier.results, &recorder)?;
    let courses = recorder.finish(&results, arguments.threads()).map_err(CliError::Threads)?;

    let total = study.case_count();
    let text = measured.as_ref().map(|(text, _)| text.as_str());
    let files = write_results(arguments, &study, &results, &courses, text)?;
    let points = measured.map_or_else(Vec::new, |(_, points)| points);
    let drawn = draw_study(&arguments.out, &study, &results, &points, arguments.threads())?;

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

/// Simulates the cases without a result and returns all results, with the seconds. Each goes into the journal, and its
/// course to the recorder.
fn simulate_cases(
    study: &Study,
    arguments: &StudyArgs,
    journal: &mut JournalFile,
    mut results: Vec<Option<CaseResult>>,
    recorder: &Recorder<'_>,
) -> Result<(Vec<CaseResult>, Progress, f64), CliError> {
    let total = study.case_count();
    stop_on_interrupt(journal, total, arguments.out.join(JOURNAL));
    let failures = results.iter().flatten().filter(|result| result.is_err()).count();
    let progress = Progress::begin(total, journal.cases(), failures, arguments.json);
    let record = |case, pass: &Simulation| recorder.take(case, pass);
    let done = |case, result: &CaseResult| {
        let flow = journal.append(case, result);
        if flow.is_continue() {
            progress.case_done(result.is_err());
        }
        flow
    };
    let simulated = complete_study_sampled(study, arguments.threads(), &mut results, recorder.sampling(), record, done);
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
    courses: &[Course],
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
        staged.push(StagedFile::text(directory, MEASURED, text).map_err(unfinished)?);
    }
    staged.push(StagedFile::text(directory, STUDY, &settings).map_err(unfinished)?);
    staged.push(StagedFile::text(directory, REPORT, &page(&name, study, results, courses)).map_err(unfinished)?);
    let files = staged.into_iter().map(StagedFile::commit).collect::<Result<_, _>>().map_err(unfinished)?;
    // What an earlier study had, and this one has not.
    let has_measured = measured.is_some();
    let others = [(RUNS_PARQUET, cfg!(feature = "parquet")), (MEASURED, has_measured), (COMPARISON, has_measured)];
    for (name, _) in others.into_iter().filter(|(_, is_written)| !is_written) {
        remove(&directory.join(name)).map_err(unfinished)?;
    }
    Ok(files)
}
