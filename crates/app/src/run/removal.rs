//! The files of a removal.

use std::path::{Path, PathBuf};

use crate::report::page::removal_page;
use crate::store::results::{write_edge_work, write_removal_rows};
use crate::store::staged::{FileError, StagedFile};
use bristle::model::settings::Settings;
use bristle_study::grid::removal::Removal;

/// The edge and the brush over time.
pub const REMOVAL: &str = "removal.csv";
/// The passes that were simulated.
pub const EDGE_WORK: &str = "edge_work.csv";
/// The page.
pub const REMOVAL_PAGE: &str = "removal.html";
/// All files that a removal writes.
pub const OF_REMOVAL: [&str; 3] = [REMOVAL, EDGE_WORK, REMOVAL_PAGE];

/// Writes the files of a removal to its directory, which must be occupied, and returns their paths.
/// `name` is that of the input file.
///
/// # Errors
/// If a file cannot be written.
pub fn write_removal(
    directory: &Path,
    name: &str,
    settings: &Settings,
    removal: &Removal,
) -> Result<Vec<PathBuf>, FileError> {
    let staged = [
        StagedFile::write(directory.join(REMOVAL), |out| {
            write_removal_rows(out, removal)
        })?,
        StagedFile::write(directory.join(EDGE_WORK), |out| {
            write_edge_work(out, removal)
        })?,
        StagedFile::text(
            directory,
            REMOVAL_PAGE,
            &removal_page(name, settings, removal),
        )?,
    ];
    staged.into_iter().map(StagedFile::commit).collect()
}
