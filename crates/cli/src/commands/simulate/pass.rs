//! One filament.

use std::io;

use super::SimulateArgs;
use crate::error::CliError;
use crate::pictures::{draw, is_of_simulation};
use crate::progress::{PassProgress, print_result, show_check};
use crate::saved::{
    CASE, CHECK, Contact, HISTORY, HISTORY_PARQUET, METRICS, OF_BRUSH, POSITIONS, PROFILE, SHAPES,
};
use crate::terminal::{commit, say_findings, say_written, show, width};
use crate::vtk_files::{VTK, commit_vtk, stage_vtk};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, Sampling, Shape, Stop, simulate_places};
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{JudgedCase, JudgedResult, judge_case};
use bristle_app::report::figures::drawn_shapes;
#[cfg(feature = "parquet")]
use bristle_app::report::parquet::write_history_parquet;
use bristle_app::report::tables::contact_table;
use bristle_app::report::view::first_turn;
use bristle_app::report::vtk::files;
use bristle_app::store::results::{
    FileHashes, case_text, write_history, write_metrics, write_positions, write_profile,
    write_shapes,
};
use bristle_app::store::staged::{StagedFile, prepare_directory, remove};
use bristle_study::grid::check::{FINER_PASS, check_text, finer_pass};
use bristle_study::input::document::Document;
use bristle_study::input::plausibility::unusual;

/// Least number of equally spaced times of a pass from which the shapes in the figures are chosen.
const LEAST_SHAPES: usize = 300;
/// The number of turns up to which there are so many of each.
const MOST_TURNS: usize = 8;

/// Simulates the pass of a filament, and writes its results.
pub fn run(
    arguments: &SimulateArgs,
    document: &Document<'_>,
    settings: Settings,
) -> Result<(), CliError> {
    let job = &arguments.job;
    let figures = job.figures.figures()?;
    job.input.warn_of(&unusual(&settings))?;
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
    let _occupied = job.occupy(&results, is_of_simulation)?;
    let shapes = arguments.vtk.unwrap_or(0) as usize;
    if shapes > 0 {
        prepare_directory(&job.out.join(VTK))?;
    }

    let samples = arguments.samples.unwrap_or(settings.solver.samples);
    let progress = PassProgress::begin("the pass", 0.0, job.json);
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
        StagedFile::hashed(&job.out, name, &mut hashes, write)
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
    let vtk = stage_vtk(&job.out, for_vtk, &mut hashes)?;
    let case = case_text(&contact.settings, &hashes);
    #[cfg(feature = "parquet")]
    let table = StagedFile::write(job.out.join(HISTORY_PARQUET), |out| {
        write_history_parquet(out, &contact.history, &case)
    })?;
    StagedFile::text(&job.out, CASE, &case)?.commit()?;
    commit(staged.into_iter().chain(along_trim))?;
    #[cfg(feature = "parquet")]
    commit([table])?;
    // Of a brush that was simulated in the same directory.
    for name in OF_BRUSH {
        remove(&job.out.join(name))?;
    }
    // Of an earlier result.
    remove(&job.out.join(CHECK))?;
    if simulation.positions.is_empty() {
        remove(&job.out.join(POSITIONS))?;
    }
    if !cfg!(feature = "parquet") {
        remove(&job.out.join(HISTORY_PARQUET))?;
    }
    commit_vtk(&job.out, vtk)?
        .iter()
        .for_each(|path| say_written(path));
    draw(
        &job.out,
        |format| contact.pictures(format),
        None,
        &figures,
        is_of_simulation,
    )?;
    let findings = job.told(judge_case(&JudgedCase {
        settings: &contact.settings,
        asked_n: force_n,
        outcome: Some(JudgedResult {
            metrics: &simulation.metrics,
            statistics: Some(&simulation.statistics),
            interaction: None,
        }),
    }));
    let shown = if job.json {
        let mut metrics = Vec::new();
        write_metrics(&mut metrics, &contact.settings, &simulation)?;
        print_result(&metrics, &findings, &contact.settings)
    } else {
        let assumptions = Assumptions::of_contact(&contact.settings, &document.unstated())
            .with_material(document.material());
        show(contact_table(
            &contact.settings,
            &simulation.metrics,
            &assumptions,
            width(),
        ))
    };
    say_findings(&findings);
    shown?;
    if job.check {
        let checked = check(&contact.settings, job.json)?;
        let text = check_text(FINER_PASS, &simulation.metrics, &checked);
        commit([StagedFile::text(&job.out, CHECK, &text)?])?;
        show_check(FINER_PASS, &simulation.metrics, &checked, job.json)?;
    }
    Ok(())
}

/// The metrics of the pass at a tenth of its tolerance.
fn check(settings: &Settings, json: bool) -> Result<Metrics, CliError> {
    let progress = PassProgress::begin("the check", 0.0, json);
    let tell = &mut |share| progress.tell(share);
    Ok(simulate_places(
        &finer_pass(settings),
        Sampling::default(),
        &Stop::default(),
        tell,
    )?
    .metrics)
}
