//! `bristle simulate`: one contact, a brush, or how precise they are.

mod brush;
mod converge;
mod pass;

use std::process::ExitCode;

use bristle::model::settings::Settings;
use bristle_app::store::vtk_files::MAX_SHAPES;
use bristle_study::grid::uncertainty::scatters;
use bristle_study::text::layout;
use clap::Args;

use crate::error::CliError;
use crate::job::JobArgs;
use crate::terminal::say;
use crate::values::parse_count;

/// Simulate one contact, or the filaments of [brush] together, over time
///
/// DIR/metrics.json is a flat object with the contact metrics and the solver statistics,
/// history.csv has forces over time, and DIR/figures has figures. [study] is ignored.
///
/// Without [brush], or with --alone, one filament passes the workpiece. history.csv has forces,
/// deflection, tip position and energies at equally spaced times. profile.csv says where on the
/// workpiece the work is done: normal impulse and friction work per length along its profile.
/// positions.csv has the filaments along the trim of a tool on which they differ.
///
/// With [brush], a sector of the brush passes the workpiece, and its filaments touch each other.
/// Metrics are taken from the columns in its middle, where the impulse no longer changes from
/// column to column. If there are none, the sector is simulated again with more columns; if the
/// file states their number, the error says how many are needed. filaments.csv has the metrics of
/// each filament; column 0 meets the workpiece first. contacts.csv says where and how strongly
/// filaments press on each other. brush.html is a page with the sector in motion. Ctrl-C, SIGTERM
/// or a crash may stop the simulation at any moment: the same command goes on from
/// DIR/checkpoint.bin, with the same results to the bit.
///
/// --check simulates again, a contact at a tenth of the tolerance and a brush at a quarter, and
/// prints by how much each metric changes.
///
/// --converge simulates with coarser and finer values of one setting after the other: the number of
/// segments, the tolerance, and with [brush] the stiffness k_l between filaments. It prints the
/// force F_n,w for each value with its change against the finest one, what to choose for an error
/// of 1 %, and how good each metric is as stated. Where the finest four numbers of segments agree
/// on the power with which the error falls, and the same number of nodes touches, metrics are
/// extrapolated. DIR/converge.csv and .json have the numbers.
///
/// --vtk, in a build with the feature vtk, writes the nodes of the filaments for ParaView: open
/// DIR/vtk/contact.pvd or brush.pvd. They have positions in m, arc length, velocity, contact force,
/// gap to the workpiece, and joint angle.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct SimulateArgs {
    #[command(flatten)]
    job: JobArgs,
    /// Say how many segments and which tolerance the contact needs
    #[arg(long, conflicts_with_all = ["check", "vtk", "samples"])]
    converge: bool,
    /// Number of rows in history.csv of one filament; overrides samples in [solver]
    #[arg(long, value_name = "N", value_parser = |text: &str| parse_count(text, "solver.samples"))]
    samples: Option<usize>,
    /// Write N equally spaced shapes to DIR/vtk, for ParaView [default: none; 200 without N]
    #[arg(
        long,
        value_name = "N",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "200",
        value_parser = clap::value_parser!(u64).range(2..=MAX_SHAPES as u64),
    )]
    vtk: Option<u64>,
    /// Time between two checkpoints of a brush, in s [default: 10]
    #[arg(long, value_name = "SECONDS", value_parser = clap::value_parser!(u64).range(0..=1 << 20))]
    checkpoint_every: Option<u64>,
}

/// Runs the command.
pub fn run(arguments: &SimulateArgs) -> Result<ExitCode, CliError> {
    if arguments.vtk.is_some() && !cfg!(feature = "vtk") {
        return Err(CliError::NoVtk);
    }
    if arguments.converge {
        return converge::run(&arguments.job);
    }
    let text = arguments.job.input.read()?;
    let document = arguments.job.document(&text)?;
    let settings = document.settings()?;
    let is_brush = settings.brush.is_some();
    let of_other = if is_brush {
        arguments
            .samples
            .map(|_| ("--samples", "one filament: add --alone, or leave it out"))
    } else {
        arguments.checkpoint_every.map(|_| {
            (
                "--checkpoint-every",
                "a brush: add [brush], or leave it out",
            )
        })
    };
    if let Some((option, remedy)) = of_other {
        return Err(CliError::Option { option, remedy });
    }
    if is_ignored(&settings) {
        say(layout::note(
            "one simulation ignores [uncertainty]; `bristle study` gives F_n,w its 95 % interval",
        ));
    }
    if is_brush {
        brush::run(arguments, &document, settings)
    } else {
        pass::run(arguments, &document, settings).map(|()| ExitCode::SUCCESS)
    }
}

/// Returns `true` if `[uncertainty]` states deviations from tool to tool, of which one simulation
/// knows nothing. Deviations within a brush are simulated, and what a calibration leaves open is
/// printed.
fn is_ignored(settings: &Settings) -> bool {
    if settings.brush.is_some() {
        settings.uncertainty.scatters() && !settings.uncertainty.scatters_within_brush()
    } else {
        scatters(settings)
    }
}
