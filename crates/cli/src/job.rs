//! The arguments of commands that simulate what an input file states.

use std::path::PathBuf;

use clap::Args;

use crate::input::InputArgs;
use crate::pictures::FigureArgs;

/// The input file of a command, and where its results go.
#[derive(Args)]
pub struct JobArgs {
    #[command(flatten)]
    pub input: InputArgs,
    /// Directory for the results, created if it does not exist
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub figures: FigureArgs,
}
