//! The files of one filament's contact, once for the program and for Python.

use std::io;
use std::path::{Path, PathBuf};

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, Sampling, Shape, Simulation};
use bristle_study::grid::check::check_text;

use crate::report::figures::drawn_shapes;
#[cfg(feature = "parquet")]
use crate::report::parquet::write_history_parquet;
use crate::report::view::first_turn;
use crate::run::brush::{CHECKPOINT, OF_BRUSH};
use crate::store::journal_file::JOURNAL;
use crate::store::results::{
    FileHashes, case_text, write_history, write_metrics, write_positions, write_profile,
    write_shapes,
};
use crate::store::staged::{FileError, StagedFile, remove};
use crate::store::vtk_files::{commit_vtk, stage_vtk};

/// Version, settings, and hashes of the other files.
pub const CASE: &str = "case.json";
/// Metrics at a finer tolerance.
pub const CHECK: &str = "check.json";
/// Metrics, also of a brush.
pub const METRICS: &str = "metrics.json";
/// Forces over time, also of a brush.
pub const HISTORY: &str = "history.csv";
/// Work along the profile of the workpiece.
pub const PROFILE: &str = "profile.csv";
/// Filaments along the trim of a tool on which they differ.
pub const POSITIONS: &str = "positions.csv";
/// The shapes that figures show.
pub const SHAPES: &str = "shapes.csv";
/// [`HISTORY`] as Parquet.
pub const HISTORY_PARQUET: &str = "history.parquet";

/// The files that only a contact has. A contact replaces a brush in a directory, and the other way
/// round, as both have metrics and a history.
pub const OF_CONTACT: [&str; 5] = [CASE, PROFILE, POSITIONS, SHAPES, HISTORY_PARQUET];

/// Least number of equally spaced times of a pass from which the shapes in the figures are chosen.
const MIN_SHAPES: usize = 300;
/// Maximum number of turns that each add this number of times.
const MAX_SHOWN_TURNS: usize = 8;

/// All files that the simulation of a contact or a brush writes or removes.
#[must_use]
pub fn of_simulation() -> Vec<&'static str> {
    let shared = [METRICS, HISTORY, CHECKPOINT, CHECK, JOURNAL];
    [&OF_BRUSH[..], &OF_CONTACT, &shared].concat()
}

/// Number of a pass's shapes, of which the caller asks for a few.
#[derive(Clone, Copy, Debug)]
pub struct ShapeTimes {
    count: usize,
    every: usize,
}

impl ShapeTimes {
    /// Returns the times of a pass with these settings, among which are `count` equally spaced
    /// ones. There are more if these are few, so that figures can show the filament while it
    /// touches.
    #[must_use]
    pub fn new(settings: &Settings, count: usize) -> Self {
        let least = MIN_SHAPES * settings.process.turns().at_most().min(MAX_SHOWN_TURNS);
        let every = least.div_ceil(count.max(2) - 1);
        Self { count, every }
    }

    /// Returns the sampling of a pass whose results are written.
    #[must_use]
    pub fn sampling(self, samples: usize) -> Sampling {
        Sampling {
            samples,
            shapes: self.every * (self.count.max(2) - 1) + 1,
            loads: true,
            profile: true,
            alongside: false,
        }
    }

    /// Returns those of `shapes` that the caller asked for.
    #[must_use]
    pub fn chosen(self, shapes: Vec<Shape>) -> Vec<Shape> {
        let chosen = shapes.into_iter().step_by(self.every);
        chosen.take(self.count).collect()
    }
}

/// Returns the shapes of a simulation that figures show: those of its last turn.
#[must_use]
pub fn last_shapes(settings: &Settings, simulation: &Simulation) -> Vec<Shape> {
    let turns = simulation.turn_contact_normal_impulses_n_s.len();
    let last_turn =
        first_turn(settings) + turns.saturating_sub(1) as f64 * Pass::new(settings).turn_time();
    drawn_shapes(&simulation.shapes, last_turn)
}

/// Writes the files of a contact to its directory, which must be occupied, and returns the paths of
/// those to tell of. Removes those of an earlier brush or check. `settings` have the depth that was
/// simulated, `drawn` are its [`last_shapes`], and `for_vtk` names and texts of files for ParaView.
///
/// # Errors
/// If a file cannot be written.
pub fn write_contact(
    directory: &Path,
    settings: &Settings,
    simulation: &Simulation,
    drawn: &[Shape],
    for_vtk: impl Iterator<Item = (String, String)>,
) -> Result<Vec<PathBuf>, FileError> {
    let mut hashes = FileHashes::new();
    let mut stage = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        StagedFile::hashed(directory, name, &mut hashes, write)
    };
    let mut staged = vec![
        stage(METRICS, &|out| write_metrics(out, settings, simulation))?,
        stage(HISTORY, &|out| write_history(out, &simulation.history))?,
        stage(PROFILE, &|out| write_profile(out, &simulation.profile))?,
        stage(SHAPES, &|out| write_shapes(out, drawn))?,
    ];
    let positions = &simulation.positions;
    if !positions.is_empty() {
        staged.push(stage(POSITIONS, &|out| write_positions(out, positions))?);
    }
    let vtk = stage_vtk(directory, for_vtk, &mut hashes)?;
    let case = case_text(settings, &hashes);
    #[cfg(feature = "parquet")]
    staged.push(StagedFile::write(directory.join(HISTORY_PARQUET), |out| {
        write_history_parquet(out, &simulation.history, &case)
    })?);
    StagedFile::text(directory, CASE, &case)?.commit()?;
    let written = staged.into_iter().map(StagedFile::commit);
    let mut written: Vec<PathBuf> = written.collect::<Result<_, _>>()?;
    for name in OF_BRUSH {
        remove(&directory.join(name))?;
    }
    remove(&directory.join(CHECK))?;
    if positions.is_empty() {
        remove(&directory.join(POSITIONS))?;
    }
    if !cfg!(feature = "parquet") {
        remove(&directory.join(HISTORY_PARQUET))?;
    }
    written.extend(commit_vtk(directory, vtk)?);
    Ok(written)
}

/// Writes [`CHECK`]: the changes of all metrics when they were computed `again`, in words.
///
/// # Errors
/// If the file cannot be written.
pub fn write_check(
    directory: &Path,
    again: &str,
    metrics: &Metrics,
    checked: &Metrics,
) -> Result<PathBuf, FileError> {
    StagedFile::text(directory, CHECK, &check_text(again, metrics, checked))?.commit()
}
