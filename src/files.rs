//! Result files that appear whole or not at all.

use std::fs;
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use bristle_codegen::exchange;
use tempfile::{Builder, NamedTempFile};
use thiserror::Error;

/// A file or directory that cannot be read or written.
#[derive(Debug, Error)]
#[error("cannot {action} `{}`: {source}", path.display())]
pub struct FileError {
    action: &'static str,
    path: PathBuf,
    source: io::Error,
}

impl FileError {
    fn new(action: &'static str, path: &Path, source: io::Error) -> Self {
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
    read_limited(path, exchange::MAX_BYTES as u64)
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
    temporary_file(path).map(drop).map_err(|error| FileError::new("write to the directory", path, error))
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
    file: BufWriter<NamedTempFile>,
    target: PathBuf,
}

impl StagedFile {
    /// Writes a file's content under a temporary name.
    pub fn write(target: PathBuf, content: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> Result<Self, FileError> {
        let target = writable_target(&target)?;
        let directory = match target.parent() {
            Some(parent) if parent != Path::new("") => parent,
            _ => Path::new("."),
        };
        let write = || {
            let mut file = BufWriter::new(temporary_file(directory)?);
            content(&mut file)?;
            file.flush()?;
            file.get_ref().as_file().sync_all()?;
            Ok(file)
        };
        match write() {
            Ok(file) => Ok(Self { file, target }),
            Err(error) => Err(FileError::new("write", &target, error)),
        }
    }

    /// Gives the file its name, in place of an older one, and returns it.
    pub fn commit(self) -> Result<PathBuf, FileError> {
        let Self { file, target } = self;
        let named = file
            .into_inner()
            .map_err(io::IntoInnerError::into_error)
            .and_then(|file| file.persist(&target).map_err(|error| error.error));
        match named {
            Ok(_) => Ok(target),
            Err(error) => Err(FileError::new("write", &target, error)),
        }
    }
}

/// A temporary file that others may read as far as the user's settings let them, once it has its name.
fn temporary_file(directory: &Path) -> io::Result<NamedTempFile> {
    let mut builder = Builder::new();
    builder.prefix(".bristle-");
    #[cfg(unix)]
    let permissions = std::os::unix::fs::PermissionsExt::from_mode(0o666);
    #[cfg(unix)]
    builder.permissions(permissions);
    builder.tempfile_in(directory)
}
