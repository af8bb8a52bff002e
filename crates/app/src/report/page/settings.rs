//! The settings of a simulation or a study, for the script of a page.

use serde_json::{Value, json};

use super::packed::rounded;
use bristle::model::parameters::{PARAMETERS, Parameter};
use bristle::model::settings::Settings;
use bristle_study::grid::Study;

/// Returns the settings of a study. Settings that differ between named tools have a value for each.
pub(super) fn study_settings(study: &Study) -> Vec<Value> {
    let tools = study.tools().len().max(1);
    let first_case = |tool: usize| study.settings(tool * (study.case_count() / tools));
    let of_tool = |tool: usize| settings(&first_case(tool), |parameter| study.varies(parameter));
    let of_tools: Vec<Vec<Value>> = (0..tools).map(of_tool).collect();
    let position = |settings: &[Value], entry: &Value| {
        settings.iter().position(|own| own["path"] == entry["path"])
    };
    // A setting of some tools only follows the setting that precedes it there.
    let mut merged: Vec<Value> = Vec::new();
    for settings in &of_tools {
        let mut next = 0;
        for entry in settings {
            next = 1 + position(&merged, entry).unwrap_or_else(|| {
                merged.insert(next, entry.clone());
                next
            });
        }
    }
    for entry in &mut merged {
        let value = |settings: &Vec<Value>| {
            position(settings, entry).map_or(json!("none"), |own| settings[own]["value"].clone())
        };
        let values: Vec<Value> = of_tools.iter().map(value).collect();
        if values.iter().any(|value| *value != values[0]) {
            (entry["value"], entry["by_tool"]) = (Value::Null, json!(values));
        }
    }
    merged
}

/// Path, symbol, name and unit of the settings that are not numbers, each after the path of the
/// number that it precedes. Absent settings are left out, such as those of another kind of
/// workpiece.
const NOT_NUMBERS: [(&str, [&str; 4]); 11] = [
    ("tool.body_radius_m", ["tool.kind", "", "kind of tool", ""]),
    (
        "workpiece.feed_velocity_m_s",
        ["workpiece.kind", "", "kind of workpiece", ""],
    ),
    (
        "workpiece.feed_velocity_m_s",
        ["workpiece.normal", "n⃗", "outward normal", ""],
    ),
    (
        "process.brushing_velocity_m_s",
        ["workpiece.side", "", "how filaments meet an edge", ""],
    ),
    (
        "process.brushing_velocity_m_s",
        [
            "workpiece.control_points_m",
            "",
            "control points of a profile",
            "m",
        ],
    ),
    (
        "process.brushing_velocity_m_s",
        ["workpiece.closed", "", "whether a profile is closed", ""],
    ),
    (
        "process.lead_angle_rad",
        [
            "process.gravity_m_s2",
            "g⃗",
            "acceleration of free fall",
            "m/s²",
        ],
    ),
    (
        "brush.columns",
        [
            "uncertainty.hold",
            "",
            "what stays the same for tools of another radius",
            "",
        ],
    ),
    (
        "brush.stiffness_n_m2",
        ["brush.pattern", "", "pattern of the roots", ""],
    ),
    (
        "brush.stiffness_n_m2",
        [
            "brush.ends",
            "",
            "what is beyond the first and the last row",
            "",
        ],
    ),
    (
        "brush.seed",
        ["brush.steady", "", "whether a steady stretch counts", ""],
    ),
];

/// Returns all settings; swept ones have no value. Without a brush there are none of `[brush]`, and
/// likewise of `[removal]`.
pub(super) fn settings(base: &Settings, is_swept: impl Fn(&Parameter) -> bool) -> Vec<Value> {
    let entry = |[path, symbol, name, unit]: [&str; 4], value: Value| json!({ "path": path, "symbol": symbol, "name": name, "unit": unit, "value": value });
    let all = serde_json::to_value(base).expect("settings have texts as keys");
    let stated = |path: &str| {
        all.pointer(&format!("/{}", path.replace('.', "/")))
            .filter(|value| !value.is_null())
    };
    let mut entries: Vec<(&str, Value)> = PARAMETERS
        .iter()
        .filter(|parameter| match parameter.section() {
            "brush" => base.brush.is_some(),
            "removal" => base.removal.is_some(),
            _ => true,
        })
        .filter_map(|parameter| {
            let &Parameter {
                path,
                symbol,
                name,
                unit,
                ..
            } = parameter;
            let number = parameter.read(base)?;
            let value = match path {
                _ if is_swept(parameter) => Value::Null,
                // A number, or what takes its place.
                "process.penetration_depth_m" if base.process.tool_force_n.is_some() => {
                    json!("found for the force")
                }
                "process.penetration_depth_m" if number == 0.0 => {
                    json!("left out: brush and bore have one axis")
                }
                "process.tool_force_n" if base.process.tool_force_n.is_none() => {
                    json!("none: the depth is stated")
                }
                // Derived settings are rounded.
                _ if !parameter.instead_of.is_empty() => json!(rounded(number)),
                // A number, or a word, or nothing.
                "process.turns" | "brush.columns" | "brush.rows" | "brush.contact_points" => {
                    json!(stated(path))
                }
                // A number without a default.
                "removal.preston_m2_n"
                | "removal.filament_wear_m2_n"
                | "removal.edge_feed_velocity_m_s" => {
                    stated(path).cloned().unwrap_or_else(|| json!("not stated"))
                }
                _ => json!(number),
            };
            Some((path, entry([path, symbol, name, unit], value)))
        })
        .collect();
    for (next, names) in NOT_NUMBERS {
        if let Some(value) = stated(names[0]) {
            let place = entries
                .iter()
                .position(|(path, _)| *path == next)
                .unwrap_or(entries.len());
            entries.insert(place, (names[0], entry(names, value.clone())));
        }
    }
    entries.into_iter().map(|(_, entry)| entry).collect()
}
