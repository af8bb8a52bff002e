//! `bristle calibrate`.

use std::io;
use std::process::ExitCode;

use bristle_app::report::figures::{calibration_figures, is_of_calibration};
use bristle_app::run::calibration::{
    CALIBRATED, CalibrationError, CalibrationOptions, OF_CALIBRATION, calibration_problem,
    run_calibration,
};
use bristle_app::run::forces::ForceJournal;
use bristle_app::store::journal_file::JOURNAL;
use bristle_app::store::staged::{read_table, relative_to};
use bristle_study::calibrate::{Interrupted, MeasurementLimits, summary};
use bristle_study::text::shown_path;
use clap::Args;
use serde_json::json;

use crate::error::CliError;
use crate::interrupt::stop_on_interrupt;
use crate::job::JobArgs;
use crate::pictures::draw;
use crate::progress::{PassProgress, print_object};
use crate::terminal::{say, say_at_the_end, say_findings, say_kept, say_written, show, width};
use crate::values::{INTERRUPTED, parse_positive};

/// Fit settings of a file to measured forces, or to the radii of an edge over time, and write
/// DIR/calibrated.toml
///
/// The section [measured] of the file names a table of measured forces at several speeds and
/// depths. It may have columns of normal force, tangential force, torque and power, each with its
/// standard deviation; relative_std = 0.03 under [measured] states 3 % for all that have none. The
/// values of the settings that --fit names are those with the least sum of squared residuals,
/// whichever of 9 starts leads there.
///
/// Printed are the values with their standard errors, what the forces do not determine, and where
/// to measure next. DIR/calibrated.toml is the file with these values, for every other command: it
/// carries their errors, so that forces come with the band that the calibration leaves. If a
/// setting is not determined, it is not written. DIR/calibration.json has all numbers,
/// DIR/residuals.csv the forces, DIR/calibration.html a page with figures.
///
/// With --fit removal.preston_m2_n the table has radii: columns of time_s or turns, edge_radius_m
/// and edge_radius_std_m. The coefficient is the one with which the edge of the workpiece grows as
/// measured; with --fit workpiece.edge_radius_m the radius at the start is sought, too. Printed is
/// also whether the square root of time fits the radii.
///
/// With [brush], which `bristle new` writes where filaments are packed, they touch each other. Each
/// simulated brush is a line of DIR/journal.jsonl: the same command goes on from there after Ctrl-C
/// or a crash. Without [brush], or with --alone, finding B015 names the bias.
///
/// --check simulates what was fitted again at the values found, passes at a tenth of their tolerance
/// and brushes at a quarter, and says by how much it changes at most.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct CalibrateArgs {
    #[command(flatten)]
    job: JobArgs,
    /// Setting to fit, as filament.youngs_modulus_pa, or with its range, as
    /// contact.friction_coefficient=0..0.6 [default: its usual range]; may be repeated
    #[arg(long, value_name = "KEY", required = true)]
    fit: Vec<String>,
    /// Largest rotational speed at which can be measured next, in rpm [default: the fastest point]
    #[arg(long, value_name = "RPM", value_parser = parse_positive)]
    max_rpm: Option<f64>,
    /// Largest depth at which can be measured next, in mm [default: the deepest point]
    #[arg(long, alias = "max-depth", value_name = "MM", value_parser = parse_positive)]
    max_depth_mm: Option<f64>,
}

/// Runs the command.
pub fn run(arguments: &CalibrateArgs) -> Result<ExitCode, CliError> {
    let job = &arguments.job;
    let figures = job.figures.figures()?;
    let path = &job.input.file;
    let failed = |error| match error {
        CalibrationError::Refused(_) | CalibrationError::Interrupted(_) => {
            CliError::of(path, error)
        }
        error => error.into(),
    };
    let text = job.input.read()?;
    let document = job.document(&text)?;
    let Some((file, format)) = document.measured() else {
        let advice = "there is no section [measured]: add one with `file = \"forces.csv\"`, a table of measured forces, or of edge radii over time";
        return Err(CliError::of(path, advice));
    };
    let table = relative_to(path, file);
    let measured = [&*read_table(&table)?, &*table.to_string_lossy()];
    let problem = calibration_problem(&document, &arguments.fit, measured, format);
    let problem = problem.map_err(failed)?;
    let _occupied = job.occupy(&OF_CALIBRATION, is_of_calibration)?;
    let is_kept = problem.has_brush();
    let stop = stop_on_interrupt();
    let options = CalibrationOptions {
        reach: MeasurementLimits {
            max_rpm: arguments.max_rpm,
            max_depth_m: arguments.max_depth_mm.map(|depth| depth / 1e3),
        },
        resources: job.resources.resources(),
        stop: &stop,
        check: job.check,
        directory: Some(&job.out),
        restart: job.restart,
        file: path,
        name: &job.input.short_name(),
        text: text.text(),
        set: &job.input.set,
    };
    let progress = PassProgress::begin("the calibration", 0.0, job.json);
    let tell = |share| progress.tell(share);
    let outcome = run_calibration(problem, &options, |journal| say_opened(journal, job), &tell);
    drop(progress);
    let outcome = match outcome {
        Err(CalibrationError::Interrupted(Interrupted::Stopped)) => {
            let resume = if is_kept {
                "; run the same command again to resume"
            } else {
                ""
            };
            say_at_the_end(format_args!("stopped: nothing was written{resume}"));
            return Ok(INTERRUPTED.into());
        }
        outcome => outcome.map_err(failed)?,
    };
    let calibration = &outcome.calibration;
    outcome.files.iter().for_each(|file| say_written(file));
    draw(
        &job.out,
        |format| calibration_figures(calibration, format),
        None,
        &figures,
        is_of_calibration,
    )?;
    if job.json {
        let result = serde_json::from_str(&calibration.json()).map_err(io::Error::from)?;
        print_object("result", &result)?;
    } else {
        show(summary(calibration, width()))?;
    }
    if !calibration.undetermined.is_empty() {
        say(format_args!(
            "warning: {CALIBRATED} is not written, as not all settings are determined\nhelp: measure where it helps, or state what is known \
             and leave out its --fit"
        ));
    }
    say_findings(&job.told(outcome.findings));
    match outcome.change {
        None => {}
        Some(Err(Interrupted::Stopped)) => {
            say_at_the_end("stopped: the results are complete, but have not been checked");
            return Ok(INTERRUPTED.into());
        }
        Some(change) => {
            let change = change.map_err(|error| CliError::of(path, error))?;
            if job.json {
                print_object("check", &json!({ "largest_change": change }))?;
            } else {
                say(format_args!(
                    "simulated with more precision, what was fitted changes by at most {:.2} %",
                    100.0 * change
                ));
            }
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// Tells the user what the journal has.
fn say_opened(journal: &ForceJournal, job: &JobArgs) {
    if journal.earlier > 0 {
        say(format_args!(
            "{} simulated brushes are in `{}`",
            journal.earlier,
            shown_path(&job.out.join(JOURNAL))
        ));
    }
    if let Some(kept) = &journal.kept {
        say_kept(kept);
    }
}
