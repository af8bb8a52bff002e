//! Evaluates the equations of motion at one state.

use bristle_codegen::ir::graph::NodeId;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::lagrange::{WholeEquations, whole_equations};
use serde::{Deserialize, Serialize};

use bristle::equations::{Chain, ChainDynamics, Clamp, Dynamics, NoLoads, PoleError};
use bristle::model::filament;
use bristle::model::settings::FilamentSettings;
use bristle::tool::radial_clamp;

/// A state of a filament on a round tool.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundToolState {
    /// Angle `β` of the brush body in rad.
    pub base_angle: f64,
    /// Its rate `ω` in rad/s.
    pub base_rate: f64,
    /// Its acceleration `β̈` in rad/s².
    pub base_acceleration: f64,
    /// Gravitational acceleration in m/s².
    pub gravity: [f64; 3],
    /// Coordinates `φ1, θ1, φ2, θ2, …` in rad.
    pub q: Vec<f64>,
    /// Their rates in rad/s.
    pub v: Vec<f64>,
}

/// Values of the equations at a state, without contact.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Evaluation {
    /// `M`, by rows, in kg m², from the whole equations.
    pub mass_matrix: Vec<Vec<f64>>,
    /// `q̈` in rad/s², from the O(n) recursion that the integrator uses.
    pub accelerations: Vec<f64>,
    /// `E_kin` in J.
    pub kinetic_energy_j: f64,
    /// `E_spring + E_grav` in J.
    pub potential_energy_j: f64,
    /// The dissipation function `D` in W.
    pub dissipation_w: f64,
    /// The tip `r_n` in m.
    pub tip_position_m: [f64; 3],
}

/// Error of a state that cannot be evaluated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum EvaluationError {
    /// The coordinates do not come in pairs, or the rates do not match them.
    #[error("q has {q} and v has {v} values; both need φ and θ for each segment")]
    Shape {
        /// Values in `q`.
        q: usize,
        /// Values in `v`.
        v: usize,
    },
    /// A segment is parallel to the tool axis.
    #[error(transparent)]
    Pole(#[from] PoleError),
    /// The equations have no finite solution there.
    #[error(
        "the equations have no finite solution at this state: is a joint folded back on itself, or a number extremely large or small?"
    )]
    NotFinite,
}

/// Evaluates the equations of a filament on a round tool with the body radius `body_radius` (m).
///
/// The state determines the number of segments.
///
/// # Errors
/// If the state has the wrong shape, a segment is at a pole of its coordinates, or the equations
/// are singular for another reason.
pub fn evaluate(
    filament: &FilamentSettings,
    body_radius: f64,
    state: &RoundToolState,
) -> Result<Evaluation, EvaluationError> {
    let (q, v) = (pairs(&state.q), pairs(&state.v));
    if q.is_empty() || 2 * q.len() != state.q.len() || state.q.len() != state.v.len() {
        return Err(EvaluationError::Shape {
            q: state.q.len(),
            v: state.v.len(),
        });
    }
    let filament = FilamentSettings {
        segments: q.len(),
        ..filament.clone()
    };
    let chain = filament::chain(&filament, state.gravity);
    let clamp = radial_clamp(
        body_radius,
        state.base_angle,
        state.base_rate,
        state.base_acceleration,
    );

    let mut dynamics = Dynamics::new(chain.clone());
    dynamics.check_poles(&q)?;
    let mut accelerations = vec![[0.0; 2]; q.len()];
    dynamics.accelerations(clamp.holding(&q, &v), &NoLoads, &mut accelerations);
    let whole = whole_equations(q.len(), Motion::Spatial);
    let values = whole
        .graph
        .evaluate(&symbol_values(&whole, &chain, &clamp, &q, &v));
    let at = |node: &NodeId| values[node.index()];
    let evaluation = Evaluation {
        mass_matrix: whole
            .mass_matrix
            .iter()
            .map(|row| row.iter().map(at).collect())
            .collect(),
        accelerations: accelerations.into_flattened(),
        kinetic_energy_j: at(&whole.kinetic_energy),
        potential_energy_j: at(&whole.spring_energy) + at(&whole.gravity_energy),
        dissipation_w: at(&whole.dissipation),
        tip_position_m: whole.tip.each_ref().map(at),
    };
    let scalars = [
        evaluation.kinetic_energy_j,
        evaluation.potential_energy_j,
        evaluation.dissipation_w,
    ];
    let vectors = evaluation
        .accelerations
        .iter()
        .chain(&evaluation.tip_position_m)
        .chain(&scalars);
    let finite = vectors
        .chain(evaluation.mass_matrix.iter().flatten())
        .all(|value| value.is_finite());
    if finite {
        Ok(evaluation)
    } else {
        Err(EvaluationError::NotFinite)
    }
}

fn pairs(values: &[f64]) -> Vec<[f64; 2]> {
    values.as_chunks().0.to_vec()
}

/// The values of all symbols of `whole`, for motion in space or in the plane, by symbol index.
///
/// # Panics
/// If the chain, `q` or `v` differs from `whole` in the number of segments.
pub fn symbol_values(
    whole: &WholeEquations,
    chain: &Chain<f64>,
    clamp: &Clamp<f64>,
    q: &[[f64; 2]],
    v: &[[f64; 2]],
) -> Vec<f64> {
    let graph = &whole.graph;
    let mut values = vec![0.0; graph.symbols().len()];
    let mut set = |node: NodeId, value: f64| {
        if let bristle_codegen::ir::graph::Node::Symbol(symbol) = graph.node(node) {
            values[symbol.index()] = value;
        }
    };
    let symbols = &whole.parameters;
    for ((body, hinge), link) in symbols.bodies.iter().zip(&symbols.hinges).zip(&chain.links) {
        set(body.length, chain.length);
        set(body.mass, link.mass);
        set(body.inertia, link.inertia);
        set(hinge.stiffness, link.stiffness);
        set(hinge.damping, link.damping);
        set(hinge.relaxed_angle, link.relaxed_angle.angle());
    }
    let vectors = [
        (symbols.gravity, chain.gravity),
        (whole.clamp.position, clamp.position),
        (whole.clamp.velocity, clamp.velocity),
        (whole.clamp.acceleration, clamp.acceleration),
        (whole.clamp.direction, clamp.direction),
        (whole.clamp.direction_rate, clamp.direction_rate),
        (whole.clamp.angular_velocity, clamp.angular_velocity),
    ];
    for (symbols, components) in vectors {
        for (symbol, component) in symbols.into_iter().zip(components) {
            set(symbol, component);
        }
    }
    for (k, segment) in whole.segments.iter().enumerate() {
        for i in 0..2 {
            set(segment.coordinates()[i], q[k][i]);
            set(segment.rates()[i], v[k][i]);
        }
    }
    values
}
