//! The filament of one pass as files for ParaView: `DIR/vtk/`.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use bristle::model::settings::Settings;
use bristle::simulation::Shape;
use bristle_report::vtk::{file_names, files, is_file_name};
use bristle_study::digest::digest;
use bristle_study::results::FileHashes;

use crate::files::{FileError, StagedFile, remove};

/// Subdirectory of the results for the files.
pub const VTK: &str = "vtk";

/// The path of a file relative to the directory of the results, as `case.json` states it.
fn vtk_path(name: &str) -> String {
    format!("{VTK}/{name}")
}

/// The name of the file at such a path; `None` if it is not in this subdirectory.
pub fn vtk_name(path: &str) -> Option<&str> {
    path.strip_prefix(VTK)?.strip_prefix('/')
}

/// Writes the shapes below `directory` under temporary names, the collection last, and adds their `hashes`. Writes nothing if
/// there are no shapes.
pub fn stage_vtk(
    directory: &Path,
    settings: &Settings,
    shapes: &[Shape],
    hashes: &mut FileHashes,
) -> Result<Vec<StagedFile>, FileError> {
    if shapes.is_empty() {
        return Ok(Vec::new());
    }
    let directory = directory.join(VTK);
    let stage = |(name, text): (String, String)| {
        hashes.insert(vtk_path(&name), digest(text.as_bytes()));
        StagedFile::text(&directory, &name, &text)
    };
    files(settings, shapes).map(stage).collect()
}

/// Gives the files of `shapes` shapes their final names. Returns the path of the collection if there is one.
///
/// Removes other files of an earlier run, which would be mistaken for those of this run.
pub fn commit_vtk(directory: &Path, staged: Vec<StagedFile>, shapes: usize) -> Result<Option<PathBuf>, FileError> {
    let collection = staged.into_iter().try_fold(None, |_, file| file.commit().map(Some))?;
    let directory = directory.join(VTK);
    let own: BTreeSet<String> = if shapes == 0 { BTreeSet::new() } else { file_names(shapes).collect() };
    // If there is no directory, there is nothing to remove.
    let entries = fs::read_dir(&directory).into_iter().flatten().flatten();
    let names = entries.filter_map(|entry| entry.file_name().into_string().ok());
    for name in names.filter(|name| is_file_name(name) && !own.contains(name)) {
        remove(&directory.join(name))?;
    }
    Ok(collection)
}
