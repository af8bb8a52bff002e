//! The program `bristle`.

mod cli;
mod files;
mod pictures;
mod validation;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
