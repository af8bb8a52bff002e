//! The program `bristle`.

mod cli;
mod files;
mod journal_file;
mod pictures;
mod progress;
mod saved;
mod terminal;
mod validation;
mod vtk_files;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
