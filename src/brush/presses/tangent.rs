//! Tangents of the forces between filaments.

use super::super::field::{Changes, Field, GroupField, Matrix, NodeIndex};
use super::{Near, Press, PressLaw, Rub, identity};
use crate::equations::linear::{add, dot, product, scale, sub, transposed_product};

impl Press {
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
