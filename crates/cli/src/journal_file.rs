//! The file of a study's journal: locked, read, appended to, and brought to the disk.
//!
//! A case's line is with the operating system before the next case of its lane begins, so that the death of the program
//! loses only what was being simulated. A thread of its own has the disk write the lines down, many at a time: waiting for
//! the disk after each case would cost more than to simulate it.

use std::convert::Infallible;
use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, BufReader, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use bristle_study::journal::{Contents, Journal, JournalError};
use bristle_study::study::{CaseResult, Study};
use thiserror::Error;
use tracing::{debug, warn};

use crate::files::FileError;

/// Name of the file in the directory of the results.
pub const JOURNAL: &str = "journal.jsonl";

/// Time between two calls for the disk to write down what has come since, so that they do not slow the study: what a loss
/// of power can cost, beside the cases that were being simulated.
const PAUSE: Duration = Duration::from_millis(100);

const UNBROKEN: &str = "nothing panics with the state in hand";

/// Why a study cannot go on from the journal in its directory, or not begin one.
#[derive(Debug, Error)]
pub enum JournalFileError {
    /// Another process has the lock.
    #[error(
        "another study is writing to the directory `{}`: wait until it ends, or choose another one with --out",
        directory.display()
    )]
    InUse { directory: PathBuf },
    /// The journal is none that the study can go on from.
    #[error("cannot go on from `{}`: {error}\n{}", path.display(), advice(error))]
    Unusable { path: PathBuf, error: JournalError },
    /// The file cannot be opened, read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The thread that has the disk write cannot be started.
    #[error("cannot start threads: {0}")]
    Threads(io::Error),
}

fn advice(error: &JournalError) -> &'static str {
    match error {
        JournalError::Foreign => "help: move the file away, or choose another directory with --out",
        _ => {
            "help: give another directory with --out to keep these results, \
             or --restart to give them up and simulate all cases anew"
        }
    }
}

/// The journal of a study that is being simulated. No other process can open it meanwhile.
#[derive(Debug)]
pub struct JournalFile {
    journal: Journal,
    shared: Arc<Shared>,
    /// None once it has ended.
    syncing: Option<JoinHandle<()>>,
}

#[derive(Debug)]
struct Shared {
    path: PathBuf,
    file: File,
    state: Mutex<State>,
    /// There is something for the disk, or the end has come.
    changed: Condvar,
}

#[derive(Debug)]
struct State {
    /// Length in bytes of the lines that are whole.
    length: u64,
    cases: usize,
    /// Whether lines have come since the disk was last told to write.
    fresh: bool,
    closing: bool,
    /// What went wrong first. Nothing is written after it.
    error: Option<io::Error>,
}

/// What the journal held when it was opened.
#[derive(Debug)]
pub struct Earlier {
    /// The result of each case, none where it has to be simulated.
    pub results: Vec<Option<CaseResult>>,
    /// Length in bytes of an end that was cut off, and has been dropped.
    pub torn: u64,
    /// Whether a restart has given up what there was.
    pub given_up: bool,
}

impl JournalFile {
    /// Opens the journal of `study` in a directory, and begins one where there is none, or where a `restart` is wanted.
    pub fn open(directory: &Path, study: &Study, restart: bool) -> Result<(Self, Earlier), JournalFileError> {
        let path = directory.join(JOURNAL);
        let opened = OpenOptions::new().read(true).write(true).create(true).truncate(false).open(&path);
        let file = opened.map_err(|error| FileError::new("open", &path, error))?;
        lock(&file, &path, directory)?;

        let journal = Journal::new(study);
        let nothing = || Contents { results: vec![None; study.case_count()], intact: 0, torn: 0 };
        let (contents, given_up) = match journal.read(study, BufReader::new(&file)) {
            Ok(Contents { intact, .. }) if restart => (nothing(), intact > 0),
            Ok(contents) => (contents, false),
            Err(JournalError::Unreadable(error)) => return Err(FileError::new("read", &path, error).into()),
            // A file that is no journal is somebody's, whom no restart of a study concerns.
            Err(error) if !restart || matches!(error, JournalError::Foreign) => {
                return Err(JournalFileError::Unusable { path, error });
            }
            Err(_) => (nothing(), true),
        };
        let Contents { results, intact, torn } = contents;
        let cases = results.iter().flatten().count();
        if torn > 0 {
            warn!(path = %path.display(), bytes = torn, "the end of the journal was cut off and is dropped");
        }
        debug!(path = %path.display(), cases, "journal opened");

        let mut state = State { length: intact, cases, fresh: false, closing: false, error: None };
        let begun = if intact > 0 { state.cut(&file) } else { state.begin(&file, journal.header(), directory) };
        begun.map_err(|error| FileError::new("write", &path, error))?;
        let shared = Arc::new(Shared { path, file, state: Mutex::new(state), changed: Condvar::new() });
        let syncing = {
            let shared = Arc::clone(&shared);
            Some(thread::Builder::new().spawn(move || shared.sync()).map_err(JournalFileError::Threads)?)
        };
        Ok((Self { journal, shared, syncing }, Earlier { results, torn, given_up }))
    }

    /// Appends the line of a case, counted from 0. After an error, which [`Self::settle`] returns, nothing is appended.
    pub fn append(&self, case: usize, result: &CaseResult) -> ControlFlow<()> {
        let line = self.journal.entry(case, result);
        let mut state = self.shared.state();
        if state.error.is_none() {
            let waits = !state.fresh;
            state.append(&self.shared.file, &line);
            if waits {
                self.shared.changed.notify_one();
            }
        }
        if state.error.is_none() { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    /// Has the disk write what it has not yet. The error is the first since the journal was opened.
    ///
    /// Nothing is to be appended after this. The lock is kept until the process ends.
    pub fn settle(&mut self) -> Result<(), FileError> {
        self.shared.state().closing = true;
        self.shared.changed.notify_one();
        if let Some(syncing) = self.syncing.take() {
            syncing.join().expect("nothing panics between the calls for the disk");
        }
        match self.shared.state().error.take() {
            None => Ok(()),
            Some(error) => Err(FileError::new("write", &self.shared.path, error)),
        }
    }

    /// The number of cases in the journal.
    pub fn cases(&self) -> usize {
        self.shared.state().cases
    }

    /// A function that waits until the line being written is whole, and calls `end` with the number of cases.
    ///
    /// It is for a signal that ends the program: `end` does not return, and no line is begun meanwhile.
    pub fn stopper(&self, end: impl Fn(usize) -> Infallible + Send + 'static) -> impl Fn() + Send + 'static {
        let shared = Arc::clone(&self.shared);
        move || {
            let state = shared.state();
            end(state.cases);
        }
    }
}

/// Takes the lock that the operating system gives back when the process ends, however it ends.
fn lock(file: &File, path: &Path, directory: &Path) -> Result<(), JournalFileError> {
    match file.try_lock() {
        Ok(()) => Ok(()),
        Err(TryLockError::WouldBlock) => Err(JournalFileError::InUse { directory: directory.to_owned() }),
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => {
            warn!(path = %path.display(), "this file system has no locks: no second study would be noticed");
            Ok(())
        }
        Err(TryLockError::Error(error)) => Err(FileError::new("lock", path, error).into()),
    }
}

impl Shared {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().expect(UNBROKEN)
    }

    /// Has the disk write what has come, until the journal is closed.
    fn sync(&self) {
        let mut state = self.state();
        loop {
            state = self.changed.wait_while(state, |state| !state.fresh && !state.closing).expect(UNBROKEN);
            if !state.fresh {
                return;
            }
            state.fresh = false;
            drop(state);
            let synced = self.file.sync_data();
            state = self.state();
            if let Err(error) = synced {
                state.error.get_or_insert(error);
            }
            state = self.changed.wait_timeout_while(state, PAUSE, |state| !state.closing).expect(UNBROKEN).0;
        }
    }
}

impl State {
    /// Writes the first line, into a file that the disk knows by its name before a case is simulated.
    fn begin(&mut self, mut file: &File, header: &str, directory: &Path) -> io::Result<()> {
        self.cut(file)?;
        if let Err(error) = file.write_all(header.as_bytes()).and_then(|()| file.sync_all()) {
            let _ = self.cut(file);
            return Err(error);
        }
        self.length = header.len() as u64;
        // Not every system can do this, and those that cannot need not.
        if let Ok(directory) = File::open(directory) {
            let _ = directory.sync_all();
        }
        Ok(())
    }

    /// Appends a line, or nothing.
    fn append(&mut self, mut file: &File, line: &str) {
        match file.write_all(line.as_bytes()) {
            Ok(()) => {
                self.length += line.len() as u64;
                self.cases += 1;
                self.fresh = true;
            }
            Err(error) => {
                // If this fails too, the end is dropped when the journal is read.
                let _ = self.cut(file);
                self.error = Some(error);
            }
        }
    }

    /// Cuts the file behind the last whole line, and goes on there.
    fn cut(&self, mut file: &File) -> io::Result<()> {
        file.seek(SeekFrom::Start(self.length))?;
        if file.metadata()?.len() == self.length { Ok(()) } else { file.set_len(self.length) }
    }
}
