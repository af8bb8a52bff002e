//! Settings from measured forces or radii.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use bristle::simulation::Stop;
use bristle_app::run::calibration::{OF_CALIBRATION, calibrated_text, write_calibration};
use bristle_app::run::forces::{ForceJournal, JournaledForces};
use bristle_study::calibrate::{
    CalibrationContext, FitError, Fitted, MeasurementLimits, Problem, STARTS,
    calibrate as fitted_to, summary,
};
use bristle_study::grid::Resources;
use bristle_study::input::measured::{TableFormat, read_points, read_radii};
use bristle_study::text::layout::WIDTH;
use pyo3::prelude::*;

use crate::error::{of_file, of_input, of_journal, of_settings};
use crate::input::{InputFile, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// Fits settings of `input` to the table `measured`, with its relative standard deviation. Returns
/// the text of `calibration.json`, the text that the program prints, and the change if it is to
/// `check`.
///
/// Only those `headings` count that are keys or are named by `[measured]`. Files are written to the
/// directory `out`, if there is one. Each of `fit` is a key, or a key and its range.
#[pyfunction]
pub fn calibrate(
    py: Python<'_>,
    input: &InputFile,
    measured: (String, Vec<String>, Option<f64>),
    fit: Vec<String>,
    reach: (Option<f64>, Option<f64>),
    means: (Option<NonZeroUsize>, Option<PathBuf>, bool, bool),
    tell: Option<Py<PyAny>>,
) -> PyResult<(String, String, Option<f64>)> {
    let (threads, out, restart, check) = means;
    let (table, headings, relative_std) = measured;
    let document = input.document()?;
    let stated = document.measured().map(|(_, format)| format.clone());
    let mut stated = stated.unwrap_or_default();
    stated
        .columns
        .retain(|(_, column)| headings.contains(&column.heading));
    let format = TableFormat {
        separator: Some(','),
        decimal: Some('.'),
        relative_std: relative_std.or(stated.relative_std),
        ..stated
    };
    let fit = fit
        .iter()
        .map(|option| Fitted::parse(option))
        .collect::<Result<Vec<_>, FitError>>();
    let fit = fit.map_err(of_settings)?;
    let problem = if fit.iter().any(Fitted::is_of_edges) {
        let radii = read_radii(&table, "measured", &format).map_err(of_settings)?;
        Problem::of_radii(input.settings()?.clone(), fit, radii)
    } else {
        let brushes = document.brushes().map_err(of_input)?;
        let points = read_points(&table, "measured", &format).map_err(of_settings)?;
        Problem::new(brushes, fit, points)
    };
    let problem = problem.map_err(of_settings)?;
    let _occupied = occupied_for(out.as_deref(), &OF_CALIBRATION)?;
    let journal = out.as_deref().filter(|_| problem.has_brush());
    let journal = journal.map(|out| ForceJournal::open(out, restart));
    let journal = journal.transpose().map_err(of_journal)?;
    let stop = Stop::default();
    let resources = Resources {
        threads,
        memory: None,
    };
    let reach = MeasurementLimits {
        max_rpm: reach.0,
        max_depth_m: reach.1,
    };
    let found = on_a_thread_sharing(py, &stop, tell, |tell| {
        let share = if check { 0.5 } else { 1.0 };
        let tell_fitted = |done| tell(share * done);
        let mut watch = JournaledForces {
            journal,
            tell: &tell_fitted,
        };
        let fitted = fitted_to(
            problem,
            reach,
            CalibrationContext {
                resources,
                stop: &stop,
                observer: &watch,
                starts: STARTS,
            },
        );
        if let Some(journal) = &mut watch.journal {
            journal.settle().map_err(of_file)?;
        }
        let found = fitted.map_err(of_settings)?.ok_or_else(|| {
            of_settings("none of the starts can be simulated: narrow the ranges of `fit`")
        })?;
        if let Some(out) = &out {
            let restated = found
                .undetermined
                .is_empty()
                .then(|| calibrated_text(out, input.text(), &found, &[], &str::to_owned));
            let restated = restated.transpose().map_err(of_settings)?;
            write_calibration(out, &input.short_name(), &found, restated.as_deref())
                .map_err(of_file)?;
        }
        let tell_checked = |done| tell(share + share * done);
        let changed = check.then(|| {
            found.change_when_checked(CalibrationContext {
                resources,
                stop: &stop,
                observer: &JournaledForces {
                    journal: None,
                    tell: &tell_checked,
                },
                starts: 0,
            })
        });
        Ok::<_, PyErr>((found, changed.transpose().map_err(of_settings)?))
    })?;
    let (found, changed) = found?;
    Ok((found.json(), summary(&found, WIDTH), changed))
}
