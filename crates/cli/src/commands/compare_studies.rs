//! `bristle compare-studies`.

use std::fs;
use std::path::{Path, PathBuf};

use bristle::simulation::Stop;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::joined::{Joined, NamedStudy, join};
use bristle_app::report::figures::is_of_study;
use bristle_app::report::page::Recorder;
use bristle_app::run::{Subject, publish};
use bristle_app::store::journal_file::JOURNAL;
use bristle_app::store::staged::prepare_directory;
use bristle_app::store::study_files::occupy_results;
use bristle_study::text::layout::note;
use bristle_study::text::number::counted;
use bristle_study::text::shown_path;
use clap::Args;

use crate::commands::study::show_tables;
use crate::error::CliError;
use crate::pictures::{FIGURES, FigureArgs, draw_study, is_picture, measured_of, say_drawn};
use crate::saved::saved_study;
use crate::terminal::{say, say_written};

/// Compare saved studies, each as a tool of its own, in one page and one set of figures
///
/// Each STUDY is a directory that `bristle study` has written to, and its name that
/// of the directory; NAME=DIR gives another. Their cases are compared at the
/// speeds, depths and other swept values that all of them have: nothing is
/// simulated, except the contacts in motion on the page, nor interpolated. A study
/// that compares tools itself has each of them as `NAME: TOOL`.
///
/// The results are those of a study with named tools: DIR/runs.csv and
/// DIR/study.json, which `bristle plot` and `bristle advise` read, DIR/report.html,
/// and DIR/figures. A table says in which settings the studies differ. Studies
/// without a common speed or depth are refused.
///
///   bristle compare-studies results/old fine=results/3 --out compared
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub struct CompareStudiesArgs {
    /// Directories with the results of studies
    #[arg(value_name = "[NAME=]STUDY", required = true)]
    studies: Vec<String>,
    /// Directory for the comparison, created if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    #[command(flatten)]
    figures: FigureArgs,
}

/// Runs the command.
pub fn run(arguments: &CompareStudiesArgs) -> Result<(), CliError> {
    let figures = arguments.figures.figures()?;
    let out = &arguments.out;
    let studies = arguments
        .studies
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
        return Err(CliError::OfAStudy(out.clone()));
    }
    let _occupied = occupy_results(out, &[(FIGURES, &is_picture(is_of_study))])?;
    if figures.are_drawn() {
        prepare_directory(&out.join(FIGURES))?;
    }
    let name = study.tool_names().join(" and ");
    let subject = Subject {
        name: &name,
        origin: &origin,
        assumptions: &Assumptions::default(),
        answer: None,
        measured: &measured,
    };
    let (files, comparisons) = publish(
        out,
        Recorder::new(&study),
        &study,
        &results,
        &subject,
        None,
        &Stop::default(),
    )?;
    let drawn = draw_study(
        out,
        &study,
        &results,
        &measured,
        &comparisons,
        None,
        &figures,
    )?;
    say(format_args!(
        "{} of {} studies",
        counted(study.case_count()),
        studies.len()
    ));
    notes.iter().for_each(|text| say(note(text)));
    files.iter().for_each(|path| say_written(path));
    show_tables(&study, &results)?;
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
