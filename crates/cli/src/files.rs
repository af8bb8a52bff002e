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

/// A longer input file is taken for a mistake.
const MAX_INPUT_BYTES: u64 = 64 << 20;

/// A longer result file is not one of ours: a study has a million cases at most, and a row some 300 bytes.
const MAX_RESULT_BYTES: u64 = 1 << 30;

/// Reads a text file.
pub fn read_text(path: &Path) -> Result<String, FileError> {
    read_limited(path, MAX_INPUT_BYTES)
}

/// Reads a result file, which is as large as a study.
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

/// Makes a directory where there is none, and makes sure that the files `names` can be made in it.
pub fn prepare_directory(path: &Path, names: &[&str]) -> Result<(), FileError> {
    for name in names {
        writable_target(&path.join(name))?;
    }
    fs::create_dir_all(path).map_err(|error| FileError::new("make the directory", path, error))?;
    let any = OsStr::new(names.first().copied().unwrap_or_default());
    temporary_file(path, any).map(drop).map_err(|error| FileError::new("write to the directory", path, error))
}

/// Removes what a process that was killed has left of the files `names`, which no other process may be writing.
pub fn remove_leftovers(path: &Path, names: &[&str]) {
    remove_leftovers_of(path, |name| names.contains(&name));
}

/// Removes what a process that was killed has left of the files whose names are `ours`.
pub fn remove_leftovers_of(path: &Path, ours: impl Fn(&str) -> bool) {
    // What cannot be seen or removed does no harm.
    let Ok(entries) = fs::read_dir(path) else { return };
    for entry in entries.flatten() {
        let file = entry.file_name();
        let is_leftover = file.to_str().and_then(final_name).is_some_and(&ours);
        if is_leftover && fs::remove_file(entry.path()).is_ok() {
            debug!(path = %entry.path().display(), "removed what a killed process has left");
        }
    }
}

/// The name that a temporary file was to get.
fn final_name(temporary: &str) -> Option<&str> {
    Some(temporary.strip_prefix('.')?.split_once(SUFFIX)?.0)
}

/// Removes a file of earlier results, if there is one, that would be taken for one of the new results.
pub fn remove(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(FileError::new("remove", path, error)),
        _ => Ok(()),
    }
}

/// The file that a target stands for, behind links; an error if that exists and is no regular file.
fn writable_target(target: &Path) -> Result<PathBuf, FileError> {
    match fs::metadata(target) {
        Ok(metadata) if !metadata.is_file() => {
            Err(FileError::new("write", target, io::Error::other("it exists and is no regular file")))
        }
        Ok(_) => fs::canonicalize(target).map_err(|error| FileError::new("write", target, error)),
        Err(_) => Ok(target.to_owned()),
    }
}

/// A file under a temporary name beside its target, which [`StagedFile::commit`] gives its own name.
///
/// Dropped before, it leaves nothing behind, and the target as it was.
#[derive(Debug)]
pub struct StagedFile {
    /// Closed, so that there can be more of them than a process may have open.
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
            // Into the file itself: an error is to name the target, not what it is called for now.
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

    /// A file of a directory with this text, under a temporary name.
    pub fn text(directory: &Path, name: &str, text: &str) -> Result<Self, FileError> {
        Self::write(directory.join(name), |out| out.write_all(text.as_bytes()))
    }

    /// Gives the file its name, in place of an older one, and returns it.
    pub fn commit(self) -> Result<PathBuf, FileError> {
        let Self { file, target } = self;
        match file.persist(&target) {
            Ok(()) => Ok(target),
            Err(error) => Err(FileError::new("write", &target, error.error)),
        }
    }
}

/// What stands between a file's name and the digits that make it a temporary one.
const SUFFIX: &str = ".bristle-";

/// How the temporary names of a file begin.
fn temporary_prefix(name: &OsStr) -> OsString {
    let mut prefix = OsString::from(".");
    prefix.push(name);
    prefix.push(SUFFIX);
    prefix
}

/// A temporary file that others may read as far as the user's settings let them, once it has its name.
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

/// A path that a file states, which is relative to the file's directory.
pub fn beside(file: &Path, path: &str) -> PathBuf {
    file.parent().unwrap_or(Path::new("")).join(path)
}
