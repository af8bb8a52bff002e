//! Settings from measured forces or radii.

use std::num::NonZeroUsize;
use std::path::PathBuf;

use bristle::simulation::Stop;
use bristle_app::run::calibration::{OF_CALIBRATION, calibrated_text, write_calibration};
use bristle_study::calibrate::{
    Calibration, FitError, Fitted, Means, Observer, Problem, Reach, STARTS, calibrate as fitted_to,
    summary,
};
use bristle_study::grid::Resources;
use bristle_study::input::measured::{Format, read_points, read_radii};
use bristle_study::text::layout::WIDTH;
use pyo3::prelude::*;

use crate::error::{of_file, of_input, of_settings};
use crate::input::{Input, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// Reports the progress of a calibration.
struct Share<'a>(&'a (dyn Fn(f64) + Sync));

impl Observer for Share<'_> {
    fn done(&self, share: f64) {
        self.0(share);
    }
}

/// Calibrates `input` to the table `measured` with its relative standard deviation. Returns the
/// content of `calibration.json`, and its text. Writes the files to the directory `out`, if any.
/// Each of `fit` is a key, or a key and its range.
#[pyfunction]
pub fn calibrate(
    py: Python<'_>,
    input: &Input,
    measured: (String, Option<f64>),
    fit: Vec<String>,
    reach: (Option<f64>, Option<f64>),
    means: (Option<NonZeroUsize>, Option<PathBuf>),
    tell: Option<Py<PyAny>>,
) -> PyResult<(String, String)> {
    let (threads, out) = means;
    let (table, relative_std) = measured;
    let format = Format {
        relative_std,
        ..Format::default()
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
        let brushes = input.document()?.brushes().map_err(of_input)?;
        let points = read_points(&table, "measured", &format).map_err(of_settings)?;
        Problem::new(brushes, fit, points)
    };
    let problem = problem.map_err(of_settings)?;
    let _occupied = occupied_for(out.as_deref(), &OF_CALIBRATION)?;
    let stop = Stop::default();
    let resources = Resources {
        threads,
        memory: None,
    };
    let reach = Reach {
        max_rpm: reach.0,
        max_depth_m: reach.1,
    };
    let found = on_a_thread_sharing(py, &stop, tell, |tell| {
        let means = Means {
            resources,
            stop: &stop,
            observer: &Share(tell),
            starts: STARTS,
        };
        fitted_to(problem, reach, means)
    })?;
    let found: Option<Calibration> = found.map_err(of_settings)?;
    let found = found.ok_or_else(|| {
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
    Ok((found.json(), summary(&found, WIDTH)))
}
