//! The program `bristle`.

mod cli;
mod files;

use std::process::ExitCode;

fn main() -> ExitCode {
    cli::run()
}
