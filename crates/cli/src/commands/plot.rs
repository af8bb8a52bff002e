//! `bristle plot`.

use std::path::PathBuf;

use clap::Args;

use crate::error::CliError;
use crate::pictures::{FigureArgs, draw_saved};

/// Redraw the figures of saved results, to DIR/figures
///
/// DIR is a directory that `bristle study`, `bristle simulate` or `bristle brush` has written to.
/// The figures of a study are maps and curves of tip deflection, contact time, contact time ratio,
/// impulse and tool force over the swept settings, and a comparison of the tool force with measured
/// forces. The figures of one contact show force and tip deflection over time, and the impulse of
/// each turn if there are several. The five that matter most are drawn, or all with --figures all,
/// as SVG, PNG and PDF, with the same bytes as by the command that made the results.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct PlotArgs {
    /// Directory with results
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Directory for the figures, which go to its subdirectory `figures` [default: DIR]
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    figures: FigureArgs,
}

/// Runs the command.
pub fn run(arguments: &PlotArgs) -> Result<(), CliError> {
    let out = arguments.out.as_ref().unwrap_or(&arguments.results);
    draw_saved(&arguments.results, out, &arguments.figures.figures()?)
}
