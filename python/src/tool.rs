//! A tool by samples of the motion of its clamp.

use bristle::model::settings::Settings;
use bristle::simulation::Pass;
use bristle::tool::Pose;
use bristle::workpiece::Part;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;

use crate::error::of_value;

/// A [`bristle::tool::SampledTool`] whose samples the Python package holds.
#[pyclass(name = "SampledTool", frozen, module = "bristle._bristle")]
pub struct PythonTool {
    tool: bristle::tool::SampledTool,
}

#[pymethods]
impl PythonTool {
    /// Creates the tool through samples of its clamp: positions in m and directions, both of the
    /// shape `(k, 3)`.
    #[new]
    fn new(
        positions: PyReadonlyArray2<'_, f64>,
        directions: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Self> {
        let rows = |array: &PyReadonlyArray2<'_, f64>| -> PyResult<Vec<[f64; 3]>> {
            let (rows, rest) = array.as_slice().map_err(of_value)?.as_chunks::<3>();
            match rest {
                [] => Ok(rows.to_vec()),
                _ => Err(of_value("positions and directions need the shape (k, 3)")),
            }
        };
        let tool = bristle::tool::SampledTool::new(&rows(&positions)?, &rows(&directions)?);
        Ok(Self {
            tool: tool.map_err(of_value)?,
        })
    }
}

impl PythonTool {
    /// Returns the pass of the tool over the workpiece, which lies where the settings place it for
    /// the round tool.
    pub fn pass(
        &self,
        settings: &Settings,
    ) -> Result<Pass<bristle::tool::SampledTool, Part>, String> {
        if Pose::of(&settings.tool) != Pose::UPRIGHT || settings.process.tool_force_n.is_some() {
            return Err("a tool of your own states its pose by its samples and needs a depth: leave out tool.tilt_rad, tool.skew_rad, \
                        tool.kind and process.tool_force_n"
                .to_owned());
        }
        let (part, _) = Part::of(settings).map_err(|violation| violation.to_string())?;
        Pass::with(settings, self.tool.clone(), part).map_err(|error| error.to_string())
    }
}
