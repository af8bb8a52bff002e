//! `bristle completions`: what packages of Bristle contain besides the program.

use std::path::{Path, PathBuf};

use bristle_app::store::staged::{StagedFile, occupy, prepare_directory};
use clap::{Args, Command};
use clap_complete::{Shell, generate};
use clap_mangen::Man;

use crate::error::CliError;
use crate::terminal::{commit, print_by};

/// The name of the program.
const PROGRAM: &str = "bristle";

/// Print a script with which a shell completes commands and options
///
///   bash  bristle completions bash > ~/.local/share/bash-completion/completions/bristle
///   zsh   bristle completions zsh > DIR/_bristle, where DIR is in $fpath
///   fish  bristle completions fish > ~/.config/fish/completions/bristle.fish
///
/// Begin a new shell after that. With --manual DIR, manual pages of the program and
/// of each command are written to DIR instead, such as ~/.local/share/man/man1.
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub struct CompletionsArgs {
    /// The shell
    #[arg(required_unless_present = "manual")]
    shell: Option<Shell>,
    /// Directory for manual pages, created if it does not exist
    #[arg(long, value_name = "DIR", conflicts_with = "shell")]
    manual: Option<PathBuf>,
}

/// Runs the command for the `program`.
pub fn run(arguments: &CompletionsArgs, program: Command) -> Result<(), CliError> {
    match (&arguments.manual, arguments.shell) {
        (Some(out), _) => write_manual(out, program),
        (None, Some(shell)) => print_completions(shell, program),
        (None, None) => unreachable!("clap requires one of them"),
    }
}

/// Prints the script of a shell.
fn print_completions(shell: Shell, mut program: Command) -> Result<(), CliError> {
    let mut script = Vec::new();
    generate(shell, &mut program, PROGRAM, &mut script);
    Ok(print_by(|| {
        std::io::Write::write_all(&mut std::io::stdout(), &script)
    })?)
}

/// Writes the manual pages.
fn write_manual(out: &Path, mut program: Command) -> Result<(), CliError> {
    program.build();
    let commands: Vec<Command> = program
        .get_subcommands()
        .filter(|command| command.get_name() != "help")
        .cloned()
        .collect();
    let pages: Vec<Man> = [program]
        .into_iter()
        .chain(commands)
        .map(Man::new)
        .collect();
    prepare_directory(out)?;
    let _occupied = occupy(
        out,
        &[("", &|name| {
            name.starts_with(PROGRAM) && name.ends_with(".1")
        })],
    )?;
    let stage =
        |page: &Man| StagedFile::write(out.join(page.get_filename()), |file| page.render(file));
    let staged: Result<Vec<StagedFile>, _> = pages.iter().map(stage).collect();
    Ok(commit(staged?)?)
}
