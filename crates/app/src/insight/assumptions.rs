//! Settings that decide the force and that the input file leaves to their defaults: the assumed
//! values, and the effect of a change of each.
//!
//! Each setting is changed alone, by a tenth, in a pass of its own. The defaults describe one
//! brush; another brush has other values. Friction comes first: no other assumed setting may be as
//! wrong and move the force as much.

use bristle::model::parameters::Parameter;
use bristle::model::settings::Settings;

use crate::insight::findings::place;
use bristle_study::grid::{CaseResult, ForceSensitivity, Study, force_sensitivities};
use bristle_study::input::friction::{FRICTION, TOPIC};
use bristle_study::input::materials::Material;
use bristle_study::input::statement::Statement;
use bristle_study::text::layout::{aligned, wrap};
use bristle_study::text::number::short;

/// Share by which the force changes with a tenth of a setting if the contact is near a resonance of
/// the filament.
const RESONANT: f64 = 0.3;

/// The settings of one contact that have their defaults.
#[derive(Clone, Debug, Default)]
pub struct Assumptions {
    /// Row of the contact in `runs.csv`, counted from 1 below the heading; `None` for a contact of
    /// its own.
    pub row: Option<usize>,
    /// Velocity and depth of the contact, and its filaments if it does not stand for all of them.
    pub place: String,
    /// The settings: friction, then the others in the order of the table of settings.
    pub list: Vec<ForceSensitivity>,
    /// The material that states some of them in place of their defaults.
    pub material: Option<&'static Material>,
}

impl Assumptions {
    /// Returns the settings `unstated` of one contact, with their effects on a filament alone.
    #[must_use]
    pub fn of_contact(settings: &Settings, unstated: &[&'static Parameter]) -> Self {
        let whose = if settings.brush.is_some() {
            ", for one filament alone"
        } else {
            ""
        };
        let place = format!("{}{whose}", place(settings));
        let mut list = force_sensitivities(settings, unstated);
        list.sort_by_key(|assumption| assumption.parameter.path != FRICTION);
        Self {
            row: None,
            place,
            list,
            material: None,
        }
    }

    /// Adds the `material` of the input file, which states some of the settings.
    #[must_use]
    pub fn with_material(self, material: Option<&'static Material>) -> Self {
        Self { material, ..self }
    }

    /// Returns notes on the settings: documentation about friction, a resonance near the contact,
    /// and settings that come from a material.
    #[must_use]
    pub fn notes(&self) -> Vec<String> {
        [
            self.friction_note(),
            self.resonance_note(),
            self.material_note(),
        ]
        .into_iter()
        .flatten()
        .collect()
    }

    /// Returns the setting of the filament that changes the force most, and the share of the
    /// change. `None` unless the change is large enough for a contact near a resonance.
    pub(crate) fn resonance(&self) -> Option<(&'static str, f64)> {
        let of_filament = self
            .list
            .iter()
            .filter(|assumption| assumption.value != 0.0);
        let changes = of_filament
            .filter_map(|assumption| Some((assumption.parameter.path, assumption.force_change?)));
        changes
            .max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
            .filter(|(_, change)| change.abs() > RESONANT)
    }

    fn resonance_note(&self) -> Option<String> {
        self.resonance().map(|(path, change)| {
            format!(
                "Near resonance: 10 % more {path} changes the force by {:+.0} %, as the filament meets the workpiece in another phase of its \
                 vibration. No single force can be relied on here; another speed or depth is safer.",
                100.0 * change
            )
        })
    }

    fn friction_note(&self) -> Option<String> {
        let is_assumed = self
            .list
            .iter()
            .any(|assumption| assumption.parameter.path == FRICTION);
        is_assumed.then(|| {
            format!("Without friction, as in the paper, forces are upper bounds: `bristle explain {TOPIC}`.")
        })
    }

    fn material_note(&self) -> Option<String> {
        let material = self.material?;
        let paths = self.list.iter().map(|assumption| assumption.parameter.path);
        let paths: Vec<&str> = paths
            .filter(|path| material.value(path).is_some())
            .collect();
        let are = if paths.len() == 1 {
            "is that"
        } else {
            "are those"
        };
        let (name, provenance, caution) = (material.name, material.provenance(), material.caution);
        (!paths.is_empty()).then(|| {
            let paths = paths.join(" and ");
            format!("{paths} {are} of filament.material = \"{name}\", {provenance}. {caution}")
                .trim_end()
                .to_owned()
        })
    }

    /// Returns [`Assumptions::of_contact`] for the case of a study with the highest tool force,
    /// without swept settings.
    #[must_use]
    pub fn of_study(study: &Study, results: &[CaseResult], statement: &Statement) -> Self {
        let force = |case: &usize| {
            results[*case]
                .as_ref()
                .map_or(f64::NEG_INFINITY, |summary| {
                    summary.metrics.tool_contact_normal_force_n
                })
        };
        // Of equal ones the first.
        let highest = (0..results.len())
            .rev()
            .max_by(|a, b| force(a).total_cmp(&force(b)));
        let Some(case) = highest else {
            return Self::default();
        };
        let tool = study.tool(case).map(|tool| tool.name.as_str());
        let defaults = statement.defaults_of(study.tool_of(case));
        let is_swept = |parameter: &&Parameter| study.sweep(parameter.path).is_some();
        let unstated: Vec<&'static Parameter> = defaults
            .settings
            .iter()
            .filter_map(|path| Parameter::find(path))
            .filter(|each| !is_swept(each))
            .collect();
        let material = defaults.material.as_deref().and_then(Material::find);
        let contact = Self::of_contact(&study.settings_found(case, &results[case]), &unstated)
            .with_material(material);
        let of_tool = tool
            .map(|name| format!("tool {name}, "))
            .unwrap_or_default();
        Self {
            row: Some(case + 1),
            place: of_tool + &contact.place,
            ..contact
        }
    }

    /// Returns the settings as a table, with prose in lines of at most `width` columns. Empty
    /// without settings.
    #[must_use]
    pub fn text(&self, width: usize) -> String {
        if self.list.is_empty() {
            return String::new();
        }
        let heading = ["assumed", "", "F_n,w at +10 %"]
            .map(str::to_owned)
            .to_vec();
        let row = |assumption: &ForceSensitivity| {
            let ForceSensitivity {
                parameter,
                value,
                changed,
                force_change,
            } = assumption;
            let change = match force_change {
                // Not a negative zero.
                Some(change) if change.abs() < 5e-4 => "0.0 %".to_owned(),
                Some(change) => format!("{:+.1} %", 100.0 * change),
                None => "unknown".to_owned(),
            };
            // A tenth of zero is no change.
            let change = if *value == 0.0 {
                format!("at {}: {change}", short(*changed))
            } else {
                change
            };
            vec![
                parameter.path.to_owned(),
                format!("{} {}", short(*value), parameter.unit)
                    .trim_end()
                    .to_owned(),
                change,
            ]
        };
        let rows: Vec<Vec<String>> = std::iter::once(heading)
            .chain(self.list.iter().map(row))
            .collect();
        let mut text = aligned(&rows).join("\n") + "\n";
        let row = self
            .row
            .map_or_else(String::new, |row| format!(" (row {row})"));
        wrap(
            width,
            &mut text,
            "  ",
            &format!(
                "State them if you know them. Each was changed alone, at {}{row}.",
                self.place
            ),
        );
        for note in self.notes() {
            wrap(width, &mut text, "  ", &note);
        }
        text.truncate(text.trim_end().len());
        text
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::insight::testing::brush;
    use bristle::simulation::simulate;
    use bristle_study::grid::run_study;
    use bristle_study::input::document::Document;
    use bristle_study::text::layout::WIDTH;

    const FILE: &str = concat!(
        brush!(4),
        "
        youngs_modulus_pa = 3e9
        [solver]
        relative_tolerance = 1e-4
        [process]
        brushing_velocity_m_s = 10.0
        penetration_depth_m = 1.0e-3
        [study]
        brushing_velocity_m_s = [5.0, 10.0]
        \"contact.friction_coefficient\" = [0.0, 0.1]
        "
    );

    #[test]
    fn each_unstated_setting_is_changed_alone() {
        let document = Document::parse(FILE, "case.toml").expect("a document");
        let settings = document.settings().expect("settings");
        let unstated = document.unstated();
        let paths: Vec<&str> = unstated.iter().map(|parameter| parameter.path).collect();
        let of_filament = ["filament.density_kg_m3", "filament.damping_ratio"];
        assert_eq!(
            paths,
            [
                of_filament,
                ["contact.stiffness_n_m", "contact.friction_coefficient"]
            ]
            .concat()
        );
        let Assumptions { list, place, .. } = Assumptions::of_contact(&settings, &unstated);
        assert_eq!(place, "v_b = 10 m/s, a_e = 1 mm");
        let force = |change: fn(&mut Settings)| {
            let mut settings = settings.clone();
            change(&mut settings);
            let contact = simulate(&settings).expect("a contact");
            contact.metrics.tool_contact_normal_force_n
        };
        let changes: [fn(&mut Settings); 4] = [
            |settings| settings.contact.friction_coefficient = 0.1,
            |settings| settings.filament.density_kg_m3 *= 1.1,
            |settings| settings.filament.damping_ratio *= 1.1,
            |settings| settings.contact.stiffness_n_m *= 1.1,
        ];
        let nominal = force(|_| ());
        for (assumption, change) in list.iter().zip(changes) {
            let found = assumption.force_change.expect("a force");
            let expected = force(change) / nominal - 1.0;
            assert!(
                (found - expected).abs() < 1e-12,
                "{}",
                assumption.parameter.path
            );
        }
    }

    #[test]
    fn what_a_material_states_is_told_as_such() {
        let text = FILE.replace("youngs_modulus_pa = 3e9", "material = \"PA6.6\"");
        let document = Document::parse(&text, "case.toml").expect("a document");
        let settings = document.settings().expect("settings");
        let assumptions = Assumptions::of_contact(&settings, &document.unstated())
            .with_material(document.material());
        let modulus = assumptions
            .list
            .iter()
            .find(|each| each.parameter.key() == "youngs_modulus_pa");
        assert_eq!(modulus.map(|modulus| modulus.value), Some(3.59e9));
        let table = assumptions.text(WIDTH);
        let note = table.split_whitespace().collect::<Vec<_>>().join(" ");
        for part in [
            "filament.youngs_modulus_pa are those of filament.material = \"PA6.6\", as published",
            "Water uptake about halves the modulus",
            "Without friction, as in the paper, forces are upper bounds: `bristle explain friction`.",
        ] {
            assert!(note.contains(part), "{part}: {table}");
        }
        assert!(
            note.starts_with("assumed F_n,w at +10 % contact.friction_coefficient 0 at 0.1: "),
            "{table}"
        );
        let without = Assumptions {
            material: None,
            ..assumptions
        };
        assert_eq!(without.notes().len(), 1, "that of friction");
    }

    #[test]
    fn a_study_changes_them_where_its_force_is_highest() {
        let document = Document::parse(FILE, "case.toml").expect("a document");
        let study = document.study().expect("a study");
        let results = run_study(&study, None, || {}).expect("the threads start");
        let assumptions = Assumptions::of_study(&study, &results, &Statement::of(&document, ""));
        let text = assumptions.text(WIDTH);
        assert!(
            !text.contains("friction") && text.contains("filament.damping_ratio"),
            "{text}"
        );
        let force = |case: &CaseResult| {
            case.as_ref()
                .map_or(0.0, |case| case.metrics.tool_contact_normal_force_n)
        };
        let highest = force(&results[assumptions.row.expect("a row") - 1]);
        assert!(results.iter().all(|case| force(case) <= highest));
        let stated = [
            "filament.density_kg_m3=1110",
            "filament.damping_ratio=0.05",
            "contact.stiffness_n_m=1e5",
        ];
        let stated = stated.map(str::to_owned);
        let whole = Document::parse_with(FILE, "case.toml", &stated).expect("a document");
        assert_eq!(
            Assumptions::of_study(&study, &results, &Statement::of(&whole, "")).text(WIDTH),
            ""
        );
    }
}
