//! `bristle explain`.

use bristle_app::insight::findings::rule;
use bristle_study::input::explain::{all_keys, explain};
use bristle_study::input::schema::input_schema;
use bristle_study::text::layout::wrap;
use clap::Args;

use crate::error::CliError;
use crate::terminal::{print, show, width};

/// Say what a key of the input file means: unit, range, default, and where the default comes from
///
/// KEY is a path such as filament.length_m, its last part, a section, or the id of a finding, such
/// as B003. `bristle explain friction` has ranges of friction coefficients and says what to do
/// about this doubt. Without KEY all keys are listed.
#[derive(Args)]
pub struct ExplainArgs {
    /// The key
    #[arg(value_name = "KEY")]
    key: Option<String>,
    /// Print the JSON schema of input files, with which an editor completes and checks them
    #[arg(long, conflicts_with = "key")]
    schema: bool,
}

/// Runs the command.
pub fn run(arguments: &ExplainArgs) -> Result<(), CliError> {
    if arguments.schema {
        return Ok(print(&input_schema())?);
    }
    if let Some(rule) = arguments.key.as_deref().and_then(rule) {
        let mut text = String::new();
        wrap(width(), &mut text, "", &rule.to_string());
        return Ok(show(text)?);
    }
    let text = match &arguments.key {
        Some(key) => explain(key, width())?,
        None => all_keys(width()),
    };
    Ok(show(text)?)
}
