//! Which points may press on which segments: the broad phase.
//!
//! *Pairs* of filaments are found by how far they reach around the tool axis and along it. A list of them is complete until some node has
//! moved by half a margin, relative to the turning body. A pair *watches* the points of one filament, in blocks of one per lane: how far they
//! are from the other filament is computed again only once both could have moved that way. For each point it knows a window of segments
//! of the other filament, outside which there is nothing near.

use std::f64::consts::TAU;

use rayon::prelude::*;

use super::field::{Field, Lane, Node, Place};
use super::presses::Near;
use crate::equations::dispatch::{Loop, dispatch};
use crate::equations::linear::{dot, scale, sub};
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

    /// The length of a segment of a filament that a point stands for, in m.
    pub fn part_length(&self, filament: usize) -> f64 {
        self.lengths[filament] / self.points as f64
    }

    /// Number of segments in a window: what lies within the reach on either side of the nearest one, or the whole filament.
    fn width(&self) -> usize {
        let shortest = self.lengths.iter().fold(f64::INFINITY, |shortest, length| shortest.min(*length));
        let side = (1.2 * self.largest_reach / shortest).ceil() as usize;
        (2 * side + 1).min(self.segments)
    }

    /// Radius of a segment in m.
    fn radius(&self, filament: usize, segment: usize) -> f64 {
        self.radii[filament * self.segments + segment]
    }
}

/// Half the number of nodes over which a path holds.
const SPREAD: usize = 6;
/// A pair of filaments is listed if they may be nearer than the reach and this multiple of it.
const MARGIN: f64 = 0.3;

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
    blocks: Vec<Block>,
}

/// What is known of the points of a block.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// The first segments of the windows.
    first: [u16; LANES],
    /// No point of the block is within reach of its window until the ways there add up to this, in m.
    clear_until: f64,
    /// Nothing is within reach next to the windows until the ways there add up to this, in m.
    next_until: f64,
    /// Nothing is within reach anywhere else until the ways of both filaments add up to this, in m.
    else_until: f64,
}

impl Block {
    const UNKNOWN: Self = Self {
        first: [0; LANES],
        clear_until: f64::NEG_INFINITY,
        next_until: f64::NEG_INFINITY,
        else_until: f64::NEG_INFINITY,
    };
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
        let gone =
            |now: &Lane, then: &Lane| (0..LANES).all(|lane| now.lane(lane) - then.lane(lane) <= 0.5 * self.margin);
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
                    blocks: vec![Block::UNKNOWN; (segments * points).div_ceil(LANES)],
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
                    let way =
                        ways[k..=k + 2 * SPREAD].iter().fold(Lane::from_lanes(|_| 0.0), |most, way| most.max(*way));
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
        let count = segments * points;
        let width = layout.width();
        let (mut line, mut own_line, mut beyond) = (Line::default(), Line::default(), Vec::new());
        let mut own_of_line = usize::MAX;
        for Pair { own, other, shift, clear_until, blocks } in pairs {
            let total = motion.farthest(*own) + motion.farthest(*other);
            if total < *clear_until {
                continue;
            }
            line.fill(layout, positions, *other, *shift);
            if own_of_line != *own {
                own_line.fill(layout, positions, *own, 0.0);
                own_of_line = *own;
            }
            let mut slack = f64::INFINITY;
            for (number, block) in blocks.iter_mut().enumerate() {
                let first = number * LANES;
                let at = |lane: usize| (first + lane).min(count - 1);
                let middle = (at(0) / points + at(LANES - 1) / points) / 2;
                let own_path = motion.path(Node::new(*own, middle, segments));
                let path = |block: &Block| own_path + motion.path(Node::new(*other, block.middle(width), segments));
                let mut way = path(block);
                let in_windows = way < block.next_until && total < block.else_until;
                if in_windows && way < block.clear_until {
                    slack = slack.min(block.slack(way, total));
                    continue;
                }
                let x = own_line.points(at, points);
                let radius = Lane::from_lanes(|lane| own_line.radii[at(lane) / points]);
                if !in_windows {
                    dispatch(Scan { x, radius, line: &line, beyond: &mut beyond });
                    block.choose(&beyond, width);
                    way = path(block);
                    let [next, others] = block.outside(&beyond, width, at(LANES - 1) / points - at(0) / points);
                    (block.next_until, block.else_until) = (way + next, total + others);
                }
                let nearest = dispatch(Windows { x, radius, line: &line, first: &block.first, width });
                let clear = (0..LANES).map(|lane| nearest.lane(lane)).fold(f64::INFINITY, f64::min);
                if clear >= 0.0 {
                    block.clear_until = way + clear;
                    slack = slack.min(block.slack(way, total));
                    continue;
                }
                (block.clear_until, slack) = (f64::NEG_INFINITY, f64::NEG_INFINITY);
                for lane in (0..LANES).filter(|lane| first + lane < count && nearest.lane(*lane) < 0.0) {
                    let index = first + lane;
                    let fraction = ((index % points) as f64 + 0.5) / points as f64;
                    let point = Place { segment: Node::new(*own, index / points, segments), fraction };
                    let from = block.first[lane] as usize;
                    let near = (from..from + width)
                        .map(|k| {
                            let segment = Node::new(*other, k, segments);
                            let reach = radius.lane(lane) + line.radii[k];
                            Near::between(
                                point,
                                x.map(|x| x.lane(lane)),
                                segment,
                                [line.node(k), line.node(k + 1)],
                                reach,
                            )
                        })
                        .min_by(|a, b| a.square().total_cmp(&b.square()))
                        .expect("a window has a segment");
                    if near.square() < near.reach * near.reach {
                        take([*own, *other], &near);
                    }
                }
            }
            *clear_until = total + slack;
        }
    }
}

impl Block {
    /// The node in the middle of all windows.
    fn middle(&self, width: usize) -> usize {
        (self.first[0] as usize + self.first[LANES - 1] as usize + width) / 2
    }

    /// How far filaments can go before this block must be looked at again, in m.
    fn slack(&self, way: f64, total: f64) -> f64 {
        (self.clear_until.min(self.next_until) - way).min(self.else_until - total)
    }

    /// Chooses the windows: `width` segments with the nearest one in the middle. `beyond` is how far each is out of reach in m.
    fn choose(&mut self, beyond: &[Lane], width: usize) {
        let (mut least, mut nearest) = (Lane::from_lanes(|_| f64::INFINITY), [0_u16; LANES]);
        for (k, beyond) in beyond.iter().enumerate() {
            for lane in 0..LANES {
                if beyond.lane(lane) < least.lane(lane) {
                    least.set_lane(lane, beyond.lane(lane));
                    nearest[lane] = k as u16;
                }
            }
        }
        self.first = nearest.map(|k| k.saturating_sub((width / 2) as u16).min((beyond.len() - width) as u16));
    }

    /// How far the segments outside the windows are out of reach in m: those for which the path of the middle holds, and all others.
    fn outside(&self, beyond: &[Lane], width: usize, own_spread: usize) -> [f64; 2] {
        let middle = self.middle(width);
        let mut outside = [f64::INFINITY; 2];
        for (k, beyond) in beyond.iter().enumerate() {
            // The path of a node holds for so many on either side, and a segment has two.
            let is_next = own_spread < 2 * SPREAD && k + SPREAD >= middle && k < middle + SPREAD;
            let least = &mut outside[usize::from(!is_next)];
            for lane in 0..LANES {
                let from = self.first[lane] as usize;
                if !(from..from + width).contains(&k) || !is_next {
                    *least = least.min(beyond.lane(lane));
                }
            }
        }
        outside
    }
}

/// The centreline of one filament.
#[derive(Debug, Default)]
struct Line {
    /// Components of the nodes in m.
    nodes: [Vec<f64>; 3],
    /// Radii of the segments in m.
    radii: Vec<f64>,
}

impl Line {
    fn fill(&mut self, layout: &Layout, positions: &Field, filament: usize, shift: f64) {
        self.nodes.iter_mut().for_each(Vec::clear);
        for k in 0..=layout.segments {
            let [x, y, z] = positions.at(Node::new(filament, k, layout.segments));
            for (values, value) in self.nodes.iter_mut().zip([x, y, z + shift]) {
                values.push(value);
            }
        }
        self.radii.clear();
        self.radii.extend((0..layout.segments).map(|k| layout.radius(filament, k)));
    }

    fn node(&self, k: usize) -> [f64; 3] {
        [0, 1, 2].map(|i| self.nodes[i][k])
    }

    /// The points of a block, by their numbers.
    fn points(&self, number: impl Fn(usize) -> usize, points: usize) -> [Lane; 3] {
        let fraction = |lane: usize| ((number(lane) % points) as f64 + 0.5) / points as f64;
        [0, 1, 2].map(|i| {
            Lane::from_lanes(|lane| {
                let k = number(lane) / points;
                // As `Place::of` computes it.
                (1.0 - fraction(lane)) * self.nodes[i][k] + fraction(lane) * self.nodes[i][k + 1]
            })
        })
    }
}

/// How far the points of a block are out of reach of each segment.
struct Scan<'a> {
    x: [Lane; 3],
    radius: Lane,
    line: &'a Line,
    beyond: &'a mut Vec<Lane>,
}

impl Loop for Scan<'_> {
    type Output = ();

    const LANES: usize = LANES;

    #[inline(always)]
    fn run(self) {
        let Self { x, radius, line, beyond } = self;
        beyond.clear();
        for k in 0..line.radii.len() {
            let end = |k: usize| [0, 1, 2].map(|i| Lane::from_f64(line.nodes[i][k]));
            beyond.push(distance(x, end(k), end(k + 1)) - (radius + Lane::from_f64(line.radii[k])));
        }
    }
}

/// How far the points of a block are out of reach of the segments of their windows.
struct Windows<'a> {
    x: [Lane; 3],
    radius: Lane,
    line: &'a Line,
    first: &'a [u16; LANES],
    width: usize,
}

impl Loop for Windows<'_> {
    type Output = Lane;

    const LANES: usize = LANES;

    #[inline(always)]
    fn run(self) -> Lane {
        let Self { x, radius, line, first, width } = self;
        let mut nearest = Lane::from_f64(f64::INFINITY);
        let end = |step: usize| [0, 1, 2].map(|i| Lane::from_lanes(|lane| line.nodes[i][first[lane] as usize + step]));
        let mut inner = end(0);
        for step in 0..width {
            let outer = end(step + 1);
            let radii = Lane::from_lanes(|lane| line.radii[first[lane] as usize + step]);
            nearest = -(-nearest).max(-(distance(x, inner, outer) - (radius + radii)));
            inner = outer;
        }
        nearest
    }
}

/// The distance of a point from a segment with the given ends.
#[inline(always)]
fn distance(x: [Lane; 3], inner: [Lane; 3], outer: [Lane; 3]) -> Lane {
    let (along, from) = (sub(outer, inner), sub(x, inner));
    let at = dot(along, from) / dot(along, along);
    let (none, all) = (Lane::from_f64(0.0), Lane::from_f64(1.0));
    let fraction = -(-at.max(none)).max(-all);
    let offset = sub(from, scale(fraction, along));
    dot(offset, offset).sqrt()
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
        let axial =
            nodes.clone().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], [_, _, z]| [low.min(z), high.max(z)]);
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::linear::add;

    /// A number between -1 and 1 that depends on `seed` alone.
    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    const REACH: f64 = 1.2e-3;

    /// Filaments whose roots are at `root` on a body that turns, and that tremble. Returns how many points were near, and how often the
    /// list was built.
    fn compare(root: impl Fn(usize) -> [f64; 3], outwards: [f64; 3], period: Option<f64>) -> [usize; 2] {
        let (filaments, segments, points, length) = (12, 6, 2, 2e-3);
        let layout = Layout {
            filaments,
            segments,
            points,
            lengths: vec![length; filaments],
            radii: vec![0.5 * REACH; filaments * segments],
            largest_reach: REACH,
            period,
        };
        let mut seed = 7;
        let mut nodes = Vec::new();
        for filament in 0..filaments {
            let mut position = root(filament);
            nodes.push((Node::new(filament, 0, segments), position));
            for k in 1..=segments {
                let aside = [0, 1, 2].map(|i| if outwards[i] == 0.0 { 0.7 * random(&mut seed) } else { outwards[i] });
                position = add(position, scale(length / dot(aside, aside).sqrt(), aside));
                nodes.push((Node::new(filament, k, segments), position));
            }
        }
        let shifts = period.map_or_else(|| vec![0.0], |period| vec![-period, 0.0, period]);
        let mut candidates = Candidates::new(layout.clone());
        let (mut met, mut built) = (0, 0);
        for step in 0..40 {
            let angle = 0.01 * f64::from(step);
            let (sin, cos) = sin_cos(angle);
            let mut placed = Field::new(layout.groups(), segments);
            for &(node, position) in &nodes {
                let tremble = scale(2e-5, [random(&mut seed), random(&mut seed), random(&mut seed)]);
                let [x, y, z] = add(position, tremble);
                placed.set(node, [cos * x - sin * y, sin * x + cos * y, z]);
            }
            let before = candidates.built.clone();
            candidates.update(&placed, angle, 1);
            built += usize::from(candidates.built != before);
            let found = candidates.by_group().map(|watched| {
                let mut near_ones = Vec::new();
                watched.for_each_near(&placed, |filaments, near| near_ones.push((filaments, *near)));
                near_ones
            });
            let mut found: Vec<([usize; 2], Near)> = found.flatten().collect();
            let mut expected = Vec::new();
            for filament in 0..filaments {
                for segment in (0..segments).map(|k| Node::new(filament, k, segments)) {
                    for part in 0..points {
                        let point = Place { segment, fraction: (part as f64 + 0.5) / points as f64 };
                        for other in (0..filaments).filter(|other| *other != filament) {
                            for &shift in &shifts {
                                let end = |k: usize| add(placed.at(Node::new(other, k, segments)), [0.0, 0.0, shift]);
                                let x = point.of(&placed);
                                let on = |k: usize| {
                                    Near::between(point, x, Node::new(other, k, segments), [end(k), end(k + 1)], REACH)
                                };
                                let all = (0..segments).map(on);
                                let nearest = all.min_by(|a, b| a.square().total_cmp(&b.square())).expect("segments");
                                if nearest.square() < REACH * REACH {
                                    expected.push(([filament, other], nearest));
                                }
                            }
                        }
                    }
                }
            }
            for list in [&mut found, &mut expected] {
                list.sort_by(|(a, first), (b, second)| {
                    let key = |near: &Near| (near.point.segment, near.nearest.segment);
                    let fractions = first.point.fraction.total_cmp(&second.point.fraction);
                    a.cmp(b).then(key(first).cmp(&key(second))).then(fractions)
                });
            }
            assert_eq!(found, expected);
            met += found.len();
        }
        [met, built]
    }

    #[test]
    fn the_list_finds_what_a_search_over_all_pairs_finds() {
        let mut seed = 3;
        let heights: Vec<f64> = (0..12).map(|_| 1e-3 * random(&mut seed)).collect();
        // So near the axis that angles do not tell filaments apart; then on a body, in two rows that repeat.
        let [met, built] =
            compare(|filament| [1.3e-3 * filament as f64, 0.0, heights[filament]], [0.0, 1.0, 0.0], None);
        assert!(met > 1000 && (1..20).contains(&built), "{met} near, built {built} times");
        let on_body = |filament: usize| {
            let (sin, cos) = sin_cos(1.3e-3 / 0.14 * (filament / 2) as f64);
            [0.14 * cos, 0.14 * sin, 1.3e-3 * (filament % 2) as f64]
        };
        let [met, built] = compare(on_body, [1.0, 0.0, 0.0], Some(2.6e-3));
        assert!(met > 1000 && (1..20).contains(&built), "{met} near, built {built} times");
    }

    #[test]
    fn a_ring_closes() {
        let around = |angles: [f64; 2]| Bounds { angles, axial: [0.0; 2] };
        let mut pairs = Vec::new();
        let bounds = [around([-0.1, 0.1]), around([0.05, 0.2]), around([TAU - 0.15, TAU - 0.05]), around([3.0, 3.1])];
        for_each_close(&bounds, |a, b| pairs.push([a.min(b), a.max(b)]));
        pairs.sort_unstable();
        assert_eq!(pairs, [[0, 1], [0, 2]]);
    }
}
