//! Filaments that touch each other.

use std::io::{self, Write};
use std::process::ExitCode;
use std::time::Duration;

use super::SimulateArgs;
use crate::checkpoint_file::{CHECKPOINT, CheckpointFile};
use crate::error::CliError;
use crate::interrupt::stop_on_interrupt;
use crate::pictures::{Figures, draw, is_of_simulation};
use crate::progress::{PassProgress, print_result, show_check};
use crate::saved::{
    BRUSH, BRUSH_PAGE, CHECK, CONTACTS, FILAMENTS, HISTORY, METRICS, OF_BRUSH, OF_CONTACT,
};
use crate::terminal::{
    commit, say, say_at_the_end, say_findings, say_kept, say_written, show, show_assumptions,
};
use crate::values::INTERRUPTED;
use crate::vtk_files::{VTK, commit_vtk, stage_vtk};
use bristle::brush::{BrushError, BrushResult, BrushRun, RunOptions};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{JudgedCase, JudgedResult, judge_case};
use bristle_app::report::figures::{Brush, brush_figures};
use bristle_app::report::page::{Notes, brush_page};
use bristle_app::report::tables::{band_line, brush_table};
use bristle_app::report::vtk::brush_files;
use bristle_app::run::forces::ForceJournal;
use bristle_app::store::journal_file::JOURNAL;
use bristle_app::store::results::{
    FileHashes, case_text, write_brush_history, write_brush_metrics, write_contacts,
    write_filaments,
};
use bristle_app::store::staged::{StagedFile, prepare_directory, remove};
use bristle_study::calibrate::forces_of;
use bristle_study::grid::check::{FINER_BRUSH, check_text, finer_brush};
use bristle_study::grid::{Interaction, calibration_band, press_brush, thread_count};
use bristle_study::input::document::Document;
use bristle_study::input::plausibility::unusual;
use bristle_study::text::layout::note;
use bristle_study::text::shown_path;

/// What is simulated, for its progress.
const BRUSH_IN_WORDS: &str = "the brush";
/// Number of frames, unless the sector is large.
const FRAMES: u64 = 120;

/// Time between two checkpoints in s, unless stated.
const CHECKPOINT_EVERY_S: u64 = 10;

/// Files of a brush, besides figures.
const FILES: [&str; 5] = [METRICS, HISTORY, CHECKPOINT, CHECK, JOURNAL];

impl SimulateArgs {
    fn options(&self) -> RunOptions {
        let resources = self.job.resources.resources();
        RunOptions {
            threads: thread_count(resources.threads),
            frames: self.vtk.unwrap_or(FRAMES) as usize,
            memory: resources.memory,
            ..RunOptions::default()
        }
    }
}

/// Why a simulation ended early.
enum Halt {
    /// It was asked to; the user knows.
    Stopped,
    Failed(CliError),
}

impl<E: Into<CliError>> From<E> for Halt {
    fn from(error: E) -> Self {
        match error.into() {
            CliError::BrushFailed(error) if matches!(*error, BrushError::Stopped) => Self::Stopped,
            error => Self::Failed(error),
        }
    }
}

/// Simulates the brush, and writes its results.
pub fn run(
    arguments: &SimulateArgs,
    document: &Document<'_>,
    settings: Settings,
) -> Result<ExitCode, CliError> {
    match simulate_and_write(arguments, document, settings) {
        Ok(()) => Ok(ExitCode::SUCCESS),
        Err(Halt::Stopped) => Ok(INTERRUPTED.into()),
        Err(Halt::Failed(error)) => Err(error),
    }
}

fn simulate_and_write(
    arguments: &SimulateArgs,
    document: &Document<'_>,
    settings: Settings,
) -> Result<(), Halt> {
    let job = &arguments.job;
    let figures = job.figures.figures()?;
    let unusual = unusual(&settings);
    job.input.warn_of(&unusual)?;
    let results = [&OF_BRUSH[..], &OF_CONTACT, &FILES].concat();
    let _occupied = job.occupy(&results, is_of_simulation)?;
    if arguments.vtk.is_some() {
        prepare_directory(&job.out.join(VTK))?;
    }
    let (stop, force_n) = (stop_on_interrupt(), settings.process.tool_force_n);
    let (settings, result, checkpoint) = pressed(arguments, &settings, &stop)?;
    let metrics = result.tool.clone();
    let assumptions =
        Assumptions::of_contact(&settings, &document.unstated()).with_material(document.material());
    let findings = job.told(judge_case(&JudgedCase {
        settings: &settings,
        asked_n: force_n,
        outcome: Some(JudgedResult {
            metrics: &metrics,
            statistics: None,
            interaction: Some(&Interaction::of(&result)),
        }),
    }));
    let notes = Notes {
        unusual: &unusual,
        findings: &findings,
        assumptions: &assumptions,
    };
    let (metrics_text, table) =
        write_results(arguments, settings.clone(), result, notes, &figures)?;
    checkpoint.remove()?;
    if job.json {
        print_result(&metrics_text, &findings, &settings)?;
    } else {
        show(table)?;
    }
    say_findings(&findings);
    if !job.json {
        show_assumptions(&assumptions)?;
    }
    if job.check {
        check(arguments, &settings, &metrics, &stop)?;
    }
    Ok(())
}

/// The brush with its settings, which have the depth of the force if they state one. Forces at the
/// depths on the way are in the journal: a search that was stopped goes on at its last depth.
fn pressed(
    arguments: &SimulateArgs,
    settings: &Settings,
    stop: &Stop,
) -> Result<(Settings, BrushResult, CheckpointFile), Halt> {
    let job = &arguments.job;
    let mut journal = settings
        .process
        .tool_force_n
        .is_some()
        .then(|| ForceJournal::open(&job.out, job.restart))
        .transpose()?;
    if let Some(kept) = journal.as_ref().and_then(|journal| journal.kept.as_deref()) {
        say_kept(kept);
    }
    let found = press_brush(settings, stop, |at_depth| {
        let recalled = journal
            .as_ref()
            .and_then(|journal| journal.recall(at_depth));
        if let Some(forces) = recalled {
            return Ok::<_, Halt>((forces[0], None));
        }
        let (result, checkpoint) = simulate(arguments, at_depth, stop)?;
        let force = result.tool.tool_contact_normal_force_n;
        if let Some(journal) = &journal {
            let depth = 1e3 * at_depth.process.penetration_depth_m;
            say(format_args!("a_e = {depth:.4} mm: {force:.1} N"));
            // An error is told when the journal settles.
            let _ = journal.append(at_depth, forces_of(&result.tool));
            checkpoint.remove()?;
        }
        Ok((force, Some((result, checkpoint))))
    });
    if let Some(journal) = &mut journal {
        journal.settle()?;
    }
    let (settings, result, stiffness) = found?;
    let (mut result, checkpoint) = match result {
        Some(result) => result,
        None => simulate(arguments, &settings, stop)?,
    };
    result.tool.force_stiffness_n_m = stiffness;
    Ok((settings, result, checkpoint))
}

/// Simulates the brush, from its checkpoint if there is one.
fn simulate(
    arguments: &SimulateArgs,
    settings: &Settings,
    stop: &Stop,
) -> Result<(BrushResult, CheckpointFile), Halt> {
    let options = arguments.options();
    let pause = Duration::from_secs(arguments.checkpoint_every.unwrap_or(CHECKPOINT_EVERY_S));
    let (mut checkpoint, state) = CheckpointFile::open(
        &arguments.job.out,
        settings,
        options.frames,
        pause,
        arguments.job.restart,
    )?;
    let json = arguments.job.json;
    let is_resumed = state.is_some();
    let run = match state {
        Some(state) => BrushRun::resume(settings, options, state),
        None => BrushRun::new(settings, options),
    };
    let mut run = run.map_err(|error| CliError::of(&arguments.job.input.file, error))?;
    if is_resumed {
        let (done, path) = (percent(&run), shown_path(checkpoint.path()));
        say(format_args!(
            "{done} % of the brush are in `{path}`, the simulation resumes from there"
        ));
    }
    let mut progress = PassProgress::begin(BRUSH_IN_WORDS, run.done(), json);
    let mut columns = run.columns();
    let mut is_kept = true;
    let outcome = loop {
        match run.advance() {
            Ok(true) => {}
            Ok(false) => {
                break run
                    .finish()
                    .map_err(|error| CliError::after(&arguments.job.input.file, error));
            }
            Err(error) => break Err(error.into()),
        }
        if run.columns() != columns {
            let now = run.columns();
            let without = if columns == 1 {
                "1 column has".to_owned()
            } else {
                format!("{columns} columns have")
            };
            say(format_args!(
                "{without} no steady stretch: simulating {now} columns from the beginning"
            ));
            columns = now;
            progress = PassProgress::begin(BRUSH_IN_WORDS, run.done(), json);
        }
        progress.tell(run.done());
        if stop.is_requested() {
            checkpoint.write(&run.checkpoint())?;
            let (done, path) = (percent(&run), shown_path(checkpoint.path()));
            say_at_the_end(format_args!(
                "stopped: {done} % of the brush are in `{path}`; run the same command again to resume"
            ));
            return Err(Halt::Stopped);
        }
        match checkpoint.keep(|| run.checkpoint()) {
            Ok(false) => {}
            Ok(true) => is_kept = true,
            // Of those that follow each other the first is enough.
            Err(error) if is_kept => {
                is_kept = false;
                say(format_args!(
                    "warning: {error}\nhelp: the simulation goes on and tries again when the next checkpoint is due; make room, so that it \
                     can be resumed if it is stopped"
                ));
                progress = PassProgress::begin(BRUSH_IN_WORDS, run.done(), json);
            }
            Err(_) => {}
        }
    };
    match outcome {
        Ok(result) => Ok((result, checkpoint)),
        Err(error) => {
            // The same state would lead to the same error.
            checkpoint.remove()?;
            Err(error.into())
        }
    }
}

/// Simulates the brush at a quarter of its tolerance, and says how its `metrics` change.
fn check(
    arguments: &SimulateArgs,
    settings: &Settings,
    metrics: &Metrics,
    stop: &Stop,
) -> Result<(), Halt> {
    let options = RunOptions {
        frames: 0,
        ..arguments.options()
    };
    let run = BrushRun::new(&finer_brush(settings), options);
    let mut run = run.map_err(|error| CliError::of(&arguments.job.input.file, error))?;
    let progress = PassProgress::begin("the check", 0.0, arguments.job.json);
    while run.advance()? {
        progress.tell(run.done());
        if stop.is_requested() {
            say_at_the_end("stopped: the results are complete, but have not been checked");
            return Err(Halt::Stopped);
        }
    }
    drop(progress);
    let checked = run
        .finish()
        .map_err(|error| CliError::after(&arguments.job.input.file, error))?
        .tool;
    commit([StagedFile::text(
        &arguments.job.out,
        CHECK,
        &check_text(FINER_BRUSH, metrics, &checked),
    )?])?;
    show_check(FINER_BRUSH, metrics, &checked, arguments.job.json)?;
    Ok(())
}

/// What is done, in per cent.
fn percent(run: &BrushRun) -> u32 {
    (100.0 * run.done()).floor() as u32
}

/// Writes all results and tells the user. Returns the text of the metrics, and the table of the
/// results.
fn write_results(
    arguments: &SimulateArgs,
    settings: Settings,
    mut result: BrushResult,
    notes: Notes<'_>,
    figures: &Figures,
) -> Result<(Vec<u8>, String), CliError> {
    let mut hashes = FileHashes::new();
    let band = calibration_band(&settings, &result.tool).unwrap_or_else(|error| {
        say(note(&error));
        None
    });
    let mut metrics = Vec::new();
    write_brush_metrics(&mut metrics, &settings, &result, band.as_ref())?;
    let mut stage = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        StagedFile::hashed(&arguments.job.out, name, &mut hashes, write)
    };
    let staged = [
        stage(METRICS, &|out| out.write_all(&metrics))?,
        stage(FILAMENTS, &|out| write_filaments(out, &result.filaments))?,
        stage(HISTORY, &|out| write_brush_history(out, &result.history))?,
        stage(CONTACTS, &|out| write_contacts(out, &result.pairs))?,
    ];
    let for_vtk = arguments
        .vtk
        .map(|_| brush_files(&settings, &result.filaments, &result.frames));
    let vtk = stage_vtk(
        &arguments.job.out,
        for_vtk.into_iter().flatten(),
        &mut hashes,
    )?;
    let case = case_text(&settings, &hashes);
    let brush = Brush {
        interaction: Interaction::of(&result),
        filaments: result.filaments.clone(),
        history: std::mem::take(&mut result.history),
        pairs: std::mem::take(&mut result.pairs),
        settings,
    };
    let name = arguments.job.input.short_name();
    let page = StagedFile::text(
        &arguments.job.out,
        BRUSH_PAGE,
        &brush_page(&name, &brush, &result, notes),
    )?;
    StagedFile::text(&arguments.job.out, BRUSH, &case)?.commit()?;
    commit(staged.into_iter().chain([page]))?;
    // Of a contact that was simulated in the same directory.
    for name in OF_CONTACT {
        remove(&arguments.job.out.join(name))?;
    }
    // Of an earlier result.
    remove(&arguments.job.out.join(CHECK))?;
    commit_vtk(&arguments.job.out, vtk)?
        .iter()
        .for_each(|path| say_written(path));
    let threads = arguments.job.resources.threads.number();
    draw(
        &arguments.job.out,
        |format| brush_figures(&brush, format),
        threads,
        figures,
        is_of_simulation,
    )?;
    let band = band.map_or_else(String::new, |band| band_line(&band));
    Ok((metrics, brush_table(&result) + &band))
}
