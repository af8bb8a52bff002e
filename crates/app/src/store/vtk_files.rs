//! Filaments as files for ParaView: `DIR/vtk/`.

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::fs;
use std::path::{Path, PathBuf};

use crate::store::digest::digest;
use crate::store::results::FileHashes;
use crate::store::staged::{FileError, StagedFile, remove};

/// Subdirectory of the results for the files.
pub const VTK: &str = "vtk";

/// The largest number of shapes in a pass: their numbers in file names have four digits.
pub const MAX_SHAPES: usize = 10_000;

/// List of the files of a contact.
pub const COLLECTION: &str = "contact.pvd";
/// List of the files of a brush.
pub const BRUSH_COLLECTION: &str = "brush.pvd";
/// The workpiece.
pub const WORKPIECE: &str = "workpiece.vtp";

/// Returns `true` if a file of this name may belong to a run with any number of shapes or frames.
#[must_use]
pub fn is_file_name(name: &str) -> bool {
    let is_numbered = |beginning: &str| {
        let number = name
            .strip_prefix(beginning)
            .and_then(|name| name.strip_suffix(".vtp"));
        number.is_some_and(|number| {
            number.len() == 4 && number.bytes().all(|digit| digit.is_ascii_digit())
        })
    };
    is_numbered("filament_")
        || is_numbered("brush_")
        || [WORKPIECE, COLLECTION, BRUSH_COLLECTION].contains(&name)
}

/// Returns the name of the file at a path relative to the directory of the results, as `case.json`
/// states it; `None` if the file is not in this subdirectory.
#[must_use]
pub fn vtk_name(path: &str) -> Option<&str> {
    path.strip_prefix(VTK)?.strip_prefix('/')
}

/// Writes `files`, names with texts, below `directory` under temporary names, and adds their
/// `hashes`.
pub(crate) fn stage_vtk(
    directory: &Path,
    files: impl Iterator<Item = (String, String)>,
    hashes: &mut FileHashes,
) -> Result<Vec<StagedFile>, FileError> {
    let directory = directory.join(VTK);
    let stage = |(name, text): (String, String)| {
        hashes.insert(format!("{VTK}/{name}"), digest(text.as_bytes()));
        StagedFile::text(&directory, &name, &text)
    };
    files.map(stage).collect()
}

/// Gives the files their final names. Returns the path of the last, which is the collection, if
/// there is one.
///
/// Removes other files of an earlier run: they would be mistaken for those of this run.
pub(crate) fn commit_vtk(
    directory: &Path,
    staged: Vec<StagedFile>,
) -> Result<Option<PathBuf>, FileError> {
    let written = staged
        .into_iter()
        .map(StagedFile::commit)
        .collect::<Result<Vec<PathBuf>, FileError>>()?;
    let directory = directory.join(VTK);
    let own: BTreeSet<&OsStr> = written.iter().filter_map(|path| path.file_name()).collect();
    // A missing directory has nothing to remove.
    let entries = fs::read_dir(&directory).into_iter().flatten().flatten();
    for name in entries.map(|entry| entry.file_name()) {
        if name.to_str().is_some_and(is_file_name) && !own.contains(name.as_os_str()) {
            remove(&directory.join(name))?;
        }
    }
    Ok(written.into_iter().next_back())
}
