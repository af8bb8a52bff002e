//! `bristle merge`.

use std::path::PathBuf;
use std::process::ExitCode;

use bristle_app::run::StudyRun;
use bristle_app::store::journal_file::{JOURNAL, JournalFile};
use clap::Args;

use crate::commands::study::{StudyArgs, run_whole};
use crate::error::CliError;

/// Merge the shards of a study, and write its results as one call of `bristle study` would
///
/// Each DIR is the directory of a shard, made by `bristle study FILE.toml --out DIR --shard I/N`.
/// The file and its options must be those of the shards, and so must the build of Bristle. The
/// results are the same to the bit as without shards. If cases are missing, they are not simulated:
/// the message says how many, and the journal keeps the others.
#[derive(Args)]
pub struct MergeArgs {
    #[command(flatten)]
    study: StudyArgs,
    /// Directories of the shards
    #[arg(value_name = "DIR", required = true)]
    shards: Vec<PathBuf>,
}

/// Runs the command.
pub fn run(arguments: &MergeArgs) -> Result<ExitCode, CliError> {
    let text = arguments.study.job.input.read()?;
    let study = arguments.study.document(&text)?.study()?;
    let total = study.case_count();
    // Shards that are missing or of another study are found before anything is written.
    let mut merged = vec![None; total];
    for directory in &arguments.shards {
        let results = JournalFile::read(directory, &study)?;
        for (merged, result) in merged.iter_mut().zip(results) {
            *merged = merged.take().or(result);
        }
    }
    let (mut run, _) = StudyRun::open(
        study,
        &arguments.study.job.out,
        &[],
        arguments.study.restart,
    )?;
    for (case, result) in merged.into_iter().enumerate() {
        result.map_or(Ok(()), |result| run.take(case, result))?;
    }
    run.settle()?;
    let (done, _) = run.counts();
    drop(run);
    if done < total {
        let path = arguments.study.job.out.join(JOURNAL);
        return Err(CliError::Incomplete {
            path,
            missing: total - done,
            total,
        });
    }
    run_whole(&arguments.study, false, false)
}
