//! Vectors at the nodes of many filaments, in lanes.

use crate::equations::dispatch::{Loop, dispatch};
use crate::equations::linear::{add, scale};
use crate::equations::{LANES, Lanes, Lanewise, Real};

/// Runs `work`, a loop over lanes, with the widest instructions of the machine.
#[inline(always)]
pub fn wide<R>(work: impl FnOnce() -> R) -> R {
    dispatch(Wide(work))
}

struct Wide<F>(F);

impl<R, F: FnOnce() -> R> Loop for Wide<F> {
    type Output = R;

    const LANES: usize = LANES;

    #[inline(always)]
    fn run(self) -> R {
        (self.0)()
    }
}

/// Index of a node. Filaments are in groups of [`LANES`], whose nodes follow each other from the
/// root to the tip.
///
/// A segment has the index of its inner end.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeIndex(usize);

impl NodeIndex {
    /// Returns the node `k` of a filament of `segments` segments; 0 is the root.
    pub fn new(filament: usize, k: usize, segments: usize) -> Self {
        Self(((filament / LANES) * (segments + 1) + k) * LANES + filament % LANES)
    }

    /// Returns the next node outwards.
    pub fn outer(self) -> Self {
        self.outwards(1)
    }

    /// Returns the node `steps` steps outwards.
    pub fn outwards(self, steps: usize) -> Self {
        Self(self.0 + steps * LANES)
    }

    /// Returns the filament of the node.
    pub fn filament(self, segments: usize) -> usize {
        self.0 / LANES / (segments + 1) * LANES + self.lane()
    }

    /// Returns the group of the node.
    pub fn group(self, segments: usize) -> usize {
        self.row() / (segments + 1)
    }

    /// Returns the number of the node, or of its outer segment, from the root.
    pub fn index(self, segments: usize) -> usize {
        self.row() % (segments + 1)
    }

    /// Returns the index among the `nodes` nodes of the group.
    pub fn within(self, nodes: usize) -> usize {
        self.0 % nodes
    }

    /// Returns the row in a field.
    fn row(self) -> usize {
        self.0 / LANES
    }

    fn lane(self) -> usize {
        self.0 % LANES
    }
}

/// A 3 × 3 matrix.
pub type Matrix = [[f64; 3]; 3];

/// A vector at each node.
#[derive(Clone, Debug, PartialEq)]
pub struct Field(pub Vec<[Lanes; 3]>);

impl Field {
    /// Creates a field of zeros at the nodes of `groups` groups.
    pub fn new(groups: usize, segments: usize) -> Self {
        Self(vec![[Lanes::ZERO; 3]; groups * (segments + 1)])
    }

    /// Returns the vector at a node.
    #[inline]
    pub fn at(&self, node: NodeIndex) -> [f64; 3] {
        let [x, y, z] = &self.0[node.row()];
        let lane = node.lane();
        [x.lane(lane), y.lane(lane), z.lane(lane)]
    }

    /// Sets the vector at a node.
    #[cfg(test)]
    pub fn set(&mut self, node: NodeIndex, vector: [f64; 3]) {
        for (component, value) in self.0[node.row()].iter_mut().zip(vector) {
            component.set_lane(node.lane(), value);
        }
    }
}

/// Positions and velocities of all nodes.
#[derive(Clone, Debug)]
pub struct Nodes {
    /// Positions in m.
    pub positions: Field,
    /// Velocities in m/s.
    pub velocities: Field,
}

impl Nodes {
    /// Returns position and velocity of a node.
    pub fn at(&self, node: NodeIndex) -> [[f64; 3]; 2] {
        [self.positions.at(node), self.velocities.at(node)]
    }

    /// Returns the positions and the velocities of each group.
    pub fn by_group(&mut self, segments: usize) -> impl Iterator<Item = [&mut [[Lanes; 3]]; 2]> {
        let Self {
            positions,
            velocities,
        } = self;
        let groups = positions
            .0
            .chunks_mut(segments + 1)
            .zip(velocities.0.chunks_mut(segments + 1));
        groups.map(|(positions, velocities)| [positions, velocities])
    }
}

/// Vectors at the nodes of one group, from the root.
pub struct GroupField<'a> {
    /// Row of the root.
    first: usize,
    vectors: &'a mut [[Lanes; 3]],
}

impl<'a> GroupField<'a> {
    /// Wraps `vectors`, the part of a field that belongs to `group`.
    pub fn new(group: usize, segments: usize, vectors: &'a mut [[Lanes; 3]]) -> Self {
        Self {
            first: group * (segments + 1),
            vectors,
        }
    }

    /// Sets all vectors to zero.
    pub fn clear(&mut self) {
        self.vectors.fill([Lanes::ZERO; 3]);
    }

    /// Adds to the first `D` components of the vector at a node.
    #[inline]
    pub fn add<const D: usize>(&mut self, node: NodeIndex, vector: [f64; D]) {
        add_in_lane(
            &mut self.vectors[node.row() - self.first],
            node.lane(),
            vector,
        );
    }

    /// Returns the vectors at all nodes.
    pub fn vectors(&self) -> &[[Lanes; 3]] {
        self.vectors
    }
}

/// Tangents of the forces on both ends of each segment of a group by the motion of these ends:
/// `[force][motion]`.
#[derive(Clone, Debug, PartialEq)]
pub struct Changes {
    /// Row of the group's root in a field.
    first: usize,
    blocks: Vec<Blocks>,
    /// `true` for segments with a tangent.
    present: Vec<bool>,
}

/// Tangent of one segment.
pub type Blocks = [[[[Lanes; 3]; 3]; 2]; 2];

impl Changes {
    /// Allocates memory for groups of `segments` segments; the tip counts as one.
    pub fn new(segments: usize) -> Self {
        let blocks = vec![[[[[Lanes::ZERO; 3]; 3]; 2]; 2]; segments + 1];
        Self {
            first: 0,
            present: vec![false; blocks.len()],
            blocks,
        }
    }

    /// Sets all tangents to zero, for `group`.
    pub fn clear(&mut self, group: usize) {
        self.first = group * self.blocks.len();
        self.present.fill(false);
    }

    /// Adds `change` to the blocks of a segment, by `[force, motion]`.
    #[inline(always)]
    pub fn add_blocks<const D: usize>(
        &mut self,
        segment: NodeIndex,
        change: impl Fn(usize, usize) -> [[f64; D]; D],
    ) {
        let (index, lane) = (segment.row() - self.first, segment.lane());
        let blocks = &mut self.blocks[index];
        if !std::mem::replace(&mut self.present[index], true) {
            *blocks = [[[[Lanes::ZERO; 3]; 3]; 2]; 2];
        }
        for force in 0..2 {
            for motion in 0..2 {
                for (row, change) in blocks[force][motion].iter_mut().zip(change(force, motion)) {
                    add_in_lane(row, lane, change);
                }
            }
        }
    }

    /// Adds to all blocks of a segment the `change` of the force at one of its points with that
    /// point, by the `shares` of the ends.
    #[inline(always)]
    pub fn add_at(&mut self, segment: NodeIndex, shares: [f64; 2], change: &Matrix) {
        self.add_blocks(segment, |force, motion| {
            change.map(|row| scale(shares[force] * shares[motion], row))
        });
    }

    /// Returns the segments with a tangent, from the root.
    pub fn blocks(&self) -> impl Iterator<Item = (usize, &Blocks)> {
        self.blocks
            .iter()
            .enumerate()
            .zip(&self.present)
            .filter_map(|(block, present)| present.then_some(block))
    }
}

#[inline(always)]
fn add_in_lane<const D: usize>(vector: &mut [Lanes; 3], lane: usize, values: [f64; D]) {
    for (component, value) in vector.iter_mut().zip(values) {
        component.set_lane(lane, component.lane(lane) + value);
    }
}

/// A point of a filament: a segment, and the fraction of it from its inner end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FilamentPoint {
    /// Segment.
    pub segment: NodeIndex,
    /// Fraction.
    pub fraction: f64,
}

impl FilamentPoint {
    /// Returns a key for the order of the points of a group.
    pub fn key(&self) -> (NodeIndex, u64) {
        (self.segment, self.fraction.to_bits())
    }

    /// Returns the shares of a force at the point on both ends of the segment.
    pub fn shares(&self) -> [f64; 2] {
        [1.0 - self.fraction, self.fraction]
    }

    /// Returns the mean of a field at both ends, by share.
    #[inline]
    pub fn of(&self, field: &Field) -> [f64; 3] {
        let [inner, outer] = self.shares();
        add(
            scale(inner, field.at(self.segment)),
            scale(outer, field.at(self.segment.outer())),
        )
    }

    /// Adds a force at the point to the forces on both ends.
    #[inline]
    pub fn load(&self, force: [f64; 3], forces: &mut GroupField<'_>) {
        let [inner, outer] = self.shares();
        forces.add(self.segment, scale(inner, force));
        forces.add(self.segment.outer(), scale(outer, force));
    }
}
