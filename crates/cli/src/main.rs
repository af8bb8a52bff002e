//! The program `bristle`: reads files, calls the libraries, writes results. Results go to files and
//! stdout, all else to stderr.

mod args;
mod commands;
mod error;
mod input;
mod interrupt;
mod job;
mod pictures;
mod progress;
mod progress_lines;
mod saved;
mod terminal;
mod values;

use std::env;
use std::ffi::OsString;
use std::process::ExitCode;

use bristle_study::text::shown;
use clap::{CommandFactory, FromArgMatches};

use args::{Cli, OVERVIEW};
use error::CliError;
use terminal::{print, print_by, say, start_log, width};

/// Maximum width of the help in columns: longer lines are hard to read.
const MAX_HELP_COLUMNS: usize = 100;

fn main() -> ExitCode {
    start_log();
    run().unwrap_or_else(|error| {
        say(error.message());
        error.status()
    })
}

fn run() -> Result<ExitCode, CliError> {
    if env::args_os().len() <= 1 {
        print(OVERVIEW)?;
        return Ok(ExitCode::SUCCESS);
    }
    match parse(env::args_os()) {
        Ok(cli) => cli.command.run(),
        Err(error) if error.use_stderr() => Err(CliError::Call(visible(error))),
        // Help, or the version.
        Err(text) => {
            print_by(|| text.print())?;
            Ok(ExitCode::SUCCESS)
        }
    }
}

/// Parses the arguments of a call. Help and messages fit into the terminal.
fn parse(arguments: impl Iterator<Item = OsString>) -> Result<Cli, clap::Error> {
    let mut command = Cli::command().term_width(width().min(MAX_HELP_COLUMNS));
    let matches = command.try_get_matches_from_mut(arguments)?;
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// Returns the error of a wrong call with every character of the arguments visible and every
/// argument shortened.
fn visible(error: clap::Error) -> clap::Error {
    /// Maximum characters of an argument in the message.
    const MAX_ARGUMENT_CHARS: usize = 200;
    let arguments = env::args_os()
        .map(|argument| shown(&argument.to_string_lossy(), MAX_ARGUMENT_CHARS).into());
    match parse(arguments) {
        Err(visible) if visible.use_stderr() => visible,
        _ => error,
    }
}
