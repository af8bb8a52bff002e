//! The checkpoint file of a brush, from which a stopped simulation resumes.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use bristle::brush::Checkpoint;
use bristle::model::settings::Settings;
use bristle_study::text::shown_path;
use thiserror::Error;

use crate::run::brush::BrushRunError;
use crate::store::checkpoint::{CheckpointError, read_checkpoint, write_checkpoint};
use crate::store::previous::Previous;
use crate::store::staged::{FileError, StagedFile, read_bytes, remove};

/// Name of the file in the results directory.
pub const CHECKPOINT: &str = "checkpoint.bin";

/// Maximum share of the time for writing checkpoints.
const MAX_WRITING_SHARE: f64 = 0.05;

/// A checkpoint from which a brush cannot be resumed.
#[derive(Debug, Error)]
#[error(
    "cannot resume from `{}`: {error}\n{}",
    shown_path(path),
    advice(error)
)]
pub struct UnusableCheckpoint {
    /// The file.
    pub path: PathBuf,
    /// The error in it.
    pub error: CheckpointError,
}

fn advice(error: &CheckpointError) -> &'static str {
    match error {
        CheckpointError::Foreign => {
            "help: move the file away, or choose another directory with --out"
        }
        _ => {
            "help: choose another directory with --out to keep this state, \
             or use --restart to discard it and simulate from the beginning"
        }
    }
}

/// The checkpoint of a running brush.
pub(crate) struct CheckpointFile {
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
    /// or build moves to `previous`, and `on_kept`
    /// gets the place.
    pub(crate) fn open(
        directory: &Path,
        settings: &Settings,
        frames: usize,
        pause: Duration,
        restart: bool,
        on_kept: impl FnOnce(&Path),
    ) -> Result<(Self, Option<Checkpoint>), BrushRunError> {
        let path = directory.join(CHECKPOINT);
        let unusable = |error| UnusableCheckpoint {
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
            Some(Err(CheckpointError::Foreign)) => {
                return Err(unusable(CheckpointError::Foreign).into());
            }
            None => None,
            Some(_) if restart => None,
            Some(Err(CheckpointError::Damaged)) => {
                return Err(unusable(CheckpointError::Damaged).into());
            }
            Some(Err(CheckpointError::Other | CheckpointError::Format(_))) => {
                let mut previous = Previous::of(directory);
                previous.keep(CHECKPOINT)?;
                previous.path().map(on_kept);
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
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Writes the state if the last attempt is old enough. Returns `true` if it was written.
    pub(crate) fn keep(&mut self, state: impl FnOnce() -> Checkpoint) -> Result<bool, FileError> {
        if self.written.elapsed() < self.pause {
            Ok(false)
        } else {
            self.write(&state()).map(|()| true)
        }
    }

    /// Writes the state in place of the last one, which remains if writing fails.
    pub(crate) fn write(&mut self, state: &Checkpoint) -> Result<(), FileError> {
        let begun = Instant::now();
        let bytes = write_checkpoint(&self.settings, self.frames, state);
        let written = StagedFile::write(self.path.clone(), |out| out.write_all(&bytes))
            .and_then(StagedFile::commit);
        self.pause = self.pause.max(begun.elapsed().div_f64(MAX_WRITING_SHARE));
        self.written = Instant::now();
        written.map(drop)
    }

    /// Removes the file when it is no longer needed.
    pub(crate) fn remove(&self) -> Result<(), FileError> {
        remove(&self.path)
    }
}
