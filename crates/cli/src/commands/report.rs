//! `bristle report`.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use bristle::simulation::Stop;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::judge_study;
use bristle_app::insight::joined::{Joined, NamedStudy, join};
use bristle_app::report::figures::is_of_study;
use bristle_app::report::page::{ReportContext, course_recorder};
use bristle_app::run::{TakeError, publish};
use bristle_app::store::journal_file::{JOURNAL, JournalFile};
use bristle_app::store::results::SavedStudy;
use bristle_app::store::staged::prepare_directory;
use bristle_app::store::study_files::occupy_results;
use bristle_study::input::statement::Statement;
use bristle_study::text::layout::note;
use bristle_study::text::number::counted;
use bristle_study::text::shown_path;
use clap::Args;

use super::study::{Conclusion, TableArgs, open, show_tables};
use crate::error::CliError;
use crate::pictures::{
    FIGURES, FigureArgs, Figures, draw_saved, draw_study, is_picture, measured_of, say_drawn,
};
use crate::saved::{saved_shard, saved_study};
use crate::terminal::{say, say_written};
use crate::values::ResourceArgs;

/// Draw saved results again, make one study of its shards, or compare studies
///
/// One DIR that `bristle study` or `bristle simulate` has written to: its figures
/// are drawn again, with the same bytes, or with other --figures.
///
/// Directories of shards, made by `bristle study --shard I/N`: DIR has the results
/// of the whole study, the same to the bit as without shards. If cases are missing,
/// they are not simulated: the message says how many.
///
/// Several studies: DIR has a study that compares them as named tools, at the
/// speeds, depths and other swept values that all of them have. Nothing is
/// simulated, except the contacts in motion on the page, nor interpolated. The name
/// of each is that of its directory; NAME=DIR gives another. A table says in which
/// settings the studies differ.
///
///   bristle report results --figures all,pdf
///   bristle report shards/1 shards/2 shards/3 --out results
///   bristle report results/old fine=results/3 --out compared
#[derive(Args)]
#[command(verbatim_doc_comment)]
#[command(allow_negative_numbers = true)]
pub struct ReportArgs {
    /// Directories with results
    #[arg(value_name = "[NAME=]DIR", required = true)]
    results: Vec<String>,
    /// Directory for what is made, created if it does not exist [default: that of the results, if
    /// it is one]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    figures: FigureArgs,
    #[command(flatten)]
    resources: ResourceArgs,
    #[command(flatten)]
    tables: TableArgs,
    /// Print progress and summary to stdout as JSON objects, instead of tables
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &ReportArgs) -> Result<ExitCode, CliError> {
    let figures = arguments.figures.figures()?;
    let shards = arguments
        .results
        .iter()
        .filter_map(|text| saved_shard(Path::new(text)).transpose())
        .collect::<Result<Vec<_>, _>>()?;
    match (&arguments.results[..], &arguments.out) {
        (results, Some(out)) if shards.len() == results.len() => {
            merge(arguments, &shards, out, &figures)
        }
        ([only], out) if shards.is_empty() => {
            let saved = Path::new(only);
            draw_saved(saved, out.as_deref().unwrap_or(saved), &figures)?;
            Ok(ExitCode::SUCCESS)
        }
        (_, None) => Err(CliError::NoOut),
        (_, Some(_)) if !shards.is_empty() => Err(CliError::NotAllShards),
        (_, Some(out)) => compare(arguments, out, &figures).map(|()| ExitCode::SUCCESS),
    }
}

/// Makes one study of its shards.
fn merge(
    arguments: &ReportArgs,
    shards: &[SavedStudy],
    out: &Path,
    figures: &Figures,
) -> Result<ExitCode, CliError> {
    let directories = || arguments.results.iter().map(Path::new);
    let first = &shards[0];
    for (shard, directory) in shards.iter().zip(directories()) {
        if !shard.study.has_cases_of(&first.study) {
            return Err(CliError::OtherShard(directory.to_owned()));
        }
    }
    let measured = measured_of(Path::new(&arguments.results[0]), first)?;
    let mut run = open(first.study.clone(), out, false)?;
    for directory in directories() {
        run.take_all(|take| JournalFile::read(directory, take))
            .map_err(|error| match error {
                TakeError::Journal(error) => CliError::from(error),
                TakeError::Run(error) => error.into(),
            })?;
    }
    run.settle()?;
    let ((done, _), total) = (run.counts(), run.study().case_count());
    if done < total {
        return Err(CliError::Incomplete {
            path: out.join(JOURNAL),
            missing: total - done,
            total,
        });
    }
    Conclusion {
        out,
        statement: &first.statement,
        measured: &measured,
        figures,
        resources: arguments.resources.resources(),
        json: arguments.json,
        tables: &arguments.tables,
        ignored: &[],
    }
    .conclude(run)
}

/// Compares studies as named tools of one.
fn compare(arguments: &ReportArgs, out: &Path, figures: &Figures) -> Result<(), CliError> {
    let studies = arguments
        .results
        .iter()
        .map(|text| named_study(text, out))
        .collect::<Result<Vec<_>, _>>()?;
    let Joined {
        study,
        results,
        measured,
        notes,
        origin,
    } = join(&studies).map_err(Box::new)?;
    if out.join(JOURNAL).exists() {
        return Err(CliError::OfAStudy(out.to_owned()));
    }
    let _occupied = occupy_results(out, &[(FIGURES, &is_picture(is_of_study))])?;
    if figures.are_drawn() {
        prepare_directory(&out.join(FIGURES))?;
    }
    let statement = Statement {
        title: study.tool_names().join(" and "),
        ..Statement::default()
    };
    let context = ReportContext {
        statement: &statement,
        origin: &origin,
        assumptions: &Assumptions::default(),
        answer: None,
        measured: &measured,
        findings: &judge_study(&study, &results),
    };
    let threads = arguments.resources.resources().threads;
    let (files, comparisons) = publish(
        out,
        course_recorder(&study),
        &study,
        &results,
        &context,
        threads,
        &Stop::default(),
    )?;
    let drawn = draw_study(
        out,
        &study,
        &results,
        &measured,
        &comparisons,
        threads,
        figures,
    )?;
    say(format_args!(
        "{} of {} studies",
        counted(study.case_count()),
        studies.len()
    ));
    notes.iter().for_each(|text| say(note(text)));
    files.iter().for_each(|path| say_written(path));
    if !arguments.json {
        show_tables(&study, &results, &arguments.tables, &statement)?;
    }
    Ok(say_drawn(&drawn, &comparisons)?)
}

/// The study of an argument, which is not in the directory `out` of the comparison.
fn named_study(text: &str, out: &Path) -> Result<NamedStudy, CliError> {
    // A directory may have an equals sign in its name.
    let given = text.split_once('=').filter(|_| !Path::new(text).exists());
    let path = given.map_or(text, |(_, path)| path);
    let directory = Path::new(path);
    let whole = fs::canonicalize(directory).ok();
    if whole.is_some() && whole == fs::canonicalize(out).ok() {
        return Err(CliError::OfAStudy(out.to_owned()));
    }
    let (saved, results) =
        saved_study(directory)?.ok_or_else(|| CliError::NoStudy(directory.to_owned()))?;
    let measured = measured_of(directory, &saved)?;
    let of_directory = || {
        let last = whole.as_deref().and_then(Path::file_name);
        last.map_or_else(
            || shown_path(directory),
            |name| name.to_string_lossy().into_owned(),
        )
    };
    let name = given.map_or_else(of_directory, |(name, _)| name.to_owned());
    Ok(NamedStudy {
        name,
        saved,
        results,
        measured,
    })
}
