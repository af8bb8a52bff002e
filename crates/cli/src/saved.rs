//! Reads saved results from the directory to which a command has written them.

use std::path::Path;

use bristle::model::settings::Settings;
use bristle::simulation::{ProfileCell, Sample, Shape};
use bristle_app::report::drawing::format::Format;
use bristle_app::report::figures::{Brush, Picture, contact_figures};
use bristle_app::run::brush::{BRUSH, CONTACTS, FILAMENTS};
use bristle_app::run::contact::{CASE, HISTORY, METRICS, PROFILE, SHAPES};
use bristle_app::store::staged::{FileError, read_results};
use bristle_app::store::study_files::{RUNS, STUDY};
use bristle_app::store::vtk_files::{is_file_name, vtk_name};
use bristle_study::input::table::DataError;

use bristle_app::store::results::{
    BuildOrigin, SavedCase, SavedStudy, read_brush_history, read_case, read_contacts,
    read_filaments, read_history, read_interaction, read_profile, read_runs, read_shapes,
    read_study, read_turn_impulses,
};
use bristle_study::grid::CaseResult;
use bristle_study::text::{shortened, shown_path};

use crate::error::CliError;
use crate::terminal::say;

/// Returns the study in a directory, with its results; `None` if there is no study.
pub fn saved_study(directory: &Path) -> Result<Option<(SavedStudy, Vec<CaseResult>)>, CliError> {
    let Some((text, name)) = read_if_there(directory, STUDY)? else {
        return Ok(None);
    };
    let saved = read_study(&text, &name)?;
    if saved.is_shard() {
        return Err(CliError::Shard(directory.to_owned()));
    }
    let (text, name) = read(directory, RUNS)?;
    let results = read_runs(&text, &name, &saved)?;
    if saved.origin != BuildOrigin::here() {
        let version = shortened(&saved.origin.version);
        say(format_args!(
            "note: `{}` was simulated by another build of Bristle, version {version}",
            shown_path(&directory.join(RUNS))
        ));
    }
    Ok(Some((saved, results)))
}

/// Returns the study whose shard is in a directory; `None` if the directory has no shard.
pub fn saved_shard(directory: &Path) -> Result<Option<SavedStudy>, CliError> {
    let Some((text, name)) = read_if_there(directory, STUDY)? else {
        return Ok(None);
    };
    Ok(Some(read_study(&text, &name)?).filter(SavedStudy::is_shard))
}

/// Data of one contact for its figures.
pub struct Contact {
    pub settings: Settings,
    pub history: Vec<Sample>,
    /// Contact normal impulse of each turn in N s.
    pub impulses: Vec<f64>,
    pub profile: Vec<ProfileCell>,
    /// Shapes for the figures.
    pub shapes: Vec<Shape>,
}

impl Contact {
    /// Returns the figures of the contact.
    pub fn pictures(&self, format: &Format) -> Vec<Picture> {
        contact_figures(
            &self.settings,
            &self.history,
            &self.impulses,
            &self.profile,
            &self.shapes,
            format,
        )
    }
}

/// Returns the contact in a directory; `None` if there is none.
pub fn saved_case(directory: &Path) -> Result<Option<Contact>, CliError> {
    let Some((text, name)) = read_if_there(directory, CASE)? else {
        return Ok(None);
    };
    let case = read_case(&text, &name)?;
    let history = table(directory, &case, HISTORY, read_history)?;
    let profile = table(directory, &case, PROFILE, read_profile)?;
    let shapes = table(directory, &case, SHAPES, read_shapes)?;
    let impulses = table(directory, &case, METRICS, read_turn_impulses)?;
    // The other files are not needed, but must not come from another run.
    let is_ours = |file: &&str| vtk_name(file).is_some_and(is_file_name);
    for file in case
        .files()
        .filter(is_ours)
        .filter(|file| directory.join(file).exists())
    {
        let (text, name) = read(directory, file)?;
        case.check(file, &text, &name)?;
    }
    Ok(Some(Contact {
        settings: case.settings,
        history,
        impulses,
        profile,
        shapes,
    }))
}

/// Returns the brush in a directory; `None` if there is none.
pub fn saved_brush(directory: &Path) -> Result<Option<Brush>, CliError> {
    let Some((text, name)) = read_if_there(directory, BRUSH)? else {
        return Ok(None);
    };
    let case = read_case(&text, &name)?;
    Ok(Some(Brush {
        interaction: table(directory, &case, METRICS, read_interaction)?,
        filaments: table(directory, &case, FILAMENTS, read_filaments)?,
        history: table(directory, &case, HISTORY, read_brush_history)?,
        pairs: table(directory, &case, CONTACTS, read_contacts)?,
        settings: case.settings,
    }))
}

/// Reads the content of a `file` of a contact, or of a brush.
fn table<T>(
    directory: &Path,
    case: &SavedCase,
    file: &str,
    parse: impl Fn(&str, &str) -> Result<T, DataError>,
) -> Result<T, CliError> {
    let (text, name) = read(directory, file)?;
    let rows = parse(&text, &name)?;
    // Checked after all else that can state where the text is wrong.
    case.check(file, &text, &name)?;
    Ok(rows)
}

/// Returns the result of [`read`] if the file exists.
fn read_if_there(directory: &Path, name: &str) -> Result<Option<(String, String)>, FileError> {
    directory
        .join(name)
        .exists()
        .then(|| read(directory, name))
        .transpose()
}

/// Returns the text of a file, and its name for error messages.
fn read(directory: &Path, name: &str) -> Result<(String, String), FileError> {
    let path = directory.join(name);
    Ok((read_results(&path)?, path.to_string_lossy().into_owned()))
}
