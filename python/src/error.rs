//! The errors of the libraries as exceptions, with the same texts.

use std::fmt::Display;
use std::io;

use bristle::brush::BrushError;
use bristle::integrate::StepControlError;
use bristle::simulation::{IntegrationError, SimulationError};
use bristle_app::run::brush::BrushRunError;
use bristle_app::run::calibration::CalibrationError;
use bristle_app::store::journal_file::JournalFileError;
use bristle_app::store::staged::{DocumentError, FileError};
use bristle_study::input::input_error::InputError;
use pyo3::PyErr;
use pyo3::exceptions::PyValueError;

/// The exceptions, which are defined in Python.
mod exceptions {
    pyo3::import_exception!(bristle._errors, SettingsError);
    pyo3::import_exception!(bristle._errors, SimulationError);
}

/// Returns the exception for invalid settings, with key and line.
pub fn of_input(error: InputError) -> PyErr {
    exceptions::SettingsError::new_err((error.to_string(), error.key, error.location.line))
}

/// Returns the exception for an input file.
pub fn of_document(error: DocumentError) -> PyErr {
    match error {
        DocumentError::File(error) => of_file(error),
        DocumentError::Input(error) => of_input(error),
        DocumentError::Data(error) => of_settings(error),
    }
}

/// Returns the exception for a file, by the kind of the error.
pub fn of_file(error: FileError) -> PyErr {
    io::Error::new(error.kind(), error.to_string()).into()
}

/// Returns the exception for the journal of a study.
pub fn of_journal(error: JournalFileError) -> PyErr {
    match error {
        JournalFileError::File(error) => of_file(error),
        _ => of_settings(error),
    }
}

/// Returns the exception for invalid settings whose reason concerns no single key.
pub fn of_settings(error: impl ToString) -> PyErr {
    exceptions::SettingsError::new_err((error.to_string(), None::<String>, None::<usize>))
}

/// Returns the exception for a simulation, with time and step in s.
pub fn of_simulation(error: SimulationError) -> PyErr {
    let (time, step) =
        match &error {
            SimulationError::Integration(IntegrationError::Step(
                StepControlError::StepTooSmall { time, step, .. },
            )) => (Some(*time), Some(*step)),
            SimulationError::Integration(IntegrationError::Step(
                StepControlError::NotFinite { time } | StepControlError::Refused { time, .. },
            )) => (Some(*time), None),
            SimulationError::Integration(IntegrationError::TooManySteps { step, .. }) => {
                (None, Some(*step))
            }
            SimulationError::Integration(
                IntegrationError::Jump { time, .. } | IntegrationError::Normal { time, .. },
            ) => (Some(*time), None),
            SimulationError::Integration(IntegrationError::NotFree | IntegrationError::Stopped)
            | SimulationError::NotFinite
            | SimulationError::Force(_)
            | SimulationError::Unbalanced { .. }
            | SimulationError::NoEquilibrium => (None, None),
        };
    failed(error, time, step)
}

/// Returns the exception for a brush. The settings are to blame if there is no such brush, or no
/// steady range of columns.
pub fn of_brush(error: BrushError) -> PyErr {
    match error {
        BrushError::NoConvergence { time, .. } | BrushError::Crossing { time, .. } => {
            failed(error, Some(time), None)
        }
        BrushError::Alone(alone) => of_simulation(alone),
        BrushError::Threads | BrushError::Stopped | BrushError::NoLanes => {
            failed(error, None, None)
        }
        _ => of_settings(error),
    }
}

/// Returns the exception for a brush whose files go to a directory.
pub fn of_brush_run(error: BrushRunError) -> PyErr {
    match error {
        BrushRunError::Refused(error) | BrushRunError::Failed(error) => of_brush(error),
        BrushRunError::File(error) => of_file(error),
        BrushRunError::Journal(error) => of_journal(error),
        BrushRunError::Checkpoint(error) => of_settings(error),
    }
}

/// Returns the exception for a calibration.
pub fn of_calibration(error: CalibrationError) -> PyErr {
    match error {
        CalibrationError::Input(error) => of_input(error),
        CalibrationError::File(error) => of_file(error),
        CalibrationError::Journal(error) => of_journal(error),
        error => of_settings(error),
    }
}

fn failed(error: impl Display, time: Option<f64>, step: Option<f64>) -> PyErr {
    exceptions::SimulationError::new_err((format!("the simulation failed: {error}"), time, step))
}

/// Returns the exception for an argument with a wrong value.
pub fn of_value(error: impl ToString) -> PyErr {
    PyValueError::new_err(error.to_string())
}
