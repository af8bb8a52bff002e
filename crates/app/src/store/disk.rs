//! Locks and syncs to disk, which shared folders need not support.

use std::fs::{File, TryLockError};
use std::io::{self, ErrorKind};
use std::path::Path;

use bristle_study::text::shown_path;
use tracing::{debug, warn};

use crate::store::journal_file::JournalFileError;
use crate::store::staged::FileError;

/// Error number of a file server without locks, on macOS and Linux.
const NO_LOCKS: i32 = if cfg!(target_os = "macos") { 77 } else { 37 };

/// Returns `true` if the file system lacks the requested function, as NFS and FUSE may.
fn is_unsupported(error: &io::Error) -> bool {
    matches!(
        error.kind(),
        ErrorKind::Unsupported | ErrorKind::InvalidInput
    )
}

/// Locks a journal in a directory. The operating system releases the lock when the process ends,
/// however it ends.
///
/// # Errors
/// If another process has the lock, or the system fails.
pub(crate) fn lock(file: &File, path: &Path, directory: &Path) -> Result<(), JournalFileError> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(JournalFileError::Refused(format!(
            "another command is writing to the directory `{}`: wait until it ends, or choose another \
             directory with --out",
            shown_path(directory)
        ))),
        Err(TryLockError::Error(error))
            if is_unsupported(&error) || error.raw_os_error() == Some(NO_LOCKS) =>
        {
            warn!(path = %shown_path(path), "this file system has no locks: a second command would go unnoticed");
            Ok(())
        }
        Err(TryLockError::Error(error)) => Err(FileError::new("lock", path, error).into()),
    }
}

/// Returns the outcome of a sync to disk. A file system without syncs writes at its own pace.
///
/// # Errors
/// If the disk failed.
pub(crate) fn synced(outcome: io::Result<()>) -> io::Result<()> {
    outcome.or_else(|error| {
        if is_unsupported(&error) {
            debug!(%error, "this file system does not sync");
            return Ok(());
        }
        Err(error)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg_attr(
        not(target_os = "linux"),
        ignore = "the numbers of errors are those of Linux"
    )]
    #[test]
    fn only_what_is_not_supported_is_passed_over() {
        // EINVAL and EOPNOTSUPP of Linux, and EIO.
        for (number, passes) in [(22, true), (95, true), (5, false)] {
            let error = Err(io::Error::from_raw_os_error(number));
            assert_eq!(synced(error).is_ok(), passes, "{number}");
        }
    }
}
