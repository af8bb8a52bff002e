//! Equilibria of a clamped chain, by Newton's method on the solver's own equations and step matrix.

use std::f64::consts::FRAC_PI_2;

use bristle::equations::{
    Chain, ChainDynamics, Dynamics, LaneSet, NodeLoads, NodeTangent, StepWeights,
};
use bristle::tool::ClampMotion;

use super::chains::{WALL, worse};
use super::trial::Failure;

/// The load on the chain, in addition to its weight.
#[derive(Clone, Copy, Debug, Default)]
pub struct Load {
    /// Dead force on the tip.
    pub force: [f64; 3],
    /// Moment about `z` on the last segment, for a chain in the plane perpendicular to `z`.
    pub moment: f64,
}

/// A chain at rest.
#[derive(Clone, Debug)]
pub struct RestingChain {
    /// Position of its tip.
    pub tip: [f64; 3],
    /// Positions of its nodes, from the root to the tip.
    pub nodes: Vec<[f64; 3]>,
    /// Polar angle and azimuth of its last segment.
    pub last: [f64; 2],
}

/// A force on the tip.
struct TipForce {
    node: usize,
    force: [f64; 3],
}

impl NodeLoads<f64> for TipForce {
    fn force(&self, node: usize, _: [f64; 3], _: [f64; 3]) -> Option<[f64; 3]> {
        (node == self.node).then_some(self.force)
    }

    fn tangent(&self, _: usize, _: [f64; 3], _: [f64; 3]) -> Option<NodeTangent<f64>> {
        None
    }
}

/// The shape of `chain`, clamped along `x`, under `load` and its weight, both applied in `parts`
/// equal increments to its relaxed shape.
///
/// # Errors
/// If Newton's method does not converge.
pub fn equilibrium(chain: Chain<f64>, load: Load, parts: usize) -> Result<RestingChain, Failure> {
    let n = chain.segments();
    let reach = chain.length * (n * n) as f64;
    let (clamp, rest) = (WALL.at(0.0), vec![[0.0; 2]; n]);
    let azimuths = chain.links.iter().scan(0.0, |azimuth, link| {
        *azimuth += link.relaxed_angle.angle();
        Some(*azimuth)
    });
    let mut q: Vec<[f64; 2]> = azimuths.map(|azimuth| [FRAC_PI_2, azimuth]).collect();
    let mass = chain.links.iter().map(|link| link.mass).fold(0.0, f64::max);
    let stiffness = chain
        .links
        .iter()
        .map(|link| link.stiffness)
        .fold(f64::INFINITY, f64::min);
    let mut dynamics = Dynamics::new(chain.clone());
    for part in 1..=parts {
        let share = part as f64 / parts as f64;
        let gravity = chain.gravity.map(|component| share * component);
        dynamics = Dynamics::new(Chain {
            gravity,
            ..chain.clone()
        });
        let tip = TipForce {
            node: n - 1,
            force: load.force.map(|component| share * component),
        };
        let mut converged = false;
        for _ in 0..60 {
            let mut change = rest.clone();
            dynamics.residual(clamp.holding(&q, &rest), &rest, &tip, &mut change);
            change[n - 1][1] -= share * load.moment;
            // The step is so long, compared with the periods of the chain, that the step matrix
            // reduces to the stiffness.
            let weights = StepWeights {
                coordinates: 1e10 * mass / stiffness * reach * reach,
                rates: 0.0,
            };
            dynamics.factorise(
                clamp.holding(&q, &rest),
                &rest,
                &tip,
                weights,
                LaneSet::first(1),
            );
            dynamics.solve(&mut change);
            let mut largest = 0.0;
            for (q, change) in q.as_flattened_mut().iter_mut().zip(change.as_flattened()) {
                let change = weights.coordinates * change;
                largest = worse(change.abs(), largest);
                *q -= change.clamp(-0.2, 0.2);
            }
            // The remaining change comes from rounding in the torques, which grows with n².
            converged = largest < 1e-13 * (n * n) as f64;
            if largest < 1e-14 {
                break;
            }
        }
        if !converged {
            return Err("no equilibrium was found".into());
        }
    }
    dynamics.place(clamp.holding(&q, &rest));
    let nodes = dynamics.positions().to_vec();
    Ok(RestingChain {
        tip: nodes[n - 1],
        nodes,
        last: q[n - 1],
    })
}
