//! `bristle brush`.

use std::io;
use std::process::ExitCode;
use std::time::Duration;

use bristle::brush::{BrushError, BrushResult, BrushRun, RunOptions};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::warnings::{of_brush, of_force};
use bristle_app::report::figures::{Brush, brush_figures};
use bristle_app::report::page::{Notes, brush_page};
use bristle_app::report::tables::{band_line, brush_table, check_table};
use bristle_app::report::vtk::{MAX_SHAPES, brush_files, is_file_name};
use bristle_app::store::results::{
    FileHashes, case_text, write_brush_history, write_brush_metrics, write_contacts,
    write_filaments,
};
use bristle_app::store::staged::{StagedFile, occupy, prepare_directory, remove};
use bristle_study::grid::check::{FINER_BRUSH, check_text, finer_brush};
use bristle_study::grid::{Interaction, calibration_band, press_brush, thread_count};
use bristle_study::input::plausibility::unusual;
use bristle_study::text::shown_path;
use clap::Args;

use crate::checkpoint_file::{CHECKPOINT, CheckpointFile};
use crate::error::CliError;
use crate::interrupt::stop_on_interrupt;
use crate::job::JobArgs;
use crate::pictures::{FIGURES, Figures, draw, is_of_simulation, is_picture};
use crate::progress::PassProgress;
use crate::saved::{
    BRUSH, BRUSH_PAGE, CHECK, CONTACTS, FILAMENTS, HISTORY, METRICS, OF_BRUSH, OF_CONTACT,
};
use crate::terminal::{commit, say, say_at_the_end, say_written, show, show_assumptions};
use crate::values::{INTERRUPTED, MemoryArgs, ThreadArgs};
use crate::vtk_files::{VTK, commit_vtk, stage_vtk};

/// What is simulated, for its progress.
const BRUSH_IN_WORDS: &str = "the brush";
/// Number of frames, unless the sector is large.
const FRAMES: u64 = 120;

/// Simulate the filaments of [brush], which touch each other, and write DIR/metrics.json,
/// filaments.csv and a page
///
/// The section [brush] of the file states the arrangement of the filaments and their contact. With
/// [brush] alone all defaults hold. A sector of the brush passes the workpiece. Metrics are taken
/// from the columns in its middle, where the impulse no longer changes from column to column. If
/// there are none, the sector is simulated again with more columns; if the file states their
/// number, the error says how many are needed.
///
/// metrics.json is a flat object with the metrics of the tool, what interaction changes, and the
/// columns that count. filaments.csv has the metrics of each filament; column 0 meets the workpiece
/// first. history.csv has the forces of the sector over time, and contacts.csv where and how
/// strongly filaments press on each other. brush.html is a page with the sector in motion, and
/// DIR/figures has figures. [study] is ignored: `bristle study` simulates a brush for each of its
/// cases. A simulation of more than 2 s shows its progress on a terminal, and one of more than 10 s
/// elsewhere, in a line now and then.
///
/// The simulation can be stopped at any moment, by Ctrl-C or by a crash. The same command goes on
/// from DIR/checkpoint.bin, where the state is written every 10 s and on Ctrl-C. The results are
/// the same to the bit. A state of other settings or another build of Bristle is refused; --restart
/// discards it.
///
/// --check simulates the brush again at a quarter of its tolerance and prints by how much each
/// metric changes.
///
/// --vtk writes all frames for ParaView: open DIR/vtk/brush.pvd.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct BrushArgs {
    #[command(flatten)]
    job: JobArgs,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Number of equally spaced times in the page and for ParaView, at most; large sectors have
    /// fewer
    #[arg(
        long,
        value_name = "N",
        default_value_t = FRAMES,
        value_parser = clap::value_parser!(u64).range(2..=MAX_SHAPES as u64),
    )]
    frames: u64,
    /// Write the frames to DIR/vtk, for ParaView
    #[arg(long)]
    vtk: bool,
    #[command(flatten)]
    memory: MemoryArgs,
    /// Discard DIR/checkpoint.bin and simulate from the beginning
    #[arg(long)]
    restart: bool,
    /// Time between two checkpoints, in s
    #[arg(long, value_name = "SECONDS", default_value_t = 10, value_parser = clap::value_parser!(u64).range(0..=1 << 20))]
    checkpoint_every: u64,
    /// Simulate again at a quarter of the tolerance, and say what that changes, also in
    /// DIR/check.json
    #[arg(long)]
    check: bool,
}

impl BrushArgs {
    fn options(&self) -> RunOptions {
        RunOptions {
            threads: thread_count(self.threads.number()),
            frames: self.frames as usize,
            memory: self.memory.limit(),
            ..RunOptions::default()
        }
    }
}

/// Runs the command.
pub fn run(arguments: &BrushArgs) -> Result<ExitCode, CliError> {
    let figures = arguments.job.figures.figures()?;
    let text = arguments.job.input.read()?;
    let document = text.document()?;
    let settings = document.settings()?;
    if settings.brush.is_none() {
        let error = "there is no section [brush]; add it, alone if all its defaults are right";
        return Err(CliError::of(&arguments.job.input.file, error));
    }
    let unusual = unusual(&settings);
    arguments.job.input.warn_of(&unusual)?;
    prepare_directory(&arguments.job.out)?;
    let results = [
        &OF_BRUSH[..],
        &OF_CONTACT,
        &[METRICS, HISTORY, CHECKPOINT, CHECK],
    ]
    .concat();
    let _occupied = occupy(
        &arguments.job.out,
        &[
            ("", &|name| results.contains(&name)),
            (FIGURES, &is_picture(is_of_simulation)),
            (VTK, &is_file_name),
        ],
    )?;
    if arguments.vtk {
        prepare_directory(&arguments.job.out.join(VTK))?;
    }
    let (stop, force_n) = (stop_on_interrupt(), settings.process.tool_force_n);
    let Some((settings, stiffness)) = at_depth(arguments, settings, &stop)? else {
        return Ok(INTERRUPTED.into());
    };
    let Some((mut result, checkpoint)) = simulate(arguments, &settings, &stop)? else {
        return Ok(INTERRUPTED.into());
    };
    result.tool.force_stiffness_n_m = stiffness;
    let metrics = result.tool.clone();
    let assumptions =
        Assumptions::of_contact(&settings, &document.unstated()).with_material(document.material());
    let notes = Notes {
        unusual: &unusual,
        assumptions: &assumptions,
    };
    let warnings = of_brush(&settings, &metrics, &Interaction::of(&result));
    let table = write_results(arguments, settings.clone(), result, notes, &figures)?;
    checkpoint.remove()?;
    show(table)?;
    warnings.iter().for_each(say);
    of_force(force_n, &metrics).iter().for_each(say);
    show_assumptions(&assumptions)?;
    if arguments.check && !check(arguments, &settings, &metrics, &stop)? {
        return Ok(INTERRUPTED.into());
    }
    Ok(ExitCode::SUCCESS)
}

/// The settings with the depth at which the brush presses with the force that they state, and the
/// stiffness of the force there (N/m). They are as they were, and the stiffness is zero, where they
/// state a depth. `None` if Ctrl-C has stopped the search.
fn at_depth(
    arguments: &BrushArgs,
    settings: Settings,
    stop: &Stop,
) -> Result<Option<(Settings, f64)>, CliError> {
    if settings.process.tool_force_n.is_none() {
        return Ok(Some((settings, 0.0)));
    }
    let found = press_brush(&settings, stop, |at_depth| {
        let mut run = BrushRun::new(
            at_depth,
            RunOptions {
                frames: 0,
                ..arguments.options()
            },
        )?
        .until(stop);
        let depth = format!("a_e = {:.4} mm", 1e3 * at_depth.process.penetration_depth_m);
        let progress = PassProgress::begin(BRUSH_IN_WORDS, 0.0);
        while run.advance()? {
            progress.tell(run.done());
        }
        let result = run.finish()?;
        say(format_args!(
            "{depth}: {:.1} N",
            result.tool.tool_contact_normal_force_n
        ));
        Ok(result)
    });
    match found {
        Ok((at_depth, result)) => Ok(Some((at_depth, result.tool.force_stiffness_n_m))),
        Err(BrushError::Stopped) => {
            say_at_the_end("stopped in the search for the depth; the same command begins it again");
            Ok(None)
        }
        Err(error) => Err(CliError::BrushFailed(Box::new(error))),
    }
}

/// Simulates the brush, from its checkpoint if there is one. `None` if Ctrl-C has stopped it.
fn simulate<'a>(
    arguments: &BrushArgs,
    settings: &'a Settings,
    stop: &Stop,
) -> Result<Option<(BrushResult, CheckpointFile<'a>)>, CliError> {
    let options = arguments.options();
    let pause = Duration::from_secs(arguments.checkpoint_every);
    let (mut checkpoint, state) = CheckpointFile::open(
        &arguments.job.out,
        settings,
        options.frames,
        pause,
        arguments.restart,
    )?;
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
    let mut progress = PassProgress::begin(BRUSH_IN_WORDS, run.done());
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
            Err(error) => break Err(CliError::BrushFailed(Box::new(error))),
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
            progress = PassProgress::begin(BRUSH_IN_WORDS, run.done());
        }
        progress.tell(run.done());
        if stop.is_requested() {
            checkpoint.write(&run.checkpoint())?;
            let (done, path) = (percent(&run), shown_path(checkpoint.path()));
            say_at_the_end(format_args!(
                "stopped: {done} % of the brush are in `{path}`; run the same command again to resume"
            ));
            return Ok(None);
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
                progress = PassProgress::begin(BRUSH_IN_WORDS, run.done());
            }
            Err(_) => {}
        }
    };
    match outcome {
        Ok(result) => Ok(Some((result, checkpoint))),
        Err(error) => {
            // The same state would lead to the same error.
            checkpoint.remove()?;
            Err(error)
        }
    }
}

/// Simulates the brush at a quarter of its tolerance, and says how its `metrics` change. Returns
/// false if Ctrl-C has stopped it.
fn check(
    arguments: &BrushArgs,
    settings: &Settings,
    metrics: &Metrics,
    stop: &Stop,
) -> Result<bool, CliError> {
    let options = RunOptions {
        frames: 0,
        ..arguments.options()
    };
    let run = BrushRun::new(&finer_brush(settings), options);
    let mut run = run.map_err(|error| CliError::of(&arguments.job.input.file, error))?;
    let progress = PassProgress::begin("the check", 0.0);
    while run
        .advance()
        .map_err(|error| CliError::BrushFailed(Box::new(error)))?
    {
        progress.tell(run.done());
        if stop.is_requested() {
            say_at_the_end("stopped: the results are complete, but have not been checked");
            return Ok(false);
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
    show(format_args!(
        "\n{}",
        check_table(FINER_BRUSH, metrics, &checked)
    ))?;
    Ok(true)
}

/// What is done, in per cent.
fn percent(run: &BrushRun) -> u32 {
    (100.0 * run.done()).floor() as u32
}

/// Writes all results and tells the user. Returns the table of the results.
fn write_results(
    arguments: &BrushArgs,
    settings: Settings,
    mut result: BrushResult,
    notes: Notes<'_>,
    figures: &Figures,
) -> Result<String, CliError> {
    let mut hashes = FileHashes::new();
    let band = calibration_band(&settings, &result.tool);
    let mut stage = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        StagedFile::hashed(&arguments.job.out, name, &mut hashes, write)
    };
    let staged = [
        stage(METRICS, &|out| {
            write_brush_metrics(out, &settings, &result, band.as_ref())
        })?,
        stage(FILAMENTS, &|out| write_filaments(out, &result.filaments))?,
        stage(HISTORY, &|out| write_brush_history(out, &result.history))?,
        stage(CONTACTS, &|out| write_contacts(out, &result.pairs))?,
    ];
    let for_vtk = arguments
        .vtk
        .then(|| brush_files(&settings, &result.filaments, &result.frames));
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
    let threads = arguments.threads.number();
    draw(
        &arguments.job.out,
        |format| brush_figures(&brush, format),
        threads,
        figures,
        is_of_simulation,
    )?;
    let band = band.map_or_else(String::new, |band| band_line(&band));
    Ok(brush_table(&result) + &band)
}
