//! The journal of a calibration: the forces of each brush that it has simulated, by its settings. A
//! calibration that is repeated goes the same way and finds them here.

use std::collections::HashMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard};

use bristle::model::settings::Settings;
use bristle_study::text::shown_path;
use serde::{Deserialize, Serialize};

use crate::store::digest::digest;
use crate::store::disk::{lock, synced};
use crate::store::journal::SOLVER;
use crate::store::journal_file::JournalFileError;
use crate::store::origin::{Program, listed, sealed, unsealed};
use crate::store::staged::FileError;

/// Name of the file in the directory of the results.
pub const FORCE_JOURNAL: &str = "calibration.jsonl";
/// Longest journal, in bytes. A line has some 200 bytes.
const MAX_JOURNAL_BYTES: u64 = 1 << 28;
const KIND: &str = "bristle calibration";
const UNBROKEN: &str = "nothing panics with the journal in hand";

/// Normal force, tangential force, torque and power of a tool.
pub type Forces = [f64; 4];

#[derive(Serialize, Deserialize)]
struct Header {
    journal: String,
    #[serde(flatten)]
    program: Program,
}

#[derive(Serialize, Deserialize)]
struct Entry {
    /// Digest of the settings.
    key: String,
    forces: Forces,
}

/// A journal that is read and appended to.
#[derive(Debug)]
pub struct ForceJournal {
    path: PathBuf,
    known: Mutex<HashMap<String, Forces>>,
    earlier: usize,
    file: Mutex<(File, Option<io::Error>)>,
}

impl ForceJournal {
    /// Opens the journal in a directory, which must be occupied. Begins a new one if there is none,
    /// or it is to `restart`.
    ///
    /// # Errors
    /// If another process writes there, the journal is not of this program, or it cannot be read or
    /// written.
    pub fn open(directory: &Path, restart: bool) -> Result<Self, JournalFileError> {
        let path = directory.join(FORCE_JOURNAL);
        let opened = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&path);
        let mut file = opened.map_err(|error| FileError::new("open", &path, error))?;
        lock(&file, &path, directory)?;
        let mut text = String::new();
        let read = (&file)
            .take(MAX_JOURNAL_BYTES + 1)
            .read_to_string(&mut text);
        read.map_err(|error| FileError::new("read", &path, error))?;
        if text.len() as u64 > MAX_JOURNAL_BYTES {
            return Err(JournalFileError::Refused(format!(
                "`{}` is longer than {} MiB, and no journal of a calibration: choose another directory with --out",
                shown_path(&path),
                MAX_JOURNAL_BYTES >> 20
            )));
        }
        let mut known = HashMap::new();
        let mut intact = 0;
        if let Some(line) = text.split_inclusive('\n').next() {
            let header: Option<Header> =
                unsealed("", line).filter(|header: &Header| header.journal == KIND);
            let refused = |why: String| {
                JournalFileError::Refused(format!("`{}` is {why}", shown_path(&path)))
            };
            let header = header.ok_or_else(|| {
                refused("no journal of a calibration: choose another directory with --out".into())
            })?;
            let differences = header.program.differences(&Program::here(&SOLVER));
            if !differences.is_empty() && !restart {
                return Err(refused(format!(
                    "of another build of Bristle:{}\nhelp: --restart discards it",
                    listed(&differences)
                )));
            }
            // What follows a damaged line is not read: it is simulated again.
            let entries = text
                .split_inclusive('\n')
                .skip(1)
                .map_while(|line| Some((line, unsealed::<Entry>("", line)?)));
            if !restart {
                intact = line.len();
                for (line, Entry { key, forces }) in entries {
                    intact += line.len();
                    known.insert(key, forces);
                }
            }
        }
        let begin = |file: &mut File| {
            file.set_len(intact as u64)?;
            file.seek(SeekFrom::End(0))?;
            if intact == 0 {
                let header = Header {
                    journal: KIND.to_owned(),
                    program: Program::here(&SOLVER),
                };
                file.write_all(sealed("", &header).as_bytes())?;
            }
            Ok(())
        };
        begin(&mut file).map_err(|error| FileError::new("write", &path, error))?;
        let earlier = known.len();
        Ok(Self {
            path,
            known: Mutex::new(known),
            earlier,
            file: Mutex::new((file, None)),
        })
    }

    fn file(&self) -> MutexGuard<'_, (File, Option<io::Error>)> {
        self.file.lock().expect(UNBROKEN)
    }

    fn known(&self) -> MutexGuard<'_, HashMap<String, Forces>> {
        self.known.lock().expect(UNBROKEN)
    }

    /// The forces of an earlier simulation with these settings.
    #[must_use]
    pub fn recall(&self, settings: &Settings) -> Option<Forces> {
        self.known().get(&key(settings)).copied()
    }

    /// Appends the forces of a simulation. Appends nothing after an error; [`Self::settle`] returns
    /// that error.
    pub fn append(&self, settings: &Settings, forces: Forces) -> ControlFlow<()> {
        let entry = Entry {
            key: key(settings),
            forces,
        };
        let line = sealed("", &entry);
        self.known().insert(entry.key, forces);
        let (file, error) = &mut *self.file();
        if error.is_none() {
            *error = file.write_all(line.as_bytes()).err();
        }
        if error.is_none() {
            ControlFlow::Continue(())
        } else {
            ControlFlow::Break(())
        }
    }

    /// The number of simulations that were there when it was opened.
    #[must_use]
    pub fn earlier(&self) -> usize {
        self.earlier
    }

    /// Syncs everything to disk.
    ///
    /// # Errors
    /// The first error since the journal was opened.
    pub fn settle(&self) -> Result<(), FileError> {
        let (file, error) = &mut *self.file();
        let settled = error.take().map_or_else(|| synced(file.sync_data()), Err);
        settled.map_err(|error| FileError::new("write", &self.path, error))
    }
}

/// What identifies settings.
fn key(settings: &Settings) -> String {
    digest(
        serde_json::to_string(settings)
            .expect("all keys are texts")
            .as_bytes(),
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_recalled_up_to_a_damaged_line() {
        let directory = tempfile::tempdir().expect("a directory");
        let settings = [1e-3, 2e-3, 3e-3].map(|depth| Settings::paper(10.0, depth));
        let open = |restart| ForceJournal::open(directory.path(), restart);
        let journal = open(false).expect("a new journal");
        for (own, force) in settings.iter().zip([1.0, 2.0]) {
            assert!(journal.append(own, [force; 4]).is_continue());
            assert_eq!(journal.recall(own), Some([force; 4]));
        }
        journal.settle().expect("a disk");
        drop(journal);
        let path = directory.path().join(FORCE_JOURNAL);
        let text = std::fs::read_to_string(&path).expect("a journal");
        std::fs::write(&path, &text[..text.len() - 9]).expect("a disk");
        let journal = open(false).expect("the same journal");
        let other = open(true).expect_err("another process").to_string();
        assert!(other.starts_with("another command is writing"), "{other}");
        let recalled = settings.each_ref().map(|own| journal.recall(own));
        assert_eq!(recalled, [Some([1.0; 4]), None, None]);
        assert!(journal.append(&settings[1], [2.0; 4]).is_continue());
        drop(journal);
        assert_eq!(open(false).expect("the same journal").earlier(), 2);
        assert_eq!(open(true).expect("a new journal").earlier(), 0);
        std::fs::write(&path, "mine\n").expect("a disk");
        assert!(matches!(open(true), Err(JournalFileError::Refused(_))));
    }
}
