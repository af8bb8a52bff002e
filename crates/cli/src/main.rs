//! The program `bristle`: reads files, calls the libraries, writes results. Text for people goes to stderr, data to files or
//! stdout.

mod args;
mod commands;
mod error;
mod files;
mod journal_file;
mod pictures;
mod progress;
mod saved;
mod terminal;
mod values;
mod vtk_files;

use std::process::ExitCode;

use clap::Parser;

use args::Cli;
use terminal::{say, start_log};

fn main() -> ExitCode {
    start_log();
    commands::run(Cli::parse().command).unwrap_or_else(|error| {
        say(format_args!("error: {error}"));
        error.status()
    })
}
