//! Which points may press on which segments: the broad phase.
//!
//! *Pairs* of filaments are found by how far they reach around the tool axis and along it. A list of them is complete until some node has
//! moved by half a margin, relative to the turning body. A pair *watches* the points of one filament, in blocks of one per lane: how far they
//! are from the other filament is computed again only once both could have moved that way. For each block it knows a window of segments
//! of the other filament, outside which there is nothing near. Blocks that are near, or nearly so, are listed: as long as nodes have
//! hardly moved since, as between the iterations of a stage, no others are looked at.

use std::f64::consts::TAU;
use std::ops::Range;

use super::field::{Field, FilamentPoint, Node, wide};
use super::presses::Near;
use super::team;
use crate::equations::dispatch::{Loop, dispatch};
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
    /// The largest sum of two radii in m.
    pub largest_reach: f64,
    /// After which distance along `z` the filaments repeat, in m, if they do.
    pub period: Option<f64>,
}

impl Layout {
    /// With these lengths and radii, as in the fields.
    pub fn new(lengths: Vec<f64>, radii: Vec<f64>, points: usize, period: Option<f64>) -> Self {
        let largest_reach = 2.0 * radii.iter().fold(0.0_f64, |largest, radius| largest.max(*radius));
        let (filaments, segments) = (lengths.len(), radii.len() / lengths.len());
        Self { filaments, segments, points, lengths, radii, largest_reach, period }
    }

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.filaments.div_ceil(LANES)
    }

    /// The length of a segment of a filament that a point stands for, in m.
    pub fn part_length(&self, filament: usize) -> f64 {
        self.lengths[filament] / self.points as f64
    }

    /// Number of segments in a window on either side of those that are nearest: what lies within the reach.
    fn side(&self) -> usize {
        let shortest = self.lengths.iter().fold(f64::INFINITY, |shortest, length| shortest.min(*length));
        (1.2 * self.largest_reach / shortest).ceil() as usize
    }
}

/// Half the number of nodes over which a path holds.
const SPREAD: usize = 6;
/// A pair of filaments is listed if they may be nearer than the reach and this multiple of it.
const MARGIN: f64 = 1.0;
/// A block is listed if it may be nearer than the reach and this multiple of it.
const RESERVE: f64 = 0.03;

/// Points that may press on other filaments.
#[derive(Clone, Debug)]
pub struct Candidates {
    layout: Layout,
    margin: f64,
    /// See [`Layout::side`].
    side: usize,
    /// The points of each block.
    stations: Vec<Stations>,
    /// Pairs by the group of the filament whose points they watch.
    pairs: Vec<Vec<Pair>>,
    motion: Ways,
    /// Where the nodes are, filament by filament.
    nodes: Vec<[f64; 3]>,
    /// Which groups nothing touches.
    left_out: Vec<bool>,
    /// Which groups are not looked at: they turn with the body.
    asleep: Vec<bool>,
    /// Scratch: the groups of which a filament may be near one that does not sleep.
    beside: Vec<bool>,
    /// Sleeping filaments that others may come near, by the group of the latter.
    wanted: Vec<Vec<usize>>,
    /// How far each filament had gone when the list was built, by group. Empty before that.
    built: Vec<Lanes>,
    search: Search,
    /// The blocks that points may be near in, by group: the numbers of the pair, and of the block.
    listed: Vec<Vec<[u32; 2]>>,
    /// How far nodes may have moved since these were listed, in m.
    drift: f64,
}

/// Memory of the search for pairs.
#[derive(Clone, Debug, Default)]
struct Search {
    bounds: Vec<Bounds>,
    /// The angle of the body then in rad.
    angle: f64,
    starts: Vec<Start>,
    /// The pairs that were found, by group: both filaments, and by how much the other is moved.
    found: Vec<Vec<(usize, usize, f64)>>,
    /// The earlier list of a group.
    earlier: Vec<Pair>,
    /// Blocks of pairs that are no longer listed.
    unused: Vec<Vec<Block>>,
}

/// Where the angles of a filament begin within a turn.
#[derive(Clone, Copy, Debug)]
struct Start {
    angle: f64,
    width: f64,
    filament: usize,
}

/// How far nodes have gone relative to the body.
#[derive(Clone, Debug)]
struct Ways {
    /// Where they were last, and the angle of the body then, by group.
    positions: Field,
    angles: Vec<f64>,
    /// The way of each node, or of the farthest among [`SPREAD`] on either side, in m.
    paths: Vec<Lanes>,
    /// Scratch: the last ways of the nodes of each group, with [`SPREAD`] beyond either end.
    ways: Vec<Lanes>,
    /// The way of the farthest node in m, by group.
    farthest: Vec<Lanes>,
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
    /// The window: the first segment, and that behind the last.
    window: [u16; 2],
    /// No point of the block is within reach of the window until the ways there add up to this, in m.
    clear_until: f64,
    /// Nothing is within reach next to the window until the ways there add up to this, in m.
    next_until: f64,
    /// Nothing is within reach anywhere else until the ways of both filaments add up to this, in m.
    else_until: f64,
}

impl Block {
    const UNKNOWN: Self = Self {
        window: [0; 2],
        clear_until: f64::NEG_INFINITY,
        next_until: f64::NEG_INFINITY,
        else_until: f64::NEG_INFINITY,
    };
}

impl Candidates {
    /// An empty list, which is out of date.
    pub fn new(layout: Layout) -> Self {
        let groups = layout.groups();
        let none = Lanes::ZERO;
        let motion = Ways {
            positions: Field::new(groups, layout.segments),
            angles: vec![f64::NAN; groups],
            paths: vec![none; groups * (layout.segments + 1)],
            ways: vec![none; groups * (layout.segments + 1 + 2 * SPREAD)],
            farthest: vec![none; groups],
        };
        Self {
            nodes: vec![[0.0; 3]; groups * LANES * (layout.segments + 1)],
            margin: MARGIN * layout.largest_reach,
            side: layout.side(),
            stations: Stations::all(layout.segments, layout.points),
            pairs: vec![Vec::new(); groups],
            motion,
            left_out: vec![false; groups],
            asleep: vec![false; groups],
            beside: vec![false; groups],
            wanted: vec![Vec::new(); groups],
            built: Vec::new(),
            listed: vec![Vec::new(); groups],
            drift: f64::INFINITY,
            search: Search { found: vec![Vec::new(); groups], ..Search::default() },
            layout,
        }
    }

    /// Puts the nodes to `positions`, where the body is at `angle` (rad). Groups that have not `moved` since the last time are where they
    /// were; those that sleep have turned with the body.
    ///
    /// Unless what is listed [holds](Self::is_listed), follows how far nodes have gone, and builds the list of pairs again if filaments may
    /// touch that are not in it. Groups that sleep are put where they are then, too.
    pub fn update(&mut self, positions: &mut Field, angle: f64, moved: impl Fn(usize) -> bool) {
        let is_listed = self.is_listed();
        let Self { motion, layout, asleep, nodes, .. } = self;
        let moved = |group: usize| !asleep[group] && moved(group);
        let segments = layout.segments;
        copy_filaments(positions, segments, moved, nodes);
        if is_listed {
            return;
        }
        let is_known = !self.built.is_empty();
        if is_known {
            motion.follow(positions, angle, segments, moved);
        } else {
            motion.positions.clone_from(positions);
            motion.angles.fill(angle);
        }
        // Of those that sleep, the places are needed of those that may be near one that does not.
        self.beside.fill(false);
        let awake = self.pairs.iter().zip(&self.asleep).filter(|(_, asleep)| !**asleep);
        awake.flat_map(|(pairs, _)| pairs).for_each(|pair| self.beside[pair.other / LANES] = true);
        let is_beside = |group: usize| self.asleep[group] && self.beside[group] && !self.left_out[group];
        for group in (0..self.asleep.len()).filter(|group| is_beside(*group)) {
            self.motion.turn(positions, angle, segments, group);
        }
        copy_filaments(positions, segments, is_beside, &mut self.nodes);
        let gone =
            |now: &Lanes, then: &Lanes| (0..LANES).all(|lane| now.lane(lane) - then.lane(lane) <= 0.5 * self.margin);
        if !is_known || !self.motion.farthest.iter().zip(&self.built).all(|(now, then)| gone(now, then)) {
            self.build(positions, angle);
            self.built.clone_from(&self.motion.farthest);
        }
    }

    /// Lists the pairs of filaments that may be nearer to each other than the reach and the margin. Keeps what is known of pairs.
    fn build(&mut self, positions: &Field, angle: f64) {
        let Self { layout, margin, stations, pairs: lists, left_out, asleep, search, .. } = self;
        let Layout { filaments, segments, period, .. } = *layout;
        let Search { bounds, angle: earlier_angle, starts, found, earlier, unused } = search;
        let near = layout.largest_reach + *margin;
        bounds.resize(filaments, Bounds::NOWHERE);
        for (filament, bounds) in bounds.iter_mut().enumerate() {
            let group = filament / LANES;
            *bounds = if left_out[group] {
                Bounds::NOWHERE
            } else if asleep[group] {
                bounds.turned(angle - *earlier_angle)
            } else {
                Bounds::of((0..=segments).map(|k| positions.at(Node::new(filament, k, segments))), near)
            };
        }
        *earlier_angle = angle;
        found.iter_mut().for_each(Vec::clear);
        let around = period.map(|period| [-period, 0.0, period]);
        let shifts = around.as_ref().map_or(&[0.0][..], |shifts| &shifts[..]);
        for_each_close(bounds, starts, |a, b| {
            for &shift in shifts {
                if bounds[a].overlaps(&bounds[b], shift) {
                    found[a / LANES].push((a, b, shift));
                    found[b / LANES].push((b, a, -shift));
                }
            }
        });
        for (pairs, found) in lists.iter_mut().zip(found) {
            found.sort_unstable_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.total_cmp(&b.2)));
            std::mem::swap(pairs, earlier);
            let mut known = earlier.drain(..).peekable();
            let key = |pair: &Pair| (pair.own, pair.other, pair.shift);
            for &wanted in &*found {
                while let Some(pair) = known.next_if(|pair| key(pair) < wanted) {
                    unused.push(pair.blocks);
                }
                pairs.push(known.next_if(|pair| key(pair) == wanted).unwrap_or_else(|| {
                    let mut blocks = unused.pop().unwrap_or_default();
                    blocks.clear();
                    blocks.resize(stations.len(), Block::UNKNOWN);
                    let (own, other, shift) = wanted;
                    Pair { own, other, shift, clear_until: f64::NEG_INFINITY, blocks }
                }));
            }
            unused.extend(known.map(|pair| pair.blocks));
        }
    }

    /// Nodes may have moved by `distance` (m) since the last time.
    pub fn drift(&mut self, distance: f64) {
        self.drift += distance;
    }

    /// Whether what is listed holds where the nodes are now.
    pub fn is_listed(&self) -> bool {
        2.0 * self.drift <= RESERVE * self.layout.largest_reach
    }

    /// Whether a group is not looked at.
    pub fn is_asleep(&self, group: usize) -> bool {
        self.asleep[group]
    }

    /// Sets whether a group is not looked at. While it is not, it turns with the body.
    pub fn set_asleep(&mut self, group: usize, is_asleep: bool) {
        self.drift = f64::INFINITY;
        self.asleep[group] = is_asleep;
    }

    /// Whether a group sleeps although other filaments may come near.
    pub fn is_any_wanted(&self) -> bool {
        self.wanted.iter().any(|filaments| !filaments.is_empty())
    }

    /// Wakes the groups that sleep although other filaments may come near. Returns whether there are any.
    pub fn wake_wanted(&mut self) -> bool {
        let is_any = self.is_any_wanted();
        for filament in self.wanted.iter_mut().flat_map(|filaments| filaments.drain(..)) {
            self.asleep[filament / LANES] = false;
        }
        if is_any {
            self.drift = f64::INFINITY;
        }
        is_any
    }

    /// Leaves out a group: nothing touches it any longer.
    pub fn leave_out(&mut self, group: usize) {
        self.set_asleep(group, true);
        self.left_out[group] = true;
        self.pairs[group].clear();
        for pairs in &mut self.pairs {
            pairs.retain(|pair| pair.other / LANES != group);
        }
    }

    /// The pairs of each group, to be looked at where the nodes were put; lists the blocks that are near if that is [not done](Self::is_listed).
    pub fn by_group(&mut self) -> impl ExactSizeIterator<Item = Watched<'_>> + Send {
        let is_listed = self.is_listed();
        if !is_listed {
            self.drift = 0.0;
        }
        let Self { layout, motion, nodes, side, stations, pairs, listed, asleep, wanted, .. } = self;
        let (layout, motion, nodes) = (&*layout, &*motion, &**nodes);
        let (side, stations, asleep) = (*side, &**stations, &**asleep);
        let parts = pairs.iter_mut().zip(listed).zip(wanted);
        parts.map(move |((pairs, listed), wanted)| {
            if !is_listed {
                listed.clear();
                wanted.clear();
            }
            Watched { layout, motion, nodes, side, stations, pairs, listed, is_listed, asleep, wanted }
        })
    }

    /// How far the nodes of a filament have gone relative to the body since the start, in m: that of the farthest at each time.
    pub fn way(&self, filament: usize) -> f64 {
        self.motion.farthest(filament)
    }
}

impl Ways {
    /// Puts a group where it is if it has turned with the body.
    fn turn(&self, positions: &mut Field, angle: f64, segments: usize, group: usize) {
        let nodes = group * (segments + 1)..(group + 1) * (segments + 1);
        let turn = turned(angle - self.angles[group]);
        for (now, earlier) in positions.0[nodes.clone()].iter_mut().zip(&self.positions.0[nodes]) {
            *now = turn(*earlier);
        }
    }

    fn follow(&mut self, positions: &Field, angle: f64, segments: usize, moved: impl Fn(usize) -> bool) {
        let nodes = segments + 1;
        let parts = self
            .positions
            .0
            .chunks_mut(nodes)
            .zip(positions.0.chunks(nodes))
            .zip(self.paths.chunks_mut(nodes))
            .zip(self.ways.chunks_mut(nodes + 2 * SPREAD))
            .zip(&mut self.farthest)
            .zip(&mut self.angles);
        let parts = parts.enumerate().filter(|(group, _)| moved(*group));
        team::for_each(parts, |(((((earlier, now), paths), ways), farthest), before)| {
            let turn = turned(angle - *before);
            *before = angle;
            wide(
                #[inline(always)]
                || {
                    ways.fill(Lanes::ZERO);
                    let mut most = Lanes::ZERO;
                    for ((earlier, now), way) in earlier.iter_mut().zip(now).zip(&mut ways[SPREAD..]) {
                        let moved = sub(*now, turn(*earlier));
                        *way = dot(moved, moved).sqrt();
                        most = most.max(*way);
                        *earlier = *now;
                    }
                    // The largest of 2, 4, and 8 that follow each other, and then of those within the spread.
                    for ahead in [1, 2, 4] {
                        for k in 0..ways.len() - ahead {
                            ways[k] = ways[k].max(ways[k + ahead]);
                        }
                    }
                    for (k, path) in paths.iter_mut().enumerate() {
                        *path = *path + ways[k].max(ways[k + 2 * SPREAD - 7]);
                    }
                    *farthest = *farthest + most;
                },
            );
        });
    }

    fn path(&self, node: Node) -> f64 {
        node.of(&self.paths)
    }

    fn farthest(&self, filament: usize) -> f64 {
        self.farthest[filament / LANES].lane(filament % LANES)
    }
}

/// Copies the positions of some groups, filament by filament.
fn copy_filaments(positions: &Field, segments: usize, groups: impl Fn(usize) -> bool, nodes: &mut [[f64; 3]]) {
    let count = segments + 1;
    let parts = positions.0.chunks(count).zip(nodes.chunks_mut(LANES * count)).enumerate();
    team::for_each(parts.filter(|(group, _)| groups(*group)), |(positions, nodes)| {
        for (k, [x, y, z]) in positions.iter().enumerate() {
            for lane in 0..LANES {
                nodes[lane * count + k] = [x.lane(lane), y.lane(lane), z.lane(lane)];
            }
        }
    });
}

/// Turns a vector by `angle` (rad) about `z`.
fn turned(angle: f64) -> impl Fn([Lanes; 3]) -> [Lanes; 3] {
    let (sin, cos) = sin_cos(angle);
    let [sin, cos] = [sin, cos].map(Lanes::from_f64);
    #[inline(always)]
    move |[x, y, z]| [cos * x - sin * y, sin * x + cos * y, z]
}

/// The pairs of one group.
pub struct Watched<'a> {
    layout: &'a Layout,
    motion: &'a Ways,
    nodes: &'a [[f64; 3]],
    side: usize,
    stations: &'a [Stations],
    pairs: &'a mut [Pair],
    listed: &'a mut Vec<[u32; 2]>,
    is_listed: bool,
    asleep: &'a [bool],
    wanted: &'a mut Vec<usize>,
}

impl Watched<'_> {
    /// Calls `take` with every point that is nearer to another filament than the reach, with both filaments.
    pub fn for_each_near(mut self, mut take: impl FnMut([usize; 2], &Near)) {
        if !self.is_listed {
            self.list();
        }
        let Self { layout, nodes, stations, pairs, listed, .. } = self;
        let mut lines = None;
        for &[pair, number] in &*listed {
            let Pair { own, other, shift, blocks, .. } = &pairs[pair as usize];
            let (_, own_line, line) = match lines {
                Some(lines @ (last, _, _)) if last == pair => lines,
                _ => (pair, Centreline::new(layout, nodes, *own, 0.0), Centreline::new(layout, nodes, *other, *shift)),
            };
            lines = Some((pair, own_line, line));
            let near = Nearby { own: *own, own_line, line, window: blocks[number as usize].window };
            near.for_each(number as usize, &stations[number as usize], layout, |near| take([*own, *other], near));
        }
    }

    /// Lists the blocks whose points may be near before nodes have drifted by the reserve.
    fn list(&mut self) {
        let Self { layout, motion, nodes, side, stations, pairs, listed, asleep, wanted, .. } = self;
        let (layout, side, segments) = (*layout, *side, layout.segments);
        let reserve = RESERVE * layout.largest_reach;
        for (pair, Pair { own, other, shift, clear_until, blocks }) in pairs.iter_mut().enumerate() {
            // What is known must hold for as long as the list does.
            let total = motion.farthest(*own) + motion.farthest(*other) + reserve;
            if total < *clear_until {
                continue;
            }
            let sleeper = [*own, *other].into_iter().find(|filament| asleep[*filament / LANES]);
            if asleep[*own / LANES] && asleep[*other / LANES] {
                continue;
            }
            let mut is_near = false;
            let line = Centreline::new(layout, nodes, *other, *shift);
            let own_line = Centreline::new(layout, nodes, *own, 0.0);
            let mut slack = f64::INFINITY;
            for (number, (block, station)) in blocks.iter_mut().zip(*stations).enumerate() {
                let own_path = motion.path(Node::new(*own, station.middle(), segments)) + reserve;
                let path = |block: &Block| own_path + motion.path(Node::new(*other, middle(block.window), segments));
                let mut way = path(block);
                let in_window = way < block.next_until && total < block.else_until;
                if in_window && way < block.clear_until {
                    slack = slack.min(block.slack(way, total));
                    continue;
                }
                if !in_window {
                    let scan = Scan { own_line, station, line, side };
                    let [next, others];
                    (block.window, [next, others]) = dispatch(scan);
                    way = path(block);
                    (block.next_until, block.else_until) = (way - reserve + next, total - reserve + others);
                }
                let Nearest { beyond, .. } = dispatch(Windows { own_line, station, line, window: block.window });
                let clear = (0..LANES).map(|lane| beyond.lane(lane)).fold(f64::INFINITY, f64::min);
                block.clear_until = way - reserve + clear;
                slack = slack.min(block.slack(way, total));
                if clear <= reserve {
                    is_near = true;
                    if sleeper.is_none() {
                        listed.push([pair as u32, number as u32]);
                    }
                }
            }
            wanted.extend(sleeper.filter(|_| is_near));
            *clear_until = total + slack;
        }
    }
}

/// The points of a block, and the window of segments that they are near.
struct Nearby<'a> {
    own: usize,
    own_line: Centreline<'a>,
    line: Centreline<'a>,
    window: [u16; 2],
}

impl Nearby<'_> {
    /// Calls `take` with every point that is nearer to the window than the reach.
    fn for_each(&self, number: usize, station: &Stations, layout: &Layout, mut take: impl FnMut(&Near)) {
        let &Self { own, own_line, line, window } = self;
        let Layout { segments, points, .. } = *layout;
        let Nearest { x, radius, beyond, segment } = dispatch(Windows { own_line, station, line, window });
        let present = LANES.min(segments * points - number * LANES);
        for lane in (0..present).filter(|lane| beyond.lane(*lane) < 0.0) {
            let own = Node::new(own, station.segments[lane].into(), segments);
            let point = FilamentPoint { segment: own, fraction: station.fractions.lane(lane) };
            let k = segment.lane(lane) as usize;
            let reach = radius.lane(lane) + line.radii[k];
            let ends = [line.node(k), line.node(k + 1)];
            let near = Near::between(point, x.map(|x| x.lane(lane)), line.segment(k), ends, reach);
            if near.square() < near.reach * near.reach {
                take(&near);
            }
        }
    }
}

impl Block {
    /// How far filaments can go before this block must be looked at again, in m.
    fn slack(&self, way: f64, total: f64) -> f64 {
        (self.clear_until.min(self.next_until) - way).min(self.else_until - total)
    }
}

/// The centreline of one filament.
#[derive(Clone, Copy)]
struct Centreline<'a> {
    /// Its root.
    root: Node,
    /// Its nodes in m.
    nodes: &'a [[f64; 3]],
    /// `z` by which it is moved, in m.
    shift: f64,
    /// Radii of the segments in m.
    radii: &'a [f64],
}

impl<'a> Centreline<'a> {
    fn new(layout: &'a Layout, nodes: &'a [[f64; 3]], filament: usize, shift: f64) -> Self {
        let Layout { segments, .. } = *layout;
        Self {
            root: Node::new(filament, 0, segments),
            nodes: &nodes[filament * (segments + 1)..][..=segments],
            shift,
            radii: &layout.radii[filament * segments..][..segments],
        }
    }

    fn segment(&self, k: usize) -> Node {
        self.root.outwards(k)
    }

    #[inline(always)]
    fn node(&self, k: usize) -> [f64; 3] {
        let [x, y, z] = self.nodes[k];
        [x, y, z + self.shift]
    }

    /// In each lane the node that is so many `steps` from the inner end of one of `segments`.
    #[inline(always)]
    fn nodes(&self, segments: &[u16; LANES], steps: usize) -> [Lanes; 3] {
        let mut nodes: [Lanes; 3] = zero();
        for lane in 0..LANES {
            let [x, y, z] = self.node(usize::from(segments[lane]) + steps);
            nodes[0].0[lane] = x;
            nodes[1].0[lane] = y;
            nodes[2].0[lane] = z;
        }
        nodes
    }

    /// The points of a block, and the radii there.
    #[inline(always)]
    fn points(&self, station: &Stations) -> ([Lanes; 3], Lanes) {
        let (inner, outer) = (self.nodes(&station.segments, 0), self.nodes(&station.segments, 1));
        let (outer_share, inner_share) = (station.fractions, Lanes::from_f64(1.0) - station.fractions);
        // As `Place::of` computes it.
        let x = add(scale(inner_share, inner), scale(outer_share, outer));
        (x, Lanes::from_lanes(|lane| self.radii[usize::from(station.segments[lane])]))
    }
}

impl Centreline<'_> {
    /// The squares of the distances of points from a segment in m².
    #[inline(always)]
    fn squares(&self, x: [Lanes; 3], segment: usize) -> Lanes {
        let splat = |[x, y, z]: [f64; 3]| [Lanes::from_f64(x), Lanes::from_f64(y), Lanes::from_f64(z)];
        let (inner, outer) = (self.node(segment), self.node(segment + 1));
        let along = sub(outer, inner);
        let share = Lanes::from_f64(1.0 / dot(along, along));
        let (along, from) = (splat(along), sub(x, splat(inner)));
        let fraction = min((dot(along, from) * share).max(Lanes::ZERO), Lanes::from_f64(1.0));
        let offset = sub(from, scale(fraction, along));
        dot(offset, offset)
    }

    /// The squares of the distances of points from the nearest of some segments in m², and its number.
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

    /// The largest radius of some segments in m.
    #[inline(always)]
    fn largest_radius(&self, segments: Range<usize>) -> Lanes {
        Lanes::from_f64(self.radii[segments].iter().fold(0.0, |largest, radius| radius.max(largest)))
    }
}

/// Where the points of a block are on a filament. Lanes that are left over repeat the last point.
#[derive(Clone, Copy, Debug)]
struct Stations {
    segments: [u16; LANES],
    fractions: Lanes,
}

impl Stations {
    /// Those of all blocks.
    fn all(segments: usize, points: usize) -> Vec<Self> {
        let count = segments * points;
        let block = |first: usize| {
            let at = |lane: usize| (first + lane).min(count - 1);
            Self {
                segments: std::array::from_fn(|lane| (at(lane) / points) as u16),
                fractions: Lanes::from_lanes(|lane| ((at(lane) % points) as f64 + 0.5) / points as f64),
            }
        };
        (0..count).step_by(LANES).map(block).collect()
    }

    fn middle(&self) -> usize {
        usize::from(self.segments[0] + self.segments[LANES - 1]) / 2
    }

    #[inline(always)]
    fn spread(&self) -> usize {
        usize::from(self.segments[LANES - 1] - self.segments[0])
    }
}

/// Chooses the window of a block: the segments that are nearest to its points, and so many on either `side`. Returns the window, and how
/// far the segments outside are out of reach in m, at least: those for which the path of the middle holds, and all others.
struct Scan<'a> {
    own_line: Centreline<'a>,
    station: &'a Stations,
    line: Centreline<'a>,
    side: usize,
}

impl Loop for Scan<'_> {
    type Output = ([u16; 2], [f64; 2]);

    const LANES: usize = LANES;

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { own_line, station, line, side } = self;
        let ((x, radius), own_spread) = (own_line.points(station), station.spread());
        let count = line.radii.len();
        let (_, nearest) = line.nearest(x, 0..count);
        // NaN is no index: the cast saturates.
        let nearest: [usize; LANES] = std::array::from_fn(|lane| nearest.lane(lane) as usize);
        let ends = nearest.iter().fold([count, 0], |[first, last], &k| [first.min(k), last.max(k)]);
        let window = [ends[0].saturating_sub(side), (ends[1] + side + 1).min(count)].map(|k| k as u16);
        let middle = middle(window);
        let mut outside = [Lanes::from_f64(f64::INFINITY); 2];
        for k in 0..count {
            // The path of a node holds for so many on either side, and a segment has two.
            let is_next = own_spread < 2 * SPREAD && k + SPREAD >= middle && k < middle + SPREAD;
            if !is_next || !segments(window).contains(&k) {
                let least = &mut outside[usize::from(!is_next)];
                *least = min(*least, line.squares(x, k));
            }
        }
        let reach = radius + line.largest_radius(0..count);
        let beyond = |squares: Lanes| {
            let beyond = squares.sqrt() - reach;
            (0..LANES).map(|lane| beyond.lane(lane)).fold(f64::INFINITY, f64::min)
        };
        (window, outside.map(beyond))
    }
}

/// The segments of a window.
#[inline(always)]
fn segments([first, behind]: [u16; 2]) -> Range<usize> {
    first.into()..behind.into()
}

/// The node in the middle of a window.
#[inline(always)]
fn middle(window: [u16; 2]) -> usize {
    let Range { start, end } = segments(window);
    (start + end) / 2
}

#[inline(always)]
fn min(a: Lanes, b: Lanes) -> Lanes {
    -(-a).max(-b)
}

/// Looks for what is nearest to the points of a block in their window.
struct Windows<'a> {
    own_line: Centreline<'a>,
    station: &'a Stations,
    line: Centreline<'a>,
    window: [u16; 2],
}

/// The points of a block, and the nearest segments of their window.
struct Nearest {
    /// The points in m.
    x: [Lanes; 3],
    /// The radii there in m.
    radius: Lanes,
    /// How far they are out of reach of all segments in m, at least.
    beyond: Lanes,
    /// The number of the segment whose centreline is nearest.
    segment: Lanes,
}

impl Loop for Windows<'_> {
    type Output = Nearest;

    const LANES: usize = LANES;

    #[inline(always)]
    fn run(self) -> Nearest {
        let Self { own_line, station, line, window } = self;
        let (x, radius) = own_line.points(station);
        let (squares, segment) = line.nearest(x, segments(window));
        let beyond = squares.sqrt() - (radius + line.largest_radius(segments(window)));
        Nearest { x, radius, beyond, segment }
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
    /// Overlaps nothing.
    const NOWHERE: Self = Self { angles: [0.0, -1.0], axial: [f64::INFINITY, f64::NEG_INFINITY] };

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

    /// The same after the body has turned by `angle` (rad).
    fn turned(self, angle: f64) -> Self {
        Self { angles: self.angles.map(|before| before + angle), ..self }
    }

    /// Whether they overlap along `z`, with the other one moved by `shift` (m).
    fn overlaps(&self, other: &Self, shift: f64) -> bool {
        self.axial[0] <= other.axial[1] + shift && other.axial[0] + shift <= self.axial[1]
    }
}

/// Calls `take` once with all pairs whose angles overlap.
fn for_each_close(bounds: &[Bounds], starts: &mut Vec<Start>, mut take: impl FnMut(usize, usize)) {
    starts.clear();
    starts.extend(bounds.iter().enumerate().map(|(filament, Bounds { angles: [from, to], .. })| {
        let width = to - from;
        Start { angle: from.rem_euclid(TAU), width: if width < TAU { width } else { TAU }, filament }
    }));
    starts.sort_unstable_by(|a, b| a.angle.total_cmp(&b.angle).then(a.filament.cmp(&b.filament)));
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
        let radii = vec![0.5 * REACH; filaments * segments];
        let layout = Layout::new(vec![length; filaments], radii, points, period);
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
        let mut placed = Field::new(layout.groups(), segments);
        for step in 0..80 {
            let angle = 0.01 * f64::from(step / 2);
            let (sin, cos) = sin_cos(angle);
            let mut random = || [random(&mut seed), random(&mut seed), random(&mut seed)];
            if step % 2 == 0 {
                for &(node, position) in &nodes {
                    let [x, y, z] = add(position, scale(2e-5, random()));
                    placed.set(node, [cos * x - sin * y, sin * x + cos * y, z]);
                }
                let before = candidates.built.clone();
                candidates.drift(f64::INFINITY);
                candidates.update(&mut placed, angle, |_| true);
                built += usize::from(candidates.built != before);
            } else {
                // Nodes that hardly move are not followed.
                let drift = 0.49 * RESERVE * REACH;
                for &(node, _) in &nodes {
                    placed.set(node, add(placed.at(node), scale(drift / 3.0_f64.sqrt(), random())));
                }
                candidates.drift(drift);
                assert!(candidates.is_listed());
                candidates.update(&mut placed, angle, |_| true);
            }
            let found = candidates.by_group().map(|watched| {
                let mut near_ones = Vec::new();
                watched.for_each_near(|filaments, near| near_ones.push((filaments, *near)));
                near_ones
            });
            let mut found: Vec<([usize; 2], Near)> = found.flatten().collect();
            let mut expected = Vec::new();
            for filament in 0..filaments {
                for segment in (0..segments).map(|k| Node::new(filament, k, segments)) {
                    for part in 0..points {
                        let point = FilamentPoint { segment, fraction: (part as f64 + 0.5) / points as f64 };
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
        for_each_close(&bounds, &mut Vec::new(), |a, b| pairs.push([a.min(b), a.max(b)]));
        pairs.sort_unstable();
        assert_eq!(pairs, [[0, 1], [0, 2]]);
    }
}
