//! `bristle evaluate`.

use std::io;
use std::path::PathBuf;

use bristle_app::store::staged::read_input;
use bristle_equations::evaluation::evaluate;
use bristle_equations::state::parse_state;
use bristle_study::input::plausibility::unusual;
use clap::Args;

use crate::error::CliError;
use crate::input::InputArgs;
use crate::terminal::print;

/// Print mass matrix, accelerations and energies at one state, as JSON
///
/// The state is a JSON file with the angle (rad), rate (rad/s) and acceleration
/// (rad/s²) of the base, and gravity (m/s²). For each segment, q holds the polar
/// angle φ and the azimuth θ (rad), and v their rates (rad/s):
///
///   {"base_angle": -1.5, "base_rate": 50, "base_acceleration": 0,
///    "gravity": [0, 0, 0], "q": [1.57, -1.5], "v": [0, 50]}
///
/// The length of q gives the number of segments. Contact is left out, so FILE.toml
/// may omit velocity, depth and number of filaments.
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub struct EvaluateArgs {
    #[command(flatten)]
    input: InputArgs,
    /// The state
    #[arg(long, value_name = "STATE.json")]
    state: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &EvaluateArgs) -> Result<(), CliError> {
    let text = arguments.input.read()?;
    let document = text.document()?;
    let settings = document.settings_without_process()?;
    // What the file leaves out has values that mean nothing.
    let stated = unusual(&settings)
        .into_iter()
        .filter(|unusual| document.states(unusual.path));
    arguments.input.warn_of(&stated.collect::<Vec<_>>())?;
    let state = parse_state(&read_input(&arguments.state)?)
        .map_err(|error| CliError::of(&arguments.state, error))?;
    let evaluation = evaluate(&settings.filament, settings.tool.body_radius_m, &state)?;
    let mut json = serde_json::to_string(&evaluation).map_err(io::Error::from)?;
    json.push('\n');
    Ok(print(&json)?)
}
