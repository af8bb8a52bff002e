//! `bristle simulate`.

use std::path::PathBuf;
use std::process::ExitCode;

use bristle::simulation::{Sampling, simulate_with};
#[cfg(feature = "parquet")]
use bristle_report::parquet::write_history_parquet;
use bristle_report::vtk::MAX_SHAPES;
use bristle_study::document::Document;
use bristle_study::results::{case_text, write_history, write_metrics};
use clap::Args;

use crate::error::CliError;
use crate::files::{StagedFile, prepare_directory, read_text, remove};
use crate::pictures::{draw_history, say_drawn};
use crate::saved::{CASE, HISTORY, HISTORY_PARQUET};
use crate::terminal::say_written;
use crate::values::parse_count;
use crate::vtk_files::{commit_vtk, prepare_vtk, stage_vtk};

/// Name of the metrics file.
const METRICS: &str = "metrics.json";

/// Simulate one contact, and write DIR/metrics.json, DIR/history.csv and a figure
///
/// metrics.json is a flat object with the contact metrics and the solver statistics. history.csv has forces, deflection, tip
/// position and energies at equally spaced times; the number of samples does not change any metric. A build with the feature
/// parquet also writes this table as history.parquet. DIR/figures/history.svg and .png show force and tip deflection over
/// time. [study] is ignored.
///
/// --vtk writes the nodes of the filament for ParaView: open DIR/vtk/contact.pvd. It lists the workpiece and one file for
/// each of 200 equally spaced times in s, or N with --vtk=N, including the first and the last instant. Positions are in m.
/// Each node has its arc length, velocity, contact force, gap to the workpiece, and joint angle.
#[derive(Args)]
pub struct SimulateArgs {
    /// Input file, see `bristle schema`
    #[arg(value_name = "FILE.toml")]
    file: PathBuf,
    /// Directory for the results, created if it does not exist
    #[arg(long, value_name = "DIR")]
    out: PathBuf,
    /// Number of rows in history.csv; overrides samples in [solver]
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "solver.samples"))]
    samples: Option<usize>,
    /// Write N shapes of the filament to DIR/vtk, for ParaView [default: none; 200 without N]
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "200",
        value_parser = clap::value_parser!(u64).range(2..=MAX_SHAPES as u64),
    )]
    vtk: Option<u64>,
}

/// Runs the command.
pub fn run(arguments: &SimulateArgs) -> Result<ExitCode, CliError> {
    let text = read_text(&arguments.file)?;
    let name = arguments.file.to_string_lossy();
    let settings = Document::parse(&text, &name)?.settings()?;
    prepare_directory(&arguments.out, &[METRICS, HISTORY, HISTORY_PARQUET, CASE])?;
    let shapes = arguments.vtk.unwrap_or(0) as usize;
    if shapes > 0 {
        prepare_vtk(&arguments.out, shapes)?;
    }

    let samples = arguments.samples.unwrap_or(settings.solver.samples);
    let simulation = simulate_with(&settings, Sampling { samples, shapes, loads: true, alongside: false })?;
    let metrics = StagedFile::write(arguments.out.join(METRICS), |out| write_metrics(out, &simulation))?;
    let history = StagedFile::write(arguments.out.join(HISTORY), |out| write_history(out, &simulation.history))?;
    let case = case_text(&settings);
    #[cfg(feature = "parquet")]
    let table = StagedFile::write(arguments.out.join(HISTORY_PARQUET), |out| {
        write_history_parquet(out, &simulation.history, &case)
    })?;
    let vtk = stage_vtk(&arguments.out, &settings, &simulation.shapes)?;
    StagedFile::text(&arguments.out, CASE, &case)?.commit()?;
    say_written(&metrics.commit()?);
    say_written(&history.commit()?);
    #[cfg(feature = "parquet")]
    say_written(&table.commit()?);
    if !cfg!(feature = "parquet") {
        remove(&arguments.out.join(HISTORY_PARQUET))?;
    }
    commit_vtk(&arguments.out, vtk, shapes)?.iter().for_each(|path| say_written(path));
    say_drawn(&draw_history(&arguments.out, &settings, &simulation.history)?);
    Ok(ExitCode::SUCCESS)
}
