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

mod bounds;
mod centreline;
#[cfg(test)]
mod tests;

use std::ops::Range;

use super::field::{Field, FilamentPoint, NodeIndex, wide};
use super::presses::Near;
use super::team;
use crate::equations::linear::{dot, sub};
use crate::equations::{LANES, Lanes, Lanewise, Real, sin_cos};
use bounds::{Bounds, for_each_close};
use centreline::{Centreline, Stations, at_lane, is_any_less, min};

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
