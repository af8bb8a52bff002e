//! `bristle study`.

use std::io;
use std::path::Path;
use std::process::{self, ExitCode};

use bristle::simulation::Stop;
use bristle_app::insight::measured::unusual_points;
use bristle_app::insight::warnings::of_study;
use bristle_app::report::figures::is_of_study;
use bristle_app::report::tables::{study_tables, tools_table};
use bristle_app::run::{Finished, Found, Means, StudyRun};
use bristle_app::store::journal_file::JOURNAL;
use bristle_app::store::staged::{prepare_directory, relative_to};
use bristle_study::grid::{CaseResult, Shard, Study};
use bristle_study::input::document::Document;
use bristle_study::input::plausibility::unusual_in_study;
use bristle_study::text::number::counted;
use bristle_study::text::{shown, shown_path};
use clap::Args;

use crate::error::{CliError, SIMULATION_FAILED};
use crate::input::InputText;
use crate::job::JobArgs;
use crate::pictures::{FIGURES, draw_study, is_picture, measured_forces, say_drawn};
use crate::progress::Progress;
use crate::terminal::{say, say_at_the_end, say_written, show, show_assumptions, width};
use crate::values::{INTERRUPTED, ResourceArgs};

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
/// as SVG, PNG and PDF; `bristle plot DIR` redraws them. If the input file names
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
/// memory than is available. --without-interaction simulates filaments alone, for
/// a quick look. If filaments touch but are simulated alone, a warning says so.
///
/// If cases are laterally unstable, a warning says how many, and how to see what
/// an imperfect filament does in them. The tables mark them with !. If filaments
/// come back still vibrating, a warning says how to simulate turn after turn.
///
/// A study can be stopped at any moment, by Ctrl-C or by a crash. The same command
/// resumes it. Each completed case is a line of DIR/journal.jsonl. Only the cases
/// in progress are lost, and after a power failure those of the last tenth of a
/// second. The results are the same to the bit. A journal from other settings or
/// another build of Bristle is refused; --restart discards it. Only one study at a
/// time can write to a directory.
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
/// With --shard I/N only the cases of shard I of N are simulated, and DIR has a
/// journal only. `bristle merge` makes results of the directories of all shards,
/// which may come from different machines.
#[derive(Args)]
#[command(verbatim_doc_comment)]
#[command(allow_negative_numbers = true)]
pub struct StudyCommandArgs {
    #[command(flatten)]
    study: StudyArgs,
    /// Simulate shard I of N only, for `bristle merge`
    #[arg(long, value_name = "I/N")]
    shard: Option<Shard>,
    /// Simulate each case again with more precision
    #[arg(long)]
    check: bool,
}

/// The study, whose cases are simulated again if it is to `check` them.
fn checked_if(study: Study, check: bool) -> Study {
    if check { study.checked() } else { study }
}

/// The input of a study, and where its results go.
#[derive(Args)]
pub struct StudyArgs {
    #[command(flatten)]
    pub job: JobArgs,
    #[command(flatten)]
    resources: ResourceArgs,
    /// Leave out [brush]: simulate each filament alone
    #[arg(long)]
    without_interaction: bool,
    /// Discard the results of an earlier call in DIR/journal.jsonl, and begin anew
    #[arg(long)]
    pub restart: bool,
    /// Print progress and summary to stdout as JSON objects, instead of tables
    #[arg(long)]
    json: bool,
}

impl StudyArgs {
    /// What the text of the input file states, with filaments that touch each other or without.
    pub fn document<'t>(&self, text: &'t InputText<'_>) -> Result<Document<'t>, CliError> {
        text.document_alone_if(self.without_interaction)
    }

    /// What the study may use, watched by `progress`.
    fn means<'a>(&self, progress: &'a Progress, stop: &'a Stop) -> Means<'a> {
        Means {
            resources: self.resources.resources(),
            stop,
            observer: progress,
        }
    }

    /// Warns of what is unusual, and checks that all brushes can be simulated.
    fn check(&self, study: &Study) -> Result<(), CliError> {
        self.job.input.warn_of(&unusual_in_study(study))?;
        self.job
            .input
            .check_brushes(study, self.resources.resources())
    }
}

/// Runs the command.
pub fn run(arguments: &StudyCommandArgs) -> Result<ExitCode, CliError> {
    match arguments.shard {
        Some(shard) => run_shard(&arguments.study, shard, arguments.check),
        None => run_whole(&arguments.study, arguments.study.restart, arguments.check),
    }
}

/// The study in `directory`, with what its journal has. Ctrl-C ends the program from now on,
/// between two lines of the journal.
fn open(study: Study, directory: &Path, restart: bool) -> Result<StudyRun, CliError> {
    let (run, found) = StudyRun::open(
        study,
        directory,
        &[(FIGURES, &is_picture(is_of_study))],
        restart,
    )?;
    let (path, total) = (directory.join(JOURNAL), run.study().case_count());
    tell_of(&run, found, &path);
    if let Some(journal) = run.journal() {
        let stop = journal.stopper(move |done| {
            let path = shown_path(&path);
            say_at_the_end(format_args!(
                "stopped: {done} of {total} cases are in `{path}`; run the same command again to resume"
            ));
            process::exit(INTERRUPTED.into())
        });
        // If signals are handled elsewhere, or ignored, that is intended. The journal survives an
        // end without notice.
        let _ = ctrlc::try_set_handler(stop);
    }
    Ok(run)
}

/// Tells the user what the journal held when the study started.
fn tell_of(run: &StudyRun, Found { torn, discarded }: Found, path: &Path) {
    let path = shown_path(path);
    if discarded {
        say(format_args!(
            "note: the earlier journal `{path}` has been discarded"
        ));
    }
    if torn > 0 {
        say(format_args!(
            "note: the last {torn} bytes of `{path}` were an incomplete line and have been dropped"
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

/// Simulates the cases of a shard, which are then in the journal.
fn run_shard(arguments: &StudyArgs, shard: Shard, check: bool) -> Result<ExitCode, CliError> {
    let text = arguments.job.input.read()?;
    let study = checked_if(arguments.document(&text)?.study()?, check);
    arguments.check(&study)?;
    let mut run = open(study, &arguments.job.out, arguments.restart)?;
    let is_own = |case| shard.has(case);
    let progress = Progress::begin(&run, is_own, arguments.json);
    run.simulate(is_own, &arguments.means(&progress, &Stop::default()))?;
    let (total, failed) = progress.counts();
    let path = arguments.job.out.join(JOURNAL);
    if !arguments.json {
        let path = shown_path(&path);
        say(format_args!(
            "shard {shard}: its {} in `{path}`\n`bristle merge` makes results of all shards",
            if total == 1 {
                "case is".to_owned()
            } else {
                format!("{total} cases are")
            }
        ));
    }
    progress.summarise(&[path])?;
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

/// Simulates all cases that are not in the journal, or all with `restart`, and writes the results.
pub fn run_whole(arguments: &StudyArgs, restart: bool, check: bool) -> Result<ExitCode, CliError> {
    let figures = arguments.job.figures.figures()?;
    let text = arguments.job.input.read()?;
    let document = arguments.document(&text)?;
    let study = checked_if(document.study()?, check);
    arguments.check(&study)?;
    let measured = match document.measured() {
        Some((file, format)) => {
            measured_forces(&relative_to(&arguments.job.input.file, file), format)?
        }
        None => Vec::new(),
    };
    arguments
        .job
        .input
        .warn_of(&unusual_points(&study, &measured))?;
    let out = &arguments.job.out;
    let run = open(study, out, restart)?;
    if figures.are_drawn() {
        prepare_directory(&out.join(FIGURES))?;
    }
    let progress = Progress::begin(&run, |_| true, arguments.json);
    let (stop, name) = (Stop::default(), arguments.job.input.short_name());
    let finished = run.finish(
        &name,
        &document,
        &measured,
        &arguments.means(&progress, &stop),
    )?;
    let Finished {
        study,
        results,
        assumptions,
        answer,
        comparisons,
        files,
    } = finished;
    let drawn = draw_study(
        out,
        &study,
        &results,
        &measured,
        &comparisons,
        arguments.resources.threads.number(),
        &figures,
    )?;

    let total = results.len();
    let tables = if arguments.json {
        Ok(())
    } else {
        say(format_args!(
            "{} in {:.2} s",
            counted(total),
            progress.seconds()
        ));
        files.iter().for_each(|path| say_written(path));
        show_tables(&study, &results)
            .and_then(|()| show_assumptions(&assumptions))
            .and_then(|()| {
                answer.map_or(Ok(()), |answer| {
                    show(format_args!("\n{}", answer.text(width())))
                })
            })
            .and_then(|()| say_drawn(&drawn, &comparisons))
    };
    let told = tables.and(progress.summarise(&files));

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
    if study.checks() {
        let changes: Vec<f64> = results
            .iter()
            .flatten()
            .filter_map(|summary| summary.change_when_checked)
            .collect();
        let largest = 100.0 * changes.iter().copied().fold(0.0, f64::max);
        say(format_args!(
            "{} of {total} cases checked: no metric changed by more than {largest:.2} %",
            changes.len()
        ));
    }
    of_study(&study, &results).iter().for_each(say);
    told?;
    Ok(status(failures.len()))
}

/// Shows the tables of a study, below that of what its named tools differ in.
pub fn show_tables(study: &Study, results: &[CaseResult]) -> io::Result<()> {
    let tables = study_tables(study, results, width());
    if study.tools().is_empty() {
        show(tables)
    } else {
        show(format_args!("{}\n{tables}", tools_table(study, width())))
    }
}
