//! Settings from measured forces.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::sync::atomic::{AtomicU64, Ordering};

use bristle::simulation::Stop;
use bristle_calibrate::{
    Calibration, FitError, Fitted, Means, Observer, Problem, Reach, STARTS, calibrate as fitted_to, summary,
};
use bristle_grid::Resources;
use bristle_input::measured::{Format, read_points, read_radii};
use bristle_run::calibration::{OF_CALIBRATION, calibrated_text, write_calibration};
use bristle_store::staged::{occupy, prepare_directory};
use bristle_text::layout::WIDTH;
use pyo3::prelude::*;

use crate::error::{of_file, of_input, of_settings};
use crate::input::Input;
use crate::interrupt::{on_a_thread_telling, tell_share};

/// Tells how far a calibration is.
struct Share<'a>(&'a AtomicU64);

impl Observer for Share<'_> {
    fn done(&self, share: f64) {
        self.0.store(share.to_bits(), Ordering::Relaxed);
    }
}

/// What `calibration.json` has of a calibration of `input` by the table `measured` and its relative standard deviation, and its text; its files are written to
/// the directory `out`, if there is one. Each of `fit` is a key, or a key and its range.
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
    let format = Format { relative_std, ..Format::default() };
    let fit = fit.iter().map(|option| Fitted::parse(option)).collect::<Result<Vec<_>, FitError>>();
    let fit = fit.map_err(|error| of_settings(error.to_string()))?;
    let problem = if fit.iter().any(Fitted::is_of_edges) {
        let radii = read_radii(&table, "measured", &format).map_err(|error| of_settings(error.to_string()))?;
        Problem::of_radii(input.settings()?.clone(), fit, radii)
    } else {
        let brushes = input.document()?.brushes().map_err(|error| of_input(&error))?;
        let points = read_points(&table, "measured", &format).map_err(|error| of_settings(error.to_string()))?;
        Problem::new(brushes, fit, points)
    };
    let problem = problem.map_err(|error| of_settings(error.to_string()))?;
    let occupied = match &out {
        Some(out) => {
            prepare_directory(out).map_err(|error| of_file(&error))?;
            let is_ours = |name: &str| OF_CALIBRATION.contains(&name);
            Some(occupy(out, &[("", &is_ours)]).map_err(|error| of_file(&error))?)
        }
        None => None,
    };
    let (stop, done) = (Stop::default(), AtomicU64::default());
    let tell = |py: Python<'_>| tell_share(py, tell.as_ref(), f64::from_bits(done.load(Ordering::Relaxed)));
    let resources = Resources { threads, memory: None };
    let reach = Reach { max_rpm: reach.0, max_depth_m: reach.1 };
    let found = on_a_thread_telling(py, &stop, tell, || {
        let means = Means { resources, stop: &stop, observer: &Share(&done), starts: STARTS };
        fitted_to(problem, reach, means)
    })?;
    let found: Option<Calibration> = found.map_err(|error| of_settings(error.to_string()))?;
    let found = found
        .ok_or_else(|| of_settings("none of the starts can be simulated: narrow the ranges of `fit`".to_owned()))?;
    if let (Some(out), Some(_occupied)) = (&out, occupied) {
        let restated =
            found.undetermined.is_empty().then(|| calibrated_text(out, input.text(), &found, &[], &str::to_owned));
        let restated = restated.transpose().map_err(of_settings)?;
        write_calibration(out, &input.short_name(), &found, restated.as_deref()).map_err(|error| of_file(&error))?;
    }
    Ok((found.json(), summary(&found, WIDTH)))
}
