//! Settings as the text of an input file, read and checked by the program's own reader.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bristle::model::settings::{Settings, WorkpieceKind};
use bristle_app::store::staged::{
    Occupied, occupy, prepare_directory, read_document, read_input as read_file, read_table,
    relative_to,
};
use bristle_study::grid::Study;
use bristle_study::input::document::Document;
use bristle_study::input::input_error::InputError;
use bristle_study::input::measured::{Measurement, read_measured};
use bristle_study::input::plausibility::{unusual, unusual_in_study};
use bristle_study::input::statement::Statement;
use pyo3::prelude::*;

use crate::error::{of_document, of_file, of_input, of_settings};

/// An input file that has been read and checked.
#[pyclass(name = "Input", frozen, module = "bristle._bristle")]
pub struct InputFile {
    text: String,
    name: String,
    settings: Settings,
    /// Setting that a single contact lacks because the section `[study]` states it.
    missing: Option<InputError>,
    unusual: Vec<String>,
}

impl InputFile {
    /// Returns the text that states the settings, in TOML.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the settings of a single contact.
    pub fn settings(&self) -> PyResult<&Settings> {
        self.missing
            .as_ref()
            .map_or(Ok(&self.settings), |error| Err(of_input(error.clone())))
    }

    /// Returns the name of the file without its directory.
    pub fn short_name(&self) -> Cow<'_, str> {
        let path = Path::new(&self.name);
        path.file_name()
            .unwrap_or(path.as_os_str())
            .to_string_lossy()
    }

    /// Returns the statement of the text besides its cases.
    pub fn statement(&self) -> PyResult<Statement> {
        Ok(Statement::of(&self.document()?, &self.short_name()))
    }

    /// Returns the measured forces that the text names.
    pub fn measured(&self) -> PyResult<Vec<Measurement>> {
        let document = self.document()?;
        let Some((file, format)) = document.measured() else {
            return Ok(Vec::new());
        };
        let table = read_table(Path::new(file)).map_err(of_file)?;
        read_measured(&table, file, format).map_err(of_settings)
    }

    /// Returns the study that the text states, whose cases are simulated again with more precision
    /// if it is to `check`.
    pub fn study(&self, check: bool) -> PyResult<Study> {
        let study = self.document()?.study().map_err(of_input)?;
        Ok(if check { study.checked() } else { study })
    }

    /// Parses the text.
    pub fn document(&self) -> PyResult<Document<'_>> {
        Document::parse(&self.text, &self.name).map_err(of_input)
    }
}

/// Returns the settings that a document states, and the error about those that a single contact
/// lacks because `[study]` states them.
fn settings_of(document: &Document<'_>) -> PyResult<(Settings, Option<InputError>)> {
    let missing = match document.settings() {
        Ok(settings) => return Ok((settings, None)),
        Err(error) => error,
    };
    if !document.has_study() {
        return Err(of_input(missing));
    }
    let study = document.study().map_err(of_input)?;
    Ok((study.base().clone(), Some(missing)))
}

#[pymethods]
impl InputFile {
    #[new]
    fn new(text: String, name: String) -> PyResult<Self> {
        let document = Document::parse(&text, &name).map_err(of_input)?;
        let (settings, missing) = settings_of(&document)?;
        let found = if missing.is_some() {
            Vec::new()
        } else {
            unusual(&settings)
        };
        let unusual = found.into_iter().map(|unusual| unusual.statement).collect();
        Ok(Self {
            text,
            name,
            settings,
            missing,
            unusual,
        })
    }

    /// Returns the values of all settings, as JSON.
    fn values(&self) -> PyResult<String> {
        serde_json::to_string(&self.settings).map_err(of_settings)
    }

    /// Returns `true` if the input states a single contact, and leaves no setting to a study.
    fn is_single(&self) -> bool {
        self.missing.is_none()
    }

    /// Returns warnings of unusual settings of a single contact.
    fn unusual(&self) -> Vec<String> {
        self.unusual.clone()
    }

    /// Returns warnings of unusual settings of the study.
    fn unusual_in_study(&self) -> PyResult<Vec<String>> {
        let study = self.study(false)?;
        Ok(unusual_in_study(&study)
            .into_iter()
            .map(|unusual| unusual.statement)
            .collect())
    }
}

/// Returns all settings of the brush of Uhlmann and Hoyer (2021) at a velocity (m/s) and a depth
/// (m), as JSON.
#[pyfunction]
pub fn paper(brushing_velocity_m_s: f64, penetration_depth_m: f64) -> PyResult<String> {
    let settings = Settings::paper(brushing_velocity_m_s, penetration_depth_m);
    serde_json::to_string(&settings).map_err(of_settings)
}

/// Control points of a spline, in m.
type Points = Vec<[f64; 2]>;

/// Returns the checked text of an input file and the control points in m that it takes from another
/// file. Also returns the path of its measured forces, relative to the current directory.
#[pyfunction]
pub fn read_input(path: PathBuf) -> PyResult<(String, Option<Points>, Option<String>)> {
    let text = read_file(&path).map_err(of_file)?;
    let name = path.to_string_lossy();
    let document = read_document(&path, &text, &name, &[]).map_err(of_document)?;
    let (settings, _) = settings_of(&document)?;
    let points = match settings.workpiece.kind {
        WorkpieceKind::Profile(profile) if document.control_points_file().is_some() => {
            Some(profile.control_points_m)
        }
        _ => None,
    };
    let measured = document
        .measured()
        .map(|(file, _)| relative_to(&path, file).to_string_lossy().into_owned());
    Ok((text, points, measured))
}

/// Creates and occupies the directory `out`, if any, for files of these names.
pub fn occupied_for(out: Option<&Path>, names: &[&str]) -> PyResult<Option<Occupied>> {
    let prepare = |out: &Path| {
        prepare_directory(out)?;
        occupy(out, &[("", &|name| names.contains(&name))])
    };
    out.map(prepare).transpose().map_err(of_file)
}
