//! Input files that are read with limits, and result files that appear whole or not at all.

use std::ffi::{OsStr, OsString};
use std::fs::{self, DirEntry, File};
use std::io::{self, BufWriter, Read, Write};
use std::path::{Path, PathBuf};

use crate::store::digest::digest;
use crate::store::disk::synced;
use bristle_study::input::control_points::read_control_points;
use bristle_study::input::document::Document;
use bristle_study::input::input_error::InputError;
use bristle_study::input::table::DataError;

use crate::store::results::FileHashes;
use bristle_study::text::{shown, shown_path};
use tempfile::{Builder, NamedTempFile, TempPath};
use thiserror::Error;
use tracing::debug;

/// Maximum length of the reason for a file error, in characters. The reason may repeat the path.
const MAX_REASON_CHARS: usize = 200;

/// A file or directory that cannot be read or written.
#[derive(Debug, Error)]
#[error("cannot {action} `{}`: {}", shown_path(path), shown(&source.to_string(), MAX_REASON_CHARS))]
pub struct FileError {
    action: &'static str,
    path: PathBuf,
    source: io::Error,
}

impl FileError {
    /// Creates the error of an `action`, such as `read`, on a path.
    pub fn new(action: &'static str, path: &Path, source: io::Error) -> Self {
        Self {
            action,
            path: path.to_owned(),
            source,
        }
    }

    /// Returns the kind of error.
    pub fn kind(&self) -> io::ErrorKind {
        self.source.kind()
    }
}

/// Reasons why an input file cannot be used.
#[derive(Debug, Error)]
pub enum DocumentError {
    /// The file, or a table that it names, cannot be read.
    #[error(transparent)]
    File(#[from] FileError),
    /// The file states something wrong.
    #[error(transparent)]
    Input(#[from] InputError),
    /// A table that the file names has something wrong.
    #[error(transparent)]
    Data(#[from] DataError),
}

/// Maximum size of a file of settings, or of a state. A longer file is regarded as a mistake; its
/// tree takes some 80 times as much memory.
const MAX_INPUT_BYTES: u64 = 4 << 20;

/// Maximum size of a table of measured forces. A longer one is regarded as a mistake: a million
/// points with four numbers each fit.
const MAX_TABLE_BYTES: u64 = 64 << 20;

/// Maximum size of a result file: a study has at most a million cases, and a row has some 300
/// bytes.
const MAX_RESULT_BYTES: u64 = 1 << 30;

/// Maximum size of the state of a brush: a filament has some 20 kB, and its frames as much.
const MAX_STATE_BYTES: u64 = 8 << 30;

/// Reads a file of settings, or of a state of the equations.
///
/// # Errors
/// If it cannot be read, is too long, or is not text.
pub fn read_input(path: &Path) -> Result<String, FileError> {
    read_as(path, MAX_INPUT_BYTES, as_text)
}

/// Reads settings from stdin.
///
/// # Errors
/// If it cannot be read, is too long, or is not text.
pub fn read_stdin() -> Result<String, FileError> {
    let path = Path::new("-");
    let bytes = read_up_to(io::stdin().lock(), MAX_INPUT_BYTES);
    bytes
        .and_then(as_text)
        .map_err(|error| FileError::new("read", path, error))
}

/// Reads the text of the input file at `path`, called `name` in errors, with `options` added.
/// Control points may come from another file.
///
/// # Errors
/// If a file cannot be read, or states something wrong.
pub fn read_document<'t>(
    path: &Path,
    text: &'t str,
    name: &'t str,
    options: &'t [String],
) -> Result<Document<'t>, DocumentError> {
    let mut document = Document::parse_with(text, name, options)?;
    if let Some(file) = document.control_points_file() {
        let file = relative_to(path, file);
        let points = read_control_points(&read_table(&file)?, &file.to_string_lossy())?;
        document.set_control_points(points);
    }
    Ok(document)
}

/// Reads a table of measured forces or control points.
///
/// # Errors
/// If it cannot be read, is too long, or is not text.
pub fn read_table(path: &Path) -> Result<String, FileError> {
    read_as(path, MAX_TABLE_BYTES, as_table)
}

/// Characters of the bytes from 0x80 to 0x9F in Windows-1252; bytes without one are themselves.
const WINDOWS_1252: &str = "€\u{81}‚ƒ„…†‡ˆ‰Š‹Œ\u{8d}Ž\u{8f}\u{90}‘’“”•–—˜™š›œ\u{9d}žŸ";

/// Returns the text of a table as spreadsheets export it: in UTF-8, in UTF-16 with a byte order
/// mark, or in Windows-1252, which contains Latin-1.
fn as_table(bytes: Vec<u8>) -> io::Result<String> {
    let utf_16 = |unit: fn([u8; 2]) -> u16| {
        let (pairs, rest) = bytes[2..].as_chunks::<2>();
        if !rest.is_empty() {
            return Err(io::Error::other(
                "it is UTF-16 text that ends within a character: save the table again",
            ));
        }
        let units: Vec<u16> = pairs.iter().map(|pair| unit(*pair)).collect();
        String::from_utf16(&units)
            .map_err(|_| io::Error::other("it begins as UTF-16 text and is not"))
    };
    match bytes.get(..2) {
        Some([0xff, 0xfe]) => return utf_16(u16::from_le_bytes),
        Some([0xfe, 0xff]) => return utf_16(u16::from_be_bytes),
        _ => {}
    }
    as_text(bytes.clone()).or_else(|error| {
        let letter = |&byte: &u8| match byte {
            0x80..0xa0 => WINDOWS_1252
                .chars()
                .nth(usize::from(byte - 0x80))
                .filter(|letter| *letter != char::from(byte)),
            byte => Some(char::from(byte)),
        };
        let text: Option<String> = bytes.iter().map(letter).collect();
        text.ok_or_else(|| {
            io::Error::other(format!(
                "{error}, nor Windows-1252: save the table as CSV in UTF-8"
            ))
        })
    })
}

/// Reads a result file, whose size grows with the study.
///
/// # Errors
/// If it cannot be read, is too long, or is not text.
pub fn read_results(path: &Path) -> Result<String, FileError> {
    read_as(path, MAX_RESULT_BYTES, as_text)
}

/// Reads a file of another kind with at most `limit` bytes.
///
/// # Errors
/// If it cannot be read, is longer, or is not text.
pub fn read_text(path: &Path, limit: usize) -> Result<String, FileError> {
    read_as(path, limit as u64, as_text)
}

/// Reads the state of a brush, whose size grows with the number of filaments.
///
/// # Errors
/// If it cannot be read, or is too long.
pub fn read_bytes(path: &Path) -> Result<Vec<u8>, FileError> {
    read_as(path, MAX_STATE_BYTES, Ok)
}

/// Reads a file of at most `limit` bytes, which `content` converts.
fn read_as<T>(
    path: &Path,
    limit: u64,
    content: fn(Vec<u8>) -> io::Result<T>,
) -> Result<T, FileError> {
    let bytes = check_source(path)
        .and_then(|()| File::open(path))
        .and_then(|file| read_up_to(file, limit));
    bytes
        .and_then(content)
        .map_err(|error| FileError::new("read", path, error))
}

fn as_text(bytes: Vec<u8>) -> io::Result<String> {
    String::from_utf8(bytes).map_err(|error| {
        let valid = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..valid]
            .iter()
            .filter(|&&byte| byte == b'\n')
            .count()
            + 1;
        io::Error::other(format!("line {line} is not UTF-8 text"))
    })
}

fn read_up_to(source: impl Read, limit: u64) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    source.take(limit + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > limit {
        return Err(io::Error::other(format!(
            "it is longer than {} MiB",
            limit >> 20
        )));
    }
    Ok(bytes)
}

/// Returns an error if a path is neither a regular file nor an input that the caller of the program
/// has opened. Reading a pipe by its name would wait for a writer, and a device may have no end.
fn check_source(path: &Path) -> io::Result<()> {
    let is_open = ["/dev/stdin", "/dev/fd", "/proc/self/fd"]
        .iter()
        .any(|open| path.starts_with(open));
    if is_open || fs::metadata(path)?.is_file() {
        Ok(())
    } else {
        Err(io::Error::other(
            "it is not a regular file; to read from a pipe, name it -",
        ))
    }
}

/// Creates a directory if it does not exist, and checks that files can be created in it.
///
/// # Errors
/// If the directory cannot be created, or no file in it.
pub fn prepare_directory(path: &Path) -> Result<(), FileError> {
    fs::create_dir_all(path)
        .map_err(|error| FileError::new("create the directory", path, error))?;
    temporary_file(path, OsStr::new(PROBE))
        .map(drop)
        .map_err(|error| FileError::new("write to the directory", path, error))
}

/// Name of the file that tests a directory.
const PROBE: &str = "probe";

/// A directory that this process writes to, until it is dropped.
#[derive(Debug)]
#[must_use]
pub struct Occupied {
    /// Shared with other processes that write there. `None` if the system cannot lock directories.
    _lock: Option<File>,
}

/// A subdirectory of the results, empty for the directory itself, and the names of the files that a
/// command writes to it.
pub type WrittenFiles<'a> = (&'a str, &'a dyn Fn(&str) -> bool);

/// Announces that this process writes to a directory, and checks that nothing is in the way of the
/// `written` files. If no other process writes there, removes temporary versions of these files
/// that a killed process has left behind.
///
/// The announcement is a lock on the directory, which the operating system releases when the
/// process ends, however it ends. Where directories cannot be locked, leftovers stay, as they may
/// belong to a running process.
///
/// # Errors
/// If anything but a regular file is in the place of a file, or a link in the place of a
/// subdirectory.
pub fn occupy(directory: &Path, written: &[WrittenFiles<'_>]) -> Result<Occupied, FileError> {
    for (subdirectory, ours) in written {
        let path = directory.join(subdirectory);
        if !subdirectory.is_empty() && path.is_symlink() {
            return Err(FileError::new(
                "write to the directory",
                &path,
                io::Error::other(LINK),
            ));
        }
        for entry in entries(&path).filter(|entry| entry.file_name().to_str().is_some_and(ours)) {
            check_target(&entry.path())?;
        }
    }
    let Ok(lock) = File::open(directory) else {
        return Ok(Occupied { _lock: None });
    };
    if lock.try_lock().is_ok() {
        for (subdirectory, ours) in written {
            remove_leftovers(&directory.join(subdirectory), |name| {
                name == PROBE || ours(name)
            });
        }
        // An error would show again when a shared lock is requested.
        let _ = lock.unlock();
    }
    let is_locked = lock.lock_shared().is_ok();
    Ok(Occupied {
        _lock: is_locked.then_some(lock),
    })
}

/// Returns the entries of a directory that can be read.
fn entries(path: &Path) -> impl Iterator<Item = DirEntry> {
    fs::read_dir(path).into_iter().flatten().flatten()
}

/// Removes the temporary versions of files whose names are `ours`. No other process may be writing
/// them.
fn remove_leftovers(path: &Path, ours: impl Fn(&str) -> bool) {
    // A leftover that cannot be read or removed does no harm.
    for entry in entries(path) {
        let file = entry.file_name();
        let is_leftover = file.to_str().and_then(final_name).is_some_and(&ours);
        if is_leftover && fs::remove_file(entry.path()).is_ok() {
            debug!(path = %shown_path(&entry.path()), "removed a temporary file of a killed process");
        }
    }
}

/// Returns the final name of a temporary file.
fn final_name(temporary: &str) -> Option<&str> {
    let (name, random) = temporary.strip_prefix('.')?.rsplit_once(SUFFIX)?;
    let is_random =
        random.len() == RANDOM_CHARS && random.bytes().all(|byte| byte.is_ascii_alphanumeric());
    is_random.then_some(name)
}

/// Removes an earlier result file, if it exists: it would be mistaken for a new one.
///
/// # Errors
/// If it exists and cannot be removed.
pub fn remove(path: &Path) -> Result<(), FileError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => {
            Err(FileError::new("remove", path, error))
        }
        _ => Ok(()),
    }
}

/// Error for a link in the place of results.
const LINK: &str =
    "it is a symbolic link, which may lead anywhere; remove it, or choose another place";

/// Returns an error if a target exists and is not a regular file. Links are not followed.
fn check_target(target: &Path) -> Result<(), FileError> {
    let problem = match fs::symlink_metadata(target) {
        Ok(metadata) if metadata.is_symlink() => LINK,
        Ok(metadata) if !metadata.is_file() => "it exists and is not a regular file",
        _ => return Ok(()),
    };
    Err(FileError::new("write", target, io::Error::other(problem)))
}

/// Returns the directory of a file.
pub fn directory_of(file: &Path) -> &Path {
    match file.parent() {
        Some(parent) if parent != Path::new("") => parent,
        _ => Path::new("."),
    }
}

/// A file under a temporary name in the directory of its target, until [`StagedFile::commit`]
/// renames it.
///
/// If it is dropped before that, it is deleted and the target stays unchanged.
#[derive(Debug)]
pub struct StagedFile {
    /// Closed, so that the number of staged files is not limited by the number of open files.
    file: TempPath,
    target: PathBuf,
}

impl StagedFile {
    /// Writes a file's content under a temporary name.
    ///
    /// # Errors
    /// If it cannot be written, or `content` fails.
    pub fn write(
        target: PathBuf,
        content: impl FnOnce(&mut (dyn Write + Send)) -> io::Result<()>,
    ) -> Result<Self, FileError> {
        check_target(&target)?;
        let write = || {
            let file = temporary_file(
                directory_of(&target),
                target.file_name().unwrap_or_default(),
            )?;
            // Written to the file itself, so that an error names the target and not its temporary
            // name.
            let mut writer = BufWriter::new(file.as_file());
            content(&mut writer)?;
            writer.flush()?;
            drop(writer);
            synced(file.as_file().sync_all())?;
            Ok(file.into_temp_path())
        };
        let file = write().map_err(|error| FileError::new("write", &target, error))?;
        Ok(Self { file, target })
    }

    /// Writes a text under a temporary name, for the file `name` in a directory.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn text(directory: &Path, name: &str, text: &str) -> Result<Self, FileError> {
        Self::write(directory.join(name), |out| out.write_all(text.as_bytes()))
    }

    /// Writes a result under a temporary name, for the file `name` in a directory, and adds its
    /// hash to `hashes`.
    ///
    /// # Errors
    /// If it cannot be written.
    pub fn hashed(
        directory: &Path,
        name: &str,
        hashes: &mut FileHashes,
        result: impl FnOnce(&mut Vec<u8>) -> io::Result<()>,
    ) -> Result<Self, FileError> {
        let mut content = Vec::new();
        result(&mut content).expect("memory takes what is written to it");
        hashes.insert(name.to_owned(), digest(&content));
        Self::write(directory.join(name), |out| out.write_all(&content))
    }

    /// Gives the file its final name unless that name is taken, and returns the path.
    ///
    /// # Errors
    /// If that is not possible; [`io::ErrorKind::AlreadyExists`] if the name is taken.
    pub fn commit_new(self) -> Result<PathBuf, FileError> {
        let Self { file, target } = self;
        file.persist_noclobber(&target)
            .map_err(|error| FileError::new("write", &target, error.error))?;
        Ok(target)
    }

    /// Gives the file its final name, replacing an older file, and returns the path.
    ///
    /// # Errors
    /// If that is not possible.
    pub fn commit(self) -> Result<PathBuf, FileError> {
        let Self { file, target } = self;
        file.persist(&target)
            .map_err(|error| FileError::new("write", &target, error.error))?;
        Ok(target)
    }
}

/// Separates the name of a file from the random characters of its temporary name.
const SUFFIX: &str = ".bristle-";
/// Number of random characters in a temporary name.
const RANDOM_CHARS: usize = 6;

/// Creates a temporary file with the permissions that the user's settings give to new files. The
/// file keeps them under its final name.
fn temporary_file(directory: &Path, name: &OsStr) -> io::Result<NamedTempFile> {
    let prefix: OsString = [OsStr::new("."), name, OsStr::new(SUFFIX)]
        .into_iter()
        .collect();
    let mut builder = Builder::new();
    builder.prefix(&prefix).rand_bytes(RANDOM_CHARS);
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tables_are_read_as_spreadsheets_save_them() {
        let text = "n [1/min];ae [µm]\r\n600;500\r\n";
        let utf_16 = |bytes: fn(u16) -> [u8; 2]| {
            [0xfeff]
                .into_iter()
                .chain(text.encode_utf16())
                .flat_map(bytes)
                .collect()
        };
        let latin_1 = text.chars().map(|letter| letter as u8).collect();
        for bytes in [
            text.as_bytes().to_vec(),
            latin_1,
            utf_16(u16::to_le_bytes),
            utf_16(u16::to_be_bytes),
        ] {
            assert_eq!(as_table(bytes).expect("a table"), text);
        }
        assert_eq!(
            as_table(b"F [\x80]\n\x93".to_vec()).expect("a table"),
            "F [€]\n“"
        );
        for wrong in [b"F\n\x81".to_vec(), vec![0xff, 0xfe, 0x00, 0xd8]] {
            assert!(as_table(wrong).is_err());
        }
        assert_eq!(as_table(Vec::new()).expect("no text"), "");
    }

    #[test]
    fn a_new_file_replaces_none() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("brush.toml");
        let staged = |text: &'static str| {
            StagedFile::text(directory.path(), "brush.toml", text).expect("a disk")
        };
        let [first, second] = ["first", "second"].map(staged);
        first.commit_new().expect("a new file");
        let error = second.commit_new().expect_err("it exists");
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(fs::read_to_string(&path).expect("a file"), "first");
        assert_eq!(
            entries(directory.path()).count(),
            1,
            "nothing is left behind"
        );
    }

    #[test]
    fn a_long_path_is_cut_in_the_reason_too() {
        let path = PathBuf::from("long ".repeat(2000));
        let error = StagedFile::write(path, |_| Ok(()))
            .expect_err("no file system takes such a name")
            .to_string();
        assert!(
            error.starts_with("cannot write `long") && error.chars().count() < 1000,
            "{error}"
        );
    }
}
