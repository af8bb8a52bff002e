//! Views of a contact in true scale: along the tool's axis, from the side, and of edges.

use super::worked::Worked;
use crate::report::view::{View, moved, sampled_pass};
use bristle::model::settings::Settings;
use bristle::simulation::{Pass, ProfileCell, Shape};
use bristle::workpiece::Workpiece;

/// Largest error of the drawn outline, as a share of the shown part: arcs of edges are round on
/// every scale.
const OUTLINE_ERROR: f64 = 1e-4;
/// The name of the part around edges.
const AT_THE_EDGE: &str = "at the edge";

/// A part of a contact in true scale, in the coordinates of the view (m).
pub(super) struct Pane {
    /// Heading of the part; empty without one.
    pub name: &'static str,
    /// Opposite corners of the shown part.
    pub corners: [[f64; 2]; 2],
    pub surface: Vec<[f64; 2]>,
    /// `true` if the surface goes round the material.
    pub is_filled: bool,
    /// The ends of the cells of the profile; `None` where they coincide in this view.
    pub cells: Vec<Option<[[f64; 2]; 2]>>,
    /// Outlines of the tool's body, and of its trim.
    pub body: Vec<Vec<[f64; 2]>>,
    pub trim: Vec<Vec<[f64; 2]>>,
    pub filaments: Vec<Vec<[f64; 2]>>,
}

/// Margin around edges, and around the whole, as a share of the size.
const AROUND_EDGES: f64 = 0.8;
const AROUND_ALL: f64 = 0.04;

/// Returns the view along the axis of an upright tool, and another of edges.
pub(super) fn upright_panes(
    settings: &Settings,
    profile: &[ProfileCell],
    worked: &Worked,
    shapes: &[Shape],
) -> Option<Vec<Pane>> {
    let pass = Pass::new(settings);
    // As far as the picture may go.
    let outline = pass.outline(1.5 * settings.tool_radius_m())?;
    // As they are seen from the workpiece, which may move.
    let [x_rate, y_rate, _] = pass.workpiece().surface([0.0; 3], 0.0).velocity;
    let seen = |shape: &Shape| {
        let time = shape.time_s;
        shape
            .nodes_m
            .iter()
            .map(|&[x, y, _]| [x - time * x_rate, y - time * y_rate])
            .collect::<Vec<_>>()
    };
    let filaments: Vec<Vec<[f64; 2]>> = shapes.iter().map(seen).collect();
    let body = (0..=720).map(|k| {
        let (sin, cos) = (f64::from(k) / 2.0).to_radians().sin_cos();
        [cos, sin].map(|part| part * settings.tool.body_radius_m)
    });
    let body = body.collect::<Vec<_>>();
    let cells: Vec<_> = pass
        .profile()?
        .cells
        .iter()
        .map(|cell| Some(cell.ends))
        .collect();
    let pane = |name, corners: [[f64; 2]; 2]| Pane {
        name,
        corners,
        surface: outline.simplified(OUTLINE_ERROR * (corners[1][0] - corners[0][0])),
        is_filled: outline.is_solid(),
        cells: cells.clone(),
        body: vec![body.clone()],
        trim: Vec::new(),
        filaments: filaments.clone(),
    };
    let mut panes = vec![pane(
        "",
        around(
            worked
                .places(profile)
                .chain(filaments.iter().flatten().copied()),
            AROUND_ALL,
        )?,
    )];
    if let Some(places) = worked.places_of_edges(profile) {
        panes.push(pane(AT_THE_EDGE, around(places, AROUND_EDGES)?));
    }
    Some(panes)
}

/// Returns the views of another tool along its axis and from the side, and another of edges.
pub(super) fn posed_panes(
    settings: &Settings,
    profile: &[ProfileCell],
    worked: &Worked,
    shapes: &[Shape],
) -> Option<Vec<Pane>> {
    let pass = sampled_pass(settings);
    let cells = pass.profile()?.cells;
    let mut edge = None;
    let mut panes = Vec::new();
    for view in View::all(settings, &pass) {
        // As they are seen from the workpiece, which may move.
        let seen = |shape: &Shape| {
            let [x, y] = view.shift(moved(&pass, shape.time_s));
            let node = |node: &[f64; 3]| {
                let [along, above] = view.place(*node);
                [along - x, above - y]
            };
            shape.nodes_m.iter().map(node).collect::<Vec<_>>()
        };
        let filaments: Vec<Vec<[f64; 2]>> = shapes.iter().map(seen).collect();
        let end = |end: [f64; 2]| view.on_profile(end);
        let places = worked.places(profile).filter_map(end);
        let corners = around(
            places
                .chain(filaments.iter().flatten().copied())
                .chain(view.nearest.iter().copied()),
            AROUND_ALL,
        )?;
        let edges = worked
            .places_of_edges(profile)
            .and_then(|places| around(places.filter_map(end), AROUND_EDGES));
        let seen: Vec<_> = cells
            .iter()
            .map(|cell| Some([end(cell.ends[0])?, end(cell.ends[1])?]))
            .collect();
        let pane = |name, corners| Pane {
            name,
            corners,
            surface: view.surface.points.clone(),
            is_filled: view.surface.is_filled,
            cells: seen.clone(),
            body: view.body.clone(),
            trim: view.trim.clone(),
            filaments: filaments.clone(),
        };
        panes.push(pane(view.name, corners));
        edge = edge.or(edges.map(|corners| {
            let pane = pane(AT_THE_EDGE, corners);
            // As round as the cells, on which the bars stand.
            let arc = seen.iter().flatten().flatten().copied().collect();
            if pane.is_filled {
                pane
            } else {
                Pane {
                    surface: arc,
                    ..pane
                }
            }
        }));
    }
    panes.extend(edge);
    Some(panes)
}

/// Returns the box around points, with a margin as a share of its larger side. `None` without
/// points.
fn around(points: impl Iterator<Item = [f64; 2]>, margin: f64) -> Option<[[f64; 2]; 2]> {
    let boxes = points.map(|point| [point; 2]);
    let [low, high] = boxes.reduce(|[low, high], [point, _]| {
        [
            [0, 1].map(|k| f64::min(low[k], point[k])),
            [0, 1].map(|k| f64::max(high[k], point[k])),
        ]
    })?;
    let margin = margin * (high[0] - low[0]).max(high[1] - low[1]);
    Some([low.map(|low| low - margin), high.map(|high| high + margin)])
}
