//! Accepted steps, between whose ends the motion is interpolated.

use super::filament::{Filament, Touch};
use super::system::FilamentState;
use super::system::integral::COUNT;
use crate::equations::linear::{add, scale};
use crate::equations::{Clamp, PolarAxis};
use crate::integrate::hermite::{Knot, Weights};
use crate::tool::ClampMotion;
use crate::workpiece::Workpiece;

/// Accepted step, as observers receive it.
#[derive(Debug)]
pub struct Step<'a> {
    /// State at the start.
    pub start: &'a FilamentState,
    /// State at the end.
    pub end: &'a FilamentState,
    /// Nodes at the start.
    pub start_nodes: &'a [Knot<3>],
    /// Nodes at the end.
    pub end_nodes: &'a [Knot<3>],
    /// Contacts that are closed throughout: contacts of nodes, then contacts with edges
    /// ([`Filament::touch`]).
    pub closed: &'a [bool],
    /// Segment of each contact with an edge at the start.
    pub starts: &'a [usize],
}

impl Step<'_> {
    /// Returns the length in s.
    pub fn length(&self) -> f64 {
        self.end.time - self.start.time
    }

    /// Returns the time at the fraction `s` of the step.
    pub fn time(&self, s: f64) -> f64 {
        self.start.time + s * self.length()
    }

    /// Returns position and velocity of `node` at the fraction `s` of the step.
    pub fn node(&self, node: usize, s: f64) -> ([f64; 3], [f64; 3]) {
        self.node_at(node, &self.weights(s))
    }

    /// Returns the weights of both ends at the fraction `s` of the step.
    pub(super) fn weights(&self, s: f64) -> Weights {
        Weights::new(self.length(), s)
    }

    /// Returns position and velocity of `node` at the place of the `weights`.
    pub(super) fn node_at(&self, node: usize, weights: &Weights) -> ([f64; 3], [f64; 3]) {
        weights.interpolate(&self.start_nodes[node], &self.end_nodes[node])
    }

    /// Returns the nodes of the filament at the fraction `s` of the step, by their number from the
    /// root.
    pub fn nodes<M: ClampMotion, W>(
        &self,
        filament: &Filament<M, W>,
        s: f64,
    ) -> impl Fn(usize) -> [[f64; 3]; 2] {
        let weights = self.weights(s);
        move |index| match index.checked_sub(1) {
            None => root(filament, self.time(s)),
            Some(node) => self.node_at(node, &weights).into(),
        }
    }

    /// Returns the rise of an integral of the motion, by its index, in the step.
    pub(super) fn integrated(&self, kind: usize) -> f64 {
        self.end.integrals[kind] - self.start.integrals[kind]
    }

    /// Returns the closed contacts, by index.
    pub(super) fn contacts(&self) -> impl Iterator<Item = usize> {
        (0..self.closed.len()).filter(|&contact| self.closed[contact])
    }

    /// Returns `contact` at the fraction `s` of the step.
    pub fn touch<M: ClampMotion, W: Workpiece>(
        &self,
        filament: &Filament<M, W>,
        contact: usize,
        s: f64,
    ) -> Touch {
        let start = contact
            .checked_sub(self.start_nodes.len())
            .map(|edge| self.starts[edge]);
        filament.touch(contact, &self.nodes(filament, s), start, self.time(s))
    }

    /// Returns the polar axis of the coordinates, which is constant in the step.
    pub fn chart(&self) -> PolarAxis {
        self.start.chart
    }

    /// Writes coordinates and rates at the fraction `s` of the step, about [`Step::chart`], into
    /// `q` and `v`.
    pub fn coordinates(&self, s: f64, q: &mut [[f64; 2]], v: &mut [[f64; 2]]) {
        let knot = |state: &FilamentState, k: usize| Knot {
            value: state.q[k],
            rate: state.v[k],
            acceleration: state.accelerations[k],
        };
        let weights = self.weights(s);
        for k in 0..self.start.q.len() {
            (q[k], v[k]) = weights.interpolate(&knot(self.start, k), &knot(self.end, k));
        }
    }

    /// Returns the integrals at the fraction `s` of the step (cubic Hermite interpolation).
    pub fn integrals(&self, s: f64) -> [f64; COUNT] {
        let (length, start, end) = (self.length(), self.start, self.end);
        std::array::from_fn(|i| {
            let rise = end.integrals[i] - start.integrals[i];
            let (early, late) = (length * start.rates[i], length * end.rates[i]);
            let bend = (1.0 - s) * (early - rise) + s * (rise - late);
            start.integrals[i] + s * rise + s * (1.0 - s) * bend
        })
    }
}

/// Returns position and velocity of the root at `time`.
fn root<M: ClampMotion, W>(filament: &Filament<M, W>, time: f64) -> [[f64; 3]; 2] {
    let Clamp {
        position, velocity, ..
    } = filament.motion.at(time);
    [position, velocity]
}

/// Returns the nodes of a filament, by their number from the root, `back` (s) before they are at
/// `knots` at `time`.
pub(super) fn at_knots<M: ClampMotion, W>(
    filament: &Filament<M, W>,
    knots: &[Knot<3>],
    time: f64,
    back: f64,
) -> impl Fn(usize) -> [[f64; 3]; 2] {
    move |index| match index.checked_sub(1) {
        None => root(filament, time - back),
        Some(node) => {
            let Knot {
                value,
                rate,
                acceleration,
            } = knots[node];
            [
                add(value, scale(-back, rate)),
                add(rate, scale(-back, acceleration)),
            ]
        }
    }
}
