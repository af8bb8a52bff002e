//! The workpieces of the settings.

use std::f64::consts::PI;
use std::sync::{Arc, Mutex, PoisonError};

use super::outline::Corner;
use super::{ContactArc, Edge, Outline, Passage, Plane, Profile, ProfileCells, Spline, Surface, Workpiece, reach};
use crate::model::parameters::Violation;
use crate::model::settings::{Settings, Side, WorkpieceKind, WorkpieceSettings};

/// A convex arc is a face if its radius is at least so many segments long. Nodes then meet it; a filament does not bend more
/// tightly in a pass, so that a smaller arc touches it at one point.
const SEGMENTS_OF_FACE: f64 = 5.0;

/// A workpiece as settings state it.
#[derive(Clone, Debug, PartialEq)]
pub enum Part {
    /// A plane.
    Plane(Plane),
    /// Straight faces and arcs.
    Outline(Arc<Outline>),
    /// A spline.
    Profile(Arc<Profile>),
}

impl Part {
    /// The workpiece of `settings`, and how the undeformed filaments pass it.
    ///
    /// # Errors
    /// If the numbers do not fit together. Each must be within its own range.
    pub fn of(settings: &Settings) -> Result<(Self, Passage), Violation> {
        let Settings { filament, workpiece, process, .. } = settings;
        check_keys(workpiece)?;
        check_unused_keys(workpiece)?;
        let (radius, depth) = (settings.tool_radius_m(), process.penetration_depth_m);
        let plane = ContactArc::on_plane(workpiece.normal, reach(workpiece, radius), depth);
        let ground = depth - radius;
        let face_radius = SEGMENTS_OF_FACE * filament.length_m / filament.segments as f64;
        let velocity = [workpiece.feed_velocity_m_s, 0.0, 0.0];
        let WorkpieceSettings { offset_m, radius_m, .. } = *workpiece;
        let touching_all_round = || Violation {
            path: "workpiece.offset_m",
            value: format!("{offset_m:?}"),
            allowed: "such that the filaments leave the workpiece at some angle of the tool".to_owned(),
        };
        let outline = match workpiece.kind {
            WorkpieceKind::Edge | WorkpieceKind::Chamfer => {
                let (corners, direction) = corners(workpiece, ground)?;
                Outline::of_corners(&corners, direction, workpiece.edge_radius_m, face_radius, velocity)
            }
            WorkpieceKind::Cylinder => {
                Outline::circle([offset_m, ground - radius_m], radius_m, true, face_radius, velocity)
            }
            WorkpieceKind::Bore => {
                let centre = [offset_m, ground + radius_m];
                check_bore(settings, centre)?;
                Outline::circle(centre, radius_m, false, face_radius, velocity)
            }
            WorkpieceKind::Profile => {
                let spline = spline(workpiece)?;
                let profile = Profile::new(spline, [offset_m, ground], face_radius, velocity);
                check_body(&profile, settings.tool.body_radius_m)?;
                let passage = profile.passage(radius, plane).ok_or_else(touching_all_round)?;
                return Ok((Self::Profile(Arc::new(profile)), passage));
            }
            WorkpieceKind::Plane => return Ok((Self::Plane(Plane::of(workpiece, radius, depth)), plane.into())),
        };
        let passage = outline.passage(radius, plane).ok_or_else(touching_all_round)?;
        Ok((Self::Outline(Arc::new(outline)), passage))
    }
}

/// The corners of an edge or a chamfer whose top face is at `ground` (m), in their order along the outline, and the direction of
/// its first face.
fn corners(workpiece: &WorkpieceSettings, ground: f64) -> Result<(Vec<Corner>, [f64; 2]), Violation> {
    let WorkpieceSettings { offset_m, included_angle_rad, edge_radius_m, chamfer_width_m, chamfer_angle_rad, .. } =
        *workpiece;
    let turn = PI - included_angle_rad;
    // From the top face downwards, with the material at x ≤ 0.
    let mut corners = vec![Corner { point: [0.0, 0.0], turn }];
    if workpiece.kind == WorkpieceKind::Chamfer {
        if chamfer_angle_rad >= turn {
            return Err(Violation {
                path: "workpiece.chamfer_angle_rad",
                value: format!("{chamfer_angle_rad:?}"),
                allowed: format!("less than {turn:.4}, by which the faces turn at the edge, in rad"),
            });
        }
        let (sin, cos) = chamfer_angle_rad.sin_cos();
        let start = -chamfer_width_m * (turn - chamfer_angle_rad).sin() / turn.sin();
        corners = vec![
            Corner { point: [start, 0.0], turn: chamfer_angle_rad },
            Corner { point: [start + chamfer_width_m * cos, -chamfer_width_m * sin], turn: turn - chamfer_angle_rad },
        ];
        let largest = chamfer_width_m / corners.iter().map(|corner| corner.rounding(1.0)).sum::<f64>();
        if edge_radius_m >= largest {
            return Err(Violation {
                path: "workpiece.edge_radius_m",
                value: format!("{edge_radius_m:?}"),
                allowed: format!("less than {largest:.4e}, at which the rounded edges use up the chamfer, in m"),
            });
        }
    }
    if workpiece.side == Side::Leaving {
        let placed =
            corners.iter().map(|&Corner { point: [x, y], turn }| Corner { point: [offset_m + x, ground + y], turn });
        return Ok((placed.collect(), [1.0, 0.0]));
    }
    // Mirrored, and gone along the other way: up the side face and onto the top.
    let placed =
        corners.iter().rev().map(|&Corner { point: [x, y], turn }| Corner { point: [offset_m - x, ground + y], turn });
    Ok((placed.collect(), [turn.cos(), turn.sin()]))
}

/// The body must fit into a bore, and the filaments must come free in it.
fn check_bore(settings: &Settings, [x, y]: [f64; 2]) -> Result<(), Violation> {
    let (body, length) = (settings.tool.body_radius_m, settings.filament.length_m);
    let radius_m = settings.workpiece.radius_m;
    let distance = x.hypot(y);
    let violation = |allowed: String| Violation { path: "workpiece.radius_m", value: format!("{radius_m:?}"), allowed };
    let least = body + length - settings.process.penetration_depth_m;
    if radius_m <= least {
        return Err(violation(format!("greater than {least:.4e}, the distance of the bore from the tool axis, in m")));
    }
    if distance + body >= radius_m {
        return Err(violation(format!("such that the brush body fits: greater than {:.4e}, in m", distance + body)));
    }
    if distance + radius_m <= body + length {
        let allowed = "such that the filaments come free in the bore: it must be wider than the brush";
        return Err(violation(format!("{allowed}, greater than {:.4e}, in m", body + length - distance)));
    }
    Ok(())
}

/// The spline of a profile. The last one is kept, because all cases of a study mostly have the same.
fn spline(workpiece: &WorkpieceSettings) -> Result<Arc<Spline>, Violation> {
    type Curve = (Vec<[f64; 2]>, usize, bool);
    static LAST: Mutex<Option<(Curve, Arc<Spline>)>> = Mutex::new(None);
    let WorkpieceSettings { control_points_m, degree, closed, .. } = workpiece;
    let mut last = LAST.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(((points, last_degree, last_closed), spline)) = &*last
        && points == control_points_m
        && (last_degree, last_closed) == (degree, closed)
    {
        return Ok(Arc::clone(spline));
    }
    let violation = |allowed: String| Violation {
        path: "workpiece.control_points_m",
        value: format!("{} points", control_points_m.len()),
        allowed,
    };
    let spline = Spline::new(control_points_m, *degree, *closed)
        .map_err(|error| violation(format!("such that they make a profile: {error}")))?;
    if spline.smallest_convex_radius() <= 0.0 {
        return Err(violation(
            "without sharp convex corners, which filaments meet with no force: round them by more control points, or use \
             the kind `edge` or `chamfer`"
                .to_owned(),
        ));
    }
    let spline = Arc::new(spline);
    *last = Some(((control_points_m.clone(), *degree, *closed), Arc::clone(&spline)));
    Ok(spline)
}

/// The brush body must be outside the material.
fn check_body(profile: &Profile, body_radius_m: f64) -> Result<(), Violation> {
    let gap = profile.surface([0.0; 3], 0.0).gap;
    if gap > body_radius_m {
        return Ok(());
    }
    let value = if gap < 0.0 { "around the tool axis".to_owned() } else { format!("{gap:.4e} m from the tool axis") };
    Err(Violation {
        path: "workpiece.control_points_m",
        value,
        allowed: format!(
            "farther than the brush body’s radius, {body_radius_m:?} m, with the material on the right-hand side of the curve"
        ),
    })
}

/// Checks that the keys which a kind needs are given, and no others.
fn check_keys(workpiece: &WorkpieceSettings) -> Result<(), Violation> {
    use WorkpieceKind::{Bore, Chamfer, Cylinder, Edge, Plane};
    let kind = workpiece.kind;
    let needed = [
        ("workpiece.edge_radius_m", workpiece.edge_radius_m, matches!(kind, Edge | Chamfer)),
        ("workpiece.chamfer_width_m", workpiece.chamfer_width_m, kind == Chamfer),
        ("workpiece.radius_m", workpiece.radius_m, matches!(kind, Cylinder | Bore)),
    ];
    for (path, value, is_needed) in needed {
        if is_needed && value <= 0.0 {
            let allowed = format!("greater than 0 for a workpiece of kind `{}`, in m", name(kind));
            return Err(Violation { path, value: "left out or zero".to_owned(), allowed });
        }
        if !is_needed && value != 0.0 {
            let allowed = format!("left out: a workpiece of kind `{}` has none", name(kind));
            return Err(Violation { path, value: format!("{value:?}"), allowed });
        }
    }
    let points = workpiece.control_points_m.len();
    if (kind == WorkpieceKind::Profile) != (points > 0) {
        let allowed =
            if points > 0 { "left out: a workpiece of kind" } else { "a list of points for a workpiece of kind" };
        return Err(Violation {
            path: "workpiece.control_points_m",
            value: format!("{points} points"),
            allowed: format!("{allowed} `{}`{}", name(kind), if points > 0 { " has none" } else { "" }),
        });
    }
    if kind != Plane && workpiece.normal != [0.0, 1.0, 0.0] {
        return Err(Violation {
            path: "workpiece.normal",
            value: format!("{:?}", workpiece.normal),
            allowed: format!("left out: a workpiece of kind `{}` faces along y", name(kind)),
        });
    }
    Ok(())
}

/// Checks that keys which have a default for another kind are left out.
fn check_unused_keys(workpiece: &WorkpieceSettings) -> Result<(), Violation> {
    use WorkpieceKind::{Chamfer, Edge, Plane};
    let (kind, default) = (workpiece.kind, WorkpieceSettings::default());
    let WorkpieceSettings { offset_m, included_angle_rad, chamfer_angle_rad, side, .. } = *workpiece;
    let has_faces = matches!(kind, Edge | Chamfer);
    let number = |path, value: f64, default, is_used| (path, format!("{value:?}"), is_used || value == default);
    let keys = [
        number("workpiece.offset_m", offset_m, default.offset_m, kind != Plane),
        number("workpiece.included_angle_rad", included_angle_rad, default.included_angle_rad, has_faces),
        number("workpiece.chamfer_angle_rad", chamfer_angle_rad, default.chamfer_angle_rad, kind == Chamfer),
        ("workpiece.side", format!("{side:?}").to_lowercase(), has_faces || side == default.side),
    ];
    keys.into_iter().find(|(.., is_right)| !is_right).map_or(Ok(()), |(path, value, _)| {
        let allowed = format!("left out: a workpiece of kind `{}` has none", name(kind));
        Err(Violation { path, value, allowed })
    })
}

/// The name of a kind in an input file.
fn name(kind: WorkpieceKind) -> &'static str {
    match kind {
        WorkpieceKind::Plane => "plane",
        WorkpieceKind::Edge => "edge",
        WorkpieceKind::Chamfer => "chamfer",
        WorkpieceKind::Cylinder => "cylinder",
        WorkpieceKind::Bore => "bore",
        WorkpieceKind::Profile => "profile",
    }
}

/// The same expression for each kind.
macro_rules! each {
    ($part:expr, $workpiece:ident => $result:expr) => {
        match $part {
            Part::Plane($workpiece) => $result,
            Part::Outline($workpiece) => $result,
            Part::Profile($workpiece) => $result,
        }
    };
}

impl Workpiece for Part {
    #[inline]
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        each!(self, workpiece => workpiece.surface(position, time))
    }

    #[inline]
    fn edges(&self) -> &[Edge] {
        each!(self, workpiece => workpiece.edges())
    }

    fn is_planar(&self) -> bool {
        each!(self, workpiece => workpiece.is_planar())
    }

    fn translates(&self) -> bool {
        each!(self, workpiece => workpiece.translates())
    }

    fn profile(&self, reach: f64) -> Option<ProfileCells> {
        each!(self, workpiece => workpiece.profile(reach))
    }

    fn arc_length(&self, position: [f64; 3], time: f64) -> Option<f64> {
        each!(self, workpiece => workpiece.arc_length(position, time))
    }
}
