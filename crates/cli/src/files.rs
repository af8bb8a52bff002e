//! Result files that appear whole or not at all.

use std::ffi::{OsStr, OsString};
use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use bristle_inspect::comparison::MAX_GRAPH_BYTES;
use tempfile::{Builder, NamedTempFile, TempPath};
use thiserror::Error;
use tracing::debug;

/// A file or directory that cannot be read or written.
#[derive(Debug, Error)]
#[error("cannot {action} `{}`: {source}", path.display())]
pub struct FileError {
    action: &'static str,
    path: PathBuf,
    source: io::Error,
}

impl FileError {
    pub fn new(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self { action, path: path.to_owned(), source }
    }
}

/// A longer input file is regarded as a mistake.
const MAX_INPUT_BYTES: u64 = 64 << 20;

/// A longer result file cannot be one of ours: a study has at most a million cases, and a row has some 300 bytes.
const MAX_RESULT_BYTES: u64 = 1 << 30;

/// Reads a text file.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    read_limited(path, MAX_INPUT_BYTES)
}

/// Reads a result file, whose size grows with the study.
pub fn read_results(path: &Path) -> Result<String, FileError> {
    read_limited(path, MAX_RESULT_BYTES)
}

/// Reads the file of an expression graph, which can be larger than input written by hand.
pub fn read_graph(path: &Path) -> Result<String, FileError> {
    read_limited(path, MAX_GRAPH_BYTES as u64)
}

fn read_limited(path: &Path, limit: u64) -> Result<String, FileError> {
    let read = || {
        let mut bytes = Vec::new();
        fs::File::open(path)?.take(limit + 1).read_to_end(&mut bytes)?;
        if bytes.len() as u64 > limit {
            return Err(io::Error::other(format!("it is longer than {} MiB", limit >> 20)));
        }
        String::from_utf8(bytes).map_err(|error| {
            let valid = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..valid].iter().filter(|&&byte| byte == b'\n').count() + 1;
            io::Error::other(format!("line {line} is not UTF-8 text"))
        })
    };
    read().map_err(|error| FileError::new("read", path, error))
}

/// Creates a directory if it does not exist, and checks that the files `names` can be created in it.
pub fn prepare_directory(path: &Path, names: &[&str]) -> Result<(), FileError> {
    for name in names {
        writable_target(&path.join(name))?;
    }
    fs::create_dir_all(path).map_err(|error| FileError::new("create the directory", path, error))?;
    let any = OsStr::new(names.first().copied().unwrap_or_default());
    temporary_file(path, any).map(drop).map_err(|error| FileError::new("write to the directory", path, error))
}

/// Removes temporary files of `names` that a killed process left behind. No other process may be writing these files.
pub fn remove_leftovers(path: &Path, names: &[&str]) {
    remove_leftovers_of(path, |name| names.contains(&name));
}

/// Removes temporary files that a killed process left behind, of those files whose names are `ours`.
pub fn remove_leftovers_of(path: &Path, ours: impl Fn(&str) -> bool) {
    // A leftover that cannot be seen or removed does no harm.
    let Ok(entries) = fs::read_dir(path) else { return };
    for entry in entries.flatten() {
        let file = entry.file_name();
        let is_leftover = file.to_str().and_then(final_name).is_some_and(&ours);
        if is_leftover && fs::remove_file(entry.path()).is_ok() {
            debug!(path = %entry.path().display(), "removed a temporary file of a killed process");
        }
    }
}

/// The final name that a temporary file was meant to get.
fn final_name(temporary: &str) -> Option<&str> {
    Some(temporary.strip_prefix('.')?.split_once(SUFFIX)?.0)
}

/// Removes a file of earlier results, if it exists, as it would be mistaken for a new one.
pub fn remove(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(FileError::new("remove", path, error)),
        _ => Ok(()),
    }
}

/// The file that a target refers to after following links. An error if it exists and is not a regular file.
fn writable_target(target: &Path) -> Result<PathBuf, FileError> {
    match fs::metadata(target) {
        Ok(metadata) if !metadata.is_file() => {
            Err(FileError::new("write", target, io::Error::other("it exists and is not a regular file")))
        }
        Ok(_) => fs::canonicalize(target).map_err(|error| FileError::new("write", target, error)),
        Err(_) => Ok(target.to_owned()),
    }
}

/// A file under a temporary name in the directory of its target, until [`StagedFile::commit`] renames it.
///
/// If it is dropped before that, it is deleted and the target stays as it was.
#[derive(Debug)]
pub struct StagedFile {
    /// Closed, so that more of them can exist than a process may have open.
    file: TempPath,
    target: PathBuf,
}

impl StagedFile {
    /// Writes a file's content under a temporary name.
    pub fn write(
        target: PathBuf,
        content: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<Self, FileError> {
        let target = writable_target(&target)?;
        let directory = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let write = || {
            let file = temporary_file(directory, target.file_name().unwrap_or_default())?;
            // Written to the file itself, so that an error names the target and not its temporary name.
            let mut writer = BufWriter::new(file.as_file());
            content(&mut writer)?;
            writer.flush()?;
            drop(writer);
            file.as_file().sync_all()?;
            Ok(file.into_temp_path())
        };
        match write() {
            Ok(file) => Ok(Self { file, target }),
            Err(error) => Err(FileError::new("write", &target, error)),
        }
    }

    /// Writes a text under a temporary name, for the file `name` in a directory.
    pub fn text(directory: &Path, name: &str, text: &str) -> Result<Self, FileError> {
        Self::write(directory.join(name), |out| out.write_all(text.as_bytes()))
    }

    /// Gives the file its final name, replacing an older file, and returns the path.
    pub fn commit(self) -> Result<PathBuf, FileError> {
        let Self { file, target } = self;
        match file.persist(&target) {
            Ok(()) => Ok(target),
            Err(error) => Err(FileError::new("write", &target, error.error)),
        }
    }
}

/// Separates the name of a file from the random characters of its temporary name.
const SUFFIX: &str = ".bristle-";

/// The start of all temporary names of a file.
fn temporary_prefix(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(SUFFIX);
    prefix
}

/// A temporary file with the permissions that the user's settings give to new files, which it keeps under its final name.
fn temporary_file(directory: &Path, name: &OsStr) -> io::Result<NamedTempFile> {
    let prefix = temporary_prefix(name);
    let mut builder = Builder::new();
    builder.prefix(&prefix);
    #[cfg(unix)]
    let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(permissions);
    builder.tempfile_in(directory)
}

/// Resolves a path that a file states, relative to the directory of that file.
pub fn relative_to(file: &Path, path: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}
