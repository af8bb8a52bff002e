//! Which points may press on which segments: the broad phase.
//!
//! Everything here is in the frame of the turning body. A sleeping filament turns with the body, so
//! its nodes stay where they are and it is a candidate like any other.
//!
//! *Pairs* of filaments are found by how far they reach around the tool axis and along it. A list
//! of them is complete until some node has moved by half a margin. A pair *watches* the points of
//! one filament, in blocks of one per lane: how far they are from the other filament is computed
//! again only once both could have moved that way. For each block it knows a window of segments of
//! the other filament, outside which there is nothing near. Blocks that are near, or nearly so, are
//! listed: as long as nodes have hardly moved since, as between the iterations of a stage, no
//! others are looked at.

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

    /// Number of groups.
    pub fn groups(&self) -> usize {
        self.filaments.div_ceil(LANES)
    }

    /// The length of a segment of a filament that a point stands for, in m.
    pub fn part_length(&self, filament: usize) -> f64 {
        self.lengths[filament] / self.points as f64
    }

    /// Number of segments in a window on either side of those that are nearest: what lies within
    /// the reach.
    fn side(&self) -> usize {
        let shortest = self
            .lengths
            .iter()
            .fold(f64::INFINITY, |shortest, length| shortest.min(*length));
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
    /// `true` if bounds exclude pairs, blocks and segments from the search.
    has_bounds: bool,
    margin: f64,
    /// See [`Layout::side`].
    side: usize,
    /// The points of each block.
    stations: Vec<Stations>,
    /// Pairs by the group of the filament whose points they watch.
    pairs: Vec<Vec<Pair>>,
    motion: Ways,
    /// Positions of the nodes in the frame of the body, filament by filament.
    nodes: Vec<[f64; 3]>,
    /// Angle of the body in rad.
    angle: f64,
    /// Which groups nothing touches.
    left_out: Vec<bool>,
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
    starts: Vec<Start>,
    /// The pairs that were found, by group: both filaments, and the image of the other.
    found: Vec<Vec<(usize, usize, i16)>>,
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
    /// Positions to which they were last followed, in the frame of the body.
    positions: Field,
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
    /// Periodic image of the other one: by how many periods it is moved along `z`.
    image: i16,
    /// No point is within reach until the ways of both filaments add up to this, in m.
    clear_until: f64,
    blocks: Vec<Block>,
}

/// What is known of the points of a block.
#[derive(Clone, Copy, Debug)]
struct Block {
    /// The window: the first segment, and that behind the last.
    window: [u16; 2],
    /// No point of the block is within reach of the window until the ways there add up to this, in
    /// m.
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
    pub fn new(layout: Layout, has_bounds: bool) -> Self {
        let groups = layout.groups();
        let none = Lanes::ZERO;
        let motion = Ways {
            positions: Field::new(groups, layout.segments),
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
            angle: 0.0,
            left_out: vec![false; groups],
            built: Vec::new(),
            listed: vec![Vec::new(); groups],
            drift: f64::INFINITY,
            search: Search {
                found: vec![Vec::new(); groups],
                ..Search::default()
            },
            has_bounds,
            layout,
        }
    }

    /// Puts the nodes to `positions`, where the body is at `angle` (rad). Groups that have not
    /// `moved` since the last time have turned with the body, if at all.
    ///
    /// Unless what is listed [holds](Self::is_listed), follows how far nodes have gone, and builds
    /// the list of pairs again if filaments may touch that are not in it.
    pub fn update(&mut self, positions: &Field, angle: f64, moved: impl Fn(usize) -> bool) {
        let is_listed = self.is_listed();
        let is_known = !self.built.is_empty();
        let moved = |group: usize| !is_known || moved(group);
        let to_body = turned(-angle);
        self.angle = angle;
        let Self {
            motion,
            layout,
            nodes,
            ..
        } = self;
        copy_filaments(positions, layout.segments, &to_body, moved, nodes);
        if is_listed {
            return;
        }
        motion.follow(positions, layout.segments, &to_body, moved);
        let gone = |now: &Lanes, then: &Lanes| {
            (0..LANES).all(|lane| now.lane(lane) - then.lane(lane) <= 0.5 * self.margin)
        };
        if !is_known
            || !self
                .motion
                .farthest
                .iter()
                .zip(&self.built)
                .all(|(now, then)| gone(now, then))
        {
            self.build();
            self.built.clone_from(&self.motion.farthest);
        }
    }

    /// Lists the pairs of filaments that may be nearer to each other than the reach and the margin.
    /// Keeps what is known of pairs.
    fn build(&mut self) {
        let Self {
            layout,
            has_bounds,
            margin,
            stations,
            pairs: lists,
            nodes,
            left_out,
            search,
            ..
        } = self;
        let Layout {
            filaments,
            segments,
            period,
            ..
        } = *layout;
        let Search {
            bounds,
            starts,
            found,
            earlier,
            unused,
        } = search;
        let near = layout.largest_reach + *margin;
        bounds.clear();
        bounds.extend(
            nodes
                .chunks_exact(segments + 1)
                .take(filaments)
                .enumerate()
                .map(|(filament, nodes)| {
                    let bounds = Bounds::of(nodes.iter().copied(), near);
                    match (left_out[filament / LANES], *has_bounds) {
                        (true, _) => Bounds::NOWHERE,
                        (false, true) => bounds,
                        (false, false) => bounds.all_around(),
                    }
                }),
        );
        found.iter_mut().for_each(Vec::clear);
        for_each_close(bounds, starts, |a, b| {
            for image in bounds[a].images(&bounds[b], period) {
                found[a / LANES].push((a, b, image));
                found[b / LANES].push((b, a, -image));
            }
        });
        // A filament meets its own images, too.
        for (filament, own) in bounds.iter().enumerate().filter(|_| period.is_some()) {
            for image in own.images(own, period).filter(|image| *image != 0) {
                found[filament / LANES].push((filament, filament, image));
            }
        }
        for (pairs, found) in lists.iter_mut().zip(found) {
            found.sort_unstable();
            std::mem::swap(pairs, earlier);
            let mut known = earlier.drain(..).peekable();
            let key = |pair: &Pair| (pair.own, pair.other, pair.image);
            for &wanted in &*found {
                while let Some(pair) = known.next_if(|pair| key(pair) < wanted) {
                    unused.push(pair.blocks);
                }
                pairs.push(
                    known
                        .next_if(|pair| key(pair) == wanted)
                        .unwrap_or_else(|| {
                            let mut blocks = unused.pop().unwrap_or_default();
                            blocks.clear();
                            blocks.resize(stations.len(), Block::UNKNOWN);
                            let (own, other, image) = wanted;
                            Pair {
                                own,
                                other,
                                image,
                                clear_until: f64::NEG_INFINITY,
                                blocks,
                            }
                        }),
                );
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
        self.has_bounds && 2.0 * self.drift <= RESERVE * self.layout.largest_reach
    }

    /// Leaves out a group: nothing touches it any longer.
    pub fn leave_out(&mut self, group: usize) {
        self.drift = f64::INFINITY;
        self.left_out[group] = true;
        self.pairs[group].clear();
        for pairs in &mut self.pairs {
            pairs.retain(|pair| pair.other / LANES != group);
        }
    }

    /// The pairs of each group, to be looked at where the nodes were put; lists the blocks that are
    /// near if that is [not done](Self::is_listed).
    pub fn by_group(&mut self) -> impl ExactSizeIterator<Item = Watched<'_>> + Send {
        let is_listed = self.is_listed();
        if !is_listed {
            self.drift = 0.0;
        }
        let Self {
            layout,
            has_bounds,
            motion,
            nodes,
            angle,
            side,
            stations,
            pairs,
            listed,
            ..
        } = self;
        let (layout, motion, nodes, stations) = (&*layout, &*motion, &**nodes, &**stations);
        let (has_bounds, side, angle) = (*has_bounds, *side, sin_cos(*angle));
        pairs.iter_mut().zip(listed).map(move |(pairs, listed)| {
            if !is_listed {
                listed.clear();
            }
            Watched {
                layout,
                has_bounds,
                motion,
                nodes,
                angle,
                side,
                stations,
                pairs,
                listed,
                is_listed,
            }
        })
    }

    /// How far the nodes of a filament have gone relative to the body since the start, in m: that
    /// of the farthest at each time.
    pub fn way(&self, filament: usize) -> f64 {
        self.motion.farthest(filament)
    }
}

impl Ways {
    /// Adds the ways to these positions of the groups that have `moved`.
    fn follow(
        &mut self,
        positions: &Field,
        segments: usize,
        to_body: &(impl Fn([Lanes; 3]) -> [Lanes; 3] + Sync),
        moved: impl Fn(usize) -> bool,
    ) {
        let nodes = segments + 1;
        let parts = self
            .positions
            .0
            .chunks_mut(nodes)
            .zip(positions.0.chunks(nodes))
            .zip(self.paths.chunks_mut(nodes))
            .zip(self.ways.chunks_mut(nodes + 2 * SPREAD))
            .zip(&mut self.farthest);
        let parts = parts.enumerate().filter(|(group, _)| moved(*group));
        team::for_each(parts, |(_, ((((earlier, now), paths), ways), farthest))| {
            wide(
                #[inline(always)]
                || {
                    ways.fill(Lanes::ZERO);
                    let mut most = Lanes::ZERO;
                    for ((earlier, now), way) in
                        earlier.iter_mut().zip(now).zip(&mut ways[SPREAD..])
                    {
                        let now = to_body(*now);
                        let moved = sub(now, *earlier);
                        *way = dot(moved, moved).sqrt();
                        most = most.max(*way);
                        *earlier = now;
                    }
                    // The largest of 2, 4, and 8 that follow each other, and then of those within
                    // the spread.
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

/// Copies the positions of some groups to the frame of the body, filament by filament.
fn copy_filaments(
    positions: &Field,
    segments: usize,
    to_body: &(impl Fn([Lanes; 3]) -> [Lanes; 3] + Sync),
    groups: impl Fn(usize) -> bool,
    nodes: &mut [[f64; 3]],
) {
    let count = segments + 1;
    let parts = positions
        .0
        .chunks(count)
        .zip(nodes.chunks_mut(LANES * count))
        .enumerate();
    team::for_each(
        parts.filter(|(group, _)| groups(*group)),
        |(_, (positions, nodes))| {
            wide(
                #[inline(always)]
                || {
                    for (k, position) in positions.iter().enumerate() {
                        let [x, y, z] = to_body(*position);
                        for lane in 0..LANES {
                            nodes[lane * count + k] = [x.lane(lane), y.lane(lane), z.lane(lane)];
                        }
                    }
                },
            );
        },
    );
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
    has_bounds: bool,
    motion: &'a Ways,
    nodes: &'a [[f64; 3]],
    /// Sine and cosine of the angle of the body.
    angle: (f64, f64),
    side: usize,
    stations: &'a [Stations],
    pairs: &'a mut [Pair],
    listed: &'a mut Vec<[u32; 2]>,
    is_listed: bool,
}

impl Watched<'_> {
    /// Calls `take` with every point that is nearer to another filament than the reach, with both
    /// filaments.
    pub fn for_each_near(mut self, mut take: impl FnMut([usize; 2], &Near)) {
        if !self.has_bounds {
            self.list_all();
        } else if !self.is_listed {
            self.list();
        }
        let Self {
            layout,
            nodes,
            angle,
            stations,
            pairs,
            listed,
            ..
        } = self;
        let mut lines = None;
        for &[pair, number] in &*listed {
            let Pair {
                own,
                other,
                image,
                blocks,
                ..
            } = &pairs[pair as usize];
            let (_, own_line, line) = match lines {
                Some(lines @ (last, _, _)) if last == pair => lines,
                _ => (
                    pair,
                    Centreline::new(layout, nodes, *own, 0),
                    Centreline::new(layout, nodes, *other, *image),
                ),
            };
            lines = Some((pair, own_line, line));
            let near = Nearby {
                own: *own,
                own_line,
                line,
                window: blocks[number as usize].window,
            };
            near.for_each(
                number as usize,
                &stations[number as usize],
                layout,
                |near| {
                    let near = Near {
                        image: *image,
                        ..near.turned(angle)
                    };
                    if near.is_within_reach() {
                        take([*own, *other], &near);
                    }
                },
            );
        }
    }

    /// Lists all blocks, with windows of all segments.
    fn list_all(&mut self) {
        let window = [0, self.layout.segments as u16];
        for (number, pair) in self.pairs.iter_mut().enumerate() {
            pair.blocks.fill(Block {
                window,
                ..Block::UNKNOWN
            });
            self.listed
                .extend((0..pair.blocks.len()).map(|block| [number as u32, block as u32]));
        }
    }

    /// Lists the blocks whose points may be near before nodes have drifted by the reserve.
    fn list(&mut self) {
        let Self {
            layout,
            motion,
            nodes,
            side,
            stations,
            pairs,
            listed,
            ..
        } = self;
        let (layout, side, segments) = (*layout, *side, layout.segments);
        let reserve = RESERVE * layout.largest_reach;
        for (
            pair,
            Pair {
                own,
                other,
                image,
                clear_until,
                blocks,
            },
        ) in pairs.iter_mut().enumerate()
        {
            // What is known must hold for as long as the list does.
            let total = motion.farthest(*own) + motion.farthest(*other) + reserve;
            if total < *clear_until {
                continue;
            }
            let line = Centreline::new(layout, nodes, *other, *image);
            let own_line = Centreline::new(layout, nodes, *own, 0);
            let mut slack = f64::INFINITY;
            for (number, (block, station)) in blocks.iter_mut().zip(*stations).enumerate() {
                let own_path = motion.path(Node::new(*own, station.middle(), segments)) + reserve;
                let path = |block: &Block| {
                    own_path + motion.path(Node::new(*other, middle(block.window), segments))
                };
                let mut way = path(block);
                let in_window = way < block.next_until && total < block.else_until;
                if in_window && way < block.clear_until {
                    slack = slack.min(block.slack(way, total));
                    continue;
                }
                if !in_window {
                    let scan = Scan {
                        own_line,
                        station,
                        line,
                        side,
                    };
                    let [next, others];
                    (block.window, [next, others]) = dispatch(scan);
                    way = path(block);
                    (block.next_until, block.else_until) =
                        (way - reserve + next, total - reserve + others);
                }
                let Nearest { beyond, .. } = dispatch(Windows {
                    own_line,
                    station,
                    line,
                    window: block.window,
                });
                let clear = (0..LANES)
                    .map(|lane| beyond.lane(lane))
                    .fold(f64::INFINITY, f64::min);
                block.clear_until = way - reserve + clear;
                slack = slack.min(block.slack(way, total));
                if clear <= reserve {
                    listed.push([pair as u32, number as u32]);
                }
            }
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
    fn for_each(
        &self,
        number: usize,
        station: &Stations,
        layout: &Layout,
        mut take: impl FnMut(&Near),
    ) {
        let &Self {
            own,
            own_line,
            line,
            window,
        } = self;
        let Layout {
            segments, points, ..
        } = *layout;
        let Nearest {
            x,
            radius,
            beyond,
            segment,
        } = dispatch(Windows {
            own_line,
            station,
            line,
            window,
        });
        let present = LANES.min(segments * points - number * LANES);
        for lane in (0..present).filter(|lane| beyond.lane(*lane) < 0.0) {
            let own = Node::new(own, station.segments[lane].into(), segments);
            let point = FilamentPoint {
                segment: own,
                fraction: station.fractions.lane(lane),
            };
            let k = segment.lane(lane) as usize;
            let reach = radius.lane(lane) + line.radii[k];
            let ends = [line.node(k), line.node(k + 1)];
            let near = Near::between(point, x.map(|x| x.lane(lane)), line.segment(k), ends, reach);
            take(&near);
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
    fn new(layout: &'a Layout, nodes: &'a [[f64; 3]], filament: usize, image: i16) -> Self {
        let Layout {
            segments, period, ..
        } = *layout;
        Self {
            root: Node::new(filament, 0, segments),
            nodes: &nodes[filament * (segments + 1)..][..=segments],
            shift: period.map_or(0.0, |period| f64::from(image) * period),
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
        let (inner, outer) = (
            self.nodes(&station.segments, 0),
            self.nodes(&station.segments, 1),
        );
        let (outer_share, inner_share) =
            (station.fractions, Lanes::from_f64(1.0) - station.fractions);
        // As `Place::of` computes it.
        let x = add(scale(inner_share, inner), scale(outer_share, outer));
        (
            x,
            Lanes::from_lanes(|lane| self.radii[usize::from(station.segments[lane])]),
        )
    }
}

impl Centreline<'_> {
    /// The squares of the distances of points from a segment in m².
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

    /// The squares of the distances of points from the nearest of some segments in m², and its
    /// number.
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
        Lanes::from_f64(
            self.radii[segments]
                .iter()
                .fold(0.0, |largest, radius| radius.max(largest)),
        )
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
                fractions: Lanes::from_lanes(|lane| {
                    ((at(lane) % points) as f64 + 0.5) / points as f64
                }),
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

/// Chooses the window of a block: the segments that are nearest to its points, and so many on
/// either `side`. Returns the window, and how far the segments outside are out of reach in m, at
/// least: those for which the path of the middle holds, and all others.
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
        let Self {
            own_line,
            station,
            line,
            side,
        } = self;
        let ((x, radius), own_spread) = (own_line.points(station), station.spread());
        let count = line.radii.len();
        let (_, nearest) = line.nearest(x, 0..count);
        // NaN is no index: the cast saturates.
        let nearest: [usize; LANES] = std::array::from_fn(|lane| nearest.lane(lane) as usize);
        let ends = nearest
            .iter()
            .fold([count, 0], |[first, last], &k| [first.min(k), last.max(k)]);
        let window = [
            ends[0].saturating_sub(side),
            (ends[1] + side + 1).min(count),
        ]
        .map(|k| k as u16);
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
            (0..LANES)
                .map(|lane| beyond.lane(lane))
                .fold(f64::INFINITY, f64::min)
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
        let Self {
            own_line,
            station,
            line,
            window,
        } = self;
        let (x, radius) = own_line.points(station);
        let (squares, segment) = line.nearest(x, segments(window));
        let beyond = squares.sqrt() - (radius + line.largest_radius(segments(window)));
        Nearest {
            x,
            radius,
            beyond,
            segment,
        }
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
    const NOWHERE: Self = Self {
        angles: [0.0, -1.0],
        axial: [f64::INFINITY, f64::NEG_INFINITY],
    };

    /// Overlaps all others that it overlaps along `z`.
    fn all_around(self) -> Self {
        Self {
            angles: [0.0, TAU],
            ..self
        }
    }

    /// Two filaments can only be nearer to each other than `near` (m) if their bounds overlap.
    fn of(nodes: impl Iterator<Item = [f64; 3]> + Clone, near: f64) -> Self {
        let axial = nodes.clone().fold(
            [f64::INFINITY, f64::NEG_INFINITY],
            |[low, high], [_, _, z]| [low.min(z), high.max(z)],
        );
        let axial = [axial[0] - 0.5 * near, axial[1] + 0.5 * near];
        let mut nodes_around = nodes.clone();
        let [x, y, _] = nodes_around.next().expect("a filament has nodes");
        let (start, mut angle, mut before) = (y.atan2(x), [0.0_f64; 2], [x, y]);
        let (mut turned, mut least) = (0.0, x.hypot(y));
        for [x, y, _] in nodes_around {
            // The axis may be nearest to the inside of a segment.
            let along = [x - before[0], y - before[1]];
            let fraction = -(before[0] * along[0] + before[1] * along[1])
                / (along[0].powi(2) + along[1].powi(2));
            let fraction = fraction.clamp(0.0, 1.0);
            least =
                least.min((before[0] + fraction * along[0]).hypot(before[1] + fraction * along[1]));
            turned += (before[0] * y - before[1] * x).atan2(before[0] * x + before[1] * y);
            (angle[0], angle[1]) = (angle[0].min(turned), angle[1].max(turned));
            before = [x, y];
        }
        // Where two points are nearer than this, the sine of the angle between them is less than
        // its share of the smaller radius. Not a number, where a vertical filament stands, has no
        // finite comparison.
        let share = near / least;
        if !(share < 0.9 && angle[1] - angle[0] < std::f64::consts::PI) {
            return Self {
                angles: [0.0, TAU],
                axial,
            };
        }
        let pad = 0.5 * share.asin();
        Self {
            angles: [start + angle[0] - pad, start + angle[1] + pad],
            axial,
        }
    }

    /// The periodic images of the other one that overlap along `z`.
    fn images(&self, other: &Self, period: Option<f64>) -> Range<i16> {
        let [first, last] = [
            self.axial[0] - other.axial[1],
            self.axial[1] - other.axial[0],
        ];
        match period {
            Some(period) => (first / period).ceil() as i16..(last / period + 1.0).floor() as i16,
            None => 0..i16::from(first <= 0.0 && last >= 0.0),
        }
    }
}

/// Calls `take` once with all pairs whose angles overlap.
fn for_each_close(bounds: &[Bounds], starts: &mut Vec<Start>, mut take: impl FnMut(usize, usize)) {
    starts.clear();
    starts.extend(bounds.iter().enumerate().map(
        |(
            filament,
            Bounds {
                angles: [from, to], ..
            },
        )| {
            let width = to - from;
            Start {
                angle: from.rem_euclid(TAU),
                width: if width < TAU { width } else { TAU },
                filament,
            }
        },
    ));
    starts.sort_unstable_by(|a, b| {
        a.angle
            .total_cmp(&b.angle)
            .then(a.filament.cmp(&b.filament))
    });
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
    use fastrand::Rng;

    use super::*;

    const REACH: f64 = 1.2e-3;

    /// A number between −1 and 1.
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
        /// Two rows of filaments on a body of `radius` (m), `pitch` (m) apart.
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

        /// Puts the nodes of a filament, which bends in a circle, into the frame that the body has
        /// left by `angle` (rad).
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
                    Node::new(filament, k, *segments),
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

    /// All points within reach, in the order of the search.
    fn found(candidates: &mut Candidates) -> Vec<([usize; 2], Near)> {
        let mut found = Vec::new();
        for watched in candidates.by_group() {
            watched.for_each_near(|filaments, near| found.push((filaments, *near)));
        }
        found
    }

    /// Moves a scene at random, and compares the search with the one without bounds. Groups wake
    /// one after the other, move by a little or a lot, and the last one is left out in the end.
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
            // Of some groups nothing has moved relative to the body, as that of filaments whose
            // equations are solved.
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
                candidates.drift(f64::INFINITY);
                candidates.update(&positions, angle, |group| moving[group]);
            }
            let expected = found(&mut exhaustive);
            assert!(
                found(&mut bounded) == expected,
                "step {step} of seed {seed}"
            );
            met += expected.len();
            built += usize::from(bounded.built != before);
            before.clone_from(&bounded.built);
            // Within the reserve, the list holds.
            let drift = 0.49 * RESERVE * REACH;
            for row in positions
                .0
                .chunks_mut(segments + 1)
                .zip(&moving)
                .filter(|(_, moving)| **moving)
                .flat_map(|(rows, _)| rows)
            {
                for component in row {
                    let by = drift / 3.0_f64.sqrt() * about_zero(&mut random);
                    *component = *component + Lanes::from_f64(by);
                }
            }
            for candidates in [&mut bounded, &mut exhaustive] {
                candidates.drift(drift);
                candidates.update(&positions, angle, |group| moving[group]);
            }
            assert!(bounded.is_listed());
            assert!(
                found(&mut bounded) == found(&mut exhaustive),
                "step {step} of seed {seed}, within the list"
            );
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

    /// The search without bounds, against the definition: the nearest segment of each other
    /// filament and image, for each point.
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
                let segment = Node::new(own, segment, segments);
                let point = FilamentPoint {
                    segment,
                    fraction: (part as f64 + 0.5) / points as f64,
                };
                for image in (-5..=5).filter(|image| own != other || *image != 0) {
                    let shift = [0.0, 0.0, f64::from(image) * period];
                    let end = |k: usize| add(placed.at(Node::new(other, k, segments)), shift);
                    let on = |k: usize| {
                        let (x, ends) = (point.of(&placed), [end(k), end(k + 1)]);
                        Near {
                            image,
                            ..Near::between(point, x, Node::new(other, k, segments), ends, REACH)
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
        let around = |angles: [f64; 2]| Bounds {
            angles,
            axial: [0.0; 2],
        };
        let mut pairs = Vec::new();
        let bounds = [
            around([-0.1, 0.1]),
            around([0.05, 0.2]),
            around([TAU - 0.15, TAU - 0.05]),
            around([3.0, 3.1]),
        ];
        for_each_close(&bounds, &mut Vec::new(), |a, b| {
            pairs.push([a.min(b), a.max(b)])
        });
        pairs.sort_unstable();
        assert_eq!(pairs, [[0, 1], [0, 2]]);
    }
}
