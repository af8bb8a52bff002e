//! `bristle wear`.

use std::process::ExitCode;

use bristle::model::settings::Settings;
use bristle_app::report::figures::{is_of_removal, removal_figures};
use bristle_app::report::removal::{removal_text, warnings};
use bristle_app::run::removal::{OF_REMOVAL, write_removal};
use bristle_study::grid::check::{FINER_PASS, finer_pass};
use bristle_study::grid::removal::{RemovalError, remove};
use bristle_study::grid::uncertainty::check;
use bristle_study::input::plausibility::unusual;
use bristle_study::text::layout::Warning;
use clap::Args;
use serde_json::json;

use crate::error::CliError;
use crate::interrupt::stop_on_interrupt;
use crate::job::JobArgs;
use crate::pictures::draw;
use crate::progress::{PassProgress, print_object};
use crate::terminal::{say, say_at_the_end, say_written, show, width};
use crate::values::INTERRUPTED;

/// Follow an edge that grows round and filaments that wear, and write DIR/removal.csv
///
/// The section [removal] states how fast material is removed per sliding work, preston_m2_n, or
/// what one trial showed, observed = { edge_radius_m = …, time_s = … }, and when to end, until = {
/// edge_radius_m = … } or turns or time_s. Passes over edges of a few radii tell the work on the
/// edge, and more are simulated until the radius over time no longer changes. With
/// filament_wear_m2_n filaments become shorter, and are simulated so.
///
/// DIR/removal.csv has radius, force and length over time, DIR/edge_work.csv the passes that were
/// simulated, DIR/removal.html a page on which the edge grows round. [study] is ignored. --check
/// follows the edge again, with passes at a tenth of their tolerance.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct WearArgs {
    #[command(flatten)]
    job: JobArgs,
}

/// Runs the command.
pub fn run(WearArgs { job }: &WearArgs) -> Result<ExitCode, CliError> {
    let figures = job.figures.figures()?;
    let text = job.input.read()?;
    let settings = job.document(&text)?.settings()?;
    job.input.warn_of(&unusual(&settings))?;
    let refused = |error: RemovalError| CliError::of(&job.input.file, error);
    check(&settings).map_err(|violation| refused(RemovalError::Failed(violation.to_string())))?;
    let _occupied = job.occupy(&OF_REMOVAL, is_of_removal)?;
    let stop = stop_on_interrupt();
    let resources = job.resources.resources();
    let follow = |what, settings: &Settings| {
        let progress = PassProgress::begin(what, 0.0, job.json);
        remove(settings, resources, &stop, &|done, of| {
            progress.tell(done as f64 / of as f64)
        })
    };
    let removal = match follow("the removal", &settings) {
        Err(RemovalError::Stopped) => {
            say_at_the_end("stopped: nothing was written");
            return Ok(INTERRUPTED.into());
        }
        outcome => outcome.map_err(refused)?,
    };
    let name = job.input.short_name();
    for file in write_removal(&job.out, &name, &settings, &removal)? {
        say_written(&file);
    }
    draw(
        &job.out,
        |format| removal_figures(&settings, &removal, format),
        None,
        &figures,
        is_of_removal,
    )?;
    let warnings = warnings(&settings, &removal);
    if job.json {
        let end = removal.rows.last();
        let warnings: Vec<String> = warnings.iter().map(Warning::plain).collect();
        let result = json!({
            "preston_m2_n": removal.preston_m2_n,
            "time_s": end.map(|row| row.time_s),
            "time_interval_95_s": removal.observed_interval.map(|interval| interval.time_s),
            "turns": end.map(|row| row.turns),
            "edge_radius_m": end.map(|row| row.edge_radius_m),
            "warnings": warnings,
        });
        print_object("result", &result)?;
    } else {
        show(removal_text(&settings, &removal, width()))?;
    }
    warnings.iter().for_each(say);
    if job.check {
        let checked = match follow("the check", &finer_pass(&settings)) {
            Err(RemovalError::Stopped) => {
                say_at_the_end("stopped: the results are complete, but have not been checked");
                return Ok(INTERRUPTED.into());
            }
            outcome => outcome.map_err(refused)?,
        };
        let change = removal.largest_change(&checked);
        if job.json {
            print_object(
                "check",
                &json!({ "again": FINER_PASS, "largest_change": change }),
            )?;
        } else {
            say(format_args!(
                "with a {FINER_PASS}, radius and time change by at most {:.2} %",
                100.0 * change
            ));
        }
    }
    Ok(ExitCode::SUCCESS)
}
