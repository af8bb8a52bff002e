//! Filaments that touch each other.

use std::process::ExitCode;
use std::time::Duration;

use super::SimulateArgs;
use crate::error::CliError;
use crate::interrupt::stop_on_interrupt;
use crate::pictures::{draw, is_of_simulation};
use crate::progress::{PassProgress, print_result, show_check};
use crate::terminal::{
    say, say_at_the_end, say_findings, say_kept, say_written, show, show_assumptions,
};
use crate::values::INTERRUPTED;
use bristle::brush::{BrushError, RunOptions};
use bristle::model::settings::Settings;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{JudgedCase, JudgedResult, judge_case};
use bristle_app::report::figures::{Brush, brush_figures};
use bristle_app::report::page::Notes;
use bristle_app::report::tables::{band_line, brush_table};
#[cfg(feature = "vtk")]
use bristle_app::report::vtk::brush_files;
use bristle_app::run::brush::{
    BrushEvent, BrushMeans, BrushRunError, BrushSimulation, BrushStore, CHECKPOINT_PAUSE, FRAMES,
    check_brush, simulate_brush, write_brush,
};
use bristle_app::run::contact::{of_simulation, write_check};
use bristle_app::store::results::write_brush_metrics;
use bristle_app::store::staged::prepare_directory;
use bristle_app::store::vtk_files::VTK;
use bristle_study::grid::check::FINER_BRUSH;
use bristle_study::grid::{Interaction, calibration_band, thread_count};
use bristle_study::input::document::Document;
use bristle_study::input::plausibility::unusual;
use bristle_study::text::layout::note;
use bristle_study::text::shown_path;

/// Name of the simulation in its progress.
const BRUSH_IN_WORDS: &str = "the brush";

impl SimulateArgs {
    fn options(&self) -> RunOptions {
        let resources = self.job.resources.resources();
        RunOptions {
            threads: thread_count(resources.threads),
            frames: self.vtk.map_or(FRAMES, |shapes| shapes as usize),
            memory: resources.memory,
            ..RunOptions::default()
        }
    }
}

/// Simulates the brush, and writes its results.
pub fn run(
    arguments: &SimulateArgs,
    document: &Document<'_>,
    settings: Settings,
) -> Result<ExitCode, CliError> {
    let job = &arguments.job;
    let figures = job.figures.figures()?;
    let unusual = unusual(&settings);
    job.input.warn_of(&unusual)?;
    let _occupied = job.occupy(&of_simulation(), is_of_simulation)?;
    if arguments.vtk.is_some() {
        prepare_directory(&job.out.join(VTK))?;
    }
    let (stop, asked_n) = (stop_on_interrupt(), settings.process.tool_force_n);
    let means = BrushMeans {
        options: arguments.options(),
        stop: &stop,
        store: Some(BrushStore {
            directory: &job.out,
            pause: arguments
                .checkpoint_every
                .map_or(CHECKPOINT_PAUSE, Duration::from_secs),
            restart: job.restart,
        }),
    };
    let mut watch = BrushProgress {
        json: job.json,
        progress: None,
    };
    let simulated = simulate_brush(&settings, &means, &mut |event| watch.observe(event));
    drop(watch);
    let BrushSimulation {
        settings,
        mut result,
        ..
    } = match simulated {
        Err(BrushRunError::Failed(BrushError::Stopped)) => return Ok(INTERRUPTED.into()),
        simulated => simulated.map_err(|error| arguments.failed(error))?,
    };
    let assumptions =
        Assumptions::of_contact(&settings, &document.unstated()).with_material(document.material());
    let findings = job.told(judge_case(&JudgedCase {
        settings: &settings,
        asked_n,
        outcome: Some(JudgedResult {
            metrics: &result.tool,
            statistics: None,
            interaction: Some(&Interaction::of(&result)),
        }),
    }));
    let notes = Notes {
        unusual: &unusual,
        findings: &findings,
        assumptions: &assumptions,
    };
    let band = calibration_band(&settings, &result.tool).unwrap_or_else(|error| {
        say(note(&error));
        None
    });
    let mut metrics = Vec::new();
    write_brush_metrics(&mut metrics, &settings, &result, band.as_ref())?;
    let brush = Brush {
        interaction: Interaction::of(&result),
        filaments: result.filaments.clone(),
        history: std::mem::take(&mut result.history),
        pairs: std::mem::take(&mut result.pairs),
        settings,
    };
    #[cfg(feature = "vtk")]
    let for_vtk = arguments
        .vtk
        .iter()
        .flat_map(|_| brush_files(&brush.settings, &brush.filaments, &result.frames));
    #[cfg(not(feature = "vtk"))]
    let for_vtk = std::iter::empty();
    let written = write_brush(
        &job.out,
        &job.input.short_name(),
        &metrics,
        &brush,
        &result,
        notes,
        for_vtk,
    )?;
    written.iter().for_each(|path| say_written(path));
    draw(
        &job.out,
        |format| brush_figures(&brush, format),
        job.resources.threads.number(),
        &figures,
        is_of_simulation,
    )?;
    if job.json {
        print_result(&metrics, &findings, &brush.settings)?;
    } else {
        let band = band.map_or_else(String::new, |band| band_line(&band));
        show(brush_table(&result) + &band)?;
    }
    say_findings(&findings);
    if !job.json {
        show_assumptions(&assumptions)?;
    }
    if job.check {
        let progress = PassProgress::begin("the check", 0.0, job.json);
        let checked = check_brush(&brush.settings, means.options, &stop, |share| {
            progress.tell(share)
        });
        drop(progress);
        let checked = match checked {
            Err(BrushRunError::Failed(BrushError::Stopped)) => {
                say_at_the_end("stopped: the results are complete, but have not been checked");
                return Ok(INTERRUPTED.into());
            }
            checked => checked.map_err(|error| arguments.failed(error))?,
        };
        say_written(&write_check(&job.out, FINER_BRUSH, &result.tool, &checked)?);
        show_check(FINER_BRUSH, &result.tool, &checked, job.json)?;
    }
    Ok(ExitCode::SUCCESS)
}

impl SimulateArgs {
    /// The error of a brush, with the input file where its settings are to blame.
    fn failed(&self, error: BrushRunError) -> CliError {
        let file = &self.job.input.file;
        match error {
            BrushRunError::Refused(error) => CliError::of(file, error),
            BrushRunError::Failed(error) => CliError::after(file, error),
            BrushRunError::File(error) => error.into(),
            BrushRunError::Journal(error) => error.into(),
            BrushRunError::Checkpoint(error) => error.into(),
        }
    }
}

/// Shows the progress of the brush.
struct BrushProgress {
    json: bool,
    progress: Option<PassProgress>,
}

impl BrushProgress {
    fn observe(&mut self, event: BrushEvent<'_>) {
        match event {
            BrushEvent::Kept(place) => say_kept(place),
            BrushEvent::Begun(share) => {
                self.progress = Some(PassProgress::begin(BRUSH_IN_WORDS, share, self.json));
            }
            BrushEvent::Done(share) => {
                if let Some(progress) = &self.progress {
                    progress.tell(share);
                }
            }
            BrushEvent::Resumed(share, path) => say(format_args!(
                "{} % of the brush are in `{}`, the simulation resumes from there",
                percent(share),
                shown_path(path)
            )),
            BrushEvent::MoreColumns(before, now) => {
                let without = if before == 1 {
                    "1 column has".to_owned()
                } else {
                    format!("{before} columns have")
                };
                say(format_args!(
                    "{without} no steady stretch: simulating {now} columns from the beginning"
                ));
            }
            BrushEvent::NotKept(error) => say(format_args!(
                "warning: {error}\nhelp: the simulation goes on and tries again when the next checkpoint is due; make room, so that it \
                 can be resumed if it is stopped"
            )),
            BrushEvent::Stopped(share, path) => say_at_the_end(format_args!(
                "stopped: {} % of the brush are in `{}`; run the same command again to resume",
                percent(share),
                shown_path(path)
            )),
            BrushEvent::Pressed(depth_m, force_n) => {
                // Its progress is over.
                self.progress = None;
                say(format_args!(
                    "a_e = {:.4} mm: {force_n:.1} N",
                    1e3 * depth_m
                ));
            }
        }
    }
}

/// A share in per cent.
fn percent(share: f64) -> u32 {
    (100.0 * share).floor() as u32
}
