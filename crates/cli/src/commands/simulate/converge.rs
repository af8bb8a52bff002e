//! Convergence of a contact over segments and tolerance.

use std::io;
use std::process::ExitCode;

use bristle::model::settings::Settings;
use bristle_app::insight::convergence::{ConvergenceError, Plan, converge};
use bristle_app::report::convergence::convergence_text;
use bristle_app::report::figures::{convergence_figures, is_of_convergence};
use bristle_app::run::convergence::{OF_CONVERGENCE, write_convergence};
use bristle_app::run::{RunContext, RunError, StudyRun};
use bristle_study::grid::{CaseResult, Study};
use bristle_study::input::plausibility::unusual;
use bristle_study::text::layout::note;
use bristle_study::text::number::counted;
use bristle_study::text::shown;

use crate::commands::study::LONGEST_FAILURE;
use crate::error::{CliError, SIMULATION_FAILED};
use crate::interrupt::stop_on_interrupt;
use crate::job::JobArgs;
use crate::pictures::draw;
use crate::progress::{Progress, print_object};
use crate::terminal::{say, say_at_the_end, say_written, show, width};
use crate::values::INTERRUPTED;

/// Simulates the study of each setting, and says what it shows.
pub fn run(arguments: &JobArgs) -> Result<ExitCode, CliError> {
    let figures = arguments.figures.figures()?;
    let text = arguments.input.read()?;
    let stated = arguments.document(&text)?.settings()?;
    arguments.input.warn_of(&unusual(&stated))?;
    // Before anything is simulated or written: what is wrong with the settings.
    Plan::new(&stated).map_err(|error| refused(arguments, error))?;
    let _occupied = arguments.occupy(&OF_CONVERGENCE, is_of_convergence)?;
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
    for file in write_convergence(&arguments.out, &convergence)? {
        say_written(&file);
    }
    draw(
        &arguments.out,
        |format| convergence_figures(&convergence, format),
        None,
        &figures,
        is_of_convergence,
    )?;
    if arguments.json {
        print_object(
            "result",
            &serde_json::from_str(&convergence.json()).map_err(io::Error::from)?,
        )?;
    } else {
        show(convergence_text(&convergence, width()))?;
    }
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

fn refused(arguments: &JobArgs, error: ConvergenceError) -> CliError {
    CliError::Convergence {
        path: arguments.input.file.clone(),
        error,
    }
}

/// The results of all cases, or none of them if it is asked to stop.
fn simulate(arguments: &JobArgs, study: Study) -> Result<Vec<CaseResult>, CliError> {
    let resources = arguments.resources.resources();
    arguments.input.check_brushes(&study, resources)?;
    let count = study.case_count();
    let mut run = StudyRun::new(study);
    let progress = Progress::begin(&run, |_| true, arguments.json);
    run.simulate(
        |_| true,
        &RunContext {
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
