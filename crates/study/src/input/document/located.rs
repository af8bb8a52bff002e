//! Parts of an input file with their places: materials, sweeps and named tools.

use std::ops::Range;

use crate::grid::Sweep;
use bristle::model::parameters::Parameter;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::input::keys::FILAMENT;
use crate::input::materials::{DENSITY, MODULUS, Material};
use crate::input::options;

/// A material that the file names.
#[derive(Debug)]
pub(super) struct LocatedMaterial {
    pub(super) material: &'static Material,
    /// Values that it states, as TOML.
    pub(super) values: [(&'static Parameter, String); 2],
    /// Place of its name.
    pub(super) span: Range<usize>,
}

/// One entry of `[study]`.
#[derive(Debug)]
pub(super) struct LocatedSweep {
    pub(super) parameter: &'static Parameter,
    pub(super) sweep: Sweep,
    /// Place of the entry's value.
    pub(super) span: Range<usize>,
}

/// A named tool.
#[derive(Debug)]
pub(super) struct LocatedTool<'t> {
    pub(super) name: String,
    /// Place of the name.
    pub(super) span: Range<usize>,
    /// Sections in which the tool states something, or that it adds, and their places.
    pub(super) sections: Vec<(String, Range<usize>)>,
    /// Settings that the tool states.
    pub(super) entries: Vec<Entry<'t>>,
    /// Material that the tool names.
    pub(super) material: Option<LocatedMaterial>,
}

/// A setting that a tool states.
#[derive(Debug)]
pub(super) struct Entry<'t> {
    pub(super) section: String,
    pub(super) key: String,
    pub(super) key_span: Range<usize>,
    pub(super) value: Spanned<DeValue<'t>>,
}

impl Entry<'_> {
    pub(super) fn parameter(&self) -> Option<&'static Parameter> {
        Parameter::find(&self.path())
    }

    pub(super) fn path(&self) -> String {
        format!("{}.{}", self.section, self.key)
    }
}

impl LocatedTool<'_> {
    /// Returns `true` if the tool states the setting at a dotted path.
    pub(super) fn states(&self, path: &str) -> bool {
        self.entries.iter().any(|entry| entry.path() == path)
    }

    /// Returns `true` if the tool leaves aside the file's value of the setting at a dotted path:
    /// its own material precedes numbers of the file.
    pub(super) fn leaves_aside(&self, path: &str) -> bool {
        self.material.is_some() && [DENSITY, MODULUS].contains(&path)
    }

    /// Replaces settings of the tree by those of the tool.
    pub(super) fn state<'a>(&'a self, table: &mut DeTable<'a>) {
        if let Some(DeValue::Table(filament)) = table.get_mut(FILAMENT).map(Spanned::get_mut)
            && self.material.is_some()
        {
            let parameters = [DENSITY, MODULUS].into_iter().filter_map(Parameter::find);
            parameters.for_each(|parameter| drop(filament.remove(parameter.key())));
        }
        for (section, span) in &self.sections {
            options::section_in(table, section, span);
        }
        for Entry {
            section,
            key,
            key_span,
            value,
        } in &self.entries
        {
            let spans = [key_span.clone(), value.span()];
            options::state(table, [section, key], value.get_ref().clone(), spans);
        }
    }
}

/// Returns the section of a key in the table of a tool: the key itself, or the beginning of a
/// dotted path in quotes.
pub(super) fn section_of(key: &str) -> &str {
    key.split_once('.').map_or(key, |(section, _)| section)
}
