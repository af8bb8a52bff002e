//! `study.json` and `case.json`: the settings of saved results.

use std::collections::BTreeMap;

use bristle::equations::FINGERPRINT;
use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::store::digest::digest;
use crate::store::method::method_of_study;
use bristle_study::grid::uncertainty::check;
use bristle_study::grid::{Study, Sweep, SweepText, ToolText};
use bristle_study::input::plausibility::unusual_in_study;
use bristle_study::input::statement::Statement;
use bristle_study::input::table::{AGAIN, DataError, Source};

/// Versions of the formats of `study.json` and `case.json`.
const STUDY_FORMAT: u32 = 8;
const CASE_FORMAT: u32 = 4;

const IN_JSON: &str = "checked settings have a form in JSON";
const CHANGED: &str = "the file has changed since it was written";

/// The build of Bristle that simulated a study.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BuildOrigin {
    /// Version of Bristle.
    pub version: String,
    /// SHA-256 of the equations.
    pub equations: String,
}

impl BuildOrigin {
    /// Returns this build.
    #[must_use]
    pub fn here() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION").to_owned(),
            equations: FINGERPRINT.to_owned(),
        }
    }

    /// Returns the common origin of results from `self` and from `other`.
    #[must_use]
    pub fn and(self, other: &Self) -> Self {
        let both = |own: String, other: &String| {
            if own == *other {
                own
            } else {
                format!("{own} and {other}")
            }
        };
        Self {
            version: both(self.version, &other.version),
            equations: both(self.equations, &other.equations),
        }
    }
}

/// A study as read from `study.json`.
#[derive(Clone, Debug)]
pub struct SavedStudy {
    /// The grid of settings.
    pub study: Study,
    /// The build that simulated the study.
    pub origin: BuildOrigin,
    /// Statement of its input file.
    pub statement: Statement,
    /// `true` if the directory of the study also has measured forces.
    pub measured: bool,
    /// SHA-256 of `runs.csv`.
    pub(super) runs: String,
}

impl SavedStudy {
    /// Returns `true` for a shard, whose results are in its journal only.
    #[must_use]
    pub fn is_shard(&self) -> bool {
        self.runs.is_empty()
    }
}

/// The text of `study.json`. Unknown keys are ignored on reading.
#[derive(Serialize, Deserialize)]
struct StudyFile {
    format: u32,
    bristle_version: String,
    /// [`FINGERPRINT`] of the build.
    equations_sha256: String,
    /// Hash of `runs.csv`. That file gets its final name first: after a crash between the two
    /// renames, the hash does not match.
    runs_sha256: String,
    /// `true` if `measured.csv` belongs to the results.
    measured: bool,
    /// Settings of the first tool, if tools are compared.
    settings: Settings,
    /// The compared tools.
    tools: Vec<ToolText>,
    axes: Vec<SweepText>,
    /// Warnings of unusual settings, in sentences.
    warnings: Vec<String>,
    statement: Statement,
    /// Findings about the results.
    findings: Vec<Value>,
    /// Method of the results, as a paragraph.
    method: String,
    /// Hash of all other keys. It reveals a change that would make figures and advice show results
    /// of other settings.
    own_sha256: String,
}

impl StudyFile {
    /// Returns the hash of all keys but `own_sha256`.
    fn digest(&self) -> String {
        let Self {
            format,
            bristle_version,
            equations_sha256,
            runs_sha256,
            measured,
            settings,
            tools,
            axes,
            warnings,
            statement,
            findings,
            method,
            own_sha256: _,
        } = self;
        json_digest(&(
            format,
            bristle_version,
            equations_sha256,
            runs_sha256,
            measured,
            settings,
            tools,
            axes,
            warnings,
            statement,
            findings,
            method,
        ))
    }
}

/// The SHA-256 of each result file of a contact, keyed by its path relative to the directory of the
/// results, with `/`.
pub type FileHashes = BTreeMap<String, String>;

/// One contact as read from `case.json`.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedCase {
    /// Settings of the contact.
    pub settings: Settings,
    /// Hashes of the other files.
    files: FileHashes,
}

impl SavedCase {
    /// Returns the paths of the other files, relative to the directory of the results, as the file
    /// states them. A path may lead anywhere.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.files.keys().map(String::as_str)
    }

    /// Checks that the `text` of a file belongs to this contact. Errors use `name` for the file.
    ///
    /// # Errors
    /// If it comes from another run, or has been changed.
    pub fn check(&self, file: &str, text: &str, name: &str) -> Result<(), DataError> {
        if self
            .files
            .get(file)
            .is_some_and(|hash| *hash == digest(text.as_bytes()))
        {
            Ok(())
        } else {
            Err(Source { name, text }.error(
                1,
                None,
                "case.json does not belong to these results",
                AGAIN,
            ))
        }
    }
}

/// The text of `case.json`. Unknown keys are ignored on reading.
#[derive(Serialize, Deserialize)]
struct CaseFile {
    format: u32,
    bristle_version: String,
    settings: Settings,
    /// Hashes of the other files. After a crash between two renames, one of them does not match.
    sha256: FileHashes,
    /// Hash of all other keys.
    own_sha256: String,
}

impl CaseFile {
    /// Returns the hash of all keys but `own_sha256`.
    fn digest(&self) -> String {
        let Self {
            format,
            bristle_version,
            settings,
            sha256,
            own_sha256: _,
        } = self;
        json_digest(&(format, bristle_version, settings, sha256))
    }
}

/// Returns [`study_text_from`] this build, of a study without a statement.
#[must_use]
pub fn study_text(study: &Study, runs: &[u8], measured: bool) -> String {
    study_text_from(
        study,
        &BuildOrigin::here(),
        &Statement::default(),
        &[],
        Some(runs),
        measured,
    )
}

/// Returns the text of `study.json` with the `findings`, for `runs` of the build `origin`. `runs`
/// is the text of `runs.csv`, which a shard lacks. `measured` is `true` if measured forces belong
/// to the results.
#[must_use]
pub fn study_text_from(
    study: &Study,
    origin: &BuildOrigin,
    statement: &Statement,
    findings: &[Value],
    runs: Option<&[u8]>,
    measured: bool,
) -> String {
    let mut file = StudyFile {
        format: STUDY_FORMAT,
        bristle_version: origin.version.clone(),
        equations_sha256: origin.equations.clone(),
        runs_sha256: runs.map(digest).unwrap_or_default(),
        measured,
        settings: study.base().clone(),
        tools: study.tool_texts(),
        axes: study.sweep_texts(),
        warnings: unusual_in_study(study)
            .into_iter()
            .map(|unusual| unusual.statement)
            .collect(),
        statement: statement.clone(),
        findings: findings.to_vec(),
        method: method_of_study(study, &origin.version),
        own_sha256: String::new(),
    };
    file.own_sha256 = file.digest();
    pretty(&file)
}

/// Returns the text of `case.json` for a contact with these result `files`.
#[must_use]
pub fn case_text(settings: &Settings, files: &FileHashes) -> String {
    let bristle_version = env!("CARGO_PKG_VERSION").to_owned();
    let (settings, sha256) = (settings.clone(), files.clone());
    let mut file = CaseFile {
        format: CASE_FORMAT,
        bristle_version,
        settings,
        sha256,
        own_sha256: String::new(),
    };
    file.own_sha256 = file.digest();
    pretty(&file)
}

fn pretty(value: &impl Serialize) -> String {
    serde_json::to_string_pretty(value).expect(IN_JSON) + "\n"
}

/// Returns the SHA-256 of a value as JSON.
fn json_digest(value: &impl Serialize) -> String {
    digest(serde_json::to_string(value).expect(IN_JSON).as_bytes())
}

/// Reads `study.json`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`study_text`] writes, or states settings that a study cannot have.
pub fn read_study(text: &str, name: &str) -> Result<SavedStudy, DataError> {
    let source = Source { name, text };
    let file: StudyFile = source.object(STUDY_FORMAT)?;
    let digest = file.digest();
    let mut sweeps = Vec::new();
    for SweepText { setting, values } in file.axes {
        let place = || {
            text.lines()
                .position(|line| line.contains(&setting))
                .map_or(1, |line| line as u64 + 1)
        };
        let parameter = Parameter::find(&setting).ok_or_else(|| {
            source.error(
                place(),
                None,
                format!("there is no setting `{setting}`"),
                AGAIN,
            )
        })?;
        sweeps.push(Sweep::list(parameter, values).map_err(|error| {
            source.error(place(), None, format!("`{setting}`: {error}"), AGAIN)
        })?);
    }
    let tools = file
        .tools
        .into_iter()
        .map(ToolText::tool)
        .collect::<Result<Vec<_>, _>>();
    let tools = tools
        .map_err(|path| source.error(1, None, format!("there is no setting `{path}`"), AGAIN))?;
    let study = if tools.is_empty() {
        Study::new(file.settings, sweeps)
    } else {
        Study::of_tools(tools, sweeps)
    };
    let study = study.map_err(|error| source.error(1, None, error.to_string(), AGAIN))?;
    // Checked last, because all checks above can state where the text is wrong.
    if digest != file.own_sha256 {
        return Err(source.error(1, None, CHANGED, AGAIN));
    }
    Ok(SavedStudy {
        study,
        origin: BuildOrigin {
            version: file.bristle_version,
            equations: file.equations_sha256,
        },
        statement: file.statement,
        measured: file.measured,
        runs: file.runs_sha256,
    })
}

/// Reads `case.json`. Errors use `name` for the file.
///
/// # Errors
/// If the text is not what [`case_text`] writes, or states settings that a simulation cannot have.
pub fn read_case(text: &str, name: &str) -> Result<SavedCase, DataError> {
    let source = Source { name, text };
    let file: CaseFile = source.object(CASE_FORMAT)?;
    check(&file.settings)
        .map_err(|violation| source.error(1, None, violation.to_string(), AGAIN))?;
    if file.digest() != file.own_sha256 {
        return Err(source.error(1, None, CHANGED, AGAIN));
    }
    Ok(SavedCase {
        settings: file.settings,
        files: file.sha256,
    })
}
