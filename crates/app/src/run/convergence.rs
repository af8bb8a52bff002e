//! The files of a convergence.

use std::path::{Path, PathBuf};

use crate::insight::convergence::{Convergence, write_convergence as write_table};
use crate::store::staged::{FileError, StagedFile};

/// One row per value of each setting.
pub const CONVERGENCE_TABLE: &str = "converge.csv";
/// Version, settings, and the metrics with their limits and errors.
pub const CONVERGENCE: &str = "converge.json";
/// All files that a convergence writes.
pub const OF_CONVERGENCE: [&str; 2] = [CONVERGENCE_TABLE, CONVERGENCE];

/// Writes the files of a convergence to its directory, which must be occupied, and returns their
/// paths.
///
/// # Errors
/// If a file cannot be written.
pub fn write_convergence(
    directory: &Path,
    convergence: &Convergence,
) -> Result<Vec<PathBuf>, FileError> {
    let staged = [
        StagedFile::write(directory.join(CONVERGENCE_TABLE), |out| {
            write_table(out, convergence)
        })?,
        StagedFile::text(directory, CONVERGENCE, &convergence.json())?,
    ];
    staged.into_iter().map(StagedFile::commit).collect()
}
