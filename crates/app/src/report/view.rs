//! Views of a contact: along the tool's axis and, unless the tool is an upright radial one, from
//! the side.
//!
//! Everything is in the frame of the workpiece, as samples and shapes are.

use std::f64::consts::TAU;

use bristle::equations::linear::{add, cross, dot, scale, sub};
use bristle::model::settings::Settings;
use bristle::simulation::Pass;
use bristle::tool::{Pose, Tool, Trim, places};
use bristle::workpiece::{Workpiece, unit_normal};

use crate::report::drawing::ends;

/// Points of a circle.
const POINTS: u32 = 180;
/// Sine below which directions count as parallel.
const PARALLEL: f64 = 1e-3;
/// Extent of drawn profiles and planes, in radii of the tool.
const REACH: f64 = 1.5;
const PLANE_REACH: f64 = 10.0;

/// Returns `true` if a tool is upright and its filaments are radial.
pub(crate) fn is_upright(settings: &Settings) -> bool {
    Pose::of(&settings.tool) == Pose::UPRIGHT && Trim::of(settings).is_radial()
}

/// Returns the place (m) along the trim of the sampled filament, which is nearest to the middle.
pub(crate) fn sampled_place(settings: &Settings) -> f64 {
    let places = places(settings);
    places[places.len() / 2].s
}

/// Returns the sampled pass.
pub(crate) fn sampled_pass(settings: &Settings) -> Pass {
    Pass::at(settings, sampled_place(settings))
}

/// Returns `true` if the filament touches the workpiece during the whole turn. The workpiece then
/// comes up in a turn before the first one that counts.
pub(crate) fn is_all_round(pass: &Pass) -> bool {
    let [entry, exit] = pass.nominal_times();
    exit - entry > (1.0 - 1e-9) * pass.turn_time()
}

/// Returns the time in s at which the first turn that counts begins.
#[must_use]
pub fn first_turn(settings: &Settings) -> f64 {
    let pass = sampled_pass(settings);
    if is_all_round(&pass) {
        pass.turn_time()
    } else {
        0.0
    }
}

/// Returns the displacement (m) of the workpiece at `time` (s) from the place of its profile: its
/// feed, and the remaining way up.
pub(crate) fn moved(pass: &Pass, time: f64) -> [f64; 3] {
    /// Points of Gauss and Legendre, which integrate polynomials of the fifth degree, and their
    /// weights.
    const GAUSS: [[f64; 2]; 3] = [
        [-0.774_596_669_241_483_4, 5.0 / 9.0],
        [0.0, 8.0 / 9.0],
        [0.774_596_669_241_483_4, 5.0 / 9.0],
    ];
    let velocity = |time: f64| {
        pass.pose()
            .from_tool(pass.workpiece().surface([0.0; 3], time).velocity)
    };
    let arrival = pass.turn_time();
    if pass.workpiece().translates() {
        return scale(time, velocity(time));
    }
    let last = velocity(arrival);
    // A tube narrows in its place.
    if pass.workpiece().is_planar() {
        return scale(time, last);
    }
    let left = (arrival - time).max(0.0);
    let to_come = GAUSS.iter().fold([0.0; 3], |sum, [point, weight]| {
        let at = arrival - left * (1.0 - point) / 2.0;
        add(sum, scale(weight * left / 2.0, sub(velocity(at), last)))
    });
    sub(scale(time, last), to_come)
}

/// Returns the height in m of a point at `time` (s), above the workpiece's own `y = 0` or a plane.
pub(crate) fn height(settings: &Settings, pass: &Pass, point: [f64; 3], time: f64) -> f64 {
    dot(
        unit_normal(&settings.workpiece),
        sub(point, moved(pass, time)),
    ) + ground(settings)
}

/// Returns the root at the `angle` (rad) of the tool.
pub(crate) fn root(pass: &Pass, angle: f64) -> [f64; 3] {
    pass.pose()
        .from_tool(pass.tool().tool.clamp(angle, 0.0).position)
}

/// Returns the distance in m from the tool's centre down to the workpiece's own `y = 0`.
fn ground(settings: &Settings) -> f64 {
    settings.reach_m() - settings.process.penetration_depth_m
}

/// The surface of a workpiece as a view shows it.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct DrawnSurface {
    /// Points of a line with the material on its right-hand side, or border of the part that faces
    /// the viewer, in m.
    pub points: Vec<[f64; 2]>,
    /// `true` if the points go round the material.
    pub is_filled: bool,
}

/// One view of a contact.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct View {
    /// Name in words.
    pub name: &'static str,
    /// Directions that point to the right and upwards in the view.
    across: [f64; 3],
    up: [f64; 3],
    /// Offset added to heights, in m. Heights begin at the surface where it is seen as a line.
    lift: f64,
    cut: Option<Cut>,
    /// `true` if the view shows places on the profile of the workpiece apart from each other.
    shows_profile: bool,
    /// The workpiece at the place of its profile.
    pub surface: DrawnSurface,
    /// Outlines of the tool's body, and of its undeformed trim.
    pub body: Vec<Vec<[f64; 2]>>,
    pub trim: Vec<Vec<[f64; 2]>>,
    /// Corners of the section through the trim that is nearest to the surface; empty along the
    /// axis.
    pub nearest: Vec<[f64; 2]>,
}

/// Plane across the tool's axis in which the sampled tip turns, and direction along which the
/// workpiece does not change.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cut {
    axis: [f64; 3],
    height: f64,
    along: [f64; 3],
}

impl View {
    /// Returns the view of a contact along the tool's axis.
    pub fn along_axis(settings: &Settings, pass: &Pass) -> Self {
        ContactScene::new(settings, pass).along_axis()
    }

    /// Returns the views of a contact.
    pub fn all(settings: &Settings, pass: &Pass) -> Vec<Self> {
        let frame = ContactScene::new(settings, pass);
        let side = (!is_upright(settings)).then(|| frame.side_on());
        [frame.along_axis()].into_iter().chain(side).collect()
    }

    /// Returns the place of a point in the view, in m.
    pub fn place(&self, point: [f64; 3]) -> [f64; 2] {
        [dot(self.across, point), dot(self.up, point) + self.lift]
    }

    /// Returns the place of a point of the workpiece's profile in the view, in m. `None` if all
    /// points coincide.
    pub fn on_profile(&self, [x, y]: [f64; 2]) -> Option<[f64; 2]> {
        self.shows_profile
            .then(|| self.place(slid(self.cut.as_ref(), [x, y, 0.0])))
    }

    /// Returns the displacement in the view of a workpiece that moves by a vector (m).
    pub fn shift(&self, way: [f64; 3]) -> [f64; 2] {
        let cut = self.cut.map(|cut| Cut { height: 0.0, ..cut });
        let way = slid(cut.as_ref(), way);
        [dot(self.across, way), dot(self.up, way)]
    }
}

/// Moves a point of the workpiece into the plane of the cut.
fn slid(cut: Option<&Cut>, point: [f64; 3]) -> [f64; 3] {
    cut.map_or(
        point,
        |&Cut {
             axis,
             height,
             along,
         }| {
            add(
                point,
                scale((height - dot(axis, point)) / dot(axis, along), along),
            )
        },
    )
}

/// Returns the direction of a vector, with its length; `None` if it is nearly zero.
fn direction(vector: [f64; 3]) -> Option<([f64; 3], f64)> {
    let length = dot(vector, vector).sqrt();
    (length > PARALLEL).then(|| (scale(1.0 / length, vector), length))
}

/// Returns the component of `vector` perpendicular to the unit vector `other`.
fn across(vector: [f64; 3], other: [f64; 3]) -> [f64; 3] {
    sub(vector, scale(dot(vector, other), other))
}

/// Tool and workpiece.
struct ContactScene<'a> {
    settings: &'a Settings,
    trim: Trim,
    pose: Pose,
    /// The tool's axis, and the outward normal of the workpiece.
    axis: [f64; 3],
    normal: [f64; 3],
    /// Direction along the workpiece's own line `y = 0`.
    forward: [f64; 3],
    is_plane: bool,
    /// Outline of the workpiece; `is_solid` is `true` if it goes round the material.
    outline: Vec<[f64; 2]>,
    is_solid: bool,
    /// Extent of drawn surfaces, in m.
    reach: f64,
}

impl<'a> ContactScene<'a> {
    fn new(settings: &'a Settings, pass: &Pass) -> Self {
        /// Largest error of the drawn outline, in m.
        const ERROR: f64 = 2e-6;
        let normal @ [x, y, _] = unit_normal(&settings.workpiece);
        let pose = Pose::of(&settings.tool);
        let trim = Trim::of(settings);
        let farthest = trim
            .ends()
            .into_iter()
            .flat_map(|s| [trim.root(s), trim.tip(s)]);
        let reach = REACH
            * farthest.fold(0.0, |reach: f64, [radius, height]| {
                reach.max(radius.hypot(height))
            });
        let profile = pass.outline(reach).unwrap_or_default();
        Self {
            settings,
            trim,
            pose,
            axis: pose.from_tool([0.0, 0.0, 1.0]),
            normal,
            forward: direction([y, -x, 0.0]).map_or([1.0, 0.0, 0.0], |(forward, _)| forward),
            is_plane: settings.workpiece.kind.is_plane(),
            outline: profile.simplified(ERROR),
            is_solid: profile.is_solid(),
            reach,
        }
    }

    /// Returns the view against the axis, which points to the viewer, with the workpiece's normal
    /// upwards.
    fn along_axis(&self) -> View {
        let Self { axis, normal, .. } = *self;
        let height = self.trim.tip(sampled_place(self.settings))[1];
        let upright = direction(across(normal, axis));
        let up = upright.map_or_else(|| self.pose.from_tool([0.0, 1.0, 0.0]), |(up, _)| up);
        let right = cross(up, axis);
        let lift = upright.map_or(0.0, |(_, part)| {
            (ground(self.settings) + dot(normal, axis) * height) / part
        });
        // On a plane points may slide along the cut; others are the same along z.
        let along = if self.is_plane {
            cross(normal, right)
        } else {
            [0.0, 0.0, 1.0]
        };
        let cut = (dot(axis, along).abs() > PARALLEL).then_some(Cut {
            axis,
            height,
            along,
        });
        let line = |points: Vec<[f64; 2]>, is_filled| DrawnSurface { points, is_filled };
        let mut view = View {
            name: "along the axis",
            across: right,
            up,
            lift,
            cut,
            shows_profile: cut.is_some()
                && (!self.is_plane || dot(right, self.forward).abs() > 0.5),
            ..View::default()
        };
        view.surface = match (self.is_plane, cut) {
            (true, Some(_)) => line(self.level(), false),
            (_, Some(cut)) => {
                let places = self
                    .outline
                    .iter()
                    .map(|&[x, y]| view.place(slid(Some(&cut), [x, y, 0.0])));
                let mut points: Vec<[f64; 2]> = places.collect();
                if axis[2] < 0.0 {
                    points.reverse();
                }
                line(points, self.is_solid)
            }
            (_, None) => line(self.facing(&view), true),
        };
        let circle = |[radius, height]: [f64; 2]| {
            let point = |k: u32| {
                let (sin, cos) = (TAU * f64::from(k) / f64::from(POINTS)).sin_cos();
                view.place(self.pose.from_tool([radius * cos, radius * sin, height]))
            };
            (0..=POINTS).map(point).collect::<Vec<_>>()
        };
        let ends = self.trim.ends();
        let outer = if self.trim.root(ends[0])[0] > self.trim.root(ends[1])[0] {
            ends[0]
        } else {
            ends[1]
        };
        let body = vec![circle(self.trim.root(outer))];
        // The tips of a radial trim turn on one circle.
        let tips = if self.trim.is_radial() {
            &ends[..1]
        } else {
            &ends
        };
        let trim = tips.iter().map(|&s| circle(self.trim.tip(s))).collect();
        View { body, trim, ..view }
    }

    /// Returns the view along the surface. A plane is seen in the plane of axis and normal, a
    /// profile along the direction of extrusion. If the tool turns about this direction, the view
    /// is across it.
    fn side_on(&self) -> View {
        let Self {
            axis, normal: up, ..
        } = *self;
        let is_about_extrusion = axis[2].abs() > std::f64::consts::FRAC_1_SQRT_2;
        let right = match self.is_plane {
            true => direction(across(axis, up)).map_or(self.forward, |(along, _)| along),
            false if is_about_extrusion => [0.0, 0.0, 1.0],
            false => [1.0, 0.0, 0.0],
        };
        let mut view = View {
            name: "from the side",
            across: right,
            up,
            lift: ground(self.settings),
            shows_profile: dot(right, self.forward).abs() > 0.9,
            surface: DrawnSurface {
                points: self.level(),
                is_filled: false,
            },
            ..View::default()
        };
        if !self.is_plane && view.shows_profile {
            let points = self
                .outline
                .iter()
                .map(|&[x, y]| view.place([x, y, 0.0]))
                .collect();
            view.surface = DrawnSurface {
                points,
                is_filled: self.is_solid,
            };
        }
        // The section through the axis that faces the viewer.
        let radial = direction(cross(cross(right, up), axis)).map_or(up, |(radial, _)| radial);
        let point = |[radius, height]: [f64; 2], side: f64| {
            view.place(add(scale(side * radius, radial), scale(height, axis)))
        };
        let [first, last] = self.trim.ends();
        let half = |side: f64| {
            let [root, tip] =
                [Trim::root, Trim::tip].map(|of| move |s: f64| point(of(&self.trim, s), side));
            vec![root(first), root(last), tip(last), tip(first), root(first)]
        };
        let root = |s: f64, side: f64| point(self.trim.root(s), side);
        let body = vec![
            root(first, -1.0),
            root(last, -1.0),
            root(last, 1.0),
            root(first, 1.0),
            root(first, -1.0),
        ];
        let trim = vec![half(-1.0), half(1.0)];
        let lowest = |half: &&Vec<[f64; 2]>| ends(half.iter().map(|[_, y]| *y))[0];
        let nearest = trim
            .iter()
            .min_by(|a, b| lowest(a).total_cmp(&lowest(b)))
            .cloned()
            .unwrap_or_default();
        View {
            body: vec![body],
            nearest,
            trim,
            ..view
        }
    }

    /// Returns the surface as a line at the height zero.
    fn level(&self) -> Vec<[f64; 2]> {
        let reach = PLANE_REACH * self.reach;
        vec![[-reach, 0.0], [reach, 0.0]]
    }

    /// Returns the border of the part of the surface that faces the viewer.
    fn facing(&self, view: &View) -> Vec<[f64; 2]> {
        if self.is_plane {
            let r = PLANE_REACH * self.reach;
            return vec![[-r, -r], [r, -r], [r, r], [-r, r], [-r, -r]];
        }
        let side = |z: f64| {
            self.outline
                .iter()
                .map(move |&[x, y]| view.place([x, y, z]))
        };
        side(-self.reach)
            .chain(side(self.reach).rev())
            .chain(side(-self.reach).take(1))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;
    use bristle::model::settings::{EdgeSettings, ToolKind, WorkpieceKind};
    use bristle::simulation::{Sampling, simulate_with};

    fn settings(kind: ToolKind, tilt: f64, skew: f64) -> Settings {
        let mut settings = Settings::paper(10.0, 1e-3);
        (
            settings.tool.kind,
            settings.tool.tilt_rad,
            settings.tool.skew_rad,
        ) = (kind, Some(tilt), skew);
        (settings.filament.segments, settings.tool.positions) = (4, Some(1));
        settings
    }

    fn both(settings: &Settings, pass: &Pass) -> [View; 2] {
        let views = View::all(settings, pass);
        views.try_into().expect("along the axis and from the side")
    }

    fn near(found: f64, expected: f64) {
        assert!((found - expected).abs() < 1e-9, "{found}, not {expected}");
    }

    /// The undeformed tip is below the surface by the depth where it comes deepest, in both views;
    /// the trim and the surface show the same.
    #[test]
    fn the_deepest_tip_is_below_the_surface_by_the_depth() {
        let cases = [
            (ToolKind::Round, 0.1, 0.0),
            (ToolKind::Cup, 1.45, 0.3),
            (ToolKind::Round, 0.4, 0.7),
        ];
        for (kind, tilt, skew) in cases {
            let settings = settings(kind, tilt, skew);
            let pass = sampled_pass(&settings);
            let views = both(&settings, &pass);
            let [entry, exit] = pass.nominal_times();
            let angle = pass.tool().angle((entry + exit) / 2.0);
            let root = root(&pass, angle);
            let clamp = pass.tool().tool.clamp(angle, 0.0);
            let tip = add(
                root,
                scale(
                    settings.filament.length_m,
                    pass.pose().from_tool(clamp.direction),
                ),
            );
            near(height(&settings, &pass, tip, 0.0), -1e-3);
            let [axis, side] = &views;
            near(side.place(tip)[1], -1e-3);
            // Seen along the axis, heights are those in the plane in which the tip turns.
            let steepness = dot(axis.up, unit_normal(&settings.workpiece));
            near(axis.place(tip)[1], -1e-3 / steepness);
            let [lowest, _] = ends(axis.trim.iter().flatten().map(|[_, y]| *y));
            assert!(lowest * steepness <= -0.9e-3, "{lowest}");
            for view in &views {
                near(dot(view.across, view.up), 0.0);
                near(dot(view.across, view.across), 1.0);
                assert_eq!(
                    view.surface
                        .points
                        .iter()
                        .map(|[_, y]| *y)
                        .collect::<Vec<_>>(),
                    [0.0, 0.0]
                );
            }
        }
    }

    /// A flat cup is seen from below along its axis, in front of the surface, and upright from the
    /// side.
    #[test]
    fn a_flat_cup_stands_on_the_surface() {
        let settings = settings(ToolKind::Cup, FRAC_PI_2, 0.0);
        let pass = sampled_pass(&settings);
        assert!(is_all_round(&pass) && !is_upright(&settings));
        let [axis, side] = both(&settings, &pass);
        assert!(axis.surface.is_filled && !side.surface.is_filled && side.shows_profile);
        let [x, y] = axis.place([0.1, -0.04, 0.02]);
        near(x, 0.1);
        near(y, 0.02);
        // The workpiece comes up by the depth in the turn before the first: all of it is ahead at
        // the start.
        near(first_turn(&settings), pass.turn_time());
        let way = dot(moved(&pass, 0.0), unit_normal(&settings.workpiece));
        assert!(way < -1e-3 + 1e-12 && way > -2e-3, "{way}");
        near(side.shift(moved(&pass, 0.0))[1], way);
        near(
            dot(
                moved(&pass, pass.turn_time()),
                unit_normal(&settings.workpiece),
            ),
            0.0,
        );
        let half = dot(
            moved(&pass, pass.turn_time() / 2.0),
            unit_normal(&settings.workpiece),
        );
        near(half, way / 2.0);
        // The gap of the solver is the height, also on the way up.
        for part in [0.0, 0.2, 0.7, 1.0, 1.5] {
            let (time, point) = (part * pass.turn_time(), [0.01, -0.038, 0.1]);
            let gap = pass
                .workpiece()
                .surface(pass.pose().to_tool(point), time)
                .gap;
            near(height(&settings, &pass, point, time), gap);
        }
    }

    /// The sampled shapes begin at the root that heights are of.
    #[test]
    fn roots_are_those_of_the_shapes() {
        let settings = settings(ToolKind::Cup, 1.4, 0.0);
        let pass = sampled_pass(&settings);
        let sampling = Sampling {
            shapes: 3,
            samples: 3,
            ..Sampling::default()
        };
        let simulation = simulate_with(&settings, sampling).expect("a pass");
        for (shape, sample) in simulation.shapes.iter().zip(&simulation.history) {
            let found = sub(root(&pass, sample.base_angle_rad), shape.nodes_m[0]);
            near(dot(found, found), 0.0);
        }
    }

    /// An edge that a cup passes is a border on what it faces, and its corner from the side.
    #[test]
    fn an_edge_is_where_it_is() {
        let mut settings = settings(ToolKind::Cup, FRAC_PI_2, 0.0);
        let edge = EdgeSettings {
            edge_radius_m: 1e-3,
            offset_m: 0.02,
            ..EdgeSettings::default()
        };
        settings.workpiece.kind = WorkpieceKind::Edge(edge);
        let pass = sampled_pass(&settings);
        let [axis, side] = both(&settings, &pass);
        assert!(axis.surface.is_filled);
        let largest =
            |view: &View, k: usize| ends(view.surface.points.iter().map(|point| point[k]))[1];
        near(largest(&axis, 0), 0.02);
        near(largest(&side, 0), 0.02);
        near(largest(&side, 1), 0.0);
        assert!(side.on_profile([0.0, 0.0]).is_some() && axis.on_profile([0.0, 0.0]).is_none());
    }
}
