//! The filament of one pass as files for ParaView: `DIR/vtk/`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use bristle::model::settings::Settings;
use bristle::simulation::Shape;
use bristle_report::vtk::{file_names, files, is_file_name};

use crate::files::{FileError, StagedFile, prepare_directory, remove, remove_leftovers_of};

/// Subdirectory of the results for the files.
const VTK: &str = "vtk";

/// Checks that the files for `shapes` shapes can be written below `directory`.
pub fn prepare_vtk(directory: &Path, shapes: usize) -> Result<(), FileError> {
    let names: Vec<String> = file_names(shapes).collect();
    prepare_directory(&directory.join(VTK), &names.iter().map(String::as_str).collect::<Vec<_>>())
}

/// Writes the shapes below `directory` under temporary names, the collection last. Writes nothing if there are no shapes.
pub fn stage_vtk(directory: &Path, settings: &Settings, shapes: &[Shape]) -> Result<Vec<StagedFile>, FileError> {
    if shapes.is_empty() {
        return Ok(Vec::new());
    }
    let directory = directory.join(VTK);
    let stage =
        |(name, text): (String, String)| StagedFile::write(directory.join(name), |out| out.write_all(text.as_bytes()));
    files(settings, shapes).map(stage).collect()
}

/// Gives the files of `shapes` shapes their final names. Returns the path of the collection if there is one.
///
/// Removes other files of an earlier run, which would be mistaken for those of this run, and leftovers of a killed run.
pub fn commit_vtk(directory: &Path, staged: Vec<StagedFile>, shapes: usize) -> Result<Option<PathBuf>, FileError> {
    let collection = staged.into_iter().try_fold(None, |_, file| file.commit().map(Some))?;
    let directory = directory.join(VTK);
    remove_leftovers_of(&directory, is_file_name);
    let own: BTreeSet<String> = if shapes == 0 { BTreeSet::new() } else { file_names(shapes).collect() };
    // If there is no directory, there is nothing to remove.
    let entries = fs::read_dir(&directory).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    for name in names.filter(|name| is_file_name(name) && !own.contains(name)) {
        remove(&directory.join(name))?;
    }
    Ok(collection)
}
