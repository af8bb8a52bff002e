//! Settings from measured forces or radii.

use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use bristle::simulation::Stop;
use bristle_app::run::calibration::{
    CalibrationOptions, OF_CALIBRATION, calibration_problem, run_calibration,
};
use bristle_study::calibrate::{MeasurementLimits, summary};
use bristle_study::grid::Resources;
use bristle_study::input::measured::TableFormat;
use bristle_study::text::layout::WIDTH;
use pyo3::prelude::*;

use crate::error::{of_calibration, of_settings};
use crate::input::{InputFile, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// Fits settings of `input` to the table `measured`, with its relative standard deviation. Returns
/// the text of `calibration.json`, the text that the program prints, the change if it is to
/// `check`, and the findings as JSON.
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
) -> PyResult<(String, String, Option<f64>, String)> {
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
    let problem = calibration_problem(&document, &fit, [&table, "measured"], &format);
    let problem = problem.map_err(of_calibration)?;
    let _occupied = occupied_for(out.as_deref(), &OF_CALIBRATION)?;
    let stop = Stop::default();
    let options = CalibrationOptions {
        reach: MeasurementLimits {
            max_rpm: reach.0,
            max_depth_m: reach.1,
        },
        resources: Resources {
            threads,
            memory: None,
        },
        stop: &stop,
        check,
        directory: out.as_deref(),
        restart,
        file: Path::new(""),
        name: &input.short_name(),
        text: input.text(),
        set: &[],
    };
    let found = on_a_thread_sharing(py, &stop, tell, |tell| {
        run_calibration(problem, &options, |_| (), tell)
    })?;
    let found = found.map_err(of_calibration)?;
    let change = found.change.transpose().map_err(of_settings)?;
    let findings = serde_json::to_string(&found.findings).map_err(of_settings)?;
    let text = summary(&found.calibration, WIDTH);
    Ok((found.calibration.json(), text, change, findings))
}
