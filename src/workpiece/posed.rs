//! Workpieces in the frame of a tool whose axis is not their `z`, or to which they come up at
//! first.

use std::sync::Arc;

use super::{ContactArc, Edge, Passage, ProfileCells, Surface, Workpiece, bisect};
use crate::equations::Clamp;
use crate::equations::linear::{add, scale, sub};
use crate::model::passage::part_left;
use crate::tool::{Pose, RotaryTool, Tool};

/// Distance of a workpiece from its place at first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Way {
    /// Vector in m along its outward normal, in its own frame.
    Along([f64; 3]),
    /// Distance in m by which its whole surface recedes into the material: a bore is wider by it.
    Inwards(f64),
}

/// Ramp on which a workpiece comes up to its place: from rest to rest, twice differentiable in
/// time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ramp {
    /// Distance to its place at the start.
    pub way: Way,
    /// Duration in s, from time zero on.
    pub duration: f64,
}

impl Ramp {
    /// Returns the part of the way that is left at `time` (s), and its rate in 1/s.
    fn left(&self, time: f64) -> [f64; 2] {
        let [left, rate] = part_left(time / self.duration);
        [left, rate / self.duration]
    }
}

/// Placement of a workpiece in the frame of the tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Placement {
    pose: Pose,
    ramp: Option<Ramp>,
}

impl Placement {
    /// Returns `true` if the workpiece comes up to its place.
    pub(super) fn has_ramp(&self) -> bool {
        self.ramp.is_some()
    }

    /// Maps a point of the tool's frame (m) at `time` (s) to the frame of the workpiece.
    #[inline]
    pub fn local(&self, position: [f64; 3], time: f64) -> [f64; 3] {
        let position = self.pose.from_tool(position);
        match &self.ramp {
            Some(
                ramp @ Ramp {
                    way: Way::Along(way),
                    ..
                },
            ) => {
                let [left, _] = ramp.left(time);
                add(position, scale(left, *way))
            }
            _ => position,
        }
    }

    /// Maps a surface at `time` (s) to the tool's frame.
    #[inline]
    pub fn seen(&self, surface: &Surface, time: f64) -> Surface {
        let (mut gap, mut velocity) = (surface.gap, surface.velocity);
        if let Some(ramp) = &self.ramp {
            let [left, rate] = ramp.left(time);
            let way = match ramp.way {
                Way::Along(way) => way,
                Way::Inwards(depth) => {
                    gap += left * depth;
                    scale(depth, surface.normal)
                }
            };
            velocity = sub(velocity, scale(rate, way));
        }
        let [normal, across, velocity] =
            [surface.normal, surface.across, velocity].map(|vector| self.pose.to_tool(vector));
        Surface {
            gap,
            normal,
            across,
            velocity,
            ..*surface
        }
    }

    /// Returns the tool's axis in the frame of the workpiece.
    pub fn axis(&self) -> [f64; 3] {
        self.pose.from_tool([0.0, 0.0, 1.0])
    }

    /// Returns the direction of extrusion in the tool's frame.
    pub fn extrusion(&self) -> [f64; 3] {
        self.pose.to_tool([0.0, 0.0, 1.0])
    }
}

/// A part in the frame of a tool.
#[derive(Clone, Debug, PartialEq)]
pub struct Posed<W> {
    part: W,
    placement: Arc<Placement>,
    edges: Vec<Edge>,
    /// Largest distance of a point of the trim from the plane `z = 0` of the tool, in m.
    axial_reach: f64,
}

impl<W: Workpiece> Posed<W> {
    /// Places `part` in the frame of a tool in `pose`, whose trim comes as far as `axial_reach` (m)
    /// from its plane `z = 0`.
    pub(super) fn new(part: W, pose: Pose, axial_reach: f64) -> Self {
        Self {
            edges: Vec::new(),
            placement: Arc::new(Placement { pose, ramp: None }),
            part,
            axial_reach,
        }
        .with_edges()
    }

    fn with_edges(self) -> Self {
        let edges = self
            .part
            .edges()
            .iter()
            .map(|edge| edge.clone().placed(Arc::clone(&self.placement)))
            .collect();
        Self { edges, ..self }
    }

    /// Lets the part come up to its place on a ramp.
    pub(super) fn on_ramp(self, ramp: Ramp) -> Self {
        let placement = Placement {
            ramp: Some(ramp),
            ..(*self.placement).clone()
        };
        Self {
            placement: Arc::new(placement),
            ..self
        }
        .with_edges()
    }

    /// Returns the part in its own frame.
    pub fn part(&self) -> &W {
        &self.part
    }

    /// Returns `true` if it is a plane.
    fn is_flat(&self) -> bool {
        self.edges.is_empty() && self.part.largest_curvatures() == [0.0; 2]
    }

    /// Returns the gap of a point in the tool's frame at time zero, in m.
    fn gap(&self, position: [f64; 3]) -> f64 {
        let face = self.surface(position, 0.0);
        let edges = self.edges.iter().map(|edge| edge.surface(position, 0.0));
        let there = [face]
            .into_iter()
            .chain(edges)
            .filter(|surface| surface.margin >= 0.0);
        // A point outside of all of them is at a border, and the face is as near.
        there
            .map(|surface| surface.gap)
            .reduce(f64::min)
            .unwrap_or(face.gap)
    }

    /// Returns the passage of the undeformed filament of `tool`, `length` (m) long, at time zero.
    /// The window also has the angles of `plane`, unless that is all round.
    pub(super) fn passage(
        &self,
        tool: &RotaryTool,
        length: f64,
        plane: Option<ContactArc>,
    ) -> Passage {
        use std::f64::consts::{PI, TAU};
        /// Least step of the angle in rad: shorter touches can be missed.
        const MIN_STEP: f64 = 1e-4;
        let Clamp {
            position,
            direction,
            ..
        } = tool.clamp(0.0, 0.0);
        let tip = add(position, scale(length, direction));
        let farthest = position[0].abs().max(tip[0].abs());
        let gap = |angle: f64| {
            let Clamp {
                position,
                direction,
                ..
            } = tool.clamp(angle, 0.0);
            self.least_gap(position, direction, length)
        };
        let above = plane.map_or(PI / 2.0, |arc| arc.middle - PI);
        // From an angle at which the filament is free, once round.
        let starts = (0..64).map(|i| above + TAU * f64::from(i) / 64.0);
        let Some(start) = starts.into_iter().find(|&angle| gap(angle) > 0.0) else {
            return Passage::all_round(above);
        };
        let (mut angle, mut here) = (start, gap(start));
        let mut touches: Vec<[f64; 2]> = Vec::new();
        let mut entry = None;
        while angle < start + TAU {
            // A gap changes by no more than the path.
            let next = (angle + (here.abs() / farthest).max(MIN_STEP)).min(start + TAU);
            let there = gap(next);
            match entry {
                None if there < 0.0 => entry = Some(bisect(|angle| gap(angle) < 0.0, angle, next)),
                Some(from) if there >= 0.0 => {
                    touches.push([from, bisect(|angle| gap(angle) >= 0.0, angle, next)]);
                    entry = None;
                }
                _ => {}
            }
            (angle, here) = (next, there);
        }
        touches.extend(entry.map(|from| [from, start + TAU]));
        let mut window = [f64::INFINITY, f64::NEG_INFINITY];
        if let Some(ContactArc { middle, angle }) = plane {
            let middle = middle + TAU * ((start + PI - middle) / TAU).round();
            window = [middle - angle / 2.0, middle + angle / 2.0];
        }
        if let (Some([first, _]), Some([_, last])) = (touches.first(), touches.last()) {
            window = [window[0].min(*first), window[1].max(*last)];
        }
        if window[0] > window[1] {
            window = [start + PI; 2];
        }
        let [first, last] = window;
        let touches = touches
            .iter()
            .map(|touch| touch.map(|angle| angle - first))
            .collect();
        Passage {
            window: ContactArc {
                middle: (first + last) / 2.0,
                angle: last - first,
            },
            touches,
            all_round: false,
        }
    }

    /// Returns the least gap of a straight filament in m.
    fn least_gap(&self, root: [f64; 3], direction: [f64; 3], length: f64) -> f64 {
        /// Number of parts in which the least gap is searched before it is bracketed.
        const SEARCH_PARTS: usize = 32;
        let gap = |share: f64| self.gap(add(root, scale(share * length, direction)));
        let ends = [gap(0.0), gap(1.0)];
        if self.is_flat() {
            return ends[0].min(ends[1]);
        }
        let (mut least, mut best) = if ends[0] < ends[1] {
            (ends[0], 0.0)
        } else {
            (ends[1], 1.0)
        };
        let mut share = 0.0;
        while share < 1.0 {
            let here = gap(share);
            if here < least {
                (least, best) = (here, share);
            }
            // Parts that are too far for the least gap are left out: it changes by no more than the
            // path.
            share += ((here - least) / length).max(1.0 / SEARCH_PARTS as f64);
        }
        let mut width = 1.0 / SEARCH_PARTS as f64;
        while width > 1e-9 {
            let [below, above] =
                [best - width / 2.0, best + width / 2.0].map(|share| share.clamp(0.0, 1.0));
            let (low, high) = (gap(below), gap(above));
            if low < least && low <= high {
                (least, best) = (low, below);
            } else if high < least {
                (least, best) = (high, above);
            } else {
                width /= 2.0;
            }
        }
        least
    }
}

impl<W: Workpiece> Workpiece for Posed<W> {
    #[inline]
    fn surface(&self, position: [f64; 3], time: f64) -> Surface {
        let local = self.placement.local(position, time);
        self.placement.seen(&self.part.surface(local, time), time)
    }

    fn edges(&self) -> &[Edge] {
        &self.edges
    }

    /// Returns `true` for a plane whose normal is across the axis, and for a surface that recedes as
    /// a whole.
    fn is_planar(&self) -> bool {
        if let Some(Ramp {
            way: Way::Inwards(_),
            ..
        }) = self.placement.ramp
        {
            return self.placement.pose == Pose::UPRIGHT && self.part.is_planar();
        }
        let surface = self.surface([0.0; 3], 0.0);
        self.is_flat()
            && !self.placement.has_ramp()
            && surface.normal[2] == 0.0
            && surface.velocity[2] == 0.0
    }

    fn translates(&self) -> bool {
        !self.placement.has_ramp()
    }

    /// Returns infinity for a ramp: its velocity is not constant.
    fn largest_curvatures(&self) -> [f64; 2] {
        if self.placement.has_ramp() {
            [f64::INFINITY; 2]
        } else {
            self.part.largest_curvatures()
        }
    }

    fn profile(&self, reach: f64, longest: f64) -> Option<ProfileCells> {
        self.part.profile(reach.hypot(self.axial_reach), longest)
    }

    fn arc_length(&self, position: [f64; 3], time: f64) -> Option<f64> {
        self.part
            .arc_length(self.placement.local(position, time), time)
    }
}
