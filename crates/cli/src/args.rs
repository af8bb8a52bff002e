//! The command line: commands, their common arguments, and what the help says.

use bristle::model::parameters::Parameter;
use clap::{Parser, Subcommand};

use crate::commands::advise::AdviseArgs;
use crate::commands::compare::CompareArgs;
use crate::commands::derive::DeriveArgs;
use crate::commands::evaluate::EvaluateArgs;
use crate::commands::plot::PlotArgs;
use crate::commands::simulate::SimulateArgs;
use crate::commands::study::StudyArgs;
use crate::commands::validate::ValidateArgs;

const EXAMPLES: &str = "\
Examples:
  bristle study examples/zirconia.toml --out results    all contacts of a study
  bristle simulate examples/zirconia.toml --out one     one contact and its course over time
  bristle plot results                                  the figures of a study once more
  bristle advise results --max-velocity 20              where its tool force is high
  bristle derive --segments 2                           the equations of motion, to read
  bristle validate                                      the simulator beside exact solutions

Units are SI throughout, angles in radians. The unit is part of each name, as in length_m or
contact_normal_impulse_n_s.

RUST_LOG=debug writes a log to stderr; RUST_LOG=bristle_study::study=debug that of one module.

Exit status:
  0    all is well
  1    a comparison has found a deviation
  2    the input or the call is wrong, or a file cannot be read or written; no file of results has
       been changed, and a study keeps in its journal what it has simulated
  3    a simulation failed; a study has written the results of the others
  130  Ctrl-C has stopped a study, which the same command continues";

/// Contact forces of brushing tools, from the equations of motion of one filament.
#[derive(Parser)]
#[command(version, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    Study(StudyArgs),
    Simulate(SimulateArgs),
    Evaluate(EvaluateArgs),
    Derive(DeriveArgs),
    Compare(CompareArgs),
    Validate(ValidateArgs),
    Plot(PlotArgs),
    Advise(AdviseArgs),
    /// Print the JSON schema of an input file
    ///
    /// The schema states each setting's meaning, unit, default and limits. An editor that knows it completes and checks input
    /// files as they are written.
    Schema,
}

/// Reads a whole number that the setting at `path` may be.
pub fn parse_count(text: &str, path: &str) -> Result<usize, String> {
    let parameter = Parameter::find(path).ok_or("no such setting")?;
    let allowed = || format!("must be {}", parameter.allowed());
    let count: usize = text.parse().map_err(|_| allowed())?;
    parameter.check(count as f64).map_err(|_| allowed())?;
    Ok(count)
}
