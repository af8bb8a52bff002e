//! Reads the named tools of a study, `[study.tools.NAME]`, with the settings that replace those of
//! the file, and materials by their names.

use std::borrow::Cow;
use std::ops::Range;

use bristle::model::parameters::Parameter;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::located::{Entry, LocatedMaterial, LocatedTool, section_of};
use super::meant::{did_you_mean, is_section, setting_meant};
use super::tree::Document;
use crate::input::input_error::InputError;
use crate::input::keys::{FILAMENT, MATERIAL_KEY, SECTIONS, STUDY, TOOLS};
use crate::input::materials::{DENSITY, MATERIALS, MODULUS, Material};

/// Path of the name of a material.
const MATERIAL: &str = "filament.material";

/// Values allowed for the named tools.
const TABLES: &str = "tables of settings by the names of the tools, as in [study.tools.fine]";
const TABLE: &str =
    "a table of settings, as in { filament.diameter_m = 0.6e-3, tool.filament_count = 20000 }";

impl<'t> Document<'t> {
    /// Reads the named tools in the order of the file.
    pub(super) fn read_tools(
        &self,
        tools: &Spanned<DeValue<'t>>,
    ) -> Result<Vec<LocatedTool<'t>>, InputError> {
        let Some(entries) = tools
            .get_ref()
            .as_table()
            .filter(|entries| !entries.is_empty())
        else {
            return Err(self.not_allowed(&format!("{STUDY}.{TOOLS}"), tools, TABLES));
        };
        let mut read = Vec::new();
        for (name, value) in entries {
            let span = name.span();
            let name = name.get_ref().to_string();
            let key = format!("{STUDY}.{TOOLS}.{name}");
            let DeValue::Table(stated) = value.get_ref() else {
                return Err(self.not_allowed(&key, value, TABLE));
            };
            let mut entries = self.read_entries(&key, stated)?;
            entries.sort_by_key(|entry| entry.key_span.start);
            let is_material =
                |entry: &mut Entry<'t>| entry.section == FILAMENT && entry.key == MATERIAL_KEY;
            let material = entries.extract_if(.., is_material).last();
            let material = material
                .map(|entry| self.read_material(&entry.value))
                .transpose()?;
            self.check_entries(&entries)?;
            let of_section =
                |key: &Spanned<Cow<'_, str>>| (section_of(key.get_ref()).to_owned(), key.span());
            let sections = stated.keys().map(of_section).collect();
            read.push(LocatedTool {
                name,
                span,
                sections,
                entries,
                material,
            });
        }
        read.sort_by_key(|tool| tool.span.start);
        Ok(read)
    }

    /// Reads the name of a material.
    pub(super) fn read_material(
        &self,
        value: &Spanned<DeValue<'_>>,
    ) -> Result<LocatedMaterial, InputError> {
        let name = value.get_ref().as_str();
        if let Some(material) = name.and_then(Material::find) {
            let values = [
                (DENSITY, material.density_kg_m3),
                (MODULUS, material.youngs_modulus_pa),
            ]
            .map(|(path, value)| {
                let parameter =
                    Parameter::find(path).expect("the table has what a material states");
                (parameter, parameter.format(value))
            });
            return Ok(LocatedMaterial {
                material,
                values,
                span: value.span(),
            });
        }
        let names = || MATERIALS.iter().map(|material| material.name);
        let allowed = format!(
            "one of {}",
            names()
                .map(|name| format!("{name:?}"))
                .collect::<Vec<_>>()
                .join(", ")
        );
        let meant = name.map_or_else(String::new, |name| did_you_mean(name, names()));
        let advice = if meant.is_empty() {
            format!("state `{DENSITY}` and `{MODULUS}` of another material")
        } else {
            meant
        };
        let span = value.span();
        let found = self.source.quote(span.clone());
        Err(self.refused(MATERIAL, found, allowed, span, &advice))
    }

    /// Reads the settings in the table of a tool, which `path` names: those of sections, and those
    /// with dotted paths in quotes.
    fn read_entries(&self, path: &str, stated: &DeTable<'t>) -> Result<Vec<Entry<'t>>, InputError> {
        let mut entries = Vec::new();
        for (key, value) in stated {
            let name = key.get_ref().as_ref();
            let section = section_of(name);
            if !SECTIONS.contains(&section) || (section == name && !value.get_ref().is_table()) {
                return Err(self.not_of_a_tool(path, name, key.span()));
            }
            let entry = |section: &str, key: &str, key_span, value: &Spanned<DeValue<'t>>| Entry {
                section: section.to_owned(),
                key: key.to_owned(),
                key_span,
                value: value.clone(),
            };
            match (name.split_once('.'), value.get_ref()) {
                (Some((section, own)), _) => entries.push(entry(section, own, key.span(), value)),
                (None, DeValue::Table(own)) => {
                    entries.extend(
                        own.iter()
                            .map(|(own, value)| entry(section, own.get_ref(), own.span(), value)),
                    );
                }
                (None, _) => {}
            }
        }
        Ok(entries)
    }

    /// Returns the error about a key that a tool cannot state.
    fn not_of_a_tool(&self, path: &str, name: &str, span: Range<usize>) -> InputError {
        let section = section_of(name);
        let sections = SECTIONS.map(|section| format!("[{section}]")).join(", ");
        let expected =
            format!("a setting of one of the sections {sections}, such as filament.diameter_m");
        let advice = if SECTIONS.contains(&section) {
            format!("state its keys, as in {section}.… = …")
        } else if is_section(section) {
            "all tools share it: state it in its own section, or sweep it under [study]".to_owned()
        } else {
            setting_meant(name)
        };
        self.unknown(&format!("{path}.{name}"), expected, span, &advice)
    }

    /// Checks that a tool states no setting twice, and none that the study sweeps.
    fn check_entries(&self, entries: &[Entry<'_>]) -> Result<(), InputError> {
        for (position, entry) in entries.iter().enumerate() {
            let Some(parameter) = entry.parameter() else {
                continue;
            };
            let is_same =
                |other: &Parameter| parameter.group().any(|same| std::ptr::eq(same, other));
            let mut earlier = entries[..position].iter();
            if let Some(other) = earlier.find(|other| other.parameter().is_some_and(is_same)) {
                let written = |entry: &Entry<'_>| self.written(&entry.path(), &entry.key_span);
                let span = entry.key_span.clone();
                return Err(self.both(&written(entry), &written(other), span, "give one of them"));
            }
            if let Some(swept) = parameter.group().find(|same| self.sweeps(same)) {
                let advice =
                    "the values of a sweep apply to all tools: leave it out here, or under [study]";
                return Err(self.swept(parameter.path, swept, entry.key_span.clone(), advice));
            }
        }
        Ok(())
    }
}
