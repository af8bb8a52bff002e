//! The most important figures of a study.

use super::picture::Picture;

/// Maximum number of figures unless all are requested.
pub(super) const MAIN: usize = 5;

/// Preferred figures of a study in order, each by the beginning of its name and a later part.
/// Measured forces come first, then effects of interaction and of varying filaments, tools side by
/// side, and work on edges. Force, contact time ratio, impulse and power over the settings follow.
const PREFERRED: [[&str; 2]; 22] = [
    ["measured_over_", ""],
    ["interaction_over_", ""],
    ["interaction_factor_map", ""],
    ["scatter_over_", ""],
    ["sobol_over_", ""],
    ["tool_force_over_", "_by_tool"],
    ["contact_time_ratio_over_", "_by_tool"],
    ["impulse_over_", "_by_tool"],
    ["tool_power_over_", "_by_tool"],
    ["tool_torque_over_", "_by_tool"],
    ["edge_share_over_offset", ""],
    ["edge_evenness_over_offset", ""],
    ["tool_force_map", ""],
    ["contact_time_ratio_map", ""],
    ["impulse_map", ""],
    ["tool_power_map", ""],
    ["penetration_depth_", ""],
    ["tool_force_over_", ""],
    ["contact_time_ratio_over_", ""],
    ["impulse_over_", ""],
    ["tool_power_over_", ""],
    ["tool_torque_over_", ""],
];

/// Returns the five most important figures in their order: one of each preferred kind, filled up
/// with the first ones.
#[must_use]
pub fn main_figures(pictures: Vec<Picture>) -> Vec<Picture> {
    let mut chosen: Vec<usize> = Vec::new();
    let of_kind = |[start, part]: [&str; 2]| {
        pictures.iter().position(|Picture { name, .. }| {
            name.strip_prefix(start)
                .is_some_and(|rest| rest.contains(part))
        })
    };
    for index in PREFERRED
        .into_iter()
        .filter_map(of_kind)
        .chain(0..pictures.len())
    {
        if chosen.len() < MAIN && !chosen.contains(&index) {
            chosen.push(index);
        }
    }
    let kept = pictures
        .into_iter()
        .enumerate()
        .filter(|(index, _)| chosen.contains(index));
    kept.map(|(_, picture)| picture).collect()
}
