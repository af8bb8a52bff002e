//! The input file of a command, and warnings of unusual settings.

use std::borrow::Cow;
use std::path::{Path, PathBuf};

use bristle_app::store::staged::{FileError, read_document, read_input, read_stdin};
use bristle_study::grid::brush::check_brushes;
use bristle_study::grid::{Resources, Study};
use bristle_study::input::document::Document;
use bristle_study::input::plausibility::{Unusual, warnings};
use clap::Args;

use crate::error::CliError;
use crate::terminal::say;

/// Name of a file that was read from stdin.
const STDIN: &str = "stdin";

/// The input file of a command.
#[derive(Args)]
pub struct InputArgs {
    /// Input file, see `bristle explain --schema`; - reads it from stdin
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
    /// State a key in place of the file, as in --set process.rotational_speed_rpm=1200; may be
    /// repeated
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Refuse settings that are unusual, instead of warning of them
    #[arg(long)]
    pub strict: bool,
}

/// The text of an input file.
pub struct InputText<'a> {
    arguments: &'a InputArgs,
    name: String,
    text: String,
}

impl InputArgs {
    /// Reads the file.
    pub fn read(&self) -> Result<InputText<'_>, FileError> {
        if self.is_stdin() {
            return Ok(InputText {
                arguments: self,
                name: STDIN.to_owned(),
                text: read_stdin()?,
            });
        }
        let name = self.file.to_string_lossy().into_owned();
        Ok(InputText {
            arguments: self,
            name,
            text: read_input(&self.file)?,
        })
    }

    /// Returns the name of the file without its directory, for titles.
    pub fn short_name(&self) -> Cow<'_, str> {
        if self.is_stdin() {
            return Cow::Borrowed(STDIN);
        }
        self.file
            .file_name()
            .unwrap_or(self.file.as_os_str())
            .to_string_lossy()
    }

    fn is_stdin(&self) -> bool {
        self.file == Path::new("-")
    }

    /// Warns of unusual settings.
    ///
    /// # Errors If unusual settings are to be refused.
    pub fn warn_of(&self, unusual: &[Unusual]) -> Result<(), CliError> {
        if self.strict && !unusual.is_empty() {
            let warnings = warnings(unusual).join("\n");
            return Err(CliError::of(
                &self.file,
                format!("--strict refuses settings that are unusual\n{warnings}"),
            ));
        }
        warnings(unusual).iter().for_each(say);
        Ok(())
    }

    /// Checks that all brushes of a study can be simulated, if it has any.
    pub fn check_brushes(
        &self,
        study: &Study,
        Resources { threads, memory }: Resources,
    ) -> Result<(), CliError> {
        if !study.has_brush() {
            return Ok(());
        }
        check_brushes(study, threads, memory).map_err(|error| CliError::of(&self.file, error))
    }
}

impl InputText<'_> {
    /// Returns the text.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Parses the text.
    pub fn document(&self) -> Result<Document<'_>, CliError> {
        Ok(read_document(
            &self.arguments.file,
            &self.text,
            &self.name,
            &self.arguments.set,
        )?)
    }

    /// Parses the text, with each filament `alone` or with those that touch each other.
    pub fn document_alone_if(&self, alone: bool) -> Result<Document<'_>, CliError> {
        let document = self.document()?;
        if !alone {
            return Ok(document);
        }
        document.without_brush().map_err(|key| {
            let error = format!(
                "`{key}` is swept, which filaments alone do not have: leave out --alone, or this sweep"
            );
            CliError::of(&self.arguments.file, error)
        })
    }
}
