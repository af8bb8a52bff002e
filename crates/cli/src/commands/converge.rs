//! `bristle converge`.

use std::process::ExitCode;

use bristle::model::settings::Settings;
use bristle_app::insight::convergence::{ConvergenceError, Plan, converge};
use bristle_app::report::convergence::convergence_text;
use bristle_app::report::figures::{convergence_figures, is_of_convergence};
use bristle_app::run::convergence::{OF_CONVERGENCE, write_convergence};
use bristle_app::run::{Means, RunError, StudyRun};
use bristle_app::store::staged::{occupy, prepare_directory};
use bristle_study::grid::{CaseResult, Study};
use bristle_study::input::plausibility::unusual;
use bristle_study::text::layout::note;
use bristle_study::text::number::counted;
use bristle_study::text::shown;
use clap::Args;

use crate::commands::study::LONGEST_FAILURE;
use crate::error::{CliError, SIMULATION_FAILED};
use crate::interrupt::stop_on_interrupt;
use crate::job::JobArgs;
use crate::pictures::{FIGURES, draw, is_picture};
use crate::progress::Progress;
use crate::terminal::{say, say_at_the_end, say_written, show, width};
use crate::values::{INTERRUPTED, ResourceArgs};

/// Say how many segments and which tolerance a contact needs, and write DIR/converge.csv and .json
///
/// Simulates the contact of [process] with coarser and finer values of one setting after the other:
/// the number of segments, filament.segments, and the tolerance, solver.relative_tolerance. With
/// [brush], filaments touch each other, and the settings are the number of segments, the tolerance
/// that chooses the step, brush.tolerance, and the stiffness k_l between filaments,
/// brush.stiffness_n_m2.
///
/// Prints the force F_n,w for each value with its change against the finest one, what to choose for
/// an error of 1 %, and how good each metric is as stated. Where the finest four numbers of
/// segments agree on the power with which the error falls, and the same number of nodes touches,
/// metrics are extrapolated.
/// DIR/figures/converge.svg and .png show the errors. [study] is ignored, [uncertainty] too without
/// [brush]. A force in place of the depth is reached first, and the depth then kept.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct ConvergeArgs {
    #[command(flatten)]
    job: JobArgs,
    #[command(flatten)]
    resources: ResourceArgs,
    /// Leave out [brush]: simulate a filament alone
    #[arg(long)]
    without_interaction: bool,
}

/// Runs the command.
pub fn run(arguments: &ConvergeArgs) -> Result<ExitCode, CliError> {
    let figures = arguments.job.figures.figures()?;
    let text = arguments.job.input.read()?;
    let stated = text
        .document_alone_if(arguments.without_interaction)?
        .settings()?;
    arguments.job.input.warn_of(&unusual(&stated))?;
    // Before anything is simulated or written: what is wrong with the settings.
    Plan::new(&stated).map_err(|error| refused(arguments, error))?;
    prepare_directory(&arguments.job.out)?;
    let _occupied = occupy(
        &arguments.job.out,
        &[
            ("", &|name| OF_CONVERGENCE.contains(&name)),
            (FIGURES, &is_picture(is_of_convergence)),
        ],
    )?;
    let at_depth = |force: f64, settings: &Settings| {
        let depth = 1e3 * settings.process.penetration_depth_m;
        say(note(&format!(
            "the depth that reaches {force} N as stated, {depth:.4} mm, is the same in all cases"
        )));
    };
    let outcome = converge(
        stated,
        |study| simulate(arguments, study),
        at_depth,
        |error| refused(arguments, error),
    );
    let convergence = match outcome {
        Err(CliError::Run(RunError::Stopped)) => {
            say_at_the_end("stopped: nothing was written");
            return Ok(INTERRUPTED.into());
        }
        outcome => outcome?,
    };
    for file in write_convergence(&arguments.job.out, &convergence)? {
        say_written(&file);
    }
    draw(
        &arguments.job.out,
        |format| convergence_figures(&convergence, format),
        None,
        &figures,
        is_of_convergence,
    )?;
    show(convergence_text(&convergence, width()))?;
    let mut status = ExitCode::SUCCESS;
    for series in &convergence.series {
        for (value, result) in series.values.iter().zip(&series.results) {
            if let Err(error) = result {
                let equation = series.setting().equation(*value);
                say(format_args!(
                    "error: with {equation}: {}",
                    shown(error, LONGEST_FAILURE)
                ));
                status = SIMULATION_FAILED.into();
            }
        }
    }
    Ok(status)
}

fn refused(arguments: &ConvergeArgs, error: ConvergenceError) -> CliError {
    CliError::Convergence {
        path: arguments.job.input.file.clone(),
        error,
    }
}

/// The results of all cases, or none of them if it is asked to stop.
fn simulate(arguments: &ConvergeArgs, study: Study) -> Result<Vec<CaseResult>, CliError> {
    let resources = arguments.resources.resources();
    arguments.job.input.check_brushes(&study, resources)?;
    let count = study.case_count();
    let mut run = StudyRun::new(study);
    let progress = Progress::begin(&run, |_| true, false);
    run.simulate(
        |_| true,
        &Means {
            resources,
            stop: &stop_on_interrupt(),
            observer: &progress,
        },
    )?;
    let results: Option<Vec<CaseResult>> = run.results().iter().cloned().collect();
    let results = results.ok_or(RunError::Stopped)?;
    say(format_args!(
        "{} in {:.2} s",
        counted(count),
        progress.seconds()
    ));
    Ok(results)
}
