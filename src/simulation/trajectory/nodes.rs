//! Nodes of a filament at one end of a step, with bounds on their motion.

use crate::equations::linear::{dot, sub};
use crate::integrate::hermite::Knot;

/// Nodes at one time.
#[derive(Clone, Debug)]
pub(super) struct NodesAtTime {
    pub(super) knots: Vec<Knot<3>>,
    /// Their largest speed in m/s and acceleration in m/s².
    pub(super) speed: f64,
    pub(super) acceleration: f64,
    /// Lower bounds on the distances of the contacts from their events, in m; zero where nothing is
    /// known.
    pub(super) distances: Vec<f64>,
}

impl NodesAtTime {
    /// Creates the nodes in `knots`, without speed and without the distances of `contacts`
    /// contacts.
    pub(super) fn new(knots: Vec<Knot<3>>, contacts: usize) -> Self {
        Self {
            knots,
            speed: f64::INFINITY,
            acceleration: f64::INFINITY,
            distances: vec![0.0; contacts],
        }
    }

    /// Finds the largest speed and acceleration.
    pub(super) fn measure(&mut self) {
        let largest = |of: fn(&Knot<3>) -> [f64; 3]| {
            self.knots
                .iter()
                .map(of)
                .map(|vector| dot(vector, vector))
                .fold(0.0, f64::max)
                .sqrt()
        };
        (self.speed, self.acceleration) =
            (largest(|knot| knot.rate), largest(|knot| knot.acceleration));
    }

    /// Returns an upper bound in m on the way of a node from here in a step of the length `length`
    /// (s) to `end`. Within the step the node stays in the hull of its Bézier points (see
    /// [`crossing`](super::super::crossing)).
    pub(super) fn way_to(&self, end: &Self, length: f64) -> f64 {
        let square = |(start, end): (&Knot<3>, &Knot<3>)| {
            let way = sub(end.value, start.value);
            dot(way, way)
        };
        let straight = self
            .knots
            .iter()
            .zip(&end.knots)
            .map(square)
            .fold(0.0, f64::max)
            .sqrt();
        let hull = |nodes: &Self| length * (0.4 * nodes.speed + 0.05 * length * nodes.acceleration);
        hull(self).max(straight + hull(end))
    }
}
