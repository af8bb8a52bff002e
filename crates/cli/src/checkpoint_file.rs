//! The checkpoint file of a brush, from which a stopped simulation resumes.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bristle::brush::Checkpoint;
use bristle::model::settings::Settings;
use bristle_app::store::checkpoint::{CheckpointError, read_checkpoint, write_checkpoint};
use bristle_app::store::previous::Previous;
use bristle_app::store::staged::{FileError, StagedFile, read_bytes, remove};

use crate::error::CliError;
use crate::terminal::say_kept;

/// Name of the file in the results directory.
pub const CHECKPOINT: &str = "checkpoint.bin";

/// Maximum share of the time for writing checkpoints.
const MAX_WRITING_SHARE: f64 = 0.05;

/// The checkpoint of a running brush.
pub struct CheckpointFile {
    path: PathBuf,
    settings: Settings,
    frames: usize,
    /// Minimum time between two checkpoints.
    pause: Duration,
    written: Instant,
}

impl CheckpointFile {
    /// Opens the checkpoint in a directory, of a brush with these settings and this number of
    /// frames. Returns it with its state, which `restart` discards. A checkpoint of another brush
    /// or build moves to `previous`.
    pub fn open(
        directory: &Path,
        settings: &Settings,
        frames: usize,
        pause: Duration,
        restart: bool,
    ) -> Result<(Self, Option<Checkpoint>), CliError> {
        let path = directory.join(CHECKPOINT);
        let unusable = |error| CliError::Checkpoint {
            path: path.clone(),
            error,
        };
        let bytes = if path.exists() {
            Some(read_bytes(&path)?)
        } else {
            None
        };
        let state = match bytes
            .as_deref()
            .map(|bytes| read_checkpoint(settings, frames, bytes))
        {
            // A file that is not a checkpoint belongs to someone else: not even a restart may
            // discard it.
            Some(Err(CheckpointError::Foreign)) => return Err(unusable(CheckpointError::Foreign)),
            None => None,
            Some(_) if restart => None,
            Some(Err(CheckpointError::Damaged)) => return Err(unusable(CheckpointError::Damaged)),
            Some(Err(CheckpointError::Other | CheckpointError::Format(_))) => {
                let mut previous = Previous::of(directory);
                previous.keep(CHECKPOINT)?;
                previous.path().into_iter().for_each(say_kept);
                None
            }
            Some(Ok(state)) => Some(state),
        };
        Ok((
            Self {
                path,
                settings: settings.clone(),
                frames,
                pause,
                written: Instant::now(),
            },
            state,
        ))
    }

    /// Returns the path of the file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the state if the last attempt is old enough. Returns `true` if it was written.
    pub fn keep(&mut self, state: impl FnOnce() -> Checkpoint) -> Result<bool, FileError> {
        if self.written.elapsed() < self.pause {
            Ok(false)
        } else {
            self.write(&state()).map(|()| true)
        }
    }

    /// Writes the state in place of the last one, which remains if writing fails.
    pub fn write(&mut self, state: &Checkpoint) -> Result<(), FileError> {
        let begun = Instant::now();
        let bytes = write_checkpoint(&self.settings, self.frames, state);
        let written = StagedFile::write(self.path.clone(), |out| out.write_all(&bytes))
            .and_then(StagedFile::commit);
        self.pause = self.pause.max(begun.elapsed().div_f64(MAX_WRITING_SHARE));
        self.written = Instant::now();
        written.map(drop)
    }

    /// Removes the file when it is no longer needed.
    pub fn remove(&self) -> Result<(), FileError> {
        remove(&self.path)
    }
}
