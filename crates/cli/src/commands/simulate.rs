//! `bristle simulate`.

use std::io;

use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, Sampling, Shape, Stop, simulate_places};
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::warnings::{of_contact, of_force};
use bristle_app::report::figures::drawn_shapes;
#[cfg(feature = "parquet")]
use bristle_app::report::parquet::write_history_parquet;
use bristle_app::report::tables::{check_table, contact_table};
use bristle_app::report::view::first_turn;
use bristle_app::report::vtk::{MAX_SHAPES, files, is_file_name};
use bristle_app::store::results::{
    FileHashes, case_text, write_history, write_metrics, write_positions, write_profile,
    write_shapes,
};
use bristle_app::store::staged::{StagedFile, occupy, prepare_directory, remove};
use bristle_study::grid::check::{FINER_PASS, check_text, finer_pass};
use bristle_study::input::plausibility::unusual;
use bristle_study::text::layout::note;
use clap::Args;

use crate::error::CliError;
use crate::job::JobArgs;
use crate::pictures::{FIGURES, draw, is_of_simulation, is_picture};
use crate::progress::PassProgress;
use crate::saved::{
    CASE, CHECK, Contact, HISTORY, HISTORY_PARQUET, METRICS, OF_BRUSH, POSITIONS, PROFILE, SHAPES,
};
use crate::terminal::{commit, say, say_written, show, width};
use crate::values::parse_count;
use crate::vtk_files::{VTK, commit_vtk, stage_vtk};

/// Least number of equally spaced times of a pass from which the shapes in the figures are chosen.
const LEAST_SHAPES: usize = 300;
/// The number of turns up to which there are so many of each.
const MOST_TURNS: usize = 8;

/// What is said of a file for `bristle brush`.
const ALONE: &str = "this filament is alone; `bristle brush` simulates those of [brush] together";

/// Simulate one contact, and write DIR/metrics.json, DIR/history.csv, DIR/profile.csv and figures
///
/// metrics.json is a flat object with the contact metrics and the solver statistics. history.csv
/// has forces, deflection, tip position and energies at equally spaced times; the number of samples
/// does not change any metric. A build with the feature parquet also writes this table as
/// history.parquet. profile.csv says where on the workpiece the work is done: normal impulse and
/// friction work per length along its profile. positions.csv has the filaments along the trim of a
/// tool on which they differ. DIR/figures/history.svg and .png show force and tip deflection over
/// time, profile_unrolled the work along the profile, profile_drawn the filament on the workpiece,
/// and turns the impulse of each turn if there are several. [study] is ignored. A simulation of
/// more than 2 s shows its progress on a terminal. If the contact is laterally unstable, a warning
/// says how to see what an imperfect filament does. If the filament comes back still vibrating, a
/// warning says how to simulate turn after turn.
///
/// --check simulates the contact again at a tenth of the tolerance and prints by how much each
/// metric changes.
///
/// --vtk writes the nodes of the filament for ParaView: open DIR/vtk/contact.pvd. It lists the
/// workpiece and one file for each of 200 equally spaced times in s, or N with --vtk=N, including
/// the first and the last instant. Positions are in m. Each node has its arc length, velocity,
/// contact force, gap to the workpiece, and joint angle.
#[derive(Args)]
#[command(allow_negative_numbers = true)]
pub struct SimulateArgs {
    #[command(flatten)]
    job: JobArgs,
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
    /// Simulate again at a tenth of the tolerance, and say what that changes, also in
    /// DIR/check.json
    #[arg(long)]
    check: bool,
}

/// Runs the command.
pub fn run(arguments: &SimulateArgs) -> Result<(), CliError> {
    let figures = arguments.job.figures.figures()?;
    let text = arguments.job.input.read()?;
    let document = text.document()?;
    let (settings, unstated, material) = (
        document.settings()?,
        document.unstated(),
        document.material(),
    );
    arguments.job.input.warn_of(&unusual(&settings))?;
    if settings.brush.is_some() {
        say(note(ALONE));
    }
    prepare_directory(&arguments.job.out)?;
    let results = [
        METRICS,
        HISTORY,
        PROFILE,
        POSITIONS,
        SHAPES,
        HISTORY_PARQUET,
        CASE,
        CHECK,
    ];
    let _occupied = occupy(
        &arguments.job.out,
        &[
            ("", &|name| results.contains(&name)),
            (FIGURES, &is_picture(is_of_simulation)),
            (VTK, &is_file_name),
        ],
    )?;
    let shapes = arguments.vtk.unwrap_or(0) as usize;
    if shapes > 0 {
        prepare_directory(&arguments.job.out.join(VTK))?;
    }

    let samples = arguments.samples.unwrap_or(settings.solver.samples);
    let progress = PassProgress::begin("the pass", 0.0);
    // More than those for ParaView if these are few, so that the figures can show the filament
    // while it touches.
    let least = LEAST_SHAPES * settings.process.turns().at_most().min(MOST_TURNS);
    let every = least.div_ceil(shapes.max(2) - 1);
    let sampling = Sampling {
        samples,
        shapes: every * (shapes.max(2) - 1) + 1,
        loads: true,
        profile: true,
        alongside: false,
    };
    let simulation = simulate_places(&settings, sampling, &Stop::default(), &mut |share| {
        progress.tell(share)
    });
    drop(progress);
    let mut simulation = simulation?;
    // What was simulated: a force is given in place of the depth that was found.
    let force_n = settings.process.tool_force_n;
    let settings = settings.at_depth(simulation.metrics.penetration_depth_m);
    let impulses = simulation.turn_contact_normal_impulses_n_s.clone();
    let last_turn = first_turn(&settings)
        + impulses.len().saturating_sub(1) as f64 * Pass::new(&settings).turn_time();
    let contact = Contact {
        shapes: drawn_shapes(&simulation.shapes, last_turn),
        impulses,
        history: std::mem::take(&mut simulation.history),
        profile: std::mem::take(&mut simulation.profile),
        settings,
    };
    let for_vtk: Vec<Shape> = std::mem::take(&mut simulation.shapes)
        .into_iter()
        .step_by(every)
        .take(shapes)
        .collect();
    let mut hashes = FileHashes::new();
    let mut stage = |name: &str, write: &dyn Fn(&mut Vec<u8>) -> io::Result<()>| {
        StagedFile::hashed(&arguments.job.out, name, &mut hashes, write)
    };
    let staged = [
        stage(METRICS, &|out| {
            write_metrics(out, &contact.settings, &simulation)
        })?,
        stage(HISTORY, &|out| write_history(out, &contact.history))?,
        stage(PROFILE, &|out| write_profile(out, &contact.profile))?,
        stage(SHAPES, &|out| write_shapes(out, &contact.shapes))?,
    ];
    let positions = &simulation.positions;
    let along_trim = (!positions.is_empty())
        .then(|| stage(POSITIONS, &|out| write_positions(out, positions)))
        .transpose()?;
    let for_vtk = (shapes > 0)
        .then(|| files(&contact.settings, &for_vtk))
        .into_iter()
        .flatten();
    let vtk = stage_vtk(&arguments.job.out, for_vtk, &mut hashes)?;
    let case = case_text(&contact.settings, &hashes);
    #[cfg(feature = "parquet")]
    let table = StagedFile::write(arguments.job.out.join(HISTORY_PARQUET), |out| {
        write_history_parquet(out, &contact.history, &case)
    })?;
    StagedFile::text(&arguments.job.out, CASE, &case)?.commit()?;
    commit(staged.into_iter().chain(along_trim))?;
    #[cfg(feature = "parquet")]
    commit([table])?;
    // Of a brush that was simulated in the same directory.
    for name in OF_BRUSH {
        remove(&arguments.job.out.join(name))?;
    }
    // Of an earlier result.
    remove(&arguments.job.out.join(CHECK))?;
    if simulation.positions.is_empty() {
        remove(&arguments.job.out.join(POSITIONS))?;
    }
    if !cfg!(feature = "parquet") {
        remove(&arguments.job.out.join(HISTORY_PARQUET))?;
    }
    commit_vtk(&arguments.job.out, vtk)?
        .iter()
        .for_each(|path| say_written(path));
    draw(
        &arguments.job.out,
        |format| contact.pictures(format),
        None,
        &figures,
        is_of_simulation,
    )?;
    let assumptions = Assumptions::of_contact(&contact.settings, &unstated).with_material(material);
    let shown = show(contact_table(
        &contact.settings,
        &simulation.metrics,
        &assumptions,
        width(),
    ));
    of_contact(
        &contact.settings,
        &simulation.metrics,
        &simulation.statistics,
    )
    .iter()
    .for_each(say);
    of_force(force_n, &simulation.metrics).iter().for_each(say);
    shown?;
    if arguments.check {
        let checked = check(&contact.settings)?;
        let text = check_text(FINER_PASS, &simulation.metrics, &checked);
        commit([StagedFile::text(&arguments.job.out, CHECK, &text)?])?;
        show(format_args!(
            "\n{}",
            check_table(FINER_PASS, &simulation.metrics, &checked)
        ))?;
    }
    Ok(())
}

/// The metrics of the pass at a tenth of its tolerance.
fn check(settings: &Settings) -> Result<Metrics, CliError> {
    let progress = PassProgress::begin("the check", 0.0);
    let tell = &mut |share| progress.tell(share);
    Ok(simulate_places(
        &finer_pass(settings),
        Sampling::default(),
        &Stop::default(),
        tell,
    )?
    .metrics)
}
