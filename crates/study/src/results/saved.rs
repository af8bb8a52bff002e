//! `study.json` and `case.json`: the settings of saved results.

use bristle::equations::FINGERPRINT;
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use serde::{Deserialize, Serialize};

use super::data::{AGAIN, DataError, FORMAT, Source};
use crate::digest::digest;
use crate::study::{Study, Sweep, SweepText};
use crate::uncertainty::check;

const IN_JSON: &str = "checked settings have a form in JSON";

/// A study as read from `study.json`.
#[derive(Clone, Debug)]
pub struct SavedStudy {
    /// The grid of settings.
    pub study: Study,
    /// Version of Bristle that simulated it.
    pub version: String,
    /// SHA-256 of the equations that simulated it.
    pub equations: String,
    /// Whether its directory also has measured forces.
    pub measured: bool,
    /// SHA-256 of its `runs.csv`.
    pub(super) runs: String,
}

/// The text of `study.json`. Unknown keys are ignored on reading.
#[derive(Serialize, Deserialize)]
struct StudyFile {
    format: u32,
    bristle_version: String,
    /// [`FINGERPRINT`] of the build.
    equations_sha256: String,
    /// Hash of `runs.csv`. That file gets its final name first: after a crash between the two renames, the hash does not match.
    runs_sha256: String,
    /// Whether `measured.csv` belongs to the results.
    measured: bool,
    settings: Settings,
    axes: Vec<SweepText>,
    /// Hash of all other keys: figures and advice would show results of other settings if one of these were changed.
    sha256: String,
}

impl StudyFile {
    /// The hash of all keys but `sha256`.
    fn digest(&self) -> String {
        let Self { format, bristle_version, equations_sha256, runs_sha256, measured, settings, axes, sha256: _ } = self;
        digest(text(&(format, bristle_version, equations_sha256, runs_sha256, measured, settings, axes)).as_bytes())
    }
}

/// The text of `case.json`.
#[derive(Serialize, Deserialize)]
struct CaseFile {
    format: u32,
    bristle_version: String,
    settings: Settings,
}

/// The text of `study.json` for a `runs.csv` with the text `runs`. `measured` states whether measured forces belong to the
/// results.
#[must_use]
pub fn study_text(study: &Study, runs: &[u8], measured: bool) -> String {
    let mut file = StudyFile {
        format: FORMAT,
        bristle_version: env!("CARGO_PKG_VERSION").to_owned(),
        equations_sha256: FINGERPRINT.to_owned(),
        runs_sha256: digest(runs),
        measured,
        settings: study.base().clone(),
        axes: study.sweep_texts(),
        sha256: String::new(),
    };
    file.sha256 = file.digest();
    pretty(&file)
}

/// The text of `case.json`.
#[must_use]
pub fn case_text(settings: &Settings) -> String {
    let bristle_version = env!("CARGO_PKG_VERSION").to_owned();
    pretty(&CaseFile { format: FORMAT, bristle_version, settings: settings.clone() })
}

fn pretty(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect(IN_JSON) + "\n"
}

fn text(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect(IN_JSON)
}

/// Reads `study.json`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`study_text`] writes, or states settings that a study cannot have.
pub fn read_study(text: &str, name: &str) -> Result<SavedStudy, DataError> {
    let source = Source { name, text };
    let file: StudyFile = source.object()?;
    let digest = file.digest();
    let mut sweeps = Vec::new();
    for SweepText { setting, values } in file.axes {
        let place = || text.lines().position(|line| line.contains(&setting)).map_or(1, |line| line as u64 + 1);
        let parameter = Parameter::find(&setting)
            .ok_or_else(|| source.error(place(), None, format!("there is no setting `{setting}`"), AGAIN))?;
        sweeps.push(
            Sweep::list(parameter, values)
                .map_err(|error| source.error(place(), None, format!("`{setting}`: {error}"), AGAIN))?,
        );
    }
    let study = Study::new(file.settings, sweeps).map_err(|error| source.error(1, None, error.to_string(), AGAIN))?;
    // Checked last, because all checks above can state where the text is wrong.
    if digest != file.sha256 {
        return Err(source.error(1, None, "the file has changed since it was written", AGAIN));
    }
    Ok(SavedStudy {
        study,
        version: file.bristle_version,
        equations: file.equations_sha256,
        measured: file.measured,
        runs: file.runs_sha256,
    })
}

/// Reads `case.json`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`case_text`] writes, or states settings that a simulation cannot have.
pub fn read_case(text: &str, name: &str) -> Result<Settings, DataError> {
    let source = Source { name, text };
    let file: CaseFile = source.object()?;
    check(&file.settings).map_err(|violation| source.error(1, None, violation.to_string(), AGAIN))?;
    Ok(file.settings)
}
