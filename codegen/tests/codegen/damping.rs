//! Is it physics? Dampers see the filament from the brush body.

use bristle_codegen::ir::graph::NodeId;
use bristle_codegen::model::chain::Motion;
use bristle_codegen::model::lagrange::{WholeEquations, whole_equations};
use fastrand::Rng;

type Vec3 = [f64; 3];

fn cross(a: Vec3, b: Vec3) -> Vec3 {
    std::array::from_fn(|i| a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3])
}

fn dot(a: Vec3, b: Vec3) -> f64 {
    (0..3).map(|i| a[i] * b[i]).sum()
}

/// `e`, `∂e/∂φ` and `∂e/∂θ`.
fn frame([phi, theta]: [f64; 2]) -> [Vec3; 3] {
    let ((sin_phi, cos_phi), (sin_theta, cos_theta)) = (phi.sin_cos(), theta.sin_cos());
    [
        [sin_phi * cos_theta, sin_phi * sin_theta, cos_phi],
        [cos_phi * cos_theta, cos_phi * sin_theta, -sin_phi],
        [-sin_phi * sin_theta, sin_phi * cos_theta, 0.0],
    ]
}

/// The rates of a segment that turns rigidly with a body.
fn rigid_rates(q: [f64; 2], turning: Vec3) -> [f64; 2] {
    let [direction, by_phi, by_theta] = frame(q);
    let rate = cross(turning, direction);
    [
        dot(rate, by_phi),
        dot(rate, by_theta) / dot(by_theta, by_theta),
    ]
}

/// `D` with unit dampings, from directions alone.
fn dissipation(q: &[[f64; 2]], v: &[[f64; 2]], turning: Vec3) -> f64 {
    let (mut sum, mut inner) = (0.0, [0.0; 3]);
    for (&q, v) in q.iter().zip(v) {
        let [direction, by_phi, by_theta] = frame(q);
        let rigid = cross(turning, direction);
        let outer = cross(
            direction,
            std::array::from_fn(|i| v[0] * by_phi[i] + v[1] * by_theta[i] - rigid[i]),
        );
        let relative: Vec3 = std::array::from_fn(|i| outer[i] - inner[i]);
        sum += 0.5 * dot(relative, relative);
        inner = outer;
    }
    sum
}

/// The values of all nodes, with every symbol that is not stated at one.
fn values(whole: &WholeEquations, q: &[[f64; 2]], v: &[[f64; 2]], turning: Vec3) -> Vec<f64> {
    let symbols = whole.graph.symbols();
    let mut point = vec![1.0; symbols.len()];
    let mut set = |node: NodeId, value: f64| {
        let name = whole.graph.symbol_name(node).expect("it is a symbol");
        let index = symbols
            .iter()
            .position(|symbol| symbol.name == name)
            .expect("it has an index");
        point[index] = value;
    };
    for (k, segment) in whole.segments.iter().enumerate() {
        for i in 0..2 {
            set(segment.coordinates()[i], q[k][i]);
            set(segment.rates()[i], v[k][i]);
        }
    }
    whole
        .clamp
        .angular_velocity
        .into_iter()
        .zip(turning)
        .for_each(|(node, value)| set(node, value));
    whole.graph.evaluate(&point)
}

#[test]
fn a_filament_that_turns_rigidly_with_the_body_dissipates_nothing_and_any_other_by_the_formula() {
    // Some hundred roundings of rates of order one, near a pole of ten.
    const TOLERANCE: f64 = 1e-12;
    let mut rng = Rng::with_seed(9);
    for segments in [1, 2, 3, 5] {
        let mut whole = whole_equations(segments, Motion::Spatial);
        let damping = whole.parts().damping;
        for _ in 0..200 {
            let mut between = |low: f64, high: f64| low + (high - low) * rng.f64();
            let turning = [0; 3].map(|_| between(-2.0, 2.0));
            let q: Vec<[f64; 2]> = (0..segments)
                .map(|_| [between(0.2, 2.9), between(-3.0, 3.0)])
                .collect();
            let v: Vec<[f64; 2]> = (0..segments)
                .map(|_| [between(-2.0, 2.0), between(-2.0, 2.0)])
                .collect();
            let found = values(&whole, &q, &v, turning)[whole.dissipation.index()];
            let expected = dissipation(&q, &v, turning);
            assert!(
                (found - expected).abs() <= TOLERANCE * expected.max(1.0),
                "{found} {expected}"
            );

            let rigid: Vec<[f64; 2]> = q.iter().map(|&q| rigid_rates(q, turning)).collect();
            let at = values(&whole, &q, &rigid, turning);
            let torques = damping.iter().map(|node| at[node.index()]);
            for lost in torques.chain([at[whole.dissipation.index()]]) {
                assert!(lost.abs() <= TOLERANCE, "{lost:e}");
            }
        }
    }
}
