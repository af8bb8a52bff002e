//! Settings as the text of an input file, read and checked by the program's own reader.

use std::fs;
use std::path::PathBuf;

use bristle::model::settings::Settings;
use bristle_study::control_points::read_control_points;
use bristle_study::document::Document;
use bristle_study::input_error::InputError;
use bristle_study::plausibility::unusual;
use pyo3::prelude::*;

use crate::error::{of_input, of_settings};

/// An input file that has been read and checked.
#[pyclass(frozen, module = "bristle._bristle")]
pub struct Input {
    text: String,
    name: String,
    settings: Settings,
    /// What is missing for a single contact, because the section `[study]` states it.
    missing: Option<InputError>,
    unusual: Vec<String>,
}

impl Input {
    /// The settings of a single contact.
    pub fn settings(&self) -> PyResult<&Settings> {
        self.missing.as_ref().map_or(Ok(&self.settings), |error| Err(of_input(error)))
    }

    /// What the file is called.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// What the text states.
    pub fn document(&self) -> PyResult<Document<'_>> {
        Document::parse(&self.text, &self.name).map_err(|error| of_input(&error))
    }
}

#[pymethods]
impl Input {
    #[new]
    fn new(text: String, name: String) -> PyResult<Self> {
        let (settings, missing) = {
            let document = Document::parse(&text, &name).map_err(|error| of_input(&error))?;
            match document.settings() {
                Ok(settings) => (settings, None),
                Err(error) => match document.study() {
                    Ok(study) => (study.base().clone(), Some(error)),
                    Err(_) => return Err(of_input(&error)),
                },
            }
        };
        let found = if missing.is_some() { Vec::new() } else { unusual(&settings) };
        let unusual = found.into_iter().map(|unusual| unusual.statement).collect();
        Ok(Self { text, name, settings, missing, unusual })
    }

    /// The values of all settings, as JSON.
    fn values(&self) -> PyResult<String> {
        serde_json::to_string(&self.settings).map_err(|error| of_settings(error.to_string()))
    }

    /// Warnings of what is unusual.
    fn unusual(&self) -> Vec<String> {
        self.unusual.clone()
    }
}

/// All settings of the brush of Uhlmann and Hoyer (2021) at a velocity (m/s) and a depth (m), as JSON.
#[pyfunction]
pub fn paper(brushing_velocity_m_s: f64, penetration_depth_m: f64) -> PyResult<String> {
    let settings = Settings::paper(brushing_velocity_m_s, penetration_depth_m);
    serde_json::to_string(&settings).map_err(|error| of_settings(error.to_string()))
}

/// The text of an input file, once it has been checked, and the control points in m that it takes from another file.
#[pyfunction]
pub fn read_input(path: PathBuf) -> PyResult<(String, Option<Vec<[f64; 2]>>)> {
    let text = fs::read_to_string(&path)?;
    let name = path.to_string_lossy();
    let mut document = Document::parse(&text, &name).map_err(|error| of_input(&error))?;
    let mut points = None;
    if let Some(file) = document.control_points_file() {
        let file = path.parent().map_or_else(|| PathBuf::from(file), |directory| directory.join(file));
        let read = read_control_points(&fs::read_to_string(&file)?, &file.to_string_lossy());
        let read = read.map_err(|error| of_settings(error.to_string()))?;
        document.set_control_points(read.clone());
        points = Some(read);
    }
    let alone = document.settings();
    if let Err(error) = alone
        && document.study().is_err()
    {
        return Err(of_input(&error));
    }
    Ok((text.clone(), points))
}
