//! The journal file of a directory: locked, read, appended to, and synced to disk.
//!
//! The operating system has the line of a case before the next case of its lane starts. A killed
//! program loses only the cases in progress. A separate thread syncs the lines to disk, many at a
//! time. Waiting for the disk after each case would take longer than simulating it.

use std::convert::Infallible;
use std::fs::{File, OpenOptions};
use std::io::{self, BufReader, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread::{self, JoinHandle};
use std::time::Duration;

use crate::store::journal::{self, JournalError, Key, Length};
use bristle_study::text::shown_path;
use parking_lot::{Condvar, Mutex, MutexGuard};
use thiserror::Error;
use tracing::{debug, warn};

use crate::store::disk::{lock, synced};
use crate::store::previous::Previous;
use crate::store::staged::FileError;

/// Name of the file in the results directory.
pub const JOURNAL: &str = "journal.jsonl";

/// Time between two syncs to disk, long enough not to slow the study. A loss of power can cost the
/// cases of this time, in addition to those in progress.
const SYNC_INTERVAL: Duration = Duration::from_millis(100);

/// Reasons why a command cannot use the journal in its directory.
#[derive(Debug, Error)]
pub enum JournalFileError {
    /// Another process has the lock, the journal is another one, or the thread for syncs cannot be
    /// started, in words.
    #[error("{0}")]
    Refused(String),
    /// The file cannot be opened, read or written.
    #[error(transparent)]
    File(#[from] FileError),
}

/// The journal of a running command. No other process can open it meanwhile.
#[derive(Debug)]
pub struct JournalFile {
    shared: Arc<Shared>,
    /// `None` once the thread has ended.
    syncing: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    file: File,
    state: Mutex<WrittenJournal>,
    /// Signals that there are lines to sync, or that the journal is closing.
    changed: Condvar,
}

#[derive(Debug)]
struct WrittenJournal {
    /// Length of the complete lines in bytes.
    length: u64,
    /// Number of results that this process has appended.
    appended: usize,
    /// `true` if lines were appended since the last sync.
    fresh: bool,
    closing: bool,
    /// The first error, after which nothing is written.
    error: Option<io::Error>,
}

/// State of the journal of an earlier command when it was opened.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct JournalState {
    /// Length in bytes of an incomplete last line, which has been dropped.
    pub torn: u64,
    /// `true` if a restart has discarded its contents.
    pub discarded: bool,
}

impl JournalFile {
    /// Opens the journal in a directory, and passes the key and the text of each line to `take`.
    /// Starts a new one if there is none, or if `restart` is set. Moves a journal of another build
    /// to `previous`.
    ///
    /// # Errors
    /// If another process writes there, the file is no journal, is damaged before its end, or
    /// cannot be read or written.
    pub fn open(
        directory: &Path,
        restart: bool,
        previous: &mut Previous,
        mut take: impl FnMut(Key, &str),
    ) -> Result<(Self, JournalState), JournalFileError> {
        let path = directory.join(JOURNAL);
        let mut file = open_locked(&path, directory)?;
        let nothing = Length { intact: 0, torn: 0 };
        let mut discarded = false;
        let length = match journal::read(BufReader::new(&file), |key, line| {
            if !restart {
                take(key, line);
            }
        }) {
            Err(JournalError::Unreadable(error)) => {
                return Err(FileError::new("read", &path, error).into());
            }
            // A file that is not a journal belongs to someone else: not even a restart may discard
            // it.
            Err(JournalError::Foreign) => {
                return Err(refused(
                    &path,
                    &JournalError::Foreign,
                    "help: move the file away, or choose another directory with --out",
                ));
            }
            Ok(length) if restart => {
                discarded = length.intact > 0;
                nothing
            }
            Err(_) if restart => {
                discarded = true;
                nothing
            }
            Ok(length) => length,
            Err(JournalError::Format(_) | JournalError::Other(_)) => {
                previous.keep(JOURNAL)?;
                file = open_locked(&path, directory)?;
                nothing
            }
            Err(error @ JournalError::Damaged(_)) => {
                return Err(refused(
                    &path,
                    &error,
                    "help: choose another directory with --out to keep these results, \
                     or use --restart to discard them and simulate all cases again",
                ));
            }
        };
        let Length { intact, torn } = length;
        if torn > 0 {
            warn!(path = %shown_path(&path), bytes = torn, "dropped an incomplete line at the end of the journal");
        }
        debug!(path = %shown_path(&path), bytes = intact, "journal opened");

        let mut state = WrittenJournal {
            length: intact,
            appended: 0,
            fresh: false,
            closing: false,
            error: None,
        };
        let begun = if intact > 0 {
            state.cut(&file)
        } else {
            state.begin(&file, journal::header(), directory)
        };
        begun.map_err(|error| FileError::new("write", &path, error))?;
        let shared = Arc::new(Shared {
            path,
            file,
            state: Mutex::new(state),
            changed: Condvar::new(),
        });
        let syncing = {
            let shared = Arc::clone(&shared);
            Some(
                thread::Builder::new()
                    .spawn(move || shared.sync())
                    .map_err(|error| {
                        JournalFileError::Refused(format!("cannot start threads: {error}"))
                    })?,
            )
        };
        Ok((Self { shared, syncing }, JournalState { torn, discarded }))
    }

    /// Passes the key and the text of each line of the journal in a directory to `take`. The
    /// journal stays unchanged.
    ///
    /// # Errors
    /// If there is no journal of this build that can be read.
    pub fn read(directory: &Path, take: impl FnMut(Key, &str)) -> Result<(), JournalFileError> {
        let path = directory.join(JOURNAL);
        let file = File::open(&path).map_err(|error| FileError::new("open", &path, error))?;
        match journal::read(BufReader::new(&file), take) {
            Ok(_) => Ok(()),
            Err(JournalError::Unreadable(error)) => {
                Err(FileError::new("read", &path, error).into())
            }
            Err(error) => Err(refused(
                &path,
                &error,
                "help: simulate its study again, by this build",
            )),
        }
    }

    /// Appends a line, but nothing after an error; [`Self::settle`] returns that error.
    pub fn append(&self, line: &str) -> ControlFlow<()> {
        let mut state = self.shared.state();
        if state.error.is_none() {
            let waits = !state.fresh;
            state.append(&self.shared.file, line);
            if waits {
                self.shared.changed.notify_one();
            }
        }
        if state.error.is_none() {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    }

    /// Syncs everything to disk. Returns the first error since the journal was opened.
    ///
    /// Do not append after this. The lock is kept until the journal is dropped or the process ends.
    ///
    /// # Errors
    /// If a line could not be written or synced.
    pub fn settle(&mut self) -> Result<(), FileError> {
        self.shared.state().closing = true;
        self.shared.changed.notify_one();
        if let Some(syncing) = self.syncing.take() {
            syncing
                .join()
                .expect("the thread that syncs does not panic");
        }
        match self.shared.state().error.take() {
            None => Ok(()),
            Some(error) => Err(FileError::new("write", &self.shared.path, error)),
        }
    }

    /// Returns the number of lines that this process has appended.
    pub fn appended(&self) -> usize {
        self.shared.state().appended
    }

    /// Returns a function that waits until the line in progress is complete. It then calls `end`
    /// with the number of lines that this process has appended.
    ///
    /// Its use is a signal that ends the program: `end` does not return, and no further line is
    /// started.
    pub fn stopper(
        &self,
        end: impl Fn(usize) -> Infallible + Send + 'static,
    ) -> impl Fn() + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move || {
            let state = shared.state();
            end(state.appended);
        }
    }
}

/// Opens and locks the file.
fn open_locked(path: &Path, directory: &Path) -> Result<File, JournalFileError> {
    let opened = OpenOptions::new()
        .read(true)
        .write(true)
        .create(true)
        .truncate(false)
        .open(path);
    let file = opened.map_err(|error| FileError::new("open", path, error))?;
    lock(&file, path, directory)?;
    Ok(file)
}

fn refused(path: &Path, error: &JournalError, advice: &str) -> JournalFileError {
    JournalFileError::Refused(format!(
        "cannot resume from `{}`: {error}\n{advice}",
        shown_path(path)
    ))
}

/// Ends the thread, and with it the lock.
impl Drop for JournalFile {
    fn drop(&mut self) {
        // The caller has settled before if an error matters.
        let _ = self.settle();
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, WrittenJournal> {
        self.state.lock()
    }

    /// Syncs appended lines to disk until the journal closes.
    fn sync(&self) {
        let mut state = self.state();
        loop {
            self.changed
                .wait_while(&mut state, |state| !state.fresh && !state.closing);
            if !state.fresh {
                return;
            }
            state.fresh = false;
            drop(state);
            let outcome = synced(self.file.sync_data());
            state = self.state();
            if let Err(error) = outcome {
                state.error.get_or_insert(error);
            }
            self.changed
                .wait_while_for(&mut state, |state| !state.closing, SYNC_INTERVAL);
        }
    }
}

impl WrittenJournal {
    /// Writes the header. The file and its name are on disk before any case is simulated.
    fn begin(&mut self, mut file: &File, header: &str, directory: &Path) -> io::Result<()> {
        self.cut(file)?;
        if let Err(error) = file
            .write_all(header.as_bytes())
            .and_then(|()| synced(file.sync_all()))
        {
            let _ = self.cut(file);
            return Err(error);
        }
        self.length = header.len() as u64;
        // Not every system supports this; the others do not need it.
        if let Ok(directory) = File::open(directory) {
            let _ = directory.sync_all();
        }
        Ok(())
    }

    /// Appends a whole line, or nothing.
    fn append(&mut self, mut file: &File, line: &str) {
        match file.write_all(line.as_bytes()) {
            Ok(()) => {
                self.length += line.len() as u64;
                self.appended += 1;
                self.fresh = true;
            }
            Err(error) => {
                // If this fails too, the incomplete line is dropped when the journal is next read.
                let _ = self.cut(file);
                self.error = Some(error);
            }
        }
    }

    /// Truncates the file after the last complete line, and continues there.
    fn cut(&self, mut file: &File) -> io::Result<()> {
        file.seek(SeekFrom::Start(self.length))?;
        if file.metadata()?.len() == self.length {
            Ok(())
        } else {
            file.set_len(self.length)
        }
    }
}
