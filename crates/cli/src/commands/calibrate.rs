//! `bristle calibrate`.

use std::io;
use std::path::{Path, absolute};
use std::process::ExitCode;

use bristle::model::settings::Settings;
use bristle_app::insight::findings::bias_of_fit;
use bristle_app::report::figures::{calibration_figures, is_of_calibration};
use bristle_app::run::calibration::{
    CALIBRATED, OF_CALIBRATION, calibrated_text, write_calibration,
};
use bristle_app::run::forces::{ForceJournal, JournaledForces};
use bristle_app::store::journal_file::JOURNAL;
use bristle_app::store::staged::{read_table, relative_to};
use bristle_study::calibrate::{
    Calibration, CalibrationContext, FitError, Fitted, Interrupted, MeasurementLimits, Problem,
    STARTS, SilentObserver, calibrate, summary,
};
use bristle_study::input::measured::{read_points, read_radii};
use bristle_study::text::shown_path;
use clap::Args;
use serde_json::json;

use crate::error::CliError;
use crate::input::InputArgs;
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
/// With [brush], filaments touch each other. Each simulated brush is a line of
/// DIR/journal.jsonl: the same command goes on from there after Ctrl-C or a crash.
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
    let figures = arguments.job.figures.figures()?;
    let path = &arguments.job.input.file;
    let refused = |error: String| CliError::of(path, error);
    let text = arguments.job.input.read()?;
    let document = arguments.job.document(&text)?;
    let fitted = arguments
        .fit
        .iter()
        .map(|option| Fitted::parse(option))
        .collect::<Result<Vec<_>, FitError>>();
    let fitted = fitted.map_err(|error| refused(error.to_string()))?;
    let Some((file, format)) = document.measured() else {
        let advice = "there is no section [measured]: add one with `file = \"forces.csv\"`, a table of measured forces, or of edge radii over time";
        return Err(refused(advice.to_owned()));
    };
    let table = relative_to(path, file);
    let read = || Ok::<_, CliError>((read_table(&table)?, table.to_string_lossy()));
    let problem = if fitted.iter().any(Fitted::is_of_edges) {
        let settings = document.settings()?;
        let (text, name) = read()?;
        Problem::of_radii(settings, fitted, read_radii(&text, &name, format)?)
    } else {
        let brushes = document.brushes()?;
        let (text, name) = read()?;
        Problem::new(brushes, fitted, read_points(&text, &name, format)?)
    };
    let problem = problem.map_err(|error| refused(error.to_string()))?;
    let settings: Vec<Settings> = problem
        .brushes
        .iter()
        .map(|brush| brush.settings.clone())
        .collect();
    let _occupied = arguments.job.occupy(&OF_CALIBRATION, is_of_calibration)?;
    let journal = problem
        .has_brush()
        .then(|| ForceJournal::open(&arguments.job.out, arguments.job.restart))
        .transpose()?;
    if let Some(earlier) = journal
        .as_ref()
        .map(|journal| journal.earlier)
        .filter(|earlier| *earlier > 0)
    {
        say(format_args!(
            "{earlier} simulated brushes are in `{}`",
            shown_path(&arguments.job.out.join(JOURNAL))
        ));
    }
    if let Some(kept) = journal.as_ref().and_then(|journal| journal.kept.as_deref()) {
        say_kept(kept);
    }
    let stop = stop_on_interrupt();
    let progress = PassProgress::begin("the calibration", 0.0, arguments.job.json);
    let watch = JournaledForces {
        journal,
        tell: &|share| progress.tell(share),
    };
    let resources = arguments.job.resources.resources();
    let reach = MeasurementLimits {
        max_rpm: arguments.max_rpm,
        max_depth_m: arguments.max_depth_mm.map(|depth| depth / 1e3),
    };
    let outcome = calibrate(
        problem,
        reach,
        CalibrationContext {
            resources,
            stop: &stop,
            observer: &watch,
            starts: STARTS,
        },
    );
    let JournaledForces { mut journal, .. } = watch;
    drop(progress);
    if let Some(journal) = &mut journal {
        journal.settle()?;
    }
    let calibration = match outcome {
        Ok(Some(calibration)) => calibration,
        Ok(None) => {
            return Err(refused(
                "none of the starts can be simulated: narrow the ranges, as in --fit KEY=LOW..HIGH"
                    .to_owned(),
            ));
        }
        Err(Interrupted::Stopped) => {
            let resume = if journal.is_some() {
                "; run the same command again to resume"
            } else {
                ""
            };
            say_at_the_end(format_args!("stopped: nothing was written{resume}"));
            return Ok(INTERRUPTED.into());
        }
        Err(error) => return Err(refused(error.to_string())),
    };
    let is_whole = calibration.undetermined.is_empty();
    let restated = is_whole
        .then(|| restated(arguments, text.text(), &calibration))
        .transpose();
    let restated = restated.map_err(refused)?;
    let name = arguments.job.input.short_name();
    for file in write_calibration(&arguments.job.out, &name, &calibration, restated.as_deref())? {
        say_written(&file);
    }
    draw(
        &arguments.job.out,
        |format| calibration_figures(&calibration, format),
        None,
        &figures,
        is_of_calibration,
    )?;
    if arguments.job.json {
        let result = serde_json::from_str(&calibration.json()).map_err(io::Error::from)?;
        print_object("result", &result)?;
    } else {
        show(summary(&calibration, width()))?;
    }
    if !is_whole {
        say(format_args!(
            "warning: {CALIBRATED} is not written, as not all settings are determined\nhelp: measure where it helps, or state what is known \
             and leave out its --fit"
        ));
    }
    let findings = settings.iter().filter_map(bias_of_fit).collect();
    say_findings(&arguments.job.told(findings));
    if arguments.job.check {
        let change = calibration.change_when_checked(CalibrationContext {
            resources,
            stop: &stop,
            observer: &SilentObserver,
            starts: 0,
        });
        let change = match change {
            Err(Interrupted::Stopped) => {
                say_at_the_end("stopped: the results are complete, but have not been checked");
                return Ok(INTERRUPTED.into());
            }
            change => change.map_err(|error| refused(error.to_string()))?,
        };
        if arguments.job.json {
            print_object("check", &json!({ "largest_change": change }))?;
        } else {
            say(format_args!(
                "simulated with more precision, what was fitted changes by at most {:.2} %",
                100.0 * change
            ));
        }
    }
    Ok(ExitCode::SUCCESS)
}

/// The text of `calibrated.toml`, which states what was fitted.
fn restated(
    arguments: &CalibrateArgs,
    text: &str,
    calibration: &Calibration,
) -> Result<String, String> {
    let InputArgs { file, set, .. } = &arguments.job.input;
    let out = arguments.job.out.clone();
    let moved = |path: &str| from_directory(&relative_to(file, path), &out);
    calibrated_text(&out, text, calibration, set, &moved)
}

/// A path as seen from a directory, with forward slashes.
fn from_directory(path: &Path, directory: &Path) -> String {
    let [path, directory] = [path, directory].map(|path| {
        path.canonicalize()
            .or_else(|_| absolute(path))
            .unwrap_or_else(|_| path.to_owned())
    });
    let common = path
        .components()
        .zip(directory.components())
        .take_while(|(a, b)| a == b)
        .count();
    let up = directory.components().skip(common).map(|_| "..".to_owned());
    let down = path
        .components()
        .skip(common)
        .map(|part| part.as_os_str().to_string_lossy().into_owned());
    up.chain(down).collect::<Vec<_>>().join("/")
}
