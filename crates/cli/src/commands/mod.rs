//! The commands, one file per command.

use std::process::ExitCode;

use bristle_input::schema::input_schema;

use crate::args::Command;
use crate::error::CliError;
use crate::terminal::print;

pub mod advise;
pub mod brush;
pub mod calibrate;
pub mod compare;
pub mod compare_studies;
pub mod completions;
pub mod converge;
pub mod derive;
pub mod evaluate;
pub mod explain;
pub mod merge;
pub mod new;
pub mod plot;
pub mod remove;
pub mod simulate;
pub mod study;
pub mod validate;

/// Runs a command.
pub fn run(command: Command) -> Result<ExitCode, CliError> {
    match command {
        Command::New(arguments) => new::run(&arguments),
        Command::Explain(arguments) => explain::run(&arguments),
        Command::Study(arguments) => study::run(&arguments),
        Command::Merge(arguments) => merge::run(&arguments),
        Command::Simulate(arguments) => simulate::run(&arguments),
        Command::Brush(arguments) => brush::run(&arguments),
        Command::Converge(arguments) => converge::run(&arguments),
        Command::Calibrate(arguments) => calibrate::run(&arguments),
        Command::Remove(arguments) => remove::run(&arguments),
        Command::Evaluate(arguments) => evaluate::run(&arguments),
        Command::Derive(arguments) => derive::run(&arguments),
        Command::Compare(arguments) => compare::run(&arguments),
        Command::CompareStudies(arguments) => compare_studies::run(&arguments),
        Command::Validate(arguments) => validate::run(&arguments),
        Command::Plot(arguments) => plot::run(&arguments),
        Command::Advise(arguments) => advise::run(&arguments),
        Command::Completions(arguments) => completions::print_completions(&arguments),
        Command::Man(arguments) => completions::write_manual(&arguments),
        Command::Schema => {
            print(&input_schema())?;
            Ok(ExitCode::SUCCESS)
        }
    }
}
