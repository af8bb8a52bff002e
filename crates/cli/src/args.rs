//! The command line: commands, their execution, and the help text.

use std::process::ExitCode;

use bristle::equations::VERSION;
use clap::{CommandFactory, Parser, Subcommand};

use crate::commands::{
    advise, calibrate, compare, completions, derive, evaluate, explain, new, report, simulate,
    study, wear,
};
use crate::error::CliError;

const EXAMPLES: &str = "\
Examples:
  bristle new brush.toml                       write a first input file
  bristle explain friction_coefficient         say what a key of it means
  bristle study brush.toml --out results       simulate all contacts of a study
  bristle simulate brush.toml --out one        simulate one contact over time
  bristle simulate brush.toml --converge --out precision
                                               say how many segments it needs
  bristle calibrate lab.toml --fit KEY --out c fit settings to measured forces
  bristle wear edge.toml --out rounding        follow an edge that grows round
  bristle report results --figures all         redraw the figures of a study
  bristle advise results --max-force 300       show which settings meet a limit
  bristle report old new --out both            compare the tools of two studies
  bristle derive --segments 2                  show the equations of motion

Units are SI throughout, angles in radians. The unit is part of each name, as in
length_m or contact_normal_impulse_n_s.

Results that people read go to stdout, progress and notes to stderr. Lines are
made for the width of the terminal, or for that in COLUMNS, or else for 80
columns. RUST_LOG=debug writes a log to stderr, and RUST_LOG=bristle_study=debug
one of a single crate or module.

Exit status:
  0    success
  1    a comparison found a deviation
  2    the input or the call is wrong, or a file cannot be read or written; no
       result file has changed, and a study keeps the cases it has simulated in
       its journal; or stdout cannot be written, and the result files are
       complete (a reader that stops early is not an error)
  3    a simulation failed; a study has written the results of the others
  130  Ctrl-C or SIGTERM stopped a study, a brush or a calibration, which the same
       command resumes, or another simulation";

/// Text that the program prints without arguments: one screen.
pub const OVERVIEW: &str = "\
Contact forces of brushing tools, from the equations of motion of one filament

  new                write a first input file
  explain            say what a key of it means
  simulate           simulate one contact, or filaments that touch, over time
  study              simulate all contacts of a study: tables, figures, a page
  report             draw results again, join shards, compare studies
  advise             say which settings of a study meet limits
  calibrate          fit settings to measured forces
  wear               follow an edge that grows round and filaments that wear
  derive             show the equations of motion
  evaluate, compare  evaluate them at a state; compare them with other engines

Begin: `bristle new brush.toml`, then `bristle study brush.toml --out results`.
`bristle help COMMAND` says more, `bristle --help` has examples.
";

/// Contact forces of brushing tools, from the equations of motion of one filament.
#[derive(Parser)]
#[command(name = "bristle", version = VERSION, after_help = EXAMPLES)]
pub struct Cli {
    #[command(subcommand)]
    pub command: Command,
}

#[derive(Subcommand)]
pub enum Command {
    New(new::NewArgs),
    Explain(explain::ExplainArgs),
    Simulate(simulate::SimulateArgs),
    Study(study::StudyArgs),
    Report(report::ReportArgs),
    Advise(advise::AdviseArgs),
    Calibrate(calibrate::CalibrateArgs),
    Wear(wear::WearArgs),
    Derive(derive::DeriveArgs),
    Evaluate(evaluate::EvaluateArgs),
    Compare(compare::CompareArgs),
    #[command(hide = true)]
    Completions(completions::CompletionsArgs),
}

impl Command {
    /// Runs the command.
    pub fn run(self) -> Result<ExitCode, CliError> {
        match self {
            Self::Simulate(arguments) => return simulate::run(&arguments),
            Self::Study(arguments) => return study::run(&arguments),
            Self::Report(arguments) => return report::run(&arguments),
            Self::Calibrate(arguments) => return calibrate::run(&arguments),
            Self::Wear(arguments) => return wear::run(&arguments),
            Self::Compare(arguments) => return compare::run(&arguments),
            Self::New(arguments) => new::run(&arguments)?,
            Self::Explain(arguments) => explain::run(&arguments)?,
            Self::Advise(arguments) => advise::run(&arguments)?,
            Self::Derive(arguments) => derive::run(&arguments)?,
            Self::Evaluate(arguments) => evaluate::run(&arguments)?,
            Self::Completions(arguments) => completions::run(&arguments, Cli::command())?,
        }
        Ok(ExitCode::SUCCESS)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_overview_is_one_screen_with_all_commands() {
        assert!(OVERVIEW.lines().count() <= 24);
        assert!(
            OVERVIEW.lines().all(|line| line.chars().count() <= 80),
            "{OVERVIEW}"
        );
        let listed: Vec<&str> = OVERVIEW
            .lines()
            .filter_map(|line| line.strip_prefix("  "))
            .flat_map(|line| line.split("  ").next().unwrap_or_default().split(", "))
            .collect();
        let mut commands: Vec<String> = Cli::command()
            .get_subcommands()
            .filter(|command| !command.is_hide_set())
            .map(|command| command.get_name().to_owned())
            .collect();
        commands.sort();
        let mut sorted = listed.clone();
        sorted.sort_unstable();
        assert_eq!(sorted, commands);
    }
}
