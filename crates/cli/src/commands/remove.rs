//! `bristle remove`.

use std::process::ExitCode;

use bristle_app::report::figures::{is_of_removal, removal_figures};
use bristle_app::report::removal::{removal_text, warnings};
use bristle_app::run::removal::{OF_REMOVAL, write_removal};
use bristle_app::store::staged::{occupy, prepare_directory};
use bristle_study::grid::removal::{RemovalError, remove};
use bristle_study::grid::uncertainty::check;
use bristle_study::input::plausibility::unusual;
use clap::Args;

use crate::error::CliError;
use crate::interrupt::stop_on_interrupt;
use crate::job::JobArgs;
use crate::pictures::{FIGURES, draw, is_picture};
use crate::progress::PassProgress;
use crate::terminal::{say, say_at_the_end, say_written, show, width};
use crate::values::{INTERRUPTED, ResourceArgs};

/// Follow an edge that grows round and filaments that wear, and write DIR/removal.csv
///
/// The section [removal] states how fast material is removed per sliding work, preston_m2_n, or
/// what one trial showed, observed = { edge_radius_m = …, time_s = … }, and when to end, until = {
/// edge_radius_m = … } or turns or time_s. Passes over edges of a few radii tell the work on the
/// edge, and more are simulated until the radius over time no longer changes. With
/// filament_wear_m2_n filaments become shorter, and are simulated so.
///
/// DIR/removal.csv has radius, force and length over time, DIR/edge_work.csv the passes that were
/// simulated, DIR/removal.html a page on which the edge grows round. [study] is ignored.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct RemoveArgs {
    #[command(flatten)]
    job: JobArgs,
    #[command(flatten)]
    resources: ResourceArgs,
}

/// Runs the command.
pub fn run(arguments: &RemoveArgs) -> Result<ExitCode, CliError> {
    let figures = arguments.job.figures.figures()?;
    let text = arguments.job.input.read()?;
    let settings = text.document()?.settings()?;
    arguments.job.input.warn_of(&unusual(&settings))?;
    let refused = |error: RemovalError| CliError::of(&arguments.job.input.file, error);
    check(&settings).map_err(|violation| refused(RemovalError::Failed(violation.to_string())))?;
    prepare_directory(&arguments.job.out)?;
    let is_ours = |name: &str| OF_REMOVAL.contains(&name);
    let _occupied = occupy(
        &arguments.job.out,
        &[("", &is_ours), (FIGURES, &is_picture(is_of_removal))],
    )?;
    let stop = stop_on_interrupt();
    let resources = arguments.resources.resources();
    let progress = PassProgress::begin("the removal", 0.0);
    let outcome = remove(&settings, resources, &stop, &|done, of| {
        progress.tell(done as f64 / of as f64)
    });
    drop(progress);
    let removal = match outcome {
        Err(RemovalError::Stopped) => {
            say_at_the_end("stopped: nothing was written");
            return Ok(INTERRUPTED.into());
        }
        outcome => outcome.map_err(refused)?,
    };
    let name = arguments.job.input.short_name();
    for file in write_removal(&arguments.job.out, &name, &settings, &removal)? {
        say_written(&file);
    }
    draw(
        &arguments.job.out,
        |format| removal_figures(&settings, &removal, format),
        None,
        &figures,
        is_of_removal,
    )?;
    show(removal_text(&settings, &removal, width()))?;
    warnings(&removal).iter().for_each(say);
    Ok(ExitCode::SUCCESS)
}
