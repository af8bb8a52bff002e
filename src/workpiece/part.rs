//! The workpieces of the settings.

use std::f64::consts::{FRAC_PI_2, PI};
use std::sync::Arc;

use super::outline::Corner;
use super::{
    ContactArc, Edge, Outline, Passage, Plane, Posed, Profile, ProfileCells, Ramp, Spline, Surface,
    Workpiece, unit_normal,
};
use crate::model::parameters::{Parameter, Violation};
use crate::model::settings::{
    ChamferSettings, EdgeSettings, ProfileSettings, RoundSettings, Settings, Side, WorkpieceKind,
};
use crate::model::trim::{self, reach_of};
use crate::tool::{Pose, RotaryTool, Trim};

/// Least radius of a convex arc that is a face, in segments. Nodes meet a face; a filament does not
/// bend more tightly in a pass, so that a smaller arc touches it at one point.
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
    /// One of these in the frame of a tool that is tilted, or with a ramp.
    Posed(Box<Posed<Self>>),
}

impl Part {
    /// Returns the workpiece of `settings`, and the passage of the undeformed filament in the
    /// middle of the trim.
    ///
    /// # Errors
    /// If the numbers do not fit together. Each must be within its own range.
    pub fn of(settings: &Settings) -> Result<(Self, Passage), Violation> {
        Self::at(settings, 0.0)
    }

    /// Returns the workpiece of `settings` in the frame of the tool, and the passage of the
    /// undeformed filament at `s` (m) on the trim.
    ///
    /// # Errors
    /// As for [`Part::of`].
    pub fn at(settings: &Settings, s: f64) -> Result<(Self, Passage), Violation> {
        let Settings {
            tool, workpiece, ..
        } = settings;
        check_stated(&workpiece.kind)?;
        let (pose, trim, [reach, _]) =
            (Pose::of(tool), Trim::of(settings), trim::reaches(settings));
        let ground = settings.process.penetration_depth_m - reach;
        let part = Self::upright(settings, ground)?;
        let (normal, tip) = (pose.to_tool(unit_normal(workpiece)), trim.tip(s));
        let across = tip[0] * normal[0].hypot(normal[1]);
        let depth = settings.process.penetration_depth_m + (reach_of(tip, normal) - reach);
        // Filaments that touch it during their whole turn have no arc on the plane.
        let plane =
            (depth < 2.0 * across).then(|| ContactArc::on_plane(normal, across, depth.max(0.0)));
        let part = match pose == Pose::UPRIGHT {
            true => part,
            false => {
                let farthest = trim
                    .ends()
                    .into_iter()
                    .flat_map(|s| [trim.root(s)[1], trim.tip(s)[1]]);
                let axial_reach = farthest.fold(0.0, |reach: f64, height| reach.max(height.abs()));
                Self::Posed(Box::new(Posed::new(part, pose, axial_reach)))
            }
        };
        let touches = || {
            let path = "workpiece.offset_m";
            let offset = Parameter::find(path).map_or(0.0, |offset| offset.get(settings));
            Violation::of(
                path,
                offset,
                "such that the filaments leave the workpiece at some angle of the tool",
            )
        };
        let passage = match (&part, plane) {
            (_, None) if workpiece.kind.is_plane() => Passage::all_round(PI),
            _ if settings.tube().is_some() => Passage::all_round(FRAC_PI_2),
            (_, Some(arc)) if workpiece.kind.is_plane() => match depth > 0.0 {
                true => arc.into(),
                false => Passage {
                    touches: Vec::new(),
                    ..arc.into()
                },
            },
            (Self::Posed(posed), plane) => {
                let tool = RotaryTool {
                    lateral_tilt: 0.0,
                    ..RotaryTool::at(settings, s)
                };
                posed.passage(&tool, trim.length, plane)
            }
            (Self::Outline(outline), Some(plane)) => {
                outline.passage(tip[0], plane).ok_or_else(touches)?
            }
            (Self::Profile(profile), Some(plane)) => {
                profile.passage(tip[0], plane).ok_or_else(touches)?
            }
            _ => return Err(touches()),
        };
        Ok((part, passage))
    }

    /// Returns the workpiece in its own frame, where its `y = 0` lies at the height `ground` (m).
    fn upright(settings: &Settings, ground: f64) -> Result<Self, Violation> {
        let Settings {
            tool,
            filament,
            workpiece,
            ..
        } = settings;
        let face_radius = SEGMENTS_OF_FACE * filament.length_m / filament.segments as f64;
        let velocity = [workpiece.feed_velocity_m_s, 0.0, 0.0];
        let outline = match &workpiece.kind {
            &WorkpieceKind::Edge(EdgeSettings {
                offset_m,
                included_angle_rad,
                edge_radius_m,
                side,
            }) => {
                let turn = PI - included_angle_rad;
                let edge = [Corner {
                    point: [0.0, 0.0],
                    turn,
                }];
                let (corners, direction) = placed(&edge, turn, [offset_m, ground], side);
                Outline::of_corners(&corners, direction, edge_radius_m, face_radius, velocity)
            }
            WorkpieceKind::Chamfer(chamfer) => {
                let turn = PI - chamfer.included_angle_rad;
                let corners = corners(chamfer, turn)?;
                let (corners, direction) =
                    placed(&corners, turn, [chamfer.offset_m, ground], chamfer.side);
                Outline::of_corners(
                    &corners,
                    direction,
                    chamfer.edge_radius_m,
                    face_radius,
                    velocity,
                )
            }
            &WorkpieceKind::Cylinder(RoundSettings { offset_m, radius_m }) => Outline::circle(
                [offset_m, ground - radius_m],
                radius_m,
                true,
                face_radius,
                velocity,
            ),
            &WorkpieceKind::Bore(RoundSettings { offset_m, radius_m }) => {
                let centre = [offset_m, ground + radius_m];
                check_bore(settings, radius_m, centre)?;
                Outline::circle(centre, radius_m, false, face_radius, velocity)
            }
            WorkpieceKind::Profile(stated) => {
                let profile = Profile::new(
                    spline(stated)?,
                    [stated.offset_m, ground],
                    face_radius,
                    velocity,
                );
                if Pose::of(tool) == Pose::UPRIGHT {
                    check_body(&profile, tool.body_radius_m)?;
                }
                return Ok(Self::Profile(Arc::new(profile)));
            }
            WorkpieceKind::Plane(_) => return Ok(Self::Plane(Plane::of(workpiece, -ground))),
        };
        Ok(Self::Outline(Arc::new(outline)))
    }

    /// Lets the workpiece come up to its place along `ramp`.
    pub(crate) fn on_ramp(self, ramp: Ramp) -> Self {
        Self::Posed(Box::new(match self {
            Self::Posed(posed) => posed.on_ramp(ramp),
            part => Posed::new(part, Pose::UPRIGHT, 0.0).on_ramp(ramp),
        }))
    }
}

/// Returns the corners of a chamfer between faces that turn by `turn` (rad), from the top face
/// downwards. The top face is along `y = 0`, and the material at `x ≤ 0`.
fn corners(chamfer: &ChamferSettings, turn: f64) -> Result<[Corner; 2], Violation> {
    let &ChamferSettings {
        edge_radius_m,
        chamfer_width_m,
        chamfer_angle_rad,
        ..
    } = chamfer;
    if chamfer_angle_rad >= turn {
        return Err(Violation::of(
            "workpiece.chamfer_angle_rad",
            chamfer_angle_rad,
            format!("less than {turn:.4}, by which the faces turn at the edge, in rad"),
        ));
    }
    let (sin, cos) = chamfer_angle_rad.sin_cos();
    let start = -chamfer_width_m * (turn - chamfer_angle_rad).sin() / turn.sin();
    let corners = [
        Corner {
            point: [start, 0.0],
            turn: chamfer_angle_rad,
        },
        Corner {
            point: [start + chamfer_width_m * cos, -chamfer_width_m * sin],
            turn: turn - chamfer_angle_rad,
        },
    ];
    let largest = chamfer_width_m
        / corners
            .iter()
            .map(|corner| corner.rounding(1.0))
            .sum::<f64>();
    if edge_radius_m >= largest {
        return Err(Violation::of(
            "workpiece.edge_radius_m",
            edge_radius_m,
            format!("less than {largest:.4e}, at which the rounded edges use up the chamfer, in m"),
        ));
    }
    Ok(corners)
}

/// Returns [`corners`] at their place, in their order along the outline, and the direction of its
/// first face.
fn placed(corners: &[Corner], turn: f64, [x, y]: [f64; 2], side: Side) -> (Vec<Corner>, [f64; 2]) {
    match side {
        Side::Leaving => {
            let along = |&Corner { point, turn }: &Corner| Corner {
                point: [x + point[0], y + point[1]],
                turn,
            };
            (corners.iter().map(along).collect(), [1.0, 0.0])
        }
        // Mirrored, and gone along the other way: up the side face and onto the top.
        Side::Entering => {
            let mirrored = |&Corner { point, turn }: &Corner| Corner {
                point: [x - point[0], y + point[1]],
                turn,
            };
            (
                corners.iter().rev().map(mirrored).collect(),
                [turn.cos(), turn.sin()],
            )
        }
    }
}

/// Checks that every root lies inside a bore, and that filaments come free in it unless it is a
/// tube.
fn check_bore(settings: &Settings, radius_m: f64, [x, y]: [f64; 2]) -> Result<(), Violation> {
    let (body, length) = (settings.tool.body_radius_m, settings.filament.length_m);
    let distance = x.hypot(y);
    let violation = |allowed: String| Violation::of("workpiece.radius_m", radius_m, allowed);
    let farthest = distance + body + settings.filament.diameter_m / 2.0;
    if farthest >= radius_m {
        return Err(violation(format!(
            "greater than {farthest:.4e}: every root must lie inside the bore, whose axis is \
             {distance:.4e} m from the tool’s; without a depth both are one"
        )));
    }
    if settings.tube().is_none() && distance + radius_m <= body + length {
        return Err(violation(format!(
            "greater than {:.4e}, in m, so that the filaments come free in the bore: they touch it \
             all round only on tools that are round and not tilted",
            body + length - distance
        )));
    }
    Ok(())
}

/// Returns the spline of a profile.
fn spline(profile: &ProfileSettings) -> Result<Arc<Spline>, Violation> {
    let ProfileSettings {
        control_points_m,
        degree,
        closed,
        ..
    } = profile;
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
    Ok(Arc::new(spline))
}

/// Checks that the brush body is outside the material.
fn check_body(profile: &Profile, body_radius_m: f64) -> Result<(), Violation> {
    let gap = profile.surface([0.0; 3], 0.0).gap;
    if gap > body_radius_m {
        return Ok(());
    }
    let value = if gap < 0.0 {
        "around the tool axis".to_owned()
    } else {
        format!("{gap:.4e} m from the tool axis")
    };
    Err(Violation {
        path: "workpiece.control_points_m",
        value,
        allowed: format!(
            "farther than the brush body’s radius, {body_radius_m:?} m, with the material on the right-hand side of the curve"
        ),
    })
}

/// Checks that the required settings of this kind of workpiece are stated.
fn check_stated(kind: &WorkpieceKind) -> Result<(), Violation> {
    let missing = |path, value: &str, allowed: &str, unit: &str| {
        let allowed = format!("{allowed} for a workpiece of kind `{}`{unit}", kind.name());
        Err(Violation {
            path,
            value: value.to_owned(),
            allowed,
        })
    };
    let length = |path| missing(path, "left out or zero", "greater than 0", ", in m");
    match kind {
        WorkpieceKind::Edge(EdgeSettings { edge_radius_m, .. })
        | WorkpieceKind::Chamfer(ChamferSettings { edge_radius_m, .. })
            if *edge_radius_m <= 0.0 =>
        {
            length("workpiece.edge_radius_m")
        }
        WorkpieceKind::Chamfer(chamfer) if chamfer.chamfer_width_m <= 0.0 => {
            length("workpiece.chamfer_width_m")
        }
        WorkpieceKind::Cylinder(round) | WorkpieceKind::Bore(round) if round.radius_m <= 0.0 => {
            length("workpiece.radius_m")
        }
        WorkpieceKind::Profile(profile) if profile.control_points_m.is_empty() => missing(
            "workpiece.control_points_m",
            "0 points",
            "a list of points",
            "",
        ),
        _ => Ok(()),
    }
}

/// Evaluates an expression for each kind.
macro_rules! each {
    ($part:expr, $workpiece:ident => $result:expr) => {
        match $part {
            Part::Plane($workpiece) => $result,
            Part::Outline($workpiece) => $result,
            Part::Profile($workpiece) => $result,
            Part::Posed($workpiece) => $result,
        }
    };
}

impl Part {
    /// Returns the surface, in a function of its own, so that the surface of a plane is inlined.
    #[inline(never)]
    fn curved_surface(&self, position: [f64; 3], time: f64) -> Surface {
        each!(self, workpiece => workpiece.surface(position, time))
    }
}

impl Workpiece for Part {
    #[inline]
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        match self {
            Self::Plane(plane) => plane.surface(position, time),
            other => other.curved_surface(position, time),
        }
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

    fn largest_curvatures(&self) -> [f64; 2] {
        each!(self, workpiece => workpiece.largest_curvatures())
    }

    fn profile(&self, reach: f64, longest: f64) -> Option<ProfileCells> {
        each!(self, workpiece => workpiece.profile(reach, longest))
    }

    fn arc_length(&self, position: [f64; 3], time: f64) -> Option<f64> {
        each!(self, workpiece => workpiece.arc_length(position, time))
    }
}
