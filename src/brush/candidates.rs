//! Which points may press on which segments: the broad phase.

use super::field::{Field, Lane, Node, Place};
use super::presses::Near;
use crate::equations::linear::{dot, sub};
use crate::equations::{LANES, Lanewise, sin_cos};

/// Filaments of equal numbers of segments.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// Number of filaments.
    pub filaments: usize,
    /// Number of segments of a filament.
    pub segments: usize,
    /// Length of a segment in m.
    pub length: f64,
    /// Number of points of a segment, `N_q`.
    pub points: usize,
    /// Sum of the radii of two filaments, in m.
    pub reach: f64,
}

impl Layout {
    /// The filament of a node.
    pub fn filament(&self, node: Node) -> usize {
        node.filament(self.segments)
    }
}

/// Points with the segments of other filaments that they may press on.
///
/// The list holds all pairs that are nearer than the reach and a margin where it is built. It is complete as long as no node has moved by
/// more than half the margin, relative to the turning body.
#[derive(Clone, Debug)]
pub struct Candidates {
    layout: Layout,
    margin: f64,
    /// Points with one other filament each, and the end of their segments in `segments`.
    points: Vec<(Place, usize)>,
    segments: Vec<Node>,
    /// Where the nodes were, and the angle of the body.
    built: Option<(Field, f64)>,
}

impl Candidates {
    /// An empty list, which is out of date.
    pub fn new(layout: Layout) -> Self {
        let margin = 0.4 * layout.reach;
        Self { layout, margin, points: Vec::new(), segments: Vec::new(), built: None }
    }

    /// Builds the list again if nodes at `positions` may touch without being in it. The body is at `angle` (rad).
    pub fn update(&mut self, positions: &Field, angle: f64) {
        if !self.covers(positions, angle) {
            self.build(positions, angle);
        }
    }

    /// Whether no node has moved by more than half the margin, relative to the body.
    fn covers(&self, positions: &Field, angle: f64) -> bool {
        let Some((earlier, built_at)) = &self.built else { return false };
        let (sin, cos) = sin_cos(angle - built_at);
        let [sin, cos] = [sin, cos].map(|value| Lane::from_lanes(|_| value));
        let mut farthest = Lane::from_lanes(|_| 0.0);
        for ([x, y, z], position) in earlier.0.iter().zip(&positions.0) {
            let moved = sub(*position, [cos * *x - sin * *y, sin * *x + cos * *y, *z]);
            farthest = farthest.max(dot(moved, moved));
        }
        (0..LANES).all(|lane| farthest.lane(lane) <= 0.25 * self.margin * self.margin)
    }

    fn build(&mut self, positions: &Field, angle: f64) {
        let Layout { filaments, segments, points, reach, .. } = self.layout;
        let near = reach + self.margin;
        let lines: Vec<Vec<[f64; 3]>> = (0..filaments)
            .map(|filament| (0..=segments).map(|k| positions.at(Node::new(filament, k, segments))).collect())
            .collect();
        let boxes: Vec<Bounds> = lines.iter().map(|line| Bounds::of(line, near)).collect();
        let neighbours = neighbours(&boxes);
        self.points.clear();
        self.segments.clear();
        for (filament, others) in neighbours.iter().enumerate() {
            for k in 0..segments {
                let segment = Node::new(filament, k, segments);
                for part in 0..points {
                    let point = Place { segment, fraction: (part as f64 + 0.5) / points as f64 };
                    let x = point.of(positions);
                    for &other in others.iter().filter(|&&other| boxes[other].contains(x)) {
                        let before = self.segments.len();
                        self.find(point, x, other, &lines[other], near);
                        if self.segments.len() > before {
                            self.points.push((point, self.segments.len()));
                        }
                    }
                }
            }
        }
        self.built = Some((positions.clone(), angle));
    }

    /// Adds the segments of the filament `other`, along `line`, that are nearer to `x` than `near`.
    fn find(&mut self, point: Place, x: [f64; 3], other: usize, line: &[[f64; 3]], near: f64) {
        let Layout { segments, length, .. } = self.layout;
        let mut k = 0;
        while k < segments {
            let from = sub(x, line[k]);
            // A node that is far away is far from the next segments, too.
            let far = ((dot(from, from).sqrt() - near) / length) as usize;
            if far > 0 {
                k += far;
                continue;
            }
            let segment = Node::new(other, k, segments);
            if Near::between(point, x, segment, [line[k], line[k + 1]]).square() < near * near {
                self.segments.push(segment);
            }
            k += 1;
        }
    }

    /// Calls `take` with every point that is nearer to another filament than the reach.
    pub fn for_each_near(&self, positions: &Field, mut take: impl FnMut(&Near)) {
        let mut start = 0;
        for &(point, end) in &self.points {
            let x = point.of(positions);
            let ends = |segment: Node| [positions.at(segment), positions.at(segment.outer())];
            let nearest = self.segments[start..end]
                .iter()
                .map(|&segment| Near::between(point, x, segment, ends(segment)))
                .min_by(|a, b| a.square().total_cmp(&b.square()))
                .expect("each point has a segment");
            start = end;
            if nearest.square() < self.layout.reach * self.layout.reach {
                take(&nearest);
            }
        }
    }

    /// The length of a segment that a point stands for, in m.
    pub fn length(&self) -> f64 {
        self.layout.length / self.layout.points as f64
    }
}

/// A box along the axes around a filament, and what is near it.
struct Bounds([[f64; 3]; 2]);

impl Bounds {
    fn of(line: &[[f64; 3]], near: f64) -> Self {
        let mut bounds = [line[0]; 2];
        for node in line {
            for (i, component) in node.iter().enumerate() {
                bounds[0][i] = bounds[0][i].min(*component);
                bounds[1][i] = bounds[1][i].max(*component);
            }
        }
        Self([bounds[0].map(|least| least - near), bounds[1].map(|most| most + near)])
    }

    fn contains(&self, point: [f64; 3]) -> bool {
        (0..3).all(|i| self.0[0][i] <= point[i] && point[i] <= self.0[1][i])
    }

    fn overlaps(&self, other: &Self) -> bool {
        (0..3).all(|i| self.0[0][i] <= other.0[1][i] && other.0[0][i] <= self.0[1][i])
    }
}

/// Which boxes overlap with each, in ascending order, by a sweep along `x`.
fn neighbours(boxes: &[Bounds]) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..boxes.len()).collect();
    order.sort_by(|&a, &b| boxes[a].0[0][0].total_cmp(&boxes[b].0[0][0]));
    let mut neighbours = vec![Vec::new(); boxes.len()];
    let mut open: Vec<usize> = Vec::new();
    for here in order {
        open.retain(|&other| boxes[other].0[1][0] >= boxes[here].0[0][0]);
        for &other in open.iter().filter(|&&other| boxes[other].overlaps(&boxes[here])) {
            neighbours[here].push(other);
            neighbours[other].push(here);
        }
        open.push(here);
    }
    for others in &mut neighbours {
        others.sort_unstable();
    }
    neighbours
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::linear::{add, scale};

    /// A number between -1 and 1 that depends on `seed` alone.
    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*seed >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    #[test]
    fn the_list_finds_what_a_search_over_all_pairs_finds() {
        let layout = Layout { filaments: 12, segments: 6, length: 2e-3, points: 2, reach: 1.2e-3 };
        let mut seed = 7;
        let mut nodes = Vec::new();
        for filament in 0..layout.filaments {
            let mut position = [1.3e-3 * filament as f64, 0.0, 1e-3 * random(&mut seed)];
            nodes.push((Node::new(filament, 0, layout.segments), position));
            for k in 1..=layout.segments {
                let direction = [0.7 * random(&mut seed), 1.0, 0.7 * random(&mut seed)];
                position = add(position, scale(layout.length / dot(direction, direction).sqrt(), direction));
                nodes.push((Node::new(filament, k, layout.segments), position));
            }
        }
        let segments_of = |filament: usize| (0..layout.segments).map(move |k| Node::new(filament, k, layout.segments));
        let mut candidates = Candidates::new(layout);
        let (mut met, mut rebuilt) = (0, 0);
        for step in 0..40 {
            let angle = 0.01 * f64::from(step);
            let (sin, cos) = sin_cos(angle);
            // Everything turns with the body, and trembles.
            let mut placed = Field::new(2, layout.segments);
            for &(node, position) in &nodes {
                let tremble = scale(2e-5, [random(&mut seed), random(&mut seed), random(&mut seed)]);
                let [x, y, z] = add(position, tremble);
                placed.set(node, [cos * x - sin * y, sin * x + cos * y, z]);
            }
            rebuilt += usize::from(!candidates.covers(&placed, angle));
            candidates.update(&placed, angle);
            let mut found = Vec::new();
            candidates.for_each_near(&placed, |near| found.push(*near));
            let mut expected = Vec::new();
            for segment in (0..layout.filaments).flat_map(segments_of) {
                for part in 0..layout.points {
                    let point = Place { segment, fraction: (part as f64 + 0.5) / layout.points as f64 };
                    for other in (0..layout.filaments).filter(|other| *other != layout.filament(segment)) {
                        let all = (0..layout.segments)
                            .map(|k| Near::on_segment(point, Node::new(other, k, layout.segments), &placed));
                        let nearest = all.min_by(|a, b| a.square().total_cmp(&b.square())).expect("segments");
                        expected.extend((nearest.square() < layout.reach * layout.reach).then_some(nearest));
                    }
                }
            }
            assert_eq!(found, expected);
            met += found.len();
        }
        assert!(met > 1000 && (1..20).contains(&rebuilt), "{met} contacts, built {rebuilt} times");
    }
}
