//! Shape of a filament that turns with its tool and touches nothing.
//!
//! Radial filaments start relaxed. Others are bent outwards by centrifugal forces: they start in
//! the relative equilibrium, in which `V = E_spring − ½ ω² Σ ∫ρ² dm` is stationary (MODEL, "Rotary
//! tools of any kind and pose"). It is a static equilibrium of the same kernels under centrifugal
//! loads. The integrand is quadratic on a rigid segment, so Simpson's rule is exact: a sixth of the
//! mass at each end, the rest at the centre.

use std::f64::consts::{FRAC_PI_2, TAU};

use crate::equations::linear::{add, scale, zero};
use crate::equations::{
    Chain, ChainDynamics, Dynamics, LaneSet, NodeLoads, NodeMotion, NodeTangent, PointLoad,
    PointTangent, PolarAxis, StepWeights,
};
use crate::tool::{RotaryTool, Tool};

/// Angle of the tool at which the equilibrium is computed. Straight filaments then stay in the
/// plane across `x`, far from the poles of coordinates about `x`.
const EQUILIBRIUM_ANGLE_RAD: f64 = FRAC_PI_2;
/// Largest change of a coordinate, in rad, at which Newton's method has converged: in any case, and
/// where changes no longer halve.
const CONVERGED_CHANGE_RAD: f64 = 1e-14;
const STALLED_CHANGE_RAD: f64 = 1e-8;
/// Largest number of Newton iterations.
const MAX_ITERATIONS: usize = 500;

/// Shape of a filament that turns rigidly with its tool: polar angle `φ` of each segment, and
/// azimuth ahead of the tool, in rad.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct RigidShape {
    segments: Vec<[f64; 2]>,
    /// `true` if Newton's method has found an equilibrium.
    pub is_equilibrium: bool,
}

impl RigidShape {
    /// Computes the relative equilibrium of `chain` on `tool`, which turns at `rate` (rad/s),
    /// without gravity.
    ///
    /// Masses damp the first steps of Newton's method: `(M + w ∂²V) δ = ∂V`, with a weight `w` that
    /// grows as the forces fall.
    pub fn equilibrium(chain: &Chain<f64>, tool: &RotaryTool, rate: f64) -> Self {
        let chain = Chain {
            gravity: [0.0; 3],
            ..chain.clone()
        };
        let n = chain.segments();
        let axis = if chain.is_relaxed_straight() {
            PolarAxis::X
        } else {
            PolarAxis::Z
        };
        let clamp = tool.clamp(EQUILIBRIUM_ANGLE_RAD, 0.0);
        let none = [0.0; 2];
        let mut q: Vec<[f64; 2]> = chain
            .relaxed(tool.undeformed(EQUILIBRIUM_ANGLE_RAD, 0.0)[0])
            .map(|q| {
                let direction = PolarAxis::Z.direction([q, none, none]);
                axis.coordinates(direction)[0]
            })
            .collect();
        let rest = vec![[0.0; 2]; n];
        let loads = Centrifugal {
            square: rate * rate,
            masses: chain.links.iter().map(|link| link.mass).collect(),
        };
        let mut dynamics = Dynamics::new(chain);
        dynamics.set_chart(axis);
        let mut residual = rest.clone();
        // The square of a time in which the filament moves little at first.
        let (mut weight, mut before, mut last) =
            (rate.powi(-2).min(1.0), f64::INFINITY, f64::INFINITY);
        let mut is_equilibrium = false;
        for _ in 0..MAX_ITERATIONS {
            let at = clamp.holding(&q, &rest);
            dynamics.residual(at, &rest, &loads, &mut residual);
            let size = residual
                .as_flattened()
                .iter()
                .fold(0.0_f64, |largest, torque| largest.max(torque.abs()));
            if size > 0.0 {
                weight = (weight * (before / size).clamp(0.1, 1e3)).min(1e12);
            }
            before = size;
            let weights = StepWeights {
                coordinates: weight,
                rates: 0.0,
            };
            dynamics.factorise(at, &rest, &loads, weights, LaneSet::first(1));
            dynamics.solve(&mut residual);
            let mut change = 0.0_f64;
            for (q, correction) in q.iter_mut().zip(&residual) {
                for (q, correction) in q.iter_mut().zip(correction) {
                    *q -= weight * correction;
                    change = change.max((weight * correction).abs());
                }
            }
            if change <= CONVERGED_CHANGE_RAD
                || (change < STALLED_CHANGE_RAD && change > last / 2.0)
            {
                is_equilibrium = true;
                break;
            }
            last = change;
        }
        let shape = q.iter().map(|&q| {
            let [[x, y, z], ..] = axis.direction([q, none, none]);
            let azimuth = y.atan2(x) - EQUILIBRIUM_ANGLE_RAD;
            [x.hypot(y).atan2(z), azimuth - TAU * (azimuth / TAU).round()]
        });
        Self {
            segments: shape.collect(),
            is_equilibrium,
        }
    }

    /// Returns `true` if all segments are within 60° of the axis.
    pub fn is_axial(&self) -> bool {
        self.segments
            .iter()
            .all(|[polar, _]| polar.cos().abs() > 0.5)
    }

    /// Returns the coordinates about `z` at the `angle` of the tool (rad).
    pub fn at(&self, angle: f64) -> impl Iterator<Item = [f64; 2]> {
        self.segments
            .iter()
            .map(move |[polar, ahead]| [*polar, angle + ahead])
    }
}

/// Centrifugal forces on a chain, `ω² ρ` per mass: on its nodes, and at the centres of its
/// segments.
struct Centrifugal {
    /// `ω²` in 1/s².
    square: f64,
    /// Masses of the segments in kg.
    masses: Vec<f64>,
}

/// Share of a segment's mass at each of its ends.
const END_MASS_SHARE: f64 = 1.0 / 6.0;

impl Centrifugal {
    /// Returns the centrifugal force of a mass over its distance from the axis, in N/m.
    fn slope(&self, mass: f64) -> f64 {
        self.square * mass
    }

    fn at_node(&self, node: usize) -> f64 {
        self.slope(END_MASS_SHARE * (self.masses[node] + self.masses.get(node + 1).unwrap_or(&0.0)))
    }

    fn at_centre(&self, segment: usize) -> f64 {
        self.slope((1.0 - 2.0 * END_MASS_SHARE) * self.masses[segment])
    }
}

fn across_axis(slope: f64) -> NodeTangent<f64> {
    let position = [[slope, 0.0, 0.0], [0.0, slope, 0.0], [0.0; 3]];
    NodeTangent {
        position,
        velocity: [zero(); 3],
    }
}

impl NodeLoads<f64> for Centrifugal {
    fn loads_points(&self) -> bool {
        true
    }

    fn point_loads(&self, nodes: &dyn NodeMotion, add_load: &mut dyn FnMut(PointLoad<f64>)) {
        for segment in 0..self.masses.len() {
            let [[inner, _], [outer, _]] = [segment, segment + 1].map(|node| nodes.node(node, 0));
            let [x, y, _] = scale(0.5 * self.at_centre(segment), add(inner, outer));
            add_load(PointLoad {
                segment,
                fraction: 0.5,
                force: [x, y, 0.0],
            });
        }
    }

    fn point_tangents(&self, _: &dyn NodeMotion, add_tangent: &mut dyn FnMut(PointTangent<f64>)) {
        for segment in 0..self.masses.len() {
            // Half of the force acts on each end, and follows half of the motion of each.
            let quarter = across_axis(0.25 * self.at_centre(segment));
            add_tangent(PointTangent {
                segment,
                ends: [[quarter; 2]; 2],
            });
        }
    }

    fn force(&self, node: usize, [x, y, _]: [f64; 3], _: [f64; 3]) -> Option<[f64; 3]> {
        Some(scale(self.at_node(node), [x, y, 0.0]))
    }

    fn tangent(&self, node: usize, _: [f64; 3], _: [f64; 3]) -> Option<NodeTangent<f64>> {
        Some(across_axis(self.at_node(node)))
    }
}
