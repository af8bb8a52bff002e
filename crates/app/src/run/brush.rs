//! A brush from its settings to the files of its result, once for the program and for Python.

use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::time::Duration;

use bristle::brush::{BrushError, BrushResult, BrushRun, Checkpoint, RunOptions};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{Stop, Unreachable};
use bristle_study::calibrate::forces_of;
use bristle_study::grid::check::finer_brush;
use bristle_study::grid::press_brush;
use thiserror::Error;

use crate::report::figures::Brush;
use crate::report::page::{Notes, brush_page};
use crate::run::checkpoint_file::CheckpointFile;
use crate::run::contact::{CHECK, HISTORY, METRICS, OF_CONTACT};
use crate::run::forces::ForceJournal;
use crate::store::journal_file::JournalFileError;
use crate::store::results::{
    FileHashes, case_text, write_brush_history, write_contacts, write_filaments,
};
use crate::store::staged::{FileError, StagedFile, remove};
use crate::store::vtk_files::{commit_vtk, stage_vtk};

pub use crate::run::checkpoint_file::{CHECKPOINT, UnusableCheckpoint};

/// Version, settings, and hashes of the other files.
pub const BRUSH: &str = "brush.json";
/// One row per filament.
pub const FILAMENTS: &str = "filaments.csv";
/// One row per pair of filaments that touched.
pub const CONTACTS: &str = "contacts.csv";
/// The page.
pub const BRUSH_PAGE: &str = "brush.html";

/// The files that only a brush has.
pub const OF_BRUSH: [&str; 4] = [BRUSH, FILAMENTS, CONTACTS, BRUSH_PAGE];

/// Number of frames, unless the sector is large.
pub const FRAMES: usize = 120;
/// Time between two checkpoints.
pub const CHECKPOINT_PAUSE: Duration = Duration::from_secs(10);

/// Resources and cancellation of a brush.
pub struct BrushMeans<'a> {
    /// Threads, frames and memory.
    pub options: RunOptions,
    /// Ends the simulation at its next step.
    pub stop: &'a Stop,
    /// Place of its state; `None` without one.
    pub store: Option<BrushStore<'a>>,
}

/// Directory of a brush, from which it resumes.
#[derive(Clone, Copy)]
pub struct BrushStore<'a> {
    /// The directory, which must be occupied.
    pub directory: &'a Path,
    /// Shortest time between two checkpoints.
    pub pause: Duration,
    /// `true` if an earlier state is discarded.
    pub restart: bool,
}

/// Progress of a brush.
pub enum BrushEvent<'a> {
    /// Results of other settings or another build were moved to this directory.
    Kept(&'a Path),
    /// A simulation begins, of which this share is done.
    Begun(f64),
    /// It resumed from a checkpoint, which has this share.
    Resumed(f64, &'a Path),
    /// This share is done.
    Done(f64),
    /// Without a steady stretch, the simulation restarts with more columns: their numbers before
    /// and after.
    MoreColumns(usize, usize),
    /// A checkpoint could not be written; the first of several in a row.
    NotKept(&'a FileError),
    /// It was stopped; the checkpoint has this share.
    Stopped(f64, &'a Path),
    /// A step of the search for the depth of a force: depth in m and force in N.
    Pressed(f64, f64),
}

/// Reasons why a brush has no result.
#[derive(Debug, Error)]
pub enum BrushRunError {
    /// Its settings cannot be simulated.
    #[error("{0}")]
    Refused(BrushError),
    /// Its simulation failed.
    #[error("the simulation failed: {0}")]
    Failed(BrushError),
    /// A file cannot be read or written.
    #[error(transparent)]
    File(#[from] FileError),
    /// The journal of forces cannot be used.
    #[error(transparent)]
    Journal(#[from] JournalFileError),
    /// The checkpoint cannot be used.
    #[error(transparent)]
    Checkpoint(#[from] UnusableCheckpoint),
}

impl From<BrushError> for BrushRunError {
    fn from(error: BrushError) -> Self {
        Self::Failed(error)
    }
}

impl From<Unreachable> for BrushRunError {
    fn from(error: Unreachable) -> Self {
        BrushError::from(error).into()
    }
}

/// A simulated brush.
pub struct BrushSimulation {
    /// Its settings, at the depth of the force if they state one.
    pub settings: Settings,
    /// Its result.
    pub result: BrushResult,
    /// The state at its end.
    pub state: Checkpoint,
}

/// Simulates a brush, at the depth of its force if the settings state one. Forces at the depths on
/// the way are in the journal: a search that was stopped goes on at its last depth. The checkpoint
/// stays until [`write_brush`].
///
/// # Errors
/// If it cannot be simulated, is stopped, or a file cannot be written.
pub fn simulate_brush(
    settings: &Settings,
    means: &BrushMeans<'_>,
    observe: &mut dyn FnMut(BrushEvent<'_>),
) -> Result<BrushSimulation, BrushRunError> {
    let is_pressed = settings.process.tool_force_n.is_some();
    let store = means.store.filter(|_| is_pressed);
    let mut journal = store
        .map(|store| ForceJournal::open(store.directory, store.restart))
        .transpose()?;
    if let Some(kept) = journal.as_ref().and_then(|journal| journal.kept.as_deref()) {
        observe(BrushEvent::Kept(kept));
    }
    let found = press_brush(settings, means.stop, |at_depth| {
        let recalled = journal
            .as_ref()
            .and_then(|journal| journal.recall(at_depth));
        if let Some(forces) = recalled {
            return Ok::<_, BrushRunError>((forces[0], None));
        }
        let (result, state) = simulate(at_depth, means, observe)?;
        let force = result.tool.tool_contact_normal_force_n;
        if let (Some(journal), Some(store)) = (&journal, store) {
            observe(BrushEvent::Pressed(
                at_depth.process.penetration_depth_m,
                force,
            ));
            // An error is told when the journal settles.
            let _ = journal.append(at_depth, forces_of(&result.tool));
            remove(&store.directory.join(CHECKPOINT))?;
        }
        Ok((force, Some((result, state))))
    });
    if let Some(journal) = &mut journal {
        journal.settle()?;
    }
    let (settings, result, stiffness) = found?;
    let (mut result, state) = match result {
        Some(result) => result,
        None => simulate(&settings, means, observe)?,
    };
    result.tool.force_stiffness_n_m = stiffness;
    Ok(BrushSimulation {
        settings,
        result,
        state,
    })
}

/// Simulates the brush at its depth, from its checkpoint if there is one.
fn simulate(
    settings: &Settings,
    means: &BrushMeans<'_>,
    observe: &mut dyn FnMut(BrushEvent<'_>),
) -> Result<(BrushResult, Checkpoint), BrushRunError> {
    let options = means.options;
    let opened = means.store.map(|store| {
        CheckpointFile::open(
            store.directory,
            settings,
            options.frames,
            store.pause,
            store.restart,
            |kept| observe(BrushEvent::Kept(kept)),
        )
    });
    let (mut checkpoint, state) = opened.transpose()?.unzip();
    let state = state.flatten();
    let is_resumed = state.is_some();
    let run = match state {
        Some(state) => BrushRun::resume(settings, options, state),
        None => BrushRun::new(settings, options),
    };
    let mut run = run.map_err(BrushRunError::Refused)?;
    if checkpoint.is_none() {
        // One that is kept stops between two steps, where it has a state.
        run = run.until(means.stop);
    }
    if let Some(checkpoint) = checkpoint.as_ref().filter(|_| is_resumed) {
        observe(BrushEvent::Resumed(run.done(), checkpoint.path()));
    }
    observe(BrushEvent::Begun(run.done()));
    let mut columns = run.columns();
    let mut is_kept = true;
    let outcome = loop {
        match run.advance() {
            Ok(true) => {}
            Ok(false) => {
                let state = run.checkpoint();
                break run.finish().map(|result| (result, state));
            }
            Err(error) => break Err(error),
        }
        if run.columns() != columns {
            observe(BrushEvent::MoreColumns(columns, run.columns()));
            columns = run.columns();
            observe(BrushEvent::Begun(run.done()));
        }
        observe(BrushEvent::Done(run.done()));
        let Some(checkpoint) = &mut checkpoint else {
            continue;
        };
        if means.stop.is_requested() {
            checkpoint.write(&run.checkpoint())?;
            observe(BrushEvent::Stopped(run.done(), checkpoint.path()));
            return Err(BrushError::Stopped.into());
        }
        match checkpoint.keep(|| run.checkpoint()) {
            Ok(false) => {}
            Ok(true) => is_kept = true,
            // Of those that follow each other the first is enough.
            Err(error) if is_kept => {
                is_kept = false;
                observe(BrushEvent::NotKept(&error));
                observe(BrushEvent::Begun(run.done()));
            }
            Err(_) => {}
        }
    };
    if let (Err(_), Some(checkpoint)) = (&outcome, &checkpoint) {
        // The same state would lead to the same error.
        checkpoint.remove()?;
    }
    Ok(outcome?)
}

/// Computes the metrics of the brush at a quarter of its tolerance. `done` takes the share that is
/// done.
///
/// # Errors
/// If it cannot be simulated, or is stopped.
pub fn check_brush(
    settings: &Settings,
    options: RunOptions,
    stop: &Stop,
    mut done: impl FnMut(f64),
) -> Result<Metrics, BrushRunError> {
    let options = RunOptions {
        frames: 0,
        ..options
    };
    let run = BrushRun::new(&finer_brush(settings), options);
    let mut run = run.map_err(BrushRunError::Refused)?.until(stop);
    while run.advance()? {
        done(run.done());
    }
    Ok(run.finish()?.tool)
}

/// Writes the files of a brush to its directory, which must be occupied, and returns the paths of
/// those to tell of. Removes those of an earlier contact or check, and the checkpoint. `metrics` is
/// the text of [`METRICS`], `result` has the frames, `name` is that of the input file, and
/// `for_vtk` are names and texts of files for ParaView.
///
/// # Errors
/// If a file cannot be written.
pub fn write_brush(
    directory: &Path,
    name: &str,
    metrics: &[u8],
    brush: &Brush,
    result: &BrushResult,
    notes: Notes<'_>,
    for_vtk: impl Iterator<Item = (String, String)>,
) -> Result<Vec<PathBuf>, FileError> {
    let mut hashes = FileHashes::new();
    let mut stage = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        StagedFile::hashed(directory, name, &mut hashes, write)
    };
    let staged = [
        stage(METRICS, &|out| out.write_all(metrics))?,
        stage(FILAMENTS, &|out| write_filaments(out, &brush.filaments))?,
        stage(HISTORY, &|out| write_brush_history(out, &brush.history))?,
        stage(CONTACTS, &|out| write_contacts(out, &brush.pairs))?,
    ];
    let vtk = stage_vtk(directory, for_vtk, &mut hashes)?;
    let case = case_text(&brush.settings, &hashes);
    let page = brush_page(name, brush, result, notes);
    let page = StagedFile::text(directory, BRUSH_PAGE, &page)?;
    StagedFile::text(directory, BRUSH, &case)?.commit()?;
    let written = staged.into_iter().chain([page]).map(StagedFile::commit);
    let mut written: Vec<PathBuf> = written.collect::<Result<_, _>>()?;
    for name in OF_CONTACT.into_iter().chain([CHECK, CHECKPOINT]) {
        remove(&directory.join(name))?;
    }
    written.extend(commit_vtk(directory, vtk)?);
    Ok(written)
}
