//! Which points may press on which segments: the broad phase.
//!
//! *Pairs* of filaments are found by how far they reach around the tool axis and along it. A list of them is complete until some node has
//! moved by half a margin, relative to the turning body. A pair *watches* every point of one filament. How far the point is from the other
//! filament is computed again only once both could have moved that way.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::field::{Field, Lane, Node, Place};
use super::presses::Near;
use crate::equations::linear::{dot, sub};
use crate::equations::{LANES, Lanewise, Real, sin_cos};

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
    /// The largest sum of two radii in m.
    pub largest_reach: f64,
    /// After which distance along `z` the filaments repeat, in m, if they do.
    pub period: Option<f64>,
}

impl Layout {
    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.filaments.div_ceil(LANES)
    }

    /// Radius of a segment in m.
    fn radius(&self, filament: usize, segment: usize) -> f64 {
        self.radii[filament * self.segments + segment]
    }
}

/// Half the number of nodes over which a path holds.
const SPREAD: usize = 3;
/// A window holds the segments that are nearer than the reach and this share of it.
const WINDOW: f64 = 0.5;
/// A pair of filaments is listed if they may be nearer than the reach and this multiple of it.
const MARGIN: f64 = 0.8;

/// Points that may press on other filaments.
#[derive(Clone, Debug)]
pub struct Candidates {
    layout: Layout,
    margin: f64,
    /// Pairs by the group of the filament whose points they watch.
    pairs: Vec<Vec<Pair>>,
    motion: Motion,
    /// How far each filament had gone when the list was built, by group. Empty before that.
    built: Vec<Lane>,
}

/// How far nodes have gone relative to the body.
#[derive(Clone, Debug)]
struct Motion {
    /// Where they were last, and the angle of the body.
    positions: Field,
    angle: f64,
    /// The way of each node, or of the farthest among [`SPREAD`] on either side, in m.
    paths: Vec<Lane>,
    /// The way of the farthest node in m, by group.
    farthest: Vec<Lane>,
}

/// The points of one filament, and another filament.
#[derive(Clone, Debug)]
struct Pair {
    own: usize,
    other: usize,
    /// `z` by which the other one is moved, in m.
    shift: f64,
    /// No point is within reach until the ways of both filaments add up to this, in m.
    clear_until: f64,
    /// By point, from the root.
    watches: Vec<Watch>,
}

/// What is known of one point.
#[derive(Clone, Copy, Debug)]
struct Watch {
    /// The segments among which the nearest one is.
    first: u32,
    last: u32,
    /// Until the ways of both filaments add up to this, in m.
    window_until: f64,
    /// It is out of reach until the ways of the point and of these segments add up to this, in m.
    clear_until: f64,
}

impl Watch {
    const UNKNOWN: Self = Self { first: 0, last: 0, window_until: f64::NEG_INFINITY, clear_until: f64::NEG_INFINITY };
}

impl Candidates {
    /// An empty list, which is out of date.
    pub fn new(layout: Layout) -> Self {
        let groups = layout.groups();
        let none = Lane::from_lanes(|_| 0.0);
        let motion = Motion {
            positions: Field::new(groups, layout.segments),
            angle: f64::NAN,
            paths: vec![none; groups * (layout.segments + 1)],
            farthest: vec![none; groups],
        };
        Self {
            margin: MARGIN * layout.largest_reach,
            pairs: vec![Vec::new(); groups],
            motion,
            built: Vec::new(),
            layout,
        }
    }

    /// Forgets everything: what follows does not depend on what was before.
    pub fn forget(&mut self) {
        *self = Self::new(self.layout.clone());
    }

    /// Follows the nodes to `positions`, and builds the list again if filaments may touch that are not in it. The body is at `angle`
    /// (rad). Groups are done in parts of at least `share`.
    pub fn update(&mut self, positions: &Field, angle: f64, share: usize) {
        let is_known = !self.built.is_empty();
        if is_known {
            self.motion.follow(positions, angle, self.layout.segments, share);
        } else {
            self.motion.positions.clone_from(positions);
            self.motion.angle = angle;
        }
        let gone = |now: &Lane, then: &Lane| (0..LANES).all(|lane| now.lane(lane) - then.lane(lane) <= 0.5 * self.margin);
        if !is_known || !self.motion.farthest.iter().zip(&self.built).all(|(now, then)| gone(now, then)) {
            self.build(positions);
            self.built.clone_from(&self.motion.farthest);
        }
    }

    /// Lists the pairs of filaments that may be nearer to each other than the reach and the margin. Keeps what is known of pairs.
    fn build(&mut self, positions: &Field) {
        let Layout { filaments, segments, points, period, .. } = self.layout;
        let near = self.layout.largest_reach + self.margin;
        let bounds: Vec<Bounds> = (0..filaments)
            .map(|filament| Bounds::of((0..=segments).map(|k| positions.at(Node::new(filament, k, segments))), near))
            .collect();
        let mut found: Vec<Vec<(usize, usize, f64)>> = vec![Vec::new(); self.pairs.len()];
        let shifts = period.map_or_else(|| vec![0.0], |period| vec![-period, 0.0, period]);
        for_each_close(&bounds, |a, b| {
            for &shift in &shifts {
                if bounds[a].overlaps(&bounds[b], shift) {
                    found[a / LANES].push((a, b, shift));
                    found[b / LANES].push((b, a, -shift));
                }
            }
        });
        for (pairs, mut found) in self.pairs.iter_mut().zip(found) {
            found.sort_unstable_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
            let mut earlier = std::mem::take(pairs).into_iter().peekable();
            let key = |pair: &Pair| (pair.own, pair.other, pair.shift);
            pairs.extend(found.into_iter().map(|wanted| {
                while earlier.next_if(|pair| key(pair) < wanted).is_some() {}
                earlier.next_if(|pair| key(pair) == wanted).unwrap_or_else(|| Pair {
                    own: wanted.0,
                    other: wanted.1,
                    shift: wanted.2,
                    clear_until: f64::NEG_INFINITY,
                    watches: vec![Watch::UNKNOWN; segments * points],
                })
            }));
        }
    }

    /// The pairs of each group, to be looked at where the nodes were last followed to.
    pub fn by_group(&mut self) -> impl IndexedParallelIterator<Item = Watched<'_>> {
        let Self { layout, motion, pairs, .. } = self;
        let (layout, motion) = (&*layout, &*motion);
        pairs.par_iter_mut().map(move |pairs| Watched { layout, motion, pairs })
    }

    /// How far the nodes of a filament have gone relative to the body since the start, in m: that of the farthest at each time.
    pub fn way(&self, filament: usize) -> f64 {
        self.motion.farthest(filament)
    }

    /// The length of a segment of a filament that a point stands for, in m.
    pub fn length(&self, filament: usize) -> f64 {
        self.layout.lengths[filament] / self.layout.points as f64
    }
}

impl Motion {
    fn follow(&mut self, positions: &Field, angle: f64, segments: usize, share: usize) {
        let (sin, cos) = sin_cos(angle - self.angle);
        self.angle = angle;
        let [sin, cos] = [sin, cos].map(|value| Lane::from_lanes(|_| value));
        let nodes = segments + 1;
        self.positions
            .0
            .par_chunks_mut(nodes)
            .zip(positions.0.par_chunks(nodes))
            .zip(self.paths.par_chunks_mut(nodes))
            .zip(&mut self.farthest)
            .with_min_len(share)
            .for_each(|(((earlier, now), paths), farthest)| {
                let mut ways = [Lane::from_lanes(|_| 0.0); LONGEST];
                let ways = &mut ways[..nodes + 2 * SPREAD];
                let mut most = Lane::from_lanes(|_| 0.0);
                for ((earlier, now), way) in earlier.iter_mut().zip(now).zip(&mut ways[SPREAD..]) {
                    let [x, y, z] = *earlier;
                    let moved = sub(*now, [cos * x - sin * y, sin * x + cos * y, z]);
                    *way = dot(moved, moved).sqrt();
                    most = most.max(*way);
                    *earlier = *now;
                }
                for (k, path) in paths.iter_mut().enumerate() {
                    let way = ways[k..=k + 2 * SPREAD].iter().fold(Lane::from_lanes(|_| 0.0), |most, way| most.max(*way));
                    *path = *path + way;
                }
                *farthest = *farthest + most;
            });
    }

    fn path(&self, node: Node) -> f64 {
        node.of(&self.paths)
    }

    fn farthest(&self, filament: usize) -> f64 {
        self.farthest[filament / LANES].lane(filament % LANES)
    }
}

/// Nodes of the longest filament, with those beyond its ends.
const LONGEST: usize = crate::model::parameters::MAX_SEGMENTS + 1 + 2 * SPREAD;

/// The pairs of one group.
pub struct Watched<'a> {
    layout: &'a Layout,
    motion: &'a Motion,
    pairs: &'a mut [Pair],
}

impl Watched<'_> {
    /// Calls `take` with every point that is nearer to another filament than the reach, with both filaments.
    pub fn for_each_near(self, positions: &Field, mut take: impl FnMut([usize; 2], &Near)) {
        let Self { layout, motion, pairs } = self;
        let Layout { segments, points, .. } = *layout;
        let mut beyond = Vec::with_capacity(segments);
        for Pair { own, other, shift, clear_until, watches } in pairs {
            let total = motion.farthest(*own) + motion.farthest(*other);
            if total < *clear_until {
                continue;
            }
            let line = Line { layout, positions, filament: *other, shift: *shift };
            let mut slack = f64::INFINITY;
            let mut watches = watches.iter_mut();
            for k in 0..segments {
                let segment = Node::new(*own, k, segments);
                let radius = layout.radius(*own, k);
                let own_path = motion.path(segment);
                for part in 0..points {
                    let watch = watches.next().expect("each point has a watch");
                    let middle = (watch.first + watch.last).div_ceil(2) as usize;
                    let path = own_path + motion.path(Node::new(*other, middle, segments));
                    if path < watch.clear_until && total < watch.window_until {
                        slack = slack.min(watch.clear_until - path).min(watch.window_until - total);
                        continue;
                    }
                    let point = Place { segment, fraction: (part as f64 + 0.5) / points as f64 };
                    let x = point.of(positions);
                    if total >= watch.window_until {
                        let outside = line.window(x, radius, watch, &mut beyond);
                        watch.window_until = total + outside;
                    }
                    let nearest = (watch.first..=watch.last)
                        .map(|k| line.nearest_on(point, x, radius, k as usize))
                        .min_by(|a, b| a.square().total_cmp(&b.square()))
                        .expect("a window has a segment");
                    if nearest.square() < nearest.reach * nearest.reach {
                        (watch.clear_until, slack) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
                        take([*own, *other], &nearest);
                        continue;
                    }
                    let middle = (watch.first + watch.last).div_ceil(2) as usize;
                    let path = own_path + motion.path(Node::new(*other, middle, segments));
                    // The path of one node stands for so many on either side.
                    let is_short = (watch.last - watch.first) as usize + 1 < 2 * SPREAD;
                    let clear = if is_short { line.clearance(&nearest, watch, radius) } else { f64::NEG_INFINITY };
                    watch.clear_until = path + clear;
                    slack = slack.min(clear).min(watch.window_until - total);
                }
            }
            *clear_until = total + slack;
        }
    }
}

/// The centreline of one filament.
struct Line<'a> {
    layout: &'a Layout,
    positions: &'a Field,
    filament: usize,
    shift: f64,
}

impl Line<'_> {
    fn node(&self, k: usize) -> [f64; 3] {
        let [x, y, z] = self.positions.at(Node::new(self.filament, k, self.layout.segments));
        [x, y, z + self.shift]
    }

    fn nearest_on(&self, point: Place, x: [f64; 3], radius: f64, k: usize) -> Near {
        let segment = Node::new(self.filament, k, self.layout.segments);
        let reach = radius + self.layout.radius(self.filament, k);
        Near::between(point, x, segment, [self.node(k), self.node(k + 1)], reach)
    }

    /// How far a point is out of reach of the segments of a window in m, of which `nearest` is the nearest.
    fn clearance(&self, nearest: &Near, watch: &Watch, radius: f64) -> f64 {
        let thickest = (watch.first..=watch.last)
            .map(|k| self.layout.radius(self.filament, k as usize))
            .fold(0.0_f64, f64::max);
        nearest.square().sqrt() - (radius + thickest)
    }

    /// Finds the window of segments for a point at `x` (m): all that are nearer than the reach and a share of it, and the nearest one,
    /// with one more on either side, which holds longer. Returns how far the point is out of reach of all others in m.
    fn window(&self, x: [f64; 3], radius: f64, watch: &mut Watch, beyond: &mut Vec<f64>) -> f64 {
        let segments = self.layout.segments;
        let length = self.layout.lengths[self.filament];
        let reach = |k: usize| radius + self.layout.radius(self.filament, k);
        let point = Place { segment: Node::new(self.filament, 0, segments), fraction: 0.0 };
        let largest = (1.0 + WINDOW) * self.layout.largest_reach;
        beyond.clear();
        while beyond.len() < segments {
            let k = beyond.len();
            let distance = self.nearest_on(point, x, radius, k).square().sqrt();
            beyond.push(distance - reach(k));
            // The next segments cannot be nearer than this one by more than the way there.
            let far = ((distance - largest) / length) as usize;
            for step in 1..=far.min(segments - 1 - k) {
                beyond.push(distance - step as f64 * length - reach(k + step));
            }
        }
        let nearest = (0..segments).min_by(|a, b| beyond[*a].total_cmp(&beyond[*b])).expect("a filament has segments");
        let is_near = |k: &usize| beyond[*k] < WINDOW * reach(*k) || *k == nearest;
        let first = (0..segments).find(is_near).unwrap_or(nearest).saturating_sub(1);
        let last = ((0..segments).rfind(is_near).unwrap_or(nearest) + 1).min(segments - 1);
        (watch.first, watch.last) = (first as u32, last as u32);
        let outside = beyond[..first].iter().chain(&beyond[last + 1..]);
        outside.fold(f64::INFINITY, |least, beyond| least.min(*beyond))
    }
}

/// How far a filament reaches, and what is near it: angles about `z`, and `z` itself.
#[derive(Clone, Copy, Debug)]
struct Bounds {
    /// In rad, from below `π`; the whole circle near the axis.
    angles: [f64; 2],
    /// In m.
    axial: [f64; 2],
}

impl Bounds {
    /// Two filaments can only be nearer to each other than `near` (m) if their bounds overlap.
    fn of(nodes: impl Iterator<Item = [f64; 3]> + Clone, near: f64) -> Self {
        let axial = nodes.clone().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], [_, _, z]| [low.min(z), high.max(z)]);
        let axial = [axial[0] - 0.5 * near, axial[1] + 0.5 * near];
        let mut nodes_around = nodes.clone();
        let [x, y, _] = nodes_around.next().expect("a filament has nodes");
        let (start, mut angle, mut before) = (y.atan2(x), [0.0_f64; 2], [x, y]);
        let (mut turned, mut least) = (0.0, x.hypot(y));
        for [x, y, _] in nodes_around {
            // The axis may be nearest to the inside of a segment.
            let along = [x - before[0], y - before[1]];
            let fraction = -(before[0] * along[0] + before[1] * along[1]) / (along[0].powi(2) + along[1].powi(2));
            let fraction = fraction.clamp(0.0, 1.0);
            least = least.min((before[0] + fraction * along[0]).hypot(before[1] + fraction * along[1]));
            turned += (before[0] * y - before[1] * x).atan2(before[0] * x + before[1] * y);
            (angle[0], angle[1]) = (angle[0].min(turned), angle[1].max(turned));
            before = [x, y];
        }
        // Where two points are nearer than this, the sine of the angle between them is less than its share of the smaller radius.
        // Not a number, where a vertical filament stands, has no finite comparison.
        let share = near / least;
        if !(share < 0.9 && angle[1] - angle[0] < std::f64::consts::PI) {
            return Self { angles: [0.0, TAU], axial };
        }
        let pad = 0.5 * share.asin();
        Self { angles: [start + angle[0] - pad, start + angle[1] + pad], axial }
    }

    /// Whether they overlap along `z`, with the other one moved by `shift` (m).
    fn overlaps(&self, other: &Self, shift: f64) -> bool {
        self.axial[0] <= other.axial[1] + shift && other.axial[0] + shift <= self.axial[1]
    }
}

/// Calls `take` once with all pairs whose angles overlap.
fn for_each_close(bounds: &[Bounds], mut take: impl FnMut(usize, usize)) {
    /// Where one interval begins within a turn.
    struct Start {
        angle: f64,
        width: f64,
        filament: usize,
    }
    let mut starts: Vec<Start> = bounds
        .iter()
        .enumerate()
        .map(|(filament, Bounds { angles: [from, to], .. })| {
            let width = to - from;
            Start { angle: from.rem_euclid(TAU), width: if width < TAU { width } else { TAU }, filament }
        })
        .collect();
    starts.sort_by(|a, b| a.angle.total_cmp(&b.angle));
    let count = starts.len();
    for (index, start) in starts.iter().enumerate() {
        for ahead in 1..count {
            let other = &starts[(index + ahead) % count];
            let turn = if index + ahead < count { 0.0 } else { TAU };
            let between = other.angle + turn - start.angle;
            if between > start.width {
                break;
            }
            // Around the circle a pair may be met from both sides.
            let is_met_again = TAU - between <= other.width && other.filament < start.filament;
            if !is_met_again {
                take(start.filament, other.filament);
            }
        }
    }
}
