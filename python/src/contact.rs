//! One contact of one filament.

use std::iter;
use std::path::{Path, PathBuf};

use bristle::model::parameters::Parameter;
use bristle::model::record::Record;
use bristle::model::settings::Settings;
use bristle::simulation::{
    ProfileCell, Sample, Sampling, Shape, Simulation, Statistics, Stop, simulate_places,
};
use bristle_app::insight::assumptions::Assumptions;
use bristle_app::insight::findings::{Finding, JudgedCase, JudgedResult, judge_case, judge_study};
use bristle_app::report::page::{ReportContext, course_recorder, page};
use bristle_app::run::contact::{
    self as files, ShapeTimes, last_shapes, write_check, write_contact,
};
use bristle_app::store::results::{
    BuildOrigin, read_history, read_profile, write_history, write_metrics, write_profile,
};
use bristle_app::store::staged::FileError;
use bristle_study::grid::check::{FINER_PASS, check_text, finer_pass};
use bristle_study::grid::{CaseSummary, Study, Sweep, VELOCITY};
use bristle_study::input::statement::Statement;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{Columns, frozen, table};
use crate::error::{of_file, of_settings, of_simulation, of_value};
use crate::input::{InputFile, occupied_for};
use crate::interrupt::{Watch, on_a_thread};
use crate::tool::PythonTool;

/// A simulated pass.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct Simulated {
    settings: Settings,
    simulation: Simulation,
    /// The text of `check.json`, if it was simulated again with more precision.
    checked: Option<String>,
}

/// Simulates the contact of `input`, sampled at `samples` times, with the filament at `shapes`
/// times, and with another `tool` if there is one. Writes the files to the directory `out`, if
/// there is one, and simulates again with more precision if it is to `check`. Calls `tell` now and
/// then with the share that is done.
#[pyfunction]
pub fn simulate(
    py: Python<'_>,
    input: &InputFile,
    samples: usize,
    shapes: usize,
    tool: Option<&Bound<'_, PythonTool>>,
    means: (Option<PathBuf>, bool),
    tell: Option<Py<PyAny>>,
) -> PyResult<Simulated> {
    let (out, check) = means;
    let settings = input.settings()?.clone();
    let _occupied = occupied_for(out.as_deref(), &files::of_simulation())?;
    let times = ShapeTimes::new(&settings, shapes);
    let sampling = if out.is_some() {
        times.sampling(samples)
    } else {
        Sampling {
            samples,
            shapes,
            profile: samples > 0,
            ..Sampling::default()
        }
    };
    let share = if check { 0.5 } else { 1.0 };
    let run = |settings: &Settings, sampling, shares: [f64; 2]| {
        let stop = Stop::default();
        let [begin, share] = shares;
        let tell = tell.as_ref().map(|tell| tell.clone_ref(py));
        let mut watch = Watch::new(&stop, tell);
        let mut look = |done: f64| watch.look(begin + share * done);
        let result = match tool {
            None => py.detach(|| simulate_places(settings, sampling, &stop, &mut look)),
            Some(tool) => {
                let pass = tool.get().pass(settings).map_err(of_settings)?.until(&stop);
                py.detach(|| pass.simulate_telling(sampling, look))
            }
        };
        watch.end()?;
        result.map_err(of_simulation)
    };
    let mut simulation = run(&settings, sampling, [0.0, share])?;
    if let Some(out) = &out {
        write(py, out, &settings, &simulation).map_err(of_file)?;
        simulation.shapes = times.chosen(simulation.shapes);
    }
    let checked = if check {
        let at_depth = settings.at_depth(simulation.metrics.penetration_depth_m);
        let finer = run(&finer_pass(&at_depth), Sampling::default(), [share, share])?;
        if let Some(out) = &out {
            write_check(out, FINER_PASS, &simulation.metrics, &finer.metrics).map_err(of_file)?;
        }
        Some(check_text(FINER_PASS, &simulation.metrics, &finer.metrics))
    } else {
        None
    };
    Ok(Simulated {
        settings,
        simulation,
        checked,
    })
}

/// Writes the files of a contact to a directory.
fn write(
    py: Python<'_>,
    out: &Path,
    settings: &Settings,
    simulation: &Simulation,
) -> Result<(), FileError> {
    let settings = settings.at_depth(simulation.metrics.penetration_depth_m);
    py.detach(|| {
        let drawn = last_shapes(&settings, simulation);
        write_contact(out, &settings, simulation, &drawn, iter::empty()).map(drop)
    })
}

/// Result of [`Simulated::state`].
type PickledPass<'py> = (
    String,
    f64,
    String,
    String,
    (Bound<'py, PyAny>, Bound<'py, PyAny>),
    Option<String>,
);

impl Simulated {
    /// Returns the summary of the pass as a case of a study.
    fn summary(&self) -> CaseSummary {
        let Simulation {
            metrics,
            turn_contact_normal_impulses_n_s,
            statistics,
            ..
        } = &self.simulation;
        CaseSummary {
            metrics: metrics.clone(),
            turn_contact_normal_impulses_n_s: turn_contact_normal_impulses_n_s.clone(),
            statistics: *statistics,
            ..CaseSummary::default()
        }
    }
}

impl Simulated {
    fn found(&self) -> Vec<Finding> {
        let metrics = &self.simulation.metrics;
        judge_case(&JudgedCase {
            settings: &self.settings.at_depth(metrics.penetration_depth_m),
            asked_n: self.settings.process.tool_force_n,
            outcome: Some(JudgedResult {
                metrics,
                statistics: Some(&self.simulation.statistics),
                interaction: None,
            }),
        })
    }
}

#[pymethods]
impl Simulated {
    /// Returns the content of `metrics.json`.
    fn metrics(&self) -> PyResult<String> {
        let mut text = Vec::new();
        write_metrics(&mut text, &self.settings, &self.simulation)?;
        String::from_utf8(text).map_err(of_value)
    }

    /// Returns the work of the solver.
    fn statistics<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let numbers = PyDict::new(py);
        for column in Statistics::COLUMNS {
            let value = column.get(&self.simulation.statistics);
            if column.whole {
                numbers.set_item(column.key, value as i64)?;
            } else {
                numbers.set_item(column.key, value)?;
            }
        }
        Ok(numbers)
    }

    /// Returns the text of `check.json`, if it was simulated again with more precision.
    fn checked(&self) -> Option<&str> {
        self.checked.as_deref()
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

    /// Returns the columns of `history.csv`, and their units.
    fn history<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        table(py, Sample::COLUMNS, &self.simulation.history)
    }

    /// Returns the columns of `profile.csv`, and their units.
    fn profile<'py>(&self, py: Python<'py>) -> PyResult<Columns<'py>> {
        table(py, ProfileCell::COLUMNS, &self.simulation.profile)
    }

    /// Returns the times of the shapes in s, and their nodes in m.
    fn shapes<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let shapes = &self.simulation.shapes;
        let times = shapes.iter().map(|shape| shape.time_s).collect();
        let nodes: Vec<f64> = shapes
            .iter()
            .flat_map(|shape| shape.nodes_m.as_flattened())
            .copied()
            .collect();
        let nodes = PyArray1::from_vec(py, nodes);
        let nodes = nodes.reshape([shapes.len(), self.settings.filament.segments + 1, 3])?;
        Ok((frozen(PyArray1::from_vec(py, times)), frozen(nodes)))
    }

    /// Returns the page of the program for a study of this case alone.
    fn page(&self, py: Python<'_>, name: &str) -> PyResult<String> {
        // A filament alone, as in the simulation.
        let settings = Settings {
            brush: None,
            ..self.settings.clone()
        };
        let velocity = Parameter::find(VELOCITY).ok_or_else(|| of_value("no velocity"))?;
        let sweep = Sweep::list(velocity, vec![settings.process.brushing_velocity_m_s])
            .map_err(of_value)?;
        let study = Study::new(settings, vec![sweep]).map_err(of_settings)?;
        let (results, stop) = ([Ok(self.summary())], Stop::default());
        on_a_thread(py, &stop, || {
            let recorder = course_recorder(&study).until(&stop);
            // Without samples the recorder simulates the case again.
            if self.simulation.shapes.len() > 1 {
                recorder.take(0, &self.simulation);
            }
            let courses = recorder.finish(&results, None)?;
            let context = ReportContext {
                statement: &Statement {
                    title: name.to_owned(),
                    ..Statement::default()
                },
                origin: &BuildOrigin::here(),
                assumptions: &Assumptions::default(),
                answer: None,
                measured: &[],
                findings: &judge_study(&study, &results),
            };
            Ok(page(&study, &results, &courses, &[], &context))
        })?
    }

    /// Returns everything but the settings, for [`Simulated::of_state`]: the summary as JSON, the
    /// tables as their files, and the shapes.
    fn state<'py>(&self, py: Python<'py>) -> PyResult<PickledPass<'py>> {
        let summary = serde_json::to_string(&self.summary()).map_err(of_value)?;
        let (mut history, mut profile) = (Vec::new(), Vec::new());
        write_history(&mut history, &self.simulation.history)?;
        write_profile(&mut profile, &self.simulation.profile)?;
        let [history, profile] = [history, profile].map(String::from_utf8);
        Ok((
            summary,
            self.simulation.end_time_s,
            history.map_err(of_value)?,
            profile.map_err(of_value)?,
            self.shapes(py)?,
            self.checked.clone(),
        ))
    }

    /// Restores the pass from the result of [`Simulated::state`].
    #[staticmethod]
    fn of_state(input: &InputFile, state: PickledPass<'_>) -> PyResult<Self> {
        let (summary, end_time_s, history, profile, (times, nodes), checked) = state;
        let CaseSummary {
            metrics,
            turn_contact_normal_impulses_n_s,
            statistics,
            ..
        } = serde_json::from_str(&summary).map_err(of_value)?;
        let nodes = nodes.extract::<PyReadonlyArray3<'_, f64>>()?;
        let count = nodes.shape()[1];
        let nodes: Vec<[f64; 3]> = nodes.as_slice().map_err(of_value)?.as_chunks().0.to_vec();
        let times = times.extract::<PyReadonlyArray1<'_, f64>>()?;
        let shape = |(&time_s, nodes): (&f64, &[[f64; 3]])| Shape {
            time_s,
            nodes_m: nodes.to_vec(),
            velocities_m_s: Vec::new(),
            forces: Vec::new(),
        };
        let shapes = times
            .as_slice()
            .map_err(of_value)?
            .iter()
            .zip(nodes.chunks(count))
            .map(shape)
            .collect();
        // Without samples, the file of a history has no heading.
        let history = match history.as_str() {
            "" => Vec::new(),
            history => read_history(history, "history").map_err(of_value)?,
        };
        let simulation = Simulation {
            metrics,
            turn_contact_normal_impulses_n_s,
            end_time_s,
            statistics,
            history,
            shapes,
            profile: read_profile(&profile, "profile").map_err(of_value)?,
            positions: Vec::new(),
        };
        Ok(Self {
            settings: input.settings()?.clone(),
            simulation,
            checked,
        })
    }
}
