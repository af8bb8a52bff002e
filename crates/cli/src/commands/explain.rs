//! `bristle explain`.

use bristle_study::input::explain::{all_keys, explain};
use clap::Args;

use crate::error::CliError;
use crate::terminal::{show, width};

/// Say what a key of the input file means: unit, range, default, and where the default comes from
///
/// KEY is a path such as filament.length_m, its last part, or a section. Without KEY all keys are
/// listed.
#[derive(Args)]
pub struct ExplainArgs {
    /// The key
    #[arg(value_name = "KEY")]
    key: Option<String>,
}

/// Runs the command.
pub fn run(arguments: &ExplainArgs) -> Result<(), CliError> {
    let text = match &arguments.key {
        Some(key) => explain(key, width())?,
        None => all_keys(width()),
    };
    Ok(show(text)?)
}
