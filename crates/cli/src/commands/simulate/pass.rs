//! One filament.

use super::SimulateArgs;
use crate::error::CliError;
use crate::pictures::{draw, is_of_simulation};
use crate::progress::{PassProgress, print_result, show_check};
use crate::saved::Contact;
use crate::terminal::{say_findings, say_written, show, width};
use bristle::model::metrics::Metrics;
use bristle::model::settings::Settings;
use bristle::simulation::{Sampling, Stop, simulate_places};
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{JudgedCase, JudgedResult, judge_case};
use bristle_app::report::tables::contact_table;
#[cfg(feature = "vtk")]
use bristle_app::report::vtk::files;
use bristle_app::run::contact::{
    ShapeTimes, last_shapes, of_simulation, write_check, write_contact,
};
use bristle_app::store::results::write_metrics;
use bristle_app::store::staged::prepare_directory;
use bristle_app::store::vtk_files::VTK;
use bristle_study::grid::check::{FINER_PASS, finer_pass};
use bristle_study::input::document::Document;
use bristle_study::input::plausibility::unusual;

/// Simulates the pass of a filament, and writes its results.
pub fn run(
    arguments: &SimulateArgs,
    document: &Document<'_>,
    settings: Settings,
) -> Result<(), CliError> {
    let job = &arguments.job;
    let figures = job.figures.figures()?;
    job.input.warn_of(&unusual(&settings))?;
    let _occupied = job.occupy(&of_simulation(), is_of_simulation)?;
    let shapes = arguments.vtk.unwrap_or(0) as usize;
    if shapes > 0 {
        prepare_directory(&job.out.join(VTK))?;
    }

    let samples = arguments.samples.unwrap_or(settings.solver.samples);
    let progress = PassProgress::begin("the pass", 0.0, job.json);
    let times = ShapeTimes::new(&settings, shapes);
    let sampling = times.sampling(samples);
    let simulation = simulate_places(&settings, sampling, &Stop::default(), &mut |share| {
        progress.tell(share)
    });
    drop(progress);
    let mut simulation = simulation?;
    // A force is given in place of the depth that was found.
    let asked_n = settings.process.tool_force_n;
    let settings = settings.at_depth(simulation.metrics.penetration_depth_m);
    let drawn = last_shapes(&settings, &simulation);
    #[cfg(feature = "vtk")]
    let chosen = times.chosen(std::mem::take(&mut simulation.shapes));
    #[cfg(feature = "vtk")]
    let for_vtk = arguments.vtk.iter().flat_map(|_| files(&settings, &chosen));
    #[cfg(not(feature = "vtk"))]
    let for_vtk = std::iter::empty();
    write_contact(&job.out, &settings, &simulation, &drawn, for_vtk)?
        .iter()
        .for_each(|path| say_written(path));
    let contact = Contact {
        shapes: drawn,
        impulses: simulation.turn_contact_normal_impulses_n_s.clone(),
        history: std::mem::take(&mut simulation.history),
        profile: std::mem::take(&mut simulation.profile),
        settings,
    };
    draw(
        &job.out,
        |format| contact.pictures(format),
        None,
        &figures,
        is_of_simulation,
    )?;
    let findings = job.told(judge_case(&JudgedCase {
        settings: &contact.settings,
        asked_n,
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
        let metrics = &simulation.metrics;
        say_written(&write_check(&job.out, FINER_PASS, metrics, &checked)?);
        show_check(FINER_PASS, metrics, &checked, job.json)?;
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
