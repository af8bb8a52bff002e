//! Contact of filaments with each other (docs/MODEL.md, "Filaments that touch").
//!
//! Filaments are capsules of radius `d/2` about their centrelines. Each integral of the energy is a
//! midpoint rule: every segment has `N_q` points, and each point is pressed off the nearest point
//! of the other filament's polyline. A force at a point of a segment acts on both its ends, in
//! proportion to their share of the point's displacement.
//!
//! Friction acts midway between both points, where the surfaces touch. So a brush that turns
//! rigidly does not rub, and in the plane the moments of both filaments balance. (In space a
//! segment takes no torque about itself.)

use super::field::{Changes, Field, FilamentPoint, GroupField, Matrix, NodeIndex, Nodes};
use crate::equations::linear::{
    add, dot, mul, mul_transposed, product, scale, sub, transposed_product,
};
use crate::model::settings::Settings;

/// Law of contact between filaments.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PressLaw {
    /// `k_l` in N/m².
    pub stiffness: f64,
    /// Hunt and Crossley's `χ` in s/m.
    pub damping: f64,
    /// Coefficient of friction.
    pub friction: f64,
    /// Sliding speed over which friction is regularised, in m/s.
    pub regularisation: f64,
}

impl PressLaw {
    /// Returns the law that `settings` state, or the default one.
    pub fn of(settings: &Settings) -> Self {
        let brush = settings.brush_or_default();
        Self {
            stiffness: brush.stiffness_n_m2,
            damping: brush.damping_s_m,
            friction: brush.friction_coefficient,
            regularisation: settings.contact.friction_regularisation_m_s,
        }
    }
}

/// Returns matrices from the velocities of both ends of a segment to that of a point that it
/// carries at `arm` (m) from `place`.
fn carried(place: &FilamentPoint, along: [f64; 3], arm: [f64; 3]) -> [Matrix; 2] {
    let (projection, square) = (dot(along, arm), dot(along, along));
    let turn: Matrix = std::array::from_fn(|i| {
        std::array::from_fn(|j| (identity(i, j) * projection - along[i] * arm[j]) / square)
    });
    let [inner, outer]: [Matrix; 2] = place
        .shares()
        .map(|share| std::array::from_fn(|i| std::array::from_fn(|j| share * identity(i, j))));
    [difference(&inner, &turn), sum(&outer, &turn)]
}

/// Point of a filament, and the nearest point of a segment of another filament.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Near {
    /// Point `x` of the rule.
    pub point: FilamentPoint,
    /// Nearest point `y`.
    pub nearest: FilamentPoint,
    /// `true` if `y` lies inside its segment, and not at an end.
    pub is_inside: bool,
    /// Segment of `y`, from its inner end to its outer end, in m.
    pub along: [f64; 3],
    /// Vector from `y` to `x` in m.
    pub offset: [f64; 3],
    /// Sum of the radii of both filaments there, in m.
    pub reach: f64,
    /// Periodic image of the other filament.
    pub image: i16,
}

impl Near {
    /// Finds the point of `segment` that is nearest to `point`.
    #[cfg(test)]
    pub fn on_segment(
        point: FilamentPoint,
        segment: NodeIndex,
        positions: &Field,
        reach: f64,
    ) -> Self {
        Self::between(
            point,
            point.of(positions),
            segment,
            [positions.at(segment), positions.at(segment.outer())],
            reach,
        )
    }

    /// Finds the nearest point to a point at `x` on a segment with the given ends, all in m.
    #[inline]
    pub fn between(
        point: FilamentPoint,
        x: [f64; 3],
        segment: NodeIndex,
        [inner, outer]: [[f64; 3]; 2],
        reach: f64,
    ) -> Self {
        let (along, from) = (sub(outer, inner), sub(x, inner));
        let at = dot(along, from) / dot(along, along);
        let fraction = at.clamp(0.0, 1.0);
        let offset = sub(from, scale(fraction, along));
        Self {
            point,
            nearest: FilamentPoint { segment, fraction },
            is_inside: fraction == at,
            along,
            offset,
            reach,
            image: 0,
        }
    }

    /// Returns the vectors turned about `z` by an angle of this sine and cosine.
    #[inline]
    pub fn turned(self, (sin, cos): (f64, f64)) -> Self {
        let turned = |[x, y, z]: [f64; 3]| [cos * x - sin * y, sin * x + cos * y, z];
        Self {
            along: turned(self.along),
            offset: turned(self.offset),
            ..self
        }
    }

    /// Returns a key of the point among those of one filament near another: periodic image of the
    /// other, place of the point.
    #[inline]
    pub fn key(&self) -> (i16, (NodeIndex, u64)) {
        (self.image, self.point.key())
    }

    /// Returns `true` if the point presses on the segment.
    #[inline]
    pub fn is_within_reach(&self) -> bool {
        self.square() < self.reach * self.reach
    }

    /// Returns the squared distance in m².
    #[inline]
    pub fn square(&self) -> f64 {
        dot(self.offset, self.offset)
    }
}

/// A point of one filament that presses on another.
#[derive(Clone, Debug, PartialEq)]
pub struct Press {
    /// Points.
    pub near: Near,
    /// Unit vector from `y` to `x`.
    normal: [f64; 3],
    /// Distance from `y` to `x` in m.
    distance: f64,
    /// Overlap `d − distance` in m.
    overlap: f64,
    /// `½ k_l Δs` in N/m.
    stiffness: f64,
    /// `max(0, 1 + χ δ̇)`.
    rate_factor: f64,
    /// Normal force in N.
    pub normal_force: f64,
    /// Power that damping and friction dissipate, in W.
    pub dissipated: f64,
    rub: Option<Box<Rub>>,
}

/// Friction of a press.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Rub {
    /// Matrices from the velocities of the ends of both segments to that of the surface of `x`'s
    /// filament relative to the other.
    carried: [Matrix; 4],
    /// Part of this velocity across the normal in m/s.
    sliding: [f64; 3],
    /// Regularised sliding speed in m/s.
    speed: f64,
    /// Friction on `x`'s filament in N.
    force: [f64; 3],
    /// Direction of sliding as an unknown of Newton's method; see [`Press::follow`].
    direction: [f64; 3],
}

impl Press {
    /// Computes the press of a point that is within reach of another filament, and stands for
    /// `length` (m) of its segment.
    #[inline(always)]
    pub fn new(
        law: &PressLaw,
        near: &Near,
        length: f64,
        Nodes {
            positions,
            velocities,
        }: &Nodes,
    ) -> Self {
        let distance = near.square().sqrt();
        let normal = scale(1.0 / distance, near.offset);
        let (overlap, stiffness) = (near.reach - distance, 0.5 * law.stiffness * length);
        let mut press = Self {
            near: *near,
            normal,
            distance,
            overlap,
            stiffness,
            rate_factor: 1.0,
            normal_force: stiffness * overlap,
            dissipated: 0.0,
            rub: None,
        };
        if law.damping > 0.0 {
            let rate = -dot(
                normal,
                sub(near.point.of(velocities), near.nearest.of(velocities)),
            );
            press.rate_factor = (1.0 + law.damping * rate).max(0.0);
            press.normal_force *= press.rate_factor;
            press.dissipated = (press.normal_force - stiffness * overlap) * rate;
        }
        if law.friction > 0.0 {
            let segment = near.point.segment;
            let (own, half) = (
                sub(positions.at(segment.outer()), positions.at(segment)),
                scale(0.5, near.offset),
            );
            let [a, b] = carried(&near.point, own, scale(-1.0, half));
            let [c, d] =
                carried(&near.nearest, near.along, half).map(|matrix| scaled(-1.0, &matrix));
            let carried = [a, b, c, d];
            let relative = press
                .nodes()
                .iter()
                .zip(&carried)
                .fold([0.0; 3], |sum, (&node, matrix)| {
                    add(sum, mul(matrix, velocities.at(node)))
                });
            let sliding = sub(relative, scale(dot(normal, relative), normal));
            let speed = (dot(sliding, sliding) + law.regularisation.powi(2)).sqrt();
            let direction = scale(1.0 / speed, sliding);
            let force = scale(-law.friction * press.normal_force, direction);
            press.dissipated -= dot(force, sliding);
            press.rub = Some(Box::new(Rub {
                carried,
                sliding,
                speed,
                force,
                direction,
            }));
        }
        press
    }

    /// Updates the direction of sliding for the tangent from the iteration before, in which the
    /// point had the press `before`.
    ///
    /// Friction changes its sign over so small a speed that Newton’s method would oscillate across
    /// it. Therefore the direction `w` is an unknown of its own, with the equation `|v|_reg w = v`
    /// (Chan, Golub and Mulet 1999). Its linearisation about `before` gives `w` here. The tangent
    /// has `(I − w vᵀ/|v|_reg)/|v|_reg`. The force is that of `v` alone: solutions do not depend on
    /// `w`.
    pub fn follow(&mut self, before: &Self) {
        let (Some(rub), Some(before)) = (&mut self.rub, &before.rub) else {
            return;
        };
        let along = dot(before.sliding, sub(rub.sliding, before.sliding)) / before.speed;
        let direction = scale(
            1.0 / before.speed,
            sub(rub.sliding, scale(along, before.direction)),
        );
        let size = dot(direction, direction).sqrt();
        rub.direction = scale(1.0 / size.max(1.0), direction);
    }

    /// Returns the ends of both segments among all nodes: those of `x`'s, then those of `y`'s.
    fn nodes(&self) -> [NodeIndex; 4] {
        let (point, nearest) = (self.near.point.segment, self.near.nearest.segment);
        [point, point.outer(), nearest, nearest.outer()]
    }

    /// Returns the share of each end in the motion of `x − y`.
    fn shares(&self) -> [f64; 4] {
        let ([a, b], [c, d]) = (self.near.point.shares(), self.near.nearest.shares());
        [a, b, -c, -d]
    }

    /// Returns the force on `x`'s filament in N.
    pub fn force(&self) -> [f64; 3] {
        let normal = scale(self.normal_force, self.normal);
        self.rub
            .as_ref()
            .map_or(normal, |rub| add(normal, rub.force))
    }

    /// Adds the force on `x`'s filament.
    #[inline]
    pub fn load_point(&self, forces: &mut GroupField<'_>) {
        self.near
            .point
            .load(scale(self.normal_force, self.normal), forces);
        self.rub_ends(0, self.near.point.segment, forces);
    }

    /// Adds the force on `y`'s filament.
    #[inline]
    pub fn load_nearest(&self, forces: &mut GroupField<'_>) {
        self.near
            .nearest
            .load(scale(-self.normal_force, self.normal), forces);
        self.rub_ends(2, self.near.nearest.segment, forces);
    }

    /// Adds the friction on both ends of a segment; `first` is the number of its inner end.
    #[inline]
    fn rub_ends(&self, first: usize, segment: NodeIndex, forces: &mut GroupField<'_>) {
        let Some(Rub { carried, force, .. }) = self.rub.as_deref() else {
            return;
        };
        forces.add(segment, mul_transposed(&carried[first], *force));
        forces.add(segment.outer(), mul_transposed(&carried[first + 1], *force));
    }

    /// Returns the energy stored in J: `½ · ½ k_l Δs ⟨d − r⟩²`.
    pub fn energy(&self) -> f64 {
        0.5 * self.stiffness * self.overlap * self.overlap
    }

    /// Returns the tangent of the forces by the accelerations of the ends, for their weights `w_q`
    /// in positions and `w_v` in velocities.
    #[inline(always)]
    pub fn tangent(&self, law: &PressLaw, weights: [f64; 2]) -> PressTangent {
        let [by_position, by_rate] = weights;
        let &Self {
            normal,
            distance,
            overlap,
            stiffness,
            rate_factor,
            ..
        } = self;
        let elastic = stiffness * overlap;
        let damping = if rate_factor > 0.0 { law.damping } else { 0.0 };
        // Fall of the normal force as `x` moves away from `y`.
        let fall = by_position * stiffness * rate_factor + by_rate * elastic * damping;
        // (I − n nᵀ)/r is the curvature of the distance from a fixed point.
        let across = by_position * elastic * rate_factor / distance;
        let shares = self.shares();
        let rub = self.rub.as_deref().map(
            |&Rub {
                 carried,
                 sliding,
                 speed,
                 direction,
                 ..
             }| {
                let viscous = law.friction * self.normal_force * by_rate / speed;
                let by_velocity: Matrix = std::array::from_fn(|i| {
                    std::array::from_fn(|j| {
                        let turning = direction[i] * sliding[j] / speed;
                        -viscous * (identity(i, j) - normal[i] * normal[j] - turning)
                    })
                });
                let by_normal = scale(law.friction * fall, direction);
                let by_end = |end: usize| {
                    let mut change = product(&by_velocity, &carried[end]);
                    for (row, by_normal) in change.iter_mut().zip(by_normal) {
                        *row = add(*row, scale(by_normal * shares[end], normal));
                    }
                    change
                };
                Box::new(RubTangent {
                    carried,
                    by_ends: std::array::from_fn(by_end),
                })
            },
        );
        let Near {
            point,
            nearest,
            is_inside,
            along,
            ..
        } = self.near;
        // The point `y` moves along its segment, which takes `g gᵀ r/|u|²` off the curvature of the
        // distance.
        let shifting = if is_inside {
            -across / dot(along, along)
        } else {
            0.0
        };
        let arm = scale(distance, normal);
        let [a, b, c, d] = shares.map(|share| scale(-share, along));
        let slopes = [a, b, add(c, arm), sub(d, arm)];
        let segments = [point.segment, nearest.segment];
        PressTangent {
            segments,
            shares,
            normal,
            across,
            along_normal: -(across + fall),
            shifting,
            slopes,
            rub,
        }
    }
}

/// Tangent of the forces of a press on the ends of both segments by the displacements of these
/// ends; see [`Press::tangent`].
#[derive(Clone, Debug)]
pub struct PressTangent {
    /// Segments of `x` and of `y`.
    pub segments: [NodeIndex; 2],
    /// See [`Press::shares`].
    shares: [f64; 4],
    normal: [f64; 3],
    /// Tangent of the force by the displacement of `x` relative to that of `y`: across the normal,
    /// and the addition along it.
    across: f64,
    along_normal: f64,
    /// Factor of `g gᵀ`, which is added to the tangent. At the ends of `y`'s segment `g` is `s u +
    /// r n` and `s' u − r n`, at those of `x`'s it is `−s u`, with the shares of the ends.
    shifting: f64,
    slopes: [[f64; 3]; 4],
    rub: Option<Box<RubTangent>>,
}

/// Tangent of friction.
#[derive(Clone, Copy, Debug)]
struct RubTangent {
    carried: [Matrix; 4],
    /// Tangent by the displacement of each end.
    by_ends: [Matrix; 4],
}

impl PressTangent {
    /// Returns the tangent of the force on the end `force` by the displacement of the end `motion`,
    /// of `x`'s segment first, then of `y`'s.
    #[inline(always)]
    fn block<const D: usize>(&self, force: usize, motion: usize) -> [[f64; D]; D] {
        let Self {
            shares,
            normal,
            across,
            along_normal,
            shifting,
            slopes,
            rub,
            ..
        } = self;
        let share = shares[force] * shares[motion];
        let (diagonal, along_normal) = (share * across, share * along_normal);
        let (on, by) = (slopes[force], slopes[motion]);
        let mut block: [[f64; D]; D] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                identity(i, j) * diagonal
                    + along_normal * normal[i] * normal[j]
                    + shifting * on[i] * by[j]
            })
        });
        if let Some(rub) = rub {
            let friction = transposed_product(&rub.carried[force], &rub.by_ends[motion]);
            for (row, friction) in block.iter_mut().zip(friction) {
                row.iter_mut()
                    .zip(friction)
                    .for_each(|(value, friction)| *value += friction);
            }
        }
        block
    }

    /// Adds the tangent of the forces on the ends of a segment, `x`'s (0) or `y`'s (1), by its own
    /// motion.
    #[inline(always)]
    pub fn add_changes<const D: usize>(&self, side: usize, changes: &mut Changes) {
        changes.add_blocks::<D>(self.segments[side], |force, motion| {
            self.block(2 * side + force, 2 * side + motion)
        });
    }
}

/// Tangent of the forces on the ends of one segment by the displacements of the ends of another, in
/// `D` dimensions.
#[derive(Clone, Debug)]
pub struct Coupling<const D: usize> {
    /// Segment with the forces, and segment that is displaced.
    pub segments: [NodeIndex; 2],
    /// Forces on both ends, by component of the displacement of either end.
    columns: [[[[f64; D]; 2]; D]; 2],
}

impl<const D: usize> Coupling<D> {
    /// Creates a zero tangent on the first of both `segments`.
    pub fn new(segments: [NodeIndex; 2]) -> Self {
        Self {
            segments,
            columns: [[[[0.0; D]; 2]; D]; 2],
        }
    }

    /// Adds the tangent of a press on `x`'s segment (0) or on `y`'s (1).
    #[inline(always)]
    pub fn add(&mut self, tangent: &PressTangent, side: usize) {
        for (motion, columns) in self.columns.iter_mut().enumerate() {
            for force in 0..2 {
                let block: [[f64; D]; D] = tangent.block(2 * side + force, 2 * (1 - side) + motion);
                for (i, row) in block.iter().enumerate() {
                    for (column, value) in columns.iter_mut().zip(row) {
                        column[force][i] += value;
                    }
                }
            }
        }
    }

    /// Adds the change of the forces by the `displacements` to `forces`.
    #[inline(always)]
    pub fn apply(&self, displacements: &Field, forces: &mut GroupField<'_>) {
        let [on, from] = self.segments;
        let mut sums = [[0.0; D]; 2];
        for (columns, displacement) in self.columns.iter().zip(ends(from, displacements)) {
            for (column, displacement) in columns.iter().zip(displacement) {
                for (sum, column) in sums.iter_mut().zip(column) {
                    for (sum, value) in sum.iter_mut().zip(column) {
                        *sum += value * displacement;
                    }
                }
            }
        }
        forces.add(on, sums[0]);
        forces.add(on.outer(), sums[1]);
    }
}

#[inline]
fn ends(segment: NodeIndex, field: &Field) -> [[f64; 3]; 2] {
    [field.at(segment), field.at(segment.outer())]
}

fn identity(row: usize, column: usize) -> f64 {
    f64::from(u8::from(row == column))
}

fn scaled(factor: f64, matrix: &Matrix) -> Matrix {
    matrix.map(|row| scale(factor, row))
}

fn sum(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|row| add(a[row], b[row]))
}

fn difference(a: &Matrix, b: &Matrix) -> Matrix {
    std::array::from_fn(|row| sub(a[row], b[row]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::equations::Lanewise;

    const LAW: PressLaw = PressLaw {
        stiffness: 6e7,
        damping: 0.1,
        friction: 0.2,
        regularisation: 1e-3,
    };
    const REACH: f64 = 1.2e-3;
    /// Two segments that cross, and the velocities of their ends.
    const POSITIONS: [[f64; 3]; 4] = [
        [0.0, 0.0, 0.0],
        [2e-3, 1e-4, 0.0],
        [8e-4, -9e-4, 1e-3],
        [1.1e-3, 9e-4, 1.2e-3],
    ];
    const VELOCITIES: [[f64; 3]; 4] = [
        [1.0, 0.2, 0.3],
        [0.8, -0.4, 0.7],
        [0.1, 0.5, -0.2],
        [-0.3, 0.2, 0.4],
    ];

    /// Returns the ends of the first segment and of the second, which are of two filaments.
    fn nodes() -> [NodeIndex; 4] {
        [(0, 0), (0, 1), (1, 0), (1, 1)].map(|(filament, k)| NodeIndex::new(filament, k, 1))
    }

    fn field(vectors: &[[f64; 3]; 4]) -> Field {
        let mut field = Field::new(1, 1);
        for (node, vector) in nodes().into_iter().zip(vectors) {
            field.set(node, *vector);
        }
        field
    }

    fn press(law: &PressLaw, positions: &[[f64; 3]; 4], velocities: &[[f64; 3]; 4]) -> Press {
        let (positions, velocities) = (field(positions), field(velocities));
        let [first, _, second, _] = nodes();
        let near = Near::on_segment(
            FilamentPoint {
                segment: first,
                fraction: 0.4,
            },
            second,
            &positions,
            REACH,
        );
        assert!(near.is_inside && near.square() < REACH * REACH);
        Press::new(
            law,
            &near,
            4e-4,
            &Nodes {
                positions,
                velocities,
            },
        )
    }

    /// Returns the forces that `load` adds.
    fn in_group(load: impl FnOnce(&mut GroupField<'_>)) -> [[f64; 3]; 4] {
        let mut field = Field::new(1, 1);
        load(&mut GroupField::new(0, 1, &mut field.0));
        nodes().map(|node| field.at(node))
    }

    fn forces(
        law: &PressLaw,
        positions: &[[f64; 3]; 4],
        velocities: &[[f64; 3]; 4],
    ) -> [[f64; 3]; 4] {
        let press = press(law, positions, velocities);
        in_group(|forces| {
            press.load_point(forces);
            press.load_nearest(forces);
        })
    }

    #[test]
    fn forces_are_the_gradient_of_the_energy() {
        let law = PressLaw {
            damping: 0.0,
            friction: 0.0,
            ..LAW
        };
        let forces = forces(&law, &POSITIONS, &VELOCITIES);
        let step = 1e-8;
        for end in 0..4 {
            for component in 0..3 {
                let energy = |by: f64| {
                    let mut positions = POSITIONS;
                    positions[end][component] += by;
                    press(&law, &positions, &VELOCITIES).energy()
                };
                let slope = (energy(step) - energy(-step)) / (2.0 * step);
                assert!((forces[end][component] + slope).abs() < 1e-6, "{forces:?}");
            }
        }
    }

    #[test]
    fn forces_and_moments_balance() {
        let in_plane = |vectors: [[f64; 3]; 4]| vectors.map(|[x, y, _]| [x, y, 0.0]);
        let beside = [
            [0.0, 0.0, 0.0],
            [2e-3, 1e-4, 0.0],
            [1e-4, 1e-3, 0.0],
            [2.1e-3, 1.2e-3, 0.0],
        ];
        // A segment takes no torque about itself, so that friction in space lacks the moment that
        // twists it.
        let smooth = PressLaw {
            friction: 0.0,
            ..LAW
        };
        for (law, positions, velocities) in [
            (smooth, POSITIONS, VELOCITIES),
            (LAW, beside, in_plane(VELOCITIES)),
        ] {
            let forces = forces(&law, &positions, &velocities);
            let force = forces.iter().fold([0.0; 3], |sum, force| add(sum, *force));
            let moment =
                forces
                    .iter()
                    .zip(positions)
                    .fold([0.0; 3], |sum, ([fx, fy, fz], [x, y, z])| {
                        add(sum, [y * fz - z * fy, z * fx - x * fz, x * fy - y * fx])
                    });
            assert!(
                dot(force, force).sqrt() < 1e-15 && dot(moment, moment).sqrt() < 1e-17,
                "{force:?} {moment:?}"
            );
        }
    }

    #[test]
    fn a_rigid_rotation_does_not_rub() {
        let spin = [3.0, -2.0, 5.0];
        let turning = POSITIONS.map(|[x, y, z]| {
            [
                spin[1] * z - spin[2] * y,
                spin[2] * x - spin[0] * z,
                spin[0] * y - spin[1] * x,
            ]
        });
        // A segment does not turn about itself: across it, the rotation is that of its ends.
        let planar = POSITIONS.map(|[x, y, _]| [x, y, 0.0]);
        let planar = [
            planar[0],
            planar[1],
            add(planar[0], [2e-4, 1.1e-3, 0.0]),
            add(planar[1], [-2e-4, 1.1e-3, 0.0]),
        ];
        let about_z = planar.map(|[x, y, _]| [-5.0 * y, 5.0 * x, 0.0]);
        assert!(press(&LAW, &planar, &about_z).dissipated.abs() < 1e-15);
        assert!(
            press(
                &PressLaw {
                    friction: 0.0,
                    ..LAW
                },
                &POSITIONS,
                &turning
            )
            .dissipated
            .abs()
                < 1e-12
        );
    }

    #[test]
    fn tangents_are_derivatives_of_the_forces() {
        let elastic = PressLaw {
            damping: 0.0,
            friction: 0.0,
            ..LAW
        };
        let damped = PressLaw {
            friction: 0.0,
            ..LAW
        };
        // A step by velocities alone leaves out the turn of the surfaces with the positions, as the
        // tangent does.
        for (law, weights) in [
            (elastic, [1.0, 0.0]),
            (damped, [0.0, 1.0]),
            (LAW, [0.0, 1.0]),
        ] {
            let tangent = press(&law, &POSITIONS, &VELOCITIES).tangent(&law, weights);
            let mut own = Changes::new(1);
            own.clear(0);
            let couplings = [0, 1].map(|side| {
                tangent.add_changes::<3>(side, &mut own);
                let mut coupling =
                    Coupling::<3>::new([tangent.segments[side], tangent.segments[1 - side]]);
                coupling.add(&tangent, side);
                coupling
            });
            let step = 1e-7;
            for end in 0..4 {
                for component in 0..3 {
                    let at = |by: f64| {
                        let (mut positions, mut velocities) = (POSITIONS, VELOCITIES);
                        positions[end][component] += weights[0] * by;
                        velocities[end][component] += weights[1] * by;
                        forces(&law, &positions, &velocities)
                    };
                    let (above, below) = (at(step), at(-step));
                    let mut moved = [[0.0; 3]; 4];
                    moved[end][component] = 1.0;
                    let mut change = in_group(|forces| {
                        couplings
                            .iter()
                            .for_each(|coupling| coupling.apply(&field(&moved), forces))
                    });
                    let (first, side) = (end / 2 * 2, end % 2);
                    for force in 0..2 {
                        let (_, blocks) = own.blocks().next().expect("a segment");
                        let block =
                            blocks[force][side].map(|row| row.map(|value| value.lane(first / 2)));
                        change[first + force] = add(change[first + force], mul(&block, moved[end]));
                    }
                    for (node, change) in change.iter().enumerate() {
                        for i in 0..3 {
                            let slope = (above[node][i] - below[node][i]) / (2.0 * step);
                            let scale = law.stiffness * 4e-4 * weights[0] + 1e3 * weights[1];
                            assert!(
                                (slope - change[i]).abs() < 1e-6 * scale,
                                "{slope} {change:?}"
                            );
                        }
                    }
                }
            }
        }
    }
}
