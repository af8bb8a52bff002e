//! The compiled part of the Python package `bristle`.
//!
//! It joins Python to the libraries. Settings go in as the text of an input file; results come out
//! as NumPy arrays and as JSON with the keys of the result files. The functions for users, with
//! their documentation, are in `bristle/*.py`.

mod arrays;
mod brush;
mod calibration;
mod contact;
mod convergence;
mod distributed;
mod equations;
mod error;
mod input;
mod interrupt;
mod removal;
mod study;
mod tool;

use pyo3::prelude::*;

#[pymodule(gil_used = false)]
fn _bristle(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add(
        "MAX_CONTROL_POINTS",
        bristle_study::input::control_points::MAX_CONTROL_POINTS,
    )?;
    module.add_class::<input::InputFile>()?;
    module.add_class::<contact::Simulated>()?;
    module.add_class::<tool::PythonTool>()?;
    module.add_class::<brush::SimulatedBrush>()?;
    module.add_class::<study::PendingStudy>()?;
    module.add_class::<study::SimulatedStudy>()?;
    module.add_class::<distributed::Cases>()?;
    module.add_function(wrap_pyfunction!(input::paper, module)?)?;
    module.add_function(wrap_pyfunction!(input::read_input, module)?)?;
    module.add_function(wrap_pyfunction!(contact::simulate, module)?)?;
    module.add_function(wrap_pyfunction!(brush::brush, module)?)?;
    module.add_function(wrap_pyfunction!(calibration::calibrate, module)?)?;
    module.add_function(wrap_pyfunction!(convergence::converge, module)?)?;
    module.add_function(wrap_pyfunction!(removal::wear, module)?)?;
    module.add_function(wrap_pyfunction!(equations::accelerations, module)?)?;
    module.add_function(wrap_pyfunction!(equations::evaluate, module)?)?;
    module.add_function(wrap_pyfunction!(equations::derive, module)?)
}
