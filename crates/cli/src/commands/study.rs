//! `bristle study`.

use std::io;
use std::path::Path;
use std::process::{self, ExitCode};

use bristle::simulation::Stop;
use bristle_app::insight::measured::unusual_points;
use bristle_app::insight::quantity::main_metric;
use bristle_app::report::figures::is_of_study;
use bristle_app::report::tables::{study_tables, tools_table};
use bristle_app::run::{DirectoryState, RunContext, StudyOutcome, StudyRun};
use bristle_app::store::journal_file::JOURNAL;
use bristle_app::store::staged::{prepare_directory, relative_to};
use bristle_app::store::study_files::write_shard;
use bristle_study::grid::{CaseResult, Resources, Shard, Study};
use bristle_study::input::measured::Measurement;
use bristle_study::input::plausibility::unusual_in_study;
use bristle_study::input::statement::Statement;
use bristle_study::text::number::counted;
use bristle_study::text::{shown, shown_path};
use clap::{Args, ValueEnum};

use crate::error::{CliError, SIMULATION_FAILED};
use crate::interrupt::on_interrupt;
use crate::job::{JobArgs, told};
use crate::pictures::{FIGURES, Figures, draw_study, is_picture, measured_forces, say_drawn};
use crate::progress::Progress;
use crate::terminal::{
    say, say_at_the_end, say_findings, say_kept, say_written, show, show_assumptions, width,
};
use crate::values::INTERRUPTED;

/// Largest number of failed cases that a study prints. `runs.csv` lists all of them.
const MAX_FAILURES_SHOWN: usize = 5;
/// Longest error of a case that is printed, in characters.
pub const LONGEST_FAILURE: usize = 400;

/// Simulate all cases of [study] in a file, and write runs.csv, a page and figures
///
/// Each entry of [study] sweeps one setting over a list or an evenly spaced range:
///
///   [study]
///   brushing_velocity_m_s = { start = 2.5, stop = 30.0, step = 2.5 }
///   penetration_depth_m = [0.5e-3, 1.0e-3]
///   "filament.segments" = [10, 25, 50]
///
/// The cases are all combinations. DIR/runs.csv has one row per case: settings,
/// contact metrics, solver statistics, and status (ok or the error). A build with
/// the feature parquet also writes this table as runs.parquet. A case that fails
/// does not stop the others; the exit status is then 3. DIR/report.html is a page
/// to explore in a browser. It shows maps, each contact in motion, and the
/// settings.
///
/// DIR/figures has the five figures that matter most, or all with --figures all,
/// as SVG, or as PNG and PDF; `bristle report DIR` redraws them. If the file names
/// measured forces under [measured], the figures compare them with the simulated
/// ones, and DIR/measured_comparison.csv lists the deviations; `bristle explain
/// measured` shows its keys.
///
/// If the properties of the filaments are not known exactly, state standard
/// deviations under [uncertainty], as in diameter_std_m = 0.03e-3. The study then
/// repeats each case with sampled tools. It shows the band that contains 95 % of
/// their forces, and how much each property contributes to it.
///
/// With [brush], the filaments of a case touch each other. Before the first case
/// is simulated, all cases are checked: filaments must not overlap, nor need more
/// memory than is available. --alone simulates filaments alone, for a quick look.
/// If filaments touch but are simulated alone, a warning says so.
///
/// If cases are laterally unstable, a warning says how many, and how to see what
/// an imperfect filament does in them. The tables mark them with !. If filaments
/// come back still vibrating, a warning says how to simulate turn after turn.
///
/// A study can be stopped at any moment, by Ctrl-C or by a crash. The same command
/// resumes it. Each completed case is a line of DIR/journal.jsonl. Only the cases
/// in progress are lost, and after a power failure those of the last tenth of a
/// second. The results are the same to the bit. After a change of the file the same
/// command simulates the cases that are new; the earlier results are kept in
/// DIR/previous. Only one study at a time can write to a directory.
///
/// With --json each line on stdout is an object. While cases are simulated, at
/// most ten per second:
///   {"event":"progress","done":40,"total":120,"failures":0,"rate":680.2,
///    "seconds_left":0.12}
/// done counts the cases with a result, failures those of them that failed. rate
/// is in cases per second; rate and seconds_left are null while unknown. At the
/// end:
///   {"event":"summary","cases":120,"failures":0,"resumed":30,"seconds":0.13,
///    "files":["results/runs.csv","results/study.json","results/report.html"]}
/// resumed counts the cases that were already in the journal, and files lists the
/// files written.
///
/// With --check each case is simulated again: a pass at a tenth of the tolerance,
/// a brush in steps of half the length. The column change_when_checked of
/// DIR/runs.csv has the largest relative change of the metrics in the tables.
/// Cases in the journal that were not checked are simulated again, too.
///
/// With --shard I/N only the cases of shard I of N are simulated, and DIR has no
/// results yet. `bristle report` makes them of the directories of all shards, which
/// may come from different machines.
#[derive(Args)]
#[command(verbatim_doc_comment)]
#[command(allow_negative_numbers = true)]
pub struct StudyArgs {
    #[command(flatten)]
    job: JobArgs,
    /// Simulate shard I of N only, for `bristle report`
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    #[command(flatten)]
    tables: TableArgs,
}

/// The tables of a study on the terminal.
#[derive(Args)]
pub struct TableArgs {
    /// Which tables are printed: that of the tool force or of what [goal] asks for, or all
    #[arg(long, value_name = "WHICH", default_value = "main")]
    tables: TableChoice,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TableChoice {
    /// The one that matters most
    Main,
    /// All tables, and all notes
    All,
}

/// Runs the command.
pub fn run(arguments: &StudyArgs) -> Result<ExitCode, CliError> {
    let job = &arguments.job;
    let figures = job.figures.figures()?;
    let text = job.input.read()?;
    let document = job.document(&text)?;
    let study = document.study()?;
    let study = if job.check { study.checked() } else { study };
    job.input.warn_of(&unusual_in_study(&study))?;
    job.input.check_brushes(&study, job.resources.resources())?;
    let measured = match document.measured() {
        Some((file, format)) => measured_forces(&relative_to(&job.input.file, file), format)?,
        None => Vec::new(),
    };
    job.input.warn_of(&unusual_points(&study, &measured))?;
    let statement = Statement::of(&document, &job.input.short_name());
    let run = open(study, &job.out, job.restart)?;
    match arguments.shard {
        Some(shard) => simulate_shard(run, job, shard, &statement, &measured),
        None => Conclusion {
            out: &job.out,
            statement: &statement,
            measured: &measured,
            figures: &figures,
            resources: job.resources.resources(),
            json: job.json,
            tables: &arguments.tables,
            ignored: &job.ignore,
        }
        .conclude(run),
    }
}

/// The study in `directory`, with what its journal has. Ctrl-C ends the program from now on,
/// between two lines of the journal.
pub fn open(study: Study, directory: &Path, restart: bool) -> Result<StudyRun, CliError> {
    let (run, found) = StudyRun::open(
        study,
        directory,
        &[(FIGURES, &is_picture(is_of_study))],
        restart,
    )?;
    let (path, total) = (directory.join(JOURNAL), run.study().case_count());
    tell_of(&run, &found, &path);
    let (earlier, _) = run.counts();
    if let Some(journal) = run.journal() {
        let stop = journal.stopper(move |appended| {
            let (path, done) = (shown_path(&path), earlier + appended);
            say_at_the_end(format_args!(
                "stopped: {done} of {total} cases are in `{path}`; run the same command again to resume"
            ));
            process::exit(INTERRUPTED.into())
        });
        on_interrupt(stop);
    }
    Ok(run)
}

/// Tells the user what the directory held when the study started.
fn tell_of(run: &StudyRun, DirectoryState { journal, kept }: &DirectoryState, path: &Path) {
    let path = shown_path(path);
    kept.iter().for_each(|kept| say_kept(kept));
    if journal.discarded {
        say(format_args!(
            "note: the earlier journal `{path}` has been discarded"
        ));
    }
    if journal.torn > 0 {
        say(format_args!(
            "note: the last {} bytes of `{path}` were an incomplete line and have been dropped",
            journal.torn
        ));
    }
    let ((done, _), total) = (run.counts(), run.study().case_count());
    if done > 0 {
        say(format_args!(
            "{done} of {total} cases are in `{path}`, {} remain",
            total - done
        ));
    }
}

/// Simulates the cases of a shard, which are then in the journal, and writes what makes the
/// directory one of this study.
fn simulate_shard(
    mut run: StudyRun,
    job: &JobArgs,
    shard: Shard,
    statement: &Statement,
    measured: &[Measurement],
) -> Result<ExitCode, CliError> {
    write_shard(&job.out, run.study(), statement, measured)?;
    let is_own = |case| shard.has(case);
    let progress = Progress::begin(&run, is_own, job.json);
    let stop = Stop::default();
    run.simulate(
        is_own,
        &RunContext {
            resources: job.resources.resources(),
            stop: &stop,
            observer: &progress,
        },
    )?;
    let (total, failed) = progress.counts();
    let path = job.out.join(JOURNAL);
    if !job.json {
        let path = shown_path(&path);
        say(format_args!(
            "shard {shard}: its {} in `{path}`\n`bristle report` makes results of all shards",
            if total == 1 {
                "case is".to_owned()
            } else {
                format!("{total} cases are")
            }
        ));
    }
    progress.summarise(&[path], &[], run.study())?;
    if failed > 0 {
        say(format_args!(
            "error: {failed} of the cases failed; the results of the study will say why"
        ));
    }
    Ok(status(failed))
}

/// The exit status of a study of which so many cases failed.
fn status(failed: usize) -> ExitCode {
    if failed == 0 {
        ExitCode::SUCCESS
    } else {
        SIMULATION_FAILED.into()
    }
}

/// Final stage of a study, once its directory is open.
pub struct Conclusion<'a> {
    /// The directory.
    pub out: &'a Path,
    /// Statement of the input file besides settings.
    pub statement: &'a Statement,
    /// The forces with which it is compared.
    pub measured: &'a [Measurement],
    /// Which figures are drawn.
    pub figures: &'a Figures,
    /// Threads and memory of simulations.
    pub resources: Resources,
    /// `true` if stdout has JSON for programs.
    pub json: bool,
    /// Which tables are shown.
    pub tables: &'a TableArgs,
    /// The ids of findings that are not told.
    pub ignored: &'a [&'static str],
}

impl Conclusion<'_> {
    /// Simulates all cases that have no result, writes the results, and shows them.
    pub fn conclude(&self, run: StudyRun) -> Result<ExitCode, CliError> {
        let Self {
            out,
            statement,
            measured,
            figures,
            resources,
            json,
            tables,
            ignored,
        } = *self;
        if figures.are_drawn() {
            prepare_directory(&out.join(FIGURES))?;
        }
        let progress = Progress::begin(&run, |_| true, json);
        let stop = Stop::default();
        let context = RunContext {
            resources,
            stop: &stop,
            observer: &progress,
        };
        let StudyOutcome {
            study,
            results,
            assumptions,
            answer,
            comparisons,
            findings,
            files,
        } = run.finish(statement, measured, &context)?;
        let drawn = draw_study(
            out,
            &study,
            &results,
            measured,
            &comparisons,
            resources.threads,
            figures,
        )?;
        let shown = if json {
            Ok(())
        } else {
            say(format_args!(
                "{} in {:.2} s",
                counted(results.len()),
                progress.seconds()
            ));
            files.iter().for_each(|path| say_written(path));
            show_tables(&study, &results, tables, statement)
                .and_then(|()| show_assumptions(&assumptions))
                .and_then(|()| {
                    answer.map_or(Ok(()), |answer| {
                        show(format_args!("\n{}", answer.text(width())))
                    })
                })
                .and_then(|()| say_drawn(&drawn, &comparisons))
        };
        let findings = told(findings, ignored);
        let shown = shown.and(progress.summarise(&files, &findings, &study));
        let failed = tell_failures(&results);
        if study.checks() {
            tell_changes(&results);
        }
        say_findings(&findings);
        shown?;
        Ok(status(failed))
    }
}

/// Tells which cases failed, and returns their number.
fn tell_failures(results: &[CaseResult]) -> usize {
    let failures: Vec<(usize, &String)> = results
        .iter()
        .enumerate()
        .filter_map(|(case, result)| Some((case, result.as_ref().err()?)))
        .collect();
    if !failures.is_empty() {
        let cases = if failures.len() == 1 { "case" } else { "cases" };
        say(format_args!(
            "error: {} {cases} failed, see the column `status`:",
            failures.len()
        ));
    }
    for (case, message) in failures.iter().take(MAX_FAILURES_SHOWN) {
        say(format_args!(
            "  row {}: {}",
            case + 1,
            shown(message, LONGEST_FAILURE)
        ));
    }
    failures.len()
}

/// Tells by how much the metrics changed that were computed more precisely.
fn tell_changes(results: &[CaseResult]) {
    let changes: Vec<f64> = results
        .iter()
        .flatten()
        .filter_map(|summary| summary.change_when_checked)
        .collect();
    let largest = 100.0 * changes.iter().copied().fold(0.0, f64::max);
    say(format_args!(
        "{} of {} cases checked: no metric changed by more than {largest:.2} %",
        changes.len(),
        results.len()
    ));
}

/// Shows the tables of a study that are asked for, below that of what its named tools differ in.
pub fn show_tables(
    study: &Study,
    results: &[CaseResult],
    tables: &TableArgs,
    statement: &Statement,
) -> io::Result<()> {
    let main = (tables.tables == TableChoice::Main).then(|| main_metric(study, statement));
    let tables = study_tables(study, results, main, width());
    if study.tools().is_empty() {
        show(tables)
    } else {
        show(format_args!("{}\n{tables}", tools_table(study, width())))
    }
}
