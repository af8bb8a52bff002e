//! The input file of a command, and warnings of what is unusual in it.

use std::path::PathBuf;

use bristle_study::document::Document;
use bristle_study::plausibility::{Unusual, warnings};
use clap::Args;

use crate::error::CliError;
use crate::files::{FileError, read_document, read_input};
use crate::terminal::say;

/// The input file of a command.
#[derive(Args)]
pub struct InputArgs {
    /// Input file, see `bristle schema`
    #[arg(value_name = "FILE.toml")]
    pub file: PathBuf,
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
        let name = self.file.to_string_lossy().into_owned();
        Ok(InputText { arguments: self, name, text: read_input(&self.file)? })
    }

    /// Warns of what is unusual.
    ///
    /// # Errors
    /// If it is to be refused.
    pub fn warn_of(&self, unusual: &[Unusual]) -> Result<(), CliError> {
        if self.strict && !unusual.is_empty() {
            return Err(CliError::Unusual { path: self.file.clone(), warnings: warnings(unusual) });
        }
        warnings(unusual).iter().for_each(say);
        Ok(())
    }
}

impl InputText<'_> {
    /// What the text states.
    pub fn document(&self) -> Result<Document<'_>, CliError> {
        read_document(&self.arguments.file, &self.text, &self.name)
    }
}
