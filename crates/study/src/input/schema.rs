//! The JSON schema of an input file, for editors and for programs that write one.

use std::collections::BTreeMap;
use std::ops::Bound;
use std::sync::LazyLock;

use schemars::JsonSchema;
use schemars::generate::SchemaSettings;
use serde_json::{Map, Value, json};

use crate::grid::{SHORT_NAMES, TOOL};
use crate::input::cells::{DECIMALS, SEPARATORS};
use crate::input::goal::goal_schema;
use crate::input::keys::{SECTIONS, STUDY, TOOLS, WORKPIECE};
use crate::input::materials::MATERIALS;
use crate::input::measured::Quantity;
use crate::input::units::other_paths;
use crate::text::capitalised;
use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::settings::{Settings, WorkpieceKind};

/// Path of a setting that files of results leave out where it is zero.
const SKEW: &str = "tool.skew_rad";

/// Returns the schema, with the limits of every number, as indented text.
#[must_use]
pub fn input_schema() -> String {
    format!("{:#}\n", file_schema())
}

/// Returns `true` if a key of a section is the path of a setting of another: those of the sweeps
/// are.
pub(crate) fn is_stated_elsewhere(section: &str, key: &str) -> bool {
    section == STUDY && key != TOOLS
}

pub(crate) fn file_schema() -> Value {
    let mut schema = settings_schema();
    schema["title"] = json!("Input file of Bristle");
    for parameter in PARAMETERS {
        let property =
            &mut schema["properties"][parameter.section()]["properties"][parameter.key()];
        if !parameter.instead_of.is_empty() && property.is_null() {
            let description = format!(
                "{}{}, instead of `{}`.",
                capitalised(parameter.name),
                parameter.in_unit(),
                parameter.instead_of
            );
            *property = json!({ "type": "number", "description": description });
        }
        if let Value::Object(number) = property {
            state_limits(number, parameter);
            // A setting that is left out where it is zero has no default in the structure.
            if parameter.path == SKEW {
                number.insert("default".to_owned(), json!(0.0));
            }
        }
    }
    // Velocity and depth may come from [study] instead. Only the program checks this condition
    // between sections.
    schema["required"] = json!(["tool", "filament"]);
    if let Value::Object(process) = &mut schema["properties"]["process"] {
        process.remove("required");
    }
    for parameter in PARAMETERS
        .iter()
        .filter(|parameter| parameter.instead_of.is_empty())
    {
        state_choice(&mut schema["properties"][parameter.section()], parameter);
    }
    for (name, section) in schema["properties"].as_object_mut().into_iter().flatten() {
        state_other_units(name, section);
    }
    schema["properties"]["measured"] = measured_schema();
    schema["properties"]["goal"] = goal_schema();
    schema["properties"]["filament"]["properties"]["material"] = json!({
        "type": "string",
        "description": "Material of the filaments, which states `density_kg_m3` and `youngs_modulus_pa` where the file does not, for dry \
                        material at room temperature: as published, or with abrasive grains computed from its parts, of which percentages \
                        are by mass. Water uptake about halves the stiffness of polyamide, and heat lowers it.",
        "examples": MATERIALS.iter().map(|material| material.name).collect::<Vec<_>>(),
    });
    schema["properties"][STUDY] = study_schema(tool_schema(&schema));
    schema["properties"][WORKPIECE]["properties"]["control_points_csv"] = json!({
        "type": "string",
        "minLength": 1,
        "description": "Path of a CSV file with control points instead of `control_points_m`, relative to the directory of the input \
                        file, with the columns x_m, y_m.",
    });
    schema
}

/// Returns the schema that follows from the structures alone. One section has the keys of
/// workpieces of all kinds.
fn settings_schema() -> Value {
    let mut schema = schema_of::<Settings>();
    let workpiece = &mut schema["properties"][WORKPIECE];
    let kinds = workpiece
        .as_object_mut()
        .and_then(|workpiece| workpiece.remove("oneOf"))
        .unwrap_or_default();
    let named = |kind: &Value| json!({ "const": kind["properties"]["kind"]["const"], "description": kind["description"], "type": "string" });
    let named: Vec<Value> = kinds.as_array().into_iter().flatten().map(named).collect();
    for kind in kinds.as_array().into_iter().flatten() {
        for (key, property) in kind["properties"].as_object().into_iter().flatten() {
            workpiece["properties"][key] = property.clone();
        }
    }
    workpiece["properties"]["kind"] = json!({ "default": WorkpieceKind::default().name(), "description": "The kind of workpiece.", "oneOf": named });
    workpiece["additionalProperties"] = json!(false);
    schema
}

fn schema_of<T: JsonSchema>() -> Value {
    let settings =
        SchemaSettings::draft2020_12().with(|settings| settings.inline_subschemas = true);
    settings
        .into_generator()
        .into_root_schema_for::<T>()
        .to_value()
}

/// Returns the keys of a workpiece of each kind besides its feed, with their defaults, by the names
/// of the kinds.
pub(crate) fn workpiece_kinds() -> &'static [(String, BTreeMap<String, Value>)] {
    static KINDS: LazyLock<Vec<(String, BTreeMap<String, Value>)>> = LazyLock::new(|| {
        let schema = schema_of::<WorkpieceKind>();
        let keys = |kind: &Value| {
            let properties = kind["properties"].as_object().into_iter().flatten();
            let keys = properties.map(|(key, property)| (key.clone(), property["default"].clone()));
            let keys = keys.filter(|(key, _)| key != "kind").collect();
            (
                kind["properties"]["kind"]["const"]
                    .as_str()
                    .unwrap_or_default()
                    .to_owned(),
                keys,
            )
        };
        schema["oneOf"]
            .as_array()
            .into_iter()
            .flatten()
            .map(keys)
            .collect()
    });
    &KINDS
}

/// States that a section has exactly one of the keys that state the same, or at most one if it need
/// not have any.
fn state_choice(section: &mut Value, parameter: &Parameter) {
    let keys: Vec<String> = parameter
        .group()
        .flat_map(|same| {
            [same.key().to_owned()]
                .into_iter()
                .chain(other_keys(same.path))
        })
        .collect();
    let Value::Object(section) = section else {
        return;
    };
    let is_required = match section.get_mut("required") {
        Some(Value::Array(required)) => required.extract_if(.., |key| *key == keys[0]).count() > 0,
        _ => false,
    };
    if !is_required && parameter.group().count() < 2 {
        return;
    }
    let each: Vec<Value> = keys
        .iter()
        .map(|key| json!({ "required": [key] }))
        .collect();
    let none = json!({ "not": { "anyOf": each } });
    let choice = json!({ "oneOf": each.into_iter().chain((!is_required).then_some(none)).collect::<Vec<_>>() });
    match section.entry("allOf").or_insert_with(|| json!([])) {
        Value::Array(choices) => choices.push(choice),
        _ => unreachable!("only choices are stated there"),
    }
}

/// Returns the keys that state the setting at a path in other units.
fn other_keys(path: &str) -> impl Iterator<Item = String> {
    other_paths(path).filter_map(|(path, _)| path.split_once('.').map(|(_, key)| key.to_owned()))
}

/// Returns the pattern of the keys that state the setting at a path in other units; `None` if there
/// is none.
fn other_units_pattern(path: &str) -> Option<String> {
    let keys: Vec<String> = other_keys(path).collect();
    (!keys.is_empty()).then(|| format!("^({})$", keys.join("|")))
}

/// Adds the other keys of a section: those of its settings, with other units.
fn state_other_units(name: &str, section: &mut Value) {
    let mut patterns = Map::new();
    for (key, property) in section["properties"].as_object().into_iter().flatten() {
        let Some(pattern) = other_units_pattern(&format!("{name}.{key}")) else {
            continue;
        };
        let mut other = json!({ "description": format!("`{key}` in the unit of this key.") });
        for word in ["type", "items"] {
            if !property[word].is_null() {
                other[word] = property[word].clone();
            }
        }
        patterns.insert(pattern, other);
    }
    if let Value::Object(section) = section
        && !patterns.is_empty()
    {
        section.insert("patternProperties".to_owned(), Value::Object(patterns));
    }
}

fn state_limits(number: &mut Map<String, Value>, parameter: &Parameter) {
    number.remove("minimum");
    let limits = [
        ("minimum", "exclusiveMinimum", parameter.range.lower),
        ("maximum", "exclusiveMaximum", parameter.range.upper),
    ];
    for (included, excluded, bound) in limits {
        match bound {
            Bound::Included(limit) => number.insert(included.to_owned(), json!(limit)),
            Bound::Excluded(limit) => number.insert(excluded.to_owned(), json!(limit)),
            Bound::Unbounded => None,
        };
    }
}

/// Returns the schema of a named tool: settings of some sections, none required, under their
/// sections or with their paths in quotes.
fn tool_schema(schema: &Value) -> Value {
    let (mut properties, mut patterns) = (Map::new(), Map::new());
    for section in SECTIONS {
        let keys = &schema["properties"][section]["properties"];
        let others = schema["properties"][section]
            .get("patternProperties")
            .cloned()
            .unwrap_or_else(|| json!({}));
        let quoted = keys.as_object().into_iter().flatten();
        properties
            .extend(quoted.map(|(key, property)| (format!("{section}.{key}"), property.clone())));
        let quoted = others.as_object().into_iter().flatten();
        patterns.extend(
            quoted.map(|(key, other)| (format!("^{section}\\.{}", &key[1..]), other.clone())),
        );
        let of_section = json!({
            "type": "object",
            "properties": keys,
            "patternProperties": others,
            "additionalProperties": false,
        });
        properties.insert(section.to_owned(), of_section);
    }
    json!({ "type": "object", "properties": properties, "patternProperties": patterns, "additionalProperties": false })
}

fn study_schema(tool: Value) -> Value {
    let sweep = json!({
        "anyOf": [
            { "type": "array", "items": { "type": "number" }, "minItems": 1 },
            {
                "type": "object",
                "properties": {
                    "start": { "type": "number" },
                    "stop": { "type": "number", "description": "Last value, included." },
                    "step": { "type": "number" },
                },
                "required": ["start", "stop", "step"],
                "additionalProperties": false,
            },
        ],
    });
    let paths = PARAMETERS.iter().map(|parameter| parameter.path);
    let tools = json!({
        "description": "Named tools that the study compares: what each states in place of the file, as in [study.tools.fine] with \
                        filament.diameter_m = 0.6e-3 and tool.filament_count = 20000.",
        "type": "object",
        "minProperties": 1,
        "additionalProperties": tool,
    });
    let sweeps: Map<String, Value> = SHORT_NAMES
        .into_iter()
        .map(|(short, _)| short)
        .chain(paths)
        .map(|name| (name.to_owned(), sweep.clone()))
        .chain([(TOOLS.to_owned(), tools)])
        .collect();
    let pattern = |parameter: &Parameter| {
        let is_short = SHORT_NAMES.iter().any(|(_, path)| *path == parameter.path);
        let section = format!("{}\\.", parameter.section());
        let section = if is_short {
            format!("({section})?")
        } else {
            section
        };
        other_units_pattern(parameter.path).map(|pattern| format!("^{section}{}", &pattern[1..]))
    };
    let patterns: Map<String, Value> = PARAMETERS
        .iter()
        .filter_map(|parameter| Some((pattern(parameter)?, sweep.clone())))
        .collect();
    json!({
        "description": "The settings that `bristle study` sweeps, and the tools that it compares.",
        "type": "object",
        "properties": sweeps,
        "patternProperties": patterns,
        "additionalProperties": false,
    })
}

fn measured_schema() -> Value {
    let column = |quantity: Quantity| {
        let heading =
            json!({ "type": "string", "minLength": 1, "description": "Heading of the column." });
        let units: Vec<&str> = quantity.unit_names().collect();
        let with_unit = json!({
            "type": "object",
            "properties": { "column": heading, "unit": { "enum": units } },
            "required": ["column"],
            "additionalProperties": false,
        });
        (
            quantity.key().to_owned(),
            json!({ "anyOf": [heading, with_unit] }),
        )
    };
    let other = |quantity: Quantity| {
        let keys: Vec<String> = quantity
            .units()
            .filter(|unit| !unit.is_own())
            .filter_map(|unit| unit.key_of(quantity.key()))
            .collect();
        let heading = json!({ "type": "string", "minLength": 1, "description": "Heading of a column in the unit of the key." });
        (!keys.is_empty()).then(|| (format!("^({})$", keys.join("|")), heading))
    };
    let others: Map<String, Value> = Quantity::ALL.into_iter().filter_map(other).collect();
    let tool = json!({ "type": "string", "minLength": 1, "description": "Heading of the column with the names of tools." });
    let columns: Map<String, Value> = Quantity::ALL
        .into_iter()
        .map(column)
        .chain([(TOOL.to_owned(), tool)])
        .collect();
    let keys = Quantity::ALL.map(Quantity::key);
    json!({
        "description": "Measured tool forces, which `bristle study` compares with simulated ones.",
        "type": "object",
        "properties": {
            "file": {
                "type": "string",
                "minLength": 1,
                "description": format!(
                    "Path of a CSV file, relative to the directory of the input file. Its columns are {}, or those that `columns` names; \
                     one of the first two is enough. Of forces, torque and power a study reads {} only, a calibration all that are there.",
                    keys.join(", "),
                    Quantity::Force.key(),
                ),
            },
            "columns": {
                "type": "object",
                "description": "Headings of the columns in the file, as in { force_n = \"Fz [kN]\" }. Their units are those in brackets in \
                                the headings, or stated, as in { force_n = { column = \"Fz\", unit = \"kN\" } }.",
                "properties": columns,
                "patternProperties": others,
                "additionalProperties": false,
                "not": { "required": keys[..2] },
            },
            "separator": {
                "enum": SEPARATORS,
                "description": "What separates the cells of a row. Recognised if it is not stated.",
            },
            "decimal": {
                "enum": DECIMALS,
                "description": "Decimal point or comma of the numbers. Recognised if it is not stated.",
            },
            "relative_std": {
                "type": "number",
                "exclusiveMinimum": 0.0,
                "maximum": 1.0,
                "description": "Standard deviation over the value, of all that has none in the table: 0.03 for 3 %.",
            },
        },
        "required": ["file"],
        "additionalProperties": false,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The table of parameters and the settings structures agree on names, types and required
    /// numbers.
    #[test]
    fn the_table_of_parameters_is_complete() {
        let schema = settings_schema();
        let mut numbers = 0;
        for (section, schema) in schema["properties"].as_object().expect("sections") {
            for (key, schema_of_key) in schema["properties"].as_object().expect("keys") {
                let whole = schema_of_key["type"] == json!("integer");
                let path = format!("{section}.{key}");
                if Parameter::find(&path).is_some_and(|parameter| !parameter.word.is_empty()) {
                    // A number or a word.
                    assert!(
                        schema_of_key["anyOf"].is_array() || schema_of_key["oneOf"].is_array(),
                        "{schema_of_key}"
                    );
                    numbers += 1;
                    continue;
                }
                if !whole && schema_of_key["type"] != json!("number") {
                    continue;
                }
                let parameter = Parameter::find(&path).expect(&path);
                numbers += usize::from(parameter.instead_of.is_empty());
                let required = schema["required"]
                    .as_array()
                    .is_some_and(|keys| keys.contains(&json!(key)));
                assert_eq!(parameter.range.whole, whole, "{path}");
                assert_eq!(parameter.required, required, "{path}");
            }
        }
        // Settings that state others in their own way are in files only, but for the force in place
        // of the depth.
        assert_eq!(
            numbers,
            PARAMETERS
                .iter()
                .filter(|parameter| parameter.instead_of.is_empty())
                .count()
        );
    }

    #[test]
    fn limits_and_sweeps_are_stated() {
        let schema: Value = serde_json::from_str(&input_schema()).expect("the schema is JSON");
        let filament = &schema["properties"]["filament"]["properties"];
        assert_eq!(filament["segments"]["maximum"], json!(400.0));
        assert_eq!(filament["segments"]["default"], json!(25));
        assert_eq!(filament["length_m"]["exclusiveMinimum"], json!(0.0));
        let sweeps = &schema["properties"]["study"]["properties"];
        assert!(sweeps["penetration_depth_m"].is_object());
        assert!(sweeps["filament.segments"].is_object());
        assert_eq!(
            schema["properties"]["tool"]["properties"]["skew_rad"]["default"],
            json!(0.0)
        );
        let force = &schema["properties"]["process"]["properties"]["tool_force_n"];
        assert_eq!(
            (&force["exclusiveMinimum"], &force["type"]),
            (&json!(0.0), &json!("number"))
        );
        assert!(
            force["description"]
                .as_str()
                .is_some_and(|text| text.contains("which is then found")),
            "{force}"
        );
        let [tool, process] = ["tool", "process"].map(|section| &schema["properties"][section]);
        assert_eq!(
            process["properties"]["rotational_speed_rpm"]["maximum"],
            json!(1e7)
        );
        let choices = |section: &Value| {
            let of = |choice: &Value| {
                choice["oneOf"]
                    .as_array()
                    .map(Vec::len)
                    .expect("alternatives")
            };
            section["allOf"]
                .as_array()
                .expect("choices")
                .iter()
                .map(of)
                .collect::<Vec<_>>()
        };
        // A length in four units. The number of filaments: itself, per area in three units, and the
        // share.
        assert_eq!(
            (choices(tool), choices(process)),
            (vec![4, 4, 5], vec![9, 8])
        );
        let pattern = "^(length_mm|length_cm|length_um)$";
        assert_eq!(
            schema["properties"]["filament"]["patternProperties"][pattern]["type"],
            json!("number")
        );
        let pattern =
            "^(process\\.)?(penetration_depth_mm|penetration_depth_cm|penetration_depth_um)$";
        assert!(schema["properties"]["study"]["patternProperties"][pattern].is_object());
    }
}
