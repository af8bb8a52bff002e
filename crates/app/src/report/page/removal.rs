//! The page of a removal. A slider shows how the edge becomes round.

use bristle::model::settings::Settings;
use bristle_study::grid::removal::{Removal, RemovalRow};
use bristle_study::text::number::significant;
use bristle_study::text::shown;
use serde_json::json;

use super::brush::drawings;
use super::{
    LONGEST_NAME, SCRIPTS, STYLE, document, escape_html, fill, lead_and_items, script_data,
};
use crate::report::drawing::format::Format;
use crate::report::figures::{corner_outline, removal_figures, unit_of_time};
use crate::report::removal::lines;

const TEMPLATE: &str = include_str!("removal.html");
const SCRIPT: &str = concat!(include_str!("format.js"), include_str!("removal.js"));
/// The style of the drawing and of its slider.
const OWN_STYLE: &str = "
#edge svg { width: 100%; max-width: 40rem; height: auto; display: block; }
#edge input { width: 100%; max-width: 40rem; }
";
/// Rows of the table.
const ROWS: usize = 11;
/// Length of the drawn faces beyond the roundest arc, over its tangent length.
const FACES: f64 = 1.6;

/// Returns the page of a removal by the settings of the input file `name`.
#[must_use]
pub fn removal_page(name: &str, settings: &Settings, removal: &Removal) -> String {
    let name = escape_html(&shown(name, LONGEST_NAME));
    let [lead, rest] = lead_and_items(&lines(settings, removal));
    let figures = drawings(&removal_figures(settings, removal, &Format::default()));
    let last = removal.rows.last().map_or(0.0, |row| row.time_s);
    let (unit, second) = unit_of_time(last);
    let rows = (0..ROWS).map(|i| &removal.rows[i * (removal.rows.len() - 1) / (ROWS - 1)]);
    let rows: String = rows
        .map(|row| {
            let cells = [
                row.time_s / second,
                row.turns,
                1e3 * row.edge_radius_m,
                row.tool_contact_normal_force_n,
                1e3 * row.filament_length_m,
                1e3 * row.edge_sliding_work_j,
            ];
            let cells =
                cells.map(|value| format!("<td class=\"number\">{}</td>", significant(value)));
            format!("<tr>{}</tr>\n", cells.concat())
        })
        .collect();
    let steps = || removal.rows.iter().step_by(4);
    let edge = |(edge, &angle): (usize, &f64)| {
        let radius = |row: &RemovalRow| [row.edge_radius_m, row.second_edge_radius_m][edge];
        let largest = removal.rows.iter().map(radius).fold(0.0, f64::max);
        let reach = FACES * largest / (angle / 2.0).tan();
        let part = |value: f64| (1e6 * value / reach.max(1e-9)).round() / 1e6;
        let outline = |row| {
            corner_outline(angle, radius(row), reach)
                .into_iter()
                .map(|point| point.map(part))
        };
        let outlines: Vec<Vec<[f64; 2]>> = steps().map(|row| outline(row).collect()).collect();
        json!({ "outlines": outlines, "reach_mm": 1e3 * reach, "half_rad": angle / 2.0 })
    };
    let edges: Vec<_> = removal.angles_rad.iter().enumerate().map(edge).collect();
    let shown_row = |row: &RemovalRow| {
        [
            row.time_s / second,
            row.turns,
            1e3 * row.edge_radius_m,
            1e3 * row.second_edge_radius_m,
        ]
        .map(significant)
    };
    let shown_rows: Vec<_> = steps().map(shown_row).collect();
    let data = json!({ "unit": unit, "edges": edges, "rows": shown_rows });
    let body = [
        ("name", &*name),
        ("lead", &lead),
        ("rest", &rest),
        ("last", &(shown_rows.len() - 1).to_string()),
        ("unit", unit),
        ("rows", &rows),
        ("figures", &figures),
        ("data", &script_data(&data)),
        ("script", SCRIPT),
    ];
    let title = format!("{name}: an edge that grows round");
    document(
        &title,
        &[STYLE, OWN_STYLE].concat(),
        SCRIPTS,
        &fill(TEMPLATE, &body),
    )
}
