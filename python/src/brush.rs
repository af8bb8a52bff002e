//! Brushes with filaments that touch each other.

use std::num::NonZeroUsize;

use bristle::brush::{BrushError, BrushResult, BrushRun, RunOptions};
use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{Finding, JudgedCase, JudgedResult, judge_case};
use bristle_app::report::figures::Brush;
use bristle_app::report::page::{Notes, brush_page};
use bristle_app::store::checkpoint::{state_bytes, state_of};
use bristle_app::store::results::{MOMENT, PAIR, PLACE, REST, write_brush_metrics};
use bristle_study::grid::brush::filament_columns;
use bristle_study::grid::{Interaction, calibration_band, press_brush, thread_count};
use bristle_study::input::plausibility::unusual;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Columns, add_columns, frozen, table};
use crate::error::{of_brush, of_settings, of_value};
use crate::input::Input;
use crate::interrupt::on_a_thread_sharing;

/// A simulated brush.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct SimulatedBrush {
    settings: Settings,
    result: BrushResult,
    frames: usize,
    /// The final state, from which the result follows.
    state: Vec<u8>,
}

/// Simulates the brush of `input` on `threads` threads, with at most `frames` frames, in at most
/// `memory` bytes. Calls `tell` now and then with the share that is done.
#[pyfunction]
pub fn brush(
    py: Python<'_>,
    input: &Input,
    threads: Option<NonZeroUsize>,
    frames: usize,
    memory: Option<u64>,
    tell: Option<Py<PyAny>>,
) -> PyResult<SimulatedBrush> {
    let settings = input.settings()?.clone();
    if settings.brush.is_none() {
        return Err(of_settings(
            "there is no section [brush]; add it, empty if all its defaults are right: `settings.replace(brush={})`",
        ));
    }
    let options = RunOptions {
        threads: thread_count(threads),
        frames,
        memory,
        ..RunOptions::default()
    };
    let stop = Stop::default();
    let simulated = on_a_thread_sharing(py, &stop, tell, |tell| {
        let (settings, (mut result, state), stiffness) =
            press_brush(&settings, &stop, |settings| {
                let mut run = BrushRun::new(settings, options)?.until(&stop);
                while run.advance()? {
                    tell(run.done());
                }
                let state = state_bytes(&run.checkpoint());
                let result = run.finish()?;
                Ok::<_, BrushError>((result.tool.tool_contact_normal_force_n, (result, state)))
            })?;
        result.tool.force_stiffness_n_m = stiffness;
        Ok((settings, result, state))
    })?;
    let (settings, result, state) = simulated.map_err(of_brush)?;
    Ok(SimulatedBrush {
        settings,
        result,
        frames,
        state,
    })
}

impl SimulatedBrush {
    fn found(&self) -> Vec<Finding> {
        judge_case(&JudgedCase {
            settings: &self.settings,
            asked_n: None,
            outcome: Some(JudgedResult {
                metrics: &self.result.tool,
                statistics: None,
                interaction: Some(&Interaction::of(&self.result)),
            }),
        })
    }
}

#[pymethods]
impl SimulatedBrush {
    /// Returns the content of `metrics.json`.
    fn metrics(&self) -> PyResult<String> {
        let mut text = Vec::new();
        let band = calibration_band(&self.settings, &self.result.tool).map_err(of_value)?;
        write_brush_metrics(&mut text, &self.settings, &self.result, band.as_ref())?;
        String::from_utf8(text).map_err(of_value)
    }

    /// Returns the warnings of the program.
    fn warnings(&self) -> Vec<String> {
        let findings = self.found();
        findings
            .iter()
            .map(|finding| finding.warning().plain())
            .collect()
    }

    /// Returns the findings about the result, as JSON.
    fn findings(&self) -> PyResult<String> {
        serde_json::to_string(&self.found()).map_err(of_settings)
    }

    /// Returns the columns of `filaments.csv`, and their units.
    fn filaments<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        let filaments = &self.result.filaments;
        let metrics: Vec<_> = filaments.iter().map(|each| each.metrics.clone()).collect();
        let columns = (PyDict::new(py), PyDict::new(py));
        add_columns(&columns, PLACE.iter(), filaments)?;
        add_columns(&columns, filament_columns(), &metrics)?;
        add_columns(&columns, REST.iter(), filaments)?;
        Ok(columns)
    }

    /// Returns the columns of `history.csv`, and their units.
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        table(py, MOMENT, &self.result.history)
    }

    /// Returns the columns of `contacts.csv`, and their units.
    fn contacts<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        table(py, PAIR, &self.result.pairs)
    }

    /// Returns the times of the frames in s, and the nodes of all filaments in m.
    fn frames<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let frames = &self.result.frames;
        let times = frames.iter().map(|frame| frame.time_s).collect();
        let nodes = frames
            .iter()
            .flat_map(|frame| &frame.nodes_m)
            .flat_map(|nodes| nodes.as_flattened());
        let shape = [
            frames.len(),
            self.result.filaments.len(),
            self.settings.filament.segments + 1,
            3,
        ];
        let nodes = PyArray1::from_vec(py, nodes.copied().collect::<Vec<f32>>()).reshape(shape)?;
        Ok((frozen(PyArray1::from_vec(py, times)), frozen(nodes)))
    }

    /// Returns everything but the settings, for [`SimulatedBrush::of_state`].
    fn state<'py>(&self, py: Python<'py>) -> (usize, Bound<'py, PyBytes>, [f64; 2]) {
        let tool = &self.result.tool;
        (
            self.frames,
            PyBytes::new(py, &self.state),
            [tool.penetration_depth_m, tool.force_stiffness_n_m],
        )
    }

    /// Restores the brush from the result of [`SimulatedBrush::state`].
    #[staticmethod]
    fn of_state(
        py: Python<'_>,
        input: &Input,
        state: (usize, Vec<u8>, [f64; 2]),
    ) -> PyResult<Self> {
        let (frames, state, [depth, stiffness]) = state;
        let settings = input.settings()?.at_depth(depth);
        let options = RunOptions {
            frames,
            ..RunOptions::default()
        };
        let result = py.detach(|| {
            let state = state_of(&state).ok_or(BrushError::Checkpoint)?;
            BrushRun::resume(&settings, options, state)?.finish()
        });
        let mut result = result.map_err(of_brush)?;
        result.tool.force_stiffness_n_m = stiffness;
        Ok(Self {
            settings,
            result,
            frames,
            state,
        })
    }

    /// Returns the page that `bristle simulate` writes, without the settings that the file leaves
    /// to their defaults.
    fn page(&self, py: Python<'_>, name: &str) -> String {
        let BrushResult {
            filaments,
            history,
            pairs,
            ..
        } = self.result.clone();
        let brush = Brush {
            settings: self.settings.clone(),
            interaction: Interaction::of(&self.result),
            filaments,
            history,
            pairs,
        };
        let (unusual, assumptions) = (unusual(&self.settings), Assumptions::default());
        let findings = self.found();
        let notes = Notes {
            unusual: &unusual,
            findings: &findings,
            assumptions: &assumptions,
        };
        py.detach(|| brush_page(name, &brush, &self.result, notes))
    }
}
