//! The program `bristle`: reads files, calls the libraries, writes results. Text for people goes to stderr, data to files or
//! stdout.

mod args;
mod checkpoint_file;
mod commands;
mod error;
mod input;
mod pictures;
mod progress;
mod saved;
mod terminal;
mod values;
mod vtk_files;

use std::env;
use std::process::ExitCode;

use bristle_text::shown;
use clap::Parser;

use args::Cli;
use error::CliError;
use terminal::{print_by, say, start_log};

fn main() -> ExitCode {
    start_log();
    run().unwrap_or_else(|error| {
        say(error.message());
        error.status()
    })
}

fn run() -> Result<ExitCode, CliError> {
    match Cli::try_parse() {
        Ok(cli) => commands::run(cli.command),
        Err(error) if error.use_stderr() => Err(CliError::Call(visible(error))),
        // Help, or the version.
        Err(text) => {
            print_by(|| text.print())?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// The error about a wrong call as if every character of the arguments were visible, and none of them long.
fn visible(error: clap::Error) -> clap::Error {
    /// Longest argument in the message, in characters.
    const LONGEST: usize = 200;
    let arguments = env::args_os().map(|argument| shown(&argument.to_string_lossy(), LONGEST));
    match Cli::try_parse_from(arguments) {
        Err(visible) if visible.use_stderr() => visible,
        _ => error,
    }
}
