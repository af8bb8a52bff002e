//! Points of filaments near segments of other filaments.

#[cfg(test)]
use super::super::field::Field;
use super::super::field::{FilamentPoint, NodeIndex};
use crate::equations::linear::{dot, scale, sub};

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
