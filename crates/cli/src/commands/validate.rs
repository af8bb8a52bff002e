//! `bristle validate`.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use bristle_store::staged::{StagedFile, occupy, prepare_directory};
use bristle_validation::{self as validation, Extent, Outcome};
use clap::Args;

use crate::error::{CliError, agreement};
use crate::progress::PassProgress;
use crate::terminal::{commit, say, show, width};

/// Names of the result files.
const COMPARISONS: &str = "validation.csv";
const PAGE: &str = "validation.md";

/// Compare the simulator with exact solutions, other codes and the paper, and write
/// DIR/validation.csv
///
/// The table shows each number with its reference, the source of the reference, the error and the
/// tolerance. validation.csv has the same with all digits. validation.md is a page with the
/// formulas, the reasons for the tolerances, and the figures, which are SVG files in the same
/// directory. The exit status is 1 if a number is off by more than its tolerance or cannot be
/// computed.
#[derive(Args)]
pub struct ValidateArgs {
    /// Include convergence studies
    #[arg(long)]
    full: bool,
    /// Directory for the results, created if it does not exist
    #[arg(long, value_name = "DIR", default_value = "validation")]
    out: PathBuf,
}

/// Runs the command.
pub fn run(arguments: &ValidateArgs) -> Result<ExitCode, CliError> {
    let extent = if arguments.full {
        Extent::Full
    } else {
        Extent::Quick
    };
    prepare_directory(&arguments.out)?;
    let written = |name: &str| [COMPARISONS, PAGE].contains(&name) || name.ends_with(".svg");
    let _occupied = occupy(&arguments.out, &[("", &written)])?;

    let start = Instant::now();
    let (done, progress) = (
        AtomicUsize::new(0),
        PassProgress::begin("the validation", 0.0),
    );
    let outcomes = validation::run(extent, || {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        progress.tell(done as f64 / validation::trial_count() as f64);
        ControlFlow::Continue(())
    });
    drop(progress);
    let seconds = start.elapsed().as_secs_f64();

    let written = write_validation(&arguments.out, &outcomes, extent);
    say(format_args!(
        "{} cases in {seconds:.2} s",
        validation::trial_count()
    ));
    // Printed last, so that the verdict is what a terminal shows, even if the files cannot be
    // written.
    show(validation::table(&outcomes, width()))?;
    written?;
    Ok(agreement(validation::agrees(&outcomes)))
}

/// Writes the comparisons of a validation, its page and its figures.
fn write_validation(
    directory: &Path,
    outcomes: &[Outcome],
    extent: Extent,
) -> Result<(), CliError> {
    let stage = |name: &str, text: String| StagedFile::text(directory, name, &text);
    let comparisons = directory.join(COMPARISONS);
    let mut files = vec![StagedFile::write(comparisons, |out| {
        validation::write_rows(out, outcomes)
    })?];
    files.push(stage(PAGE, validation::page(outcomes, extent))?);
    for figure in outcomes.iter().flat_map(Outcome::figures) {
        files.push(stage(&format!("{}.svg", figure.name), figure.svg())?);
    }
    Ok(commit(files)?)
}
