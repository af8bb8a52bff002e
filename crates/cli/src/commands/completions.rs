//! `bristle completions` and `bristle man`.

use std::path::PathBuf;

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
/// Begin a new shell after that.
#[derive(Args)]
#[command(verbatim_doc_comment)]
pub struct CompletionsArgs {
    /// The shell
    shell: Shell,
}

/// Write manual pages of the program and of each command, as DIR/bristle.1 and
/// DIR/bristle-COMMAND.1
///
/// In a directory such as ~/.local/share/man/man1, `man bristle-study` shows them.
#[derive(Args)]
pub struct ManArgs {
    /// Directory for the pages, created if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
}

/// Prints the script of a shell for the `program`.
pub fn print_completions(
    arguments: &CompletionsArgs,
    mut program: Command,
) -> Result<(), CliError> {
    let mut script = Vec::new();
    generate(arguments.shell, &mut program, PROGRAM, &mut script);
    Ok(print_by(|| {
        std::io::Write::write_all(&mut std::io::stdout(), &script)
    })?)
}

/// Writes the manual pages of the `program`.
pub fn write_manual(arguments: &ManArgs, mut program: Command) -> Result<(), CliError> {
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
    prepare_directory(&arguments.out)?;
    let _occupied = occupy(
        &arguments.out,
        &[("", &|name| {
            name.starts_with(PROGRAM) && name.ends_with(".1")
        })],
    )?;
    let stage = |page: &Man| {
        StagedFile::write(arguments.out.join(page.get_filename()), |out| {
            page.render(out)
        })
    };
    let staged: Result<Vec<StagedFile>, _> = pages.iter().map(stage).collect();
    Ok(commit(staged?)?)
}
