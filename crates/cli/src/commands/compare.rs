//! `bristle compare`.

use std::path::PathBuf;
use std::process::ExitCode;

use bristle_app::store::staged::read_text;
use bristle_equations::comparison::{MAX_GRAPH_BYTES, States, compare_graph};
use clap::Args;

use crate::error::CliError;
use crate::terminal::show;

/// Exit status of a comparison that found a deviation.
const DISAGREEMENT: u8 = 1;
/// Most states that a comparison may ask for.
const MAX_STATES: u64 = 100_000;

/// Compare a graph from another engine with the built-in derivation, output by output, at random
/// states
///
/// GRAPH.json holds either the whole equations for some number of segments, or the kernels of the
/// solver. derivations/ has such graphs and the scripts that make them; docs/library.md
/// describes the format. The table shows the largest deviation of each output, relative to its
/// size. The exit status is 1 if one deviates by more than 1e-12.
#[derive(Args)]
pub struct CompareArgs {
    /// The graph
    #[arg(value_name = "GRAPH.json")]
    file: PathBuf,
    /// Number of states
    #[arg(long, value_name = "N", default_value_t = 1000, value_parser = clap::value_parser!(u64).range(1..=MAX_STATES))]
    states: u64,
    /// Seed of the states
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    seed: u64,
    /// Leave out straight states, at which springs stated with the arc cosine are singular
    #[arg(long)]
    bent: bool,
}

/// Runs the command.
pub fn run(arguments: &CompareArgs) -> Result<ExitCode, CliError> {
    let text = read_text(&arguments.file, MAX_GRAPH_BYTES)?;
    let which = if arguments.bent {
        States::Bent
    } else {
        States::All
    };
    let comparison = compare_graph(&text, arguments.states as usize, which, arguments.seed)
        .map_err(|error| CliError::of(&arguments.file, error))?;
    let agrees = comparison.agrees();
    show(comparison)?;
    Ok(if agrees {
        ExitCode::SUCCESS
    } else {
        DISAGREEMENT.into()
    })
}
