//! Results of an earlier command, which are kept when others replace them in a directory.

use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use crate::store::staged::FileError;

/// Name of the subdirectory; further ones have a number.
const PREVIOUS: &str = "previous";

/// A subdirectory for replaced results, created when the first file is kept.
#[derive(Debug)]
pub struct Previous {
    directory: PathBuf,
    place: Option<PathBuf>,
}

impl Previous {
    /// Returns the subdirectory of a directory of results.
    #[must_use]
    pub fn of(directory: &Path) -> Self {
        Self {
            directory: directory.to_owned(),
            place: None,
        }
    }

    /// Moves a file, or a directory of files, there. A missing file is left out.
    ///
    /// # Errors
    /// If it cannot be moved.
    pub fn keep(&mut self, name: &str) -> Result<(), FileError> {
        let path = self.directory.join(name);
        if fs::symlink_metadata(&path).is_err() {
            return Ok(());
        }
        let place = self.place()?.join(name);
        fs::rename(&path, &place).map_err(|error| FileError::new("move", &path, error))
    }

    /// Returns the place of kept files; `None` if there are none.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        self.place.as_deref()
    }

    /// Returns the subdirectory, with the first free name.
    fn place(&mut self) -> Result<&Path, FileError> {
        if self.place.is_none() {
            for number in 1.. {
                let place = self.directory.join(match number {
                    1 => PREVIOUS.to_owned(),
                    _ => format!("{PREVIOUS}-{number}"),
                });
                match fs::create_dir(&place) {
                    Ok(()) => {
                        self.place = Some(place);
                        break;
                    }
                    Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                    Err(error) => return Err(FileError::new("create", &place, error)),
                }
            }
        }
        Ok(self.place.as_deref().expect("it has been made"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_are_kept_side_by_side() {
        let directory = tempfile::tempdir().expect("a directory");
        let write = |name: &str| fs::write(directory.path().join(name), name).expect("a disk");
        for place in ["previous", "previous-2"] {
            write("runs.csv");
            let mut previous = Previous::of(directory.path());
            previous.keep("study.json").expect("nothing to move");
            assert_eq!(previous.path(), None);
            previous.keep("runs.csv").expect("a disk");
            let place = directory.path().join(place);
            assert_eq!(previous.path(), Some(place.as_path()));
            assert!(place.join("runs.csv").exists() && !directory.path().join("runs.csv").exists());
        }
    }
}
