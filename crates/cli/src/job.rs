//! The arguments of commands that simulate what an input file states.

use std::path::PathBuf;

use bristle_app::insight::findings::{Finding, rule};
use bristle_app::store::staged::{Occupied, occupy, prepare_directory};
use bristle_app::store::vtk_files::{VTK, is_file_name};
use bristle_study::input::document::Document;
use clap::Args;

use crate::error::CliError;
use crate::input::{InputArgs, InputText};
use crate::pictures::{FIGURES, FigureArgs, is_picture};
use crate::values::ResourceArgs;

/// Arguments of every command that simulates an input file, with one meaning.
#[derive(Args)]
pub struct JobArgs {
    #[command(flatten)]
    pub input: InputArgs,
    /// Directory for the results, created if it does not exist
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    #[command(flatten)]
    pub figures: FigureArgs,
    #[command(flatten)]
    pub resources: ResourceArgs,
    /// Leave out [brush]: simulate each filament alone
    #[arg(long, visible_alias = "without-interaction")]
    pub alone: bool,
    /// Discard what DIR keeps of an earlier call, and simulate from the beginning
    #[arg(long)]
    pub restart: bool,
    /// Simulate again with more precision, and say what that changes
    #[arg(long)]
    pub check: bool,
    /// Do not tell a finding, as B003; `bristle explain B003` says what it means; may be repeated
    #[arg(long, value_name = "ID", value_parser = parse_rule)]
    pub ignore: Vec<&'static str>,
    /// Print progress and results to stdout as JSON objects, one per line, instead of tables
    #[arg(long)]
    pub json: bool,
}

impl JobArgs {
    /// Parses the input file, without [brush] if filaments are to be alone.
    pub fn document<'t>(&self, text: &'t InputText<'_>) -> Result<Document<'t>, CliError> {
        text.document_alone_if(self.alone)
    }

    /// The findings that are told.
    pub fn told(&self, findings: Vec<Finding>) -> Vec<Finding> {
        told(findings, &self.ignore)
    }

    /// Prepares the directory for the results, and announces that this process writes `files`,
    /// figures that `is_figure` names, and files for ParaView.
    pub fn occupy(
        &self,
        files: &[&str],
        is_figure: fn(&str) -> bool,
    ) -> Result<Occupied, CliError> {
        prepare_directory(&self.out)?;
        let occupied = occupy(
            &self.out,
            &[
                ("", &|name| files.contains(&name)),
                (FIGURES, &is_picture(is_figure)),
                (VTK, &is_file_name),
            ],
        )?;
        Ok(occupied)
    }
}

/// Parses the id of a rule.
pub fn parse_rule(text: &str) -> Result<&'static str, String> {
    rule(text)
        .map(|rule| rule.id)
        .ok_or_else(|| "there is no such finding: they are B001, B002, …".to_owned())
}

/// The findings whose ids are not to be ignored.
pub fn told(mut findings: Vec<Finding>, ignored: &[&str]) -> Vec<Finding> {
    findings.retain(|finding| !ignored.contains(&finding.id));
    findings
}
