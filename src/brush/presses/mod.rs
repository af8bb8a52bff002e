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

mod near;
mod tangent;
#[cfg(test)]
mod tests;

use super::field::{FilamentPoint, GroupField, Matrix, NodeIndex, Nodes};
use crate::equations::linear::{add, dot, mul, mul_transposed, scale, sub};
use crate::model::settings::Settings;
pub use near::Near;
pub use tangent::{Coupling, PressTangent};

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
