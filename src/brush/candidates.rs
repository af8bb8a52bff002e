//! Broad phase: which points of filaments may press on which segments of others.
//!
//! Everything is in the frame of the turning body, where sleeping filaments do not move. There are
//! two levels, each a list with a margin (Verlet 1967):
//!
//! - *Candidate pairs* of filaments come from bounds of their angles and heights, by sort and sweep.
//!   They are listed again once a node has moved by half a margin.
//! - A pair has *blocks* of points, one per lane. Each lists the segments within the reach and a
//!   skin, and lists them again once both filaments together have moved by the skin. A block without
//!   any is listed again once they have moved by its distance.
//!
//! Bounds only exclude: results have the same bits without them.

use std::f64::consts::{PI, TAU};
use std::ops::Range;

use super::field::{Field, FilamentPoint, NodeIndex, wide};
use super::presses::Near;
use super::team;
use crate::equations::linear::{add, dot, scale, sub, zero};
use crate::equations::{LANES, Lanes, Lanewise, Real, sin_cos};

/// Filaments of equal numbers of segments.
#[derive(Clone, Debug, PartialEq)]
pub struct Layout {
    /// Number of filaments.
    pub filaments: usize,
    /// Number of segments of a filament.
    pub segments: usize,
    /// Number of points of a segment, `N_q`.
    pub points: usize,
    /// Length of a segment of each filament in m.
    pub lengths: Vec<f64>,
    /// Radius of each segment, filament by filament, in m.
    pub radii: Vec<f64>,
    /// Largest sum of two radii in m.
    pub largest_reach: f64,
    /// Period of the filaments along `z` in m, if they repeat.
    pub period: Option<f64>,
}

impl Layout {
    /// Creates a layout from lengths and radii, as in the fields.
    pub fn new(lengths: Vec<f64>, radii: Vec<f64>, points: usize, period: Option<f64>) -> Self {
        let largest_reach = 2.0
            * radii
                .iter()
                .fold(0.0_f64, |largest, radius| largest.max(*radius));
        let (filaments, segments) = (lengths.len(), radii.len() / lengths.len());
        Self {
            filaments,
            segments,
            points,
            lengths,
            radii,
            largest_reach,
            period,
        }
    }

    /// Returns the number of groups.
    pub fn groups(&self) -> usize {
        self.filaments.div_ceil(LANES)
    }

    /// Returns the length of filament that a point stands for, in m.
    pub fn part_length(&self, filament: usize) -> f64 {
        self.lengths[filament] / self.points as f64
    }
}

/// Margin of the candidate pairs, as a share of the largest reach: filaments hardly move relative to
/// their neighbours, so that pairs a diameter apart stay pairs.
const MARGIN: f64 = 1.0;
/// Skin of the blocks, as a share of the largest reach. A larger one lists more segments, a smaller
/// one lists them more often; from 0.02 to 0.05 times differ by less than 1 %.
const SKIN: f64 = 0.03;

/// Candidate pairs of filaments, with their blocks.
#[derive(Clone, Debug)]
pub struct Candidates {
    placement: PlacedFilaments,
    /// Margin in m.
    margin: f64,
    /// Lists by the group of the filament whose points may press.
    pairs: Vec<Vec<CandidatePair>>,
    /// Paths of the filaments when the pairs were last listed; empty before that.
    listed_at: Vec<Lanes>,
    /// `true` for groups that nothing touches any longer.
    left_out: Vec<bool>,
    scratch: Scratch,
}

/// Memory of the search for pairs, so that steps do not allocate.
#[derive(Clone, Debug)]
struct Scratch {
    bounds: Vec<Bounds>,
    /// Pairs by group.
    found: Vec<Vec<PairId>>,
    /// Pairs of a group that were listed before.
    known: Vec<CandidatePair>,
}

/// Positions of the filaments, and data that all pairs share in the search.
#[derive(Clone, Debug)]
struct PlacedFilaments {
    layout: Layout,
    /// Skin in m; infinite without bounds.
    skin: f64,
    /// Points of each block of a filament.
    stations: Vec<Stations>,
    /// In the frame of the body.
    positions: Field,
    /// Angle of the body in rad.
    angle: f64,
    /// Path of each filament relative to the body in m: the sum of the steps of its farthest node.
    paths: Vec<Lanes>,
}

/// A filament whose points may press on another one.
#[derive(Clone, Debug)]
struct CandidatePair {
    id: PairId,
    /// Segments near each block of points.
    blocks: Vec<SegmentList>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct PairId {
    own: usize,
    other: usize,
    /// Periodic image of the other one: the number of periods by which it is moved along `z`.
    image: i16,
}

/// Segments of another filament that are near one of the points of a block.
#[derive(Clone, Debug, Default)]
struct SegmentList {
    segments: Range<usize>,
    /// Sum of the paths of both filaments up to which all near segments are listed, in m.
    complete_until: f64,
}

impl Candidates {
    /// Creates an empty list. Without bounds, all points are candidates for all segments.
    pub fn new(layout: Layout, has_bounds: bool) -> Self {
        let groups = layout.groups();
        let skin = if has_bounds {
            SKIN * layout.largest_reach
        } else {
            f64::INFINITY
        };
        Self {
            margin: MARGIN * layout.largest_reach,
            pairs: vec![Vec::new(); groups],
            listed_at: Vec::new(),
            left_out: vec![false; groups],
            scratch: Scratch {
                bounds: Vec::new(),
                found: vec![Vec::new(); groups],
                known: Vec::new(),
            },
            placement: PlacedFilaments {
                skin,
                stations: Stations::all(layout.segments, layout.points),
                positions: Field::new(groups, layout.segments),
                angle: 0.0,
                paths: vec![Lanes::ZERO; groups],
                layout,
            },
        }
    }

    /// Moves the nodes to `positions`, where the body is at `angle` (rad). Groups that have not
    /// `moved` since the last time have turned with the body, if at all.
    pub fn update(&mut self, positions: &Field, angle: f64, moved: impl Fn(usize) -> bool) {
        let is_first = self.listed_at.is_empty();
        self.placement
            .follow(positions, angle, |group| is_first || moved(group));
        let paths = &self.placement.paths;
        let is_complete = |(now, then): (&Lanes, &Lanes)| {
            (0..LANES).all(|lane| now.lane(lane) - then.lane(lane) <= 0.5 * self.margin)
        };
        if is_first || !paths.iter().zip(&self.listed_at).all(is_complete) {
            self.listed_at.clone_from(paths);
            self.list_pairs();
        }
    }

    /// Lists the pairs of filaments that may be nearer to each other than the reach and the margin.
    /// Pairs that are listed again keep their blocks.
    fn list_pairs(&mut self) {
        let PlacedFilaments { layout, skin, .. } = &self.placement;
        let near = layout.largest_reach + self.margin;
        let Scratch {
            bounds,
            found,
            known,
        } = &mut self.scratch;
        bounds.clear();
        let filaments = (0..layout.filaments).filter(|filament| !self.left_out[filament / LANES]);
        bounds.extend(filaments.map(|filament| {
            let bounds = Bounds::of(filament, self.placement.centreline(filament, 0).all(), near);
            if skin.is_finite() {
                bounds
            } else {
                bounds.all_around()
            }
        }));
        found.iter_mut().for_each(Vec::clear);
        for_each_close(bounds, |a, b| {
            for image in a.images(b, layout.period) {
                let (own, other) = (a.filament, b.filament);
                found[own / LANES].push(PairId { own, other, image });
                if own != other {
                    let (own, other, image) = (other, own, -image);
                    found[own / LANES].push(PairId { own, other, image });
                }
            }
        });
        for (pairs, found) in self.pairs.iter_mut().zip(found) {
            found.sort_unstable();
            std::mem::swap(pairs, known);
            pairs.clear();
            pairs.extend(found.iter().map(|&id| {
                let blocks = match known.binary_search_by_key(&id, |pair| pair.id) {
                    Ok(at) => std::mem::take(&mut known[at].blocks),
                    Err(_) => vec![SegmentList::default(); self.placement.stations.len()],
                };
                CandidatePair { id, blocks }
            }));
        }
    }

    /// Leaves out a group: nothing touches it any longer.
    pub fn leave_out(&mut self, group: usize) {
        self.left_out[group] = true;
        self.pairs[group].clear();
        for pairs in &mut self.pairs {
            pairs.retain(|pair| pair.id.other / LANES != group);
        }
    }

    /// Returns the candidate pairs of each group, where the nodes were put.
    pub fn by_group(&mut self) -> impl ExactSizeIterator<Item = GroupPairs<'_>> + Send {
        let placement = &self.placement;
        self.pairs
            .iter_mut()
            .map(move |pairs| GroupPairs { placement, pairs })
    }

    /// Returns the path of a filament relative to the body since the start, in m: the sum of the
    /// steps of its farthest node.
    pub fn path(&self, filament: usize) -> f64 {
        self.placement.path(filament)
    }
}

impl PlacedFilaments {
    /// Moves the nodes of the groups that have `moved` to these positions.
    fn follow(&mut self, positions: &Field, angle: f64, moved: impl Fn(usize) -> bool) {
        self.angle = angle;
        let (sin, cos) = sin_cos(-angle);
        let [sin, cos] = [sin, cos].map(Lanes::from_f64);
        let nodes = self.layout.segments + 1;
        let groups = self
            .positions
            .0
            .chunks_mut(nodes)
            .zip(positions.0.chunks(nodes))
            .zip(&mut self.paths)
            .enumerate();
        let groups = groups.filter(|(group, _)| moved(*group));
        team::for_each(groups, |(_, ((positions, new), path))| {
            wide(
                #[inline(always)]
                || {
                    let mut farthest = Lanes::ZERO;
                    for (position, [x, y, z]) in positions.iter_mut().zip(new) {
                        let new = [cos * *x - sin * *y, sin * *x + cos * *y, *z];
                        let step = sub(new, *position);
                        farthest = farthest.max(dot(step, step));
                        *position = new;
                    }
                    *path = *path + farthest.sqrt();
                },
            );
        });
    }

    fn path(&self, filament: usize) -> f64 {
        self.paths[filament / LANES].lane(filament % LANES)
    }

    /// Returns a filament, moved along `z` by `image` periods.
    fn centreline(&self, filament: usize, image: i16) -> Centreline<'_> {
        let Layout {
            segments, period, ..
        } = self.layout;
        Centreline {
            root: NodeIndex::new(filament, 0, segments),
            nodes: &self.positions.0[filament / LANES * (segments + 1)..][..=segments],
            lane: filament % LANES,
            shift: period.map_or(0.0, |period| f64::from(image) * period),
            radii: &self.layout.radii[filament * segments..][..segments],
        }
    }

    /// Lists the segments of the `other` filament that are near a block of points, where both paths
    /// add up to `path` (m).
    fn list(
        &self,
        [own, other]: &[Centreline<'_>; 2],
        stations: &Stations,
        path: f64,
        block: &mut SegmentList,
    ) {
        let reach = self.layout.largest_reach;
        let near = Lanes::from_f64((reach + self.skin).powi(2));
        block.segments = 0..0;
        let least = wide(
            #[inline(always)]
            || {
                let x = own.points(stations);
                let mut least = Lanes::from_f64(f64::INFINITY);
                for k in 0..self.layout.segments {
                    let squares = other.squares(x, k);
                    least = min(least, squares);
                    if is_any_less(squares, near) {
                        let is_first = block.segments.is_empty();
                        let first = if is_first { k } else { block.segments.start };
                        block.segments = first..k + 1;
                    }
                }
                least
            },
        );
        let least = (0..LANES)
            .map(|lane| least.lane(lane))
            .fold(f64::INFINITY, f64::min);
        block.complete_until = path + self.skin.max(least.sqrt() - reach);
    }

    /// Calls `take` with every point of a block that is nearer than the reach to one of these
    /// segments of the `other` filament.
    fn search(
        &self,
        [own, other]: &[Centreline<'_>; 2],
        (number, stations): (usize, &Stations),
        near_segments: Range<usize>,
        mut take: impl FnMut(Near),
    ) {
        let Layout {
            segments,
            points,
            largest_reach,
            ..
        } = self.layout;
        let (x, squares, nearest) = wide(
            #[inline(always)]
            || {
                let x = own.points(stations);
                let (squares, nearest) = other.nearest(x, near_segments);
                (x, squares, nearest)
            },
        );
        let present = LANES.min(segments * points - number * LANES);
        for lane in (0..present).filter(|lane| squares.lane(*lane) < largest_reach.powi(2)) {
            let (segment, k) = (stations.segments[lane], nearest.lane(lane) as usize);
            let point = FilamentPoint {
                segment: own.root.outwards(segment),
                fraction: stations.fractions.lane(lane),
            };
            let reach = own.radii[segment] + other.radii[k];
            let ends = [other.node(k), other.node(k + 1)];
            let segment = other.root.outwards(k);
            let near = Near::between(point, at_lane(x, lane), segment, ends, reach);
            if near.is_within_reach() {
                take(near);
            }
        }
    }
}

/// Candidate pairs of one group.
pub struct GroupPairs<'a> {
    placement: &'a PlacedFilaments,
    pairs: &'a mut [CandidatePair],
}

impl GroupPairs<'_> {
    /// Calls `take` with every point that is nearer to another filament than the reach, with both
    /// filaments.
    pub fn for_each_near(self, mut take: impl FnMut([usize; 2], &Near)) {
        let Self { placement, pairs } = self;
        let angle = sin_cos(placement.angle);
        for CandidatePair { id, blocks } in pairs {
            let PairId { own, other, image } = *id;
            let path = placement.path(own) + placement.path(other);
            let is_clear =
                |block: &SegmentList| path < block.complete_until && block.segments.is_empty();
            if blocks.iter().all(is_clear) {
                continue;
            }
            let lines = [
                placement.centreline(own, 0),
                placement.centreline(other, image),
            ];
            for (block, stations) in blocks.iter_mut().zip(placement.stations.iter().enumerate()) {
                let is_complete = path < block.complete_until;
                if !is_complete {
                    placement.list(&lines, stations.1, path, block);
                }
                if !block.segments.is_empty() {
                    placement.search(&lines, stations, block.segments.clone(), |near| {
                        let near = near.turned(angle);
                        take([own, other], &Near { image, ..near });
                    });
                }
            }
        }
    }
}

/// Centreline of one filament.
#[derive(Clone, Copy)]
struct Centreline<'a> {
    root: NodeIndex,
    /// Nodes of its group in m.
    nodes: &'a [[Lanes; 3]],
    lane: usize,
    /// Distance along `z` by which it is moved, in m.
    shift: f64,
    /// Radii of its segments in m.
    radii: &'a [f64],
}

impl Centreline<'_> {
    #[inline(always)]
    fn node(&self, k: usize) -> [f64; 3] {
        let [x, y, z] = at_lane(self.nodes[k], self.lane);
        [x, y, z + self.shift]
    }

    /// Returns all nodes, from the root.
    fn all(&self) -> impl Iterator<Item = [f64; 3]> + Clone {
        (0..self.nodes.len()).map(|k| self.node(k))
    }

    /// Returns in each lane the node `steps` outwards from the inner end of one of `segments`.
    #[inline(always)]
    fn nodes(&self, segments: &[usize; LANES], steps: usize) -> [Lanes; 3] {
        let mut nodes: [Lanes; 3] = zero();
        for lane in 0..LANES {
            let [x, y, z] = self.node(segments[lane] + steps);
            nodes[0].0[lane] = x;
            nodes[1].0[lane] = y;
            nodes[2].0[lane] = z;
        }
        nodes
    }

    /// Returns the points of a block in m.
    #[inline(always)]
    fn points(&self, stations: &Stations) -> [Lanes; 3] {
        let inner = self.nodes(&stations.segments, 0);
        let outer = self.nodes(&stations.segments, 1);
        let outer_share = stations.fractions;
        let inner_share = Lanes::from_f64(1.0) - outer_share;
        // As `FilamentPoint::of` computes it.
        add(scale(inner_share, inner), scale(outer_share, outer))
    }

    /// Returns the squares of the distances of points from a segment in m².
    #[inline(always)]
    fn squares(&self, x: [Lanes; 3], segment: usize) -> Lanes {
        let splat =
            |[x, y, z]: [f64; 3]| [Lanes::from_f64(x), Lanes::from_f64(y), Lanes::from_f64(z)];
        let (inner, outer) = (self.node(segment), self.node(segment + 1));
        let along = sub(outer, inner);
        let share = Lanes::from_f64(1.0 / dot(along, along));
        let (along, from) = (splat(along), sub(x, splat(inner)));
        let fraction = min(
            (dot(along, from) * share).max(Lanes::ZERO),
            Lanes::from_f64(1.0),
        );
        let offset = sub(from, scale(fraction, along));
        dot(offset, offset)
    }

    /// Returns the squares of the distances of points from the nearest of some segments in m², and
    /// its number.
    #[inline(always)]
    fn nearest(&self, x: [Lanes; 3], segments: Range<usize>) -> (Lanes, Lanes) {
        let at = |k: usize| Lanes::from_f64(k as f64);
        let (mut least, mut nearest) = (Lanes::from_f64(f64::INFINITY), at(0));
        for k in segments {
            let squares = self.squares(x, k);
            // Numbers of segments are whole, so that this chooses exactly.
            nearest = nearest + squares.less_than(least) * (at(k) - nearest);
            least = min(least, squares);
        }
        (least, nearest)
    }
}

/// Points of a block, as places on a filament. Lanes that are left over repeat the last point.
#[derive(Clone, Copy, Debug)]
struct Stations {
    segments: [usize; LANES],
    fractions: Lanes,
}

impl Stations {
    /// Returns the stations of all blocks.
    fn all(segments: usize, points: usize) -> Vec<Self> {
        let count = segments * points;
        let block = |first: usize| {
            let at = |lane: usize| (first + lane).min(count - 1);
            Self {
                segments: std::array::from_fn(|lane| at(lane) / points),
                fractions: Lanes::from_lanes(|lane| {
                    ((at(lane) % points) as f64 + 0.5) / points as f64
                }),
            }
        };
        (0..count).step_by(LANES).map(block).collect()
    }
}

#[inline(always)]
fn at_lane([x, y, z]: [Lanes; 3], lane: usize) -> [f64; 3] {
    [x.lane(lane), y.lane(lane), z.lane(lane)]
}

#[inline(always)]
fn min(a: Lanes, b: Lanes) -> Lanes {
    -(-a).max(-b)
}

#[inline(always)]
fn is_any_less(a: Lanes, b: Lanes) -> bool {
    (0..LANES).fold(false, |any, lane| any | (a.lane(lane) < b.lane(lane)))
}

/// Bounding volume of a filament and its vicinity: an interval of angles about `z`, and one of `z`.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    filament: usize,
    /// Start of the angles in rad, within a turn.
    start: f64,
    /// Width of the angles in rad; a turn near the axis.
    width: f64,
    /// Interval of `z` in m.
    axial: [f64; 2],
}

impl Bounds {
    /// Widens the angles to a whole turn.
    fn all_around(self) -> Self {
        Self {
            start: 0.0,
            width: TAU,
            ..self
        }
    }

    /// Returns the bounds of a filament. Two filaments can only be nearer to each other than `near`
    /// (m) if their bounds overlap.
    fn of(filament: usize, nodes: impl Iterator<Item = [f64; 3]> + Clone, near: f64) -> Self {
        let axial = nodes.clone().fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[low, high], [_, _, z]| [low.min(z), high.max(z)],
        );
        let mut nodes_around = nodes.clone();
        let [x, y, _] = nodes_around.next().expect("a filament has nodes");
        let (start, mut angle, mut before) = (y.atan2(x), [0.0_f64; 2], [x, y]);
        let (mut turned, mut least) = (0.0, x.hypot(y));
        for [x, y, _] in nodes_around {
            // The axis may be nearest to the inside of a segment.
            let along = [x - before[0], y - before[1]];
            let fraction = -dot(before, along) / dot(along, along);
            let [x_near, y_near] = add(before, scale(fraction.clamp(0.0, 1.0), along));
            least = least.min(x_near.hypot(y_near));
            turned += (before[0] * y - before[1] * x).atan2(before[0] * x + before[1] * y);
            angle = [angle[0].min(turned), angle[1].max(turned)];
            before = [x, y];
        }
        // If two points are nearer than `near`, the sine of the angle between them is below its
        // share of the smaller radius. The NaN of a vertical segment drops out of the minimum.
        let share = near / least;
        let pad = 0.5 * share.asin();
        let bounds = Self {
            filament,
            start: (start + angle[0] - pad).rem_euclid(TAU),
            width: angle[1] - angle[0] + 2.0 * pad,
            axial: [axial[0] - 0.5 * near, axial[1] + 0.5 * near],
        };
        if share < 0.9 && angle[1] - angle[0] < PI {
            bounds
        } else {
            bounds.all_around()
        }
    }

    /// Returns the periodic images of `other` that overlap along `z`. A filament meets its own
    /// images, but not itself.
    fn images(&self, other: &Self, period: Option<f64>) -> impl Iterator<Item = i16> {
        let [first, last] = [
            self.axial[0] - other.axial[1],
            self.axial[1] - other.axial[0],
        ];
        let images = match period {
            Some(period) => (first / period).ceil() as i16..(last / period + 1.0).floor() as i16,
            None => 0..i16::from(first <= 0.0 && last >= 0.0),
        };
        let is_own = self.filament == other.filament;
        images.filter(move |image| !is_own || *image != 0)
    }
}

/// Calls `take` once with each pair whose angles overlap, also of a filament with itself.
fn for_each_close(bounds: &mut [Bounds], mut take: impl FnMut(&Bounds, &Bounds)) {
    bounds.sort_unstable_by(|a, b| a.start.total_cmp(&b.start));
    let count = bounds.len();
    for (index, own) in bounds.iter().enumerate() {
        take(own, own);
        for ahead in 1..count {
            let other = &bounds[(index + ahead) % count];
            let turn = if index + ahead < count { 0.0 } else { TAU };
            let between = other.start + turn - own.start;
            if between > own.width {
                break;
            }
            // Around the circle a pair may be met from both sides.
            let is_met_again = TAU - between <= other.width && other.filament < own.filament;
            if !is_met_again {
                take(own, other);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use fastrand::Rng;

    use super::*;

    const REACH: f64 = 1.2e-3;

    /// Returns a number between −1 and 1.
    fn about_zero(random: &mut Rng) -> f64 {
        2.0 * random.f64() - 1.0
    }

    /// Filaments on a body, by their roots in its frame.
    struct Scene {
        layout: Layout,
        roots: Vec<[f64; 3]>,
        /// Bend and tilt of each, in rad.
        shapes: Vec<[f64; 2]>,
    }

    impl Scene {
        /// Creates two rows of filaments on a body of `radius` (m), `pitch` (m) apart.
        fn new(radius: f64, pitch: f64, segments: usize, period: Option<f64>) -> Self {
            let (filaments, length) = (21, 6.0 * REACH / segments as f64);
            let radii = vec![0.5 * REACH; filaments * segments];
            let root = |filament: usize| {
                let (sin, cos) = sin_cos(pitch / radius * (filament / 2) as f64);
                [radius * cos, radius * sin, pitch * (filament % 2) as f64]
            };
            Self {
                layout: Layout::new(vec![length; filaments], radii, 2, period),
                roots: (0..filaments).map(root).collect(),
                shapes: vec![[0.0; 2]; filaments],
            }
        }

        /// Places the nodes of a filament, bent to a circle, in the frame from which the body has
        /// turned by `angle` (rad).
        fn place(&self, filament: usize, angle: f64, positions: &mut Field) {
            let Layout {
                segments, lengths, ..
            } = &self.layout;
            let (root, [bend, tilt]) = (self.roots[filament], self.shapes[filament]);
            let (sin, cos) = sin_cos(angle);
            let mut position = root;
            for k in 0..=*segments {
                let [x, y, z] = position;
                positions.set(
                    NodeIndex::new(filament, k, *segments),
                    [cos * x - sin * y, sin * x + cos * y, z],
                );
                let around = root[1].atan2(root[0]) + bend * (k as f64 + 0.5) / *segments as f64;
                let direction = [
                    tilt.cos() * around.cos(),
                    tilt.cos() * around.sin(),
                    tilt.sin(),
                ];
                position = add(position, scale(lengths[filament], direction));
            }
        }
    }

    /// Returns all points within reach, in the order of the search.
    fn found(candidates: &mut Candidates) -> Vec<([usize; 2], Near)> {
        let mut found = Vec::new();
        for watched in candidates.by_group() {
            watched.for_each_near(|filaments, near| found.push((filaments, *near)));
        }
        found
    }

    /// Moves a scene at random, and compares the search with the one without bounds. Groups wake
    /// one after the other, move by a little or a lot, and the first one is left out in the end.
    /// Returns the numbers of points within reach, and of lists of pairs that were built.
    fn compare(mut scene: Scene, seed: u64) -> [usize; 2] {
        let mut random = Rng::with_seed(seed);
        let Layout {
            filaments,
            segments,
            ..
        } = scene.layout;
        let [mut bounded, mut exhaustive] =
            [true, false].map(|bounds| Candidates::new(scene.layout.clone(), bounds));
        let mut positions = Field::new(scene.layout.groups(), segments);
        (0..filaments).for_each(|filament| scene.place(filament, 0.0, &mut positions));
        let (mut met, mut built, mut before) = (0, 0, Vec::new());
        for step in 0..100 {
            let angle = 0.02 * f64::from(step);
            let is_awake =
                |group: usize| group < 1 + step as usize / 25 && !(group == 0 && step > 75);
            if step == 76 {
                bounded.leave_out(0);
                exhaustive.leave_out(0);
            }
            // Some groups have not moved relative to the body, as those whose equations are solved.
            let moving: Vec<bool> = (0..scene.layout.groups())
                .map(|group| is_awake(group) && random.u8(..4) > 0)
                .collect();
            let amplitude = random.choice([1e-4, 1e-2, 0.3]).expect("three amplitudes");
            for filament in (0..filaments).filter(|filament| is_awake(filament / LANES)) {
                if moving[filament / LANES] {
                    for angle in &mut scene.shapes[filament] {
                        *angle = (*angle + amplitude * about_zero(&mut random)).clamp(-1.5, 1.5);
                    }
                }
                scene.place(filament, angle, &mut positions);
            }
            for candidates in [&mut bounded, &mut exhaustive] {
                candidates.update(&positions, angle, |group| moving[group]);
            }
            let expected = found(&mut exhaustive);
            assert!(
                found(&mut bounded) == expected,
                "step {step} of seed {seed}"
            );
            met += expected.len();
            built += usize::from(bounded.listed_at != before);
            before.clone_from(&bounded.listed_at);
        }
        [met, built]
    }

    /// Packed and sparse filaments on large and small bodies, of few and many segments, alone and
    /// periodic.
    #[test]
    fn bounds_exclude_no_contact() {
        let mut seed = 0;
        for radius in [2e-3, 0.14] {
            for pitch in [1.05, 1.6, 4.0] {
                for segments in [3, 20] {
                    for period in [None, Some(2.0 * pitch * REACH)] {
                        seed += 1;
                        let scene = Scene::new(radius, pitch * REACH, segments, period);
                        let [met, built] = compare(scene, seed);
                        let is_out_of_reach = pitch > 3.0 && radius > 0.1;
                        assert!(
                            met > 100 || is_out_of_reach,
                            "{radius}, {pitch}, {segments}: {met} within reach"
                        );
                        // On the small body, all filaments are always near each other by their
                        // angles.
                        assert!(
                            (1..150).contains(&built),
                            "{radius}, {pitch}, {segments}: built {built} times"
                        );
                    }
                }
            }
        }
    }

    /// Compares the search without bounds with the definition: for each point, the nearest segment
    /// of each other filament and image.
    #[test]
    fn the_search_without_bounds_follows_the_definition() {
        let mut random = Rng::with_seed(1);
        let period = 2.1 * REACH;
        let mut scene = Scene::new(0.05, 1.05 * REACH, 7, Some(period));
        scene
            .shapes
            .iter_mut()
            .for_each(|shape| *shape = [0, 1].map(|_| 0.8 * about_zero(&mut random)));
        let Layout {
            filaments,
            segments,
            points,
            ..
        } = scene.layout;
        let mut placed = Field::new(scene.layout.groups(), segments);
        (0..filaments).for_each(|filament| scene.place(filament, 0.0, &mut placed));
        let mut expected = Vec::new();
        for (own, other) in
            (0..filaments).flat_map(|own| (0..filaments).map(move |other| (own, other)))
        {
            for (segment, part) in
                (0..segments).flat_map(|k| (0..points).map(move |part| (k, part)))
            {
                let segment = NodeIndex::new(own, segment, segments);
                let point = FilamentPoint {
                    segment,
                    fraction: (part as f64 + 0.5) / points as f64,
                };
                for image in (-5..=5).filter(|image| own != other || *image != 0) {
                    let shift = [0.0, 0.0, f64::from(image) * period];
                    let end = |k: usize| add(placed.at(NodeIndex::new(other, k, segments)), shift);
                    let on = |k: usize| {
                        let (x, ends) = (point.of(&placed), [end(k), end(k + 1)]);
                        Near {
                            image,
                            ..Near::between(
                                point,
                                x,
                                NodeIndex::new(other, k, segments),
                                ends,
                                REACH,
                            )
                        }
                    };
                    let nearest = (0..segments)
                        .map(on)
                        .min_by(|a, b| a.square().total_cmp(&b.square()));
                    let nearest = nearest.expect("segments");
                    if nearest.is_within_reach() {
                        expected.push(([own, other], nearest));
                    }
                }
            }
        }
        let mut candidates = Candidates::new(scene.layout.clone(), false);
        candidates.update(&placed, 0.0, |_| true);
        let mut found = found(&mut candidates);
        for list in [&mut found, &mut expected] {
            list.sort_by(|(a, first), (b, second)| {
                let key = |near: &Near| (near.point.segment, near.nearest.segment);
                let fractions = first.point.fraction.total_cmp(&second.point.fraction);
                let offsets = first.offset[2].total_cmp(&second.offset[2]);
                a.cmp(b)
                    .then(key(first).cmp(&key(second)))
                    .then(fractions)
                    .then(offsets)
            });
        }
        assert!(expected.len() > 100);
        assert_eq!(found, expected);
    }

    #[test]
    fn a_ring_closes() {
        let around = |filament: usize, start: f64, width: f64| Bounds {
            filament,
            start,
            width,
            axial: [0.0; 2],
        };
        let mut pairs = Vec::new();
        let mut bounds = [
            around(0, TAU - 0.1, 0.2),
            around(1, 0.05, 0.15),
            around(2, TAU - 0.15, 0.1),
            around(3, 3.0, 0.1),
        ];
        for_each_close(&mut bounds, |a, b| {
            if a.filament != b.filament {
                pairs.push([a.filament, b.filament]);
            }
        });
        pairs.iter_mut().for_each(|pair| pair.sort_unstable());
        pairs.sort_unstable();
        assert_eq!(pairs, [[0, 1], [0, 2]]);
    }
}
