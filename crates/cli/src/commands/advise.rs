//! `bristle advise`.

use std::io;
use std::path::PathBuf;

use bristle::simulation::Stop;
use bristle_app::insight::advice::{Limits, Most, advise};
use bristle_study::grid::VELOCITY;
use clap::Args;

use crate::error::CliError;
use crate::progress::{RECOMMENDING, Waiting};
use crate::saved::saved_study;
use crate::terminal::{print, say, show, width};
use crate::values::{ThreadArgs, parse_if, parse_positive, parse_setting};

/// Say where the tool force of a study is high, or as wanted, from saved results
///
/// DIR is a directory that `bristle study` has written to. The table shows the highest tool force
/// F_n,w: of all cases, at each brushing velocity, and at each penetration depth. It also shows the
/// most force per velocity and per depth, and local maxima along the line between sweeping and
/// striking. Each line identifies a case by its row in runs.csv and explains it in a sentence. If
/// further settings are swept, each combination of their values has a table.
///
/// With limits or --target-force there is one recommendation instead, and at most five others: near
/// the target, or entirely within --max-force, stable cases come first, then those that sweep, then
/// those whose whole band is nearest to the target, or whose force is highest. Forces interpolated
/// between cases are marked with ≈. The recommendation is simulated, with filaments that touch each
/// other where they do, and then again in space, with tilts; --no-verify leaves that out.
///
/// Without any of them, the question is that of [goal] in the file of the study, which `bristle
/// study` answers in the same run. process.tool_force_n in place of a depth asks for the depth of a
/// force.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct AdviseArgs {
    /// Directory with the results of a study
    #[arg(value_name = "DIR")]
    results: PathBuf,
    /// Highest force F_n,w of the tool in N
    #[arg(long, value_name = "N", value_parser = parse_positive)]
    max_force: Option<f64>,
    /// The force F_n,w that is wanted, in N
    #[arg(long, value_name = "N", value_parser = parse_positive)]
    target_force: Option<f64>,
    /// Highest brushing velocity in m/s
    #[arg(long, value_name = "V_B", value_parser = |text: &str| parse_setting(text, VELOCITY))]
    max_velocity: Option<f64>,
    /// Highest rotational speed in rpm
    #[arg(long, value_name = "RPM", value_parser = parse_positive)]
    max_rpm: Option<f64>,
    /// Largest penetration depth in mm
    #[arg(long, alias = "max-depth", value_name = "MM", value_parser = parse_positive)]
    max_depth_mm: Option<f64>,
    /// Highest power of the drive in W
    #[arg(long, value_name = "W", value_parser = parse_positive)]
    max_power: Option<f64>,
    /// Lowest contact time ratio, from 0 (striking) to 1 (sweeping)
    #[arg(long, value_name = "RATIO", value_parser = parse_ratio)]
    min_ratio: Option<f64>,
    /// Highest contact time ratio
    #[arg(long, value_name = "RATIO", value_parser = parse_ratio)]
    max_ratio: Option<f64>,
    /// Quantity to maximise: the force, or the removal from edges or in all
    #[arg(long, value_name = "WHAT", value_parser = parse_most)]
    most: Option<Most>,
    /// Do not simulate the recommendation
    #[arg(long)]
    no_verify: bool,
    #[command(flatten)]
    threads: ThreadArgs,
    /// Print one JSON object, in SI units, instead of the table
    #[arg(long)]
    json: bool,
}

impl AdviseArgs {
    /// The limits, in SI units.
    fn limits(&self) -> Limits {
        Limits {
            max_velocity_m_s: self.max_velocity,
            max_rotational_speed_rpm: self.max_rpm,
            max_depth_m: self.max_depth_mm.map(|millimetres| millimetres / 1e3),
            max_force_n: self.max_force,
            max_power_w: self.max_power,
            min_ratio: self.min_ratio,
            max_ratio: self.max_ratio,
            target_force_n: self.target_force,
            most: self.most,
        }
    }
}

/// Runs the command.
pub fn run(arguments: &AdviseArgs) -> Result<(), CliError> {
    let path = &arguments.results;
    let (saved, results) = saved_study(path)?.ok_or_else(|| CliError::NoStudy(path.clone()))?;
    let mut limits = arguments.limits();
    if let Some(goal) = saved
        .statement
        .goal
        .as_ref()
        .filter(|_| limits.asks_nothing())
    {
        limits = Limits::of(goal).map_err(|error| CliError::of(path, error))?;
        say(format_args!("{} ([goal] of the study)", limits.question()));
    }
    let advice = advise(&saved.study, &results, limits);
    let mut advice = advice.map_err(|error| CliError::of(path, error))?;
    if advice.recommendation.is_some() && !arguments.no_verify {
        if !arguments.json {
            say("simulating the recommendation; --no-verify leaves this out");
        }
        // Its lines show that the program is at work.
        let _progress = Waiting::begin(RECOMMENDING, arguments.json);
        advice
            .verify(arguments.threads.number(), &Stop::default())
            .map_err(CliError::Threads)?;
    }
    if arguments.json {
        let json = serde_json::to_string(&advice).map_err(io::Error::from)?;
        print(&(json + "\n"))?;
    } else {
        show(advice.text(width()))?;
    }
    Ok(())
}

/// Parses what there is to be most of, as [goal] states it.
fn parse_most(text: &str) -> Result<Most, String> {
    serde_json::from_value(text.into()).map_err(|_| "must be force, edge or removal".to_owned())
}

/// Parses a contact time ratio.
fn parse_ratio(text: &str) -> Result<f64, String> {
    let is_ratio = |ratio: f64| (0.0..=1.0).contains(&ratio);
    parse_if(text, is_ratio, "a number from 0 to 1")
}
