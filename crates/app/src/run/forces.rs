//! The forces of simulated brushes in the journal of a directory. A repeated calibration, or a
//! repeated search for the depth of a force, takes the same steps and finds the forces there.

use std::collections::HashMap;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};

use bristle::model::settings::Settings;
use bristle_study::calibrate::{Forces, Observer};
use parking_lot::{Mutex, MutexGuard};
use serde::{Deserialize, Serialize};

use crate::store::journal::{Key, line};
use crate::store::journal_file::{JournalFile, JournalFileError};
use crate::store::previous::Previous;
use crate::store::staged::FileError;

/// The result of a line.
#[derive(Serialize, Deserialize)]
struct ForceEntry {
    forces: Forces,
}

/// Forces that are recalled and kept.
#[derive(Debug)]
pub struct ForceJournal {
    known: Mutex<HashMap<Key, Forces>>,
    journal: JournalFile,
    /// The number of those that were known when it was opened.
    pub earlier: usize,
    /// Path to which the journal of another build was moved.
    pub kept: Option<PathBuf>,
}

impl ForceJournal {
    /// Opens the journal of a directory, which must be occupied. Begins a new one on `restart`.
    ///
    /// # Errors
    /// As for [`JournalFile::open`].
    pub fn open(directory: &Path, restart: bool) -> Result<Self, JournalFileError> {
        let mut known = HashMap::new();
        let mut previous = Previous::of(directory);
        let (journal, _) = JournalFile::open(directory, restart, &mut previous, |key, line| {
            if let Ok(ForceEntry { forces }) = serde_json::from_str(line) {
                known.insert(key, forces);
            }
        })?;
        Ok(Self {
            earlier: known.len(),
            known: Mutex::new(known),
            journal,
            kept: previous.path().map(Path::to_owned),
        })
    }

    fn known(&self) -> MutexGuard<'_, HashMap<Key, Forces>> {
        self.known.lock()
    }

    /// The forces of an earlier simulation with these settings.
    #[must_use]
    pub fn recall(&self, settings: &Settings) -> Option<Forces> {
        self.known().get(&key(settings)).copied()
    }

    /// Appends the forces of a simulation. Appends nothing after an error; [`Self::settle`] returns
    /// that error.
    pub fn append(&self, settings: &Settings, forces: Forces) -> ControlFlow<()> {
        let key = key(settings);
        self.known().insert(key, forces);
        self.journal.append(&line(key, &ForceEntry { forces }))
    }

    /// Syncs everything to disk.
    ///
    /// # Errors
    /// The first error since the journal was opened.
    pub fn settle(&mut self) -> Result<(), FileError> {
        self.journal.settle()
    }
}

/// Observer of a calibration that keeps forces in a journal.
pub struct JournaledForces<'a> {
    /// The journal, if there is one.
    pub journal: Option<ForceJournal>,
    /// Takes the share that is done.
    pub tell: &'a (dyn Fn(f64) + Sync),
}

impl Observer for JournaledForces<'_> {
    fn done(&self, share: f64) {
        (self.tell)(share);
    }

    fn recall(&self, settings: &Settings) -> Option<Forces> {
        self.journal.as_ref()?.recall(settings)
    }

    fn keep(&self, settings: &Settings, forces: &Forces) -> ControlFlow<()> {
        self.journal
            .as_ref()
            .map_or(ControlFlow::Continue(()), |journal| {
                journal.append(settings, *forces)
            })
    }
}

fn key(settings: &Settings) -> Key {
    Key::of("forces", settings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::store::journal_file::JOURNAL;

    #[test]
    fn forces_are_recalled_up_to_a_damaged_line() {
        let directory = tempfile::tempdir().expect("a directory");
        let settings = [1e-3, 2e-3, 3e-3].map(|depth| Settings::paper(10.0, depth));
        let open = |restart| ForceJournal::open(directory.path(), restart);
        let mut journal = open(false).expect("a new journal");
        for (own, force) in settings.iter().zip([1.0, 2.0]) {
            assert!(journal.append(own, [force; 4]).is_continue());
            assert_eq!(journal.recall(own), Some([force; 4]));
        }
        journal.settle().expect("a disk");
        drop(journal);
        let path = directory.path().join(JOURNAL);
        let text = std::fs::read_to_string(&path).expect("a journal");
        std::fs::write(&path, &text[..text.len() - 9]).expect("a disk");
        let journal = open(false).expect("the same journal");
        let other = open(true).expect_err("another process").to_string();
        assert!(other.starts_with("another command is writing"), "{other}");
        let recalled = settings.each_ref().map(|own| journal.recall(own));
        assert_eq!(recalled, [Some([1.0; 4]), None, None]);
        assert!(journal.append(&settings[1], [2.0; 4]).is_continue());
        drop(journal);
        assert_eq!(open(false).expect("the same journal").earlier, 2);
        assert_eq!(open(true).expect("a new journal").earlier, 0);
        std::fs::write(&path, "mine\n").expect("a disk");
        assert!(matches!(open(true), Err(JournalFileError::Refused(_))));
    }
}
