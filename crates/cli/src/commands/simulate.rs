//! `bristle simulate`.

use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

use bristle::simulation::{Pass, Sampling};
#[cfg(feature = "parquet")]
use bristle_report::parquet::write_history_parquet;
use bristle_report::vtk::{MAX_SHAPES, is_file_name};
use bristle_study::digest::digest;
use bristle_study::document::Document;
use bristle_study::limited_work::case_work_warning;
use bristle_study::results::{FileHashes, case_text, write_history, write_metrics};
use bristle_study::stability::case_warning;
use clap::Args;

use crate::error::CliError;
use crate::files::{StagedFile, occupy, prepare_directory, read_input, remove};
use crate::pictures::{FIGURES, draw_history, is_picture_of_case, say_drawn};
use crate::progress::PassProgress;
use crate::saved::{CASE, HISTORY, HISTORY_PARQUET, METRICS};
use crate::terminal::{say, say_written};
use crate::values::parse_count;
use crate::vtk_files::{VTK, commit_vtk, stage_vtk};

/// Simulate one contact, and write DIR/metrics.json, DIR/history.csv and a figure
///
/// metrics.json is a flat object with the contact metrics and the solver statistics. history.csv has forces, deflection, tip
/// position and energies at equally spaced times; the number of samples does not change any metric. A build with the feature
/// parquet also writes this table as history.parquet. DIR/figures/history.svg and .png show force and tip deflection over
/// time. [study] is ignored. A simulation of more than 2 s shows its progress on a terminal. If the contact is laterally unstable,
/// a warning says how to see what an imperfect filament does.
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
    let text = read_input(&arguments.file)?;
    let name = arguments.file.to_string_lossy();
    let settings = Document::parse(&text, &name)?.settings()?;
    prepare_directory(&arguments.out)?;
    let results = [METRICS, HISTORY, HISTORY_PARQUET, CASE];
    let _occupied = occupy(
        &arguments.out,
        &[("", &|name| results.contains(&name)), (FIGURES, &is_picture_of_case), (VTK, &is_file_name)],
    )?;
    let shapes = arguments.vtk.unwrap_or(0) as usize;
    if shapes > 0 {
        prepare_directory(&arguments.out.join(VTK))?;
    }

    let samples = arguments.samples.unwrap_or(settings.solver.samples);
    let mut progress = PassProgress::begin();
    let sampling = Sampling { samples, shapes, loads: true, profile: true, alongside: false };
    let simulation = Pass::new(&settings).simulate_telling(sampling, |share| progress.tell(share));
    progress.end();
    let simulation = simulation?;
    case_work_warning(&simulation.statistics).iter().for_each(say);
    let mut hashes = FileHashes::new();
    let mut stage = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        let mut content = Vec::new();
        write(&mut content).expect("memory takes what is written to it");
        hashes.insert(name.to_owned(), digest(&content));
        StagedFile::write(arguments.out.join(name), |out| out.write_all(&content))
    };
    let metrics = stage(METRICS, &|out| write_metrics(out, &simulation))?;
    let history = stage(HISTORY, &|out| write_history(out, &simulation.history))?;
    let vtk = stage_vtk(&arguments.out, &settings, &simulation.shapes, &mut hashes)?;
    let case = case_text(&settings, &hashes);
    #[cfg(feature = "parquet")]
    let table = StagedFile::write(arguments.out.join(HISTORY_PARQUET), |out| {
        write_history_parquet(out, &simulation.history, &case)
    })?;
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
    case_warning(&settings, &simulation.metrics).iter().for_each(say);
    Ok(ExitCode::SUCCESS)
}
