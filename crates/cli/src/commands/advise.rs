//! `bristle advise`.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use bristle::model::parameters::Parameter;
use bristle_study::advice::{Limits, advise};
use bristle_study::study::VELOCITY;
use clap::Args;

use crate::error::CliError;
use crate::saved::{SavedError, saved_study};
use crate::terminal::print;

/// Say where the tool force of a study is high, from saved results
///
/// DIR is a directory that `bristle study` has written to. The table shows the highest tool force F_n,w: of all cases,
/// within the limits, at each brushing velocity, and at each penetration depth. It also shows the most force per velocity
/// and per depth, and local maxima along the tier, the line between sweeping and striking. Each line identifies a case by
/// its row in runs.csv and explains it in a sentence. Nothing is interpolated. If further settings are swept, each
/// combination of their values has a table.
#[derive(Args)]
pub struct AdviseArgs {
    /// Directory with the results of a study
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Highest brushing velocity in m/s, for the highest force within the limits
    #[arg(long, value_name = "V_B", value_parser = parse_velocity)]
    max_velocity: Option<f64>,
    /// Lowest contact time ratio, from 0 (striking) to 1 (sweeping)
    #[arg(long, value_name = "RATIO", value_parser = parse_ratio)]
    min_ratio: Option<f64>,
    /// Highest contact time ratio
    #[arg(long, value_name = "RATIO", value_parser = parse_ratio)]
    max_ratio: Option<f64>,
    /// Print one JSON object, in SI units, instead of the table
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(arguments: &AdviseArgs) -> Result<ExitCode, CliError> {
    let path = &arguments.results;
    let (saved, results) = saved_study(path)?.ok_or_else(|| SavedError::NoStudy(path.clone()))?;
    let AdviseArgs { max_velocity: max_velocity_m_s, min_ratio, max_ratio, .. } = *arguments;
    let advice = advise(&saved.study, &results, Limits { max_velocity_m_s, min_ratio, max_ratio })
        .map_err(|error| CliError::Advice { path: path.clone(), error })?;
    if arguments.json {
        let json = serde_json::to_string(&advice).map_err(io::Error::from)?;
        print(&(json + "\n"))?;
    } else {
        print(&advice.text())?;
    }
    Ok(ExitCode::SUCCESS)
}

/// Parses a brushing velocity.
fn parse_velocity(text: &str) -> Result<f64, String> {
    let parameter = Parameter::find(VELOCITY).ok_or("no such setting")?;
    let velocity = text.parse().ok().filter(|&velocity| parameter.check(velocity).is_ok());
    velocity.ok_or_else(|| format!("must be {}", parameter.allowed()))
}

/// Parses a contact time ratio.
fn parse_ratio(text: &str) -> Result<f64, String> {
    let ratio = text.parse().ok().filter(|ratio| (0.0..=1.0).contains(ratio));
    ratio.ok_or_else(|| "must be a number from 0 to 1".to_owned())
}
