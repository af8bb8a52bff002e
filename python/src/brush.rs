//! Brushes with filaments that touch each other.

use std::iter;
use std::num::NonZeroUsize;
use std::path::{Path, PathBuf};

use bristle::brush::{BrushError, BrushResult, BrushRun, RunOptions};
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use bristle::simulation::Stop;
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{Finding, JudgedCase, JudgedResult, judge_case};
use bristle_app::report::figures::Brush;
use bristle_app::report::page::{Notes, brush_page};
use bristle_app::run::brush::{
    BrushEvent, BrushMeans, BrushRunError, BrushStore, CHECKPOINT_PAUSE, check_brush,
    simulate_brush, write_brush,
};
use bristle_app::run::contact::{of_simulation, write_check};
use bristle_app::store::checkpoint::{state_bytes, state_of};
use bristle_app::store::results::{MOMENT, PAIR, PLACE, REST, write_brush_metrics};
use bristle_app::store::staged::FileError;
use bristle_study::grid::brush::filament_columns;
use bristle_study::grid::check::{FINER_BRUSH, check_text};
use bristle_study::grid::{Interaction, calibration_band, thread_count};
use bristle_study::input::materials::Material;
use bristle_study::input::plausibility::unusual;
use numpy::{PyArray1, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};

use crate::arrays::{Columns, add_columns, frozen, table};
use crate::error::{of_brush, of_brush_run, of_settings, of_value};
use crate::input::{InputFile, occupied_for};
use crate::interrupt::on_a_thread_sharing;

/// A simulated brush.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct SimulatedBrush {
    settings: Settings,
    result: BrushResult,
    frames: usize,
    /// The final state, from which the result follows.
    state: Vec<u8>,
    /// The text of `check.json`, if it was simulated again with more precision.
    checked: Option<String>,
}

/// Simulates the brush of `input` on `threads` threads, with at most `frames` frames, in at most
/// `memory` bytes. Files and checkpoints go to the directory `out`, if there is one, from which it
/// resumes unless it is to `restart`. Simulates again with more precision if it is to `check`.
/// Calls `tell` now and then with the share that is done.
#[pyfunction]
pub fn brush(
    py: Python<'_>,
    input: &InputFile,
    resources: (Option<NonZeroUsize>, Option<u64>),
    frames: usize,
    means: (Option<PathBuf>, bool, bool),
    tell: Option<Py<PyAny>>,
) -> PyResult<SimulatedBrush> {
    let (threads, memory) = resources;
    let (out, restart, check) = means;
    let settings = input.settings()?.clone();
    if settings.brush.is_none() {
        return Err(of_settings(
            "there is no section [brush]; add it, empty if all its defaults are right: `settings.replace(brush={})`",
        ));
    }
    let document = input.document()?;
    let (unstated, material) = (document.unstated(), document.material());
    let _occupied = occupied_for(out.as_deref(), &of_simulation())?;
    let stop = Stop::default();
    let store = out.as_deref().map(|directory| BrushStore {
        directory,
        pause: CHECKPOINT_PAUSE,
        restart,
    });
    let means = BrushMeans {
        options: RunOptions {
            threads: thread_count(threads),
            frames,
            memory,
            ..RunOptions::default()
        },
        stop: &stop,
        store,
    };
    let simulated = on_a_thread_sharing(py, &stop, tell, |tell| {
        let share = if check { 0.5 } else { 1.0 };
        let simulated = simulate_brush(&settings, &means, &mut |event| {
            if let BrushEvent::Begun(done) | BrushEvent::Done(done) = event {
                tell(share * done);
            }
        })?;
        let mut simulated = SimulatedBrush {
            settings: simulated.settings,
            result: simulated.result,
            frames,
            state: state_bytes(&simulated.state),
            checked: None,
        };
        if let Some(out) = &out {
            simulated.write(out, &input.short_name(), (&settings, &unstated, material))?;
        }
        if check {
            let (settings, options) = (&simulated.settings, means.options);
            let done = |done| tell(share + share * done);
            let (metrics, finer) = (
                &simulated.result.tool,
                check_brush(settings, options, &stop, done)?,
            );
            if let Some(out) = &out {
                write_check(out, FINER_BRUSH, metrics, &finer)?;
            }
            simulated.checked = Some(check_text(FINER_BRUSH, metrics, &finer));
        }
        Ok::<_, BrushRunError>(simulated)
    })?;
    simulated.map_err(of_brush_run)
}

impl SimulatedBrush {
    /// Writes its files to a directory. `stated` are the settings before the depth of a force was
    /// found, and what the file leaves to its defaults.
    fn write(
        &self,
        out: &Path,
        name: &str,
        (stated, unstated, material): (&Settings, &[&'static Parameter], Option<&'static Material>),
    ) -> Result<(), FileError> {
        let (settings, result) = (&self.settings, &self.result);
        let mut metrics = Vec::new();
        // The property `metrics` raises why there is no band.
        let band = calibration_band(settings, &result.tool).unwrap_or_default();
        write_brush_metrics(&mut metrics, settings, result, band.as_ref())
            .expect("memory takes what is written to it");
        let unusual = unusual(stated);
        let assumptions = Assumptions::of_contact(settings, unstated).with_material(material);
        let findings = self.found(stated.process.tool_force_n);
        let notes = Notes {
            unusual: &unusual,
            findings: &findings,
            assumptions: &assumptions,
        };
        let brush = self.drawn();
        write_brush(out, name, &metrics, &brush, result, notes, iter::empty()).map(drop)
    }

    /// Returns the content of figures and the page.
    fn drawn(&self) -> Brush {
        let BrushResult {
            filaments,
            history,
            pairs,
            ..
        } = self.result.clone();
        Brush {
            settings: self.settings.clone(),
            interaction: Interaction::of(&self.result),
            filaments,
            history,
            pairs,
        }
    }

    /// Returns the findings, where a force `asked_n` (N) was stated in place of the depth.
    fn found(&self, asked_n: Option<f64>) -> Vec<Finding> {
        judge_case(&JudgedCase {
            settings: &self.settings,
            asked_n,
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

    /// Returns the text of `check.json`, if it was simulated again with more precision.
    fn checked(&self) -> Option<&str> {
        self.checked.as_deref()
    }

    /// Returns the warnings of the program.
    fn warnings(&self) -> Vec<String> {
        let findings = self.found(None);
        findings
            .iter()
            .map(|finding| finding.warning().plain())
            .collect()
    }

    /// Returns the findings about the result, as JSON.
    fn findings(&self) -> PyResult<String> {
        serde_json::to_string(&self.found(None)).map_err(of_settings)
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
    fn state<'py>(&self, py: Python<'py>) -> (usize, Bound<'py, PyBytes>, [f64; 2], Option<&str>) {
        let tool = &self.result.tool;
        (
            self.frames,
            PyBytes::new(py, &self.state),
            [tool.penetration_depth_m, tool.force_stiffness_n_m],
            self.checked(),
        )
    }

    /// Restores the brush from the result of [`SimulatedBrush::state`].
    #[staticmethod]
    fn of_state(
        py: Python<'_>,
        input: &InputFile,
        state: (usize, Vec<u8>, [f64; 2], Option<String>),
    ) -> PyResult<Self> {
        let (frames, state, [depth, stiffness], checked) = state;
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
            checked,
        })
    }

    /// Returns the page that `bristle simulate` writes, without the settings that the file leaves
    /// to their defaults.
    fn page(&self, py: Python<'_>, name: &str) -> String {
        let brush = self.drawn();
        let (unusual, assumptions) = (unusual(&self.settings), Assumptions::default());
        let findings = self.found(None);
        let notes = Notes {
            unusual: &unusual,
            findings: &findings,
            assumptions: &assumptions,
        };
        py.detach(|| brush_page(name, &brush, &self.result, notes))
    }
}
